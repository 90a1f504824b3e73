"""Faces larger than cells: their parts cover them, places are found on them, light within large faces is right."""

import numpy as np

from pdm_core import Mesh, Plane, Scene, Surface
from pdm_core.rays.solution import ray_steps
from pdm_core.rays.split import Split, find
from pdm_core.signs_of_life import finish

RNG = np.random.default_rng(3)


def mesh():
    """A large triangle, one of half its size, and a small one."""
    corners = np.array(
        [[0, 0, 0], [4, 0, 0], [0, 3, 1], [4, 0, 0], [6, 1, 0], [4, 2, 1], [9, 0, 0], [9.1, 0, 0], [9, 0.1, 0]]
    )
    return Mesh(corners, np.arange(9).reshape(3, 3), True)


def place(corners, at):
    """Points (n, 3) m at (n, 2) on triangles (n, 3, 3)."""
    s, t = at.T
    return np.einsum("nk,nki->ni", np.stack([1 - s - t, s, t], axis=1), corners)


def test_parts_cover_their_faces():
    split = Split(mesh(), 0.5)
    assert split.parts.tolist() == [8, 4, 1] and len(split) == 64 + 16 + 1
    area = np.linalg.norm(np.cross(*(split.points[:, k] - split.points[:, 0] for k in (1, 2))), axis=1) / 2
    np.testing.assert_allclose(area, split.areas, rtol=1e-12)
    np.testing.assert_allclose(np.bincount(split.triangle, area), mesh().areas, rtol=1e-12)
    assert len(np.unique(np.round(split.points.mean(axis=1), 9), axis=0)) == len(split)  # none lies on another
    np.testing.assert_allclose(np.linalg.norm(split.normals, axis=2), 1, rtol=1e-12)


def test_places_are_found_on_the_parts():
    split, solid = Split(mesh(), 0.5), mesh()
    triangle = RNG.integers(3, size=500)
    at = np.sort(RNG.random((500, 2)), axis=1)
    at = np.column_stack([at[:, 0], at[:, 1] - at[:, 0]])
    at[:6] = [[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0.25, 0], [0.125, 0.125]]
    part, inner = find(split.parts[triangle], split.first[triangle], at)
    assert (split.triangle[part] == triangle).all() and (inner > -1e-12).all() and (inner.sum(axis=1) < 1 + 1e-12).all()
    there = place(split.points[part], inner)
    np.testing.assert_allclose(there, place(solid.vertices[solid.triangles[triangle]], at), atol=1e-12)


def test_corners_at_one_place_have_one_name():
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [2, 0, 2]])
    flat = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), False)
    names = Split(flat, 0.3).names(flat.bounds[1])
    assert len(np.unique(names)) == 9**2
    bent = Mesh(corners, np.array([[0, 1, 2], [1, 4, 2]]), False)
    names = Split(bent, 0.3).names(bent.bounds[1])
    assert len(np.unique(names)) == 2 * 45  # the edge between them is shaded two ways


def test_light_within_large_faces():
    """A floor of two triangles sends on what a floor of cells does: a lamp shines on its middle alone."""
    corners = np.array([[-3.0, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]])
    floors = Plane.through(corners), Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), False)
    lamp = Plane((-0.3, -0.3, 0.6), (0, 0.6, 0), (0.6, 0, 0))
    screen = Plane((-3, 2, 0), (6, 0, 0), (0, 0, 2))
    points = np.column_stack([np.linspace(-2.9, 2.9, 30), np.full(30, 2.0), np.tile([0.2, 0.7, 1.5], 10)])
    found = []
    for floor in floors:
        surfaces = [Surface(floor, 0.9), Surface(screen, 0.5), Surface(lamp, 0.0, 10.0)]
        solution = finish(ray_steps(Scene(surfaces), 0.04, None, ""))
        assert solution.error <= 0.04
        found.append(solution.incident(1, points))
    assert np.linalg.norm(found[1] - found[0]) <= 0.04 * np.linalg.norm(found[0])
