"""Form factors of polygons and meshes: the double contour, convex pieces in the exact engine, the published method."""

import numpy as np
import pytest

from pdm_core import Mesh, Plane, Polygon, Scene, SceneError, Sphere, Surface, form_factors, pdm_form_factor
from pdm_core.aligned import aligned_rectangles
from pdm_core.exchange import polygon_exchange
from pdm_core.numerics import gauss_square

CORNER = np.array([(0, 0, 0), (3, 0, 0), (3, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0)], float)
CORNER_PARTS = [Plane((0, 0, 0), (3, 0, 0), (0, 1, 0)), Plane((0, 1, 0), (1, 0, 0), (0, 2, 0))]
HEXAGON = np.column_stack([np.cos(np.pi / 3 * np.arange(6)), np.sin(np.pi / 3 * np.arange(6)), np.zeros(6)])


def square(low, high, z=0.0):
    return np.array([(low, low, z), (high, low, z), (high, high, z), (low, high, z)], float)


def scene(*shapes):
    return Scene([Surface(shape, name=str(k)) for k, shape in enumerate(shapes)])


def prism(outline, low, high, inward=False):
    """Polygons of a prism over an outline [(x, y)], its top and bottom first."""
    x = np.asarray(outline, float)
    ends = [np.column_stack([x, np.full(len(x), z)]) for z in (low, high)]
    loops = [ends[1], ends[0][::-1]]
    for a, b, c, d in zip(ends[0], np.roll(ends[0], -1, axis=0), np.roll(ends[1], -1, axis=0), ends[1]):
        loops.append(np.array([a, b, c, d]))
    return [Polygon(loop[::-1] if inward else loop) for loop in loops]


def by_quadrature(a, b, points=24):
    """Form factor between polygons that are apart: Gauss over the triangles of a, in closed form over b."""
    nodes, weights = gauss_square(points)
    s, t = nodes.T[..., None]
    total = 0.0
    for p, q, r in a.triangles:
        x = p + s * (1 - t) * (q - p) + t * (r - p)
        value = b.factor(x, np.broadcast_to(a.normal, x.shape))
        total += np.linalg.norm(np.cross(q - p, r - p)) * (weights * (1 - t[:, 0])) @ value
    return total / a.area


@pytest.mark.parametrize("upright", [False, True])
def test_the_double_contour_of_rectangles(upright):
    """Against the closed form of aligned ones, down to gaps of 1e-5 and with shared edges."""
    rng = np.random.default_rng(int(upright))
    one = Plane((0, 0, 0), (1, 0, 0), (0, 1, 0))
    for _ in range(40):
        gap, (x, y), (w, h) = 10 ** rng.uniform(-5, 0), rng.uniform(-0.7, 0.7, 2), rng.uniform(0.3, 1.5, 2)
        touching = rng.random(3) < 0.3
        x, y = np.where(touching[:2], 0.0, (x, y))
        other = Plane((x, y, gap), (0, h, 0), (w, 0, 0))
        if upright:
            other = Plane((x, y, 0.0 if touching[2] else gap), (0, 0, h), (w, 0, 0))
        known, _ = aligned_rectangles([Surface(one), Surface(other)], np.array([0]), np.array([1]))
        loops, normals = [p.corners[None] for p in (one, other)], [p.normal[None] for p in (one, other)]
        value, error = polygon_exchange(*loops, *normals)
        assert abs(value[0] - known[0]) < 1e-13 and abs(value[0] - known[0]) < 10 * error[0]


@pytest.mark.parametrize("seed", range(5))
def test_pairs_of_triangles_that_stand_askew(seed):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(3) + 0.6 * rng.random((2, 3))) / 3
    one, other = (np.column_stack([np.cos(a), np.sin(a), rng.uniform(-0.3, 0.3, 3)]) for a in angle)
    a, b = Polygon(one), Polygon((other + [*rng.uniform(-1, 1, 2), 4])[::-1])
    f = form_factors(scene(a, b), 1e-9)
    assert abs(f.F[0, 1] / by_quadrature(a, b) - 1) < 1e-10 and abs(f.F[1, 0] / by_quadrature(b, a) - 1) < 1e-10
    assert f.error.max() < 1e-10 * f.F[0, 1] and f.counts["free"] == 0


def test_what_is_behind_has_no_part():
    """A wall that goes through the floor, and a floor that goes on behind the wall."""
    floor = Polygon([(0, -2, 0), (1, -2, 0), (1, 1, 0), (0, 1, 0)])
    wall = Polygon([(0, 0, -1), (0, 0, 1), (1, 0, 1), (1, 0, -1)])
    value, _ = polygon_exchange(floor.outline[None], wall.outline[None], floor.normal[None], wall.normal[None])
    assert abs(value[0] - 0.200043776075403) < 1e-14


def test_triangles_with_a_common_edge():
    """Halves of the unit cube's neighbouring faces add up to the whole."""
    floor = [Polygon([(0, 0, 0), (1, 0, 0), (1, 1, 0)]), Polygon([(0, 0, 0), (1, 1, 0), (0, 1, 0)])]
    wall = [Polygon([(0, 0, 0), (0, 0, 1), (1, 0, 1)]), Polygon([(0, 0, 0), (1, 0, 1), (1, 0, 0)])]
    f = form_factors(scene(*floor, *wall), 1e-9).F
    assert abs(f[:2, 2:].sum() / 2 - 0.200043776075403) < 1e-14
    assert np.abs(f - f.T).max() < 1e-15 and np.abs(f[:2, :2]).max() == 0


def test_hexagons():
    """Opposite ones against quadrature; the whole prism closes."""
    room = prism(HEXAGON[:, :2], 0, 1.5, True)
    f = form_factors(scene(*room), 1e-9)
    assert abs(f.F[0, 1] - by_quadrature(room[0], room[1])) < 1e-12
    assert np.abs(f.background).max() < 1e-13 and np.abs(f.F[2:, 0] - f.F[2, 0]).max() < 1e-14


def test_an_l_on_an_l():
    top = [Plane(p.origin + [0, 0, 1.5], p.v, p.u) for p in CORNER_PARTS]
    parts = form_factors(scene(*CORNER_PARTS, *top), 1e-9).F
    f = form_factors(scene(Polygon(CORNER), Polygon((CORNER + [0, 0, 1.5])[::-1])), 1e-9)
    known = (3 * parts[0, 2:].sum() + 2 * parts[1, 2:].sum()) / 5
    assert np.abs(f.F - [[0, known], [known, 0]]).max() < 1e-14 and f.error.max() < 1e-12


def test_a_square_with_a_square_hole():
    frame, square_ = Polygon(square(0, 3), [square(1, 2)]), Plane((0, 0, 1), (0, 2, 0), (2, 0, 0))
    planes = form_factors(scene(square_, Plane((0, 0, 0), (3, 0, 0), (0, 3, 0)))).F[0, 1]
    planes -= form_factors(scene(square_, Plane((1, 1, 0), (1, 0, 0), (0, 1, 0)))).F[0, 1]
    f = form_factors(scene(square_, frame), 1e-9).F
    assert abs(f[0, 1] - planes) < 1e-14 and abs(f[1, 0] - planes * 4 / 8) < 1e-14


def test_pieces_are_rectangles_where_corners_are_right_angles():
    windows = [square(0.2, 0.8) + [i, j, 0] for i in range(3) for j in range(2)]
    wall = np.array([(0, 0, 0), (3, 0, 0), (3, 2, 0), (0, 2, 0)], float)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    for holes, count, half in (
        (windows, 11, False),
        ([windows[0][:3]], 7, True),
        ([w + [1e-7, 0, 0] for w in windows], 11, False),
    ):
        polygon = Polygon(1e3 * wall @ turn, [1e3 * hole @ turn for hole in holes])
        pieces = polygon.pieces
        assert len(pieces) == count and all(piece.half == half for piece in pieces)
        assert abs(sum(piece.area for piece in pieces) / polygon.area - 1) < 1e-14
        assert min(piece.normal @ polygon.normal for piece in pieces) > 1 - 1e-14
        inner = np.concatenate([piece.corners.mean(axis=0)[None] for piece in pieces])
        assert polygon.contains(polygon.local(inner)).all()
    slanted = Polygon(CORNER @ [[1, 0, 0], [0.5, 1, 0], [0, 0, 1]]).pieces
    assert len(slanted) == 4 and all(piece.half for piece in slanted)


def test_light_through_a_window():
    """A wall with a hole hides what the frame of four planes hides; nothing of it hides another part of it."""
    floor, ceiling = Plane((0, 0, 0), (3, 0, 0), (0, 3, 0)), Plane((0, 0, 2), (0, 3, 0), (3, 0, 0))
    frame = [
        Plane((a, b, 1), (w, 0, 0), (0, h, 0))
        for a, b, w, h in ((0, 0, 3, 1), (0, 2, 3, 1), (0, 1, 1, 1), (2, 1, 1, 1))
    ]
    rtol = 1e-4
    known = form_factors(scene(floor, ceiling, *frame), rtol)
    f = form_factors(scene(floor, ceiling, Polygon(square(0, 3, 1.0), [square(1, 2, 1.0)])), rtol)
    assert abs(f.F[0, 1] - known.F[0, 1]) < 3 * rtol * known.F[0, 1]
    assert abs(f.F[1, 2] - known.F[1, 2:].sum()) < 3 * rtol and not f.warnings
    assert abs(f.F[0, 1] - f.F[1, 0]) < 3 * rtol * f.F[0, 1] and f.F[2, 2] == 0


def test_a_ball_in_a_prism_closes():
    room = [*prism(HEXAGON[:3, :2], 0, 1.5, True), Sphere.at((0.3, 0.6, 0.7), 0.1)]
    f = form_factors(scene(*room), 1e-3)
    assert np.abs(f.background).max() < 1e-12
    exchange = np.array([s.area for s in room])[:, None] * f.F
    assert np.abs(exchange - exchange.T).max() < 2e-3 * exchange.max()


def test_a_small_mesh_is_the_sum_of_its_faces():
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    inner = Scene([Surface(Mesh(corners, faces), side="back")])
    f = form_factors(inner, 1e-6)
    assert abs(f.F[0, 0] - 1) < 1e-12
    outside = form_factors(
        Scene([Surface(Mesh(corners, faces)), Surface(Plane((0, 0, 2), (0, 1, 0), (1, 0, 0)))]), 1e-6
    )
    assert abs(outside.F[1, 0] - 0.199824895698387) < 1e-12 and outside.F[0, 0] == 0


def test_the_published_method_on_polygons():
    """A rectangle is as the plane is; another outline trims its patches, so that Gauss converges slowly."""
    plane, other = Plane((0, 0, 0), (3, 0, 0), (0, 3, 0)), Surface(Plane((0, 0, 1.5), (0, 3, 0), (3, 0, 0)))
    same = pdm_form_factor(Surface(Polygon(plane.corners)), other, (2, 2), (2, 2))
    assert abs(same - pdm_form_factor(Surface(plane), other, (2, 2), (2, 2))) < 1e-15
    corner = Surface(Polygon(CORNER))
    known = form_factors(Scene([corner, other]), 1e-9).F[0, 1]
    assert abs(pdm_form_factor(corner, other, (3, 3), (3, 3)) - known) < 1e-4 * known  # patches end where it does
    error = [abs(pdm_form_factor(corner, other, (n, n), (3, 3), 2) - known) / known for n in (4, 16)]
    assert error[1] < error[0] / 2 and error[1] < 0.04
    window = np.array([(1.03, 1.01, 1), (1.98, 1.01, 1), (1.98, 2.07, 1), (1.03, 2.07, 1)])
    hidden = pdm_form_factor(Surface(plane), other, (6, 6), (6, 6), 3, [Polygon(square(0, 3, 1.0), [window])])
    sizes = ((0, 0, 3, 1.01), (0, 2.07, 3, 0.93), (0, 1.01, 1.03, 1.06), (1.98, 1.01, 1.02, 1.06))
    frame = [Plane((a, b, 1), (w, 0, 0), (0, h, 0)) for a, b, w, h in sizes]
    assert abs(hidden - pdm_form_factor(Surface(plane), other, (6, 6), (6, 6), 3, frame)) < 1e-15
    with pytest.raises(SceneError, match="Polygons"):
        pdm_form_factor(corner, other, occluders=[Mesh(CORNER, [[0, 1, 2]])])
