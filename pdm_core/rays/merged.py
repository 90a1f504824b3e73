"""Vertices of meshes at which light is kept: merged where faces are finer than the light, cut where they are larger.

On the faces between them light is linear.
"""

import copy

import numpy as np

from ..shapes.shape import SIDES, side_of, square_lattice
from .cuts import Cuts
from .split import MOST, Split, find

PLACES = 16  # of a node from which rays start in turn
BENT = 0.2  # of how far values vary over a face between its own vertices: how far linear ones are off
WHOLE = 0.95  # of a mesh's vertices, with their normals: when so many are on their own it is no use to part the others


class Merged:
    """Of the surfaces `which` of meshes: number (n surfaces,) of each one's groups of vertices; anew (n surfaces,)
    bool: whether they are others than in what this was made from; size (n surfaces,) m of the cells in which vertices
    become one group, both sides of a mesh alike."""

    def __init__(self, facets, which, size):
        self.facets, self.which, scene = facets, which, facets.scene
        self.size, self.anew = np.full(len(scene), size), np.ones(len(scene), bool)
        self.least = 2 * np.array([s.shape.bounds[1] for s in scene.surfaces]) / MOST
        self.split, self.group, self.distinct = {}, {}, {}
        self._merge()

    def finer(self, marked):
        """marked (n surfaces,) bool: which are merged less -> Merged."""
        new, shape_of = copy.copy(self), self.facets.scene.shape_of
        new.anew = np.bincount(shape_of, marked)[shape_of] > 0
        new.size = np.where(new.anew, self.size / 2, self.size)
        new.split, new.group, new.distinct = dict(self.split), dict(self.group), dict(self.distinct)
        new._merge()
        return new

    def _merge(self):
        """Of the shapes: split {shape: Split}, group {shape: (T, 3)}, the corners of its parts, distinct {shape:
        number}, how many of them are different; of all in turn corner (sum of T, 3), points (sum of T, 3, 3) m and
        facet (sum of T,), whose each is; what cuts them; of facets parts, first_part (m facets,): see split.find."""
        scene, facets = self.facets.scene, self.facets
        anew = {scene.shape_of[k]: k for k in self.which if self.anew[k]}
        for key, k in anew.items():
            shape = scene.surfaces[k].shape
            self.split[key] = Split(shape, self.size[k])
            self.group[key], self.distinct[key] = merged_corners(shape, self.split[key], self.size[k])
        self.parts, self.first_part = np.ones(facets.count, int), np.zeros(facets.count, int)
        begin = np.cumsum([0, *map(len, self.split.values())])
        for first, (key, split) in zip(begin, self.split.items()):
            mine = slice(facets.first[key], facets.first[key] + len(split.parts))
            self.parts[mine], self.first_part[mine] = split.parts, first + split.first
        self.points = np.concatenate([np.zeros((0, 3, 3)), *(split.points for split in self.split.values())])
        facet = [facets.first[key] + split.triangle for key, split in self.split.items()]
        self.facet = np.concatenate([np.zeros(0, int), *facet])
        self.cuts = Cuts(facets, self)
        for first, key in zip(begin, self.split):
            if key in anew:
                self.group[key] = self.cuts.parted(first, self.group[key])
        self.corner = np.concatenate([np.zeros((0, 3), np.int32), *self.group.values()])
        self.number, self.unmerged = np.zeros(len(scene), int), np.zeros(len(scene))
        for k in self.which:
            key = scene.shape_of[k]
            self.number[k] = self.group[key].max() + 1
            self.unmerged[k] = self.number[k] / self.distinct[key]

    def nodes(self, k):
        """Of the groups of a surface: it (n,), -1 (n,), the area of each (n,) m^2, points and normals (n, PLACES, 3)
        and their triangles (n, PLACES). Each corner stands for a third of its triangle, at the middle of that third."""
        scene = self.facets.scene
        key = scene.shape_of[k]
        split, group = self.split[key], self.group[key].ravel()
        area, begin = np.repeat(split.areas / 3, 3), self.first_part[self.facets.first[key]]
        points = self.cuts.third[begin : begin + len(split)].reshape(-1, 3) + self.facets.centre
        weight = np.bincount(group, area)
        # of each group places by equal parts of its area
        order = np.argsort(group, kind="stable")
        begin = np.searchsorted(group[order], np.arange(len(weight)))
        cumulated = np.cumsum(area[order])
        before = np.concatenate([[0.0], cumulated])[begin]
        want = before[:, None] + (np.arange(PLACES) + 0.5) / PLACES * weight[:, None]
        last = np.append(begin[1:], len(order)) - 1
        pick = np.clip(np.searchsorted(cumulated, want), begin[:, None], last[:, None])
        pick = order[pick[:, np.argsort(square_lattice(PLACES)[:, 0])]]  # in an order that the first few are spread
        normals = scene.surfaces[k].sign * split.normals.reshape(-1, 3)
        new = np.full(len(weight), k), np.full(len(weight), -1), weight
        return *new, points[pick], normals[pick], split.triangle[pick // 3]

    def part(self, facet, at):
        """Which parts (h,) of facets (h,) places (h, 2) are on, and where on them (h, 2)."""
        return find(self.parts.take(facet), self.first_part.take(facet), at)

    def surplus(self, k, value, lost):
        """How far values (n, c) of a surface's groups vary over its faces, in L2; lost (n,): which do not count."""
        key = self.facets.scene.shape_of[k]
        v, counts = value[self.group[key]], ~lost[self.group[key]]
        number = np.maximum(counts.sum(axis=1), 1)
        mean = np.einsum("tkc,tk->tc", v, counts) / number[:, None]
        spread = np.einsum("tk,tk->t", ((v - mean[:, None]) ** 2).sum(axis=2), counts) / number
        # between merged vertices it may jump so far; between the mesh's own it bends a little
        jumps = np.clip(2 * (1 - self.unmerged[k]), BENT, 1.0)
        return float(jumps * np.sqrt((spread * self.split[key].areas).sum()))

    @property
    def is_finest(self):
        """(n surfaces,) Whether all but all vertices stand for themselves and faces are cut finely."""
        return (self.unmerged > WHOLE) & (self.size <= self.least)


def merged_corners(mesh, split, size):
    """(T, 3) group of each corner of the parts of a mesh's triangles, and how many corners are different. Those of
    triangles that are not cut are one where they are in one cell of that size, m, and their normals look much the same
    way."""
    whole = np.repeat(~split.is_cut[split.triangle], 3)
    points = split.points.reshape(-1, 3)
    cell = np.floor((points - points.min(axis=0)) / max(size, 1e-300)).astype(np.int64)
    cell = np.minimum(cell, 1 << 15)
    side = side_of(split.normals.reshape(-1, 3))
    key = (((cell[:, 0] << 40) + (cell[:, 1] << 20) + cell[:, 2]) * SIDES + side).astype(np.uint64)
    vertex = mesh.triangles[split.triangle[whole.reshape(-1, 3)[:, 0]]].ravel()
    distinct = len(np.unique(vertex * SIDES + side[whole]))
    if not whole.all():
        key[~whole] = split.names(mesh.bounds[1])[~whole]
        distinct += len(np.unique(key[~whole]))
    return np.unique(key, return_inverse=True)[1].reshape(-1, 3).astype(np.int32), distinct
