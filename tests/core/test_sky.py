"""Maps of the sky: what they give, and the suns taken out of them."""

import numpy as np
import pytest

from pdm_core import Plane, Scene, Surface
from pdm_core.shapes.shape import lattice
from pdm_core.sky import SkyMap, directions_of, places_on_map, reduced, solid_angles, without_suns


def test_pixels_are_where_they_are_looked_up():
    directions = directions_of(16, 32)
    u, v = places_on_map(directions)
    assert np.allclose(u * 32, np.arange(32) + 0.5) and np.allclose((v * 16).T, np.arange(16) + 0.5)
    assert np.isclose(solid_angles(16, 32).sum() * 32, 4 * np.pi)
    values = np.random.default_rng(1).uniform(size=(16, 32, 3))
    assert np.allclose(SkyMap(values)(directions.reshape(-1, 3)), values.reshape(-1, 3))


def test_a_map_of_a_smooth_sky_is_that_sky():
    sky = directions_of(128, 256) @ np.array([[0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.5]]) + 1
    directions = lattice(500)
    assert np.abs(SkyMap(sky)(directions) - (directions * [0.3, 0.2, 0.5] + 1)).max() < 2e-4
    scene = Scene([Surface(Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)))], SkyMap(sky))
    assert np.allclose(scene.background, 1, atol=1e-3) and scene.sky_at(directions).shape == (500, 3)


@pytest.mark.parametrize("degrees", [0.5, 2.0])
def test_a_sun_is_taken_out(degrees):
    directions = directions_of(512, 1024)
    towards = np.array([0.5, -0.6, 0.7]) / np.linalg.norm([0.5, -0.6, 0.7])
    values = np.full((512, 1024, 3), 0.2)
    disc = directions @ towards > np.cos(np.radians(degrees / 2))
    if not disc.any():
        disc.ravel()[np.argmax(directions @ towards)] = True
    values[disc] = [4000, 3000, 2000]
    sent = (values * solid_angles(512, 1024)[..., None]).sum(axis=(0, 1))
    rest, (sun,) = without_suns(values, "Sun")
    assert np.allclose(rest, 0.2) and sun.name == "Sun"
    assert np.allclose(sun.colour, sent - 0.2 * 4 * np.pi, rtol=1e-3)
    assert np.linalg.norm(-sun.direction - towards) < np.radians(0.2)
    assert abs(np.degrees(sun.angle) - degrees) < 0.3


def test_a_sky_without_a_sun_stays():
    values = directions_of(64, 128) + 1.0
    assert without_suns(values)[1] == []
    softbox = np.full((64, 128, 3), 0.1)
    softbox[40:50, 20:40] = 20  # bright, but large
    rest, suns = without_suns(softbox)
    assert suns == [] and np.array_equal(rest, softbox)
    assert np.allclose(reduced(softbox, 32).mean(axis=(0, 1)), softbox.mean(axis=(0, 1)))
