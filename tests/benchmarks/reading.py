"""How long reading takes, and the longest time without a sign of life: many objects, large meshes, many nodes.

    PYTHON_WITH_BPY tests/benchmarks/reading.py [OUTPUT.json] [--only NAME] [--profile]

Signs of life are what keeps Blender's window alive while a bake reads. How long it was silent is given in CPU seconds
of this process too: what else a busy machine does is not in them.
"""

import argparse
import cProfile
import pstats
import time

import bpy
import numpy as np
from lights import extension
from output import machine, save

SEED = 5


def link(name, mesh, place=(0, 0, 0)):
    obj = bpy.data.objects.new(name, mesh)
    obj.location = place
    bpy.context.scene.collection.objects.link(obj)
    return obj


def mesh_of(name, vertices, faces, smooth=False):
    """A Mesh of vertices (n, 3) and quads or triangles (f, k)."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.asarray(vertices, np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", np.asarray(faces, np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, faces.shape[1], dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(len(faces), smooth))
    mesh.update(calc_edges=True)
    return mesh


def sheet(columns, rows):
    """Vertices (n, 2) in the unit square and quads (f, 4)."""
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    k = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    return np.column_stack([x.ravel(), y.ravel()]), np.column_stack([k, k + 1, k + columns + 2, k + columns + 1])


def terrain(cells):
    places, quads = sheet(cells, cells)
    height = 0.1 * np.sin(9 * places[:, 0]) * np.cos(7 * places[:, 1])
    return mesh_of("Terrain", np.column_stack([10 * places, height]), quads, smooth=True)


def wall(cells):
    places, quads = sheet(cells, cells)
    return mesh_of("Wall", np.column_stack([10 * places, np.zeros(len(places))]), quads)


def ball(segments, rings):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=rings)
    return _taken()


def rock(cells, seed=0):
    """A closed bumpy body of 6 * cells^2 quads, as sculpts and scans are."""
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=cells - 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = _taken(obj)
    at = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", at)
    at = at.reshape(-1, 3) / np.linalg.norm(at.reshape(-1, 3), axis=1, keepdims=True)
    mesh.vertices.foreach_set("co", (at * (1 + 0.1 * np.sin(5 * at + seed).sum(axis=1, keepdims=True))).ravel())
    mesh.shade_smooth()
    return mesh


def _taken(obj=None):
    """The mesh of an object that goes."""
    obj = obj or bpy.context.object
    mesh = obj.data
    bpy.data.objects.remove(obj)
    return mesh


def city(count, faces):
    """Objects of some `faces` each, no two meshes alike: boxes of fine walls, balls, rocks, terrains in turn."""
    rng = np.random.default_rng(SEED)
    side = int(np.sqrt(faces / 6))
    made = [rock(side), ball(2 * int(np.sqrt(faces / 2)), int(np.sqrt(faces / 2))), terrain(int(np.sqrt(faces)))]
    made.append(fine_box(side))
    for k in range(count):
        mesh = made[k % len(made)].copy()
        at = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", at)
        scale = rng.uniform(0.5, 1.5, 3) if k % len(made) != 1 else np.full(3, rng.uniform(0.5, 1.5))
        mesh.vertices.foreach_set("co", (at.reshape(-1, 3) * scale).astype(np.float32).ravel())
        link(f"Thing {k}", mesh, (20 * (k % 50), 20 * (k // 50), 0))


def fine_box(cells):
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=cells - 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    return _taken(obj)


def triangulated(mesh):
    obj = link("Some", mesh)
    obj.modifiers.new("Triangulate", "TRIANGULATE")
    graph = bpy.context.evaluated_depsgraph_get()
    made = bpy.data.meshes.new_from_object(obj.evaluated_get(graph), depsgraph=graph)
    bpy.data.objects.remove(obj)
    return made


def loose_cubes(count):
    """One mesh of many boxes, a few turned: what exporters join."""
    rng = np.random.default_rng(SEED)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    at = 3.0 * np.column_stack([np.arange(count) % 200, np.arange(count) // 200, np.zeros(count)])
    size = rng.uniform(0.5, 1.5, (count, 1, 3))
    return mesh_of(
        "Cubes",
        (corners * size + at[:, None]).reshape(-1, 3),
        (quads + 8 * np.arange(count)[:, None, None]).reshape(-1, 4),
    )


def many_balls(count):
    """One mesh of many UV balls."""
    places, quads = ball_arrays(16, 8)
    at = 3.0 * np.column_stack([np.arange(count) % 50, np.arange(count) // 50, np.zeros(count)])
    vertices = (places + at[:, None]).reshape(-1, 3)
    return mesh_of("Balls", vertices, (quads + len(places) * np.arange(count)[:, None, None]).reshape(-1, 3))


def ball_arrays(segments, rings):
    mesh = ball(segments, rings)
    at = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", at)
    mesh.calc_loop_triangles()
    return at.reshape(-1, 3), np.array([triangle.vertices[:] for triangle in mesh.loop_triangles])


KINDS = ("ShaderNodeMix", "ShaderNodeGamma", "ShaderNodeInvert", "ShaderNodeHueSaturation")


def nodes(count):
    """A material of a chain of nodes between an image texture and the shader."""
    image = bpy.data.images.new("Image", 8, 8)
    made = bpy.data.materials.new("Long")
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    tree = made.node_tree
    last = tree.nodes.new("ShaderNodeTexImage")
    last.image = image
    for k in range(count):
        node = tree.nodes.new(KINDS[k % 4])
        if k % 4 == 0:
            node.data_type = "RGBA"
        inputs = [s for s in node.inputs if s.enabled and s.type == "RGBA"]
        for socket in inputs[: 1 + k % 2]:
            tree.links.new(last.outputs[0] if k % 4 != 1 else next(s for s in last.outputs if s.enabled), socket)
        last = node
    out = next(s for s in last.outputs if s.enabled)
    tree.links.new(out, tree.nodes["Principled BSDF"].inputs["Base Color"])
    mesh = wall(1)
    mesh.materials.append(made)
    link("Shown", mesh)
    return made


SCENES = {
    "2,000 objects, 1,000,000 faces": lambda: city(2000, 500),
    "2,000 boxes of 6 faces": lambda: [link(f"Box {k}", loose_cubes(1), (3 * k, 0, 0)) for k in range(2000)],
    "terrain, 150,000 faces": lambda: link("It", terrain(387)),
    "terrain, 300,000 triangles": lambda: link("It", triangulated(terrain(387))),
    "wall, 150,000 faces": lambda: link("It", wall(387)),
    "wall, 300,000 triangles": lambda: link("It", triangulated(wall(387))),
    "ball, 131,000 faces": lambda: link("It", ball(512, 256)),
    "rock, 150,000 faces": lambda: link("It", rock(158)),
    "25,000 boxes in one mesh": lambda: link("It", loose_cubes(25_000)),
    "1,000 balls in one mesh": lambda: link("It", many_balls(1000)),
    "a chain of 1,000 nodes": lambda: nodes(1000),
}


def seconds(read_steps):
    """(seconds of reading, the longest times between two signs of life: seconds, CPU seconds; the Reading)"""
    start, steps = np.array([time.perf_counter(), time.process_time()]), read_steps(bpy.context)
    last, longest = start, np.zeros(2)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            reading = end.value
            break
        finally:
            now = np.array([time.perf_counter(), time.process_time()])
            longest, last = np.maximum(longest, now - last), now
    return (last - start).tolist(), longest.tolist(), reading


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("output", nargs="?")
    parser.add_argument("--only", default="")
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args()
    module, rows = extension(), []
    read_steps = module("operators.reading.read_scene").read_steps
    read_material = module("operators.reading.materials").read_material
    print(f"{'':34} {'s':>7} {'CPU s':>7} {'silent s':>9} {'CPU s':>7}   {'read as'}")
    for name, make in SCENES.items():
        if options.only not in name:
            continue
        bpy.ops.wm.read_factory_settings(use_empty=True)
        make()
        bpy.context.view_layer.update()
        profile = cProfile.Profile(time.thread_time)  # the machine may be busy
        if options.profile:
            profile.enable()
        (taken, cpu), (silent, cpu_silent), reading = seconds(read_steps)
        profile.disable()
        label = f"{len(reading.objects)} objects: {reading.objects[0].label}"
        rows.append({
            "scene": name, "seconds": taken, "cpu_seconds": cpu, "longest_silence": silent,
            "longest_cpu_silence": cpu_silent, "read_as": label,
        })  # fmt: skip
        print(f"{name:34} {taken:7.2f} {cpu:7.2f} {silent:9.3f} {cpu_silent:7.3f}   {label}", flush=True)
        if "nodes" in name:
            start, cpu = time.perf_counter(), time.process_time()
            read_material(bpy.data.materials["Long"])
            taken, cpu = time.perf_counter() - start, time.process_time() - cpu
            rows[-1] |= {"material_seconds": taken, "material_cpu_seconds": cpu}
            print(f"{'  the material alone':34} {taken:7.3f} {cpu:7.3f}")
        if options.profile:
            pstats.Stats(profile).sort_stats("tottime").print_stats(60)
    if options.output:
        save(options.output, {"machine": machine(), "blender": bpy.app.version_string, "rows": rows})


if __name__ == "__main__":
    main()
