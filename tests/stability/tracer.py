"""An independent judge: a plain path tracer that shares nothing with the core but the description of the scene."""

import numpy as np

from pdm_core import Mesh, Plane, Polygon, Sphere

BOUNCES = 200
SURVIVE = 0.95  # of Russian roulette, at most
OFF = 1e-7  # of the scene's size: rays begin so far from their surface


def random_points(shape, count, rng):
    """(count, 3) m on a shape, evenly over its area (over that of the round one, of an ellipsoid)."""
    if isinstance(shape, Sphere):
        local = rng.normal(size=(count, 3))
        return shape.world(local / np.linalg.norm(local, axis=1, keepdims=True))
    if isinstance(shape, Plane):
        return shape.world(np.column_stack([rng.random((count, 2)), np.zeros(count)]))
    p, q, r = np.moveaxis(triangles_of(shape), 1, 0)
    areas = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    k = rng.choice(len(p), count, p=areas / areas.sum())
    s, t = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    return (1 - s) * p[k] + s * ((1 - t) * q[k] + t * r[k])


def triangles_of(shape):
    """(k, 3, 3) m of a Polygon or a Mesh."""
    return shape.triangles if isinstance(shape, Polygon) else shape.vertices[shape.triangles]


class Tracer:
    def __init__(self, scene):
        self.scene = scene
        self.parts = []  # (shape's number, origin, inverse, kind)
        for k, shape in enumerate(scene.shapes):
            if isinstance(shape, Mesh | Polygon):
                for a, b, c in triangles_of(shape):
                    linear = np.column_stack([b - a, c - a, np.cross(b - a, c - a)])
                    self.parts.append((k, a, np.linalg.inv(linear), "triangle"))
            else:
                kind = "ball" if isinstance(shape, Sphere) else "plane"
                self.parts.append((k, shape.origin, shape.inverse, kind))
        self.surface = np.full((len(scene.shapes), 2), -1)  # of the front and the back of each shape
        for k, s in enumerate(scene.surfaces):
            self.surface[scene.shape_of[k], int(s.side == "back")] = k

    def hit(self, x, d):
        """Rays x + t d (n, 3) -> surface hit (n,), -1 for none, -2 for a side without a surface; point (n, 3)."""
        nearest, which, front = np.full(len(x), np.inf), np.full(len(x), -1), np.zeros(len(x), bool)
        for k, origin, inverse, kind in self.parts:
            p, e = (x - origin) @ inverse.T, d @ inverse.T
            if kind == "ball":
                a, b, c = (e * e).sum(1), (p * e).sum(1), (p * p).sum(1) - 1
                root = np.sqrt(np.maximum(b * b - a * c, 0))
                t = np.where(-b - root > 0, -b - root, root - b) / a
                t, outside = np.where((b * b > a * c) & (t > 0), t, np.inf), c > 0
            else:
                with np.errstate(divide="ignore", invalid="ignore"):
                    t = -p[:, 2] / e[:, 2]
                at = p[:, :2] + t[:, None] * e[:, :2]
                most = at.sum(axis=1) if kind == "triangle" else at.max(axis=1)
                t, outside = np.where((t > 0) & (at >= 0).all(1) & (most <= 1), t, np.inf), e[:, 2] < 0
            closer = t < nearest
            nearest, which, front = (
                np.where(closer, t, nearest),
                np.where(closer, k, which),
                np.where(closer, outside, front),
            )
        found = np.where(which >= 0, self.surface[which, (~front).astype(int)], -2)
        surface = np.where(which < 0, -1, np.where(found >= 0, found, -2))
        return surface, x + np.where(np.isfinite(nearest), nearest, 0.0)[:, None] * d

    def from_lamps(self, x, n, rng):
        """Irradiance / pi (n, 3) at points off their surface, by one point on each shining surface."""
        scene, total = self.scene, np.zeros((len(x), 3))
        for k in np.flatnonzero((scene.emission > 0).any(axis=1)):
            s = scene.surfaces[k]
            y = random_points(s.shape, len(x), rng)
            d = y - x
            r2 = np.maximum((d * d).sum(1), 1e-300)
            kernel = np.maximum((d * n).sum(1), 0) * np.maximum(-(d * s.normals(y)).sum(1), 0) / (np.pi * r2**2)
            some = np.flatnonzero(kernel > 0)
            surface, hit = self.hit(x[some], d[some] / np.sqrt(r2[some, None]))
            seen = (surface == k) & (np.linalg.norm(hit - y[some], axis=1) < 1e-4 * scene.size)
            total[some[seen]] += (kernel[some[seen]] * scene.areas[k])[:, None] * scene.emission[k]
        return total

    def incident(self, points, normals, paths, rng):
        """Irradiance / pi (n, 3) at points (n, 3) with normals (n, 3), each the mean of so many paths."""
        scene, count = self.scene, len(points) * paths
        x, n = np.repeat(points, paths, axis=0), np.repeat(normals, paths, axis=0)
        weight, total, alive = np.ones((count, 3)), np.zeros((count, 3)), np.arange(count)
        for _ in range(BOUNCES):
            x = x + OFF * scene.size * n
            surface, hit = self.hit(x, _cosine(n, rng))
            out = surface == -1
            total[alive[out]] += weight[out] * scene.background
            total[alive] += weight * self.from_lamps(x, n, rng)
            on = np.flatnonzero(surface >= 0)
            surface, alive, weight, x = surface[on], alive[on], weight[on], hit[on]
            weight = weight * scene.reflectance[surface]
            chance = np.minimum(weight.max(axis=1), SURVIVE)
            on = np.flatnonzero(rng.random(len(chance)) < chance)
            if not len(on):
                break
            surface, alive, weight, x = surface[on], alive[on], weight[on] / chance[on, None], x[on]
            n = np.empty_like(x)
            for s in np.unique(surface):
                n[surface == s] = scene.surfaces[s].normals(x[surface == s])
        return total.reshape(len(points), paths, 3).mean(axis=1)


def _cosine(n, rng):
    """Directions about normals (n, 3), dense as the cosine."""
    z = rng.normal(size=n.shape)
    d = n + z / np.linalg.norm(z, axis=1, keepdims=True)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def places(scene, count, rng):
    """surface (k,), points, normals (k, 3), about count spread over the area of the scene's surfaces."""
    number = np.maximum((count * scene.areas / scene.areas.sum()).round().astype(int), 4)
    points, normals = [], []
    for s, many in zip(scene.surfaces, number):
        p = random_points(s.shape, many, rng)
        points.append(p)
        normals.append(s.normals(p))
    weight = np.repeat(scene.areas / number, number)
    return np.repeat(np.arange(len(scene)), number), np.concatenate(points), np.concatenate(normals), weight


def measured_error(scene, solution, count, paths, rng):
    """Relative L2 error of L - Le: free of the tracer's noise in the mean, from two independent halves."""
    surface, points, normals, weight = places(scene, count, rng)
    rho, tracer = scene.reflectance[surface], Tracer(scene)
    halves = [rho * tracer.incident(points, normals, paths // 2, rng) for _ in range(2)]
    mine = np.empty_like(points)
    for s in np.unique(surface):
        mine[surface == s] = rho[surface == s] * solution.incident(s, points[surface == s])
    product = (weight[:, None] * (mine - halves[0]) * (mine - halves[1])).sum(axis=1)
    norm = (weight[:, None] * halves[0] * halves[1]).sum()
    noise = np.sqrt((product**2).sum()) / norm
    return np.sqrt(max(product.sum() / norm, 0.0)), np.sqrt(noise)
