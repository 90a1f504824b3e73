"""Lamps against numerical integration over many samples, and what they refuse."""

import numpy as np
import pytest

from pdm_core import AreaLight, Light, Plane, PointLight, Scene, SceneError, SpotLight, SunLight, Surface
from pdm_core.closed_forms import disc_unoccluded, sphere_unoccluded

MANY = 1 << 17  # samples
RNG_SEED = 11


def places(count=12, seed=RNG_SEED, scale=1.0, least=1.6):
    """points (n, 3) m away from the origin, unit normals (n, 3) some of which see the origin at the horizon"""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points *= scale * rng.uniform(least, 4.0, (count, 1)) / np.linalg.norm(points, axis=1, keepdims=True)
    normals = rng.normal(size=(count, 3))
    normals[::3] = np.cross(normals[::3], points[::3])
    normals[1::3] = -points[1::3] + 0.3 * normals[1::3]
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def by_samples(light, points, normals, count=MANY):
    """(n,) what all samples' kappa mean, times what a whole lamp of 1 W sends."""
    positions, own, weights = light.samples(count)
    out = []
    for x, n in zip(points, normals):
        d = positions - x
        distance = np.linalg.norm(d, axis=1)
        d /= distance[:, None]
        kappa = np.maximum(d @ n, 0) / distance**2 * light.pattern(-d)
        if own is not None:
            kappa *= np.maximum(-np.einsum("ij,ij->i", d, own), 0)
        out.append((weights * kappa).sum())
    return np.array(out)


def test_a_point_is_known():
    points, normals = places(scale=1e-3)
    light = PointLight((0, 0, 0), 1.0)
    distance = np.linalg.norm(points, axis=1)
    cosine = np.maximum(np.einsum("ij,ij->i", -points, normals) / distance, 0)
    assert np.allclose(light.unoccluded(points, normals), cosine / (4 * np.pi * distance**2) / np.pi, rtol=1e-13)
    positions, own, weights = light.samples(16)
    assert positions.shape == (1, 3) and own is None and weights.sum() == 1


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_ball_is_the_sum_of_its_samples(scale):
    points, normals = places(scale=scale)
    light = PointLight((0, 0, 0), 1.0, radius=scale)
    found, known = light.unoccluded(points, normals), by_samples(light, points, normals) / np.pi**2
    assert np.abs(found - known).max() < 2e-4 * known.max()


def test_a_small_ball_is_a_point_and_inside_light_comes_from_everywhere():
    points, normals = places(least=2.0)
    point, small = PointLight((0, 0, 0), 1.0), PointLight((0, 0, 0), 1.0, radius=1e-5)
    facing = point.unoccluded(points, normals) > 1e-4
    assert np.allclose(small.unoccluded(points, normals)[facing], point.unoccluded(points, normals)[facing], rtol=1e-7)
    ball = PointLight((0, 0, 0), 1.0, radius=2.0)
    assert np.allclose(ball.unoccluded(normals, normals), 1 / (4 * np.pi**2 * 4))


def test_a_disc_that_faces_the_point_is_the_sum_over_it():
    points, normals = places()
    found = PointLight((0, 0, 0), 1.0, radius=0.7, faces=True).unoccluded(points, normals)
    radiance = 1 / (4 * np.pi**2 * 0.7**2)
    for x, n, value in zip(points, normals, found):
        axis = x / np.linalg.norm(x)
        u = np.cross(axis, np.roll(axis, 1))
        u *= 1.4 / np.linalg.norm(u)
        disc = AreaLight((0, 0, 0), u, np.cross(axis, u), 1.0, ellipse=True)
        mean = by_samples(disc, x[None], n[None])[0]
        assert abs(value - radiance * disc.area / np.pi * mean) < 3e-4 * found.max()


def test_a_disc_seen_from_its_axis_is_a_ball_that_fills_the_same_cone():
    normals = places()[1]
    for height in (1e-6, 0.1, 1.0, 50.0):
        points = np.tile([0.0, 0.0, height], (len(normals), 1))
        found = disc_unoccluded(points, normals, np.zeros(3), *np.eye(3)[:2])
        ball = points - [0.0, 0.0, np.hypot(height, 1)]
        known = sphere_unoccluded(points, normals, ball, np.ones(len(normals)))
        np.testing.assert_allclose(found, known, atol=1e-12)


@pytest.mark.parametrize("faces", [False, True])
@pytest.mark.parametrize("blend", [0.0, 0.3, 1.0])
def test_a_spot_shines_within_its_cone_alone(faces, blend):
    points, normals = places(200)
    light = SpotLight((0, 0, 0), (1, 2, -1), 1.0, np.radians(70), blend, faces=faces)
    point = PointLight((0, 0, 0), 1.0)
    axis = np.array([1, 2, -1]) / np.sqrt(6)
    angle = np.arccos(points @ axis / np.linalg.norm(points, axis=1))
    share = light.unoccluded(points, normals) / np.where(point.unoccluded(points, normals) > 0, 1, np.inf)
    assert (share[angle > np.radians(35.01)] == 0).all()
    inner = np.arccos(np.cos(np.radians(35)) + (1 - np.cos(np.radians(35))) * blend)
    full = angle < inner - 1e-3
    assert np.allclose(light.unoccluded(points, normals)[full], point.unoccluded(points, normals)[full])
    assert (light.pattern(np.array([axis])) == 1).all()


def test_the_cone_of_a_spot_with_a_radius_is_the_sum_of_its_samples():
    points, normals = places(60)
    light = SpotLight((0, 0, 0), (0.2, 0.1, -1), 1.0, np.radians(100), 0.5, radius=0.5)
    found, known = light.unoccluded(points, normals), by_samples(light, points, normals) / np.pi**2
    assert (known > 0).sum() > 10
    assert np.abs(found - known).max() < 2e-3 * known.max()


def test_axes_stretch_the_cone_of_a_spot():
    light = SpotLight((0, 0, 0), (0, 0, -1), 1.0, np.radians(90), axes=np.diag([3.0, 1.0, 1.0]))
    x = np.array([[2.9, 0, -1], [3.1, 0, -1], [0, 0.9, -1], [0, 1.1, -1]])
    assert light.pattern(x / np.linalg.norm(x, axis=1, keepdims=True)).tolist() == [1, 0, 1, 0]


@pytest.mark.parametrize("degrees", [0, 0.5, 30, 120, 180])
def test_a_sun_is_the_sum_of_its_directions(degrees):
    _, normals = places(40)
    light = SunLight((1, -2, 3), 1.0, np.radians(degrees))
    directions, own, weights = light.samples(MANY)
    straight = np.maximum(directions @ -light.direction, 0) @ weights
    known = np.maximum(normals @ directions.T, 0) @ weights / straight / np.pi
    assert own is None and light.distant and len(directions) == (1 if degrees == 0 else MANY)
    assert np.abs(light.unoccluded(np.zeros_like(normals), normals) - known).max() < 1e-4
    assert np.isclose(light.unoccluded(np.zeros((1, 3)), -light.direction[None])[0], 1 / np.pi)


@pytest.mark.parametrize("ellipse", [False, True])
@pytest.mark.parametrize("degrees", [180, 179, 120, 60, 10])
def test_an_area_is_the_sum_of_its_samples(ellipse, degrees):
    points, normals = places(40)
    light = AreaLight((0.1, 0.2, -0.3), (1.5, 0.3, 0.1), (-0.2, 0.8, 0.4), 1.0, ellipse, np.radians(degrees))
    found, known = light.unoccluded(points, normals), by_samples(light, points, normals) / np.pi**2
    assert np.abs(found - known).max() < (5e-3 if degrees == 10 else 3e-4) * max(known.max(), 1 / 100)


@pytest.mark.parametrize("degrees", [1e-4, 0.1, 5, 100])
def test_a_spread_keeps_the_power_of_an_area(degrees):
    light = AreaLight((0, 0, 0), (2, 0, 0), (0, 3, 0), 1.0, spread=np.radians(degrees))
    side = (np.arange(120) + 0.5) / 20 - 3
    points = np.stack(np.meshgrid(side, side, [0.4]), axis=-1).reshape(-1, 3)
    irradiance = np.pi * light.unoccluded(points, np.tile([0.0, 0.0, -1.0], (len(points), 1)))
    assert abs(irradiance.sum() / 400 - 1) < 0.01


@pytest.mark.parametrize("ellipse", [False, True])
def test_an_area_is_dark_behind_and_in_its_plane(ellipse):
    light = AreaLight((0, 0, 1), (2, 0, 0), (0, 1, 0), 1.0, ellipse)
    points = np.array([[0, 0, 0.5], [0, 0, 1], [5, 0, 1], [0.3, 0.2, 1.5]])
    found = light.unoccluded(points, np.tile([0.0, 0.0, -1.0], (4, 1)))
    assert (found[:3] == 0).all() and found[3] > 0


def test_bad_lights_are_named():
    cases = [
        (lambda: PointLight((0, 0), 1, name="Lamp"), "Light 'Lamp': position must have shape"),
        (lambda: PointLight((0, 0, np.nan), 1), "A light without a name: position .* finite"),
        (lambda: PointLight((0, 0, 0), -1, name="Lamp"), "Light 'Lamp': power .* at least 0"),
        (lambda: PointLight((0, 0, 0), 1, radius=-1, name="Lamp"), "Light 'Lamp': radius is -1"),
        (lambda: PointLight((0, 0, 0), 1, name=3), "A light's name is 3"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 0), 1, 1, name="Spot"), "Light 'Spot': direction .* some length"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), 1, 4, name="Spot"), "Light 'Spot': angle is 4"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), 1, 1, 2, name="Spot"), "Light 'Spot': blend is 2"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), 1, 1, axes=np.diag([1, 1, 0])), "scaled flat"),
        (lambda: SunLight((0, 0, 1), 1, angle=4, name="Sun"), "Light 'Sun': angle is 4"),
        (lambda: AreaLight((0, 0, 0), (1, 0, 0), (2, 0, 0), 1, name="Area"), "Light 'Area': it has no area"),
        (lambda: AreaLight((0, 0, 0), (1, 0, 0), (0, 1, 0), 1, spread=0), "spread is 0"),
        (lambda: Scene([floor()], lights=["Sun"]), "'Sun' is no light"),
        (lambda: Scene([floor()], lights=3), "3 is no list; give one of lights"),
    ]
    for make, message in cases:
        with pytest.raises(SceneError, match=message):
            make()
    lamp = PointLight((0, 0, 1), 1)
    assert Scene([floor()], lights=[lamp]).lights == (lamp,) and isinstance(lamp, Light)


def floor():
    return Surface(Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), name="Floor")
