"""Form factors between whole surfaces against known answers and the identities of the field."""

import importlib
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import both_sides, cube_planes, scene_of

from pdm_core import Plane, Scene, SceneError, Sphere, Surface, form_factors, pdm_form_factor
from pdm_core.form_factors import _row as cells_of_row
from pdm_core.visibility import Factors, Shafts

form_factors_module = importlib.import_module("pdm_core.form_factors")  # the package's own name is the function

OPPOSITE, ADJACENT = 0.199824895698387, 0.200043776075403
SEED_ADJACENT, SEED_OPPOSITE, SEED_SPHERE = 0.1968931067, 0.1542499315, 4 * np.pi / 216


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def moved(shape, turn, shift, scale):
    if isinstance(shape, Plane):
        return Plane(scale * turn @ shape.origin + shift, scale * turn @ shape.u, scale * turn @ shape.v)
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn @ shape.linear
    matrix[:3, 3] = scale * turn @ shape.origin + shift
    return Sphere(matrix)


def test_unit_cube():
    f = form_factors(scene_of(cube_planes(0.5)), 1e-8)
    assert np.abs(f.F[0, 1] - OPPOSITE) < 1e-14 and np.abs(f.F[0, 2:] - ADJACENT).max() < 1e-14
    assert np.abs(f.background).max() < 1e-14


def test_parallel_squares_near_contact():
    f = form_factors(scene_of([Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), Plane((0, 0, 1e-3), (0, 1, 0), (1, 0, 0))]))
    assert abs(f.F[0, 1] - 0.9980056319075797) < 1e-12


def test_rotated_pairs_agree_with_the_closed_form():
    planes = [
        Plane((0, 0, 0), (1, 0, 0), (0, 2, 0)),
        Plane((3, -1, 0.2), (0, 1.5, 0), (0, 0, 1)),
        Plane((0.5, 0.5, 1), (0, 1, 0), (0.7, 0, 0)),
        Plane((0.2, 2.5, 1), (1, 0, 0), (0, 0, 1)),
    ]
    exact = form_factors(scene_of(planes)).F
    turned = form_factors(scene_of([moved(p, rotation(1), np.ones(3), 2.0) for p in planes]), 1e-5)
    assert np.abs(turned.F - exact).max() < 1e-5


def test_coplanar_neighbours_and_corner_only():
    f = form_factors(
        scene_of(
            [
                Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)),
                Plane((1, 0, 0), (1, 0, 0), (0, 1, 0)),
                Plane((1, 1, 0), (0, 1, 0), (0, 0, 1)),  # shares a corner only
            ]
        )
    )
    assert f.F[0, 1] == 0 and f.F[1, 0] == 0
    # crossed rectangles by superposition of edge-sharing ones: F of the corner pair from the 2 x 2 unit layout
    whole = form_factors(scene_of([Plane((0, 0, 0), (1, 0, 0), (0, 2, 0)), Plane((1, 0, 0), (0, 2, 0), (0, 0, 1))])).F
    near = form_factors(scene_of([Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), Plane((1, 0, 0), (0, 1, 0), (0, 0, 1))])).F
    assert abs(f.F[0, 2] - (whole[0, 1] - near[0, 1])) < 1e-13


@pytest.mark.parametrize("rtol, within", [(1e-2, 1e-5), (1e-4, 1e-7), (1e-7, 1e-9)])
def test_seed_room_against_its_exact_values(rtol, within):
    """The known values have ten digits."""
    f = form_factors(scene_of([*cube_planes(), Sphere.at((0, 0, 0), 1)]), rtol)
    known = [SEED_OPPOSITE, SEED_ADJACENT, SEED_ADJACENT, SEED_ADJACENT, SEED_ADJACENT, SEED_SPHERE]
    wrong = np.abs(f.F[0, 1:] / known - 1)
    assert wrong.max() < within and np.abs(f.F[6, :6] * 6 - 1).max() < within
    assert np.abs(f.background).max() < 1e-14
    assert (f.error[0, 1:] > wrong * known - 1e-10).all() and f.error.max() < rtol and f.counts["sampled"] == 0


def test_rows_alone_are_those_of_the_whole():
    scene = scene_of([*cube_planes(), Sphere.at((0.5, 0, 0), 1)])
    whole, some = form_factors(scene, 1e-3), form_factors(scene, 1e-3, rows=[6, 0])
    assert (some.background == whole.background[[6, 0]]).all()
    assert (np.abs(some.F - whole.F[[6, 0]]) <= whole.error[[6, 0]]).all()  # whole: from the better side of each pair
    with pytest.raises(SceneError, match="rows"):
        form_factors(scene, 1e-3, rows=[7])


def test_kinks_of_tilted_planes_and_ellipsoids():
    """The rule broken at the kinks agrees with cells split again and again, and tells its own error."""
    egg = np.array([[0.5, 0.1, 0, 0.1], [0, 0.3, 0.2, 0.0], [0, 0, 0.6, 0.2], [0, 0, 0, 1]])
    shapes = [Plane((-2, -1, -1.5), (3, 0.3, 0), (0.4, 2, 0.2)), Plane((-1, -1, 1.5), (0.2, 2, 0.1), (2.5, 0, 0.4))]
    scene = scene_of([*shapes, Sphere(egg)])
    broken = form_factors(scene, 1e-8)
    seen, hidden = Factors(scene, Shafts(scene), Counter()), np.full((2, 1), 2)
    hidden[1] = -1
    total, wrong = cells_of_row(seen, 0, np.array([1, 2]), hidden, 1e-5, np.inf)
    assert np.abs(broken.F[0, 1:] - total).max() < 1e-6 * total.max() + wrong.max()
    exchange = scene.areas[:2, None] * broken.F[:2, :2]
    assert abs(exchange[0, 1] - exchange[1, 0]) < 1e-8 * exchange[0, 1]


def test_work_without_end_is_said(monkeypatch):
    """A ball behind a screen: what is asked for is out of reach, the pairs are named; where it is reached, nothing."""
    screen = Plane((-0.5, -0.5, 0.8), (1, 0.2, 0), (0, 1, 0))
    shapes = [*cube_planes(), screen, Sphere.at((0.1, 0.2, 1.5), 0.4)]
    scene = Scene([Surface(shape, name=f"shape {k}") for k, shape in enumerate(shapes)])
    monkeypatch.setattr(form_factors_module, "WORK", 1000)
    found = form_factors(scene, 1e-9)
    (said,) = found.warnings
    assert "1e-09" in said and "shape " in said
    above = found.error > 1e-9 * found.F + form_factors_module.TINY
    assert f"and {above.sum() - form_factors_module.NAMED} more" in said
    assert not form_factors(scene_of(cube_planes()), 1e-9).warnings


def test_published_method_gives_its_checked_values():
    room, ball = [Surface(p) for p in cube_planes()], Surface(Sphere.at((0, 0, 0), 1))
    for target, divisions, value in ((2, 3, 0.22255), (2, 6, 0.20972), (1, 3, 0.15395), (1, 6, 0.15411)):
        patches = (divisions, divisions)
        assert abs(pdm_form_factor(room[0], room[target], patches, patches, 5, [ball.shape]) - value) < 1e-4
    for face in room:
        assert abs(pdm_form_factor(ball, face, (4, 8), (3, 3)) - 1 / 6) < 2e-4


def test_inside_a_sphere():
    sphere = Sphere.at((1, 2, 3), 2.0)
    f = form_factors(Scene([Surface(sphere, side="back")]))
    assert abs(f.F[0, 0] - 1) < 1e-13


def test_convex_body_in_a_dome():
    ball, dome = Sphere.at((0.2, 0.1, 0), 1.0), Sphere.at((0, 0, 0), 3.0)
    f = form_factors(Scene([Surface(ball), Surface(dome, side="back")]), 1e-6)
    assert abs(f.F[0, 1] - 1) < 1e-12 and abs(f.F[1, 0] - 1 / 9) < 1e-7 and abs(f.F[1].sum() - 1) < 1e-12


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-6, 6), st.booleans())
def test_invariant_under_motion_scale_and_mirror(seed, exponent, mirror):
    rng = np.random.default_rng(seed)
    shapes = [
        *cube_planes(),
        Sphere.at(rng.uniform(-1, 1, 3), rng.uniform(0.3, 1.0)),
        Plane(rng.uniform(-2.5, -1, 3), (1, 0.2, 0), (0, 0.3, 0.9)),
    ]
    turn = rotation(seed) * [[1], [1], [-1 if mirror else 1]]
    scale = 10.0**exponent
    there = [moved(s, turn, scale * np.array([1.0, -2.0, 0.5]), scale) for s in shapes]

    def build(parts, flip):
        # a mirror swaps u x v: the other side of every plane is what faces inwards then
        return Scene([Surface(s, side="back" if flip and isinstance(s, Plane) else "front") for s in parts])

    a, b = form_factors(build(shapes, False), 1e-2), form_factors(build(there, mirror), 1e-2)
    assert np.abs(a.F - b.F).max() < 1e-3
    order = rng.permutation(len(shapes))
    c = form_factors(build([shapes[k] for k in order], False), 1e-2)
    assert np.abs(c.F - a.F[np.ix_(order, order)]).max() < 1e-11


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_closure_and_reciprocity_in_random_rooms(seed):
    rng = np.random.default_rng(seed)
    balls = [
        Sphere.at((x, y, rng.uniform(-2, 2)), rng.uniform(0.1, 0.65)) for x in (-1.7, 0, 1.7) for y in (-1.7, 0, 1.7)
    ]
    chosen = [balls[k] for k in rng.choice(9, 3, replace=False)]
    scene = Scene([Surface(s) for s in [*cube_planes(), *chosen]])
    f = form_factors(scene, 1e-2)
    assert np.abs(f.background).max() < 1e-11
    exchange = scene.areas[:, None] * f.F
    assert (np.abs(exchange - exchange.T) <= 2 * scene.areas[:, None] * (f.error + f.error.T) * 20 + 1e-3).all()


def test_free_standing_screen_has_two_sides():
    screen = Plane((-1, 0, -1), (2, 0, 0), (0, 0, 2))
    scene = Scene([*[Surface(p) for p in cube_planes()], *both_sides(screen)])
    f = form_factors(scene, 1e-3)
    assert np.abs(f.background).max() < 1e-11 and f.F[6, 7] == 0 and f.F[6, 4] == 0 and f.F[7, 5] == 0


def test_splitting_a_surface_adds_up():
    ball = Sphere.at((0, 0, 0), 1)
    whole = form_factors(scene_of([*cube_planes(), ball]), 1e-4)
    floor = [Plane((-3, -3, -3), (2, 0, 0), (0, 6, 0)), Plane((-1, -3, -3), (4, 0, 0), (0, 6, 0))]
    split = form_factors(scene_of([*floor, *cube_planes()[1:], ball]), 1e-4)
    assert abs(split.F[2, :2].sum() - whole.F[1, 0]) < 1e-5
    assert abs((split.F[0, 2] * 12 + split.F[1, 2] * 24) / 36 - whole.F[0, 1]) < 1e-5


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=15, deadline=None)
def test_an_occluder_outside_every_shaft_changes_nothing(seed, flat):
    """A floor, a ceiling and a ball between them; a shape beside the hull of all three, at any size and turn."""
    rng = np.random.default_rng(seed)
    shapes = [
        Plane((-1, -1, 0), (2, 0, 0), (0, 2, 0)),
        Plane((-1, -1, 2), (0, 2, 0), (2, 0, 0)),
        Sphere.at(rng.uniform(-0.3, 0.3, 3) + [0, 0, 1], rng.uniform(0.1, 0.5)),
    ]
    radius, angle = 10.0 ** rng.uniform(-2, 1), rng.uniform(0, 2 * np.pi)
    centre = (1.5 + radius) * np.array([np.cos(angle), np.sin(angle), 0]) + [0, 0, rng.uniform(0, 2)]
    aside = Sphere.at(centre, radius)
    if flat:
        u, v = radius * rotation(int(rng.integers(1 << 30)))[:2]
        aside = Plane(centre - (u + v) / 2, u, v)
    with_it = Scene([Surface(s) for s in shapes] + [Surface(aside)])
    without = form_factors(scene_of(shapes), 1e-3).F
    found = form_factors(with_it, 1e-3).F[:3, :3]
    # each entry is exact to its rule, and the rule may refine for the added target: compare as closely as that
    assert np.abs(found - without).max() < 2e-4
    points = rng.uniform(-1, 1, (40, 3)) * [1, 1, 0]
    normals = np.tile([0.0, 0, 1], (40, 1))
    assert (to_ceiling(with_it, points, normals) == to_ceiling(scene_of(shapes), points, normals)).all()


def to_ceiling(scene, points, normals):
    """Exact factors from points of the floor to the ceiling, behind everything else in the scene."""
    shafts, own = Shafts(scene), np.zeros(len(points), int)
    return Factors(scene, shafts, Counter()).pairs(points, normals, own, own + 1)


@given(st.tuples(*[st.floats(0.2, 3)] * 4), st.floats(0.0, 2.0))
@settings(max_examples=25, deadline=None)
def test_rectangles_that_share_a_corner_or_less(sizes, apart):
    """Superposition: perpendicular rectangles whose spans along the common line only meet, or are `apart`."""
    depth, height, near, far = sizes

    def exchange(start, end, low, high):
        """Area times factor from the floor over [start, end] to the wall over [low, high], on the common line x = 0."""
        floor = Plane((0, start, 0), (depth, 0, 0), (0, end - start, 0))
        wall = Plane((0, low, 0), (0, high - low, 0), (0, 0, height))
        return floor.area * form_factors(scene_of([floor, wall])).F[0, 1]

    gap = apart if apart > 0.05 else 0.0
    found = exchange(0, near, near + gap, near + gap + far)
    whole = exchange(0, near + gap + far, 0, near + gap + far)
    rest = exchange(0, near, 0, near) + exchange(near, near + gap + far, near, near + gap + far)
    if gap:
        # the strip between them counts with both: taken away from the whole, and added back once
        beside = exchange(0, near, near, near + gap)
        assert found == pytest.approx((whole - rest) / 2 - beside, abs=1e-12)
    else:
        assert found == pytest.approx((whole - rest) / 2, abs=1e-12)


def test_bad_tolerance_is_refused():
    with pytest.raises(SceneError, match="rtol"):
        form_factors(scene_of(cube_planes()), 0)
