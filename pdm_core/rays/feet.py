"""Feet of shapes on flat ones: which way points that lie just there are beside them, not under them, and what is."""

import numpy as np

from ..names import names_of
from ..shapes.shape import PARALLEL, frames
from ..shapes.triangles import barycentric
from ..tolerances import FLUSH
from .grid import pairs_of


class OnFlats:
    """Of Facets: flat shapes (k,), and a facet (k,) each of another that meets them within reach m: those of meshes
    that lie in their planes, or all that do not."""

    def __init__(self, facets, reach, lying):
        self.facets, self.reach = facets, reach
        found = [np.zeros((2, 0), int)]
        for own, facet in facets.near_flats:
            plane = facets.first[own]
            height = np.einsum("nci,ni->nc", self._given(facet) - self._given(plane)[:, :1], facets.normal[plane])
            across = np.linalg.norm(np.cross(facets.normal[facet], facets.normal[plane]), axis=1) > PARALLEL
            meets = (height.min(axis=1) <= reach) & (height.max(axis=1) >= -reach) & (across != lying)
            if lying:
                meets &= facets.own[facets.shape[facet]] < 0
            found.append(np.stack([own[meets], facet[meets]]))
        self.flat, self.facet = np.concatenate(found, axis=1)
        some, self.place = np.unique(self.flat), np.full(len(facets.first), -1)
        self.place[some] = np.arange(len(some))
        self.room = 2 * np.linalg.norm(facets.boxes, axis=1).max(initial=0.0)  # m, the widest that a plane can be
        rounded = reach + 2.0**-50 * self.room * len(some)
        corners = self._laid_out(self.flat[:, None], self._given(self.facet))
        self.low, self.high = corners.min(axis=2) - rounded, corners.max(axis=2) + rounded

    def pairs(self, shape, points):
        """Yields points (j,), and which (j,) of the facets they lie on: of points (n, 3) m about the facets' centre, of
        shapes (n,), those of flat ones."""
        some = np.flatnonzero(self.place[shape] >= 0)
        for point, which in pairs_of(*self._laid_out(shape[some], points[some]), self.low, self.high):
            point = some[point]
            on = (self.flat[which] == shape[point]) & self._lie_on(points[point], self.facet[which])
            yield point[on], which[on]

    def _given(self, facet):
        """(k, 4, 3) m, see Facets.corners; where their shapes are given, not parted into layers."""
        facets = self.facets
        return facets.corners(facet) - (facets.moved[facets.shape[facet], None] * facets.normal[facet])[:, None]

    def _laid_out(self, flat, points):
        """x, y (2, ...) m of points (..., 3) m in the planes of flat shapes (...), side by side."""
        facets = self.facets
        axes = frames(facets.normal[facets.first[flat.ravel()]]).reshape(*flat.shape, 3, 3)
        x, y, _ = np.moveaxis(np.einsum("...ai,...i->...a", axes, points), -1, 0)
        return np.stack([x + self.room * self.place[flat], y])

    def _lie_on(self, points, facet):
        """(n,) Whether points (n, 3) m lie on facets (n,)."""
        corners = self._given(facet)[:, [0, 1, 3]]
        at = np.clip(barycentric(points, corners)[:, 1:], 0.0, 1.0)
        at /= np.where(self.facets.triangle[facet], np.maximum(at.sum(axis=1), 1.0), 1.0)[:, None]
        nearest = corners[:, 0] + np.einsum("nk,nki->ni", at, corners[:, 1:] - corners[:, :1])
        return np.linalg.norm(points - nearest, axis=1) <= self.reach


class Feet(OnFlats):
    """along (k, 3): the unit direction in the flat shapes' planes that leads to each facet's front."""

    def __init__(self, facets, reach):
        super().__init__(facets, reach, lying=False)
        shown = np.where(facets.surface[self.facet, 0] >= 0, 1.0, -1.0)[:, None] * facets.normal[self.facet]
        normal = facets.normal[facets.first[self.flat]]
        self.along = shown - np.einsum("ki,ki->k", shown, normal)[:, None] * normal
        self.along /= np.linalg.norm(self.along, axis=1, keepdims=True)
        # a wall's triangles lead the same way, and count once
        self.way = np.unique(names_of(np.rint(self.along / PARALLEL)), return_inverse=True)[1]

    def away(self, shape, points):
        """points (n, 3) m about the facets' centre, of shapes (n,) -> (n, 3): of those of flat ones the sums of the
        directions along, of what meets these there."""
        out = np.zeros(points.shape)
        for point, which in self.pairs(shape, points):
            once = np.unique(point * len(self.way) + self.way[which], return_index=True)[1]
            np.add.at(out, point[once], self.along[which[once]])
        return out


def under_bodies(facets):
    """The Under of facets, made once."""
    if "_under" not in facets.__dict__:
        facets._under = Under(facets, FLUSH * facets.tolerance)
    return facets._under


class Under(OnFlats):
    """What lies on flat shapes of bodies that are meshes."""

    def __init__(self, facets, reach):
        super().__init__(facets, reach, lying=True)
        self.middle = np.array([s.bounds[0] for s in facets.scene.shapes]) - facets.centre

    def __call__(self, receivers):
        """(n,) Whether receivers on flat shapes are under a body's face that lies against theirs; what is behind it, as
        of two rooms that share a wall, covers nothing."""
        out, facets = np.zeros(len(receivers), bool), self.facets
        shape = np.append(facets.scene.shape_of, -1)[receivers.surface]
        shape = np.where((shape >= 0) & (self.place[shape] >= 0), shape, -1)
        some = np.flatnonzero(shape >= 0)
        if not len(some):
            return out
        shape, normals = shape[some], receivers.faces[some]
        points = receivers.points[some] - facets.moved[shape, None] * facets.normal[facets.first[shape]]
        for point, which in self.pairs(shape, points):
            facet, n = self.facet[which], normals[point]
            ahead = np.einsum("ni,ni->n", self.middle[facets.shape[facet]] - points[point], n) > self.reach
            against = np.einsum("ni,ni->n", facets.normal[facet], n) < 0
            out[some[point[ahead & against]]] = True
        return out
