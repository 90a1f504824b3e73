"""Openness against closed forms: a wall beside a floor, a ball over it, a closed room."""

import numpy as np
from rooms import cube_planes, scene_of

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.openness import openness_steps
from pdm_core.signs_of_life import finish

FLOOR = Plane((-50, -50, 0), (100, 0, 0), (0, 100, 0))


def openness(scene, points, *distances):
    points = np.array(points, float)
    return finish(openness_steps(scene, np.zeros(len(points), int), points, distances))


def test_a_wall_hides_half_of_the_sky():
    wall = Plane((0, -40, 0), (0, 80, 0), (0, 0, 40))
    found = openness(Scene([Surface(FLOOR), Surface(wall)]), [(0.01, 0, 0), (-0.01, 0, 0), (10, 0, 0)], np.inf)[:, 0]
    # nearly all of a quarter sphere; from farther the infinite strip: (1 - cos of its top) / 2
    assert np.abs(found[:2] - 0.5).max() < 0.02
    assert abs(found[2] - (1 - (1 - 10 / np.hypot(10, 40)) / 2)) < 0.02


def test_a_ball_overhead():
    ball = Sphere.at((0, 0, 2), 1)
    scene = Scene([Surface(FLOOR), Surface(ball)])
    found = openness(scene, [(0, 0, 0)], np.inf, 0.5, 1.5)
    assert np.abs(found[0, 0] - 0.75) < 0.02 and found[0, 1] == 1  # r^2 / d^2 is hidden
    assert 0.75 < found[0, 2] < 0.95  # the near part of it alone


def test_of_a_closed_room_only_what_is_near_counts():
    scene = scene_of(cube_planes())
    found = openness(scene, [(0, 0, -3), (-2.9, 0, -3)], np.inf, 7.0, 2.0, 0.0)
    assert not found[:, 0].any()
    assert found[0, 2] == 1 and 0.4 < found[1, 2] < 0.7  # a wall at hand
    assert (np.diff(found, axis=1) >= 0).all() and (found[:, 3] == 1).all()


def test_what_lies_under_a_thing_is_not_open():
    """However near one looks: rays that what lies against a point swallows went to any face of the scene."""
    lid = Plane((0, 0, 0), (0, 1, 0), (1, 0, 0))  # looks down, in the floor's plane
    far = Plane((0, 0, -9), (1, 0, 0), (0, 1, 0))
    found = openness(Scene([Surface(s) for s in (FLOOR, lid, far)]), [(0.5, 0.5, 0), (3, 3, 0)], 0.1, 1.0, np.inf)
    np.testing.assert_array_equal(found, [[0, 0, 0], [1, 1, 1]])
