"""Textured rooms, lit by lamps and by a picture: our bake beside Cycles' of the same objects.

    PYTHON_WITH_BPY tests/benchmarks/textured.py [OUTPUT.json [TARGET [PART_OF_A_NAME]]]

A room of 5.5 m with two boxes, its floor of checks, its back wall painted with an image, on the right a screen that
shows an image by its own light: with a lamp, alone, and shining backwards too, at a wall 2 cm behind it; and a room in
which a spot lights a wall of red and blue stripes alone, so that all light elsewhere is what that wall reflects. The
numbers are told in lights_shaded.py; `elsewhere` leaves out that wall too.
"""

import sys
from math import radians

import bpy
import lights_shaded as shaded
import numpy as np
from mathutils import Euler, Matrix

SAMPLES = 2048
SIZE = 128  # pixels of the images
H, A = 5.5, 2.75  # m of the room, half of it
X, Y, Z = (H, 0, 0), (0, H, 0), (0, 0, H)


def image(name, colours):
    """Packed, of colours(u, v) -> three arrays, and a little noise as of a photograph."""
    made = bpy.data.images.new(name, SIZE, SIZE)
    u, v = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)
    pixels = np.ones((SIZE, SIZE, 4), np.float32)
    grain = np.random.default_rng(1).uniform(-0.08, 0.08, u.shape)
    for k, channel in enumerate(colours(u, v)):
        pixels[:, :, k] = np.clip(channel + grain, 0, 1)
    made.pixels.foreach_set(pixels.ravel())
    made.pack()
    return made


def with_uv(obj, u, v, corner):
    """The map of a flat object at corner + s u + t v."""
    mesh = obj.data
    at = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops]) - corner
    uv = np.column_stack([at @ u / np.dot(u, u), at @ v / np.dot(v, v)])
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.astype(np.float32).ravel())
    return obj


def node_of(obj, kind, **settings):
    """A new node of an object's material, its output linked to the shader's colour."""
    tree = obj.data.materials[0].node_tree
    node = tree.nodes.new(f"ShaderNode{kind}")
    for key, value in settings.items():
        setattr(node, key, value)
    kinds = "ShaderNodeEmission", "ShaderNodeBsdfDiffuse"
    shader = min((n for n in tree.nodes if n.bl_idname in kinds), key=lambda n: kinds.index(n.bl_idname))
    tree.links.new(node.outputs["Color"], shader.inputs["Color"])
    return node


def shining(obj, strength, backwards):
    """Its material emits instead of reflecting, from its front or from both sides."""
    tree = obj.data.materials[0].node_tree
    old = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    new = tree.nodes.new("ShaderNodeEmission")
    new.inputs["Strength"].default_value = strength
    shader = new.outputs[0]
    if not backwards:
        mix, geometry = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeNewGeometry")
        dark = tree.nodes.new("ShaderNodeBsdfDiffuse")
        dark.inputs["Color"].default_value = (0, 0, 0, 1)
        dark.name = "Dark"
        tree.links.new(geometry.outputs["Backfacing"], mix.inputs[0])
        tree.links.new(shader, mix.inputs[1])
        tree.links.new(dark.outputs[0], mix.inputs[2])
        shader = mix.outputs[0]
    tree.links.new(shader, tree.get_output_node("CYCLES").inputs["Surface"])
    tree.nodes.remove(old)
    return obj


def wall_of(name, corner, u, v, colour=(0.73, 0.73, 0.73), cells=6):
    return with_uv(shaded.thing(name, [shaded.wall(cells, corner, u, v)], colour), u, v, corner)


def boxes():
    tall = Matrix.Translation((-0.95, 0.9, 0)) @ Matrix.Rotation(0.3, 4, "Z")
    low = Matrix.Translation((0.95, -0.9, 0)) @ Matrix.Rotation(-0.29, 4, "Z")
    return [
        shaded.thing("Tall", shaded.box(2, (1.65, 1.65, 3.3)), (0.73, 0.73, 0.73), tall),
        shaded.thing("Low", shaded.box(2, (1.65, 1.65, 1.65)), (0.73, 0.73, 0.73), low),
    ]


def shell():
    """Floor, ceiling, back, left, right."""
    return [
        wall_of("Floor", (-A, -A, 0), X, Y),
        wall_of("Ceiling", (-A, -A, H), Y, X),
        wall_of("Back", (-A, A, 0), X, Z),
        wall_of("Left", (-A, -A, 0), Y, Z),
        wall_of("Right", (A, -A, 0), Z, Y),
    ]


def painted_room(has_lamp, backwards=False):
    objects = [*shell(), *boxes()]
    checks = node_of(objects[0], "TexChecker")
    checks.inputs["Color1"].default_value, checks.inputs["Color2"].default_value = (
        (0.8, 0.75, 0.7, 1),
        (0.15, 0.1, 0.1, 1),
    )
    checks.inputs["Scale"].default_value = 8
    tree = checks.id_data
    tree.links.new(tree.nodes.new("ShaderNodeUVMap").outputs[0], checks.inputs["Vector"])
    photo = image(
        "Photo", lambda u, v: (0.5 + 0.4 * np.sin(9 * u) * v, 0.6 * v, 0.3 + 0.5 * np.cos(7 * v + 4 * u) ** 2)
    )
    node_of(objects[2], "TexImage", image=photo)
    picture = wall_of("Picture", (A - 0.02, -1.2, 1.5), (0, 0, 1.6), (0, 2.4, 0), cells=1)
    screen = image("Screen", lambda u, v: (u, 0.9 * np.sin(6 * v) ** 2, 0.2 + 0.8 * (v > u)))
    node_of(shining(picture, 6.0, backwards), "TexImage", image=screen)
    if has_lamp:
        shaded.lamp("cornell", "AREA", {"shape": "SQUARE", "size": 1.0, "energy": 60.0})
    return objects, None


def bleeding():
    objects = [*shell(), *boxes()]
    stripes = image("Stripes", lambda u, v: (0.9 * (np.sin(12 * u) > 0), 0.05 + 0 * u, 0.8 * (np.sin(12 * u) <= 0) * v))
    node_of(objects[3], "TexImage", image=stripes)
    data = bpy.data.lights.new("Lamp", "SPOT")
    data.energy, data.spot_size, data.spot_blend, data.shadow_soft_size = 1000, radians(80), 0.3, 0.0
    made = bpy.data.objects.new("Lamp", data)
    made.matrix_world = Matrix.Translation((0.5, 0, 4.4)) @ Euler((0, radians(70), 0)).to_matrix().to_4x4()
    bpy.context.scene.collection.objects.link(made)
    return objects, "Left"


ROOMS = {
    "checks, painted wall, screen and lamp": lambda: painted_room(True),
    "checks, painted wall, screen alone": lambda: painted_room(False),
    "checks, painted wall, screen shining backwards too": lambda: painted_room(False, True),
    "bleeding striped wall": bleeding,
}


def row(name, make, target, bake):
    shaded.set_up("cornell")
    for obj in list(bpy.context.scene.objects):
        bpy.data.objects.remove(obj)
    bpy.context.scene.cycles.samples = SAMPLES
    objects, source = make()
    found, values = shaded.measured(objects, target, bake)
    found = {"room": name, **found}
    if source:
        keep = np.concatenate([np.full(len(obj.data.vertices), obj.name != source) for obj in objects])
        found |= shaded.elsewhere(objects, values, keep & shaded.free(objects))
    return found


def main(output=None, target="0.01", part=""):
    shaded.table(
        "room",
        [(name, lambda bake, n=name, m=make: row(n, m, float(target), bake)) for name, make in ROOMS.items()],
        output, part, {"samples": SAMPLES, "target": float(target)}, ("room",),
    )  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:])
