"""Run by a second Blender on a copy of the scene: bakes named objects with Cycles at growing samples, two seeds each.

    blender -b COPY.blend --python cycles_script.py -- FOLDER SAMPLES NAME ...
    python cycles_script.py -- FOLDER SAMPLES NAME ...        (the bpy wheel; COPY.blend lies in FOLDER)

Writes FOLDER/<samples>.npz when a step is done: corners' irradiance / pi of each object and seed, wall and CPU
seconds, peak: MB, NaN where the system cannot tell.
"""

import os
import sys
import time

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))  # the extension is not installed where this runs

from peak_memory import added_megabytes, count_anew  # noqa: E402

ATTRIBUTE = "PDM Cycles"
BOUNCES = 1024


def set_up(names):
    """Cycles on the CPU without clamping or early ends, as exact as its bake gets, and the objects selected."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.bake.target = "VERTEX_COLORS"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_light_tree = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.film_exposure, cycles.use_fast_gi = 1.0, False
    for obj in bpy.context.view_layer.objects:
        obj.select_set(False)
    for name in names:
        obj = bpy.data.objects[name]
        obj.hide_viewport = False
        obj.hide_set(False)
        colours = obj.data.color_attributes
        if ATTRIBUTE in colours:
            colours.remove(colours[ATTRIBUTE])
        colours.active_color = colours.new(ATTRIBUTE, "FLOAT_COLOR", "CORNER")
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj


def bake(names, samples, seed):
    """{name: (corners, 3)} irradiance / pi; CPU and wall seconds."""
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.seed = samples, seed
    cpu, wall = time.process_time(), time.perf_counter()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    found = {}
    for name in names:
        data = bpy.data.objects[name].data.color_attributes[ATTRIBUTE].data
        values = np.empty(4 * len(data), np.float32)
        data.foreach_get("color", values)
        found[name] = values.reshape(-1, 4)[:, :3]
    return found, cpu, wall


def main(folder, samples, *names):
    if not bpy.data.filepath:
        bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "copy.blend"))
    set_up(names)
    bake(names, 1, 0)  # the first one builds kernels and the scene
    for count in (int(n) for n in samples.split(",")):
        held = count_anew()
        (one, cpu, wall), (other, again, rewall) = bake(names, count, 1), bake(names, count, 2)
        arrays = {f"{seed}:{k}": v[name] for k, name in enumerate(names) for seed, v in ((1, one), (2, other))}
        path, peak = os.path.join(folder, f"{count}.npz"), added_megabytes(held)
        peak = np.nan if peak is None else peak
        np.savez(f"{path}.part.npz", seconds=[(wall + rewall) / 2, (cpu + again) / 2], peak=peak, **arrays)
        os.replace(f"{path}.part.npz", path)


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1 :])
