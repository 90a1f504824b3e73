"""A mesh as plain arrays, and the little topology that shape detection needs. numpy only, no bpy."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

FLOAT32 = float(np.finfo(np.float32).eps)  # meshes are stored in float32


class NotRecognised(ValueError):
    """The mesh is no shape we know; the message says why and, where that helps, what to do."""


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """vertices (n, 3) m, local; corners (c,) vertex of each polygon corner; counts (p,) corners of each polygon;
    materials (p,) any number that tells the polygons' materials apart."""

    vertices: np.ndarray
    corners: np.ndarray
    counts: np.ndarray
    materials: np.ndarray

    @classmethod
    def make(cls, vertices, corners, counts, materials=None):
        counts = np.asarray(counts, np.int64)
        materials = np.zeros(len(counts), np.int64) if materials is None else np.asarray(materials)
        return cls(np.asarray(vertices, np.float64), np.asarray(corners, np.int64), counts, materials)

    @cached_property
    def starts(self):
        """(p,) first corner of each polygon."""
        return np.cumsum(self.counts) - self.counts

    @cached_property
    def following(self):
        """(c,) vertex of the next corner of the same polygon."""
        after = np.empty_like(self.corners)
        after[:-1] = self.corners[1:]
        after[self.starts + self.counts - 1] = self.corners[self.starts]
        return after

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
    def rounding(self):
        """m; how far float32 may have moved a vertex: a few roundings at the largest coordinate."""
        return 4 * FLOAT32 * float(np.abs(self.vertices).max())

    def part(self, polygons):
        """The MeshArrays of some polygons (bool mask (p,)) with the vertices they use."""
        corners = self.corners[np.repeat(polygons, self.counts)]
        used, corners = np.unique(corners, return_inverse=True)
        return MeshArrays.make(self.vertices[used], corners, self.counts[polygons], self.materials[polygons])

    @cached_property
    def bodies(self):
        """(p,) a number for each polygon, the same within a closed body with its normals outward, -1 where there is
        none: each edge of a component belongs to two of its polygons, once in either direction."""
        component = self.components()
        forward = np.where(self.corners < self.following, 1, -1)
        _, edge, count = np.unique(self.edges, return_inverse=True, return_counts=True)
        paired = (count == 2) & (np.bincount(edge, forward) == 0)
        at = self.vertices - self.vertices.mean(axis=0)
        # six times the volume under each corner's triangle with the polygon's first corner and the middle
        first = at[self.corners[self.starts]][self.polygons]
        volume = np.einsum("ci,ci->c", first, np.cross(at[self.corners], at[self.following]))
        count = len(self.vertices)
        open_edges = np.bincount(component[self.polygons], ~paired[edge], count)
        closed = (open_edges == 0) & (np.bincount(component[self.polygons], volume, count) > 0)
        return np.where(closed[component], component, -1)

    def components(self):
        """(p,) a number for each polygon, the same within a component; polygons are linked through vertices."""
        return connected(len(self.vertices), self.corners, self.following)[self.corners[self.starts]]


def connected(n, a, b):
    """(n,) for nodes 0..n-1 with edges a[i]-b[i]: the smallest node of each node's component.

    Hooking to the smaller root and halving paths, a few rounds of each (Shiloach and Vishkin 1982).
    """
    label = np.arange(n)
    while True:
        low = np.minimum(label[a], label[b])
        if (label[a] == low).all() and (label[b] == low).all():
            return label
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        while (label[label] != label).any():
            label = label[label]
