"""A mesh whose faces are triangulated and halved as a Bisected tells; what it carries is interpolated by bmesh.

Faces that stay whole are put together again.
"""

import math
from contextlib import contextmanager
from dataclasses import dataclass

import bmesh
import numpy as np

from .bisect import Bisected
from .finer_mesh import normals_kept, triangulate
from .round_places import round_places

FACE, CORNER = "pdm face", "pdm corner"  # layers that tell where triangles came from, counted from 1


@dataclass(eq=False)
class Triangulated:
    """vertices and corners (t, 3): of the mesh, at the corners of triangles; polygon (t,) that each is part of."""

    vertices: np.ndarray
    corners: np.ndarray
    polygon: np.ndarray


@dataclass(eq=False)
class Places:
    """at (n, 3) m: where vertices are, local; spheres: [RoundPlaces] on which new ones are put."""

    at: np.ndarray
    spheres: list

    def between(self, a, b):
        """(k, 3) m: where a vertex between vertices a and b (k,) is put."""
        middle = (self.at[a] + self.at[b]) / 2
        for sphere in self.spheres:
            own = np.flatnonzero(sphere.has(a) & sphere.has(b))
            middle[own] = sphere.place(*sphere.between(a[own], b[own]))
        return middle

    def extend(self, ends):
        """Vertices between ends (k, 2)."""
        self.at = np.concatenate([self.at, self.between(*ends.T)])
        for sphere in self.spheres:
            sphere.extend(*ends.T)


@contextmanager
def _triangles(mesh):
    """A BMesh of triangles with the layers FACE and CORNER."""
    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        face, corner = work.faces.layers.int.new(FACE), work.loops.layers.int.new(CORNER)
        count = 0
        for number, each in enumerate(work.faces):
            each[face] = number + 1
            for loop in each.loops:
                count += 1
                loop[corner] = count
        triangulate(work, work.faces, "SHORT_EDGE")
        work.verts.ensure_lookup_table()
        yield work, work.faces.layers.int[FACE], work.loops.layers.int[CORNER]
    finally:
        work.free()


def triangulated(mesh):
    """The Triangulated of a Mesh, which stays as it is."""
    with _triangles(mesh) as (work, face, corner):
        rows = [[(loop.vert.index, loop[corner] - 1) for loop in each.loops] for each in work.faces]
        polygon = np.array([each[face] - 1 for each in work.faces], np.int64)
        vertices, corners = np.moveaxis(np.array(rows, np.int64).reshape(-1, 3, 2), 2, 0)
        return Triangulated(vertices, corners, polygon)


def cut(mesh, places, cuts):
    """Makes the rounds `cuts` [Cut] on a Mesh; places: the Places of all vertices then."""
    with normals_kept(mesh), _triangles(mesh) as (work, face, corner):
        whole = set(range(1, len(mesh.polygons) + 1))
        verts, faces = list(work.verts), list(work.faces)
        diagonals = [e for e in work.edges if len({each[face] for each in e.link_faces}) == 1 and len(e.link_faces) > 1]
        for round in cuts:
            for a, b in round.edges.tolist():
                edge = work.edges.get((verts[a], verts[b]))
                whole.difference_update(each[face] for each in edge.link_faces)
                verts.append(bmesh.utils.edge_split(edge, verts[a], 0.5)[1])
            for halved, rows in round.passes:
                for number, (a, _, opposite, middle) in zip(halved.tolist(), rows.tolist(), strict=True):
                    faces.append(_halve(faces, number, verts[a], verts[middle], verts[opposite]))
        for vert, co in zip(verts, places.at.tolist(), strict=True):
            vert.co = co
        inside = [e for e in diagonals if e.is_valid and all(each[face] in whole for each in e.link_faces)]
        if inside:
            bmesh.ops.dissolve_edges(work, edges=inside, use_verts=False)
        work.faces.layers.int.remove(work.faces.layers.int[FACE])
        work.loops.layers.int.remove(work.loops.layers.int[CORNER])
        work.to_mesh(mesh)
    mesh.update()


def halve_all(mesh, arrays, times):
    """Cuts every edge of a Mesh, of Arrays, into at least `times` parts; uneven spheres stay on their sphere."""
    faces, places = triangulated(mesh), Places(arrays.vertices.astype(float), round_places(arrays))
    none = np.zeros(0, np.int64)
    parts = Bisected.make(places.at, faces.vertices, {}, none, np.zeros((0, 3)))
    for _ in range(math.ceil(math.log2(times))):
        parts.bisect(np.ones(len(parts.corner), bool))
        places.extend(parts.cuts[-1].edges)
    cut(mesh, places, parts.cuts)


def _halve(faces, number, first, middle, opposite):
    """Splits faces[number] from the middle of an edge to the vertex opposite; it keeps the part at the edge's first
    vertex, the other part is returned."""
    old = faces[number]
    new = bmesh.utils.face_split(old, middle, opposite)[0]
    if first in new.verts:
        faces[number], new = new, old
    return new
