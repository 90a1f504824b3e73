"""How far colours interpolated between a mesh's vertices are from the light: what the mesh itself cannot show."""

from dataclasses import dataclass, field

import numpy as np

from .bake_points import world_vertices

SHARE = 0.1  # points looked at, of the vertices baked
MOST, MANY, FEW = 4000, 32, 8  # points in all, and on each object where that allows it, and in any case
FINER = 2, 4, 8, 16, 32, 64  # parts of an edge, for which meshes that are too coarse are looked at
LOOKED, LEAST_LOOKED = 500, 64  # points of that, in all and on each object


@dataclass
class Between:
    """error: relative L2 error of the interpolated colours over all objects, as Solution.error; parts (n objects,);
    finer {index of an object that is too coarse: [(N, its part if each face were N x N)]}."""

    error: float
    parts: np.ndarray
    finer: dict = field(default_factory=dict)

    def too_coarse(self, target):
        """Indices of the objects, worst first, without which the rest would be within the target."""
        order = np.argsort(-self.parts)
        left = np.sqrt(np.maximum(self.error**2 - np.cumsum(self.parts[order] ** 2), 0.0))
        return order[: int(np.argmax(left <= target)) + 1] if self.error > target else order[:0]


def between_steps(solution, light, targets, points, values, allowed):
    """Generator of the fraction done, object by object; returns Between. Points are random, of a fixed seed.

    light(surface, points) -> (n, 3) before the exposure; values: [(k, 3)] of it at the BakePoints `points`; allowed:
    the error from which on finer meshes are looked at.
    """
    total = sum(p.size for p in points)
    least = int(np.clip(MOST // len(points), FEW, MANY))
    rng, parts = np.random.default_rng(1), []
    for target, p, value in zip(targets, points, values, strict=True):
        count = least + int(min(SHARE * total, MOST) * p.size / total)
        look = _Look(solution, light, target, p, count, rng)
        parts.append(look.error(p.colours(value)[:, :3].astype(float)))
        yield len(parts) / len(points)
    norm = solution.norm if solution.norm > 0 else np.inf  # nothing was to be found
    parts = np.array(parts) / norm
    between = Between(float(np.sqrt((parts**2).sum())), parts)
    coarse = between.too_coarse(allowed)
    for k in coarse:
        look = _Look(solution, light, targets[k], points[k], max(LOOKED // len(coarse), LEAST_LOOKED), rng)
        between.finer[int(k)] = finer = []
        for times in FINER:
            finer.append((times, look.error_finer(times) / norm))
            yield 1.0
            if finer[-1][1] < allowed / (2 * len(coarse)):
                break
    return between


class _Look:
    """Random points of one object, the light there, and where they are in the mesh's triangles."""

    def __init__(self, solution, light, target, points, count, rng):
        ends, self.corners, surface = _triangles(target, points.domain)
        area = np.linalg.norm(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]), axis=1) / 2
        self.area, self.light, self.solution = area.sum(), light, solution
        if not self.area > 0:
            return
        edges = np.cumsum(area) / area.sum()
        self.pick = np.minimum(np.searchsorted(edges, (np.arange(count) + rng.random(count)) / count), len(area) - 1)
        weight = np.sort(rng.random((count, 2)), axis=1)
        self.weight = np.column_stack([weight[:, 0], weight[:, 1] - weight[:, 0], 1 - weight[:, 1]])
        self.ends, self.surface = ends[self.pick], surface[self.pick]
        self.here = self._light_at(np.einsum("nk,nki->ni", self.weight, self.ends), self.surface)

    def error(self, colours):
        """L2 norm over the object of what interpolating `colours`, one a vertex or corner, costs, in radiance times
        metres."""
        if not self.area > 0:
            return 0.0
        return self._norm(np.einsum("nk,nki->ni", self.weight, colours[self.corners[self.pick]]))

    def error_finer(self, times):
        """The same where each triangle is cut into times x times."""
        if not self.area > 0:
            return 0.0
        cell = np.floor(times * self.weight)
        part = times * self.weight - cell
        upright = np.rint(part.sum(axis=1)) < 2  # else the small triangle is upside down
        step = np.where(upright[:, None, None], np.eye(3), 1 - np.eye(3))
        weight = np.where(upright[:, None], part, 1 - part)
        at = np.einsum("nck,nki->nci", (cell[:, None] + step) / times, self.ends)
        values = self._light_at(at.reshape(-1, 3), np.repeat(self.surface, 3)).reshape(-1, 3, 3)
        return self._norm(np.einsum("nc,nci->ni", weight, values))

    def _light_at(self, points, surface):
        out = np.empty((len(points), 3))
        for s in np.unique(surface):
            out[surface == s] = self.light(int(s), points[surface == s])
        return out

    def _norm(self, values):
        wrong = values - self.here
        if self.light == self.solution.incident:
            wrong *= self.solution.scene.reflectance[self.surface]
        return float(np.sqrt(self.area * (wrong**2).sum(axis=1).mean()))


def _triangles(target, domain):
    """World corners (t, 3, 3) m of the mesh's triangles, indices (t, 3) of their colours, their surfaces (t,)."""
    mesh = target.mesh
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    found = {}
    for name, width in (("vertices", 3), ("loops", 3), ("polygon_index", 1)):
        found[name] = np.empty(len(triangles) * width, np.int32)
        triangles.foreach_get(name, found[name])
    of_vertices = found["vertices"].reshape(-1, 3)
    corners = found["loops"].reshape(-1, 3) if domain == "CORNER" else of_vertices
    return world_vertices(target)[of_vertices], corners, np.asarray(target.polygon_surface)[found["polygon_index"]]
