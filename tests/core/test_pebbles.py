"""Small things on large ones: no bound of a field's cells may keep a scene from being solved."""

import numpy as np
import pytest
from places import PLACES, Place

from pdm_core import Scene, Sphere, Surface, solve


@pytest.mark.parametrize("radius", [0.01, 1e-3, 1e-5])
@pytest.mark.parametrize("place", PLACES)
def test_a_pebble_on_a_floor(radius, place):
    """Its top sees half of the sky and nothing else; cells as small as the contact are deeper than cells go."""
    place = Place(*PLACES[place])
    surfaces = [Surface(Sphere.at(place((0.2, 0.1, radius)), radius), 0.5)]
    surfaces += place.sheet((-3, -3, 0), (6, 0, 0), (0, 6, 0), reflectance=0.5)
    solution = solve(Scene(surfaces, 1.0), 0.01, time_limit=10)
    assert solution.radiance(0, place([(0.2, 0.1, 2 * radius)])) == pytest.approx(0.5, rel=0.01)
    floor = place(np.random.default_rng(0).uniform((-3, -3, 0), (3, 3, 0), (200, 3)))
    assert solution.radiance(1, floor).max() <= 0.5 * 1.01 and solution.error <= 0.01


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1.0, 1e4])
def test_a_dome_about_what_it_covers(size):
    """Two bounding spheres with one centre: numpy warned of an overflow in large scenes."""
    place = Place()
    dome = Surface(Sphere.at((0, 0, 0), 2 * size), side="back")
    sheets = [place.plane((-size, -size, z * size), (2 * size, 0, 0), (0, 2 * size, 0)) for z in (0, 0.5)]
    surfaces = [Surface(sheets[0], 0.8, 1.0), Surface(sheets[1], 0.8, side="back")]
    found, alone = (solve(Scene(part), 0.01).radiance(0, (0, 0, 0)) for part in ([*surfaces, dome], surfaces))
    assert found == pytest.approx(alone, rel=0.01)
