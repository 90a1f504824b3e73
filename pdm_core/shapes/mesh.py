"""Shapes that are neither flat nor round: triangles, as they are given, with shading normals at their corners.

Whatever is given is taken: open, non-manifold, inside out, crossing itself. Only faces that no light can reach are left
out, those without area and those that lie on an earlier one with the same corners.
"""

from functools import cached_property

import numpy as np

from ..closed_forms import cross, dot
from ..coincident import REACHES
from ..names import names_of
from ..nearest import NearestTriangle
from .mesh_faces import Faces
from .mesh_light import MeshLight
from .plane import Facet
from .rims import ways_in
from .shape import FLATTEST, Shape, unit
from .triangles import INNER, barycentric, inner, spread_over

LIFTED = 1e-4  # of a triangle's size: what points that give or receive light are lifted off it


class Mesh(Shape):
    """vertices (n, 3) m; faces (f, 3), (f, 4) or a list of corner lists, their front the side from which they run
    counter-clockwise.

    smooth: whether faces are shaded smoothly, for all or for each (f,); or the shading normals, for each vertex (n, 3)
    or for each corner of each face in turn (sum of corners, 3).

    vertices (n, 3) m; triangles (t, 3): vertices of the triangles that faces are cut into; face_of (t,): their faces.
    """

    is_mesh = True
    has_chart = False
    plural = "meshes"

    def __init__(self, vertices, faces, smooth=True):
        self.faces = Faces(vertices, faces, smooth)
        self.vertices, self.face_count = self.faces.vertices, self.faces.count
        self._lights = {}  # MeshLight of the front and of the back, by the sign

    def __repr__(self):
        return f"Mesh of {len(self.vertices)} vertices and {self.face_count} faces"

    @property
    def triangles(self):
        """(t, 3) Vertices of the triangles that faces are cut into."""
        return self.faces.triangles

    @property
    def face_of(self):
        """(t,) Their faces."""
        return self.faces.of

    @cached_property
    def corner_normals(self):
        """(t, 3, 3) unit shading normals."""
        return self.faces.corner_normals(self.triangle_normals)

    @cached_property
    def _points(self):
        """(t, 3, 3) m, corners of the triangles."""
        return self.vertices[self.triangles]

    @cached_property
    def _area_vectors(self):
        """(t, 3) m^2"""
        p, q, r = (self.vertices[self.triangles[:, k]].T for k in range(3))
        return cross(q - p, r - p).T / 2

    @cached_property
    def triangle_normals(self):
        """(t, 3) unit normals of the front."""
        return unit(self._area_vectors)

    @cached_property
    def areas(self):
        """(t,) m^2"""
        return np.sqrt(dot(self._area_vectors.T, self._area_vectors.T))

    @cached_property
    def area(self):
        """m^2"""
        return float(self.areas.sum())

    @cached_property
    def pieces(self):
        """[Facet] its triangles."""
        return [Facet.of(corners, self.thickness) for corners in self._points]

    @property
    def facet_count(self):
        """How many of `facets` there are."""
        return len(self.triangles)

    @property
    def facets(self):
        """What rays meet: origin, u, v (k, 3) m, whether triangles (k,), chart (k, 2, 3), see rays.facets."""
        p, q, r = np.moveaxis(self._points, 1, 0)
        chart = np.tile(np.array([[[0.0, 1, 0], [0, 0, 1]]]), (len(p), 1, 1))
        return p, q - p, r - p, np.ones(len(p), bool), chart

    @cached_property
    def bounds(self):
        """Centre (3,) m, of the box, and radius of a sphere around the shape."""
        centre = (self._used.min(axis=0) + self._used.max(axis=0)) / 2
        return centre, float(np.linalg.norm(self._used - centre, axis=1).max())

    @cached_property
    def _used(self):
        """(n, 3) m, vertices that triangles have."""
        used = np.zeros(len(self.vertices), bool)
        used[self.triangles] = True
        return self.vertices[used]

    @cached_property
    def marks(self):
        """(12,) m; the same of the same shape."""
        p, q, r = (self.vertices[self.triangles[:, k]] for k in range(3))
        middle = (p + q + r) / 3
        centre = self.areas @ middle / self.area
        spread = np.sqrt(self.areas @ ((middle - centre) ** 2).sum(axis=1) / self.area)
        volume = np.einsum("ti,ti->", self._area_vectors, p - centre) / 3
        front = self._area_vectors.sum(axis=0) / np.sqrt(self.area) + volume / self.area * np.array([0.3, 0.5, 0.8])
        reach = np.abs((self._used - centre) @ REACHES.T).max(axis=0)
        return np.concatenate([centre, front, reach + spread])

    @cached_property
    def thickness(self):
        """m; the area over the extent: of a wire about its girth."""
        return self.area / (2 * self.bounds[1])

    @cached_property
    def _tree(self):
        return NearestTriangle(self._points)

    def nearest(self, points):
        """points (n, 3) -> nearest triangle (n,), barycentric coordinates (n, 3) of the nearest point on it."""
        points = np.asarray(points, float)
        names, corner = self._corner_names
        found = np.minimum(np.searchsorted(names, name := names_of(points)), len(names) - 1)
        elsewhere = np.flatnonzero(names[found] != name)
        triangle, weights = corner[found] // 3, np.eye(3)[corner[found] % 3]
        triangle[elsewhere], weights[elsewhere] = self._tree.find(points[elsewhere])
        return triangle, weights

    @cached_property
    def _names(self):
        """(t, 3) names of the places of triangles' corners."""
        return names_of(self.vertices)[self.triangles]

    @cached_property
    def _longest(self):
        """(t,) m of the triangles' edges."""
        return np.linalg.norm(self._points - np.roll(self._points, 1, axis=1), axis=2).max(axis=1)

    @cached_property
    def _rims(self):
        """See ways_in."""
        return ways_in(self._names, self._points, self.triangle_normals)

    @cached_property
    def _corner_names(self):
        """Names (k,), sorted, of the places where triangles have corners, and a corner there of each (k,): what is read
        off at vertices needs no search."""
        return np.unique(self._names.ravel(), return_index=True)

    def project(self, points):
        """points (n, 3) -> nearest points (n, 3) on the shape."""
        triangle, weights = self.nearest(points)
        return np.einsum("nk,nki->ni", weights, self._points[triangle])

    def normals(self, points):
        """Unit shading normals (n, 3) of the front at points (n, 3); their faces' own where those cancel."""
        triangle, weights = self.nearest(points)
        normals = np.einsum("nk,nki->ni", weights, self.corner_normals[triangle])
        cancel = np.linalg.norm(normals, axis=1) < FLATTEST
        normals[cancel] = self.triangle_normals[triangle[cancel]]
        return unit(normals)

    def face_normals(self, points):
        """Unit normals (n, 3) of the faces' fronts at points (n, 3)."""
        return self.triangle_normals[self.nearest(points)[0]]

    def unhidden(self, points, normals, sign, tolerance):
        """points (n, 3) m, unit normals (n, 3) -> (n,) irradiance / pi where the radiance of the side of the sign is 1
        and nothing hides it, itself neither."""
        if sign not in self._lights:
            self._lights[sign] = MeshLight(self, sign)
        return self._lights[sign].at(points, normals)

    @cached_property
    def lift(self):
        """m; what points are lifted off it that stand for its light."""
        return LIFTED * np.sqrt(np.median(self.areas))

    def reach(self, least):
        """m; what points are lifted off it at most that receive light, at least so many m."""
        return LIFTED * np.sqrt(self.areas.max()) + least

    def receiving(self, points, sign, least, normals=None, middle=None, triangle=None):
        """points (n, 3) m near it -> where they receive light on the side of the sign, at least so many m off it, and
        shading normals there (n, 3): those told, its own where they are nan or None. middle (n, 3) m: a point of the
        face that each belongs to, nan or None for the nearest; triangle (n,): where it is known."""
        toward = points
        if middle is not None:  # clearly on its own face
            known = np.isfinite(middle).all(axis=1)
            toward = np.where(known[:, None], points + INNER * (np.nan_to_num(middle) - points), points)
        if triangle is None:
            triangle, bary = self.nearest(toward)
        else:
            bary = barycentric(toward, self._points[triangle])
        flat = sign * self.triangle_normals[triangle]
        smooth = sign * np.einsum("nk,nki->ni", bary, self.corner_normals[triangle])
        if normals is not None:
            given = np.isfinite(normals).all(axis=1) & (np.abs(np.nan_to_num(normals)).max(axis=1) > 0)
            smooth = np.where(given[:, None], np.nan_to_num(normals), smooth)
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        smooth = np.where(length > 1e-12, smooth / np.maximum(length, 1e-300), flat)
        bary = inner(bary)
        place = np.einsum("nk,nki->ni", bary, self._points[triangle]) + self._inward(triangle, bary, least)
        lift = np.maximum(LIFTED * np.sqrt(self.areas[triangle]), least)
        # off the face, or along the light's own normal where faces meet in a ridge
        return place + lift[:, None] * (flat + smooth) / 2, smooth

    def _inward(self, triangle, bary, least):
        """(n, 3) m: how far points, bary (n, 3) on triangles (n,), are moved along them, so as to keep at least so many
        m from where the mesh ends: what touches it there may be a little before them."""
        out, least = np.zeros((len(triangle), 3)), min(least, self.thickness / 4)
        some = np.flatnonzero(
            least * self._longest[triangle] > 2 * INNER * self.areas[triangle]
        )  # else they keep it anyway
        if not len(some) or not len(self._rims[0]):
            return out
        (names, ways), name = self._rims, self._names[triangle[some]]
        found = np.minimum(np.searchsorted(names, name), len(names) - 1)
        way = np.einsum("nk,nki->ni", np.where(names[found] == name, bary[some], 0.0), ways[found])
        normal = self.triangle_normals[triangle[some]]
        out[some] = least * (way - np.einsum("ni,ni->n", way, normal)[:, None] * normal)
        return out

    def spread(self, count):
        """Points (count, 3) m spread evenly over the area."""
        return spread_over(self._points[self._tree.order], count)  # neighbours follow each other

    def problem(self):
        """What is wrong with the shape, as a sentence, or None."""
        return self._problem

    @cached_property
    def _problem(self):
        return self.faces.problem()
