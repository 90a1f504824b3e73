"""Which triangles of a mesh points are on: found by name where a triangle has a corner there, else by a search."""

from functools import cached_property

import numpy as np

from ..at_once import entries_of
from ..names import names_of
from ..nearest import NearestTriangle


class MeshPlaces:
    """Of triangles (t, 3), vertices of those (n, 3) m."""

    def __init__(self, vertices, triangles):
        self.vertices, self.triangles = vertices, triangles

    @cached_property
    def tree(self):
        """NearestTriangle"""
        return NearestTriangle(self.vertices[self.triangles])

    @cached_property
    def names(self):
        """(t, 3) names of the places of triangles' corners."""
        return names_of(self.vertices)[self.triangles]

    @cached_property
    def _corners(self):
        """Names (3 t,), sorted, of the places of all corners, and these (3 t,): what is read off at vertices needs no
        search."""
        order = np.argsort(self.names.ravel(), kind="stable")
        return self.names.ravel()[order], order

    def around(self, points):
        """points (n, 3) m -> pairs (k,), (k,) of those at vertices and the triangles that have a corner there."""
        names, corner = self._corners
        first, last = (np.searchsorted(names, names_of(points), side) for side in ("left", "right"))
        point, found = entries_of((first, last - first), np.arange(len(points)))
        return point, corner[found] // 3

    def nearest(self, points):
        """points (n, 3) m -> nearest triangle (n,), barycentric coordinates (n, 3) of the nearest point on it."""
        points = np.asarray(points, float)
        names, corner = self._corners
        found = np.minimum(np.searchsorted(names, name := names_of(points)), len(names) - 1)
        elsewhere = np.flatnonzero(names[found] != name)
        triangle, weights = corner[found] // 3, np.eye(3)[corner[found] % 3]
        triangle[elsewhere], weights[elsewhere] = self.tree.find(points[elsewhere])
        return triangle, weights
