"""Places on surfaces as receivers of rays: moved off what bounds their shapes, and told what they must not meet."""

import copy

import numpy as np

from ..mesh import Mesh
from ..polygon import Polygon
from ..read_off import runs_of
from ..scene import Sphere
from .bundles import Receivers
from .facets import KEPT

INSET = 2e-4  # of a shape's extent: what points keep from its border at least
INNER = 2e-3  # least barycentric coordinate of points on triangles
LIFTED = 1e-4  # of a triangle's size: what points of meshes are lifted off it
MEET = 1e-7  # difference of barycentric coordinates up to which a point is next to several triangles alike
MET = 8.0  # tolerances within which what lies against a flat shape hides what is beyond
TRIANGLES = 1 << 18  # pairs of points and triangles compared at once


class Placed(Receivers):
    """Receivers at points (n, 3) m near surfaces (n,): points on them, at exact places (n, 3) m in the scene.

    normals (n, 3): shading normals of points on meshes, of the surface's side, nan or None for the mesh's own; middle
    (n, 3) m: a point of the face that a point of a mesh belongs to, nan or None for the nearest; triangle (n,): of a
    mesh, where it is known.
    """

    def __init__(self, facets, surface, points, normals=None, middle=None, triangle=None):
        scene = facets.scene
        out, normal = np.array(points, float), np.zeros((len(points), 3))
        own, start = np.full(len(points), -1), np.zeros(len(points))
        inside = np.zeros(len(points), bool)
        for k, some in runs_of(surface):
            place = _Place(facets, scene.surfaces[k])
            given = (None if a is None else a[some] for a in (normals, middle, triangle))
            out[some], normal[some] = place(out[some], *given)
            out[some] += facets.moved[scene.shape_of[k]] * scene.surfaces[k].sign * normal[some]
            own[some] = -1 if isinstance(scene.surfaces[k].shape, Mesh) else scene.shape_of[k]
            inside[some] = scene.surfaces[k].is_inside
            start[some] = place.start
        super().__init__(out - facets.centre, normal, own, start, inside)
        self.surface, self.exact = surface, out

    def joined(self, other):
        """These places and then the other's."""
        both = copy.copy(self)
        for name, value in vars(self).items():
            setattr(both, name, np.concatenate([value, getattr(other, name)]))
        return both

    def reorder(self, index):
        """Makes the n-th place that of index[n] (n,)."""
        for name, value in vars(self).items():
            setattr(self, name, value[index])


class _Place:
    """Where points of one surface receive light."""

    def __init__(self, facets, surface):
        self.surface, self.shape, self.tolerance = surface, surface.shape, facets.tolerance
        solid = isinstance(self.shape, Mesh) or surface.is_inside
        self.start = facets.tolerance if solid else -MET * facets.tolerance

    def __call__(self, points, normals, middle, triangle):
        """points (n, 3) m -> points on the surface, normals (n, 3)"""
        if isinstance(self.shape, Sphere):
            points = self.shape.project(points)
            return points, self.surface.normals(points)
        if isinstance(self.shape, Mesh):
            return self._on_mesh(points, normals, middle, triangle)
        local = self.shape.local(points)
        if isinstance(self.shape, Polygon):
            border = max(INSET * np.sqrt(self.shape.area), KEPT * self.tolerance)
            outer = np.flatnonzero(~self.shape.contains(local, border))
            at = self.shape.local(self.shape.project(points[outer]))[:, :2]
            local[outer, :2] = self._in_triangles(at) if len(outer) else at
        else:
            edges = np.linalg.norm(self.shape.linear[:, :2], axis=0)
            border = np.minimum(np.maximum(INSET, KEPT * self.tolerance / edges), 0.25)
            local[:, :2] = np.clip(local[:, :2], border, 1 - border)
        local[:, 2] = 0.0
        points = self.shape.world(local)
        return points, self.surface.normals(points)

    def _in_triangles(self, at):
        """Chart positions (n, 2) of a polygon moved into the triangles that they lie in or next to; where several meet,
        to the middle: at a corner that points inwards a single one would see along one of its edges alone."""
        corners = self.shape.local(self.shape.few_triangles.reshape(-1, 3))[:, :2].reshape(-1, 3, 2)
        a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        det = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        det = np.where(det == 0, np.inf, det)
        out = np.empty_like(at)
        step = max(1, TRIANGLES // len(a))
        for start in range(0, len(at), step):
            d = at[start : start + step, None] - a
            s = (d[..., 0] * v[:, 1] - d[..., 1] * v[:, 0]) / det
            t = (u[:, 0] * d[..., 1] - u[:, 1] * d[..., 0]) / det
            bary = np.stack([1 - s - t, s, t], axis=-1)
            least = bary.min(axis=-1)
            point, k = np.nonzero(least >= least.max(axis=1, keepdims=True) - MEET)
            place = np.einsum("nk,nki->ni", inner(bary[point, k]), corners[k])
            count = np.bincount(point, minlength=len(least))
            out[start : start + step] = np.stack([np.bincount(point, c, len(least)) / count for c in place.T], axis=1)
        return out

    def _on_mesh(self, points, normals, middle, triangle):
        shape, sign = self.shape, self.surface.sign
        toward = points
        if middle is not None:  # clearly on its own face
            known = np.isfinite(middle).all(axis=1)
            toward = np.where(known[:, None], points + INNER * (np.nan_to_num(middle) - points), points)
        if triangle is None:
            triangle, bary = shape.nearest(toward)
        else:
            bary = barycentric(toward, shape.vertices[shape.triangles[triangle]])
        flat = sign * shape.triangle_normals[triangle]
        smooth = sign * np.einsum("nk,nki->ni", bary, shape.corner_normals[triangle])
        if normals is not None:
            given = np.isfinite(normals).all(axis=1) & (np.abs(np.nan_to_num(normals)).max(axis=1) > 0)
            smooth = np.where(given[:, None], np.nan_to_num(normals), smooth)
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        smooth = np.where(length > 1e-12, smooth / np.maximum(length, 1e-300), flat)
        place = np.einsum("nk,nki->ni", inner(bary), shape.vertices[shape.triangles[triangle]])
        lift = np.maximum(LIFTED * np.sqrt(shape.areas[triangle]), KEPT * self.tolerance)
        # off the face, or along the light's own normal where faces meet in a ridge
        return place + lift[:, None] * (flat + smooth) / 2, smooth


def barycentric(points, corners):
    """Coordinates (n, 3) of points (n, 3) in the planes of triangles (n, 3, 3)."""
    u, v, d = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    uu, uv, vv, du, dv = (np.einsum("ni,ni->n", *pair) for pair in ((u, u), (u, v), (v, v), (d, u), (d, v)))
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
    return np.stack([1 - s - t, s, t], axis=1)


def inner(bary):
    """Barycentric coordinates (n, 3) moved into their triangles."""
    bary = np.maximum(bary, INNER)
    return bary / bary.sum(axis=1, keepdims=True)
