"""Triangles halved in places: no cracks, straight values stay straight, spheres stay spheres, planes planes."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_mesh_shapes import flipped, grid, mapped, random_affine, shuffled, sphere_error, triangulated, uv_sphere

for _name, _path in (("without_bpy", "."), ("without_bpy.operators", "operators")):
    _package = types.ModuleType(_name)
    _package.__path__ = [str(Path(__file__).resolve().parents[2] / _path)]
    sys.modules.setdefault(_name, _package)
from_ = lambda name: importlib.import_module(f"without_bpy.operators.{name}")  # noqa: E731
Bisected, round_places = from_("baking.bisect").Bisected, from_("baking.round_places")
find_shapes, Arrays = from_("reading.mesh_shapes").find_shapes, from_("reading.mesh_arrays").Arrays


def made(mesh, places=(), weights=()):
    """The Bisected of triangles (vertices, faces), its vertices' places being the value."""
    vertices, corner = np.asarray(mesh[0], float), np.array(mesh[1])
    places, weights = np.asarray(places, int), np.asarray(weights, float).reshape(-1, 3)
    parts = Bisected.make(vertices, corner, {"at": vertices[corner]}, places, weights)
    return parts, vertices


def halve(parts, at, wanted, between):
    parts.middle["at"] = (parts.values["at"] + np.roll(parts.values["at"], -1, axis=1)) / 2
    parts.bisect(wanted)
    return np.concatenate([at, between(*parts.cuts[-1].edges.T)])


def near(at, corner, place, radius):
    return np.linalg.norm(at[corner].mean(axis=1) - place, axis=1) < radius


def find(vertices, corner):
    return find_shapes(vertices.astype(np.float32), corner.ravel(), np.full(len(corner), 3))


def is_whole(corner, boundary):
    """No edge hangs: of each edge's two sides both have it whole, but for `boundary` edges."""
    ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], -1).reshape(-1, 2), axis=1)
    count = np.unique(ends, axis=0, return_counts=True)[1]
    return count.max() == 2 and (count == 1).sum() == boundary


def on_outline(at, corner):
    """Edges along the outline of the square -1..1."""
    ends = at[np.stack([corner, np.roll(corner, -1, axis=1)], -1)].reshape(-1, 2, 3)
    return int(((np.abs(ends[:, :, :2]) > 1 - 1e-9).all(axis=1)).any(axis=1).sum())


@pytest.mark.parametrize("cells", [1, 3])
def test_no_cracks_and_straight_values_stay(cells):
    rng = np.random.default_rng(cells)
    mesh = triangulated(grid(cells, cells), "mixed", rng)
    places, weights = rng.integers(len(mesh[1]), size=50), rng.dirichlet(np.ones(3), 50)
    parts, at = made(mesh, places, weights)
    before = np.einsum("nk,nki->ni", weights, at[np.array(mesh[1])][places])
    for turn in range(7):
        wanted = near(at, parts.corner, (0.3, 0.2, 0), 2.0 ** (1 - turn))
        at = halve(parts, at, wanted, lambda a, b, at=at: (at[a] + at[b]) / 2)
        assert is_whole(parts.corner, on_outline(at, parts.corner))
    assert parts.size == len(at) and len(np.unique(at, axis=0)) == len(at)
    np.testing.assert_allclose(parts.values["at"], at[parts.corner], atol=1e-12)  # as if a straight value were carried
    area = np.cross(*(at[parts.corner[:, k]] - at[parts.corner[:, 0]] for k in (1, 2)))[:, 2] / 2
    assert (area > 0).all() and area.sum() == pytest.approx(4)
    assert area.min() < 4 / 2**13 and len(area) < 2000 * cells  # fine there, and nowhere else
    inside = np.einsum("nk,nki->ni", parts.weight, at[parts.corner][parts.points])
    np.testing.assert_allclose(inside, before, atol=1e-12)
    assert (parts.weight > -1e-12).all()
    (shape,) = find(at, parts.corner).shapes
    assert type(shape).__name__ == "PlaneShape"


@settings(deadline=None, max_examples=60)
@given(st.integers(3, 24), st.integers(3, 16), st.integers(1, 5), st.booleans(), st.integers(0, 2**32 - 1))
def test_cut_spheres_are_the_same_spheres(segments, rings, rounds, inward, seed):
    rng = np.random.default_rng(seed)
    linear, origin = random_affine(rng, 0.2) * 10 ** rng.uniform(-2, 2), rng.normal(size=3)
    origin *= np.linalg.norm(linear, 2)
    mesh = triangulated(uv_sphere(segments, rings), "mixed", rng)
    vertices, faces = mapped(shuffled(flipped(mesh) if inward else mesh, rng), linear, origin)
    counts, corner = np.full(len(faces), 3), np.array(faces)
    arrays = Arrays(vertices, corner.ravel(), counts, np.arange(corner.size).reshape(-1, 3), None)
    (sphere,) = round_places.round_places(arrays)
    parts, at = made((vertices, faces))
    spot = at[rng.integers(len(at))]
    for turn in range(rounds):
        if len(parts.corner) > 20_000:
            break
        # a spot, and at first anything; sometimes all of it
        wanted = near(at, parts.corner, spot, 2.0**-turn * np.linalg.norm(linear, 2))
        wanted |= rng.random(len(wanted)) < (0.1 if turn < 2 else 0)
        at = halve(parts, at, wanted, lambda a, b: sphere.place(*sphere.between(a, b)))
        sphere.extend(*parts.cuts[-1].edges.T)
    found = find(at, parts.corner)
    assert found.kind == "SPHERE"
    assert found.shapes[0].is_even == (len(at) == len(vertices))
    assert found.shapes[0].is_outward != inward
    assert sphere_error(found.shapes[0], linear, origin, np.linalg.norm(linear, 2)) < 1e-4


def test_a_cut_sphere_with_a_vertex_moved_is_none():
    mesh = triangulated(uv_sphere(12, 6), "first", np.random.default_rng(0))
    arrays = Arrays(mesh[0].astype(np.float32), np.concatenate(mesh[1]), np.full(len(mesh[1]), 3), None, None)
    (sphere,) = round_places.round_places(arrays)
    parts, at = made(mesh)
    at = halve(parts, at, near(at, parts.corner, (1, 0, 0), 0.7), lambda a, b: sphere.place(*sphere.between(a, b)))
    assert find(at, parts.corner).kind == "SPHERE"
    moved = at.copy()
    moved[-1] *= 1.001
    assert find(moved, parts.corner).kind == "MESH"
    gone = np.delete(parts.corner, 5, axis=0)
    assert find(at, gone).kind == "MESH"
