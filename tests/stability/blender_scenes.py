"""Random scenes for fuzz_blender.py, what of them a bake must leave as it was, and how far it is off."""

import importlib

import bpy
import numpy as np
import scenes
from conftest import MODULE
from mathutils import Euler, Matrix
from mathutils.bvhtree import BVHTree

LATTICE = 0.5  # m: half of all coordinates lie on it, so that objects touch and coincide
SPREAD = 256  # points of a surface
DATA = ("objects", "meshes", "materials", "lights", "worlds", "collections", "node_groups", "images", "scenes")


def anywhere(rng):
    """Numbers (3,), on the lattice or not."""
    at = rng.uniform(-2, 2, 3)
    return np.where(rng.random(3) < 0.5, np.round(at / LATTICE) * LATTICE, at)


def primitive(rng):
    """Adds one of Blender's own by its operator -> the object."""
    ops, many = bpy.ops.mesh, lambda low, high: int(rng.integers(low, high))
    turns = many(3, 33)
    [
        ops.primitive_cube_add,
        ops.primitive_plane_add,
        ops.primitive_uv_sphere_add,
        ops.primitive_monkey_add,
        lambda: ops.primitive_uv_sphere_add(segments=turns, ring_count=many(3, 17)),
        lambda: ops.primitive_ico_sphere_add(subdivisions=many(1, 4)),
        lambda: ops.primitive_cylinder_add(
            vertices=turns, end_fill_type=str(rng.choice(["NGON", "TRIFAN", "NOTHING"]))
        ),
        lambda: ops.primitive_cone_add(vertices=turns, radius2=float(rng.choice([0, 0.5]))),
        lambda: ops.primitive_torus_add(major_segments=many(3, 33), minor_segments=many(3, 13)),
        lambda: ops.primitive_grid_add(x_subdivisions=many(1, 9), y_subdivisions=many(1, 9)),
        lambda: ops.primitive_circle_add(vertices=turns, fill_type=str(rng.choice(["NGON", "TRIFAN"]))),
    ][many(0, 11)]()
    return bpy.context.object


def material(rng, furnace):
    rho = rng.uniform(0.1, 0.9)
    made = scenes.new_material("Grey")
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (rho, rho, rho, 1)
    shader.inputs["Emission Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Emission Strength"].default_value = 1 - rho if furnace else float(rng.choice([0, 3], p=[0.9, 0.1]))
    made["rho"] = rho
    return made


def made_up(seed, furnace):
    """Fills the empty scene."""
    rng = np.random.default_rng(seed)
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    shader = world.node_tree.nodes["Background"]
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Strength"].default_value = 1.0 if furnace else rng.choice([0.0, 0.1])
    bpy.context.scene.world = world
    made, grey = [], material(rng, furnace)
    for _ in range(rng.integers(1, 5)):
        obj = primitive(rng)
        if rng.random() < 0.5:
            bpy.ops.object.shade_smooth()
        size = np.maximum(np.abs(anywhere(rng)), 0.1) if rng.random() < 0.5 else np.ones(3)
        size *= rng.choice([-1, 1], 3, p=[0.2, 0.8])
        obj.matrix_basis = Matrix.LocRotScale(
            anywhere(rng), Euler(rng.choice([0, np.pi / 2, rng.uniform(0, 6)], 3)), size
        )
        obj.data.materials.append(grey if rng.random() < 0.3 else material(rng, furnace))
        if made and rng.random() < 0.3:
            obj.parent = made[rng.integers(len(made))]
        made.append(obj)
    for _ in range(0 if furnace else rng.integers(1, 4)):
        kind = str(rng.choice(["POINT", "SUN", "SPOT", "AREA"]))
        bpy.ops.object.light_add(type=kind, location=anywhere(rng), rotation=rng.uniform(0, 6, 3))
        bpy.context.object.data.energy = 1.0 if kind == "SUN" else 50.0
    bpy.context.view_layer.update()


def state():
    """What a bake must leave as it was: counts and names of all data, and of each object its place, mesh, materials and
    selection."""
    named = [(kind, [each.name for each in getattr(bpy.data, kind)]) for kind in DATA]
    out = [named, bpy.context.object and bpy.context.object.name, bpy.context.mode]
    for obj in bpy.data.objects:
        whole = [obj.name, obj.parent and obj.parent.name, obj.select_get(), obj.hide_render, obj.hide_viewport]
        whole += [list(row) for row in (*obj.matrix_world, *obj.matrix_basis)]
        if obj.type == "MESH":
            mesh, faces = obj.data, obj.data.polygons
            whole += [mesh.name, scenes.vertices(obj).tolist(), [(*f.vertices, f.use_smooth) for f in faces]]
            whole += [
                [slot.name for slot in obj.material_slots],
                [a.name for a in mesh.attributes if a.name != "Radiosity"],
            ]
        out.append(whole)
    return out


def furnace_error(report, furnace, touching, rounded):
    """What is wrong with the colours of a bake and its report, or "". What is stated is over all area: where colours,
    which stand in corners, are further off, points all over the scene's surfaces tell."""
    objects = {entry["name"]: entry for entry in report["objects"] if entry["baked"]}
    named = objects.keys() | {entry["name"] for entry in report["refused"]}
    if (
        missing := {o.name for o in bpy.data.objects if o.type == "MESH"}
        - named
        - {e["name"] for e in report["objects"]}
    ):
        return f"not a word of {missing}"
    shapes = {o.name: world(o) for o in bpy.data.objects if o.type == "MESH"}
    trees = {name: BVHTree.FromPolygons(points.tolist(), faces) for name, (points, faces) in shapes.items()}
    size = max(np.ptp(np.concatenate([points for points, _ in shapes.values()]), axis=0))
    square = whole = 0.0
    told = []
    for name, entry in objects.items():
        obj, (points, faces) = bpy.data.objects[name], shapes[name]
        colours = scenes.colours(obj)[:, :3]
        if not np.isfinite(colours).all() or (colours < 0).any():
            return f"{name}: colours from {colours.min()} to {colours.max()}"
        if not furnace:
            continue
        corner, area = np.concatenate(faces), area_of_corners(points, faces)
        others = [tree for other, tree in trees.items() if other != name]
        free = np.array([all(tree.find_nearest(p, touching * size)[0] is None for tree in others) for p in points])
        off = np.abs(colours - 1).max(axis=1)
        off = (off[corner] if len(colours) == len(points) else off) * free[corner]
        square += (area * off**2).sum()
        whole += (area * free[corner]).sum() * obj.data.materials[0]["rho"] ** 2
        told.append(f"{name} ({entry['label']}) {off.max():.4f} at most, {np.sqrt((off**2).mean()):.4f}")
    measured = np.sqrt(square / max(whole, 1e-300))
    if measured <= report["error"] + rounded:
        return ""
    everywhere = over_area(report["settings"]["target_error"], trees.values(), touching * size)
    told = f"stated {report['error']:.4f}, measured {measured:.4f} in corners, {everywhere:.4f} all over: {told}"
    return told if everywhere > report["error"] + rounded else ""


def over_area(target, trees, touching):
    """Relative L2 error of L - Le of the scene as it is read and solved again, where L is 1; but where objects lie
    against each other, by their trees."""
    read, solve = (importlib.import_module(f"{MODULE}.{name}") for name in ("operators.reading.read_scene", "pdm_core"))
    scene = read.read_scene(bpy.context).scene
    solution, square, whole = solve.solve(scene, target), 0.0, 0.0
    for k, surface in enumerate(scene.surfaces):
        points = surface.shape.spread(SPREAD)
        near = [sum(tree.find_nearest(p, touching)[0] is not None for tree in trees) for p in points]
        weight, rho = scene.areas[k] / len(points) * (np.array(near) < 2), scene.reflectance[k].max()
        off = np.abs(solution.incident(k, points) - 1).max(axis=1)
        square, whole = square + (weight * (rho * off) ** 2).sum(), whole + (weight * rho**2).sum()
    return float(np.sqrt(square / max(whole, 1e-300)))


def world(obj):
    """Vertices (n, 3) m and faces."""
    matrix = np.array(obj.matrix_world)
    points = scenes.vertices(obj) @ matrix[:3, :3].T + matrix[:3, 3]
    return points, [list(face.vertices) for face in obj.data.polygons]


def area_of_corners(points, faces):
    """(corners,) m^2, the same of all corners of a face."""
    out = []
    for face in faces:
        p = points[face]
        normal = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0) / 2
        out += [np.linalg.norm(normal) / len(face)] * len(face)
    return np.array(out)
