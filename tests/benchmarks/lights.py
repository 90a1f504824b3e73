"""Each type and size of Blender's lights over a floor and a plane that leans: what is read beside Cycles' direct bake.

    PYTHON_WITH_BPY tests/benchmarks/lights.py [OUTPUT.json]

Nothing is shaded. Irradiance / pi at 106 vertices: L2 is the relative difference over all of them, worst the largest
one, relative to the brightest vertex; noise is Cycles' own L2, from two seeds. OUTPUT.json keeps one table for each
version of Blender that has written to it.
"""

import importlib
import importlib.util
import json
import sys
import time
from math import pi, radians
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix
from output import ROOT, machine, save

SAMPLES = 4096
TILTED = Matrix.Translation((0.3, -0.2, 2.5)) @ Euler((0.3, 0.4, 0.1)).to_matrix().to_4x4()
PLANES = {
    "Floor": (8, 4.0, Matrix()),
    "Lean": (4, 1.0, Matrix.Translation((6, 0.2, 1)) @ Euler((0.5, 0.3, 0.2)).to_matrix().to_4x4()),
}


def cases():
    """Yield (name, kind, settings, scale)."""
    for soft in (True, False):
        falloff = "disc" if soft else "ball"
        for radius in (0.0, 0.1, 1.0):
            common = {"shadow_soft_size": radius, "use_soft_falloff": soft, "energy": 100.0}
            yield f"point, {falloff} of {radius:g} m", "POINT", common, (1, 1, 1)
            for blend in (0.0, 0.15, 1.0):
                spot = {**common, "spot_size": 1.2, "spot_blend": blend}
                yield f"spot, {falloff} of {radius:g} m, blend {blend:g}", "SPOT", spot, (1, 1, 1)
    yield "spot, stretched", "SPOT", {**common, "shadow_soft_size": 0.1, "spot_size": 1.2}, (1, 2, 0.5)
    for degrees in (0, 0.5, 10, 90):
        yield f"sun, {degrees:g} degrees", "SUN", {"energy": 3.0, "angle": radians(degrees)}, (1, 1, 1)
    for shape in ("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"):
        for size in (0.1, 1.0):
            common = {"shape": shape, "size": size, "size_y": size / 2, "energy": 100.0}
            for spread in (180, 90, 20):
                name = f"area, {shape.lower()} of {size:g} m, spread {spread}"
                yield name, "AREA", {**common, "spread": radians(spread)}, (1, 1, 1)
        yield f"area, {shape.lower()}, scaled and mirrored", "AREA", {**common, "spread": pi}, (-3, 1, 0.2)


def extension():
    """import_module of the repository's own packages, as inside the extension."""
    name = "pdm_extension"
    spec = importlib.util.spec_from_file_location(name, ROOT / "__init__.py", submodule_search_locations=[str(ROOT)])
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return lambda module: importlib.import_module(f"{name}.{module}")


def set_up():
    """The planes' objects, their points (n, 3) m and unit normals (n, 3)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world, scene.render.engine, scene.render.bake.target = None, "CYCLES", "VERTEX_COLORS"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", SAMPLES
    cycles.use_adaptive_sampling = cycles.use_light_tree = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    points, normals = [], []
    for name, (cells, size, matrix) in PLANES.items():
        steps = np.linspace(-size / 2, size / 2, cells + 1)
        own = np.stack(np.meshgrid(steps, steps, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
        k = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(own.tolist(), [], np.stack([k, k + cells + 1, k + cells + 2, k + 1], axis=1).tolist())
        mesh.color_attributes.new("Cycles", "FLOAT_COLOR", "POINT")
        mesh.color_attributes.active_color = mesh.color_attributes["Cycles"]
        obj = bpy.data.objects.new(name, mesh)
        obj.matrix_world = matrix
        scene.collection.objects.link(obj)
        turn = np.array(matrix)
        points.append(own @ turn[:3, :3].T + turn[:3, 3])
        normals.append(np.tile(turn[:3, 2], (len(own), 1)))
    return list(scene.objects), np.concatenate(points), np.concatenate(normals)


def baked(objects, seed):
    """(n, 3) direct irradiance / pi, and wall seconds"""
    bpy.context.scene.cycles.seed = seed
    bpy.context.view_layer.update()
    for obj in list(bpy.context.view_layer.objects):
        obj.select_set(obj.type == "MESH")
    bpy.context.view_layer.objects.active = objects[0]
    start = time.perf_counter()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"})
    start = time.perf_counter() - start
    values = []
    for obj in objects:
        data = obj.data.color_attributes["Cycles"].data
        found = np.empty(4 * len(data), np.float32)
        data.foreach_get("color", found)
        values.append(found.reshape(-1, 4)[:, :3].astype(float))
    return np.concatenate(values), start


def row(name, kind, settings, scale, read_scene):
    objects, points, normals = set_up()
    data = bpy.data.lights.new("Lamp", kind)
    for key, value in settings.items():
        setattr(data, key, value)
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.matrix_world = TILTED @ Matrix.Diagonal((*scale, 1))
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    (light,) = read_scene(bpy.context).scene.lights
    start = time.perf_counter()
    ours = light.unoccluded(points, normals)[:, None] * light.colour
    start = time.perf_counter() - start
    (one, seconds), (other, _) = baked(objects, 1), baked(objects, 2)
    good = np.isfinite(one + other).all(axis=1)  # Cycles returns a NaN now and then
    mean, size = (one + other)[good] / 2, np.sqrt((one[good] ** 2).sum())
    return {
        "light": name,
        "l2": float(np.sqrt(((ours[good] - mean) ** 2).sum()) / size),
        "worst": float(np.abs(ours[good] - mean).max() / mean.max()),
        "noise": float(np.sqrt(((one - other)[good] ** 2).sum() / 2) / size),
        "seconds": start,
        "cycles_seconds": seconds,
    }


def main(output=None):
    read_scene = extension()("operators.reading.read_scene").read_scene
    rows, version = [], ".".join(map(str, bpy.app.version[:2]))
    print(f"{'light':44} {'L2 %':>7} {'worst %':>8} {'noise %':>8}   (Blender {version})")
    for case in cases():
        rows.append(row(*case, read_scene))
        found = rows[-1]
        numbers = [100 * found[key] for key in ("l2", "worst", "noise")]
        print(f"{found['light']:44} {numbers[0]:7.3f} {numbers[1]:8.3f} {numbers[2]:8.3f}", flush=True)
    if output:
        tables = json.loads(Path(output).read_text())["tables"] if Path(output).exists() else {}
        save(output, {"machine": machine(), "samples": SAMPLES, "tables": {**tables, version: rows}})


if __name__ == "__main__":
    main(*sys.argv[1:])
