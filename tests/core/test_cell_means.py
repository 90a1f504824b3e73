"""Cells send their own light in the mean: what is interpolated between their middles makes none brighter or darker."""

import numpy as np
import pytest

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.rays.check import Check
from pdm_core.rays.engine import RayState
from pdm_core.rays.lattice import QUARTERS
from pdm_core.signs_of_life import finish


def room(turn, size, lamp):
    """A closed box of 2 x 2 x 2 sizes, a ball in it and a lamp below its ceiling."""
    x, y, z = 2 * size * turn.T
    o = np.zeros(3)
    faces = [(o, x, y), (o + z, y, x), (o, y, z), (o, z, x), (o + y, x, z), (o + x, z, y)]
    surfaces = [Surface(Plane(*face), 0.7) for face in faces]
    surfaces.append(Surface(Sphere.at(0.3 * (x + y + z), 0.2 * size), 0.5))
    return Scene([*surfaces, Surface(Sphere.at(0.5 * (x + y) + lamp * z, 0.05 * size), 0.0, 10.0)])


@pytest.mark.parametrize("size, lamp", [(1e-3, 0.9), (1.0, 0.5), (1e4, 0.75)])
def test_what_is_interpolated_is_the_light_of_cells_in_their_mean(size, lamp):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    state = RayState(room(turn, size, lamp), 0.04)
    finish(state.extend(np.full(len(state.nodes), -1)))
    finish(state.solve())
    nodes, light = state.nodes, state.nodes.reflectance * state.received
    node, weight = nodes.parted.columns(*nodes.lattice.middles(np.arange(QUARTERS * len(nodes.lattice))))

    def off(value):
        """How far off the means of what is interpolated between values (k, 3) are, in L2."""
        mean = np.einsum("hk,hkc->hc", weight, value[node]).reshape(-1, QUARTERS, 3).mean(axis=1)
        return np.sqrt((nodes.weight[:, None] * (mean - light) ** 2).sum())

    assert off(state.sent) < 0.5 * off(light)


def test_what_has_not_changed_is_not_worked_out_again():
    state = RayState(room(np.eye(3), 1.0, 0.5), 0.04)
    check = Check(state)
    finish(state.extend(np.full(len(state.nodes), -1)))
    for _ in range(2):
        finish(state.solve())
        finish(check.measure())
    once, sent, passed = state.counts["iterations"], state.sent, check.passed
    state.read *= 2
    finish(state.solve())
    finish(check.measure())
    assert state.counts["iterations"] == once and check.passed is passed
    state.link()
    finish(state.solve())
    finish(check.measure())
    assert state.counts["iterations"] == 2 * once and check.passed is not passed
    np.testing.assert_array_equal(state.sent, sent)
    np.testing.assert_array_equal(check.passed, passed)
