"""How far colours interpolated between a mesh's vertices are from the light: what the mesh itself cannot show."""

from dataclasses import dataclass

import numpy as np

from .bake_points import world_vertices

SHARE = 0.1  # points looked at, of the vertices baked
MOST, MANY, FEW = 4000, 32, 8  # points in all, and on each object where that allows it, and in any case


@dataclass
class Between:
    """error: relative L2 error of the interpolated colours over all objects, as Solution.error; parts (n objects,)."""

    error: float
    parts: np.ndarray

    def too_coarse(self, target):
        """Indices of the objects, worst first, without which the rest would be within the target."""
        order = np.argsort(-self.parts)
        left = np.sqrt(np.maximum(self.error**2 - np.cumsum(self.parts[order] ** 2), 0.0))
        return order[: int(np.argmax(left <= target)) + 1] if self.error > target else order[:0]


def between_steps(solution, field, targets, points, values):
    """Generator of the fraction done, object by object; returns Between. Points are random, of a fixed seed.

    field(surface, points) -> (n, 3) before the exposure; values: [(k, 3)] of it at the BakePoints `points`.
    """
    total = sum(p.size for p in points)
    least = int(np.clip(MOST // len(points), FEW, MANY))
    rng, parts = np.random.default_rng(1), []
    for target, p, value in zip(targets, points, values, strict=True):
        count = least + int(min(SHARE * total, MOST) * p.size / total)
        parts.append(_error(solution, field, target, p, p.colours(value)[:, :3].astype(float), count, rng))
        yield len(parts) / len(points)
    parts = np.array(parts) / solution.norm if solution.norm > 0 else np.zeros(len(parts))  # nothing was to be found
    return Between(float(np.sqrt((parts**2).sum())), parts)


def _error(solution, field, target, points, colours, count, rng):
    """L2 norm over one object of what interpolation costs, in radiance times metres."""
    ends, corners, surface = _triangles(target, points.domain)
    area = np.linalg.norm(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]), axis=1) / 2
    if not area.sum() > 0:
        return 0.0
    edges = np.cumsum(area) / area.sum()
    pick = np.minimum(np.searchsorted(edges, (np.arange(count) + rng.random(count)) / count), len(area) - 1)
    weight = np.sort(rng.random((count, 2)), axis=1)
    weight = np.column_stack([weight[:, 0], weight[:, 1] - weight[:, 0], 1 - weight[:, 1]])
    at = np.einsum("nk,nki->ni", weight, ends[pick])
    wrong = np.einsum("nk,nki->ni", weight, colours[corners[pick]])
    for s in np.unique(surface[pick]):
        mine = surface[pick] == s
        wrong[mine] -= field(int(s), at[mine])
        if field == solution.incident:
            wrong[mine] *= solution.scene.reflectance[s]
    return float(np.sqrt(area.sum() * (wrong**2).sum(axis=1).mean()))


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
