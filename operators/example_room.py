"""`bpy.ops.pdm.example_room`: a small room, ready to be baked, in a scene of its own."""

import bmesh
import bpy
from bpy.types import Operator
from mathutils import Matrix, Vector

from .modal_steps import Idle
from .reading.preview_nodes import new_material

NAME = "Radiosity Example"
WIDTH, DEPTH, HEIGHT, CELLS = 4.0, 4.0, 3.0, 40
WARM, COOL, WHITE, GOLD = (0.63, 0.12, 0.08), (0.12, 0.3, 0.6), (0.75, 0.75, 0.73), (0.8, 0.55, 0.2)


class PDM_OT_example_room(Idle, Operator):
    """Add a scene of a small room with a lamp, two balls and a box, to bake at once. Your scene stays as it is"""

    bl_idname = "pdm.example_room"
    bl_label = "Add Example Room"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        scene = bpy.data.scenes.new(NAME)
        build(scene.collection)
        scene.camera = scene.collection.objects["Room Camera"]
        if context.window is not None:
            context.window.scene = scene
            for area in context.window.screen.areas:
                if area.type == "VIEW_3D":
                    area.spaces.active.region_3d.view_perspective = "CAMERA"
        return {"FINISHED"}


def build(collection):
    """The room's objects, open in front (-y), the floor's middle at the origin."""
    x, y, z = Vector((WIDTH, 0, 0)), Vector((0, DEPTH, 0)), Vector((0, 0, HEIGHT))
    corner = -(x + y) / 2
    white, warm, cool = (_material(f"Room {name}", colour) for name, colour in
                         (("White", WHITE), ("Warm", WARM), ("Cool", COOL)))  # fmt: skip
    _wall(collection, "Room Floor", corner, x, y, white)
    _wall(collection, "Room Ceiling", corner + z, y, x, white)
    _wall(collection, "Room Left", corner, y, z, warm)
    _wall(collection, "Room Right", corner + x, z, y, cool)
    _wall(collection, "Room Back", corner + y, x, z, white)
    lamp = _material("Room Lamp", WHITE, 12.0)
    _wall(collection, "Room Lamp", Vector((-0.6, -0.5, HEIGHT - 0.3)), Vector((0, 1, 0)), Vector((1.2, 0, 0)), lamp, 1)
    _ball(collection, "Room Ball", (-0.85, 0.7, 0.8), 0.8, white)
    _ball(collection, "Room Small Ball", (0.1, -0.9, 0.4), 0.4, _material("Room Gold", GOLD))
    _box(collection, "Room Box", Matrix.Translation((1.05, 0.35, 0.6)) @ Matrix.Rotation(0.35, 4, "Z"), 0.5, white)
    data = bpy.data.cameras.new("Room Camera")
    data.lens = 28.0
    camera = bpy.data.objects.new("Room Camera", data)
    camera.matrix_world = Matrix.Translation((0, -6.3, 1.5)) @ Matrix.Rotation(1.5708, 4, "X")
    collection.objects.link(camera)


def _object(collection, name, material, make, smooth=False):
    mesh, work = bpy.data.meshes.new(name), bmesh.new()
    make(work)
    for face in work.faces:
        face.smooth = smooth
    work.to_mesh(mesh)
    work.free()
    mesh.materials.append(material)
    made = bpy.data.objects.new(name, mesh)
    collection.objects.link(made)
    return made


def _wall(collection, name, corner, u, v, material, cells=CELLS):
    """A grid over corner + s u + t v, facing along u x v."""
    turn = Matrix([u, v, u.cross(v).normalized()]).transposed().to_4x4()
    turn.translation = corner + (u + v) / 2
    _object(
        collection, name, material, lambda b: bmesh.ops.create_grid(b, x_segments=cells, y_segments=cells, size=0.5)
    ).matrix_world = turn


def _ball(collection, name, centre, radius, material):
    made = _object(
        collection, name, material,
        lambda b: bmesh.ops.create_uvsphere(b, u_segments=48, v_segments=24, radius=radius), smooth=True,
    )  # fmt: skip
    made.location = centre


def _box(collection, name, matrix, half, material):
    def make(b):
        bmesh.ops.create_cube(b, size=2 * half)
        bmesh.ops.scale(b, vec=(1, 1, 1.2), verts=b.verts)
        bmesh.ops.subdivide_edges(b, edges=b.edges[:], cuts=15, use_grid_fill=True)

    _object(collection, name, material, make).matrix_world = matrix


def _material(name, colour, emission=0.0):
    """A plain Principled material, shared by several example rooms."""
    if found := bpy.data.materials.get(name):
        return found
    material = new_material(name)
    shader = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = material.diffuse_color = (*colour, 1.0)
    if emission:
        shader.inputs["Emission Color"].default_value = (1.0, 0.85, 0.65, 1.0)
        shader.inputs["Emission Strength"].default_value = emission
    return material
