"""Live light: seconds from a change of light to new values, beside relighting and reading off anew; and in Blender.

    PYTHON_WITH_BPY tests/benchmarks/relight.py [OUTPUT.json]

`core` are values at so many points, `blender` whole changes from the material or lamp to the written attribute. Each is
the median of five changes; off: the relative L2 difference from a solution relit and read off anew. CPU seconds.
"""

import sys
import time
from dataclasses import replace

import bpy
import numpy as np
from lights import extension
from output import machine, save
from rooms import load
from scenes import thirteen_spheres

from pdm_core import Mesh, Plane, PointLight, Scene, Surface, solve
from pdm_core.compare import points_over
from pdm_core.signs_of_life import finish

VERTICES = 8000, 32_000
TURNS = 5
COMPARED = 2000  # points
RINGS = 48  # of the rock


def rock():
    """A bumpy mesh of 2 RINGS^2 quads over the floor, under a lamp."""
    t, p = np.meshgrid(np.linspace(0.05, np.pi - 0.05, RINGS), np.arange(2 * RINGS) * np.pi / RINGS, indexing="ij")
    r = 0.8 + 0.1 * np.sin(5 * t) * np.cos(4 * p)
    vertices = np.stack([r * np.sin(t) * np.cos(p), r * np.sin(t) * np.sin(p), r * np.cos(t) + 1.2], -1).reshape(-1, 3)
    a = (np.arange(RINGS - 1)[:, None] * 2 * RINGS + np.arange(2 * RINGS)).ravel()
    b = (np.arange(RINGS - 1)[:, None] * 2 * RINGS + (np.arange(2 * RINGS) + 1) % (2 * RINGS)).ravel()
    mesh = Mesh(vertices, np.column_stack([a, a + 2 * RINGS, b + 2 * RINGS, b]))
    planes = [Plane((-2, -2, 0), (4, 0, 0), (0, 4, 0)), Plane((-2, -2, 0), (0, 4, 0), (0, 0, 3))]
    paints = [(0.6, 0.5, 0.4), (0.7, 0.2, 0.2), (0.7, 0.7, 0.7)]
    surfaces = [Surface(shape, paint) for shape, paint in zip([*planes, mesh], paints, strict=True)]
    return Scene(surfaces, lights=[PointLight((1, 0.5, 2.8), 100.0, 0.2)])


CASES = {
    "Cornell's room, two balls": (lambda: load("cornell_spheres")[1], 0.01),
    "13 balls": (thirteen_spheres, 0.01),
    "rock of 9,024 triangles under a lamp": (rock, 0.04),
}


def changes(scene):
    """[Scene] one with another colour, one with other light; in turn."""
    painted = np.argmax((scene.reflectance > 0).all(axis=1))
    for k in range(TURNS):
        surfaces = list(scene.surfaces)
        surfaces[painted] = replace(surfaces[painted], reflectance=(0.2 + 0.1 * k, 0.5, 0.3))
        yield "colour", Scene(surfaces, scene.background, scene.rounding, scene.lights)
        surfaces = [replace(s, emission=s.emission * (0.5 + 0.1 * k)) for s in surfaces]
        lamps = [PointLight(lamp.position, 20.0 * (k + 1), lamp.radius) for lamp in scene.lights]
        yield "light", Scene(surfaces, scene.background, scene.rounding, lamps)


def core(name, count):
    make, target = CASES[name]
    scene = make()
    start = time.process_time()
    solution = solve(scene, target)
    solved = time.process_time() - start
    surface, points = points_over(scene, count)
    start = time.process_time()
    kept = finish(solution.kept_steps(surface, points))
    row = {
        "room": name, "vertices": count, "target": target, "stated": solution.error, "nodes": solution.nodes,
        "solve_seconds": solved, "keep_seconds": time.process_time() - start, "kept_megabytes": kept.bytes / 1e6,
    }  # fmt: skip
    taken, last = {"colour": [], "light": []}, {}
    for what, other in changes(scene):
        start = time.process_time()
        last[what] = other, kept.radiance(other)
        taken[what].append(time.process_time() - start)
    pick = np.linspace(0, count - 1, COMPARED).astype(int)
    for what, (other, value) in last.items():
        start = time.process_time()
        truth = finish(solution.relight(other).radiance_steps(surface[pick], points[pick]))
        row[f"{what}_anew_seconds"] = time.process_time() - start  # of fewer points
        row[f"{what}_seconds"] = float(np.median(taken[what]))
        row[f"{what}_off"] = float(np.linalg.norm(value[pick] - truth) / np.linalg.norm(truth))
    return row


def blender(count):
    """A floor of so many vertices, a wall, a monkey, a lamp: from a colour and a power to the written colours."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cells = int(np.sqrt(count)) - 1
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cells, y_subdivisions=cells, size=4)
    bpy.ops.mesh.primitive_plane_add(size=4, location=(-2, 0, 2), rotation=(0, np.pi / 2, 0))
    bpy.ops.mesh.primitive_monkey_add(size=1.5, location=(0, 0, 1))
    bpy.ops.object.light_add(type="AREA", location=(1, 0, 3.5))
    lamp, floor = bpy.context.object.data, bpy.data.objects["Grid"]
    lamp.energy = 200.0
    paint = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        paint.use_nodes = True
    floor.data.materials.append(paint)
    colour = paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    own, watch = bpy.context.scene.pdm_radiosity, ADDON("operators.live_watch")
    own.live = True
    bpy.context.view_layer.update()
    start = time.process_time()
    bpy.ops.pdm.bake(target_error=0.05)
    row = {
        "vertices": len(floor.data.vertices), "bake_seconds": time.process_time() - start,
        "kept_megabytes": watch.live.held.kept.bytes / 1e6,
    }  # fmt: skip
    taken = {"colour": [], "light": []}
    for k in range(TURNS):
        for what in taken:
            if what == "colour":
                colour.default_value = (0.1 * k, 0.5, 0.3, 1)
            else:
                lamp.energy = 50.0 * (k + 1)
            start = time.process_time()
            bpy.context.view_layer.update()
            watch.follow(bpy.context)
            taken[what].append(time.process_time() - start)
            assert watch.live.held and not watch.live.held.problem, watch.live.held and watch.live.held.problem
    return row | {f"{what}_seconds": float(np.median(seconds)) for what, seconds in taken.items()}


def main(path=None):
    data = {**machine(), "blender_version": bpy.app.version_string, "core": [], "blender": []}
    for count in VERTICES:
        data["blender"].append(blender(count))
        print(data["blender"][-1], flush=True)
        for name in CASES:
            data["core"].append(core(name, count))
            print(data["core"][-1], flush=True)
    if path:
        save(path, data)


if __name__ == "__main__":
    ADDON = extension()
    ADDON("operators").register()
    main(*sys.argv[1:])
    ADDON("operators").unregister()
