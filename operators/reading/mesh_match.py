"""How the mesh that is baked lies on the shapes found in the evaluated one. numpy only, no bpy."""

from dataclasses import dataclass

import numpy as np

from .mesh_topology import MeshArrays

ALIKE = 0.5  # cosine between a face and that which it was made into, at least


@dataclass(frozen=True, eq=False)
class Baked:
    """Of the base mesh's corners (c,) and triangles (t,): the shape each is on, and whether on its back. normals (c, 3)
    with which corners are shaded, middles (c, 3) m in the face that each corner belongs to, local, or None where every
    shape is exact."""

    corner_shape: np.ndarray
    corner_back: np.ndarray
    triangle_shape: np.ndarray
    triangle_back: np.ndarray
    normals: np.ndarray | None = None
    middles: np.ndarray | None = None


def baked_of(base, made, shapes):
    """Baked of the Arrays `base`, whose vertices are those of the evaluated Arrays `made` in which MeshShapes were
    found; None where its faces are not made of the same vertices any more."""
    parts = ("corners", "counts", "triangles")
    at = None
    if base is made or all(np.array_equal(getattr(base, k), getattr(made, k)) for k in parts):
        corner = triangle = slice(None)
    elif found := _matched(base, made):
        at = _triangle_at(made)
        corner, triangle = found[0], at[found[1]]
    else:
        return None
    rest = (None, None)
    if shapes.counts[3]:
        at = _triangle_at(made) if at is None else at
        a, b, c = (made.vertices[made.corners[made.triangles[:, k]]].astype(np.float64) for k in range(3))
        rest = made.normals[corner].astype(np.float64), ((a + b + c) / 3)[at[corner]]
    return Baked(
        shapes.corner_shape[corner],
        shapes.corner_back[corner],
        shapes.triangle_shape[triangle],
        shapes.triangle_back[triangle],
        *rest,
    )


def _triangle_at(arrays):
    """(c,) the first triangle at each corner."""
    at = np.zeros(len(arrays.corners), np.int64)
    at[arrays.triangles[::-1].ravel()] = np.repeat(np.arange(len(arrays.triangles))[::-1], 3)
    return at


def _matched(base, made):
    """Of each corner (c,) and triangle (t,) of the base a corner of the evaluated mesh at the same vertex, whose face
    looks the same way as far as there is one; None where there is none."""
    normals = _unit(_mesh(made).normals)[np.repeat(np.arange(len(made.counts)), made.counts)]
    mesh = _mesh(base)
    order = np.argsort(made.corners, kind="stable")
    starts = np.searchsorted(made.corners[order], np.arange(len(base.vertices) + 1))
    a, b, c = (base.vertices[base.corners[base.triangles[:, k]]].astype(float) for k in range(3))
    of_triangle = _unit(np.cross(b - a, c - a))
    found = []
    for vertex, normal in (
        (base.corners, _unit(mesh.normals)[mesh.polygons]),
        (base.corners[base.triangles[:, 0]], of_triangle),
    ):
        best, match = np.full(len(vertex), -2.0), np.full(len(vertex), -1)
        at, end = starts[vertex], starts[vertex + 1]
        open_ones = np.flatnonzero(at < end)
        while len(open_ones):  # as often as there are faces around one vertex
            here = order[at[open_ones]]
            along = np.einsum("ki,ki->k", normals[here], normal[open_ones])
            better = along > best[open_ones]
            best[open_ones[better]], match[open_ones[better]] = along[better], here[better]
            at[open_ones] += 1
            open_ones = open_ones[at[open_ones] < end[open_ones]]
        if not ((best > ALIKE) | (~normal.any(axis=1) & (match >= 0))).all():
            return None
        found.append(match)
    return found


def _mesh(arrays):
    return MeshArrays.make(arrays.vertices, arrays.corners, arrays.counts)


def _unit(normals):
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
