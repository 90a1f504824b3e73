"""Random rooms: whatever stands in a closed room, every point's visible factors sum to one."""

import numpy as np
import pytest
from rooms import cube_planes, ellipsoid
from test_view import floor_points, free_points, rows

from pdm_core import Plane, Sphere

CELLS = np.stack(np.meshgrid(*[(-1.96, 0, 1.96)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


def furniture(rng, cell):
    """One of: a ball, an ellipsoid, a tilted screen, a box, a ball on the floor."""
    kind = rng.integers(0, 5)
    if kind == 0:
        return [Sphere.at(cell + rng.uniform(-0.1, 0.1, 3), rng.uniform(0.1, 0.85))]
    if kind == 1:
        return [ellipsoid(cell, rng.uniform(0.3, 0.95, 3), int(rng.integers(1 << 20)))]
    if kind == 2:
        u, v = (0.9 * w / np.linalg.norm(w) for w in rng.normal(size=(2, 3)))
        return [Plane(cell - (u + v) / 2, u, v)]
    if kind == 3:
        return [Plane(p.origin * 0.25 + cell, p.u * 0.25, p.v * 0.25) for p in cube_planes()]
    radius = rng.uniform(0.2, 0.9)
    return [Sphere.at((cell[0], cell[1], radius - 3), radius)] if cell[2] < -1 else [Sphere.at(cell, 0.5)]


@pytest.mark.parametrize("seed", range(8))
def test_random_room_closes(seed):
    rng = np.random.default_rng(seed)
    chosen = CELLS[rng.choice(len(CELLS), rng.integers(1, 8), replace=False)]
    shapes = cube_planes() + [shape for cell in chosen for shape in furniture(rng, cell)]
    for points, normals in (free_points(shapes, 60, seed), floor_points(40, seed)):
        f = rows(shapes, points, normals)
        assert np.abs(f.sum(axis=0) - 1).max() < 1e-9
        assert np.isfinite(f).all() and f.min() >= 0
