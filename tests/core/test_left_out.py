"""What the plan leaves out changes nothing but the time: done all the same, the light is the same."""

import numpy as np
import pytest
from rooms import cube_planes

from pdm_core import Scene, Sphere, Surface, plan, solve
from pdm_core.left_out import ITEMS, approach_with, left_out, seconds_steps
from pdm_core.signs_of_life import finish

TARGET = 0.02


def room():
    """Grey, closed, two balls, one of them the lamp; the back of one wall looks at nothing."""
    surfaces = [Surface(plane, 0.5) for plane in cube_planes()]
    surfaces += [Surface(Sphere.at((0, 0, 2), 0.4), 0.0, 10.0), Surface(Sphere.at((0.5, 0.5, -1), 0.8), 0.7)]
    surfaces.append(Surface(cube_planes()[0], 0.5, side="back"))
    return Scene(surfaces)


def test_both_are_left_out_of_a_grey_closed_room():
    assert left_out(plan(room())) == list(ITEMS)
    coloured = [Surface(plane, (0.5, 0.1 * k, 0.2), (1, 2, k)) for k, plane in enumerate(cube_planes())]
    assert left_out(plan(Scene(coloured))) == []


@pytest.mark.parametrize("what", list(ITEMS))
def test_done_all_the_same_the_light_is_the_same(what):
    scene = room()
    reference = solve(scene, TARGET)
    approach = approach_with(scene, TARGET, what)
    finish(approach.steps())
    other = approach.best
    points = np.random.default_rng(0).uniform(-3, 3, (100, 3))
    for k in (0, 2, 7):
        one, two = reference.incident(k, points), other.incident(k, points)
        assert np.linalg.norm(one - two) < 2 * TARGET * np.linalg.norm(one)
    seconds, error = finish(seconds_steps(scene, TARGET, what))
    assert seconds > 0 and error <= TARGET
