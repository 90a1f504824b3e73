"""Lamps behind things, by the whole solver: what is seen of them, which of them cast shadows."""

from functools import cache

import numpy as np
import pytest

from pdm_core import AreaLight, Mesh, Plane, PointLight, Polygon, Scene, SpotLight, SunLight, Surface, solve
from pdm_core.rays.direct import MANY
from pdm_core.rays.engine import RayState
from pdm_core.rays.placed import Placed
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

FLOOR = Surface(Plane((-3, -3, 0), (6, 0, 0), (0, 6, 0)), 0.5, name="Floor")
BLIND = Plane((0, -3, 1), (3, 0, 0), (0, 6, 0))  # over the half x > 0


def seen(light, points):
    """Irradiance / pi (n, 3) at points of the floor behind a black blind."""
    sides = [Surface(BLIND, side=side, name="Blind") for side in ("front", "back")]
    solution = solve(Scene([FLOOR, *sides], lights=[light]), 0.1)
    return solution.irradiance(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))


def on_floor(x):
    return np.column_stack([x, np.full(len(x), 0.3), np.zeros(len(x))])


@pytest.mark.parametrize(
    "light",
    [
        PointLight((-0.5, 0, 2), (3, 2, 1)),
        SpotLight((-0.5, 0, 2), (0, 0, -1), (3, 2, 1), 2.5, 0.2),
        SunLight((0.5, 0, -1), (3, 2, 1)),
    ],
)
def test_what_is_small_casts_sharp_shadows(light):
    x = np.array([-2, -1, 0.2, 0.45, 0.55, 1.5])  # the shadow begins at .5
    found, whole = seen(light, on_floor(x)), light.unoccluded(on_floor(x), np.tile([0.0, 0.0, 1.0], (6, 1)))
    assert np.allclose(found[:4], whole[:4, None] * light.colour, rtol=1e-6)
    assert (found[4:] == 0).all()


def test_a_light_without_shadows_casts_none():
    light = PointLight((-0.5, 0, 2), 3, shadows=False)
    x = np.array([-1, 1, 2.5])
    whole = light.unoccluded(on_floor(x), np.tile([0.0, 0.0, 1.0], (3, 1)))
    assert np.allclose(seen(light, on_floor(x)), whole[:, None] * light.colour, rtol=1e-6)


@pytest.mark.parametrize("degrees", [180, 90])
def test_a_spread_makes_shadows_sharper(degrees):
    light = AreaLight((0, 0, 2), (0, 1, 0), (1, 0, 0), 10.0, spread=np.radians(degrees))
    points = on_floor(np.array([-0.8, -0.2, 0.0, 0.2, 0.8]))
    positions, own, weights = light.samples(1 << 16)
    known = []
    for x in points:
        d = positions - x
        distance = np.linalg.norm(d, axis=1)
        d /= distance[:, None]
        open_ = (x + d / d[:, 2:])[:, 0] < 0
        kappa = d[:, 2] * np.maximum(-d @ light.normal, 0) / distance**2 * light.pattern(-d) * open_
        known.append((weights * kappa).sum() * 10 / np.pi**2)
    assert np.abs(seen(light, points)[:, 0] - known).max() < 0.06 * max(known)  # of a target of .1


def test_many_lamps_with_penumbrae():
    """Each is looked at by few points; their sum is right."""
    rng = np.random.default_rng(4)
    places = np.column_stack([rng.uniform(-1.5, 1.5, (40, 2)), rng.uniform(1.6, 2.6, 40)])
    lamps = [PointLight(place, 10.0, 0.3) for place in places]
    sides = [Surface(BLIND, side=side, name="Blind") for side in ("front", "back")]
    solution = solve(Scene([FLOOR, *sides], lights=lamps), 0.04)
    points = on_floor(np.linspace(-1.5, 1.5, 9))
    known = np.zeros(len(points))
    for lamp in lamps:
        position, normal, weight = lamp.samples(1 << 11)
        d = position - points[:, None]
        distance = np.linalg.norm(d, axis=2)
        d /= distance[..., None]
        open_ = (points[:, None] + d / d[..., 2:])[..., 0] < 0  # the blind is at z = 1
        kappa = np.maximum(d[..., 2], 0) * np.maximum(-np.einsum("pki,ki->pk", d, normal), 0) / distance**2
        known += (weight * kappa * open_).sum(axis=1) * 10 / np.pi**2
    found = solution.irradiance(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))[:, 0]
    assert np.sqrt(((found - known) ** 2).mean() / (known**2).mean()) < 0.04


@pytest.mark.parametrize("count", [5, 40])
def test_a_few_of_many_lamps_tell_of_all(count):
    """In the mean of many places; some lamps give far more than others, half of all is behind the blind."""
    rng = np.random.default_rng(5)
    places = np.column_stack([rng.uniform(-1.5, 1.5, (count, 2)), rng.uniform(1.6, 2.6, count)])
    power = rng.uniform(0.01, 1, (count, 1)) ** 4 * rng.uniform(0.5, 1, (count, 3))
    lamps = [PointLight(place, own, 0.1) for place, own in zip(places, power)]
    sides = [Surface(BLIND, side=side, name="Blind") for side in ("front", "back")]
    shares = RayState(Scene([FLOOR, *sides], lights=lamps), 0.04).lit.shares
    points = np.column_stack([rng.uniform(-1, 1, (4000, 2)), np.zeros(4000)])
    floor = Placed(shares.facets, np.zeros(len(points), int), points)
    light = np.array([lamp.colour for lamp in lamps])
    few, all_ = finish(shares.scattered(floor)) * light, finish(shares.at(floor, 1e-3, 1e-3, (64, 256)))[0] * light
    assert (few > 0).any(axis=2).sum(axis=1).max() <= MANY < 40
    assert np.abs(few.sum(axis=(0, 1)) / all_.sum(axis=(0, 1)) - 1).max() < 0.01
    # of eight lamps each, not of one: what a place gets is about right
    assert np.abs(few.sum(axis=1) - all_.sum(axis=1)).mean() < 0.25 * all_.sum(axis=1).mean()


ROOMS = 4


@cache
def on_the_floor(shapes, lights=()):
    """Irradiance / pi of the floor, in the mean, in the middle one of closed rooms in a row, and what shines there."""
    walls = []
    for k in range(ROOMS):
        low, size = np.array([5.0 * k, 0, 0]), np.diag([5.0, 4.0, 3.0])
        for axis in range(3):
            u, v = size[(axis + 1) % 3], size[(axis + 2) % 3]
            walls += [Surface(Plane(low, u, v), 0.7), Surface(Plane(low + size[axis], v, u), 0.7)]
    lamps = [Surface(shape, 0.5, 20.0) for shape in shapes]
    scene, floor = Scene([*walls, *lamps], lights=lights), 6 * (ROOMS // 2) + 4
    solution = finish(ray_steps(scene, 0.04, None, "asked for"))
    return solution.incident(np.full(64, floor), scene.surfaces[floor].shape.spread(64))[:, 0].mean()


def corners(x, width, length):
    """(4, 3) m of a lamp under the ceiling, which looks down, from x on."""
    near, far, end = 2 - width / 2, 2 + width / 2, x + length
    return np.array([[x, near, 2.95], [x, far, 2.95], [end, far, 2.95], [end, near, 2.95]])


def trapezium(*where):
    """As it is, but a millimetre narrower at its end, so that it is no rectangle."""
    return Polygon(corners(*where) + np.outer([0, 0, 1, 0], [0.0, -0.001, 0]))


def mesh(*lamps):
    return Mesh(np.concatenate([corners(*one) for one in lamps]), np.arange(4 * len(lamps)).reshape(-1, 4), False)


def area(x, width, length):
    u, v = [0, width, 0], [length, 0, 0]
    return AreaLight([x + length / 2, 2, 2.95], u, v, 20.0 * np.pi * width * length)


PANELS = [(5.0 * k + 1.5, 1.0, 1.5) for k in range(ROOMS)]
STRIP = (0.0, 0.1, 5.0 * ROOMS)
PANEL_EACH = tuple(mesh(one) for one in PANELS)
STRIP_EACH = tuple(mesh((5.0 * k, 0.1, 5.0)) for k in range(ROOMS))
ONE = {  # what shines in each room, and the same as one
    "panels of one mesh": (PANEL_EACH, (mesh(*PANELS),), ()),
    "a mesh": (STRIP_EACH, (mesh(STRIP),), ()),
    "a rectangle": (STRIP_EACH, (Plane.through(corners(*STRIP)),), ()),
    "a polygon": (STRIP_EACH, (trapezium(*STRIP),), ()),
    "an area light": (STRIP_EACH, (), (area(*STRIP),)),
}


@pytest.mark.parametrize("kind", ONE)
def test_rooms_get_the_light_of_lamps_of_their_own_of_those_that_are_one(kind):
    """Few points of a lamp that goes through all are in each, and what met none of them stayed dark: floors were up to
    a third too dark where .8 % was stated."""
    each, shapes, lights = ONE[kind]
    assert on_the_floor(shapes, lights) == pytest.approx(on_the_floor(each), rel=0.03)
