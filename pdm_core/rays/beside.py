"""Points where other shapes stand on theirs: read off beside those, on the side they show, instead of under them."""

import numpy as np

from ..shapes.shape import PARALLEL
from ..tolerances import FLUSH, KEPT
from .feet import Feet
from .placed import Placed

OPPOSITE = PARALLEL**2 / 2 - 1  # cosine of normals that look opposite ways


def read_places(facets, surface, points, normals=None, inward=None):
    """Placed points (n, 3) m of surfaces (n,) where colours are read off; normals, inward as Placed's."""
    own = beside(facets)
    inward = own.shown(surface, points, normals, inward)
    return own.lifted(Placed(facets, surface, own.moved(surface, points), normals, inward))


def beside(facets):
    """The Beside of facets, made once."""
    if "_beside" not in facets.__dict__:
        facets._beside = Beside(facets)
    return facets._beside


class Beside:
    """The flat shapes of facets, and what stands on them."""

    def __init__(self, facets):
        scene = facets.scene
        self.scene, self.tolerance, self.centre = scene, facets.tolerance, facets.centre
        self.own = facets.own
        flat = facets.flat
        self.shapes = [scene.shapes[k] for k in flat]
        reach = FLUSH * facets.tolerance
        low, high = np.array([shape.box for shape in self.shapes]).reshape(-1, 2, 3).swapaxes(0, 1)
        self.low, self.high = low - reach, high + reach
        self.origin = np.array([shape.outline[0] for shape in self.shapes]).reshape(-1, 3)
        self.two_sided = (facets.surface[facets.first[flat]] >= 0).all(axis=1)
        shown = np.where(facets.surface[facets.first[flat], 0] >= 0, 1.0, -1.0)
        self.normal = np.array([s.normal for s in self.shapes]).reshape(-1, 3) * shown[:, None]
        self.feet = Feet(facets, reach)

    def moved(self, surface, points):
        """points (n, 3) m of surfaces (n,) -> (n, 3): those on which flat shapes or meshes stand just there are moved
        to these ones' front, by little more than what touches is told by.

        A floor's vertex in the edge of a box is under the box as much as beside it; only the one side is ever seen.
        """
        points, shape = np.array(points, float), self.scene.shape_of[surface]
        return points + KEPT * self.tolerance * self.feet.away(shape, points - self.centre)

    def shown(self, surface, points, normals, inward):
        """points (n, 3) m of surfaces (n,), normals and inward as Placed's -> inward: vertices of meshes that stand on
        flat shapes, or against them, are of one of their faces that does not lie there, where the normals allow it."""
        number = self.scene.shape_of[surface]
        for k in np.unique(number[self.own[number] < 0]):
            mesh, some = self.scene.shapes[k], np.flatnonzero(number == k)
            flats, reach = self._near(mesh, points[some]), FLUSH * self.tolerance
            heights = [np.abs((points[some] - self.origin[j]) @ self.normal[j]) <= reach for j, _ in flats]
            some = some[np.any(heights, axis=0)] if flats else some[:0]
            point, triangle = mesh.places.around(points[some])
            who, against = some[point], np.zeros(len(point), bool)
            faces = self.scene.sign[surface[who], None] * mesh.triangle_normals[triangle]
            for j, side in flats:
                lies = faces @ side < OPPOSITE
                if normals is not None:  # of a flat face that lies there
                    lies &= ~(normals[who] @ side < OPPOSITE)
                lies = np.flatnonzero(lies)
                off = np.linalg.norm(points[who[lies]] - self.shapes[j].project(points[who[lies]]), axis=1)
                against[lies[off <= reach]] = True
            turned = np.flatnonzero(~against & np.isin(who, who[against]))
            if len(turned):
                which, first = np.unique(who[turned], return_index=True)
                inward = np.full(points.shape, np.nan) if inward is None else np.array(inward)
                inward[which] = mesh.corners[triangle[turned[first]]].mean(axis=1)
        return inward

    def _near(self, mesh, points, reach=0.0):
        """[(j, side (3,))] of flat shapes near points (n, 3) m of a mesh, and the normal of their side where it is."""
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        flats = np.flatnonzero(((self.low <= high) & (self.high >= low)).all(axis=1))
        centre = mesh.bounds[0]
        return [(j, np.sign((centre - self.origin[j]) @ self.normal[j]) * self.normal[j]) for j in flats]

    def lifted(self, receivers):
        """Receivers, those on meshes moved: none is lifted through a flat shape that its mesh stands on or against.

        A cup's foot would see what is under the table. What looks the way that a one-sided one does lies on it. What
        lies against it has its face's own normal.
        """
        number = self.scene.shape_of[receivers.surface]
        for k in np.unique(number[self.own[number] < 0]):
            shape = self.scene.shapes[k]
            reach = shape.reach(KEPT * self.tolerance)
            some = np.flatnonzero(number == k)
            points = receivers.exact[some]
            for j, side in self._near(shape, points, reach):
                height = (points - self.origin[j]) @ side
                on = (np.abs(height) <= reach) & (height < KEPT * self.tolerance)
                if not self.two_sided[j]:
                    on &= receivers.faces[some] @ self.normal[j] < -OPPOSITE
                on &= ((points >= self.low[j] - reach) & (points <= self.high[j] + reach)).all(axis=1)
                on = np.flatnonzero(on)
                off = np.linalg.norm(points[on] - self.shapes[j].project(points[on]), axis=1)
                on = on[off <= reach]
                points[on] += (KEPT * self.tolerance - height[on])[:, None] * side
                # what lies against it is within the mesh now, where a shading normal would look about
                held = some[on[receivers.faces[some[on]] @ side < OPPOSITE]]
                receivers.normals[held] = receivers.faces[held]
            receivers.exact[some] = points
            receivers.points[some] = points - self.centre
        return receivers
