"""Scenes that several tests share."""

import numpy as np

from pdm_core import Plane, Scene, Sphere, Surface


def cube_planes(half=3.0, centre=(0.0, 0.0, 0.0)):
    """Six planes of a cube facing inwards: floor, ceiling, left, right, back, front."""
    a, b, c = -half, half, 2 * half
    faces = [
        ((a, a, a), (c, 0, 0), (0, c, 0)),
        ((a, a, b), (0, c, 0), (c, 0, 0)),
        ((a, a, a), (0, c, 0), (0, 0, c)),
        ((b, a, a), (0, 0, c), (0, c, 0)),
        ((a, b, a), (c, 0, 0), (0, 0, c)),
        ((a, a, a), (0, 0, c), (c, 0, 0)),
    ]
    return [Plane(np.add(corner, centre), u, v) for corner, u, v in faces]


def ellipsoid(centre, axes, seed=0):
    """An ellipsoid with the given semi-axes m in a random orientation."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0] * axes
    matrix[:3, 3] = centre
    return Sphere(matrix)


def scene_of(shapes, **material):
    """Every shape as one front surface; free-standing planes have to be given both sides by the test."""
    return Scene([Surface(shape, name=f"s{k}", **material) for k, shape in enumerate(shapes)])


def both_sides(plane):
    return [Surface(plane, side="front"), Surface(plane, side="back")]
