"""Exact occlusion: what a point receives from everything around it sums to one, whatever hides what."""

from collections import Counter

import numpy as np
import pytest
from rooms import cube_planes, ellipsoid

from pdm_core import Plane, Sphere, region_crossings, view, visible_integral
from pdm_core.closed_forms import sphere_unoccluded
from pdm_core.contour import polygon_unoccluded
from pdm_core.shape_table import ShapeTable
from pdm_core.view import visible_factors

BALLS = [
    Sphere.at((0, 0, 0), 1),
    Sphere.at((1.5, 1, 0), 0.7),
    Sphere.at((-1, -1, -2.2), 0.8),  # touches the floor
    Sphere.at((-1, -1.5, 1), 0.9),
    Sphere.at((2.1, 2.1, -2.1), 0.9),  # touches three walls
    Sphere.at((0, 2, -2.5), 0.5),
]
SCREENS = [
    Plane((-2, -2.5, -2.9), (1.5, 0.3, 0), (0, 0.2, 2.0)),
    Plane((0.3, 0.4, -2.2), (1.2, -1.5, 0.1), (0.2, 0.3, 2.5)),
]
STANDING = [Plane((-2, -2.5, -3), (1.5, 0.3, 0), (0, 0.2, 2.0))]
BOX_ON_FLOOR = [Plane(p.origin * 0.3 + [1, 0.5, -2.1], p.u * 0.3, p.v * 0.3) for p in cube_planes()]
BOX_IN_AIR = [Plane(p.origin * 0.3 + [1, 0.5, -1.1], p.u * 0.3, p.v * 0.3) for p in cube_planes()]
ELLIPSOIDS = [ellipsoid((1.5, 0.2, -1.3), (0.5, 1, 0.7), 1), ellipsoid((-1, -1.2, 1), (0.5, 0.3, 0.9), 2)]


def rows(shapes, points, normals, inside=None, counts=None):
    """Visible factors of all shapes and of the sky, (shapes + 1, m); every shape is everybody's candidate occluder."""
    table, m = ShapeTable(shapes), len(points)
    every = np.tile(np.arange(len(shapes)), (m, 1))
    result = []
    for k, shape in enumerate(shapes):
        corners = np.broadcast_to(shape.corners, (m, 4, 3)) if isinstance(shape, Plane) else None
        factor = visible_factors(table, points, normals, np.full(m, k), corners, every, k == inside, counts)
        if isinstance(shape, Plane):  # a plane does not see itself
            factor = np.where(np.abs((points - shape.origin) @ shape.normal) < 1e-12, 0, factor)
        result.append(factor)
    if inside is None:
        result.append(visible_factors(table, points, normals, -1, None, every, True, counts))
    return np.array(result)


def floor_points(count, seed=1):
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-3, 3, (count, 2)), np.full(count, -3.0)])
    return points, np.tile([0, 0, 1.0], (count, 1))


def free_points(shapes, count, seed=2):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-2.9, 2.9, (count, 3))
    normals = rng.normal(size=(count, 3))
    outside = np.ones(count, bool)
    for ball in (s for s in shapes if isinstance(s, Sphere)):
        outside &= np.linalg.norm(ball.local(points), axis=1) > 1
    return points[outside], normals[outside] / np.linalg.norm(normals[outside], axis=1)[:, None]


@pytest.mark.parametrize(
    "objects",
    [[], BALLS[:1], BALLS, SCREENS, STANDING, BOX_ON_FLOOR, BOX_IN_AIR, ELLIPSOIDS, ELLIPSOIDS + STANDING + BALLS[4:5]],
    ids=["empty", "ball", "six balls", "screens", "standing", "box on floor", "box in air", "ellipsoids", "mixed"],
)
def test_closed_room_closes_at_every_floor_point(objects):
    counts = Counter()
    f = rows(cube_planes() + objects, *floor_points(300), counts=counts)
    assert np.abs(f.sum(axis=0) - 1).max() < 1e-11
    assert counts["sampled"] == 0 and f.min() >= 0


def test_closed_room_closes_at_free_points_in_all_directions():
    shapes = cube_planes() + BALLS[:3] + SCREENS[:1]
    f = rows(shapes, *free_points(shapes, 300))
    assert np.abs(f.sum(axis=0) - 1).max() < 2e-11
    assert np.abs(f[-1]).max() < 2e-11  # no sky in a closed room


def test_dome_closes():
    shapes = [Sphere.at((0, 0, 0), 8), *BALLS[:3]]
    f = rows(shapes, *free_points(shapes[1:], 300), inside=0)
    assert np.abs(f.sum(axis=0) - 1).max() < 1e-13


def test_open_scene_closes_with_the_sky():
    shapes = [*BALLS, STANDING[0]]
    f = rows(shapes, *free_points(shapes, 300))
    assert np.abs(f.sum(axis=0) - 1).max() < 1e-11


def test_crossing_shapes_are_sampled_and_counted():
    shapes = [*cube_planes(), Sphere.at((0, 0, -2.8), 0.5)]  # sunk in the floor
    counts = Counter()
    points = np.array([[2.0, 1.0, 2.5]])
    f = rows(shapes, points, np.array([[0, 0, -1.0]]), counts=counts)
    assert counts["sampled"] > 0
    assert abs(f.sum() - 1) < 5e-3


def test_ball_hides_what_a_ray_count_says():
    rng = np.random.default_rng(5)
    x, n = np.array([[0.4, -0.3, -3.0]]), np.array([[0, 0, 1.0]])
    f = rows(cube_planes() + BALLS[:1], x, n)
    radius, angle = np.sqrt(rng.random(400000)), 2 * np.pi * rng.random(400000)
    d = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)])
    hit = (d @ -x[0]) ** 2 - x[0] @ x[0] + 1 > 0
    up = ~hit & (np.abs(x[0, :2] + d[:, :2] * (6 / d[:, 2:])) < 3).all(axis=1)
    assert abs(up.mean() - f[1, 0]) < 5 * np.sqrt(up.mean() / 400000)


def test_round_sphere_closed_form_equals_the_contour():
    points, normals = floor_points(200)
    table = ShapeTable([BALLS[2]])
    sky = np.zeros((200, 1), int)
    free = sphere_unoccluded(points, normals, np.tile(BALLS[2].origin, (200, 1)), np.full(200, 0.8))
    rest = visible_factors(table, points, normals, -1, None, sky, True)
    assert np.abs(free + rest - 1).max() < 1e-14


def test_small_sphere_over_a_plane():
    # irradiance / pi = E r^2 h / d^3 in the limit
    r, h, a = 1e-4, 2.0, 1.5
    d = np.hypot(h, a)
    f = sphere_unoccluded(np.array([[a, 0, 0.0]]), np.array([[0, 0, 1.0]]), np.array([[0, 0, h]]), np.array([r]))
    assert abs(f[0] / (r * r * h / d**3) - 1) < 1e-12


def test_polygon_half_below_the_horizon_is_its_upper_half():
    side = np.array([[0, 0, -1], [0, 1, -1], [0, 1, 1], [0, 0, 1.0]])
    upper = np.maximum(side, 0)
    x, n = np.array([[0.7, 0.2, 0.0]]), np.array([[0, 0, 1.0]])
    assert abs(polygon_unoccluded(x, n, side[None]) - polygon_unoccluded(x, n, upper[None])) < 1e-15


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 0.0])
def test_nearly_touching_ball_and_floor_close(gap):
    ball = Sphere.at((0.3, 0.2, -3 + 1 + gap), 1.0)
    points, normals = floor_points(200)
    points[:100, :2] = [0.3, 0.2] + np.logspace(-8, -1, 100)[:, None] * [0.6, 0.8]
    f = rows([*cube_planes(), ball], points, normals)
    assert np.abs(f.sum(axis=0) - 1).max() < 1e-11


def test_penumbra_is_monotone_and_smooth():
    # a ball under a square light: from full shadow's centre outwards the light only grows
    light, ball = Plane((-0.5, -0.5, 3), (0, 1, 0), (1, 0, 0)), Sphere.at((0, 0, 1), 0.5)
    x = np.column_stack([np.linspace(0, 0.9, 1000), np.zeros((1000, 2))])
    table = ShapeTable([light, ball])
    n, corners = np.tile([0, 0, 1.0], (1000, 1)), np.broadcast_to(light.corners, (1000, 4, 3))
    f = visible_factors(table, x, n, np.zeros(1000, int), corners, np.ones((1000, 1), int))
    assert (np.diff(f) >= -1e-15).all()
    coarse, fine = np.abs(np.diff(f[::4], 2)).max(), np.abs(np.diff(f, 2)).max()
    assert fine < coarse / 6  # second differences shrink with the step: no steps, no kinks of the first order


@pytest.mark.parametrize("direction", [(1, 0), (0, -1), (1, 1), (0.6, 0.8)])
def test_ball_on_the_floor_seen_along_an_axis_of_symmetry(direction):
    # the outline touches the horizon without crossing it, at the very middle of the far wall's piece of it
    ball, distance = Sphere.at((0, 0, -2), 1.0), np.linspace(0, 2.5, 40)
    points = np.column_stack([distance[:, None] * direction / np.linalg.norm(direction), np.full(40, -3.0)])
    f = rows([*cube_planes(), ball], points, np.tile([0, 0, 1.0], (40, 1)))
    assert np.abs(f.sum(axis=0) - 1).max() < 1e-11


def test_a_factor_does_not_depend_on_what_is_found_with_it(monkeypatch):
    shapes = cube_planes() + ELLIPSOIDS + STANDING + BALLS[4:] + [Plane((-1, 1, -2), (2, 0.1, 0), (0, 0.3, 1.5))]
    for points, normals in (floor_points(60), free_points(shapes, 60)):
        together = rows(shapes, points, normals)
        monkeypatch.setattr(view, "CACHED", 4)
        monkeypatch.setattr(view, "AT_ONCE", 5)
        monkeypatch.setattr(visible_integral, "CACHED", 3)
        assert np.abs(rows(shapes, points, normals) - together).max() < 1e-13
        monkeypatch.undo()
        alone = [rows(shapes, points[k : k + 1], normals[k : k + 1])[:, 0] for k in range(10)]
        assert np.abs(np.transpose(alone) - together[:, :10]).max() < 1e-13


def test_gaps_are_what_no_interval_covers():
    rng = np.random.default_rng(3)
    low, width = rng.uniform(0, 0.5, 200), rng.uniform(-0.2, 0.5, 200)  # some rows are empty
    row = rng.integers(0, 200, 900)
    row = row[row % 7 != 0]  # and some have no intervals
    start = rng.uniform(-0.2, 1.0, len(row))
    end = start + rng.choice([0.0, 0.05, 0.3], len(row))
    end[::9] = 1.0  # long ones, and ends that coincide
    found = region_crossings.gaps(low, low + width, row, start, end)
    place = rng.uniform(-0.2, 1, (200, 500))

    def covered(number, a, b):
        out = np.zeros(place.shape, bool)
        np.logical_or.at(out, number, (place[number] > a[:, None]) & (place[number] < b[:, None]))
        return out

    left = covered(np.arange(200), low, low + width) & ~covered(row, start, end)
    assert (covered(*found) == left).all()
    assert (found[2] > found[1]).all() and 0.05 < left.mean() < 0.5


def test_a_ball_behind_many_that_overlap():
    # a row of balls of which each hides a part of the next: outlines with many hidden arcs
    row = [Sphere.at((-2.4 + 0.45 * k, 0.3 * (-1) ** k, -2.2 + 0.3 * k), 0.2) for k in range(11)]
    f = rows(cube_planes() + row, *floor_points(300))
    assert np.abs(f.sum(axis=0) - 1).max() < 1e-11
