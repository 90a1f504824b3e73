"""Lamps partly within white balls: what is seen of them from within few points tell, and the ball amplifies it."""

import sys
from pathlib import Path

import numpy as np
import pytest

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.rays.direct import _set
from pdm_core.rays.placed import Placed
from pdm_core.rays.quadrics import Quadrics
from pdm_core.read_off import spread_points
from pdm_core.shapes.shape import lattice, square_lattice
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from variants import solve_by_links, solve_by_rays  # noqa: E402


def ellipsoid(rng):
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.2, 1, 3)
    way = rng.normal(size=3)
    matrix[:3, 3] = way / np.linalg.norm(way) * rng.uniform(0.8, 1.5)
    return Sphere(matrix)


def furnace(rng):
    """A white ball and an ellipsoid that shines and is partly within it: radiance is 1 everywhere."""
    lamp, rho = ellipsoid(rng), rng.uniform(0.8, 0.97)
    shapes = (Sphere.at((0, 0, 0), 1.0), rho), (lamp, 0.12)
    surfaces = [Surface(s, rho, 1 - rho, side=side) for s, rho in shapes for side in ("front", "back")]
    return Scene(surfaces, background=1.0)


def off(solution):
    """Relative L2 error of L - Le at points of each surface."""
    scene, square, light = solution.scene, 0.0, 0.0
    for k in range(len(scene)):
        points = spread_points(scene, np.full(400, k), np.random.default_rng(1))
        radiance = solution.radiance(np.full(400, k), points)[:, 0]
        square += scene.areas[k] * ((radiance - 1) ** 2).mean()
        light += scene.areas[k] * (1 - scene.emission[k, 0]) ** 2
    return np.sqrt(square / light)


@pytest.mark.parametrize(("seed", "target"), [(30, 0.05), (33, 0.05), (101, 0.01)])
def test_what_is_stated_holds_what_is_measured(seed, target):
    scene = furnace(np.random.default_rng(seed))
    solution = solve_by_rays(scene, target, None)
    assert off(solution) <= solution.error


@pytest.mark.parametrize("points", [64, 1024])
def test_as_much_is_seen_by_many_points_as_by_few(points):
    """Where points outnumber places, lines begin at the places, which lie on the ball that hides some."""
    scene = furnace(np.random.default_rng(112))
    state = solve_by_rays(scene, 0.05, None)._state
    x = lattice(300)
    x = x[(scene.surfaces[2].shape.local(x) ** 2).sum(axis=1) > 1.1]
    places = Placed(state.facets, np.ones(len(x), int), x)  # inside
    found = finish(state.lit.shares.at(places, 1e-9, 1e-9, (points, points)))[0]
    # of the light that leaves what of the lamp is within, which all comes to the ball
    lamp = scene.surfaces[2].shape
    y = lamp.spread(40_000)
    within = lamp.area_shares(y)[(y**2).sum(axis=1) < 1].sum()
    lamp_only = [k for k, s in enumerate(state.lit.sources) if s.name == scene.surfaces[2].name]
    assert len(lamp_only)
    mean = found[:, lamp_only, 0].sum(axis=1).mean() * len(x) / 300 * 4 * np.pi
    np.testing.assert_allclose(mean, within, rtol=0.06)


def test_what_samples_of_an_ellipsoid_stand_for():
    shape = Sphere(np.diag([0.2, 0.5, 1.0, 1.0]))
    points = shape.samples(2000)
    shares = shape.area_shares(points)
    z, a = np.linspace(-1, 1, 2001)[1:] - 5e-4, np.linspace(0, 2 * np.pi, 201)[1:]
    ring = np.sqrt(1 - z**2)[:, None]
    unit = np.stack([ring * np.cos(a), ring * np.sin(a), z[:, None] + 0 * a], axis=-1)
    area = np.linalg.norm(unit * [0.5 * 1.0, 0.2 * 1.0, 0.2 * 0.5], axis=-1)
    np.testing.assert_allclose(shares.sum(), shape.area, rtol=1e-12)
    exact = (area * np.abs(unit[..., 2])).sum() / area.sum()
    np.testing.assert_allclose((shares * np.abs(points[:, 2])).sum() / shares.sum(), exact, rtol=2e-3)
    scene = Scene([Surface(shape, lambda x: np.abs(x[:, 2:]) * np.ones(3))])
    np.testing.assert_allclose(scene.reflectance[0], exact, rtol=2e-3)
    random = spread_points(scene, np.zeros(1000, int), np.random.default_rng(1))
    np.testing.assert_allclose(np.abs(random[:, 2]).mean(), exact, rtol=0.03)


def test_a_line_from_a_point_on_a_ball_leaves_it_at_its_other_end():
    rng = np.random.default_rng(3)
    start = lattice(50).T
    moving = rng.normal(size=(3, 3, 1, 50))
    quadrics = Quadrics(start[:, None], list(moving), True)
    x, y = rng.normal(size=(2, 50))
    way = moving[0, :, 0] * x + moving[1, :, 0] * y + moving[2, :, 0]
    far = -2 * (way * start).sum(axis=0) / (way * way).sum(axis=0)
    ends = quadrics.ends(np.arange(50), x, y)
    np.testing.assert_allclose(ends[1], np.maximum(far, 0), atol=1e-9)


@pytest.mark.parametrize("turns", [8, 16, 32])
def test_sets_of_a_lamps_points_are_spread_evenly(turns):
    count = 16
    which = [_set(count * turns, turns, k) for k in range(turns)]
    np.testing.assert_array_equal(np.sort(np.concatenate(which)), np.arange(count * turns))
    for own in which:
        ball, square = lattice(count * turns)[own], square_lattice(count * turns)[own]
        apart = square[:, None] - square
        apart -= np.round(apart)
        for d, area in ((ball[:, None] - ball, 4 * np.pi), (apart, 1.0)):
            length = np.linalg.norm(d, axis=2) + 9 * np.eye(count)
            assert length.min(axis=1).mean() > 0.45 * np.sqrt(area / count)


def test_the_shadow_beside_a_long_ellipsoid_that_shines():
    """By rays as by links, which know its light exactly: points at its ends stand for little of its area."""
    matrix = np.diag([0.1, 0.8, 0.1, 1.0])
    matrix[:3, 3] = (0, 0, 2)
    screen = Plane((-0.5, -0.5, 1), (1, 0, 0), (0, 1, 0))
    surfaces = [Surface(Plane((-2, -2, 0), (4, 0, 0), (0, 4, 0)), 0.5), Surface(Sphere(matrix), 0, 10)]
    scene = Scene(surfaces + [Surface(screen, 0.5, side=side) for side in ("front", "back")])
    y = np.linspace(-1.9, 1.9, 39)
    line = np.stack([0 * y + 0.3, y, 0 * y], axis=1)
    exact, found = (
        solve_by(scene, t, None).incident(0, line) for solve_by, t in ((solve_by_links, 0.01), (solve_by_rays, 0.01))
    )
    assert np.linalg.norm(found - exact) < 0.01 * np.linalg.norm(exact)
