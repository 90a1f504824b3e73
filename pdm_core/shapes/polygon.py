"""Flat shapes of any simple outline, convex or not, with holes: one shape, exact.

Its field lives on the chart of its bounding rectangle, its light is a contour integral, its triangles are only for what
needs convex pieces.
"""

from functools import cached_property

import numpy as np

from ..coincident import REACHES
from ..contour import loops_unoccluded
from ..outlines import enclosed, nearest_on_edges
from ..tolerances import TOUCHING
from .loops import Loops
from .mesh import Mesh
from .pieces import rectangles
from .plane import Facet
from .shape import INSET, Flat, square_lattice
from .triangles import facets_of, into_triangles, spread_over

TRIED = 64  # places of a cell on the border, of which those inside are used; points for each that is wanted of all


class Polygon(Flat):
    """The flat area within an outline (n, 3) m and outside its holes [(m, 3)], simple loops of straight edges.

    Its front is the side from which the outline runs counter-clockwise; holes may run either way. Local coordinates
    are (s, t) in [0, 1]^2 on the bounding rectangle, and the height along the unit normal in units of the square root
    of the rectangle's area.
    """

    plural = "polygons"

    def __init__(self, outline, holes=()):
        self._loops = Loops(outline, holes)

    def __repr__(self):
        return f"Polygon({self.outline.tolist()}, {[hole.tolist() for hole in self.holes]})"

    @property
    def normal(self):
        return self._loops.normal

    @property
    def outline(self):
        return self._loops.in_plane[0]

    @property
    def holes(self):
        """[(m, 3)] m, clockwise seen from the front."""
        return self._loops.in_plane[1:]

    @property
    def origin(self):
        """(3,) m; the corner of the bounding rectangle."""
        return self._loops.rectangle[0]

    @cached_property
    def linear(self):
        """(3, 3) with columns along the bounding rectangle's sides and the unit normal times the root of its area."""
        _, axes, sides = self._loops.rectangle
        return np.column_stack([sides[0] * axes[0], sides[1] * axes[1], np.sqrt(sides.prod()) * self.normal])

    @property
    def area(self):
        return self._loops.moments[0]

    @property
    def triangles(self):
        return self._loops.triangles

    @property
    def _few_in_chart(self):
        """(k, 3, 2): few_triangles in local coordinates."""
        return self.local(self._loops.few_triangles.reshape(-1, 3))[:, :2].reshape(-1, 3, 2)

    @cached_property
    def pieces(self):
        """[Plane] rectangles where all its corners are right angles, else triangles."""
        return rectangles(self._loops) or [Facet.of(corners, self.thickness) for corners in self.triangles]

    def cut(self, length):
        return Mesh.of(self.triangles).cut(length)

    @property
    def facet_count(self):
        return len(self._loops.few_triangles)

    @property
    def facets(self):
        at = self._few_in_chart
        chart = np.stack([at[:, 0], at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]], axis=2)
        return facets_of(self._loops.few_triangles, chart)

    @cached_property
    def bounds(self):
        """Centre (3,) m, the bounding rectangle's, and radius of a sphere around the shape."""
        centre = self.origin + (self.linear[:, 0] + self.linear[:, 1]) / 2
        return centre, float(np.linalg.norm(self.outline - centre, axis=1).max())

    @property
    def marks(self):
        """(12,) m; the same of the same shape, and a Plane's where it is a rectangle."""
        corner, axes, sides = self._loops.rectangle
        area, centroid, spread = self._loops.moments
        centre = corner + centroid @ axes
        reach = np.abs((self.outline - centre) @ REACHES.T).max(axis=0)
        if area < (1 - TOUCHING) * sides.prod():
            along = REACHES @ axes.T
            reach = reach + np.sqrt(np.einsum("ki,ij,kj->k", along, spread, along))
        return np.concatenate([centre, np.sqrt(area) * self.normal, reach])

    @cached_property
    def thickness(self):
        """m; the area over the longer side of the bounding rectangle."""
        return self.area / float(self._loops.rectangle[2].max())

    def contains(self, local, inset=0.0):
        """Whether local points (n, 2) are within the outline and outside the holes, by at least inset m -> (n,)"""
        points = np.asarray(local, float)[:, :2] * self._loops.rectangle[2]
        inside = enclosed(points, self._loops.in_rectangle)
        if inset:
            away = np.linalg.norm(points - nearest_on_edges(points, self._loops.in_rectangle), axis=1)
            inside &= away >= inset
        return inside

    @property
    def chart_area(self):
        return float(np.linalg.norm(np.cross(*self.linear[:, :2].T)))

    @classmethod
    def cells(cls, shapes, own, low, high, places):
        share, at = super().cells(shapes, own, low, high, places)
        for k in np.unique(own):
            mine = np.flatnonzero(own == k)
            inside, chosen = shapes[k]._within_cells(low[mine], high[mine], places)
            if not inside.any() and share[mine].sum() > 1 - 1e-9:  # a sliver between all places: its triangles' middles
                middles = shapes[k].local(shapes[k].triangles.mean(axis=1))[:, :2]
                inside[0], chosen[0] = 1 / TRIED, middles[np.arange(places) % len(middles)]
            share[mine] *= inside
            at[mine] = np.where((inside == 1)[:, None, None], at[mine], chosen)
        return share, at

    def _within_cells(self, low, high, places):
        """Of cells low (k, 2) to high (k, 2): the part of each (k,) inside, and so many places there (k, places, 2)."""
        tried = low[:, None] + (high - low)[:, None] * square_lattice(TRIED)
        inside = self.contains(tried.reshape(-1, 2)).reshape(tried.shape[:2])
        count = inside.sum(axis=1)
        order = np.argsort(~inside, axis=1, kind="stable")
        pick = np.take_along_axis(order, np.arange(places) % np.maximum(count, 1)[:, None], axis=1)
        return count / TRIED, np.take_along_axis(tried, pick[..., None], axis=1)

    def project(self, points):
        corner, axes, _ = self._loops.rectangle
        flat = (np.asarray(points, float) - corner) @ axes.T
        outside = np.flatnonzero(~enclosed(flat, self._loops.in_rectangle))
        flat[outside] = nearest_on_edges(flat[outside], self._loops.in_rectangle)
        return corner + flat @ axes

    def inset(self, points, least):
        local = self.local(points)
        border = max(INSET * np.sqrt(self.area), least)
        outer = np.flatnonzero(~self.contains(local, border))
        at = self.local(self.project(points[outer]))[:, :2]
        local[outer, :2] = into_triangles(at, self._few_in_chart) if len(outer) else at
        local[:, 2] = 0.0
        return self.world(local)

    def spread(self, count):
        wanted = int(min(1.2 * count * self._loops.rectangle[2].prod() / self.area + 16, TRIED * count))
        local = square_lattice(wanted)
        local = local[self.contains(local)][:count]
        points = self.world(np.column_stack([local, np.zeros(len(local))]))
        rest = count - len(points)
        return np.concatenate([points, spread_over(self.triangles, rest)]) if rest else points

    @property
    def problem(self):
        return self._loops.problem

    def parametric(self, st):
        """Points (n, 3) m at parameters (n, 2), those of its bounding rectangle, and area vectors (n, 3) m^2 of the
        front; without area outside: patches that its loops trim."""
        area = np.cross(self.linear[:, 0], self.linear[:, 1])
        return self.world(np.column_stack([st, 0 * st[:, 0]])), self.contains(st)[:, None] * area

    def factor(self, points, normals):
        return loops_unoccluded(points, normals, self._loops.in_plane)
