"""A mesh as recognition wants it: welded by position, every face flat and with an area, none twice. No bpy."""

from dataclasses import dataclass, field, replace

import numpy as np

from .mesh_flat import SLACK
from .mesh_topology import MeshArrays, cross, length, next_in_loops, spans

CROSSED = 1 + 1e-4  # of its area: a face whose triangles have more crosses itself
MOST_CUT = 1000  # faces to be cut into flat triangles; where more are bent, they are a curved surface


@dataclass(frozen=True, eq=False)
class CleanMesh:
    """faces: MeshArrays of f faces, whole polygons or triangles of bent ones; bent (f,): those left whole though bent;
    source (c,): the given corner of each of their corners.

    triangles (T, 3) given corners; corner_face (C,), triangle_face (T,): the face of each given corner and triangle;
    corner_back, triangle_back: whether it looks the other way, being that face's double; live (T,): whether it is part
    of the face and not its double. warnings: {mesh: [sentence]}.
    """

    faces: MeshArrays
    bent: np.ndarray
    source: np.ndarray
    triangles: np.ndarray
    corner_face: np.ndarray
    triangle_face: np.ndarray
    corner_back: np.ndarray
    triangle_back: np.ndarray
    live: np.ndarray
    warnings: dict = field(default_factory=dict)


def clean(joined):
    """Joined meshes of welded vertices -> CleanMesh, or None where no face has an area."""
    welded, triangles = joined.mesh, joined.triangles
    bent = _bent(welded) if joined.is_convex else _bent(welded) | _crossed(welded, triangles)
    cut = bent & (np.bincount(welded.mesh, bent) <= MOST_CUT)[welded.mesh]
    if not cut.any() and (fast := _as_it_is(welded, triangles, bent)):
        return fast
    corner, counts, polygon, triangle_of = _cut_up(welded, triangles, cut)
    kept, left = _without_repeats(welded.corners[corner], counts)
    is_face = left >= 3
    face = np.flatnonzero(is_face)
    if not len(face):
        return None
    kept &= np.repeat(is_face, counts)
    rest = (part[polygon[face]] for part in (welded.materials, welded.mesh, welded.rounding))
    faces = MeshArrays(welded.vertices, welded.corners[corner[kept]], left[face], *rest)
    first, back = doubles(faces)
    has_area = (faces.heights > faces.rounding)[first]
    stays = has_area & (first == np.arange(len(first)))
    if not stays.any():
        return None
    number, is_back = np.full(len(counts), -1), np.zeros(len(counts), bool)
    number[face] = np.where(has_area, (np.cumsum(stays) - 1)[first], -1)  # among those that stay, -1 without area
    is_back[face] = back
    source = corner[kept][np.repeat(stays, faces.counts)]
    stay = np.flatnonzero(stays)
    final = faces.kept(stay)
    corner_piece = np.empty(len(welded.corners), np.int64)
    corner_piece[corner[::-1]] = np.repeat(np.arange(len(counts)), counts)[::-1]  # of triangles at a corner the first
    triangle_piece = np.where(triangle_of >= 0, triangle_of, corner_piece[triangles[:, 0]])
    beside = np.zeros(len(welded.vertices), np.int64)  # a face at each vertex, for what has no area
    beside[final.corners[::-1]] = final.polygons[::-1]

    def found(piece, vertex):
        return np.where(number[piece] >= 0, number[piece], beside[vertex])

    live = np.zeros(len(counts), bool)
    live[face] = stays
    return CleanMesh(
        final,
        (bent & ~cut)[polygon[face[stay]]],
        source,
        triangles,
        found(corner_piece, welded.corners),
        found(triangle_piece, welded.corners[triangles[:, 0]]),
        is_back[corner_piece],
        is_back[triangle_piece],
        live[triangle_piece],
        _said(np.append(welded.mesh[polygon[~is_face]], faces.mesh[~has_area]), faces.mesh[has_area & ~stays]),
    )


def _said(no_area, doubled):
    """{mesh: [sentence]} of the meshes of faces left out (k,)."""
    texts = (no_area, "without area: {} left out"), (doubled, "on another face of its own: {} read once")
    said = {}
    for left_out, text in texts:
        for mesh, n in zip(*(part.tolist() for part in np.unique(left_out, return_counts=True))):
            faces, are = ("faces", "they are") if n > 1 else ("face", "it is")
            said.setdefault(mesh, []).append(f"has {n:,} {faces} {text.format(are)}")
    return said


def _as_it_is(mesh, triangles, bent):
    """The CleanMesh of one that has nothing to be cleaned, or None."""
    if (mesh.corners == mesh.following).any() or not (mesh.heights > mesh.rounding).all():
        return None
    if not (doubles(mesh)[0] == np.arange(len(mesh.counts))).all():
        return None
    face = mesh.polygons[triangles[:, 0]]
    no_corner, no_triangle = np.zeros(len(mesh.corners), bool), np.zeros(len(triangles), bool)
    corner = np.arange(len(mesh.corners))
    return CleanMesh(mesh, bent, corner, triangles, mesh.polygons, face, no_corner, no_triangle, ~no_triangle)


def weld(mesh):
    """The MeshArrays with vertices at exactly one place made one, numbered in order of appearance; others' numbers,
    which spheres are known again by, stay. Vertices without a face stay as well."""
    of = np.zeros(len(mesh.vertices), np.int64)  # which mesh each is of: loose ones are anyone's
    of[mesh.corners] = np.repeat(mesh.mesh, mesh.counts)
    order = np.lexsort([*mesh.vertices.T, of])
    starts = np.flatnonzero(np.append(True, _differ(mesh.vertices[order]) | (np.diff(of[order]) > 0)))
    if len(starts) == len(order):
        return mesh
    number = np.empty(len(order), np.int64)
    number[order] = np.repeat(np.minimum.reduceat(order, starts), np.diff(np.append(starts, len(order))))
    used, number = np.unique(number, return_inverse=True)
    return replace(mesh, vertices=mesh.vertices[used], corners=number[mesh.corners])


def _differ(place):
    """(n - 1,) Whether each row of (n, 3) is another than the one before."""
    x, y, z = place.T
    return (x[1:] != x[:-1]) | (y[1:] != y[:-1]) | (z[1:] != z[:-1])


def _bent(mesh):
    """(p,) Whether polygons are not flat."""
    return ~(mesh.off <= SLACK * mesh.heights + mesh.rounding)


def _crossed(mesh, triangles):
    """(p,) Whether polygons cross themselves."""
    size = length(mesh.normals)
    of = mesh.polygons[triangles[:, 0]]
    some = np.flatnonzero((mesh.counts > 3)[of])
    a, b, c = (mesh.vertices[mesh.corners[triangles[some, k]]] for k in range(3))
    parts = np.bincount(of[some], length(cross(b - a, c - a)) / 2, len(mesh.counts))
    return parts > CROSSED * size + mesh.rounding * mesh.heights


def _cut_up(mesh, triangles, cut):
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


def _without_repeats(vertex, counts):
    """kept (c,): whether each face corner is at another place than the next; left (k,) how many each face keeps."""
    starts = np.cumsum(counts) - counts
    kept = vertex != vertex[next_in_loops(starts, len(vertex))]
    return kept, np.add.reduceat(kept, starts)


def doubles(faces):
    """first (f,): of each face the first one with the same corners; back (f,): whether it looks the other way."""
    mixed = np.random.default_rng(11).integers(0, 2**63, len(faces.vertices), dtype=np.uint64)
    key = np.add.reduceat(mixed[faces.corners], faces.starts)  # wraps; the same of the same corners in any order
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.append(True, key[order][1:] != key[order][:-1]))
    if len(starts) == len(order):
        return np.arange(len(order)), np.zeros(len(order), bool)
    first = np.empty(len(order), np.int64)
    first[order] = np.repeat(order[starts], np.diff(np.append(starts, len(order))))
    return first, np.einsum("fi,fi->f", faces.normals, faces.normals[first]) < 0
