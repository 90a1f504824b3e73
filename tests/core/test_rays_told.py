"""How far off what rays tell is said to be, where a closed form tells: not by luck, whatever their number."""

import numpy as np
import pytest

from pdm_core import Plane, Polygon, Scene, Surface
from pdm_core.rays.engine import RayState
from pdm_core.rays.placed import Placed
from pdm_core.rays.rows import Gathered, Traced, directions
from pdm_core.signs_of_life import finish

RECEIVERS = 1000


@pytest.mark.parametrize("rays", [96, 256, 512, 960, 1024])
def test_what_is_told_of_a_sky_through_a_hole_is_what_is_off(rays):
    """A floor below a hole in a ceiling: one way of halving against one of quarters told 1.3 times as much of 1024."""
    size = np.array([6.0, 5.0, 3.0])
    (x, y, z), o = np.diag(size), np.zeros(3)
    hole = Plane((1, 1, 3), (0, 2, 0), (3, 0, 0))
    walls = [Plane(*edges) for edges in ((o, x, y), (o, y, z), (o, z, x), (o + y, x, z), (o + x, z, y))]
    ceiling = Polygon(np.array([o, y, x + y, x]) + z, [hole.corners])
    scene = Scene([Surface(shape, 0.5) for shape in (*walls, ceiling)], 1.0)
    state = RayState(scene, 0.04)
    at = np.column_stack([np.random.default_rng(1).random((RECEIVERS, 2)) * size[:2], np.zeros(RECEIVERS)])
    places, traced = Placed(state.facets, np.zeros(RECEIVERS, int), at), Traced(RECEIVERS, directions(rays))
    steps = traced.trace(state.facets, lambda rows, _: places.take(rows), np.arange(RECEIVERS))
    finish(steps)
    rows = Gathered(traced, state.nodes, scene)
    exact = hole.unhidden(at, np.tile([0.0, 0, 1], (RECEIVERS, 1)), 1, 1e-9)
    told = np.linalg.norm(rows.unsure(np.zeros((len(state.nodes), 3)), np.ones(RECEIVERS))[0])
    assert 0.8 < told / np.linalg.norm(rows.sky - exact[:, None]) < 1.2
