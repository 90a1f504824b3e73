"""Small scenes from plain Blender primitives, with what is known about them."""

import bmesh
import bpy
import numpy as np
from mathutils import Matrix


def new_material(name):
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True  # later materials always do
    return made


def material(name, colour=(0.5, 0.5, 0.5), emission=None):
    """A Principled material of a plain colour, or an Emission one of `emission` as radiance."""
    made = new_material(name)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    if emission is None:
        shader = nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (*colour, 1)
    else:
        shader = nodes.new("ShaderNodeEmission")
        shader.inputs["Color"].default_value = (*emission, 1)
    links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def add(name, build, matrix=None, made_of=None):
    """A mesh object from build(bmesh)."""
    mesh = bpy.data.meshes.new(name)
    obj = bpy.data.objects.new(name, mesh)
    rebuild(obj, build)
    obj.matrix_world = matrix or Matrix()
    if made_of:
        mesh.materials.append(made_of)
    bpy.context.collection.objects.link(obj)
    return obj


def rebuild(obj, build):
    """Another mesh of the same object."""
    shape = bmesh.new()
    build(shape)
    shape.to_mesh(obj.data)
    shape.free()


def sphere(name, segments=16, rings=8, radius=1.0, matrix=None, made_of=None):
    return add(
        name,
        lambda b: bmesh.ops.create_uvsphere(b, u_segments=segments, v_segments=rings, radius=radius),
        matrix,
        made_of,
    )


def grid(name, cells=1, size=1.0, matrix=None, made_of=None):
    """A square in z = 0, normal +z, `size` a side."""
    return add(
        name,
        lambda b: bmesh.ops.create_grid(b, x_segments=cells, y_segments=cells, size=size / 2),
        matrix,
        made_of,
    )


def box(name, size=1.0, matrix=None, made_of=None, inverted=False):
    def build(b):
        bmesh.ops.create_cube(b, size=size)
        if inverted:
            bmesh.ops.reverse_faces(b, faces=b.faces)

    return add(name, build, matrix, made_of)


def wire(name):
    """No faces: refused."""
    return add(name, lambda b: b.edges.new([b.verts.new((0, 0, 0)), b.verts.new((1, 0, 0))]))


def lit_ball():
    """A ball over a floor under a lamp: (floor, ball, lamp)."""
    floor = grid("Floor", 4, 4.0, made_of=material("Floor", (0.6, 0.5, 0.4)))
    ball = sphere("Ball", matrix=Matrix.Translation((0, 0, 1.5)), made_of=material("Ball", (0.7, 0.7, 0.7)))
    lamp = grid(
        "Lamp",
        1,
        1.0,
        Matrix.Translation((1, 0, 4)) @ Matrix.Rotation(np.pi, 4, "X"),
        material("Lamp", emission=(5.0, 4.0, 3.0)),
    )
    return floor, ball, lamp


def colours(obj, name="Radiosity"):
    """(n, 4) float32 linear values of the colour attribute."""
    data = obj.data.color_attributes[name].data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)


def vertices(obj):
    """(n, 3) float64 local coordinates."""
    values = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", values)
    return values.reshape(-1, 3).astype(float)
