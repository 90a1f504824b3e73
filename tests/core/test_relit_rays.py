"""A solution by rays under other light: right, and what is stated holds, from nothing, to next to nothing."""

from dataclasses import replace

import numpy as np
import pytest
from rooms import cube_planes

from pdm_core import Mesh, PointLight, Scene, Surface, solve

CORNERS = 0.7 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) - 1
ROCK = Mesh(CORNERS, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
SURFACES = [*(Surface(plane, 0.5) for plane in cube_planes()), Surface(ROCK, 0.6)]
POINTS = np.random.default_rng(0).uniform(-2.9, 2.9, (30, 3))

TARGET = 0.08


def scene(watts, shining=(), sky=0.0):
    lit = [replace(s, emission=1.0 if k in shining else 0.0) for k, s in enumerate(SURFACES)]
    return Scene(lit, sky, lights=[PointLight((1, 1.5, 2), watts, 0.1)])


def light(solution):
    return np.array([solution.radiance(k, POINTS) for k in (0, 2, 5)])


@pytest.fixture(scope="module")
def solved():
    return solve(scene(300.0), TARGET)


@pytest.mark.parametrize("factor", [1e-12, 0.1, 10, 1e9])
def test_what_is_stated_does_not_depend_on_how_bright_it_is(solved, factor):
    """Light that no point of a lamp stands for, a tenth here, stayed that of the light which it was found for."""
    state = solved._state
    before, state.lit.lost = state.lit.lost, 0.1 * np.linalg.norm(state.lit.direct, axis=1)
    alike, relit = (solved.relight(scene(300.0 * f)) for f in (1, factor))
    state.lit.lost = before
    np.testing.assert_allclose(light(relit) / factor, light(solved), rtol=1e-3)
    assert relit.error == pytest.approx(alike.error, rel=0.01) and relit.error > solved.error


def test_a_wall_that_begins_to_shine(solved):
    other = scene(300.0, (2,))
    relit, right = solved.relight(other), solve(other, 0.05)
    measured = np.linalg.norm(light(relit) - light(right)) / np.linalg.norm(light(right))
    assert measured <= relit.error + right.error and relit.error <= TARGET
