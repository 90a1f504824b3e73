"""Points where other shapes stand on theirs: read off beside those, on the side they show, instead of under them."""

import numpy as np

from ..shapes.shape import PARALLEL
from ..tolerances import FLUSH, KEPT
from .feet import Feet

OPPOSITE = PARALLEL**2 / 2 - 1  # cosine of normals that look opposite ways
NARROW = 2.0**-6  # square of the sine of wedges, seven degrees wide, out of which points need not come


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
        """[(j, side (3,))] of flat shapes near points (n, 3) m of a mesh, and the normal of their side where it is, 0
        where it is in their plane."""
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        flats = np.flatnonzero(((self.low <= high) & (self.high >= low)).all(axis=1))
        height = np.einsum("ki,ki->k", mesh.bounds[0] - self.origin[flats], self.normal[flats])
        sign = np.where(np.abs(height) > FLUSH * self.tolerance, np.sign(height), 0.0)
        return list(zip(flats, sign[:, None] * self.normal[flats]))

    def lifted(self, mesh, at, points, normals, faces):
        """Points (n, 3) m lifted off a mesh, at what MeshReceiving.at tells of where on it, normals and its faces' own
        (n, 3) -> points, normals: none is lifted through a flat shape that the mesh stands on or against or is sunk in.

        A cup's foot would see what is under the table. What looks the way that a one-sided one does lies on it. What
        lies against it has its face's own normal.
        """
        triangle, foot = at
        kept, reach = KEPT * self.tolerance, mesh.reach(KEPT * self.tolerance)
        for j, side in self._near(mesh, points, reach):
            height, before = ((a - self.origin[j]) @ self.normal[j] for a in (points, foot))
            on = (np.abs(height) <= reach) | (height * before < 0)
            if not self.two_sided[j]:
                on &= faces @ self.normal[j] < -OPPOSITE
            on = np.flatnonzero(on)
            level = points[on] - height[on, None] * self.normal[j]
            over = ((level >= self.low[j] - reach) & (level <= self.high[j] + reach)).all(axis=1)
            on, level = on[over], level[over]
            on = on[np.linalg.norm(level - self.shapes[j].project(level), axis=1) <= reach]
            side = self._side(j, side, foot[on], mesh.corners[triangle[on]])
            height = np.einsum("ni,ni->n", points[on] - self.origin[j], side)
            low = height < kept
            on, side, height = on[low], side[low], height[low]
            cosine = np.einsum("ni,ni->n", faces[on], side)
            # what lies against it is within the mesh now, where a shading normal would look about
            held = cosine < OPPOSITE
            normals[on[held]] = faces[on[held]]
            # out of the wedge between the two, as far off the mesh as before
            cosine = np.where(held, 0.0, np.minimum(cosine, 0.0))[:, None]
            points[on] += (kept - height)[:, None] * (side - cosine * faces[on]) / np.maximum(1 - cosine**2, NARROW)
        return points, normals

    def _side(self, j, side, foot, corners):
        """(n, 3) Normals of the flat shape j's side on which points are, foot (n, 3) m on triangles, corners (n, 3, 3)
        m: that of the foot itself, of one in the plane that of its triangle, of one that lies there the mesh's, side.
        """
        normal, flush = self.normal[j], FLUSH * self.tolerance
        height, corner = (foot - self.origin[j]) @ normal, (corners - self.origin[j]) @ normal
        through = np.where(corner.max(axis=1) > flush, 1.0, np.where(corner.min(axis=1) < -flush, -1.0, side @ normal))
        return np.where(np.abs(height) > flush, np.sign(height), through)[:, None] * normal
