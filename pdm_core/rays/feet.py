"""Feet of shapes on flat ones: which way points that lie just there are beside them, not under them."""

import numpy as np

from ..names import names_of
from ..read_off import runs_of
from ..shapes.shape import PARALLEL, frames, unit
from ..shapes.triangles import barycentric
from ..tolerances import CLEAR
from ..wedges import Rays, Wedges
from .grid import pairs_of
from .side_by_side import SideBySide

RIM = (0, 1), (1, 2), (2, 3), (3, 0)  # corners of facets, of triangles one of them twice


class Feet:
    """Of Facets: flat shapes (k,), a facet (k,) each of another that meets them within reach m, lies (k,) whether it
    lies on them, stands (2, k) whether it is before their fronts and before their backs, and along (k, 3), of those
    that do not lie there the unit direction in their planes that leads to its front."""

    def __init__(self, facets, reach):
        self.facets, self.reach = facets, reach
        found = [np.zeros((5, 0), int)]
        for own, facet in facets.near_flats:
            plane = facets.first[own]
            height = np.einsum("nci,ni->nc", facets.corners(facet) - facets.corners(plane)[:, :1], facets.normal[plane])
            meets = (height.min(axis=1) <= reach) & (height.max(axis=1) >= -reach)
            level = np.linalg.norm(np.cross(facets.normal[facet], facets.normal[plane]), axis=1) <= PARALLEL
            lies = facets.lying.bears(plane, facet)
            meets &= ~level | (lies != 0)
            front, back = (np.where(level, side * lies > 0, (side * height).max(axis=1) > reach) for side in (1, -1))
            found.append(np.stack([own, facet, level, front, back])[:, meets])
        self.flat, self.facet, lies, *stands = np.concatenate(found, axis=1)
        self.lies, self.stands = lies > 0, np.stack(stands) > 0
        some, self.place = np.unique(self.flat), np.full(len(facets.first), -1)
        self.place[some] = np.arange(len(some))
        self.planes = SideBySide(facets, facets.normal[facets.first[some]], reach)
        self.low, self.high = self.planes.boxes(self.place[self.flat], facets.corners(self.facet))
        shown = facets.lit[self.facet, None] * facets.normal[self.facet]
        normal = facets.normal[facets.first[self.flat]]
        self.along = shown - np.einsum("ki,ki->k", shown, normal)[:, None] * normal
        self.along = np.where(self.lies[:, None], 0.0, unit(self.along))
        # a wall's triangles lead the same way, and count once
        self.way = np.unique(names_of(np.rint(self.along / PARALLEL)), return_inverse=True)[1]

    def moved(self, shape, sign, points, step):
        """points (n, 3) m about the facets' centre, on sides of the sign (n,) of shapes (n,) -> (n, 3): those of flat
        ones that others meet there moved into the open between these, see wedges, by at least step m off them."""
        found = [np.zeros((2, 0), int), *(np.stack(pair) for pair in self._pairs(shape, sign, points))]
        point, which = np.concatenate(found, axis=1)
        out, (some, place) = points.copy(), np.unique(point, return_inverse=True)
        if not len(some):
            return out
        # as far as the sum of what leads away, where no wedge's middle is on the shape, as at its own borders
        once = np.unique(place * len(self.way) + self.way[which], return_index=True)[1]
        np.add.at(out, point[once], step * self.along[which[once]])
        normals = self.facets.normal[self.facets.first[shape[some]]]
        rays = self._rays(place, which, points[some], normals, CLEAR * step)
        if not len(rays.point):
            return out
        wedges = Wedges(rays, normals, frames(normals)[:, 0])
        own = some[wedges.point]
        there = points[own] + (step / wedges.lean)[:, None] * wedges.middle
        is_open = self._are_on(shape[own], there) & (wedges.width > PARALLEL) & (wedges.shown > 0)
        for point, which in self._pairs(shape[own], sign[own], there):
            is_open[point[self.lies[which]]] = False
        best = wedges.best(1 * is_open)
        best = best[is_open[best]]
        out[own[best]] = there[best]
        return out

    def _rays(self, place, which, points, normals, far):
        """Rays of wedges: of pairs of points (n, 3) m with normals (n, 3), at these places (e,), and what meets them
        there, which (e,), where it goes on as far, m."""
        lies, out = self.lies[which], []
        at, facet, along = place[~lies], self.facet[which[~lies]], self.along[which[~lies]]
        back = 1 * (self.facets.surface[facet] >= 0).all(axis=1)
        parts = [(at, facet, np.cross(normals[at], along), along, back)]
        # borders of what lies there, whose inner sides show nothing
        at, facet = place[lies], self.facet[which[lies]]
        corners = self.facets.corners(facet)
        turned = np.einsum("ni,ni->n", self.facets.normal[facet], normals[at])
        for a, b in RIM:
            side = np.sign(turned)[:, None] * unit(corners[:, b] - corners[:, a])
            outwards = np.cross(side, normals[at])
            off = points[at] - corners[:, a]
            on = (np.abs(np.einsum("ni,ni->n", off, outwards)) <= self.reach) & side.any(axis=1)
            parts.append((at[on], facet[on], side[on], outwards[on], np.zeros(on.sum(), int)))
        for at, facet, line, along, back in parts:
            for sign in (1, -1):  # what leads away is on the right of the one direction, and on the left of the other
                on = np.flatnonzero(self._lie_on(points[at] + sign * far * line, facet))
                shows = np.stack([back[on], np.full(len(on), 2)][::sign], axis=1)
                out.append(Rays(at[on], sign * line[on], along[on], shows))
        return Rays.of(*out)

    def _are_on(self, shape, points):
        """(n,) Whether points (n, 3) m about the facets' centre, in the planes of flat shapes (n,), are on these."""
        out, points = np.zeros(len(points), bool), points + self.facets.centre
        order = np.argsort(shape, kind="stable")
        for k, some in runs_of(shape[order]):
            at = points[order[some]]
            nearest = self.facets.scene.shapes[k].project(at)
            out[order[some]] = np.linalg.norm(at - nearest, axis=1) <= self.reach
        return out

    def _pairs(self, shape, sign, points):
        """Yields points (j,), and which (j,) of the facets they lie on, if these are before them: of points (n, 3) m
        about the facets' centre, on sides of the sign (n,) of shapes (n,), those of flat ones."""
        some = np.flatnonzero(self.place[shape] >= 0)
        x, y = self.planes.at(self.place[shape[some]], points[some])
        for point, which in pairs_of(x, y, self.low, self.high):
            point = some[point]
            on = (self.flat[which] == shape[point]) & self.stands[(sign[point] < 0).astype(int), which]
            on &= self._lie_on(points[point], self.facet[which])
            yield point[on], which[on]

    def _lie_on(self, points, facet):
        """(n,) Whether points (n, 3) m lie on facets (n,)."""
        corners = self.facets.corners(facet)[:, [0, 1, 3]]
        at = np.clip(barycentric(points, corners)[:, 1:], 0.0, 1.0)
        at /= np.where(self.facets.triangle[facet], np.maximum(at.sum(axis=1), 1.0), 1.0)[:, None]
        nearest = corners[:, 0] + np.einsum("nk,nki->ni", at, corners[:, 1:] - corners[:, :1])
        return np.linalg.norm(points - nearest, axis=1) <= self.reach
