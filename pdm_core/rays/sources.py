"""What shines: emitting surfaces and lights, what each would give unhidden and points that stand for it."""

import copy
from functools import cached_property

import numpy as np

from ..closed_forms import polygon_unoccluded
from ..mesh import Mesh
from ..polygon import Polygon
from ..scene import Sphere, lattice, square_lattice
from ..view import ShapeTable, visible_factors
from .bundles import PARALLEL, TOUCHING
from .placed import LIFTED

PAIRS = 1 << 16  # of points and triangles at once
TRIANGLES = 256  # of a mesh, up to which its light is a sum of closed forms
CLUSTER = 16  # of them in a cluster at most, of larger ones
MOST_CLUSTERS = 512
AFAR = 6.0  # radii of a cluster from which on it is one point


class Source:
    """colour (3,): radiance; distant: whether sample places are directions; skip: the shape that does not hide it;
    shadows: whether any does; pattern(directions (n, 3)) -> (n,) of its radiance, None where it is even; beam: see
    Light."""

    distant, skip, lift = False, -1, 0.0
    shadows, pattern, beam = True, None, None

    def __init__(self, colour, name):
        self.colour, self.name = np.asarray(colour, float), name

    def against(self, points, normals):
        """(n,) Whether it gives nothing there, as it lies against the shape or the point is within it."""
        return np.zeros(len(points), bool)

    def take_light(self, scene, before):
        """Becomes what it is under another scene's light; before: the sources before it, under that light."""
        raise NotImplementedError


class Emitter(Source):
    """An emitting surface. Where its emission varies, colour is its mean and each sample point has its own part of it:
    `tint(points)` (n, 3), of the mean."""

    def __init__(self, facets, index):
        scene = facets.scene
        self.index, self.surface, self.shape = index, scene.surfaces[index], scene.surfaces[index].shape
        super().__init__(scene.emission[index], self.surface.name)
        self.skip = -1 if isinstance(self.shape, Mesh) else scene.shape_of[index]
        self.lift, self.touching = 0.0, TOUCHING * facets.tolerance
        self.table = ShapeTable([self.shape], facets.tolerance) if isinstance(self.shape, Sphere) else None
        if isinstance(self.shape, Mesh):
            self.lift = LIFTED * np.sqrt(np.median(self.shape.areas))

    def take_light(self, scene, before):
        """See Source."""
        self.surface, self.colour = scene.surfaces[self.index], scene.emission[self.index]

    def unoccluded(self, points, normals):
        """points, normals (n, 3) -> (n,) irradiance / pi where the radiance is 1 and nothing hides it."""
        shape = self.shape
        if isinstance(shape, Sphere):
            return visible_factors(self.table, points, normals, np.zeros(len(points), int))
        if isinstance(shape, Mesh):
            return self._of_triangles(points, normals)
        out = np.zeros(len(points))
        seen = np.flatnonzero(self.surface.sign * ((points - shape.bounds[0]) @ shape.normal) > 0)
        if isinstance(shape, Polygon):
            out[seen] = shape.factor(points[seen], normals[seen])
        else:
            corners = np.broadcast_to(shape.corners, (len(seen), 4, 3))
            out[seen] = polygon_unoccluded(points[seen], normals[seen], corners)
        return out

    def against(self, points, normals):
        """(n,) Whether points lie against a flat shape, or within the ball that shines outwards."""
        shape = self.shape
        if isinstance(shape, Sphere):
            return (shape.local(points) ** 2).sum(axis=1) < 1 - 1e-9
        if isinstance(shape, Mesh):
            return np.zeros(len(points), bool)
        near = np.abs((points - shape.bounds[0]) @ shape.normal) < self.touching
        return near & (self.surface.sign * (normals @ shape.normal) < PARALLEL**2 / 2 - 1)

    def _of_triangles(self, points, normals):
        shape, out = self.shape, np.zeros(len(points))
        if len(shape.triangles) > TRIANGLES:
            return self._of_clusters(points, normals)
        corners, n = shape.vertices[shape.triangles], self.surface.sign * shape.triangle_normals
        step = max(1, PAIRS // len(corners))
        for start in range(0, len(points), step):
            x, m = points[start : start + step], normals[start : start + step]
            ahead = np.einsum("pti,ti->pt", x[:, None] - corners[:, 0], n) > 0
            r, k = np.nonzero(ahead)
            factor = polygon_unoccluded(x[r], m[r], corners[k])
            out[start : start + step] = np.bincount(r, factor, len(x))
        return out

    def _of_clusters(self, points, normals):
        """From afar a cluster of triangles is one point; those of near ones are summed each."""
        shape, clusters = self.shape, self.clusters
        corners, n = shape.vertices[shape.triangles], self.surface.sign * shape.triangle_normals
        out = np.zeros(len(points))
        step = max(1, PAIRS // len(clusters.area))
        for start in range(0, len(points), step):
            x, m = points[start : start + step], normals[start : start + step]
            k = kernel(clusters.place, clusters.normal, x, m)
            offset = x[:, None] - clusters.place
            near = np.einsum("pci,pci->pc", offset, offset) < (AFAR * clusters.radius) ** 2
            out[start : start + step] = np.where(near, 0.0, k) @ clusters.area / np.pi
            r, c = np.nonzero(near)
            if not len(r):
                continue
            count = clusters.count[c]
            cuts = np.unique(np.searchsorted(np.cumsum(count), np.arange(0, count.sum(), PAIRS)))
            for first, last in zip(cuts, np.append(cuts[1:], len(r))):
                many = count[first:last]
                who = start + np.repeat(r[first:last], many)
                place = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many)
                t = clusters.order[np.repeat(clusters.first[c[first:last]], many) + place]
                ahead = np.flatnonzero(np.einsum("pi,pi->p", points[who] - corners[t, 0], n[t]) > 0)
                who, t = who[ahead], t[ahead]
                out += np.bincount(who, polygon_unoccluded(points[who], normals[who], corners[t]), len(points))
        return out

    @cached_property
    def clusters(self):
        """The Clusters of a mesh's triangles."""
        return Clusters(self.shape, self.surface.sign)

    def samples(self, count):
        """Places (k, 3) m on it, normals (k, 3), weights (k,) m^2."""
        shape = self.shape
        if isinstance(shape, Sphere):
            points = shape.world(lattice(2 * count))  # half of them look away from any point
            areas = np.full(2 * count, shape.area / (2 * count))
            return points, self.surface.normals(points), areas
        if isinstance(shape, Mesh) or isinstance(shape, Polygon):
            points = shape.spread(count)
        else:
            points = shape.world(np.column_stack([square_lattice(count), np.zeros(count)]))
        normals = self.surface.normals(points)
        return points + self.lift * normals, normals, np.full(count, shape.area / count)

    def tint(self, points):
        """(k, 3) emission at sample points, of its mean; None where it is the same everywhere."""
        if not callable(self.surface.emission):
            return None
        return self.surface.emission_at(points) / np.maximum(self.colour, 1e-300)


class Clusters:
    """Of a mesh's triangles, near each other and turned alike: place, normal (c, 3), its length below 1 where they are
    bent; area, radius (c,); order (t,) of the triangles, first, count (c,) of each cluster in it."""

    def __init__(self, mesh, sign):
        middle = mesh.vertices[mesh.triangles].mean(axis=1)
        axis = np.abs(mesh.triangle_normals).argmax(axis=1)
        turned = 2 * axis + (mesh.triangle_normals[np.arange(len(axis)), axis] > 0)
        most = max(CLUSTER, len(axis) // MOST_CLUSTERS)
        parts, left = [], [np.flatnonzero(turned == k) for k in range(6)]
        while left:
            some = left.pop()
            if len(some) <= most:
                parts += [some] * (len(some) > 0)
                continue
            some = some[np.argsort(middle[some, np.ptp(middle[some], axis=0).argmax()], kind="stable")]
            left += [some[: len(some) // 2], some[len(some) // 2 :]]
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


class Lamp(Source):
    """Scene.lights[number]."""

    def __init__(self, light, number):
        super().__init__(light.colour, light.name)
        self.light, self.number, self.distant = light, number, light.distant
        self.unoccluded, self.samples = light.unoccluded, light.samples
        self.pattern, self.shadows, self.beam = light.pattern, light.shadows, light.beam

    def take_light(self, scene, before):
        """See Source."""
        self.light = scene.lights[self.number]
        self.colour = np.asarray(self.light.colour, float)

    def tint(self, points):
        """A light is of one colour."""
        return None


def kernel(place, normal, points, normals):
    """(n, k) cosines over square distance, of sample places (k, 3) with normals (k, 3) or None, at points (n, 3)."""
    d = place[None] - points[:, None]
    square = np.maximum(np.einsum("nki,nki->nk", d, d), 1e-300)
    out = np.maximum(np.einsum("nki,ni->nk", d, normals), 0.0)
    if normal is None:
        return out / square**1.5
    return out * np.maximum(-np.einsum("nki,ki->nk", d, normal), 0.0) / square**2


def relit(sources, scene):
    """The same sources under the light of another scene of the same shapes and lights."""
    out = []
    for source in sources:
        new = copy.copy(source)
        new.take_light(scene, out)
        out.append(new)
    return out


def sources_of(facets, by_rays):
    """[Source] of all that shines, but for surfaces by_rays (n surfaces,) bool, which rays meet."""
    scene = facets.scene
    shines = (scene.emission > 0).any(axis=1) & ~by_rays
    emitters = [Emitter(facets, k) for k in np.flatnonzero(shines)]
    return emitters + [Lamp(light, k) for k, light in enumerate(scene.lights)]
