"""Two results of one scene against each other: at given points, and over all surfaces."""

from dataclasses import dataclass

import numpy as np

from .error_estimates import sample_points
from .field import Field
from .scene import Plane, Sphere

POINTS = 2000  # over all surfaces
SEED = 11


@dataclass(frozen=True)
class Difference:
    """l2: relative L2; p95, worst: 95th percentile and greatest of the differences at points, relative to the mean
    square of the light there."""

    l2: float
    p95: float
    worst: float


def difference(value, reference, own_light):
    """value, reference (n, 3) radiance, own_light (n, 3) of it emitted -> Difference of L - Le at equally many points
    everywhere."""
    size = float(np.sqrt(((reference - own_light) ** 2).sum(axis=1).mean()))
    wrong = np.linalg.norm(value - reference, axis=1) / max(size, 1e-300)
    if not size > 0 or not len(wrong):
        return Difference(0.0, 0.0, 0.0)
    return Difference(float(np.sqrt((wrong**2).mean())), float(np.percentile(wrong, 95)), float(wrong.max()))


def points_over(scene, count=POINTS):
    """Random points spread evenly over the area: surface (k,), points (k, 3) m."""
    if not all(isinstance(shape, Plane | Sphere) for shape in scene.shapes):
        return _spread_over(scene, count)
    field = Field(scene)
    nothing, everything = np.zeros(len(field.level)), np.ones(len(scene), bool)
    surface, points, _, weight = sample_points(field, nothing, np.zeros(len(scene)), everything, 4 * count, SEED)
    # more lie in small places than their area asks for, weighted less: one is taken where so much of the area begins
    edges = np.cumsum(weight) / weight.sum()
    pick = np.searchsorted(edges, (np.arange(count) + 0.5) / count)
    return surface[pick], points[pick]


def _spread_over(scene, count):
    """The same for any shapes, of points that each has evenly over its area."""
    rng, edges = np.random.default_rng(SEED), np.cumsum(scene.areas)
    surface = np.searchsorted(edges / edges[-1], (np.arange(count) + 0.5) / count)
    points = np.empty((count, 3))
    for k in np.unique(surface):
        mine = np.flatnonzero(surface == k)
        spread = scene.surfaces[k].shape.spread(4 * len(mine))
        points[mine] = spread[rng.permutation(len(spread))[: len(mine)]]
    return surface, points


def material_at(scene, surface, points):
    """Reflectance and emission (k, 3) at points (k, 3) m on these surfaces (k,), where they vary too."""
    reflectance, emission = scene.reflectance[surface], scene.emission[surface]
    for k in np.unique(surface):
        mine, own = np.flatnonzero(surface == k), scene.surfaces[k]
        if own.varies:
            reflectance[mine], emission[mine] = own.reflectance_at(points[mine]), own.emission_at(points[mine])
    return reflectance, emission


def radiance_at(solution, surface, points, chunk=4096):
    """Radiance (k, 3) of a solution at points on these surfaces; yields the fraction done."""
    value, done = np.empty((len(points), 3)), 0
    for s in np.unique(surface):
        mine = np.flatnonzero(surface == s)
        for start in range(0, len(mine), chunk):
            part = mine[start : start + chunk]
            value[part] = solution.radiance(int(s), points[part])
            done += len(part)
            yield done / len(points)
    return value
