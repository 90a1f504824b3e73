"""A mesh as plain arrays, and the little topology that shape detection needs. numpy only, no bpy."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...pdm_core.connected import connected

FLOAT32 = float(np.finfo(np.float32).eps)  # meshes are stored in float32


class NotRecognised(ValueError):
    """The mesh is no shape we know; the message says why and, where that helps, what to do."""


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """One mesh, or several that share nothing: vertices (n, 3) m, local; corners (c,) vertex of each polygon corner;
    counts (p,) corners of each polygon; materials (p,) any number that tells the polygons' materials apart; mesh (p,)
    which of the meshes each is of; rounding (p,) m: how far float32 may have moved its vertices."""

    vertices: np.ndarray
    corners: np.ndarray
    counts: np.ndarray
    materials: np.ndarray
    mesh: np.ndarray
    rounding: np.ndarray

    @classmethod
    def make(cls, vertices, corners, counts, materials=None):
        """Of one mesh."""
        vertices, counts = np.asarray(vertices, np.float64), np.asarray(counts, np.int64)
        none = np.zeros(len(counts), np.int64)
        materials = none if materials is None else np.asarray(materials)
        rounding = np.full(len(counts), rounding_of(np.abs(vertices).max(initial=0.0)))
        return cls(vertices, np.asarray(corners, np.int64), counts, materials, none, rounding)

    @cached_property
    def starts(self):
        """(p,) first corner of each polygon."""
        return np.cumsum(self.counts) - self.counts

    @cached_property
    def next(self):
        """(c,) the next corner of the same polygon."""
        return next_in_loops(self.starts, len(self.corners))

    @cached_property
    def following(self):
        """(c,) vertex of the next corner of the same polygon."""
        return self.corners[self.next]

    @cached_property
    def polygons(self):
        """(c,) polygon of each corner."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def edges(self):
        """(c,) one number for each corner's edge, the same in both directions."""
        low, high = np.minimum(self.corners, self.following), np.maximum(self.corners, self.following)
        return low * len(self.vertices) + high

    @cached_property
    def _by_edge(self):
        """The corners sorted by edge, and whether each is the first of its edge."""
        order = np.argsort(self.edges)
        key = self.edges[order]
        return order, np.append(True, key[1:] != key[:-1])

    @cached_property
    def edge(self):
        """(c,) the edges numbered from 0."""
        order, first = self._by_edge
        number = np.empty(len(order), np.int64)
        number[order] = np.cumsum(first) - 1
        return number

    @cached_property
    def joints(self):
        """(2, k) pairs of corners on one edge, each pair once."""
        order, _ = self._by_edge
        key, pairs, step = self.edges[order], [np.zeros((2, 0), int)], 1
        while step < len(key) and (same := key[step:] == key[:-step]).any():  # again where three faces and more meet
            pairs.append(np.stack([order[step:][same], order[:-step][same]]))
            step += 1
        return np.concatenate(pairs, axis=1)

    @cached_property
    def fans(self):
        """Area vectors and centroids (c, 3) of the triangles first corner, corner, next corner; zero at both ends."""
        first = np.repeat(self.vertices[self.corners[self.starts]], self.counts, axis=0)
        a = self.vertices[self.corners] - first
        b = a[self.next]
        return cross(a, b) / 2, first + (a + b) / 3

    @cached_property
    def _measures(self):
        """Area vectors (p, 3) m^2; longest sides (p,) m; (p,) m how far off its plane, through the first, each
        polygon's corners are."""
        vectors, longest, off = np.empty((len(self.counts), 3)), np.empty(len(self.counts)), np.zeros(len(self.counts))
        for size in (3, 4):  # nearly all are: their diagonals tell
            some = np.flatnonzero(self.counts == size)
            at = [self.vertices[self.corners[self.starts[some] + k]] for k in range(size)]
            vector = cross(at[2] - at[0], at[-1] - at[1]) / 2
            vectors[some] = vector
            longest[some] = np.maximum.reduce([length(at[k] - at[k - 1]) for k in range(size)])
            if size == 4:  # both ends of either diagonal are at one height
                off[some] = _over(np.abs(np.einsum("pi,pi->p", vector, at[1] - at[0])), length(vector))
        some = np.flatnonzero(self.counts > 4)
        if len(some):
            vectors[some], longest[some], off[some] = _measures_of(self.kept(some))
        return vectors, longest, off

    @property
    def normals(self):
        """(p, 3) m^2 along each polygon's normal, its length the area."""
        return self._measures[0]

    @property
    def off(self):
        """(p,) m; how far corners are off their polygon's plane."""
        return self._measures[2]

    @cached_property
    def heights(self):
        """(p,) m; the width of each polygon across its longest edge, if it were a parallelogram."""
        return _over(length(self.normals), self._measures[1])

    def part(self, polygons):
        """The MeshArrays of some polygons, a bool mask (p,) or indices, with the vertices they use."""
        part = self.kept(polygons)
        low = part.corners.min()
        used = np.zeros(part.corners.max() + 1 - low, bool)
        used[part.corners - low] = True
        corners = (np.cumsum(used) - 1)[part.corners - low]
        return replace(part, vertices=self.vertices[low + np.flatnonzero(used)], corners=corners)._knows(part)

    def kept(self, polygons):
        """The same with all vertices."""
        polygons = np.flatnonzero(polygons) if polygons.dtype == bool else polygons
        corners = self.corners[spans(self.starts[polygons], self.counts[polygons])]
        rest = (part[polygons] for part in (self.counts, self.materials, self.mesh, self.rounding))
        return MeshArrays(self.vertices, corners, *rest)._knows(self, polygons)

    def _knows(self, other, polygons=slice(None)):
        """Itself, with what is known already of those polygons of another MeshArrays, which it has."""
        if "_measures" in other.__dict__:
            self.__dict__["_measures"] = tuple(part[polygons] for part in other._measures)
        return self

    def alone(self, polygons):
        """Those polygons as one mesh, by the rounding of their own vertices."""
        part = self.part(polygons)
        return MeshArrays.make(part.vertices, part.corners, part.counts, part.materials)

    @cached_property
    def bodies(self):
        """(p,) a number for each polygon, the same within a closed body with its normals outward, -1 where there is
        none: each edge of a component belongs to two of its polygons, once in either direction."""
        component = self.components
        forward = np.where(self.corners < self.following, 1, -1)
        paired = (np.bincount(self.edge) == 2) & (np.bincount(self.edge, forward) == 0)
        # three times the volume under each polygon, as triangles with its first corner
        first = self.vertices[self.corners[self.starts]] - self.vertices[component]
        volume = np.einsum("pi,pi->p", first, self.normals)
        count = len(self.vertices)
        is_open = np.zeros(count, bool)
        is_open[component[self.polygons[~paired[self.edge]]]] = True
        closed = ~is_open & (np.bincount(component, volume, count) > 0)
        return np.where(closed[component], component, -1)

    @cached_property
    def components(self):
        """(p,) a number for each polygon, the same within a component; polygons are linked through vertices."""
        return connected(len(self.vertices), self.corners, self.following)[self.corners[self.starts]]


def _measures_of(mesh):
    """MeshArrays._measures of any polygons."""
    vectors = np.add.reduceat(mesh.fans[0], mesh.starts)
    sides = length(mesh.vertices[mesh.following] - mesh.vertices[mesh.corners])
    apart = mesh.vertices[mesh.corners] - np.repeat(mesh.vertices[mesh.corners[mesh.starts]], mesh.counts, axis=0)
    off = np.abs(np.einsum("ci,ci->c", apart, vectors[mesh.polygons]))
    longest, off = (np.maximum.reduceat(values, mesh.starts) for values in (sides, off))
    return vectors, longest, _over(off, length(vectors))


def _over(a, b):
    return a / np.maximum(b, np.finfo(float).tiny)


def rounding_of(largest):
    """m; how far float32 may have moved vertices of these largest coordinates: a few roundings."""
    return 4 * FLOAT32 * largest


def cross(a, b):
    """(n, 3) x (n, 3), three times as fast as numpy's"""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[:, i], b[:, j], out=out[:, k])
        out[:, k] -= a[:, j] * b[:, i]
    return out


def length(vectors):
    """(n, 3) -> (n,), twice as fast as numpy's norm"""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def next_in_loops(starts, n):
    """(n,) the following place in loops that begin at these places (k,), all of n places in turn; of the last of each
    loop the first."""
    after = np.arange(1, n + 1)
    after[np.append(starts, n)[1:] - 1] = starts
    return after


def spans(starts, counts):
    """(sum of counts,) the numbers starts[0], starts[0] + 1, ... of all spans, one after the other"""
    before = np.cumsum(counts) - counts
    return np.repeat(starts - before, counts) + np.arange(int(counts.sum()))
