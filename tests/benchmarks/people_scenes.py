"""Twelve scenes of the kind people make, each built into the open file; people_beside.py bakes and measures them."""

from math import cos, pi, radians, sin

import bpy
import numpy as np
from people_parts import (
    box,
    camera,
    lamp,
    lathe,
    material,
    painted,
    pierced,
    placed,
    primitive,
    prism,
    quad,
    thing,
    tube,
    world,
)  # fmt: skip

WHITE, WOOD, DARK = (0.8, 0.8, 0.78), (0.45, 0.27, 0.14), (0.12, 0.12, 0.14)


def room(x, y, z, wall, floor, cut, leave=""):
    """A room's faces as separate planes, as people make them, front inside; `leave`: those that are made otherwise."""
    planes = {
        "Floor": ((0, 0, 0), (x, 0, 0), (0, y, 0), floor),
        "Ceiling": ((0, 0, z), (0, y, 0), (x, 0, 0), wall),
        "West": ((0, 0, 0), (0, y, 0), (0, 0, z), wall),
        "East": ((x, 0, 0), (0, 0, z), (0, y, 0), wall),
        "North": ((0, y, 0), (x, 0, 0), (0, 0, z), wall),
        "South": ((0, 0, 0), (0, 0, z), (x, 0, 0), wall),
    }
    for name, (corner, u, v, paint) in planes.items():
        if name not in leave:
            quad(name, corner, u, v, paint, cut)


def kitchen():
    white, wood, front = material("Wall", WHITE), material("Wood", WOOD), material("Front", (0.25, 0.4, 0.42))
    top, steel = material("Worktop", (0.55, 0.52, 0.48)), material("Steel", (0.6, 0.6, 0.62))
    room(4, 3.4, 2.6, white, wood, 0.2, leave="North")
    pierced("North", (0, 3.4, 0), (4, 0, 0), (0, 0, 2.6), [(1.4, 2.7, 1.1, 2.1)], white, 0.2)
    inner = [(0, 0.6), (0, 3.4), (3.2, 3.4), (3.2, 2.8), (0.6, 2.8), (0.6, 0.6)]
    low = [(x, y, 0.86) for x, y in inner[::-1]]
    prism("Cupboards", low, (0, 0, 0.86), front, cut=0.2)
    over = [(0, 0.58), (0, 3.4), (3.22, 3.4), (3.22, 2.77), (0.63, 2.77), (0.63, 0.58)]
    prism("Counter", [(x, y, 0.9) for x, y in over[::-1]], (0, 0, 0.04), top, cut=0.15)
    box("Shelf", (0, 0.8, 1.5), (0.35, 1.8, 0.6), front, 0.2)
    fridge = box("Fridge", (3.3, 2.7, 0), (0.65, 0.65, 1.8), steel)
    bevel = fridge.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.04, 3
    apply(fridge)
    box("Table", (1.9, 0.8, 0.72), (1.3, 0.8, 0.04), wood, 0.15)
    for k, (x, y) in enumerate([(1.95, 0.85), (3.15, 0.85), (1.95, 1.55), (3.15, 1.55)]):
        tube(f"Leg {k + 1}", (x, y, 0), 0.03, 0.72, wood, 12, True)
    lathe("Bowl", [(0, 0), (0.06, 0), (0.14, 0.08), (0.13, 0.08), (0.055, 0.012), (0, 0.012)], top, at=(2.5, 1.2, 0.76))
    primitive("Orange", bpy.ops.mesh.primitive_uv_sphere_add, material("Orange", (0.8, 0.3, 0.05)), True,
              (2.52, 1.21, 0.82), radius=0.045)  # fmt: skip
    lamp("Pendant", "POINT", (2.5, 1.2, 1.9), 40, colour=(1, 0.85, 0.65), shadow_soft_size=0.08)
    lamp("Strip", "AREA", (0.45, 1.7, 1.45), 12, (0.45, 1.7, 0), shape="RECTANGLE", size=0.06, size_y=1.6)
    world((0.5, 0.7, 1.0), 3.0)
    camera((3.7, 0.25, 1.75), (1.1, 2.4, 0.95), 75)


def apply(obj):
    bpy.context.view_layer.objects.active = obj
    for modifier in list(obj.modifiers):
        with bpy.context.temp_override(object=obj):
            bpy.ops.object.modifier_apply(modifier=modifier.name)


def attic():
    wall, floor, wood = material("Plaster", WHITE), material("Boards", WOOD), material("Beam", (0.3, 0.18, 0.1))
    x, y, knee, ridge = 6.0, 4.4, 0.8, 2.8
    quad("Floor", (0, 0, 0), (x, 0, 0), (0, y, 0), floor, 0.22)
    quad("Knee South", (0, 0, 0), (0, 0, knee), (x, 0, 0), wall, 0.22)
    quad("Knee North", (0, y, 0), (x, 0, 0), (0, 0, knee), wall, 0.22)
    slope = (0, y / 2, ridge - knee)
    pierced("Roof South", (0, 0, knee), slope, (x, 0, 0), [(0.8, 2.0, 1.5, 2.6), (0.8, 2.0, 3.6, 4.4)], wall, 0.2)
    pierced("Roof North", (0, y, knee), (x, 0, 0), (0, -y / 2, ridge - knee), [], wall, 0.22)
    gable = [(0, 0), (y, 0), (y, knee), (y / 2, ridge), (0, knee)]
    thing("Gable West", [(0, b, c) for b, c in gable], [range(5)], wall, cut=0.22)
    thing("Gable East", [(x, b, c) for b, c in gable], [range(4, -1, -1)], wall, cut=0.22)
    for k in range(3):
        box(f"Beam {k + 1}", (1.2 + 1.7 * k, 0.95, 1.9), (0.14, 2.5, 0.16), wood, 0.2)
    box("Bed", (4.0, 2.4, 0.15), (1.8, 1.2, 0.3), material("Sheet", (0.3, 0.35, 0.55)), 0.2)
    box("Chest", (0.6, 3.0, 0), (1.0, 0.6, 0.5), wood, 0.15, turn=12)
    world((1, 1, 1), 0.6, sky=True)
    camera((0.3, 0.5, 1.5), (4.5, 3.0, 0.9), 75)


def gallery():
    rng = np.random.default_rng(5)
    white, black = material("Wall", WHITE), material("Frame", DARK)
    boards = painted(
        "Boards", lambda u, v: [c * (0.6 + 0.4 * (np.floor(12 * u + 0.4 * np.floor(5 * v)) % 2)) for c in WOOD]
    )
    room(8, 5, 3.4, white, white, 0.25, leave="Floor")
    quad("Floor", (0, 0, 0), (8, 0, 0), (0, 5, 0), material("Boards", image=boards), 0.1, uv=True)
    for k in range(5):
        f, g, h = rng.uniform(2, 9, 3), rng.uniform(0, 6, 3), rng.uniform(0.2, 0.9, 3)
        image = painted(f"Picture {k + 1}", lambda u, v, f=f, g=g, h=h: [
            h[c] * (0.5 + 0.5 * np.sin(f[c] * u + g[c]) * np.cos(f[(c + 1) % 3] * v)) for c in range(3)])  # fmt: skip
        paint, width = material(f"Picture {k + 1}", image=image), 0.8 + 0.1 * k
        if k < 3:
            a = 0.8 + 2.4 * k
            box(f"Frame {k + 1}", (a - 0.06, 4.95, 1.14), (width + 0.12, 0.05, 1.22), black)
            quad(f"Picture {k + 1}", (a, 4.94, 1.2), (width, 0, 0), (0, 0, 1.1), paint, 0.08, uv=True)
            lamp(f"Spot {k + 1}", "SPOT", (a + width / 2, 3.4, 3.3), 120, (a + width / 2, 5, 1.6), spot_size=0.9,
                 spot_blend=0.4, shadow_soft_size=0.03)  # fmt: skip
        else:
            a = 1.0 + 1.9 * (k - 3)
            quad(f"Picture {k + 1}", (0.02, a, 1.2), (0, width, 0), (0, 0, 1.1), paint, 0.08, uv=True)
    box("Bench", (3.0, 2.2, 0.4), (1.8, 0.5, 0.07), black, 0.15)
    for k, a in enumerate((3.1, 4.5)):
        box(f"Foot {k + 1}", (a, 2.3, 0), (0.2, 0.3, 0.4), black, 0.15)
    box("Plinth", (6.2, 1.2, 0), (0.5, 0.5, 1.0), white, 0.12, turn=20)
    primitive(
        "Bust", bpy.ops.mesh.primitive_ico_sphere_add, white, True, (6.37, 1.52, 1.28), subdivisions=3, radius=0.28
    )
    lamp("Skylight", "AREA", (4, 2.5, 3.38), 90, (4, 2.5, 0), shape="RECTANGLE", size=5, size_y=1)
    camera((7.6, 0.4, 1.7), (2.2, 3.9, 1.3), 75)


def arch(width, height, spring, across, segments=12):
    """(n, 2): the outline of a wall with an arch cut out from below, counter-clockwise."""
    middle, radius = width / 2, across / 2
    bow = [
        (middle + radius * cos(pi * k / segments), spring + radius * sin(pi * k / segments))
        for k in range(segments + 1)
    ]
    return [(0, 0), (middle - radius, 0), *bow[::-1], (middle + radius, 0), (width, 0), (width, height), (0, height)]


def dungeon():
    stone, slab = material("Stone", (0.42, 0.38, 0.33)), material("Slab", (0.3, 0.29, 0.28))
    quad("Floor", (0, 0, 0), (6, 0, 0), (0, 6, 0), slab, 0.2)
    outline = arch(6, 3, 1.5, 2.4)
    prism("Arch North", [(a, 5.6, b) for a, b in outline], (0, -0.4, 0), stone, cut=0.25)
    prism("Arch Middle", [(a, 2.6, b) for a, b in outline], (0, -0.4, 0), stone, cut=0.25)
    quad("West", (0, 0, 0), (0, 6, 0), (0, 0, 3), stone, 0.25)
    quad("East", (6, 0, 0), (0, 0, 3), (0, 6, 0), stone, 0.25)
    for k, (a, b) in enumerate([(0.8, 1.2), (5.2, 1.2), (0.8, 4.4), (5.2, 4.4)]):
        tube(f"Pillar {k + 1}", (a, b, 0), 0.28, 3, stone, 16)
        box(f"Foot {k + 1}", (a - 0.4, b - 0.4, 0), (0.8, 0.8, 0.25), stone, 0.2)
    box("Coffer", (2.6, 4.2, 0), (0.9, 0.5, 0.5), material("Coffer", WOOD), 0.12, turn=25)
    for k, (a, b) in enumerate([(0.9, 2.3), (5.1, 2.3), (3.0, 5.4)]):
        lamp(f"Torch {k + 1}", "POINT", (a, b, 1.9), 60, colour=(1, 0.55, 0.2), shadow_soft_size=0.06)
    world((0.02, 0.03, 0.06))
    camera((3, -4.2, 3.6), (3, 3.2, 0.9), 55)


def stairs():
    white, wood, rail = material("Wall", WHITE), material("Wood", WOOD), material("Rail", DARK)
    steps, rise, run = 10, 0.18, 0.28
    outline = [(0.0, 0.0)]
    for k in range(steps):
        outline += [(run * k, rise * (k + 1)), (run * (k + 1), rise * (k + 1))]
    outline += [(run * steps, 0.0)]
    prism("Stairs", [(1.0 + a, 1.2, b) for a, b in outline[::-1]], (0, -1.1, 0), wood, cut=0.14)
    box("Landing", (1.0 + run * steps, 1.2, 0), (1.4, 1.1, rise * steps), wood, 0.2)
    quad("Floor", (0, 0, 0), (5.2, 0, 0), (0, 2.3, 0), material("Tiles", (0.5, 0.45, 0.4)), 0.15)
    quad("North", (0, 2.3, 0), (5.2, 0, 0), (0, 0, 4), white, 0.2)
    quad("West", (0, 0, 0), (0, 2.3, 0), (0, 0, 4), white, 0.2)
    pierced("East", (5.2, 0, 0), (0, 2.3, 0), (0, 0, 4), [(0.5, 1.4, 2.4, 3.5)], white, 0.2)
    quad("Ceiling", (0, 0, 4), (0, 2.3, 0), (5.2, 0, 0), white, 0.2)
    post = tube("Balusters", (1.14, 1.28, rise), 0.02, 0.9, rail, 8)
    array = post.modifiers.new("Array", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = steps, False, True
    array.constant_offset_displace = (run, 0, rise)
    length = np.hypot(run, rise) * (steps - 0.5)
    handle = box("Handrail", (1.06, 1.25, rise + 0.88), (length, 0.06, 0.05), rail, 0.15)
    handle.rotation_euler = (0, -float(np.arctan2(rise, run)), 0)
    lamp("Sun", "SUN", (8, -2, 6), 4, (2.2, 2.0, 0), colour=(1, 0.92, 0.8), angle=radians(0.526))
    world((0.45, 0.6, 0.9), 0.8)
    camera((-0.2, -4.6, 2.4), (2.7, 1.4, 1.45), 50)


def house(name, at, size, turn, wall, roof, cut=0.0):
    """Walls with gables and an overhanging roof of thin boxes' kind, one mesh, two materials."""
    x, y, z, ridge, over = *size, size[2] + 0.6 * size[1], 0.25
    vertices = [
        (0, 0, 0),
        (x, 0, 0),
        (x, y, 0),
        (0, y, 0),
        (0, 0, z),
        (x, 0, z),
        (x, y, z),
        (0, y, z),
        (0, y / 2, ridge),
        (x, y / 2, ridge),
    ]
    faces = [(0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 9, 5), (3, 0, 4, 8, 7)]
    drop, rise = over * 1.2, 0.08
    low, high = z - drop + rise, ridge + rise
    vertices += [(-over, -over, low), (x + over, -over, low), (x + over, y / 2, high), (-over, y / 2, high),
                 (x + over, y + over, low), (-over, y + over, low)]  # fmt: skip
    faces += [(10, 11, 12, 13), (13, 12, 14, 15)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("material_index", np.array([0, 0, 0, 0, 1, 1], np.int32))
    return placed(name, mesh, [wall, roof], cut=cut, at=at, turn=turn)


def tree(name, at, height):
    x, y, z = at
    tube(f"{name} trunk", (x, y, z), 0.12, height * 0.4, material("Bark", (0.2, 0.12, 0.07)), 8, True)
    primitive(name, bpy.ops.mesh.primitive_ico_sphere_add, material("Leaves", (0.12, 0.3, 0.08)), False,
              (x, y, z + height * 0.65), subdivisions=2, radius=height * 0.33)  # fmt: skip


def street():
    asphalt, kerb, roof = (
        material("Asphalt", (0.15, 0.15, 0.16)),
        material("Kerb", (0.45, 0.44, 0.42)),
        material("Roof", (0.5, 0.17, 0.1)),
    )
    walls = [material(f"Paint {k}", c) for k, c in enumerate([(0.75, 0.68, 0.5), (0.6, 0.65, 0.7), (0.7, 0.45, 0.35)])]
    quad("Ground", (-6, -14, 0), (42, 0, 0), (0, 28, 0), material("Grass", (0.22, 0.32, 0.12)), 0.7)
    quad("Road", (-6, -3, 0.02), (42, 0, 0), (0, 6, 0), asphalt, 0.4)
    for k, y in enumerate((-4.2, 3.0)):
        box(f"Pavement {k + 1}", (-6, y, 0), (42, 1.2, 0.15), kerb, 0.4)
    for k in range(4):
        house(f"North house {k + 1}", (8 * k, 5.5, 0), (5, 4.2, 3 + 0.5 * (k % 3)), 3 * k - 4, walls[k % 3], roof, 0.5)
        house(
            f"South house {k + 1}",
            (8 * k, -9.5, 0),
            (5, 4, 2.8 + 0.4 * (k % 2)),
            2 * k - 3,
            walls[(k + 1) % 3],
            roof,
            0.5,
        )
        tree(f"Tree {k + 1}", (6.4 + 8 * k, 3.6, 0.15), 3.2 + 0.3 * k)
    box("Van", (11, -2.3, 0.35), (4, 1.7, 1.6), material("Van", (0.8, 0.8, 0.82)), 0.3)
    lamp("Sun", "SUN", (0, 0, 20), 4, (9, 7, 0), colour=(1, 0.93, 0.82), angle=radians(0.526))
    world((0.35, 0.55, 0.95), 0.8)
    camera((-5.5, -1.4, 4.2), (14, 1.0, 1.2), 65)


def desk():
    wood, wall, dark = material("Wood", WOOD), material("Wall", (0.7, 0.68, 0.62)), material("Plastic", DARK)
    red, white = material("Book", (0.55, 0.1, 0.08)), material("China", (0.85, 0.85, 0.83))
    quad("Wall", (-1.2, 0.5, -0.75), (2.4, 0, 0), (0, 0, 2.1), wall, 0.08)
    box("Desk", (-0.9, -0.4, -0.04), (1.8, 0.85, 0.04), wood, 0.04)
    cup = [(0, 0), (0.038, 0), (0.042, 0.005), (0.042, 0.095), (0.038, 0.095), (0.038, 0.008), (0, 0.008)]
    lathe("Cup", cup, white, 48, at=(0.25, -0.1, 0))
    primitive("Handle", bpy.ops.mesh.primitive_torus_add, white, True, (0.3, -0.1, 0.05), (90, 0, 0),
              major_radius=0.028, minor_radius=0.006, major_segments=32, minor_segments=12)  # fmt: skip
    pot = [(0, 0), (0.035, 0), (0.035, 0.1), (0.032, 0.1), (0.032, 0.004), (0, 0.004)]
    lathe("Pencil pot", pot, dark, 32, smooth=False, at=(-0.35, 0.15, 0))
    for k in range(4):
        colour = [(0.8, 0.6, 0.1), (0.1, 0.3, 0.6), (0.6, 0.1, 0.1), (0.1, 0.5, 0.2)][k]
        at = (-0.35 + 0.012 * cos(1.6 * k), 0.15 + 0.012 * sin(1.6 * k), 0.006)
        pencil = tube(f"Pencil {k + 1}", at, 0.004, 0.17, material(f"Pencil {k}", colour), 6)
        pencil.rotation_euler = (0.11 * cos(1.6 * k + 1.57) * -1, 0.11 * cos(1.6 * k), 0)
    for k, (size, turn) in enumerate([((0.24, 0.17, 0.03), 8), ((0.22, 0.15, 0.025), -6), ((0.2, 0.14, 0.02), 15)]):
        box(f"Book {k + 1}", (-0.1, 0.12, [0, 0.03, 0.055][k]), size, [red, white, dark][k], 0.03, turn=turn)
    box("Screen", (-0.62, 0.3, 0.1), (0.5, 0.02, 0.3), dark, 0.05)
    quad(
        "Display", (-0.6, 0.299, 0.12), (0.46, 0, 0), (0, 0, 0.26), material("Display", (0.3, 0.5, 0.9), glow=2.0), 0.05
    )
    box("Stand", (-0.42, 0.29, 0), (0.1, 0.1, 0.1), dark, 0.05)
    tube("Tin", (0.48, 0.2, 0), 0.05, 0.12, material("Tin", (0.5, 0.5, 0.52)), 40, True)
    lamp("Desk lamp", "SPOT", (0.55, 0.05, 0.55), 12, (0.1, -0.02, 0), colour=(1, 0.86, 0.7), spot_size=1.5,
         spot_blend=0.3, shadow_soft_size=0.03)  # fmt: skip
    world((0.05, 0.055, 0.07))
    camera((0.35, -0.85, 0.55), (-0.03, 0.12, 0.05), 55)


CORNELL = {  # https://www.graphics.cornell.edu/online/box/data.html, mm
    "Floor": ("w", (552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)),
    "Light": ("l", (343, 548.7, 227), (343, 548.7, 332), (213, 548.7, 332), (213, 548.7, 227)),
    "Ceiling": ("w", (556, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)),
    "Back": ("w", (549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556, 548.8, 559.2)),
    "Right": ("g", (0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2)),
    "Left": ("r", (552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0)),
}
BLOCKS = {
    "Short": [
        [(130, 165, 65), (82, 165, 225), (240, 165, 272), (290, 165, 114)],
        [(290, 0, 114), (290, 165, 114), (240, 165, 272), (240, 0, 272)],
        [(130, 0, 65), (130, 165, 65), (290, 165, 114), (290, 0, 114)],
        [(82, 0, 225), (82, 165, 225), (130, 165, 65), (130, 0, 65)],
        [(240, 0, 272), (240, 165, 272), (82, 165, 225), (82, 0, 225)],
    ],
    "Tall": [
        [(423, 330, 247), (265, 330, 296), (314, 330, 456), (472, 330, 406)],
        [(423, 0, 247), (423, 330, 247), (472, 330, 406), (472, 0, 406)],
        [(472, 0, 406), (472, 330, 406), (314, 330, 456), (314, 0, 456)],
        [(314, 0, 456), (314, 330, 456), (265, 330, 296), (265, 0, 296)],
        [(265, 0, 296), (265, 330, 296), (423, 330, 247), (423, 0, 247)],
    ],
}


def cornell():
    """As typed, in units of 100 mm, each face its own four vertices."""
    paint = {
        "w": material("White", (0.737, 0.737, 0.738)), "r": material("Red", (0.493, 0.049, 0.051)),
        "g": material("Green", (0.068, 0.399, 0.086)), "l": material("Light", (1, 0.75, 0.45), glow=18.0),
    }  # fmt: skip

    def turned(corners):
        return [(a / 100, c / 100, b / 100) for a, b, c in corners[::-1]]

    for name, (key, *corners) in CORNELL.items():
        thing(name, turned(corners), [range(4)], paint[key])
    for name, faces in BLOCKS.items():
        corners = [corner for face in faces for corner in turned(face)]
        thing(name, corners, [range(4 * k, 4 * k + 4) for k in range(5)], paint["w"])
    camera((2.78, -8.0, 2.73), (2.78, 2.8, 2.73), 39.3)


def suzanne():
    white, floor = material("Wall", WHITE), material("Floor", (0.4, 0.32, 0.25))
    outline = [(0, 0), (6, 0), (6, 3), (3, 3), (3, 6), (0, 6)]
    thing("Floor", [(a, b, 0) for a, b in outline], [range(6)], floor, cut=0.2)
    thing("Ceiling", [(a, b, 2.8) for a, b in outline], [range(5, -1, -1)], white, cut=0.25)
    sides = [(k, (k + 1) % 6) for k in range(6)]
    vertices = [(a, b, c) for c in (0, 2.8) for a, b in outline]
    thing("Walls", vertices, [(j, i, i + 6, j + 6) for i, j in sides], [white], cut=0.25)
    primitive("Suzanne", bpy.ops.mesh.primitive_monkey_add, material("Clay", (0.6, 0.35, 0.25)), True, (1.4, 2.0, 0.5),
              (-35, 0, 25), size=1.2)  # fmt: skip
    primitive("Torus", bpy.ops.mesh.primitive_torus_add, material("Blue", (0.15, 0.3, 0.6)), True, (4.2, 1.4, 0.2),
              major_radius=0.6, minor_radius=0.2)  # fmt: skip
    lamp("Panel", "AREA", (1.5, 4.4, 2.75), 60, (1.5, 4.4, 0), shape="SQUARE", size=1.0)
    lamp("Bulb", "POINT", (4.9, 0.8, 2.0), 30, colour=(1, 0.7, 0.4), shadow_soft_size=0.1)
    camera((5.7, 0.3, 2.2), (1.4, 2.6, 0.6), 70)


def product():
    grey, red = material("Backdrop", (0.75, 0.75, 0.75)), material("Red", (0.6, 0.08, 0.06))
    bend = [(2.0 + 0.8 * sin(a), 0.8 - 0.8 * cos(a)) for a in np.linspace(0, pi / 2, 13)]
    profile = [*((-2 + 0.2 * k, 0.0) for k in range(20)), *bend, *((2.8, 1.0 + 0.2 * k) for k in range(11))]
    across, n = np.linspace(-2.5, 2.5, 26), len(profile)
    vertices = [(x, y, z) for x in across for y, z in profile]
    faces = [(i * n + k, (i + 1) * n + k, (i + 1) * n + k + 1, i * n + k + 1) for i in range(25) for k in range(n - 1)]
    thing("Backdrop", vertices, faces, grey, smooth=True)
    bottle = [
        (0, 0),
        (0.2, 0),
        (0.22, 0.02),
        (0.22, 0.55),
        (0.2, 0.63),
        (0.09, 0.75),
        (0.08, 0.95),
        (0.09, 0.96),
        (0, 0.96),
    ]
    lathe("Bottle", bottle, material("Glaze", (0.1, 0.35, 0.25)), 48, at=(-0.35, 0.2, 0))
    carton = box("Carton", (0.1, 0.1, 0), (0.5, 0.35, 0.7), red)
    carton.rotation_euler = (0, 0, radians(-20))
    bevel = carton.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.03, 4
    apply(carton)
    yellow = material("Yellow", (0.8, 0.55, 0.08))
    primitive("Ball", bpy.ops.mesh.primitive_uv_sphere_add, yellow, True, (0.05, -0.5, 0.18), radius=0.18,
              segments=48, ring_count=24)  # fmt: skip
    lamp("Key", "AREA", (-1.8, -1.4, 2.4), 80, (0, 0.2, 0.3), shape="SQUARE", size=1.2)
    lamp("Fill", "AREA", (2.2, -0.6, 1.2), 20, (0, 0.2, 0.3), colour=(0.8, 0.9, 1), shape="DISK", size=0.8)
    world((0.05, 0.05, 0.05))
    camera((0.2, -3.0, 1.1), (0.05, 0.3, 0.42), 40)


def level():
    rng = np.random.default_rng(11)
    floor, paints = material("Floor", (0.4, 0.4, 0.42)), [material(f"Crate {k}", c) for k, c in enumerate(
        [(0.5, 0.33, 0.18), (0.55, 0.55, 0.55), (0.2, 0.35, 0.5), (0.6, 0.2, 0.12)])]  # fmt: skip
    box("Hall", (0, 0, 0), (30, 30, 5), floor, inward=True)
    for k in range(150):
        size = rng.uniform(0.5, 2.2, 3) * (1, 1, 0.9)
        a, b = rng.uniform(1, 27, 2)
        box(f"Crate {k + 1}", (a, b, 0), size, paints[k % 4], turn=float(rng.uniform(0, 90)))
    for k in range(20):
        at = (3 + 6 * (k % 5) + rng.uniform(-1, 1), 3.5 + 7.5 * (k // 5) + rng.uniform(-1, 1), 3.6)
        colour = [(1, 0.8, 0.5), (0.6, 0.8, 1), (1, 1, 1)][k % 3]
        lamp(f"Lamp {k + 1}", "POINT", at, 100, colour=colour, shadow_soft_size=0.1)
    camera((1.0, 1.0, 4.4), (15, 17, 0.0), 75)


def height(x, y):
    return 2.2 * np.sin(0.21 * x + 0.4) * np.cos(0.17 * y) + 0.5 * np.sin(0.7 * x) * np.sin(0.6 * y + 1)


def terrain():
    n, side = 80, 40.0
    line = np.linspace(0, side, n)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    k = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack([k, k + 1, k + n + 1, k + n], axis=1).tolist()
    thing("Terrain", np.stack([x, y, height(x, y)], axis=1), faces, material("Meadow", (0.25, 0.33, 0.13)), smooth=True)
    wall, roof, rng = material("Wall", (0.7, 0.65, 0.55)), material("Roof", (0.45, 0.16, 0.1)), np.random.default_rng(3)
    for i in range(10):
        a, b = 6 + 7 * (i % 5) + rng.uniform(-1.5, 1.5), 10 + 14 * (i // 5) + rng.uniform(-3, 3)
        house(
            f"House {i + 1}", (a, b, height(a, b) - 0.9), (3.2, 2.6, 2.9), float(rng.uniform(0, 360)), wall, roof, 0.5
        )
    lamp("Sun", "SUN", (0, 0, 20), 4, (14, 9, 9), colour=(1, 0.93, 0.82), angle=radians(0.526))
    world((0.35, 0.55, 0.95), 0.7)
    camera((4, -8, 14), (19, 18, 0), 55)


SCENES = {
    f.__name__: f
    for f in (kitchen, attic, gallery, dungeon, stairs, street, desk, cornell, suzanne, product, level, terrain)
}


def build(name, path):
    """Saves the scene as a .blend."""
    bpy.ops.wm.read_homefile(use_empty=True)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 960, 600, 100
    SCENES[name]()
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
