"""Polygons of any outline: their measures, triangles, closed form, and what is wrong with one."""

import numpy as np
import pytest

from pdm_core import Plane, Polygon, SceneError, Surface
from pdm_core.contour import polygon_unoccluded

CORNER = np.array([(0, 0, 0), (3, 0, 0), (3, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0)], float)  # an L of area 5


def square(low, high, z=0.0):
    return np.array([(low, low, z), (high, low, z), (high, high, z), (low, high, z)], float)


def placed(seed):
    """A random rotation, shift and size from 1e-6 to 1e6, as a function of points."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    size = 10 ** rng.uniform(-6, 6)
    turn, shift = turn * np.sign(np.linalg.det(turn)), size * rng.normal(size=3)
    return lambda points: size * np.asarray(points) @ turn.T + shift, size


def star(rng, count, middle=(0.0, 0.0), least=0.3, most=1.0):
    """A simple outline (count, 3) at z = 0 around a middle, which it may reach back to."""
    angle = 2 * np.pi * (np.arange(count) + 0.8 * rng.random(count)) / count
    reach = rng.uniform(least, most, count)
    return np.column_stack([middle[0] + reach * np.cos(angle), middle[1] + reach * np.sin(angle), 0 * angle])


def with_holes(seed):
    """A random outline with up to 3 holes at z = 0, and its area by the shoelace formula."""
    rng = np.random.default_rng(seed)
    outline = star(rng, rng.integers(3 + 4, 40), least=0.75)
    middles = [(0.35, 0.1), (-0.3, 0.25), (-0.05, -0.35)][: rng.integers(0, 4)]
    holes = [star(rng, rng.integers(3, 12), m, 0.02, 0.15) for m in middles]
    holes = [hole[::-1] if rng.random() < 0.5 else hole for hole in holes]
    return outline, holes, shoelace(outline) - sum(abs(shoelace(hole)) for hole in holes)


def shoelace(loop):
    x, y = loop[:, :2].T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def oriented(rng, count, size=1.0):
    points, normals = size * rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_rectangle_is_as_the_plane_is():
    plane = Plane((1, 2, 3), (4, 0, 0), (0, 2, 0))
    polygon = Polygon(plane.corners)
    assert np.abs(polygon.linear - plane.linear).max() < 1e-15 and np.abs(polygon.origin - plane.origin).max() == 0
    assert np.abs(polygon.marks - plane.marks).max() < 1e-14
    assert abs(polygon.area - 8) < 1e-14 and abs(polygon.thickness - plane.thickness) < 1e-15
    points, normals = oriented(np.random.default_rng(0), 500, 4.0)
    assert np.abs(polygon.project(points) - plane.project(points)).max() < 1e-14
    assert np.abs(polygon.spread(50) - plane.spread(50)).max() < 1e-14
    known = polygon_unoccluded(points, normals, np.broadcast_to(plane.corners, (500, 4, 3)))
    assert np.abs(polygon.factor(points, normals) - known).max() < 1e-15


@pytest.mark.parametrize("seed", range(60))
def test_triangles_fill_the_outline_whatever_its_place_and_size(seed):
    outline, holes, area = with_holes(seed)
    place, size = placed(seed)
    polygon = Polygon(place(outline), [place(hole) for hole in holes])
    assert polygon.problem is None
    assert abs(polygon.area / (area * size**2) - 1) < 1e-9
    p, q, r = np.moveaxis(polygon.triangles, 1, 0)
    doubled = np.cross(q - p, r - p) @ polygon.normal
    assert (doubled > 0).all() and abs(doubled.sum() / 2 / polygon.area - 1) < 1e-9
    corners = len(outline) + sum(map(len, holes))
    assert len(polygon.triangles) == corners + 2 * len(holes) - 2
    given = {tuple(c) for loop in (polygon.outline, *polygon.holes) for c in loop}
    assert {tuple(c) for c in polygon.triangles.reshape(-1, 3)} == given


@pytest.mark.parametrize("seed", range(20))
def test_the_contour_is_the_sum_of_the_triangles(seed):
    """Also where the horizon cuts concave outlines and holes in many places."""
    outline, holes, _ = with_holes(seed)
    place, size = placed(seed)
    polygon = Polygon(place(outline), [place(hole) for hole in holes])
    points, normals = oriented(np.random.default_rng(seed), 400)
    points = place(points)
    normals[:100] = polygon.normal * 1e-3 + normals[:100]  # seen from all but edge-on to steep
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    known = sum(polygon_unoccluded(points, normals, np.broadcast_to(t, (400, 3, 3))) for t in polygon.triangles)
    assert np.abs(polygon.factor(points, normals) - known).max() < 1e-13


def test_a_square_with_a_square_hole_is_the_difference_of_two():
    whole, hole = square(0, 3), square(1, 2)
    points, normals = oriented(np.random.default_rng(1), 1000, 2.0)

    def plane(corners):
        return polygon_unoccluded(points, normals, np.broadcast_to(corners, (1000, 4, 3)))

    for way in (1, -1):
        polygon = Polygon(whole, [hole[::way]])
        value = polygon.factor(points, normals)
        assert np.abs(value - (plane(whole) - plane(hole))).max() < 1e-14
        assert abs(polygon.area - 8) < 1e-14


def test_an_l_is_two_rectangles():
    points, normals = oriented(np.random.default_rng(2), 1000, 3.0)
    parts = [square(0, 1) * [3, 1, 1], square(0, 1) * [1, 2, 1] + [0, 1, 0]]
    known = sum(polygon_unoccluded(points, normals, np.broadcast_to(p, (1000, 4, 3))) for p in parts)
    assert np.abs(Polygon(CORNER).factor(points, normals) - known).max() < 1e-14


def test_a_hexagon_seen_from_its_axis():
    """Six triangles about the axis, each (a / sqrt(a^2 + h^2) arctan(tan(30 deg) a / sqrt(a^2 + h^2))) / pi."""
    angle = np.pi / 3 * np.arange(6)
    hexagon = Polygon(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]))
    for height in (1e-3, 0.5, 1.0, 30.0):
        apothem = np.sqrt(3) / 2
        k = apothem / np.hypot(apothem, height)
        known = 6 / np.pi * k * np.arctan(0.5 / np.hypot(apothem, height))
        value = hexagon.factor(np.array([[0, 0, height], [0, 0, -height]]), np.array([[0, 0, -1.0], [0, 0, 1.0]]))
        assert np.abs(value / known - 1).max() < 1e-12


def test_vertices_within_edges_leave_no_seam():
    """Corners of neighbours in the middle of an edge belong to a triangle that ends there."""
    polygon = Polygon([(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (2, 2, 0), (0, 2, 0), (0, 0.5, 0)])
    assert polygon.problem is None and len(polygon.triangles) == 5
    p, q, r = np.moveaxis(polygon.triangles, 1, 0)
    assert np.cross(q - p, r - p)[:, 2].min() > 0.1
    near = np.float32(placed(5)[0](polygon.outline) / placed(5)[1]).astype(float)  # the same with rounded corners
    rounded = Polygon(near)
    p, q, r = np.moveaxis(rounded.triangles, 1, 0)
    assert (np.cross(q - p, r - p) @ rounded.normal).min() > 0.1


def test_holes_that_touch_and_stand_in_rows():
    windows = [square(0.2, 0.8) + [i, j, 0] for i in range(6) for j in range(4)]
    wall = Polygon([(0, 0, 0), (6, 0, 0), (6, 4, 0), (0, 4, 0)], windows)
    assert wall.problem is None and abs(wall.area - 24 * (1 - 0.36)) < 1e-12
    p, q, r = np.moveaxis(wall.triangles, 1, 0)
    doubled = np.cross(q - p, r - p)[:, 2]
    assert (doubled > 0).all() and abs(doubled.sum() / 2 - wall.area) < 1e-12
    # a door down to the floor's edge, a window that touches a corner, a slit from the outline to the hole
    around, hole = [(0, 0, 0), (6, 0, 0), (6, 4, 0), (0, 4, 0)], [(0.5, 0.5, 0), (0.5, 1, 0), (1, 1, 0), (1, 0.5, 0)]
    for loops in (
        (around, [[(2, 0, 0), (3, 0, 0), (2.5, 2, 0)]]),
        (around, [[(2, 1, 0), (3, 0, 0), (4, 1, 0), (3, 2, 0)]]),
        (around, [[(0, 0, 0), (3, 1, 0), (1, 3, 0)]]),
        ([*around, around[0], *hole, hole[0]], []),
        ([(0, 0, 0), (2, 0, 0), (1, 1, 0), (2, 2, 0), (0, 2, 0), (1, 1, 0)], []),
    ):
        polygon = Polygon(*loops)
        p, q, r = np.moveaxis(polygon.triangles, 1, 0)
        doubled = np.cross(q - p, r - p)[:, 2]
        assert polygon.problem is None, loops
        assert (doubled > 0).all() and abs(doubled.sum() / 2 - polygon.area) < 1e-12


def test_project_and_contains():
    rng = np.random.default_rng(3)
    outline, holes, _ = with_holes(11)
    polygon = Polygon(outline, holes)
    fine = polygon.spread(40000)
    points = rng.normal(size=(200, 3))
    near = polygon.project(points)
    assert np.abs(polygon.project(near) - near).max() < 1e-12
    distance = np.linalg.norm(points - near, axis=1)
    wanted = np.linalg.norm(points[:, None] - fine, axis=2).min(axis=1)
    assert (distance <= wanted + 1e-12).all() and (wanted - distance).max() < 0.03
    local = polygon.local(fine)
    assert polygon.contains(local).mean() > 0.9999
    assert np.abs(local[:, 2]).max() < 1e-14 and local[:, :2].min() >= 0 and local[:, :2].max() <= 1
    inset = Polygon(square(0, 2), [square(0.5, 1.0)])
    at = np.array([[0.05, 0.5], [0.3, 0.4], [0.24, 0.4], [0.7, 0.7], [1.2, 0.5]])
    assert inset.contains(at).tolist() == [True, False, True, True, False]
    assert inset.contains(at, 0.15).tolist() == [False, False, False, True, False]


def test_points_are_spread_evenly():
    for polygon in (Polygon(CORNER), Polygon(square(0, 1), [square(0.005, 0.995)])):
        points = polygon.spread(4000)
        assert len(points) == 4000
        assert np.linalg.norm(polygon.project(points) - points, axis=1).max() < 1e-12
    middle = Polygon(CORNER).spread(4000).mean(axis=0)
    assert np.abs(middle[:2] - 1.1).max() < 5e-3  # (3 * 1.5 + 2 * 0.5) / 5


def test_near_flat_outlines_are_put_into_their_plane():
    outline, holes, _ = with_holes(4)
    place, size = placed(4)
    single = [np.float32(place(loop)).astype(float) for loop in (outline, *holes)]
    polygon = Polygon(single[0], single[1:])
    assert polygon.problem is None
    assert np.abs((polygon.outline - polygon.outline[0]) @ polygon.normal).max() < 1e-14 * size
    assert np.abs(polygon.outline - single[0]).max() < 1e-5 * size


def test_marks_tell_polygons_from_each_other():
    wall, window = square(0, 4), square(0.5, 1)
    polygon = Polygon(wall, [window])
    same = Polygon(np.roll(wall, 2, axis=0), [window[::-1]])
    assert np.abs(polygon.marks - same.marks).max() < 1e-14
    for other in (
        Polygon(wall[::-1], [window]),
        Polygon(wall, [window + [1, 0, 0]]),
        Polygon(wall),
        Polygon(CORNER),
    ):
        assert np.abs(polygon.marks - other.marks).max() > 1e-2


@pytest.mark.parametrize(
    "outline, holes, words",
    [
        ([(0, 0, 0), (1, 0, np.nan), (0, 1, 0)], [], "not finite"),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], "no area"),
        ([(0, 0, 0), (0, 0, 0), (1, 0, 0)], [], "no area"),
        ([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)], [], "no area"),
        ([(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, -0.5, 0), (0, 2, 0)], [], "cross each other"),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)], [], "off their plane"),
        (square(0, 1), [square(2, 3)], "hole 0 is not within its outline"),
        (square(0, 1), [square(0.5, 3)], "cross each other"),
        (square(0, 1), [square(0.1, 0.9), square(0.2, 0.3)], "hole 1 is within another"),
        (square(0, 1), [square(0.2, 0.4, 0.1)], "off their plane"),
        (square(0, 1), [square(0.2, 0.4), square(0.2, 0.4)], "runs over itself"),
        ([(0, 0, 0), (3, 0, 0), (1, 1, 0), (0, 3, 0), (2, 4, 0), (1, 1, 0)], [], "runs over itself"),
    ],
)
def test_what_is_wrong_is_named(outline, holes, words):
    with pytest.raises(SceneError, match=words):
        Surface(Polygon(outline, holes))


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Polygon([(0, 0, 0), (1, 0, 0)]), "at least 3 corners"),
        (lambda: Polygon([(0, 0), (1, 0), (1, 1)]), "shape"),
        (lambda: Polygon("square"), "numbers"),
        (lambda: Polygon(square(0, 1), 3), "holes"),
        (lambda: Polygon(square(0, 1), [[(0, 0, 0)]]), "hole 0"),
    ],
)
def test_other_things_are_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_many_corners_are_soon_done():
    rng = np.random.default_rng(6)
    polygon = Polygon(star(rng, 2000))
    assert polygon.problem is None and len(polygon.triangles) == 1998
