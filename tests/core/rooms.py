"""Scenes that several tests share, and their solution by rays, however few the shapes."""

import numpy as np

from pdm_core import Mesh, Plane, PointLight, Polygon, Scene, Sphere, Surface
from pdm_core.links.approach import Approach
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish


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


def ball_room():
    """A closed cube with a shining ceiling and a ball, of planes and balls alone."""
    room = [Surface(plane, (0.5, 0.4, 0.3), float(k == 1)) for k, plane in enumerate(cube_planes())]
    return Scene([*room, Surface(Sphere.at((0.5, 0, 0), 1), 0.6)])


def mixed_room(grey=0.5, shine=2.0, watts=300.0):
    """The cube with all kinds of shapes: a polygon, a ball, a smooth mesh; lit by a plane and a lamp."""
    outline = np.array([(-1, -1, -2.5), (1, -1, -2.5), (1, 1, -2.5), (0, 0, -2.5), (-1, 1, -2.5)], float)
    corners = 0.7 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) - 1
    rock = Mesh(corners, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    shapes = [*cube_planes(), Polygon(outline), Sphere.at((2, 2, 0), 0.5), rock]
    surfaces = [Surface(shape, grey * np.array([1, 0.8, 0.6])) for shape in shapes]
    lamp = Plane((-0.5, -0.5, 2.9), (0, 1, 0), (1, 0, 0))
    return Scene([*surfaces, Surface(lamp, 0, shine)], lights=[PointLight((2, -2, 2), watts, 0.1)])


def transport_of(scene):
    """The Transport of links, as a solution begins with."""
    return Approach(scene, 0.01, "").transport


def by_rays(scene, target=0.04):
    return finish(ray_steps(scene, target, None, ""))
