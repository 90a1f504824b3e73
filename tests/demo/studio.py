"""A room as people build them: one mesh with a window, Suzanne on a pedestal, a ball, a picture, an area and a point
light, and the sky outside. Flat walls and the ball are read exactly, Suzanne and the pedestal as they are meshed.
"""

import math

import bmesh
import bpy
import numpy as np
from rooms import ball, camera, diffuse

CELL, HEIGHT = 0.125, 3.0  # m, of the room's faces; of the room
OUTLINE = [(0, 0), (6, 0), (6, 4), (3, 4), (3, 6), (0, 6)]  # counter-clockwise from above
FLOOR = [((0, 0), (6, 4)), ((0, 4), (3, 6))]
WINDOW = (0.875, 2.25), (0.875, 2.25)  # y and z, in the wall at x = 0
SKY = (1.2, 1.7, 2.6)
WALLS, WOOD, TEAL = (0.75, 0.73, 0.7), (0.42, 0.28, 0.17), (0.1, 0.38, 0.4)
PICTURE = 96  # pixels


def build(size=600):
    """Replaces the open file by the studio, size * 4 / 3 x size pixels a picture."""
    bpy.ops.wm.read_homefile(use_empty=True)
    room([diffuse("Walls", WALLS), diffuse("Wood", WOOD), diffuse("Teal", TEAL)])
    pedestal((3.1, 2.8), 0.38, 0.9, diffuse("Stone", (0.62, 0.6, 0.57)))
    monkey((3.1, 2.8, 1.32), 0.5, diffuse("Clay", (0.65, 0.3, 0.18)))
    ball("Ball", (3.5, 1.1, 0.36), 0.36, diffuse("Gold", (0.75, 0.52, 0.15)))
    picture((0.02, 2.87, 0.87), (0, 1.385, 0), (0, 0, 1.385))  # its edges just beyond vertices of the wall
    lamp("Area", "AREA", (1.7, 1.5, 2.9), energy=42.0, size=0.8)
    lamp("Bulb", "POINT", (1.5, 5.2, 2.0), energy=40.0, color=(1.0, 0.68, 0.36), shadow_soft_size=0.12)
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*SKY, 1)
    scene = bpy.context.scene
    scene.world = world
    camera((5.7, 0.35, 1.6), (1.4, 3.0, 1.2), 80)
    scene.render.resolution_x, scene.render.resolution_y = size * 4 // 3, size
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()


def room(materials):
    """Floor, ceiling and walls as one mesh of square faces, their normals inwards."""
    work = bmesh.new()
    for (x, y), (far_x, far_y) in FLOOR:
        _cells(work, (x, y, 0), (far_x - x, 0, 0), (0, far_y - y, 0), 1)
        _cells(work, (x, y, HEIGHT), (0, far_y - y, 0), (far_x - x, 0, 0), 0)
    for (x, y), (next_x, next_y) in zip(OUTLINE, OUTLINE[1:] + OUTLINE[:1]):
        _cells(work, (x, y, 0), (0, 0, HEIGHT), (next_x - x, next_y - y, 0), 2 if y == next_y == 6 else 0)
    bmesh.ops.delete(work, geom=[face for face in work.faces if _in_window(face)], context="FACES")
    bmesh.ops.remove_doubles(work, verts=work.verts, dist=CELL / 100)
    _object("Room", work, materials)


def _cells(work, corner, u, v, material):
    """Square faces over corner + s u + t v, which face along u x v."""
    corner, u, v = (np.array(a, float) for a in (corner, u, v))
    m, n = (round(np.linalg.norm(a) / CELL) for a in (u, v))
    lattice = [[work.verts.new(corner + i / m * u + j / n * v) for j in range(n + 1)] for i in range(m + 1)]
    for i in range(m):
        for j in range(n):
            around = lattice[i][j], lattice[i + 1][j], lattice[i + 1][j + 1], lattice[i][j + 1]
            work.faces.new(around).material_index = material


def _in_window(face):
    x, y, z = face.calc_center_median()
    return x < CELL / 100 and all(low < value < high for value, (low, high) in zip((y, z), WINDOW))


def pedestal(place, radius, height, material, segments=40):
    """A cylinder with rings of faces, so that its vertices can hold the light."""
    profile = [(r, height) for r in np.linspace(radius / 6, radius, 6)]
    profile += [(radius, z) for z in np.linspace(height, 0, 16)[1:]]
    turn = 2 * math.pi * np.arange(segments) / segments
    work = bmesh.new()
    rings = [[work.verts.new((r * math.cos(a), r * math.sin(a), z)) for a in turn] for r, z in profile]
    work.faces.new(rings[0])
    for upper, lower in zip(rings, rings[1:]):
        for k in range(segments):
            after = (k + 1) % segments
            face = work.faces.new((upper[k], lower[k], lower[after], upper[after]))
            face.smooth = upper[k].co.z > lower[k].co.z
    _object("Pedestal", work, [material]).location = (*place, 0)


def monkey(place, scale, material):
    bpy.ops.mesh.primitive_monkey_add(location=place, rotation=(-0.35, 0, 0.95))
    obj = bpy.context.object
    obj.name, obj.scale = "Suzanne", (scale,) * 3
    bpy.ops.object.shade_smooth()
    obj.modifiers.new("Smooth", "SUBSURF").levels = 1
    bpy.ops.object.modifier_apply(modifier="Smooth")
    obj.data.materials.append(material)


def picture(corner, u, v, cells=64):
    """A plane that shows a painted image."""
    work = bmesh.new()
    corner, u, v = (np.array(a, float) for a in (corner, u, v))
    bmesh.ops.create_grid(work, x_segments=cells, y_segments=cells, size=0.5, calc_uvs=True)
    uv = work.loops.layers.uv.verify()
    for vertex in work.verts:
        s, t = vertex.co.x + 0.5, vertex.co.y + 0.5
        for loop in vertex.link_loops:
            loop[uv].uv = s, t
        vertex.co = corner + s * u + t * v
    material = diffuse("Picture", (1, 1, 1))
    nodes = material.node_tree.nodes
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = _painting()
    shader = next(node for node in nodes if node.bl_idname == "ShaderNodeBsdfDiffuse")
    material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Color"])
    _object("Picture", work, [material])


def _painting():
    """Hills under a setting sun, packed into the file."""
    y, x = np.mgrid[0:PICTURE, 0:PICTURE] / (PICTURE - 1.0)
    colour = np.array([0.95, 0.62, 0.3]) * (1 - y[..., None]) + np.array([0.3, 0.3, 0.65]) * y[..., None]
    colour[(x - 0.62) ** 2 + (y - 0.55) ** 2 < 0.02] = 1.0, 0.9, 0.55
    for level, swing, shade in (
        (0.42, 7.0, (0.45, 0.2, 0.35)),
        (0.28, 10.0, (0.25, 0.12, 0.3)),
        (0.14, 5.0, (0.1, 0.06, 0.2)),
    ):
        colour[y < level + 0.07 * np.sin(swing * x + 9 * level)] = shade
    image = bpy.data.images.new("Painting", PICTURE, PICTURE)
    image.pixels.foreach_set(np.dstack([colour, np.ones_like(x)]).astype(np.float32).ravel())
    image.update()
    image.pack()
    return image


def lamp(name, kind, place, **settings):
    """A light that looks down."""
    data = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(name, data)
    obj.location = place
    bpy.context.collection.objects.link(obj)


def _object(name, work, materials):
    mesh = bpy.data.meshes.new(name)
    work.to_mesh(mesh)
    work.free()
    for material in materials:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj
