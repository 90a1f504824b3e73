"""Points where other shapes stand on theirs: read off beside those, on the side they show, instead of under them."""

import numpy as np

from .facets import KEPT
from .placed import Placed

ON = 4.0  # tolerances within which a point lies on another shape
ALIKE = 1e-3  # sine up to which two shapes lie in one plane
PAIRS = 1 << 20  # of points and shapes at once


def read_places(facets, surface, points, normals=None, inward=None):
    """Placed points (n, 3) m of surfaces (n,) where colours are read off; normals, inward as Placed's."""
    if "_beside" not in facets.__dict__:
        facets._beside = Beside(facets)
    receivers = Placed(facets, surface, facets._beside.moved(surface, points), normals, inward)
    facets._beside.lifted(receivers, surface)
    return receivers


class Beside:
    """The flat shapes of facets, and what stands on them."""

    def __init__(self, facets):
        scene = facets.scene
        self.scene, self.tolerance, self.centre = scene, facets.tolerance, facets.centre
        flat = facets.flat
        self.shapes = [scene.shapes[k] for k in flat]
        corners = [shape.outline for shape in self.shapes]
        reach = ON * facets.tolerance
        self.low = np.array([c.min(axis=0) for c in corners]).reshape(-1, 3) - reach
        self.high = np.array([c.max(axis=0) for c in corners]).reshape(-1, 3) + reach
        self.origin = np.array([c[0] for c in corners]).reshape(-1, 3)
        shown = np.where(facets.surface[facets.first[flat], 0] >= 0, 1.0, -1.0)
        self.normal = np.array([s.normal for s in self.shapes]).reshape(-1, 3) * shown[:, None]
        self.place = np.full(len(scene.shapes), -1)
        self.place[flat] = np.arange(len(flat))

    def moved(self, surface, points):
        """points (n, 3) m of surfaces (n,) -> (n, 3): those on which other flat shapes stand just there are moved to
        these ones' front, by little more than what touches is told by.

        A floor's vertex in the edge of a box is under the box as much as beside it; only the one side is ever seen.
        """
        out, own = np.array(points, float), self.place[self.scene.shape_of[surface]]
        for k in np.unique(own[own >= 0]):
            near = ((self.low <= self.high[k]) & (self.high >= self.low[k])).all(axis=1)
            near &= np.linalg.norm(np.cross(self.normal, self.normal[k]), axis=1) > ALIKE
            some = np.flatnonzero(own == k)
            out[some] += KEPT * self.tolerance * self._away(k, np.flatnonzero(near), out[some])
        return out

    def lifted(self, receivers, surface):
        """Receivers on meshes, of surfaces (n,), in place: none is lifted through a flat shape that its mesh stands on.

        A cup's foot would see what is under the table.
        """
        number = self.scene.shape_of[surface]
        for k in np.unique(number[self.place[number] < 0]):
            shape = self.scene.shapes[k]
            if not shape.is_mesh:
                continue
            reach = shape.reach(KEPT * self.tolerance)
            some = np.flatnonzero(number == k)
            points = receivers.exact[some]
            centre, low, high = shape.bounds[0], points.min(axis=0) - reach, points.max(axis=0) + reach
            for j in np.flatnonzero(((self.low <= high) & (self.high >= low)).all(axis=1)):
                side = np.sign((centre - self.origin[j]) @ self.normal[j]) * self.normal[j]
                height = (points - self.origin[j]) @ side
                on = (np.abs(height) <= reach) & (height < KEPT * self.tolerance)
                on &= ((points >= self.low[j] - reach) & (points <= self.high[j] + reach)).all(axis=1)
                on = np.flatnonzero(on)
                off = np.linalg.norm(points[on] - self.shapes[j].project(points[on]), axis=1)
                on = on[off <= reach]
                points[on] += (KEPT * self.tolerance - height[on])[:, None] * side
            receivers.exact[some] = points
            receivers.points[some] = points - self.centre

    def _away(self, own, others, points):
        """(n, 3) The sum of the unit directions, in the plane of the shape `own`, that lead away from others there."""
        out = np.zeros_like(points)
        step = max(1, PAIRS // max(len(others), 1))
        for start in range(0, len(points), step):
            part = points[start : start + step]
            height = part @ self.normal[others].T - np.einsum("ki,ki->k", self.origin[others], self.normal[others])
            for j in np.flatnonzero((np.abs(height) <= ON * self.tolerance).any(axis=0)):
                other = others[j]
                on = np.flatnonzero(np.abs(height[:, j]) <= ON * self.tolerance)
                on = on[((part[on] >= self.low[other]) & (part[on] <= self.high[other])).all(axis=1)]
                off = np.linalg.norm(part[on] - self.shapes[other].project(part[on]), axis=1)
                along = self.normal[other] - (self.normal[other] @ self.normal[own]) * self.normal[own]
                out[start + on[off <= ON * self.tolerance]] += along / np.linalg.norm(along)
        return out
