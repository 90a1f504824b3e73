"""An independent judge: a plain path tracer that shares nothing with the core but the description of the scene."""

import numpy as np

from pdm_core import Mesh, Plane, Polygon, Sphere
from pdm_core.signs_of_life import finish

BOUNCES = 200
CLUSTER = 32  # triangles, about, that a ray tests only if it meets the ball around them
SURVIVE = 0.95  # of Russian roulette, at most
OFF = 1e-7  # of the scene's size: rays begin so far from their surface


PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])  # steps of points that fill the unit square evenly


def random_points(shape, square):
    """Points (n, 3) m on a shape, evenly over its area (over that of the round one, of an ellipsoid), from places in
    the unit square (n, 2)."""
    if isinstance(shape, Sphere):
        return shape.world(_on_ball(square))
    if isinstance(shape, Plane):
        return shape.world(np.column_stack([square, np.zeros(len(square))]))
    p, q, r = np.moveaxis(triangles_of(shape), 1, 0)
    upto = np.cumsum(np.linalg.norm(np.cross(q - p, r - p), axis=1))
    at = square[:, 0] * upto[-1]
    k = np.minimum(np.searchsorted(upto, at, "right"), len(p) - 1)
    first = np.append(0.0, upto)[k]
    s, t = np.sqrt(np.clip((at - first) / (upto[k] - first), 0, 1))[:, None], square[:, 1:]
    return (1 - s) * p[k] + s * ((1 - t) * q[k] + t * r[k])


def _on_ball(square):
    """Unit vectors (n, 3)"""
    z, turn = 1 - 2 * square[:, :1], 2 * np.pi * square[:, 1:]
    around = np.sqrt(1 - z * z)
    return np.concatenate([around * np.cos(turn), around * np.sin(turn), z], axis=1)


def triangles_of(shape):
    """(k, 3, 3) m of a Polygon or a Mesh."""
    return shape.triangles if isinstance(shape, Polygon) else shape.vertices[shape.triangles]


class Tracer:
    def __init__(self, scene):
        self.scene = scene
        self.parts = []  # (shape's number, origin, inverse, kind)
        self.clusters = []  # (centre, radius, parts)
        for k, shape in enumerate(scene.shapes):
            if isinstance(shape, Mesh | Polygon):
                for some in clustered(triangles_of(shape)):
                    centre = some.mean(axis=(0, 1))
                    radius = 1.001 * np.linalg.norm(some - centre, axis=2).max()
                    parts = []
                    for a, b, c in some:
                        linear = np.column_stack([b - a, c - a, np.cross(b - a, c - a)])
                        parts.append((k, a, np.linalg.inv(linear), "triangle"))
                    self.clusters.append((centre, radius, parts))
            else:
                kind = "ball" if isinstance(shape, Sphere) else "plane"
                self.parts.append((k, shape.origin, shape.inverse, kind))
        self.surface = np.full((len(scene.shapes), 2), -1)  # of the front and the back of each shape
        for k, s in enumerate(scene.surfaces):
            self.surface[scene.shape_of[k], int(s.side == "back")] = k

    def hit(self, x, d):
        """Rays x + t d (n, 3) -> surface hit (n,), -1 for none, -2 for a side without a surface; point (n, 3)."""
        nearest, which, front = np.full(len(x), np.inf), np.full(len(x), -1), np.zeros(len(x), bool)

        def meet(part, x, d, rays):
            t, outside = _met(part, x, d)
            closer = np.flatnonzero(t < nearest[rays])
            rays = rays[closer]
            nearest[rays], which[rays], front[rays] = t[closer], part[0], outside[closer]

        for part in self.parts:
            meet(part, x, d, np.arange(len(x)))
        for centre, radius, parts in self.clusters:
            offset = centre - x
            along = (offset * d).sum(axis=1)
            rays = np.flatnonzero(((offset * offset).sum(axis=1) - along**2 <= radius**2) & (along >= -radius))
            some, way = x[rays], d[rays]
            for part in parts:
                meet(part, some, way, rays)
        found = np.where(which >= 0, self.surface[which, (~front).astype(int)], -2)
        surface = np.where(which < 0, -1, np.where(found >= 0, found, -2))
        return surface, x + np.where(np.isfinite(nearest), nearest, 0.0)[:, None] * d

    def normals(self, surface, points):
        """Shading normals and those of faces (n, 3) of surfaces (n,) at points (n, 3)."""
        shading, own = np.empty_like(points), np.empty_like(points)
        for k in np.unique(surface):
            mine, s = surface == k, self.scene.surfaces[k]
            shading[mine], own[mine] = s.normals(points[mine]), face_normals(s, points[mine])
        return shading, own

    def from_lamps(self, x, n, square):
        """Irradiance / pi (n, 3) at points off their surface, by one point on each shining surface, at places
        (n, 2) of it."""
        scene, total = self.scene, np.zeros((len(x), 3))
        for k in np.flatnonzero((scene.emission > 0).any(axis=1)):
            s = scene.surfaces[k]
            y = random_points(s.shape, square)
            d = y - x
            r2 = np.maximum((d * d).sum(1), 1e-300)
            kernel = np.maximum((d * n).sum(1), 0) * np.maximum(-(d * face_normals(s, y)).sum(1), 0) / (np.pi * r2**2)
            some = np.flatnonzero(kernel > 0)
            surface, hit = self.hit(x[some], d[some] / np.sqrt(r2[some, None]))
            seen = (surface == k) & (np.linalg.norm(hit - y[some], axis=1) < 1e-4 * scene.size)
            total[some[seen]] += (kernel[some[seen]] * scene.areas[k])[:, None] * scene.emission[k]
        return total

    def incident(self, surface, points, paths, rng):
        """Irradiance / pi (n, 3) at points (n, 3) of surfaces (n,), each the mean of so many paths. Shading normals
        only shade: what lies below a face is hidden by it."""
        scene, count = self.scene, len(points) * paths
        surface, x = np.repeat(surface, paths), np.repeat(points, paths, axis=0)
        weight, total, alive = np.ones((count, 3)), np.zeros((count, 3)), np.arange(count)
        # of the first lamps and directions of a point those that fill the square evenly, shifted at random
        even = np.arange(1, paths + 1)[:, None] * np.tile(PLASTIC, 2) + rng.random((len(points), 1, 4))
        square = even.reshape(count, 4) % 1
        for _ in range(BOUNCES):
            n, horizon = self.normals(surface, x)
            x = x + OFF * scene.size * horizon
            total[alive] += weight * self.from_lamps(x, n, square[:, :2])
            surface, hit = self.hit(x, _cosine(n, square[:, 2:]))
            out = surface == -1
            total[alive[out]] += weight[out] * scene.background
            on = np.flatnonzero(surface >= 0)
            surface, alive, weight, x = surface[on], alive[on], weight[on], hit[on]
            weight = weight * scene.reflectance[surface]
            chance = np.minimum(weight.max(axis=1), SURVIVE)
            on = np.flatnonzero(rng.random(len(chance)) < chance)
            if not len(on):
                break
            surface, alive, weight, x = surface[on], alive[on], weight[on] / chance[on, None], x[on]
            square = rng.random((len(x), 4))
        return total.reshape(len(points), paths, 3).mean(axis=1)


def _met(part, x, d):
    """Distances (n,) at which rays x + t d (n, 3) meet a part, inf where they do not, and whether its front (n,)."""
    _, origin, inverse, kind = part
    p, e = (x - origin) @ inverse.T, d @ inverse.T
    if kind == "ball":
        a, b, c = (e * e).sum(1), (p * e).sum(1), (p * p).sum(1) - 1
        root = np.sqrt(np.maximum(b * b - a * c, 0))
        t = np.where(-b - root > 0, -b - root, root - b) / a
        return np.where((b * b > a * c) & (t > 0), t, np.inf), c > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -p[:, 2] / e[:, 2]
    at = p[:, :2] + t[:, None] * e[:, :2]
    most = at.sum(axis=1) if kind == "triangle" else at.max(axis=1)
    return np.where((t > 0) & (at >= 0).all(1) & (most <= 1), t, np.inf), e[:, 2] < 0


def clustered(triangles):
    """[(k, 3, 3) m] triangles (n, 3, 3) halved until few are left of each."""
    if len(triangles) <= CLUSTER:
        return [triangles]
    middle = triangles.mean(axis=1)
    order = np.argsort(middle[:, np.ptp(middle, axis=0).argmax()], kind="stable")
    half = len(order) // 2
    return clustered(triangles[order[:half]]) + clustered(triangles[order[half:]])


def face_normals(surface, points):
    """(n, 3) of a surface's side, not bent for shading."""
    shape = surface.shape
    return surface.sign * shape.face_normals(points) if isinstance(shape, Mesh) else surface.normals(points)


def _cosine(n, square):
    """Directions about normals (n, 3), dense as the cosine."""
    d = n + _on_ball(square)
    return d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300)


def places(scene, count, rng):
    """surface (k,), points, normals (k, 3), area (k,) m^2 of each, about count spread over the area of all surfaces."""
    number = np.maximum((count * scene.areas / scene.areas.sum()).round().astype(int), 4)
    points, normals = [], []
    for s, many in zip(scene.surfaces, number):
        p = random_points(s.shape, rng.random((many, 2)))
        points.append(p)
        normals.append(s.normals(p))
    weight = np.repeat(scene.areas / number, number)
    return np.repeat(np.arange(len(scene)), number), np.concatenate(points), np.concatenate(normals), weight


def measured_error(scene, solution, count, paths, rng):
    """Relative L2 error of L - Le: free of the tracer's noise in the mean, from two independent halves."""
    surface, points, _, weight = places(scene, count, rng)
    rho, tracer = scene.reflectance[surface], Tracer(scene)
    halves = [rho * tracer.incident(surface, points, paths // 2, rng) for _ in range(2)]
    mine = rho * finish(solution.incident_steps(surface, points))
    product = (weight[:, None] * (mine - halves[0]) * (mine - halves[1])).sum(axis=1)
    norm = (weight[:, None] * halves[0] * halves[1]).sum()
    noise = np.sqrt((product**2).sum()) / norm
    return np.sqrt(max(product.sum() / norm, 0.0)), np.sqrt(noise)
