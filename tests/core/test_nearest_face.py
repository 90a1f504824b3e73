"""The triangle that a point lies on, against every triangle tried."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest

# the package and its operators import bpy; empty ones over the same folders let numpy-only modules be imported
for _name, _path in (("without_bpy", "."), ("without_bpy.operators", "operators")):
    _package = types.ModuleType(_name)
    _package.__path__ = [str(Path(__file__).resolve().parents[2] / _path)]
    sys.modules.setdefault(_name, _package)
NearestFace = importlib.import_module("without_bpy.operators.reading.nearest_face").NearestFace


def sheet(cells, rng, scale=1.0):
    """A wavy sheet of 2 cells^2 triangles, about `scale` wide."""
    x, y = np.meshgrid(*[np.linspace(0, 1, cells + 1)] * 2, indexing="ij")
    points = np.stack([x, y, 0.1 * np.sin(5 * x) * np.cos(4 * y)], axis=-1).reshape(-1, 3)
    points += rng.uniform(-0.2, 0.2, points.shape) / cells
    k = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return scale * points[faces]


def distance(faces, points):
    triangle, weights = faces.locate(points)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-9)
    assert (weights > -1e-5).all()
    return np.linalg.norm(np.einsum("nc,ncd->nd", weights, faces.triangles[triangle]) - points, axis=1)


def brute_force(triangles, points):
    """(n,) distances from every triangle tried: from its plane where that is below, else from its edges."""
    least = np.full(len(points), np.inf)
    for a, b, c in triangles:
        normal = np.cross(b - a, c - a)
        if normal @ normal == 0:
            continue
        flat = points - np.outer((points - a) @ normal, normal) / (normal @ normal)
        inside = np.ones(len(points), bool)
        for start, end in ((a, b), (b, c), (c, a)):
            inside &= np.cross(end - start, flat - start) @ normal >= 0
            t = np.clip((points - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
            least = np.minimum(least, np.linalg.norm(points - start - np.outer(t, end - start), axis=1))
        least = np.where(inside, np.minimum(least, np.linalg.norm(points - flat, axis=1)), least)
    return least


@pytest.mark.parametrize("cells", [1, 2, 3, 17, 40])
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_points_on_faces_are_found_there(cells, scale):
    rng = np.random.default_rng(cells)
    triangles = sheet(cells, rng, scale)
    weights = rng.dirichlet([1, 1, 1], 2000)
    chosen = rng.integers(len(triangles), size=2000)
    points = np.einsum("nc,ncd->nd", weights, triangles[chosen])
    triangle, found = NearestFace(triangles).locate(points)
    assert (triangle == chosen).mean() > 0.999
    np.testing.assert_allclose(np.einsum("nc,ncd->nd", found, triangles[triangle]), points, atol=1e-6 * scale)


@pytest.mark.parametrize("cells", [1, 3, 20])
def test_points_off_the_faces_go_to_the_nearest(cells):
    rng = np.random.default_rng(cells)
    triangles = sheet(cells, rng)
    points = rng.uniform(-2, 3, (300, 3))
    np.testing.assert_allclose(distance(NearestFace(triangles), points), brute_force(triangles, points), rtol=1e-9)


def test_faces_of_all_sizes_and_of_none():
    rng = np.random.default_rng(1)
    triangles = np.concatenate([sheet(6, rng), sheet(6, rng, 100.0), np.zeros((3, 3, 3)) + 0.5])
    points = np.einsum("nc,ncd->nd", rng.dirichlet([1, 1, 1], 300), triangles[rng.integers(144, size=300)])
    np.testing.assert_allclose(distance(NearestFace(triangles), points), 0.0, atol=1e-9)


def test_large_faces_among_many_small_ones_fit_the_memory():
    rng = np.random.default_rng(1)
    large = np.concatenate([sheet(20, rng, 100.0) + [0, 0, k] for k in range(5)])
    faces = NearestFace(np.concatenate([large, sheet(40, rng, 0.1)]))
    faces.locate(np.zeros((1, 3)))
    assert len(faces._grid[1]) < 3e6
