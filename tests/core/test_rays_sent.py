"""What errors of the light that cells send come to: nothing where nobody sees them; and lamps from within."""

import numpy as np
import pytest

from pdm_core import Plane, PointLight, Scene, Sphere, Surface
from pdm_core.rays.solution import ray_steps
from pdm_core.rays.spots import Spots
from pdm_core.signs_of_life import finish


def both(plane, reflectance):
    return [Surface(plane, reflectance, side=side) for side in ("front", "back")]


def floor(size=6.0):
    return both(Plane((-size / 2, -size / 2, 0), (size, 0, 0), (0, size, 0)), 0.6)


def box(corner, size, reflectance=0.7):
    o, (u, v, z) = np.array(corner, float), np.diag(size)
    faces = [(o, v, u), (o + z, u, v), (o, u, z), (o + u, v, z), (o + u + v, -u, z), (o + v, -v, z)]
    return [Surface(Plane(*face), reflectance) for face in faces]


def lamp(height, size):
    return [Surface(Plane((-size / 2, size / 2, height), (size, 0, 0), (0, -size, 0)), 0.0, 10.0, name="lamp")]


def by_rays(scene, target):
    return finish(ray_steps(scene, target, None, ""))


def difference(scene, one, other, count=64):
    """Relative L2 difference of L - Le over what is not shining."""
    wrong = light = 0.0
    for k, surface in enumerate(scene.surfaces):
        points = surface.shape.spread(count)
        a, b = (scene.reflectance[k] * s.incident(k, points) for s in (one, other))
        wrong += scene.areas[k] * ((a - b) ** 2).mean()
        light += scene.areas[k] * (b**2).mean()
    return np.sqrt(wrong / light)


@pytest.mark.parametrize("shape", ("plane", "ball"))
@pytest.mark.parametrize("height", (0.02, 0.1, 0.5))
def test_a_lamp_close_to_a_floor_that_nobody_sees_is_exact(height, shape):
    ball = [Surface(Sphere.at((0, 0, height), height / 2), 0.0, 10.0, name="lamp")]
    scene = Scene(floor() + (ball if shape == "ball" else lamp(height, height / 2)))
    solution = by_rays(scene, 0.01)
    assert solution.error < 1e-3
    # irradiance / pi of a small lamp straight above: radiance times area over pi height squared, or that of a ball
    below = solution.incident(0, np.zeros((1, 3)))[0, 0]
    exact = 10 / 4 if shape == "ball" else 10 * _square_above(height / 2, height)
    assert below == pytest.approx(exact, rel=1e-3)


def _square_above(side, height):
    """Share of what a point sees of a square parallel to it, straight above; four corner rectangles, closed form."""
    a = side / 2 / height
    return 4 * a / np.hypot(1, a) * np.arctan(a / np.hypot(1, a)) / np.pi


@pytest.mark.parametrize("height", (0.1, 0.4))
def test_what_stands_beside_it_is_as_far_off_as_stated(height):
    scene = Scene(floor() + box((0.8, -0.5, 0), (1, 1, 1)) + lamp(height, height / 2.5))
    coarse, fine = by_rays(scene, 0.06), by_rays(scene, 0.02)
    assert coarse.error <= 0.06
    assert difference(scene, coarse, fine) <= coarse.error


def test_shares_of_cells_are_those_of_rows():
    scene = Scene(floor() + box((0.8, -0.5, 0), (1, 1, 1)) + lamp(2.0, 0.5))
    state = by_rays(scene, 0.1)._state
    value = state.nodes.surface % 7 + 1.0
    found = np.zeros(len(value))
    # of surfaces that are one value each, cells tell as much as what is interpolated between them
    for who, node, share in state.rows.cells_met():
        assert len(np.unique(np.column_stack([who, node]), axis=0)) == len(who)
        found += np.bincount(who, share * value[node], len(value))
    np.testing.assert_allclose(found, state.rows.times(value[:, None])[:, 0], atol=1e-6)


@pytest.mark.parametrize("radius", (5.0, 100.0))
def test_a_lamp_around_everything_is_a_sky(radius):
    shapes = floor() + box((-0.5, -0.5, 1), (1, 1, 1))
    around = Scene(shapes, lights=(PointLight((0, 0, 0.3), 4 * np.pi**2 * radius**2, radius=radius),))
    sky = Scene(shapes, background=1.0)
    inside, outside = by_rays(around, 0.03), by_rays(sky, 0.01)
    assert inside.error <= 0.03
    assert difference(around, inside, outside) <= inside.error + outside.error


def test_what_is_told_of_a_cell_that_a_box_stands_on_hangs_on_no_order_of_rays():
    """The last ray that met a quarter of such a cell told all of it: beside a foot it was a tenth brighter or darker,
    as it happened."""
    nodes = by_rays(Scene(floor() + box((0.8, -0.5, 0), (1, 1, 1)) + lamp(2.0, 0.5)), 0.1)._state.nodes
    rng = np.random.default_rng(5)
    at = rng.random((20_000, 2)) * [0.3, 0.25] + [0.55, 0.4]  # the box and what is around it on the floor
    facet, front, light = np.zeros(len(at), int), np.zeros(len(at), int), rng.random(len(nodes))
    told = []
    for order in (np.arange(len(at)), np.arange(len(at))[::-1], rng.permutation(len(at))):
        spots = Spots(nodes)
        met = np.unique(spots.of(facet, at[order], front))
        node, weight = spots.basis(met[met >= 0])
        told.append((light[node] * weight).sum(axis=1))
    np.testing.assert_allclose(told[1:], [told[0]] * 2, rtol=1e-9)
    assert nodes.parted.touched.any() and len(told[0]) > 20
