"""Narrow gaps by rays: a lamp that shines both ways a millimetre below a ceiling, where no cell can be so small."""

import sys
from pathlib import Path

import numpy as np
import pytest

from pdm_core import Plane, Polygon, Scene, Surface
from pdm_core.rays.engine import RayState
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from tracer import Tracer  # noqa: E402

SIZE, WHITE, GREY, EMITTED = 5.5, 0.737, 0.6, 18.0
TURNS = [np.eye(3), np.linalg.qr(np.array([[0.9, -0.4, 0.1], [0.3, 0.8, 0.5], [-0.3, -0.4, 0.9]]))[0]]


def square(corners, turn, polygon):
    corners = np.asarray(corners, float) @ turn.T
    if polygon:
        return Polygon(corners)
    return Plane(corners[0], corners[1] - corners[0], corners[3] - corners[0])


def room(gap, turn, polygon):
    """A box without a front, its ceiling second, and the lamp's two sides last."""
    s, h = SIZE, SIZE - gap
    walls = [
        [(0, 0, 0), (s, 0, 0), (s, s, 0), (0, s, 0)],
        [(0, 0, s), (0, s, s), (s, s, s), (s, 0, s)],
        [(0, 0, 0), (0, s, 0), (0, s, s), (0, 0, s)],
        [(s, 0, 0), (s, 0, s), (s, s, s), (s, s, 0)],
        [(0, s, 0), (s, s, 0), (s, s, s), (0, s, s)],
    ]
    lamp = [(2.1, 2.2, h), (2.1, 3.25, h), (3.4, 3.25, h), (3.4, 2.2, h)]
    turn = turn * np.sign(np.linalg.det(turn))
    surfaces = [Surface(square(wall, turn, polygon), WHITE) for wall in walls]
    lamp = square(lamp, turn, polygon)
    surfaces += [Surface(lamp, GREY, EMITTED, side=side) for side in ("front", "back")]
    return Scene(surfaces, rounding=2**-24), turn


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("polygon", [False, True])
def test_light_in_a_narrow_gap_is_none_beside_it(turn, polygon):
    scene, turn = room(1e-3, turn, polygon)
    solution = finish(ray_steps(scene, 0.02, None, "asked for"))
    assert solution.error <= 0.02
    # between parallel planes without end, but for what leaves at the rims
    within = np.array([[2.7, 2.7, SIZE], [2.14, 2.5, SIZE], [3.36, 3.21, SIZE]]) @ turn.T
    held = finish(solution.held_steps(np.ones(3, int), within))[:, 0] * WHITE
    endless = WHITE * EMITTED / (1 - WHITE * GREY)
    assert (held > 0.9 * endless).all()
    assert (held < 1.02 * endless).all()
    # a wall's light as a path tracer tells it: the ceiling beside the lamp sends no light of the gap
    places = np.array([[2.78, SIZE, 2.7], [0.3, SIZE, 0.3], [2.7, 2.7, 0.0], [1.0, 1.0, 0.0]]) @ turn.T
    surface = np.array([4, 4, 0, 0])
    traced = Tracer(scene).incident(surface, places, 4000, np.random.default_rng(1))[:, 0]
    np.testing.assert_allclose(solution.incident(surface, places)[:, 0], traced, rtol=0.035)


def test_where_light_jumps_at_what_stands_there_cells_are_not_bent():
    floor = Plane((0, 0, 0), (4, 0, 0), (0, 4, 0))
    wall = Plane((2.3, 0, 0), (0, 4, 0), (0, 0, 1))
    surfaces = [Surface(floor, 0.5), *(Surface(wall, 0.5, side=side) for side in ("front", "back"))]
    nodes = RayState(Scene(surfaces, 1.0), 0.04).nodes
    lattice = nodes.lattice
    mine = np.flatnonzero(lattice.chart == 0)
    middle = nodes.parted.centre[mine, 0] * 4 > 2.3
    value = np.zeros((len(nodes), 3))
    value[mine] = np.where(middle, 1.0, 0.2)[:, None]
    cells, _ = nodes.surplus(value, np.zeros(len(nodes)))
    assert np.abs(lattice.surplus(value[: len(lattice)], np.zeros(len(lattice))))[mine].max() > 0.1
    np.testing.assert_allclose(cells[mine], 0.0, atol=1e-12)
