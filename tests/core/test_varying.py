"""Values on faces in the world: straight maps and seams, the order of evaluation."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np

# the package and its operators import bpy; empty ones over the same folders let numpy-only modules be imported
for _name, _path in (("without_bpy", "."), ("without_bpy.operators", "operators")):
    _package = types.ModuleType(_name)
    _package.__path__ = [str(Path(__file__).resolve().parents[2] / _path)]
    sys.modules.setdefault(_name, _package)
from_ = lambda name: importlib.import_module(f"without_bpy.operators.reading.{name}")  # noqa: E731
MeshLayers, Arrays = from_("mesh_layers").MeshLayers, from_("mesh_arrays").Arrays
at_places, constant, derive, evaluate = (getattr(from_("node_values"), n) for n in (
    "at_places", "constant", "derive", "evaluate"))  # fmt: skip
Faces, Varying = from_("varying").Faces, from_("varying").Varying

UV = at_places(lambda places: places.read("uv", ""))
MATRIX = np.array([[0, -3.0, 0, 1], [2.0, 0, 0, 5], [0, 0, 1, -2], [0, 0, 0, 1]])


def sheet(cells, uv):
    """Faces of the unit square under MATRIX, of cells^2 quads; uv(places (c, 2), quad (c,)) -> (c, 2)."""
    x, y = (a.ravel() for a in np.meshgrid(*[np.arange(cells)] * 2, indexing="ij"))
    corner = np.stack([x, y], -1)[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]
    places = corner.reshape(-1, 2) / cells
    first = 4 * np.arange(cells**2)[:, None]
    arrays = Arrays(
        vertices=np.column_stack([places, np.zeros(len(places))]),
        corners=np.arange(len(places)),
        counts=np.full(cells**2, 4),
        triangles=np.concatenate([first + [0, 1, 2], first + [0, 2, 3]]),
        normals=None,
    )
    layers = MeshLayers(
        arrays,
        space=(np.full(3, 0.5), np.full(3, 0.5)),
        colour=np.ones(4),
        layers={("uv", ""): uv(places, np.repeat(np.arange(cells**2), 4)).astype(np.float32)},
    )
    return Faces(layers, MATRIX, slice(None))


def world(places):
    return np.column_stack([places, np.zeros(len(places))]) @ MATRIX[:3, :3].T + MATRIX[:3, 3]


def test_a_straight_map_needs_no_faces():
    faces = sheet(20, lambda at, quad: 3 * at[:, ::-1] + 1)
    at = np.random.default_rng(0).uniform(0, 1, (500, 2))
    found = Varying(UV, faces)(world(at))
    np.testing.assert_allclose(found[:, :2], 3 * at[:, ::-1] + 1, atol=2e-5)
    assert "world" not in vars(faces)


def test_each_face_has_its_own_map():
    faces = sheet(7, lambda at, quad: (7 * at) % 1 + 0 * at + 0.1 * quad[:, None] * [1, 0])
    faces.layers.layers["uv", ""][:] = np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (49, 1)) + np.repeat(
        np.arange(49) % 5, 4
    )[:, None] * [1, 0]
    at = np.random.default_rng(0).uniform(0, 1, (500, 2))
    quad = (np.floor(7 * at) @ [7, 1]).astype(int)
    found = Varying(UV, faces)(world(at))
    np.testing.assert_allclose(found[:, 0], (7 * at[:, 0]) % 1 + quad % 5, atol=1e-5)
    np.testing.assert_allclose(found[:, 1], (7 * at[:, 1]) % 1, atol=1e-5)


def test_each_part_is_evaluated_once_and_in_any_depth():
    calls = []
    value = first = at_places(lambda places: calls.append(1) or np.ones((5, 1)))
    for _ in range(3000):
        value = derive(lambda a, b: (a + b) / 2, value, value)
    np.testing.assert_allclose(evaluate(derive(np.add, value, first), None), 2.0)
    assert len(calls) == 1


def test_constants_are_folded_and_notes_kept_once():
    note = ("taken so",)
    value = derive(np.multiply, constant([1.0, 2.0, 3.0], note), constant(0.5, note))
    assert not value.varies and value.notes == note
    np.testing.assert_allclose(value.constant, [[0.5, 1.0, 1.5]])
