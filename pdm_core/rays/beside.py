"""Points where other shapes stand on theirs: read off beside those, on the side they show, instead of under them."""

import numpy as np

from ..read_off import runs_of
from ..shapes.shape import PARALLEL
from ..tolerances import FLUSH, KEPT
from .feet import Feet
from .grid import pairs_of

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
        into the open before these, by little more than what touches is told by.

        A floor's vertex in the edge of a box is under the box as much as beside it; only the one side is ever seen.
        """
        shape, sign = self.scene.shape_of[surface], self.scene.sign[surface]
        points = np.array(points, float) - self.centre
        return self.centre + self.feet.moved(shape, sign, points, KEPT * self.tolerance)

    def shown(self, surface, points, normals, inward):
        """points (n, 3) m of surfaces (n,), normals and inward as Placed's -> inward: vertices of meshes that stand on
        flat shapes, or against them, are of one of their faces that does not lie there, where the normals allow it."""
        number = self.scene.shape_of[surface]
        for k in np.unique(number[self.own[number] < 0]):
            mesh, some = self.scene.shapes[k], np.flatnonzero(number == k)
            flush = []
            for j, on in self._over(points[some], 0.0):
                height = (points[some[on]] - self.origin[j]) @ self.normal[j]
                flush.append((j, on[np.abs(height) <= FLUSH * self.tolerance]))
            some = some[np.unique(np.concatenate([np.zeros(0, int), *(on for _, on in flush)]))]
            point, triangle = mesh.places.around(points[some])
            who, against = some[point], np.zeros(len(point), bool)
            faces = self.scene.sign[surface[who], None] * mesh.triangle_normals[triangle]
            for j, _ in [pair for pair in flush if len(pair[1])]:
                side = self._toward(mesh, j)
                lies = faces @ side < OPPOSITE
                if normals is not None:  # of a flat face that lies there
                    lies &= ~(normals[who] @ side < OPPOSITE)
                lies = np.flatnonzero(lies)
                off = np.linalg.norm(points[who[lies]] - self.shapes[j].project(points[who[lies]]), axis=1)
                against[lies[off <= FLUSH * self.tolerance]] = True
            turned = np.flatnonzero(~against & np.isin(who, who[against]))
            if len(turned):
                which, first = np.unique(who[turned], return_index=True)
                inward = np.full(points.shape, np.nan) if inward is None else np.array(inward)
                inward[which] = mesh.corners[triangle[turned[first]]].mean(axis=1)
        return inward

    def _over(self, points, reach):
        """Yields numbers of flat shapes and which (k,) of points (n, 3) m are within reach m of their boxes."""
        low, high = self.low - reach, self.high + reach
        found = [np.zeros((2, 0), int)]
        for who, flat in pairs_of(*points[:, :2].T, low[:, :2].T, high[:, :2].T):
            near = ((points[who] >= low[flat]) & (points[who] <= high[flat])).all(axis=1)
            found.append(np.stack([who[near], flat[near]]))
        who, flat = np.concatenate(found, axis=1)
        for j, some in runs_of(flat):
            yield j, who[some]

    def _toward(self, mesh, j):
        """(3,) Normal of the flat shape j's side on which a mesh is, 0 where it is in its plane."""
        height = (mesh.middle - self.origin[j]) @ self.normal[j]
        return (np.sign(height) if abs(height) > FLUSH * self.tolerance else 0.0) * self.normal[j]

    def lifted(self, mesh, at, points, normals, faces):
        """Points (n, 3) m lifted off a mesh, at what MeshReceiving.at tells of where on it, normals and its faces' own
        (n, 3) -> points, normals: none is lifted through a flat shape that the mesh stands on or against or is sunk in.

        A cup's foot would see what is under the table. What looks the way that a one-sided one does lies on it. What
        lies against it has its face's own normal.
        """
        triangle, foot = at
        kept, reach = KEPT * self.tolerance, mesh.reach(KEPT * self.tolerance)
        for j, on in self._over(points, reach + np.linalg.norm(points - foot, axis=1).max(initial=0.0)):
            height, before = ((a[on] - self.origin[j]) @ self.normal[j] for a in (points, foot))
            near = (np.abs(height) <= reach) | (height * before < 0)
            if not self.two_sided[j]:
                near &= faces[on] @ self.normal[j] < -OPPOSITE
            on, height = on[near], height[near]
            level = points[on] - height[:, None] * self.normal[j]
            over = ((level >= self.low[j] - reach) & (level <= self.high[j] + reach)).all(axis=1)
            on, level = on[over], level[over]
            on = on[np.linalg.norm(level - self.shapes[j].project(level), axis=1) <= reach]
            if not len(on):
                continue
            side = self._side(j, self._toward(mesh, j), foot[on], mesh.corners[triangle[on]])
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
