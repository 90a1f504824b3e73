"""What stands on something is not darker at its foot: the seen half of cells that lie half under it is not dark."""

import numpy as np
import pytest
from test_rays import both, box, by_rays

from pdm_core import Mesh, Plane, Polygon, Scene, SunLight, Surface
from pdm_core.contour import polygon_unoccluded
from pdm_core.rays.beside import beside
from pdm_core.rays.facets import Facets
from pdm_core.tolerances import CLEAR, KEPT

RHO, TARGET = 0.8, 0.02
SUN = SunLight((0, -1, -1), 3.0)
LOW, HIGH = np.array([-0.43, -1.1, 0]), np.array([0.55, -0.07, 1.2])
HEIGHTS = np.array([0.0, 1e-3, 0.01, 0.03, 0.1, 0.3, 0.8])


def flat(kind):
    plane = Plane((-4, -4, 0), (8, 0, 0), (0, 8, 0))
    if kind == "plane":
        return Surface(plane, RHO)
    return Surface(Polygon(plane.corners), RHO)


def expected(points):
    """Irradiance / pi at points of the side that the sun shines on: the sun's, and half of what the floor before it
    reflects, which nothing shades; the box itself is black."""
    strip = np.array([[4, HIGH[1], 0], [4, 4, 0], [-4, 4, 0], [-4, HIGH[1], 0]], float)
    towards = np.tile([0.0, 1.0, 0.0], (len(points), 1))
    corners = np.broadcast_to(strip, (len(points), 4, 3))
    share = polygon_unoccluded(np.maximum(points, [-9, -9, 1e-6]), towards, corners)
    return SUN.unoccluded(points, towards) * 3 + RHO * share * 3 / np.sqrt(2) / np.pi


@pytest.mark.parametrize("sunk", [0.0, 0.05])
@pytest.mark.parametrize("kind", ["plane", "polygon"])
def test_a_box_in_the_sun(kind, sunk):
    sides = box(LOW - [0, 0, sunk], HIGH, 0.0)
    front = next(k for k, s in enumerate(sides) if s.shape.normal[1] > 0.5)
    solution = by_rays(Scene([flat(kind), *sides], lights=[SUN]), TARGET)
    for x in (-0.4, 0.05, 0.5):
        points = np.column_stack(
            [np.full(len(HEIGHTS), x), np.full(len(HEIGHTS), HIGH[1]), HEIGHTS + 1e-5 * (sunk > 0)]
        )
        found = solution.incident(1 + front, points)[:, 0]
        assert np.abs(found / expected(points) - 1).max() < 1.5 * TARGET


def test_shade_is_no_cover():
    """The floor under a low table is dark and seen: its cells are its own."""
    table = both(Plane((-1, -1, 0.01), (2, 0, 0), (0, 2, 0)), 0.0)
    solution = by_rays(Scene([flat("plane"), *table], lights=[SunLight((0, 0, -1), 3.0)]), TARGET)
    points = np.array([[x, 0.1, 0.0] for x in (-0.9, -0.3, 0.2, 0.8)])
    assert np.abs(solution.radiance(0, points)).max() < TARGET * RHO * 3 / np.pi
    # from just under the table's edge half of what is seen is the lit floor
    rim = solution.incident(2, np.array([[0.0, 1 - 1e-4, 0.01]]))[0, 0]
    assert rim == pytest.approx(RHO * 3 / np.pi / 2, rel=0.1)


@pytest.mark.parametrize("turn, at", [(0.0, (0, 0, 0)), (0.4, (0.3, -0.2, 0)), (1.1, (300, 50, 7))])
def test_vertices_of_a_floor_at_the_foot_of_a_mesh_are_beside_it(turn, at):
    """Two reflecting planes of .5 at a right angle under a sky of 1: 1/3 where they meet, in the middle of edges."""
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def world(points):
        return np.float32(np.asarray(points, float) @ rotation.T + at).astype(float)

    corners = np.array([(x, y, z) for z in (0, 2) for y in (-1, 1) for x in (-1, 1)])
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
    floor = Plane(world((-3, -3, 0)), *(world(k) - world((0, 0, 0)) for k in ((6, 0, 0), (0, 6, 0))))
    cube = Mesh(world(corners), faces, smooth=False)
    solution = by_rays(Scene([Surface(floor, 0.5), Surface(cube, 0.5)], 1.0, rounding=2**-24), TARGET)
    feet = np.array([(x, y, 0) for x, y in [(0, 1), (1, 0), (0, -1), (-1, 0), (0.25, 1), (-1, -0.25)]])
    assert np.abs(solution.radiance(0, world(feet)) - 1 / 3).max() < 0.05 / 3
    assert not solution.radiance(0, world(0.99 * feet)).any()


def test_a_wall_leads_points_at_its_foot_as_far_whatever_it_is_made_of():
    """A mesh's two triangles led twice as far at the seam between them."""
    floor, wall = Plane((-4, -4, 0), (8, 0, 0), (0, 8, 0)), Plane((0, -1, 0), (0, 2, 0), (0, 0, 1))
    kinds = wall, Polygon(wall.corners), Mesh(wall.corners, [(0, 1, 2, 3)], smooth=False)
    points = np.column_stack([np.zeros(9), np.linspace(-1, 1, 9), np.zeros(9)])
    moved = []
    for kind in kinds:
        facets = Facets(Scene([Surface(floor, RHO), *both(kind, RHO)]))
        moved.append((beside(facets).moved(np.zeros(9, int), points) - points) / facets.tolerance)
    expected = np.tile([KEPT, 0, 0], (9, 1))
    expected[[0, -1]] = CLEAR * KEPT * np.array([[0, -1, 0], [0, 1, 0]])  # beyond its ends
    np.testing.assert_allclose(moved, np.tile(expected, (3, 1, 1)), atol=1e-6)
