"""Feet of shapes on flat ones: which way points that lie just there are beside them, not under them."""

import numpy as np

from ..names import names_of
from ..shapes.shape import PARALLEL, frames
from ..shapes.triangles import barycentric
from .grid import pairs_of


class Feet:
    """Of Facets: flat shapes (k,), a facet (k,) each of another that meets them within reach m and does not lie in
    their planes, and along (k, 3), the unit direction in these that leads to its front."""

    def __init__(self, facets, reach):
        self.facets, self.reach = facets, reach
        found = [np.zeros((2, 0), int)]
        for own, facet in facets.near_flats:
            plane = facets.first[own]
            height = np.einsum("nci,ni->nc", facets.given(facet) - facets.given(plane)[:, :1], facets.normal[plane])
            across = np.linalg.norm(np.cross(facets.normal[facet], facets.normal[plane]), axis=1) > PARALLEL
            meets = (height.min(axis=1) <= reach) & (height.max(axis=1) >= -reach) & across
            found.append(np.stack([own[meets], facet[meets]]))
        self.flat, self.facet = np.concatenate(found, axis=1)
        some, self.place = np.unique(self.flat), np.full(len(facets.first), -1)
        self.place[some] = np.arange(len(some))
        self.room = 2 * np.linalg.norm(facets.boxes, axis=1).max(initial=0.0)  # m, the widest that a plane can be
        rounded = reach + 2.0**-50 * self.room * len(some)
        corners = self._laid_out(self.flat[:, None], facets.given(self.facet))
        self.low, self.high = corners.min(axis=2) - rounded, corners.max(axis=2) + rounded
        shown = facets.lit[self.facet, None] * facets.normal[self.facet]
        normal = facets.normal[facets.first[self.flat]]
        self.along = shown - np.einsum("ki,ki->k", shown, normal)[:, None] * normal
        self.along /= np.linalg.norm(self.along, axis=1, keepdims=True)
        # a wall's triangles lead the same way, and count once
        self.way = np.unique(names_of(np.rint(self.along / PARALLEL)), return_inverse=True)[1]

    def away(self, shape, points):
        """points (n, 3) m about the facets' centre, of shapes (n,) -> (n, 3): of those of flat ones the sums of the
        directions along, of what meets these there."""
        out = np.zeros(points.shape)
        for point, which in self._pairs(shape, points):
            once = np.unique(point * len(self.way) + self.way[which], return_index=True)[1]
            np.add.at(out, point[once], self.along[which[once]])
        return out

    def _pairs(self, shape, points):
        """Yields points (j,), and which (j,) of the facets they lie on: of points (n, 3) m about the facets' centre, of
        shapes (n,), those of flat ones."""
        some = np.flatnonzero(self.place[shape] >= 0)
        for point, which in pairs_of(*self._laid_out(shape[some], points[some]), self.low, self.high):
            point = some[point]
            on = (self.flat[which] == shape[point]) & self._lie_on(points[point], self.facet[which])
            yield point[on], which[on]

    def _laid_out(self, flat, points):
        """x, y (2, ...) m of points (..., 3) m in the planes of flat shapes (...), side by side."""
        facets = self.facets
        axes = frames(facets.normal[facets.first[flat.ravel()]]).reshape(*flat.shape, 3, 3)
        x, y, _ = np.moveaxis(np.einsum("...ai,...i->...a", axes, points), -1, 0)
        return np.stack([x + self.room * self.place[flat], y])

    def _lie_on(self, points, facet):
        """(n,) Whether points (n, 3) m lie on facets (n,)."""
        corners = self.facets.given(facet)[:, [0, 1, 3]]
        at = np.clip(barycentric(points, corners)[:, 1:], 0.0, 1.0)
        at /= np.where(self.facets.triangle[facet], np.maximum(at.sum(axis=1), 1.0), 1.0)[:, None]
        nearest = corners[:, 0] + np.einsum("nk,nki->ni", at, corners[:, 1:] - corners[:, :1])
        return np.linalg.norm(points - nearest, axis=1) <= self.reach
