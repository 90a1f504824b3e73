"""Form factors whose integrand peaks where no node may be: both sides of a pair agree, or the error says so."""

import numpy as np
import pytest
from rooms import both_sides

from pdm_core import Plane, Scene, Sphere, Surface, form_factors


def reciprocity(scene, result):
    """Greatest difference of the two sides of a pair, of what their errors allow."""
    area = scene.areas[:, None]
    exchange, bound = area * result.F, area * result.error
    return (np.abs(exchange - exchange.T) / (bound + bound.T + 1e-15 * area.max())).max()


def on_axis(size, height, radius):
    """From a ball over the middle of a square: the square's solid angle as seen from the ball's centre, exactly."""
    half = size / 2
    return 4 * np.arctan(half * half / (height * np.sqrt(2 * half * half + height * height))) / (4 * np.pi)


@pytest.mark.parametrize("height, radius", [(0.5, 0.1), (0.06, 0.05), (2.0, 0.5), (0.11, 0.1), (5.0, 0.01)])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_small_ball_over_a_large_floor(height, radius, scale):
    floor = Plane(scale * np.array([-10, -10, 0]), (20 * scale, 0, 0), (0, 20 * scale, 0))
    scene = Scene([Surface(floor), Surface(Sphere.at((0, 0, height * scale), radius * scale))])
    result = form_factors(scene)
    right = on_axis(20, height, radius)
    assert result.F[1, 0] == pytest.approx(right, rel=1e-4)
    assert result.F[0, 1] == pytest.approx(right * 4 * np.pi * radius**2 / 400, rel=2e-4)
    assert reciprocity(scene, result) <= 1.01


def test_balls_anywhere_over_large_floors():
    rng = np.random.default_rng(7)
    for _ in range(12):
        radius = 10 ** rng.uniform(-2, 0)
        centre = [*rng.uniform(-9, 9, 2), radius * 10 ** rng.uniform(0.01, 1)]
        scene = Scene([Surface(Plane((-10, -10, 0), (20, 0, 0), (0, 20, 0))), Surface(Sphere.at(centre, radius))])
        result = form_factors(scene)
        exchange = scene.areas[:, None] * result.F
        assert exchange[0, 1] == pytest.approx(exchange[1, 0], rel=3e-4)


def test_ball_in_a_long_room():
    room = [
        Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)),
        Plane((0, 0, 1000), (0, 1, 0), (1, 0, 0)),
        Plane((0, 0, 0), (0, 1, 0), (0, 0, 1000)),
        Plane((1, 0, 0), (0, 0, 1000), (0, 1, 0)),
        Plane((0, 0, 0), (0, 0, 1000), (1, 0, 0)),
        Plane((0, 1, 0), (1, 0, 0), (0, 0, 1000)),
    ]
    scene = Scene([*(Surface(p) for p in room), Surface(Sphere.at((0.5, 0.5, 300), 0.3))])
    result = form_factors(scene, 1e-3)
    assert result.F.sum(axis=1) == pytest.approx(1, abs=1e-3)
    assert result.F[2:6, 6] == pytest.approx(0.25 * 4 * np.pi * 0.09 / 1000, rel=5e-3)
    assert reciprocity(scene, result) <= 1.01


def test_what_is_integrated_from_both_sides_agrees_to_its_errors():
    rng = np.random.default_rng(3)
    for _ in range(4):
        screen = Plane(rng.uniform(-1, 1, 3) + [0, 0, 2], *rng.normal(size=(2, 3)))
        surfaces = [Surface(Plane((-3, -3, 0), (6, 0, 0), (0, 6, 0))), *both_sides(screen)]
        surfaces.append(Surface(Sphere.at([*rng.uniform(-2, 2, 2), 5], 10 ** rng.uniform(-1, 0))))
        scene = Scene(surfaces)
        assert reciprocity(scene, form_factors(scene, 1e-3)) <= 1.01
