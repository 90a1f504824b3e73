"""Floors' vertices that nobody sees, below what stands there, do not darken the faces that reach out from there."""

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix
from test_bake import bake
from test_cases import sky

HALF = 0.45  # m, of what stands in the middle; the floor's vertices are .25 m apart


def crate():
    return scenes.box("Stands", 2 * HALF, Matrix.Translation((0, 0, HALF)), scenes.material("Crate", (0.5, 0.4, 0.3)))


def drum(open_below=False):
    def build(b):
        scenes.bmesh.ops.create_cone(
            b, cap_ends=True, segments=24, radius1=HALF, radius2=HALF, depth=1.0,
            matrix=Matrix.Translation((0, 0, 0.5)),
        )  # fmt: skip
        down = [face for face in b.faces if face.normal.z < -0.5]
        scenes.bmesh.ops.delete(b, geom=down if open_below else [], context="FACES_ONLY")

    return scenes.add("Stands", build, made_of=scenes.material("Drum", (0.5, 0.4, 0.3)))


def open_drum():
    """Its hollow is black, not within a body."""
    return drum(True)


def sunk_ball():
    return scenes.sphere("Stands", 32, 16, 0.6, Matrix.Translation((0, 0, 0.3)), scenes.material("Ball"))


def floor_colours(floor):
    """(vertices a side, vertices a side, 3) of the floor, by x and y, and their distance from the middle along x, y."""
    x, y, _ = scenes.vertices(floor).T
    by_corner = np.array([loop.vertex_index for loop in floor.data.loops])
    colours = scenes.colours(floor)[:, :3]
    if len(colours) == len(by_corner):
        each = np.zeros((len(x), 3))
        each[by_corner] = colours
        colours = each
    order = np.lexsort((y, x))
    side = round(len(x) ** 0.5)
    return colours[order].reshape(side, side, 3), np.abs(np.stack([x, y])[:, order]).reshape(2, side, side)


@pytest.mark.parametrize("what", [crate, drum, open_drum, sunk_ball])
def test_faces_that_reach_out_from_below_are_not_darkened(what):
    floor = scenes.grid("Floor", 16, 4.0, made_of=scenes.material("Floor", (0.6, 0.5, 0.4)))
    what()
    sky()
    bake(target_error=0.04)
    colours, (x, y) = floor_colours(floor)
    below = np.hypot(x, y) < HALF if what in (drum, open_drum) else np.maximum(x, y) < HALF
    if what is sunk_ball:
        below = np.hypot(x, y) < np.sqrt(0.6**2 - 0.3**2)
    inner = np.maximum(x, y) < 0.1  # all of its faces are below
    assert below.sum() >= 9 and inner.sum() == 1 and (colours[inner] == 0).all()
    seen = colours[~below]
    assert (colours[below & ~inner] > 0.9 * seen.min(axis=0)).all() and seen.min() > 0.05


def test_what_is_seen_in_the_dark_stays_dark():
    """Below a screen, in a lamp's full shadow, with nothing that reflects light to it."""
    floor = scenes.grid("Floor", 16, 4.0, made_of=scenes.material("Floor", (0.6, 0.5, 0.4)))
    scenes.grid("Screen", 1, 1.8, Matrix.Translation((0, 0, 1)), scenes.material("Screen", (0, 0, 0)))
    lamp = bpy.data.objects.new("Point", bpy.data.lights.new("Point", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size, lamp.location = 100.0, 0.0, (0, 0, 4.0)
    bpy.context.collection.objects.link(lamp)
    bake(target_error=0.04)
    colours, (x, y) = floor_colours(floor)
    assert (colours[np.maximum(x, y) < 1.15] == 0).all() and (colours[np.maximum(x, y) > 1.3] > 0).all()
