"""A mesh as recognition wants it: welded by position, every face flat and with an area, none twice. No bpy."""

from dataclasses import dataclass, field

import numpy as np

from .mesh_topology import MeshArrays, spans

SLACK = 1e-5  # of a face's width: how far a vertex may be off its plane, besides rounding; a bent one is cut up
CROSSED = 1 + 1e-4  # of its area: a face whose triangles have more crosses itself


@dataclass(frozen=True, eq=False)
class CleanMesh:
    """faces: MeshArrays of f faces, whole polygons or triangles of bent ones; source (c,): the given corner of each
    of their corners; corner_face (C,), triangle_face (T,): the face of each given corner and triangle; corner_back,
    triangle_back: whether it looks the other way, being that face's double. warnings: [sentence]."""

    faces: MeshArrays
    source: np.ndarray
    corner_face: np.ndarray
    triangle_face: np.ndarray
    corner_back: np.ndarray
    triangle_back: np.ndarray
    warnings: list = field(default_factory=list)


def clean(mesh, triangles=None):
    """MeshArrays as given -> CleanMesh, or None where no face has an area.

    triangles (T, 3): corners of each polygon's triangles, polygon after polygon; fans where there are none.
    """
    triangles = _fans(mesh) if triangles is None else np.asarray(triangles, np.int64)
    welded = weld(mesh)
    cut = _to_cut(welded, triangles)
    corner, counts, polygon, triangle_of = _faces(mesh, triangles, cut)
    # what has two corners at one place loses one of them; with fewer than three it has no area
    starts = np.cumsum(counts) - counts
    vertex = welded.corners[corner]
    after = np.arange(1, len(corner) + 1)
    after[starts + counts - 1] = starts
    kept = vertex != vertex[after]
    left = np.add.reduceat(kept, starts)
    is_face = left >= 3
    kept &= np.repeat(is_face, counts)
    face = np.flatnonzero(is_face)
    if not len(face):
        return None
    faces = MeshArrays.make(welded.vertices, vertex[kept], left[face], mesh.materials[polygon[face]])
    has_area = faces.heights > faces.rounding
    first, back = _doubles(faces)
    has_area &= has_area[first]
    stays = has_area & (first == np.arange(len(first)))
    if not stays.any():
        return None
    number = np.full(len(counts), -1)  # of each face among those that stay, -1 without area
    number[face] = np.where(has_area, (np.cumsum(stays) - 1)[first], -1)
    is_back = np.zeros(len(counts), bool)
    is_back[face] = back
    source = corner[kept][np.repeat(stays, faces.counts)]
    stay = np.flatnonzero(stays)
    clean_faces = MeshArrays.make(
        faces.vertices, faces.corners[spans(faces.starts[stay], faces.counts[stay])], faces.counts[stay],
        faces.materials[stay],
    )  # fmt: skip
    face_of = np.repeat(np.arange(len(counts)), counts)
    corner_virtual = np.empty(len(mesh.corners), np.int64)
    corner_virtual[corner[::-1]] = face_of[::-1]  # of a cut one's triangles the first that has the corner
    triangle_virtual = np.where(triangle_of >= 0, triangle_of, corner_virtual[triangles[:, 0]])
    beside = np.zeros(len(welded.vertices), np.int64)  # a face at each vertex, for what has no area
    beside[clean_faces.corners[::-1]] = clean_faces.polygons[::-1]

    def found(virtual, corners):
        return np.where(number[virtual] >= 0, number[virtual], beside[welded.corners[corners]])

    counted = [
        (int(np.count_nonzero(~is_face) + np.count_nonzero(~has_area)), "without area, which {} left out"),
        (int(np.count_nonzero(has_area & ~stays)), "on another face of its own, which {} read once"),
    ]
    warnings = [
        f"has {n:,} face{'s' * (n > 1)} {text.format('are' if n > 1 else 'is')}" for n, text in counted if n
    ]
    return CleanMesh(
        clean_faces,
        source,
        found(corner_virtual, np.arange(len(mesh.corners))),
        found(triangle_virtual, triangles[:, 0]),
        is_back[corner_virtual],
        is_back[triangle_virtual],
        warnings,
    )


def weld(mesh):
    """The MeshArrays with vertices at exactly one place made one, numbered in order of appearance; others' numbers,
    which spheres are known again by, stay. Vertices without a face stay as well."""
    order = np.lexsort(mesh.vertices.T)
    place = mesh.vertices[order]
    starts = np.flatnonzero(np.append(True, (place[1:] != place[:-1]).any(axis=1)))
    if len(starts) == len(order):
        return mesh
    number = np.empty(len(order), np.int64)
    number[order] = np.repeat(np.minimum.reduceat(order, starts), np.diff(np.append(starts, len(order))))
    used, number = np.unique(number, return_inverse=True)
    return MeshArrays(mesh.vertices[used], number[mesh.corners], mesh.counts, mesh.materials)


def _fans(mesh):
    """(T, 3) corners: first corner, corner, next corner of each polygon."""
    inner = mesh.counts - 2
    second = spans(mesh.starts + 1, inner)
    return np.column_stack([np.repeat(mesh.starts, inner), second, second + 1])


def _to_cut(mesh, triangles):
    """(p,) Whether polygons are to be cut into their triangles: bent, or crossing themselves."""
    normals, heights = mesh.normals, mesh.heights
    size = np.linalg.norm(normals, axis=1)
    unit = normals / np.maximum(size, np.finfo(float).tiny)[:, None]
    many = (mesh.counts > 3)[mesh.polygons]
    corner = np.flatnonzero(many)
    if not len(corner):
        return np.zeros(len(mesh.counts), bool)
    of, at = mesh.polygons[corner], mesh.vertices[mesh.corners[corner]]
    off = np.abs(np.einsum("ci,ci->c", at - mesh.vertices[mesh.corners[mesh.starts[of]]], unit[of]))
    cut = np.zeros(len(mesh.counts), bool)
    cut[of[~(off <= SLACK * heights[of] + mesh.rounding)]] = True
    big = np.flatnonzero((mesh.counts > 3)[mesh.polygons[triangles[:, 0]]])
    a, b, c = (mesh.vertices[mesh.corners[triangles[big, k]]] for k in range(3))
    parts = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    total = np.bincount(mesh.polygons[triangles[big, 0]], parts, len(mesh.counts))
    return cut | ((total > CROSSED * size + mesh.rounding * heights) & (mesh.counts > 3))


def _faces(mesh, triangles, cut):
    """Corners, counts (k,), polygons (k,) of the faces, in order of their polygons; face (T,) of each triangle that is
    one, -1 of the others."""
    is_cut = cut[mesh.polygons[triangles[:, 0]]]
    parts = triangles[is_cut]
    whole = np.flatnonzero(~cut)
    corner = np.concatenate([spans(mesh.starts[whole], mesh.counts[whole]), parts.ravel()])
    counts = np.concatenate([mesh.counts[whole], np.full(len(parts), 3)])
    polygon = np.concatenate([whole, mesh.polygons[parts[:, 0]]])
    order = np.argsort(polygon, kind="stable")
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    triangle_of = np.full(len(triangles), -1)
    triangle_of[is_cut] = place[len(whole) :]
    starts = np.cumsum(counts) - counts
    return corner[spans(starts[order], counts[order])], counts[order], polygon[order], triangle_of


def _doubles(faces):
    """first (f,): of each face the first one with the same corners; back (f,): whether it looks the other way."""
    mixed = np.random.default_rng(11).integers(0, 2**63, len(faces.vertices), dtype=np.uint64)
    key = np.add.reduceat(mixed[faces.corners], faces.starts)  # wraps; the same of the same corners in any order
    _, at, same = np.unique(key, return_index=True, return_inverse=True)
    first = at[same]
    return first, np.einsum("fi,fi->f", faces.normals, faces.normals[first]) < 0
