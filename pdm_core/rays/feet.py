"""Feet of meshes on flat shapes: which way points that lie just there are beside them, not under them."""

import numpy as np

from ..closed_forms import across
from ..read_off import runs_of
from ..shapes.shape import PARALLEL
from ..shapes.triangles import barycentric
from .grid import pairs_of


class Feet:
    """Of Facets: facet (k,), those of meshes that meet flat shapes shape (k,), within reach m."""

    def __init__(self, facets, reach):
        self.facets, self.reach = facets, reach
        found = [np.zeros((2, 0), int)]
        for own, facet in facets.near_flats:
            meshes = facets.own[facets.shape[facet]] < 0
            own, facet = own[meshes], facet[meshes]
            plane = facets.first[own]
            height = np.einsum("nci,ni->nc", self._corners(facet) - facets.origin[plane, None], facets.normal[plane])
            height += facets.moved[own, None]  # points lie where their shapes are given
            flat = np.linalg.norm(np.cross(facets.normal[facet], facets.normal[plane]), axis=1) <= PARALLEL
            meets = (height.min(axis=1) <= reach) & (height.max(axis=1) >= -reach) & ~flat
            found.append(np.stack([own[meets], facet[meets]]))
        self.shape, self.facet = np.unique(np.concatenate(found, axis=1), axis=1)

    def _corners(self, facet):
        o, u, v = (array[facet] for array in (self.facets.origin, self.facets.u, self.facets.v))
        return np.stack([o, o + u, o + v], axis=1)

    def away(self, shape, points):
        """points (n, 3) m about the facets' centre, of flat shapes (n,) -> (n, 3): the sums of the unit directions in
        their planes that lead to the fronts of what meets them there."""
        out = np.zeros(points.shape)
        some = np.flatnonzero(np.isin(shape, self.shape))
        for k, mine in runs_of(shape[some]):
            mine = some[mine]
            facet = self.facet[np.searchsorted(self.shape, k) : np.searchsorted(self.shape, k, side="right")]
            normal, corners = self.facets.normal[self.facets.first[k]], self._corners(facet)
            e = across(normal[:, None])[:, 0]
            axes = np.stack([e, np.cross(normal, e)])
            at, flat = points[mine] @ axes.T, corners @ axes.T
            along = self.facets.normal[facet] @ axes.T
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            low, high = flat.min(axis=1).T - self.reach, flat.max(axis=1).T + self.reach
            for point, which in pairs_of(*at.T, low, high):
                on = self._lie_on(points[mine[point]], corners[which])
                np.add.at(out, mine[point[on]], along[which[on]] @ axes)
        return out

    def _lie_on(self, points, corners):
        """(n,) Whether points (n, 3) m lie on triangles of corners (n, 3, 3)."""
        inner = np.maximum(barycentric(points, corners), 0.0)
        nearest = np.einsum("nk,nki->ni", inner / inner.sum(axis=1, keepdims=True), corners)
        return np.linalg.norm(points - nearest, axis=1) <= self.reach
