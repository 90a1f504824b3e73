"""Rooms of white walls with a lamp close to the ceiling: all that shines is taken up somewhere."""

import numpy as np
import pytest
from places import Place
from test_contacts import mean

from pdm_core import Scene, Surface, solve


@pytest.mark.parametrize(("reflectance", "size"), [(0.95, 1.0), (0.9, 1e-3)])
def test_light_is_not_lost_in_white_rooms(reflectance, size):
    """What links lose is amplified by so many reflections: half of the light was, for any time at targets of 4 %."""
    place = Place(0.4, (3, -2, 1))
    room = place.box((0, 0, 0), size * np.array([4, 4, 3]), inward=True, reflectance=reflectance)
    shape = place.plane(size * np.array([1.5, 1.5, 2.9]), (0, size, 0), (size, 0, 0))
    lamp = [Surface(shape, emission=10), Surface(shape, side="back")]
    solution = solve(Scene([*room, *lamp]), 0.04, time_limit=20)
    assert solution.error <= 0.04
    areas = solution.scene.areas
    taken = sum((1 / reflectance - 1) * areas[k] * mean(solution, k) for k in range(6))
    for k in (6, 7):
        points = solution.scene.surfaces[k].shape.spread(200)
        taken += areas[k] * solution.incident(k, points)[:, 0].mean()
    assert taken == pytest.approx(10 * size**2, rel=0.04)
