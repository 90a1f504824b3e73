"""What shines: emitting surfaces and lights, each with what it would give unhidden and with points that stand for it."""

import copy

import numpy as np

from ..closed_forms import polygon_unoccluded
from ..mesh import Mesh
from ..polygon import Polygon
from ..scene import Sphere, lattice, square_lattice
from ..view import ShapeTable, visible_factors
from .bundles import PARALLEL, TOUCHING

PAIRS = 1 << 16  # of points and triangles at once
TRIANGLES = 256  # of a mesh, up to which its light is a sum of closed forms
SPREAD = 1024  # points that stand for the light of a larger one


class Source:
    """colour (3,): radiance; distant: whether sample places are directions; skip: the shape that does not hide it;
    shadows: whether any does; pattern(directions (n, 3)) -> (n,) of its radiance, None where it is even."""

    distant, skip, lift = False, -1, 0.0
    shadows, pattern = True, None

    def __init__(self, colour, name):
        self.colour, self.name = np.asarray(colour, float), name

    def against(self, points, normals):
        """(n,) Whether it gives nothing there, as it lies against the shape or the point is within it."""
        return np.zeros(len(points), bool)


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
            self.lift = 1e-4 * np.sqrt(np.median(self.shape.areas))

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
            return self._of_points(points, normals)
        corners, n = shape.vertices[shape.triangles], self.surface.sign * shape.triangle_normals
        step = max(1, PAIRS // len(corners))
        for start in range(0, len(points), step):
            x, m = points[start : start + step], normals[start : start + step]
            ahead = np.einsum("pti,ti->pt", x[:, None] - corners[:, 0], n) > 0
            r, k = np.nonzero(ahead)
            factor = polygon_unoccluded(x[r], m[r], corners[k])
            out[start : start + step] = np.bincount(r, factor, len(x))
        return out

    def _of_points(self, points, normals):
        place, n, weight = self.samples(SPREAD)
        out = np.zeros(len(points))
        step = max(1, PAIRS // len(place))
        for start in range(0, len(points), step):
            k = kernel(place, n, points[start : start + step], normals[start : start + step])
            out[start : start + step] = k @ weight / np.pi
        return out

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


class Lamp(Source):
    """One of Scene.lights."""

    def __init__(self, light):
        super().__init__(light.colour, light.name)
        self.light, self.distant = light, light.distant
        self.unoccluded, self.samples = light.unoccluded, light.samples
        self.pattern, self.shadows = light.pattern, light.shadows

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
    lights, out = iter(scene.lights), []
    for source in sources:
        new = copy.copy(source)
        if isinstance(source, Emitter):
            new.surface, new.colour = scene.surfaces[source.index], scene.emission[source.index]
        else:
            new.light = next(lights)
            new.colour = np.asarray(new.light.colour, float)
        out.append(new)
    return out


def sources_of(facets, by_rays):
    """[Source] of all that shines, but for surfaces by_rays (n surfaces,) bool, which rays meet."""
    scene = facets.scene
    shines = (scene.emission > 0).any(axis=1) & ~by_rays
    emitters = [Emitter(facets, k) for k in np.flatnonzero(shines)]
    return emitters + [Lamp(light) for light in scene.lights]
