"""Two results of one scene against each other: at given points, and over all surfaces."""

from dataclasses import dataclass

import numpy as np

from .read_off import spread_points

POINTS = 2000  # over all surfaces


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
    edges = np.cumsum(scene.areas) / scene.areas.sum()
    surface = np.minimum(np.searchsorted(edges, (np.arange(count) + 0.5) / count), len(scene) - 1)
    return surface, spread_points(scene, surface, np.random.default_rng(11))
