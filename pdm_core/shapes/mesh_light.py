"""What a shining mesh gives unhidden: a sum over its triangles, from afar over clusters of them."""

from functools import cached_property

import numpy as np

from ..at_once import AT_ONCE, entries_of, runs, slices
from ..closed_forms import dot, kernel, ways
from ..contour import polygon_unoccluded
from .shape import SIDES, side_of
from .triangles import halves

TRIANGLES = 256  # of a mesh, up to which its light is a sum of closed forms
CLUSTER = 16  # of them in a cluster at most, of larger ones
MOST_CLUSTERS = 512
AFAR = 6.0  # radii of a cluster from which on it is one point


class MeshLight:
    """Of the side of the sign of a Mesh, where its radiance is 1; of backs those that no other face lies on."""

    def __init__(self, mesh, sign):
        self.mesh, self.sign = mesh, sign
        self.seen = np.flatnonzero((sign > 0) | ~mesh.faces.backed)
        self.corners, self.normals = mesh.vertices[mesh.triangles], sign * mesh.triangle_normals

    def at(self, points, normals):
        """points (n, 3) m, unit normals (n, 3) -> (n,) irradiance / pi"""
        if len(self.seen) > TRIANGLES:
            return self._of_clusters(points, normals)
        corners, n, out = self.corners[self.seen], self.normals[self.seen], np.zeros(len(points))
        for part in slices(len(points), AT_ONCE // max(len(corners), 1)):
            x, m = points[part], normals[part]
            ahead = np.einsum("pti,ti->pt", x[:, None] - corners[:, 0], n) > 0
            r, k = np.nonzero(ahead)
            factor = polygon_unoccluded(x[r], m[r], corners[k])
            out[part] = np.bincount(r, factor, len(x))
        return out

    def _of_clusters(self, points, normals):
        """From afar a cluster of triangles is one point; those of near ones are summed each."""
        clusters, corners, n, out = self.clusters, self.corners, self.normals, np.zeros(len(points))
        for part in slices(len(points), AT_ONCE // len(clusters.area)):
            x, m = points[part], normals[part]
            way = ways(x, clusters.place)
            near = dot(way, way) < (AFAR * clusters.radius[:, None]) ** 2
            out[part] = clusters.area @ np.where(near, 0.0, kernel(way, clusters.normal, m)) / np.pi
            c, r = np.nonzero(near)
            if not len(r):
                continue
            count = clusters.count[c]
            for some in runs(count):
                which, entry = entries_of((clusters.first, clusters.count), c[some])
                who, t = part.start + r[some][which], clusters.order[entry]
                ahead = np.flatnonzero(np.einsum("pi,pi->p", points[who] - corners[t, 0], n[t]) > 0)
                who, t = who[ahead], t[ahead]
                out += np.bincount(who, polygon_unoccluded(points[who], normals[who], corners[t]), len(points))
        return out

    @cached_property
    def clusters(self):
        """The Clusters of its triangles."""
        return Clusters(self.mesh, self.sign, self.seen)


class Clusters:
    """Of a mesh's triangles, near each other and turned alike: place, normal (c, 3), its length below 1 where they are
    bent; area, radius (c,); order (t,) of the triangles seen (t,), first, count (c,) of each cluster in it."""

    def __init__(self, mesh, sign, seen):
        middle = mesh.vertices[mesh.triangles].mean(axis=1)
        turned, most = side_of(mesh.triangle_normals), max(CLUSTER, len(middle) // MOST_CLUSTERS)
        parts, left = [], [seen[turned[seen] == k] for k in range(SIDES)]
        while left:
            some = left.pop()
            if len(some) <= most:
                parts += [some] * (len(some) > 0)
                continue
            left += halves(some, middle)
        self.order, self.count = np.concatenate(parts), np.array([len(part) for part in parts])
        self.first = np.cumsum(self.count) - self.count

        def total(value):
            return np.add.reduceat(value[self.order], self.first)

        areas = mesh.areas[:, None]
        self.area = np.maximum(total(mesh.areas), 1e-300)
        self.place = total(areas * middle) / self.area[:, None]
        self.normal = sign * total(areas * mesh.triangle_normals) / self.area[:, None]
        own = np.repeat(np.arange(len(parts)), self.count)
        far = np.linalg.norm(mesh.vertices[mesh.triangles[self.order]] - self.place[own, None], axis=2).max(axis=1)
        self.radius = np.maximum.reduceat(far, self.first)
