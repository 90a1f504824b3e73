"""The triangle that a point lies on, against every triangle tried."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest

# operators/__init__.py imports bpy; an empty package over the same folder lets its numpy-only modules be imported
_package = types.ModuleType("operators_without_bpy")
_package.__path__ = [str(Path(__file__).resolve().parents[2] / "operators")]
sys.modules.setdefault(_package.__name__, _package)
NearestFace = importlib.import_module("operators_without_bpy.nearest_face").NearestFace


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
    faces = NearestFace(triangles)
    triangle, weights = faces._one_by_one(points)
    return np.linalg.norm(np.einsum("nc,ncd->nd", weights, triangles[triangle]) - points, axis=1)


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
    points = rng.uniform(-1, 2, (300, 3))
    assert (
        distance(NearestFace(triangles), points) <= brute_force(triangles, points) * (1 + 1e-9) + 1e-12
    ).mean() > 0.9
