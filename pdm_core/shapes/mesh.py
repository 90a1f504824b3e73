"""Shapes that are neither flat nor round: triangles, as they are given, with shading normals at their corners.

Whatever is given is taken: open, non-manifold, inside out, crossing itself. Only faces that no light can reach are left
out, those without area and those that lie on an earlier one with the same corners and look the same way.
"""

from functools import cached_property

import numpy as np

from ..closed_forms import cross, dot
from ..coincident import REACHES
from .mesh_faces import Faces
from .mesh_light import MeshLight
from .mesh_parts import parts_of
from .mesh_places import MeshPlaces
from .mesh_receiving import LIFTED, MeshReceiving
from .plane import Facet
from .rims import ways_in
from .shape import FLATTEST, Shape, unit
from .triangle_tiles import tiles_of
from .triangles import facets_of, spread_over


class Mesh(Shape):
    """vertices (n, 3) m; faces (f, 3), (f, 4) or a list of corner lists, their front the side from which they run
    counter-clockwise.

    smooth: whether faces are shaded smoothly, for all or for each (f,); or the shading normals, for each vertex (n, 3)
    or for each corner of each face in turn (sum of corners, 3).

    vertices (n, 3) m; triangles (t, 3): vertices of the triangles that faces are cut into; faces: Faces.
    """

    is_mesh = True
    plural = "meshes"

    def __init__(self, vertices, faces, smooth=True):
        self.faces = Faces(vertices, faces, smooth)
        self.vertices = self.faces.vertices
        self._lights = {}  # MeshLight of the front and of the back, by the sign

    def __repr__(self):
        return f"Mesh of {len(self.vertices)} vertices and {self.faces.count} faces"

    @property
    def triangles(self):
        """(t, 3) Vertices of the triangles that faces are cut into."""
        return self.faces.triangles

    @cached_property
    def corner_normals(self):
        """(t, 3, 3) unit shading normals."""
        return self.faces.corner_normals(self.triangle_normals)

    @cached_property
    def corners(self):
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
        return float(self.areas.sum())

    @cached_property
    def apart(self):
        return parts_of(self)

    @classmethod
    def of(cls, corners):
        """The mesh of triangles (t, 3, 3) m, shaded flat."""
        return cls(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), smooth=False)

    def cut(self, length):
        parts = tiles_of(self.corners, length)
        return [Mesh.of(part) for part in parts] if len(parts) > 1 else [self]

    @cached_property
    def pieces(self):
        """[Facet] its triangles."""
        return [Facet.of(corners, self.thickness) for corners in self.corners]

    @property
    def facet_count(self):
        return len(self.triangles)

    @property
    def facets(self):
        return facets_of(self.corners, np.tile(np.array([[[0.0, 1, 0], [0, 0, 1]]]), (len(self.corners), 1, 1)))

    @property
    def box(self):
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

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
    def middle(self):
        """(3,) m, the centroid of its area: of a sheet in its plane, as that of its box need not be."""
        return self.areas @ self.corners.mean(axis=1) / self.area

    @cached_property
    def volume(self):
        """m^3; of a closed mesh, negative where it is inside out."""
        return np.einsum("ti,ti->", self._area_vectors, self.corners[:, 0] - self.middle) / 3

    def inner_side(self, near):
        """The sign of the side that is within, of a closed mesh so flat that its walls are no further apart than about
        near m; 0 of others."""
        wide = 2 * self.volume / self.area
        if abs(wide) > near or len(self.ways_in[0]):
            return 0
        return 1 if wide < -near / 2 else -1

    @cached_property
    def marks(self):
        p, q, r = (self.vertices[self.triangles[:, k]] for k in range(3))
        middle, centre = (p + q + r) / 3, self.middle
        spread = np.sqrt(self.areas @ ((middle - centre) ** 2).sum(axis=1) / self.area)
        front = self._area_vectors.sum(axis=0) / np.sqrt(self.area)
        front = front + self.volume / self.area * np.array([0.3, 0.5, 0.8])
        reach = np.abs((self._used - centre) @ REACHES.T).max(axis=0)
        return np.concatenate([centre, front, reach + spread])

    @cached_property
    def thickness(self):
        """m; the area over the extent: of a wire about its girth."""
        return self.area / (2 * self.bounds[1])

    @cached_property
    def ways_in(self):
        """See rims.ways_in."""
        return ways_in(self.places.names, self.corners, self.triangle_normals)

    @cached_property
    def places(self):
        """MeshPlaces of the triangles."""
        return MeshPlaces(self.vertices, self.triangles)

    def nearest(self, points):
        """points (n, 3) -> nearest triangle (n,), barycentric coordinates (n, 3) of the nearest point on it."""
        return self.places.nearest(points)

    def project(self, points):
        triangle, weights = self.nearest(points)
        return np.einsum("nk,nki->ni", weights, self.corners[triangle])

    def normals(self, points):
        """Unit shading normals (n, 3) of the front at points (n, 3); their faces' own where those cancel."""
        triangle, weights = self.nearest(points)
        normals = np.einsum("nk,nki->ni", weights, self.corner_normals[triangle])
        cancel = np.linalg.norm(normals, axis=1) < FLATTEST
        normals[cancel] = self.triangle_normals[triangle[cancel]]
        return unit(normals)

    def face_normals(self, points):
        return self.triangle_normals[self.nearest(points)[0]]

    def unhidden(self, points, normals, sign, tolerance):
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

    @cached_property
    def receiving(self):
        """MeshReceiving.at of it."""
        return MeshReceiving(self).at

    def spread(self, count):
        return spread_over(self.corners[self.places.tree.order], count)  # neighbours follow each other

    @cached_property
    def problem(self):
        return self.faces.problem
