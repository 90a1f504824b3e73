"""CPU time to a given error: our bake beside Cycles' vertex bake of the same meshes, in the same run.

    PYTHON_WITH_BPY tests/benchmarks/beside_cycles.py [OUTPUT.json [VERTICES ...]]

Cycles bakes DIFFUSE, DIRECT and INDIRECT without COLOR (irradiance / pi) into colour attributes of the point domain:
bounces without end, no adaptive sampling, no clamping, light tree off, two threads. Its error is its noise alone, from
two seeds (the tessellation's bias comes on top), fitted as noise^2 = a / samples and CPU seconds = b + c samples.
Ours is the difference to a run at TIGHT. Both are relative L2 errors of rho times irradiance over the objects' areas.
Two ratios of CPU seconds: where our stated error is the level, which is what a user asks for, and where our measured
error is at most the level, as Cycles' is: the quickest of the runs at TARGETS that is so good.
"""

import sys
import time

import bpy
import numpy as np
from output import machine, save
from rooms import ROOMS, load
from scenes import thirteen_spheres

from pdm_core import Mesh, Plane, solve

SAMPLES = (1, 4, 16, 64, 256)
LEVELS = (0.05, 0.01, 0.003)
TARGETS = (0.1, 0.05, 0.03, 0.02, 0.015, 0.01, 0.0075, 0.005, 0.003)  # of ours, LEVELS among them
TIGHT = 0.0015
MOST = 1 << 19  # vertices times samples of one bake


def scenes():
    """Yield (name, Scene, its surfaces that become objects)."""
    for name in ROOMS:
        _, scene, front = load(name)
        yield name, scene, front
    scene = thirteen_spheres()
    yield "thirteen_spheres", scene, np.arange(len(scene))


def material(surface, back):
    """Diffuse on both sides, emission on the front."""
    made = bpy.data.materials.new(surface.name)
    if not made.node_tree:
        made.use_nodes = True  # deprecated where it is always so
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    diffuse, emission = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeEmission")
    add, output = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*surface.reflectance, 1.0)
    strongest = max(surface.emission.max(), 1e-30)
    emission.inputs["Color"].default_value = (*(surface.emission / strongest), 1.0)
    emission.inputs["Strength"].default_value = strongest if surface.emission.any() else 0.0
    links.new(diffuse.outputs[0], add.inputs[0])
    links.new(emission.outputs[0], add.inputs[1])
    if surface.emission.any() and back:
        side, flip = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeMath")
        flip.operation = "MULTIPLY_ADD"
        flip.inputs[1].default_value, flip.inputs[2].default_value = -strongest, strongest
        links.new(side.outputs["Backfacing"], flip.inputs[0])
        links.new(flip.outputs[0], emission.inputs["Strength"])
    links.new(add.outputs[0], output.inputs["Surface"])
    return made


def grid_mesh(shape, count):
    """Vertices (n, 3) and faces of about count vertices: a grid of a plane, a UV sphere; a mesh as it is."""
    if isinstance(shape, Mesh):
        return shape.vertices, shape.triangles
    if isinstance(shape, Plane):
        side = max(int(np.sqrt(count)), 2)
        s, t = (a.ravel() for a in np.meshgrid(*[np.linspace(0, 1, side)] * 2, indexing="ij"))
        k = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
        return shape.world(np.column_stack([s, t, 0 * s])), np.stack([k, k + side, k + side + 1, k + 1], axis=1)
    rings = max(int(np.sqrt(count / 2)), 3)
    turns = 2 * rings
    theta, phi = np.meshgrid(np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(turns) / turns, indexing="ij")
    ring = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rings - 2), np.arange(turns), indexing="ij"))
    after = (j + 1) % turns
    quads = np.stack([i * turns + j, (i + 1) * turns + j, (i + 1) * turns + after, i * turns + after], axis=1)
    j, after, last = np.arange(turns), (np.arange(turns) + 1) % turns, (rings - 2) * turns
    top = np.stack([np.full(turns, len(ring)), j, after], axis=1)
    bottom = np.stack([np.full(turns, len(ring) + 1), last + after, last + j], axis=1)
    return shape.world(np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])), [*quads, *top, *bottom]


def build(scene, front, count):
    """Objects of the scene with about count vertices in all -> [(surface, object, points (n, 3))]"""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made = []
    for k in front:
        surface = scene.surfaces[k]
        points, faces = grid_mesh(surface.shape, count / len(front))
        mesh = bpy.data.meshes.new(surface.name)
        mesh.from_pydata(points.tolist(), [], [face.tolist() for face in faces])
        if not isinstance(surface.shape, Mesh):
            mesh.shade_smooth()
        mesh.materials.append(material(surface, isinstance(surface.shape, Plane)))
        mesh.color_attributes.new("bake", "FLOAT_COLOR", "POINT")
        mesh.color_attributes.active_color = mesh.color_attributes["bake"]
        thing = bpy.data.objects.new(surface.name, mesh)
        bpy.context.scene.collection.objects.link(thing)
        thing.select_set(True)
        bpy.context.view_layer.objects.active = thing
        made.append((k, thing, points))
    return made


def settings():
    render = bpy.context.scene.render
    render.engine, render.threads_mode, render.threads = "CYCLES", "FIXED", 2
    render.bake.target = "VERTEX_COLORS"
    cycles = bpy.context.scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_light_tree = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = 1024
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    bpy.context.scene.world = None


def bake(made, samples, seed):
    """Irradiance / pi of the objects [(n, 3)] and CPU seconds."""
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.seed = samples, seed
    cpu = time.process_time()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    cpu = time.process_time() - cpu
    values = []
    for _, thing, points in made:
        data = np.empty(4 * len(points), np.float32)
        thing.data.color_attributes["bake"].data.foreach_get("color", data)
        values.append(data.reshape(-1, 4)[:, :3].astype(float))
    return values, cpu


def norm(scene, made, values):
    """L2 norm of rho times values over the objects' areas."""
    parts = [scene.areas[k] * ((scene.reflectance[k] * v) ** 2).sum() / len(v) for (k, _, _), v in zip(made, values)]
    return float(np.sqrt(sum(parts)))


def cycles_rows(scene, made, exact):
    size, total = norm(scene, made, exact), sum(len(v) for v in exact)
    for samples in SAMPLES:
        if samples * total > MOST:
            continue
        one, cpu = bake(made, samples, 1)
        other, again = bake(made, samples, 2)
        noise = norm(scene, made, [a - b for a, b in zip(one, other)]) / np.sqrt(2) / size
        apart = norm(scene, made, [(a + b) / 2 - c for a, b, c in zip(one, other, exact)]) / size
        yield {"samples": samples, "cpu_seconds": (cpu + again) / 2, "noise": noise, "mean_from_ours": apart}


def fitted(rows):
    """CPU seconds that Cycles takes to each of LEVELS."""
    samples, noise, cpu = (np.array([row[key] for row in rows]) for key in ("samples", "noise", "cpu_seconds"))
    scale = float(np.exp(np.mean(np.log(noise**2 * samples))))
    each, start = np.polyfit(samples, cpu, 1, w=1 / cpu)
    return {str(level): float(max(start, 0.0) + each * scale / level**2) for level in LEVELS}


def ours(scene, made, exact, target):
    cpu, wall = time.process_time(), time.perf_counter()
    solution = solve(scene, target)
    values = [solution.incident(k, points) for k, _, points in made]
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    wrong = norm(scene, made, [a - b for a, b in zip(values, exact)]) / norm(scene, made, exact)
    return {"target": target, "stated": float(solution.error), "measured": wrong, "cpu_seconds": cpu, "seconds": wall}


def beside(level, mine, theirs):
    """Our runs whose stated and whose measured error is the level, with the ratio of CPU seconds."""
    stated = next(m for m in mine if m["target"] == level)
    good = [m for m in mine if m["measured"] <= level]
    found = {"stated": stated, "measured": min(good, key=lambda m: m["cpu_seconds"])} if good else {"stated": stated}
    return {what: {**m, "ratio": theirs / m["cpu_seconds"]} for what, m in found.items()}


def main(output="build/bench/cycles.json", *vertices):
    rows = []
    for name, scene, front in scenes():
        tight = solve(scene, TIGHT)
        for count in [int(v) for v in vertices] or [500, 2000, 8000, 32000]:
            made = build(scene, front, count)
            settings()
            exact = [tight.incident(k, points) for k, _, points in made]
            mine = [ours(scene, made, exact, target) for target in TARGETS]
            theirs = list(cycles_rows(scene, made, exact))
            fit = fitted(theirs)
            total = sum(len(points) for _, _, points in made)
            row = {"scene": name, "vertices": total, "ours": mine, "cycles": theirs, "fit": fit}
            row["tight_stated"] = float(tight.error)
            row["levels"] = {str(level): beside(level, mine, fit[str(level)]) for level in LEVELS}
            rows.append(row)
            print(f"{name}, {total} vertices (Cycles' mean from ours {theirs[-1]['mean_from_ours']:.2%})")
            for level, found in row["levels"].items():
                print(f"  {float(level):5.1%}: Cycles {fit[level]:.1f} s CPU;", "; ".join(
                    f"ours {what} {m['cpu_seconds']:.2f} s CPU (target {m['target']:.1%}, stated {m['stated']:.2%}, "
                    f"measured {m['measured']:.2%}): {m['ratio']:.0f}x" for what, m in found.items()
                ), flush=True)  # fmt: skip
    save(output, {"about": {**machine(), "blender": bpy.app.version_string}, "rows": rows})


if __name__ == "__main__":
    main(*sys.argv[1:])
