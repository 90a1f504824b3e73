"""Each type and size of Blender's lights with shadows and reflections: our bake beside Cycles' of the same objects.

    PYTHON_WITH_BPY tests/benchmarks/lights_shaded.py [OUTPUT.json [TARGET [PART_OF_A_NAME]]]

Two scenes: a floor with a ball of 128 x 64 segments, which is exact to us, and a box; a Cornell box of 5.5 m with two
boxes. Irradiance / pi at the vertices of all but the ball: L2 is the relative difference to the mean of two bakes by
Cycles over the vertices, each by the area of the faces about it, as every second one lies in an edge; worst the largest
one, relative to the brightest vertex; noise is that mean's own L2, from the two seeds; elsewhere and noise_elsewhere
leave out vertices against another object, as a box's feet: Cycles' bounces start on its edge there, and half of them or
none go into the box, by chance; ours are read beside what stands there. OUTPUT.json keeps one table for each version of
Blender that has written to it; rows made anew, as PART_OF_A_NAME picks them, replace those of before.
"""

import json
import sys
import time
from math import radians
from pathlib import Path

import bpy
import numpy as np
from lights import extension
from mathutils import Euler, Matrix
from mathutils.bvhtree import BVHTree
from output import machine, save

SAMPLES = {"floor": 512, "cornell": 4096}
BOUNCES = 64
TOUCHING = 1e-4  # m of another object
LAMP = {
    "floor": Matrix.Translation((0.3, -0.2, 2.8)) @ Euler((0.25, 0.3, 0.1)).to_matrix().to_4x4(),
    "cornell": Matrix.Translation((0.5, -0.6, 4.2)) @ Euler((0.15, 0.1, 0.1)).to_matrix().to_4x4(),
}
SUN = {"floor": Euler((0.5, 0.3, 0)), "cornell": Euler((radians(62), 0, radians(15)))}


def cases():
    """Yield (name, kind, settings)."""
    for soft in (True, False):
        falloff = "disc" if soft else "ball"
        for radius in (0.0, 0.1, 1.0):
            common = {"shadow_soft_size": radius, "use_soft_falloff": soft, "energy": 100.0}
            yield f"point, {falloff} of {radius:g} m", "POINT", common
            yield f"spot, {falloff} of {radius:g} m", "SPOT", {**common, "spot_size": 1.2, "spot_blend": 0.15}
    for degrees in (0, 0.5, 10):
        yield f"sun, {degrees:g} degrees", "SUN", {"energy": 3.0, "angle": radians(degrees)}
    for shape in ("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"):
        for spread in (180, 60):
            settings = {"shape": shape, "size": 1.0, "size_y": 0.5, "energy": 100.0, "spread": radians(spread)}
            yield f"area, {shape.lower()} of 1 m, spread {spread}", "AREA", settings


def material(name, colour):
    made = bpy.data.materials.new(name)
    if not made.node_tree:
        made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*colour, 1.0)
    made.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def thing(name, sides, colour, matrix=None):
    """An object of grids [(points (n, 3), faces)]."""
    points, faces, count = [], [], 0
    for own, corners in sides:
        points += own.tolist()
        faces += (corners + count).tolist()
        count += len(own)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.materials.append(material(name, colour))
    obj = bpy.data.objects.new(name, mesh)
    obj.matrix_world = matrix or Matrix()
    bpy.context.scene.collection.objects.link(obj)
    return obj


def wall(cells, corner, u, v):
    """points (n, 3) and faces (k, 4) of a grid over corner + s u + t v, facing along u x v."""
    s, t = (a.ravel() / cells for a in np.meshgrid(*[np.arange(cells + 1)] * 2, indexing="ij"))
    k = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    faces = np.stack([k, k + cells + 1, k + cells + 2, k + 1], axis=1)
    return np.array(corner, float) + np.outer(s, u) + np.outer(t, v), faces


def box(cells, size):
    """The sides of a box on z = 0, each a grid of its own: its edges stay sharp."""
    u, v, w = np.diag(size)
    o = -(u + v) / 2
    sides = (o, u, w), (o + u, v, w), (o + u + v, -u, w), (o + v, -v, w), (o + w, u, v), (o, v, u)
    return [wall(cells, *side) for side in sides]


def floor():
    """[objects to bake]"""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=0.6, location=(-0.9, 0.6, 0.6))
    ball = bpy.context.object.data
    ball.materials.append(material("Ball", (0.3, 0.5, 0.8)))
    ball.polygons.foreach_set("use_smooth", [True] * len(ball.polygons))
    upright = Matrix.Translation((0.9, -0.7, 0)) @ Matrix.Rotation(0.4, 4, "Z")
    return [
        thing("Floor", [wall(15, (-4, -4, 0), (8, 0, 0), (0, 8, 0))], (0.8, 0.75, 0.7)),
        thing("Box", box(4, (1.0, 0.8, 1.2)), (0.8, 0.4, 0.3), upright),
    ]


def cornell():
    """[objects to bake]"""
    a, h = 2.75, 5.5
    x, y, z = (h, 0, 0), (0, h, 0), (0, 0, h)
    white = (0.73, 0.73, 0.73)
    tall = Matrix.Translation((-0.95, 0.9, 0)) @ Matrix.Rotation(0.3, 4, "Z")
    low = Matrix.Translation((0.95, -0.9, 0)) @ Matrix.Rotation(-0.29, 4, "Z")
    return [
        thing("Floor", [wall(5, (-a, -a, 0), x, y)], white),
        thing("Ceiling", [wall(5, (-a, -a, h), y, x)], white),
        thing("Back", [wall(5, (-a, a, 0), x, z)], white),
        thing("Left", [wall(5, (-a, -a, 0), y, z)], (0.63, 0.065, 0.05)),
        thing("Right", [wall(5, (a, -a, 0), z, y)], (0.14, 0.45, 0.09)),
        thing("Tall", box(2, (1.65, 1.65, 3.3)), white, tall),
        thing("Low", box(2, (1.65, 1.65, 1.65)), white, low),
    ]


SCENES = {"floor": floor, "cornell": cornell}


def lamp(where, kind, settings):
    data = bpy.data.lights.new("Lamp", kind)
    for key, value in settings.items():
        setattr(data, key, value)
    made = bpy.data.objects.new("Lamp", data)
    made.matrix_world = SUN[where].to_matrix().to_4x4() if kind == "SUN" else LAMP[where]
    bpy.context.scene.collection.objects.link(made)


def set_up(where):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world, scene.render.engine, scene.render.bake.target = None, "CYCLES", "VERTEX_COLORS"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", SAMPLES[where]
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.use_adaptive_sampling = cycles.use_light_tree = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    return SCENES[where]()


def colours(objects, name):
    """(n, 3)"""
    values = []
    for obj in objects:
        data = obj.data.color_attributes[name].data
        found = np.empty(4 * len(data), np.float32)
        data.foreach_get("color", found)
        values.append(found.reshape(-1, 4)[:, :3].astype(float))
    return np.concatenate(values)


def by_cycles(objects, seed):
    """(n, 3) irradiance / pi, and wall seconds"""
    bpy.context.scene.cycles.seed = seed
    for obj in list(bpy.context.view_layer.objects):
        obj.select_set(obj in objects)
    for obj in objects:
        made = obj.data.color_attributes
        made.active_color = made.get("Cycles") or made.new("Cycles", "FLOAT_COLOR", "POINT")
    bpy.context.view_layer.objects.active = objects[0]
    start = time.perf_counter()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    return colours(objects, "Cycles"), time.perf_counter() - start


def by_us(objects, target, bake):
    """(n, 3) irradiance / pi, and the report"""
    names = tuple(obj.name for obj in objects)
    settings = bake.BakeSettings(
        names, target, attribute="Ours", quantity="IRRADIANCE", domain="POINT", data_type="FLOAT_COLOR"
    )
    steps = bake.bake_steps(bpy.context, settings)
    while True:
        try:
            next(steps)
        except StopIteration as done:
            return colours(objects, "Ours"), done.value


def areas(objects):
    """(n,) m^2 of the faces about each vertex, its part of them."""
    parts = []
    for obj in objects:
        mesh, part = obj.data, np.zeros(len(obj.data.vertices))
        for face in mesh.polygons:
            part[list(face.vertices)] += face.area / len(face.vertices)
        parts.append(part)
    return np.concatenate(parts)


def free(objects):
    """(n,) bool of vertices that do not touch another object."""
    places = [[obj.matrix_world @ vertex.co for vertex in obj.data.vertices] for obj in objects]
    trees = [BVHTree.FromPolygons(p, [f.vertices for f in obj.data.polygons]) for p, obj in zip(places, objects)]
    return np.array([
        all(tree.find_nearest(at, TOUCHING)[0] is None for j, tree in enumerate(trees) if j != i)
        for i, own in enumerate(places) for at in own
    ])  # fmt: skip


def compared(ours, one, other, area):
    """L2, worst and noise, of (n, 3) each and (n,) m^2."""
    good = np.isfinite(one + other).all(axis=1)  # Cycles returns a NaN now and then
    mean, weight = (one + other)[good] / 2, area[good, None]

    def norm(value):
        return np.sqrt((weight * value**2).sum())

    return {
        "l2": float(norm(ours[good] - mean) / norm(mean)),
        "worst": float(np.abs(ours[good] - mean).max() / mean.max()),
        "noise": float(norm((one - other)[good]) / 2 / norm(mean)),
    }


def row(where, name, kind, settings, target, bake):
    objects = set_up(where)
    lamp(where, kind, settings)
    return {"scene": where, "light": name, **measured(objects, target, bake)[0]}


def measured(objects, target, bake):
    """What is told of our bake of these objects beside two of Cycles', and (ours, one, other) themselves."""
    bpy.context.view_layer.update()
    start = time.process_time()
    ours, report = by_us(objects, target, bake)
    start = time.process_time() - start
    (one, seconds), (other, _) = by_cycles(objects, 1), by_cycles(objects, 2)
    told = {"stated": report["error"], **compared(ours, one, other, areas(objects)), "vertices": len(ours)}
    told |= elsewhere(objects, (ours, one, other), free(objects))
    return {**told, "cpu_seconds": start, "cycles_seconds": seconds}, (ours, one, other)


def elsewhere(objects, values, some):
    """What is told over vertices `some` (n,) bool."""
    found = compared(*(a[some] for a in (*values, areas(objects))))
    return {"elsewhere": found["l2"], "noise_elsewhere": found["noise"]}


def keep(output, version, rows, about, key):
    """Writes the rows of this version of Blender beside those of others, and instead of those of the same names."""
    tables = json.loads(Path(output).read_text())["tables"] if Path(output).exists() else {}
    named = {tuple(row[name] for name in key): row for row in [*tables.get(version, []), *rows]}
    save(output, {"machine": machine(), **about, "tables": {**tables, version: list(named.values())}})


def table(what, cases, output, part, about, key):
    """Prints, and keeps, the rows of those cases, (name, row of a bake module), that have the part in their names."""
    module = extension()
    sys.modules["pdm_extension"].register()
    bake = module("operators.baking.bake")
    rows, version = [], ".".join(map(str, bpy.app.version[:2]))
    heads = " ".join(f"{head + ' %':>8}" for head in ("L2", "worst", "noise", "stated"))
    print(f"{what:44} {heads} {'CPU s':>6} {'Cycles':>6}   (Blender {version})")
    for name, make in cases:
        if part not in name:
            continue
        rows.append(make(bake))
        found = rows[-1]
        numbers = " ".join(f"{100 * found[column]:8.3f}" for column in ("l2", "worst", "noise", "stated"))
        more = [
            f" {column} {100 * found[column]:.3f} %" for column in ("elsewhere", "noise_elsewhere") if column in found
        ]
        print(
            f"{name:44} {numbers} {found['cpu_seconds']:6.1f} {found['cycles_seconds']:6.1f}{''.join(more)}", flush=True
        )
        if output:
            keep(output, version, rows, about, key)
    sys.modules["pdm_extension"].unregister()


def main(output=None, target="0.02", part=""):
    every = [(name, where, kind, settings) for name, kind, settings in cases() for where in SCENES]
    table(
        "light",
        [(f"{w}: {n}", lambda bake, w=w, n=n, k=k, s=s: row(w, n, k, s, float(target), bake)) for n, w, k, s in every],
        output, part, {"samples": SAMPLES, "bounces": BOUNCES, "target": float(target)}, ("scene", "light"),
    )  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:])
