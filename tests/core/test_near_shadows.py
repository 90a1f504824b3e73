"""What lies next to the edge of a shadow sees it where it is, and not where cells end."""

import numpy as np
import pytest
from test_rays import by_rays

from pdm_core import Plane, Polygon, Scene, SunLight, Surface
from pdm_core.closed_forms import polygon_unoccluded

RHO, TARGET = 0.8, 0.02


@pytest.mark.parametrize("edge", [0.013, 0.31, -0.77])
@pytest.mark.parametrize("kind", [Plane, Polygon])
def test_a_shadow_that_ends_at_a_wall(edge, kind):
    """The sun from above, a blind over the floor's half x > edge; the wall is black, and sees the lit half alone."""
    plane = Plane((-4, 0, 0), (8, 0, 0), (0, 8, 0))
    floor = Surface(plane if kind is Plane else Polygon(plane.corners), RHO, name="Floor")
    wall = Surface(Plane((-4, 0, 0), (0, 0, 3), (8, 0, 0)), 0.0, name="Wall")
    blind = Plane((edge, -1, 6), (9, 0, 0), (0, 12, 0))
    sides = [Surface(blind, 0.0, side=side, name="Blind") for side in ("front", "back")]
    solution = by_rays(Scene([floor, wall, *sides], lights=[SunLight((0, 0, -1), 3.0)]), TARGET)
    x = edge + np.array([-0.4, -0.1, -0.03, -0.01, 0.01, 0.03, 0.1, 0.4])
    points = np.stack(np.meshgrid(x, [0.0], [1e-3, 0.01, 0.05, 0.3], indexing="ij"), axis=-1).reshape(-1, 3)
    lit = np.array([[edge, 0, 0], [edge, 8, 0], [-4, 8, 0], [-4, 0, 0]], float)
    normals = np.tile([0.0, 1.0, 0.0], (len(points), 1))
    known = RHO * 3 / np.pi * polygon_unoccluded(points, normals, np.broadcast_to(lit, (len(points), 4, 3)))
    found = solution.incident(1, points)[:, 0]
    # a black wall's own rays are no part of the error: the 64 of it tell the edge of the lit half so well
    assert np.sqrt(((found - known) ** 2).mean() / (known**2).mean()) < 0.05
    assert np.abs(found - known).max() < 0.07 * known.max()
