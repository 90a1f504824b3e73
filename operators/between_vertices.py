"""How far colours interpolated between a mesh's vertices are from the light: what the mesh itself cannot show."""

from dataclasses import dataclass

import numpy as np

from ..pdm_core.scene import unit
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


def between_steps(field, targets, points, values):
    """Generator of the fraction done; returns Between. Points are random, of a fixed seed.

    field: the Field that is baked, before the exposure; values: [(k, 3)] of it at the BakePoints `points`.
    """
    total = sum(p.size for p in points)
    least = int(np.clip(MOST // len(points), FEW, MANY))
    rng, norm = np.random.default_rng(1), field.solution.norm
    looked = []
    for target, p, value in zip(targets, points, values, strict=True):
        count = least + int(min(SHARE * total, MOST) * p.size / total)
        looked.append(_look(target, p, p.colours(value)[:, :3].astype(float), count, rng))
    surface, at, interpolated, weight, normals, inward = (np.concatenate(part) for part in zip(*looked))
    wrong = interpolated - (yield from field.steps(surface, at, normals, inward))
    if field.quantity == "IRRADIANCE":
        wrong *= field.solution.scene.reflectance[surface]
    owner = np.repeat(np.arange(len(looked)), [len(look[0]) for look in looked])
    parts = np.sqrt(np.bincount(owner, weight * (wrong**2).sum(axis=1), len(looked)))
    parts = parts / norm if norm > 0 else np.zeros(len(parts))  # nothing was to be found
    return Between(float(np.sqrt((parts**2).sum())), parts)


def _look(target, points, colours, count, rng):
    """Random points on one object: their surfaces, places, interpolated colours, weights m^2, normals and places inward."""
    ends, corners, surface, normals = _triangles(target, points.domain)
    area = np.linalg.norm(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]), axis=1) / 2
    if not area.sum() > 0:
        return np.zeros(0, int), *np.zeros((2, 0, 3)), np.zeros(0), *np.zeros((2, 0, 3))
    edges = np.cumsum(area) / area.sum()
    pick = np.minimum(np.searchsorted(edges, (np.arange(count) + rng.random(count)) / count), len(area) - 1)
    weight = np.sort(rng.random((count, 2)), axis=1)
    weight = np.column_stack([weight[:, 0], weight[:, 1] - weight[:, 0], 1 - weight[:, 1]])
    at = np.einsum("nk,nki->ni", weight, ends[pick])
    interpolated = np.einsum("nk,nki->ni", weight, colours[corners[pick]])
    shaded = np.full(at.shape, np.nan) if normals is None else unit(np.einsum("nk,nki->ni", weight, normals[pick]))
    return surface[pick], at, interpolated, np.full(count, area.sum() / count), shaded, ends[pick].mean(axis=1)


def _triangles(target, domain):
    """World corners (t, 3, 3) m of the mesh's triangles, indices (t, 3) of their colours, their surfaces (t,), and
    shading normals (t, 3, 3) or None."""
    loops = target.base.triangles
    vertices = target.base.corners[loops]
    normals = None if target.corner_normals is None else target.corner_normals[loops]
    return world_vertices(target)[vertices], loops if domain == "CORNER" else vertices, target.triangle_surface, normals
