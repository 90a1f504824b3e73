"""Large lamps: balls and discs around or beside what they light, their shadows by closed forms and by many rays."""

import numpy as np
import pytest

from pdm_core import Plane, PointLight, Scene, SpotLight, Surface, solve

MANY = 1 << 16  # rays
UP = np.array([0.0, 0, 1])


def ground(size, place):
    """A black floor and a black board above it, which hides a part of what is over the floor."""
    floor = Surface(Plane((-3, -3, 0), (6, 0, 0), (0, 6, 0)), name="Floor")
    board = Plane((-1, -1, 1), (2, 0, 0), (0, 2, 0))
    surfaces = [floor, *(Surface(board, side=side, name="Board") for side in ("front", "back"))]
    moved = [Surface(Plane(size * s.shape.origin + place, size * s.shape.u, size * s.shape.v), side=s.side)
             for s in surfaces[:2]]  # fmt: skip
    return [*moved, Surface(moved[1].shape, side="back")]


def floor_points(size, place):
    return size * np.array([[-2.5, 0.1, 0], [-1.4, 0.3, 0], [-0.4, 0.2, 0], [0.7, -0.8, 0], [1.6, 1.4, 0]]) + place


def by_rays(points, light):
    """(n,) irradiance / pi on the floor from the cone in which a facing disc is seen, the board's shadow taken away."""
    k = np.arange(MANY) + 0.5
    height, turn = k / MANY, np.pi * (1 + np.sqrt(5)) * k
    out = []
    for x in points:
        offset = light.position - x
        distance = np.linalg.norm(offset)
        axis = offset / distance
        e = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        e /= np.linalg.norm(e)
        ring = light.radius * np.sqrt(height)[:, None]
        aside = ring * (np.cos(turn)[:, None] * e + np.sin(turn)[:, None] * np.cross(axis, e))
        ray = offset + aside
        length = np.linalg.norm(ray, axis=1)
        kappa = np.maximum(ray[:, 2] / length, 0) * (distance / length) / length**2
        kappa *= light.pattern(-ray / length[:, None])
        t = (1 - x[2]) / ray[:, 2]  # of the board's height
        met = np.abs(x[:2] + t[:, None] * ray[:, :2]) < 1
        kappa[(t > 0) & (t < 1) & met.all(axis=1)] = 0
        out.append(light.colour[0] / (4 * np.pi**2) * kappa.mean())  # its radiance, times its area, over pi
    return np.array(out)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_ball_around_all_is_a_sky(size):
    place = size * np.array([0.3, -0.2, 0.1])
    surfaces, points = ground(size, place), floor_points(size, place)
    radius = 50 * size
    lamp = PointLight((2 * size, size, size), 4 * np.pi**2 * radius**2, radius)
    normals = np.tile(UP, (len(points), 1))
    found = solve(Scene(surfaces, lights=[lamp]), 0.005).irradiance(points, normals)
    known = solve(Scene(surfaces, background=1), 1e-4).irradiance(points, normals)
    assert known.min() < 0.5 and np.abs(found - known).max() < 0.02


@pytest.mark.parametrize("radius", [0.8, 2.0, 40.0])
@pytest.mark.parametrize("make", [
    lambda at, radius: PointLight(at, 100.0, radius, faces=True),
    lambda at, radius: SpotLight(at, (0, 0.2, -1), 100.0, 1.8, 0.4, radius, faces=True),
])  # fmt: skip
def test_shadows_of_a_disc_that_faces_the_point(make, radius):
    lamp = make((0.4, -0.6, 2.2), radius)
    points = floor_points(1.0, 0.0)
    found = solve(Scene(ground(1.0, np.zeros(3)), lights=[lamp]), 0.002).irradiance(points, np.tile(UP, (5, 1)))[:, 0]
    known = by_rays(points, lamp)
    assert np.abs(found - known).max() < 0.02 * known.max()
