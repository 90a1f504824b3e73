"""Meshes of no thickness: faces that look opposite ways lie on each other, as of a ball or a crate scaled to nothing.

Rays met either of them, of those which lie in one plane, and its back is black; of faces at the same corners the later
was left out, whichever way it looks.
"""

from itertools import product

import numpy as np
import pytest
from places import each_somewhere
from test_mesh import CUBE, CUBE_FACES, ball
from test_rays_cases import by_rays

from pdm_core import Mesh, Scene, SunLight, Surface, solve

PAPER = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


@each_somewhere("smooth, squashed", product([True, False], [(1, 1, 0), (1, 1, 1e-11), (0.6, 0, 0.8)]))
def test_a_ball_flattened_to_nothing_in_a_furnace(place, squashed, smooth):
    vertices, faces = ball(8)
    disc = Mesh(place(0.5 * vertices * squashed + (0, 0, 0.6)), faces, smooth)
    floor = place.plane((-2, -2, 0), (4, 0, 0), (0, 4, 0))
    solution = by_rays(Scene([Surface(floor, 0.5, 0.5), Surface(disc, 0.7, 0.3)], 1.0))
    for k, shape in enumerate((floor, disc)):
        assert np.abs(solution.radiance(k, shape.spread(200)) - 1).max() < 1e-3


LAMPS = {
    "crate": (CUBE * (1, 1, 0), CUBE_FACES, ["front"]),
    "crate of both sides": (CUBE * (1, 1, 0), CUBE_FACES, ["front", "back"]),
    "two faces": (PAPER, [[0, 1, 2, 3], [3, 2, 1, 0]], ["front"]),
    "two faces of both sides": (PAPER, [[0, 1, 2, 3], [3, 2, 1, 0]], ["front", "back"]),
}


@each_somewhere("lamp", LAMPS)
def test_a_lamp_of_no_thickness_shines_both_ways_once(place, lamp):
    vertices, faces, sides = LAMPS[lamp]
    walls = [
        Surface(place.plane((-2, -2, 0), (5, 0, 0), (0, 5, 0)), 0.5),
        Surface(place.plane((-2, -2, 2), (0, 5, 0), (5, 0, 0)), 0.5),
    ]
    mesh = Mesh(place(vertices * (1, 1, 0) + (0, 0, 0.8)), faces, False)
    found = by_rays(Scene(walls + [Surface(mesh, emission=10, side=side) for side in sides]), 0.02)
    right = solve(Scene(walls + place.sheet((0, 0, 0.8), (1, 0, 0), (0, 1, 0), emission=10)), 0.005)
    for k in range(2):
        points = walls[k].shape.spread(100)
        assert np.abs(found.radiance(k, points) / right.radiance(k, points) - 1).mean() < 0.015


@pytest.mark.parametrize("back", [[(3, 2, 1, 0)], [(3, 1, 0), (3, 2, 1)], [(2, 1, 0), (0, 3, 2)]])
def test_each_of_two_faces_back_to_back_receives_on_its_own_side(back):
    """Faces that share their corners, cut alike or not: which is nearest to a corner is told by the normal alone."""
    sheet = Mesh([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], [*back, (0, 1, 2), (0, 2, 3)])
    sun = SunLight((0, 0, -1), np.pi)
    solution = by_rays(Scene([Surface(sheet, 0.5)], lights=(sun,)))
    corners, middle = np.array(sheet.vertices), np.tile([0.5, 0.5, 1.0], (4, 1))
    up, down = (solution.radiance(0, corners, np.tile([0.0, 0, way], (4, 1)), middle) for way in (1, -1))
    assert up == pytest.approx(0.5, rel=1e-6) and (down == 0).all()
