"""At the feet of what stands on a floor, by links and by rays: at a crate's corner, an edge, where two meet."""

import itertools

import numpy as np
import pytest
from places import Place
from rooms import by_rays, transport_of

from pdm_core import Plane, Scene, Surface
from pdm_core.links.approach import link_steps
from pdm_core.signs_of_life import finish

PLACES = [Place(), Place(0.3), Place(0.7, (10, 20, 3))]
CRATES = {  # and the floor's vertices at their feet, each with the direction of the open there
    "one": ([((1, 1, 0), (2, 2, 1))], [((2, 2), (1, 1)), ((1, 2), (-1, 1)), ((1.5, 1), (0, -1))]),
    "side by side": (
        [((1, 1, 0), (2, 2, 1)), ((2, 1, 0), (3, 2, 0.7))],
        [((2, 1), (0, -1)), ((2, 2), (0, 1)), ((3, 1), (1, -1))],
    ),
    "three about a point": (
        [((1, 1, 0), (2, 2, 1)), ((2, 2, 0), (3, 3, 0.7)), ((2, 1, 0), (3, 2, 0.45))],
        [((2, 2), (-1, 1)), ((2, 1), (0, -1)), ((3, 2), (1, 0))],
    ),
    "edge on side": (
        [((1, 1, 0), (2, 2, 1)), ((2, 1.5, 0), (3, 2.5, 0.7))],
        [((2, 1.5), (1, -1)), ((2, 2), (-1, 1)), ((2, 2.5), (-1, 1)), ((2, 2.25), (-1, 0))],
    ),
    "against a wall": (
        [((0, 1, 0), (1, 2, 1)), ((0, 2, 0), (2, 3, 0.7))],
        [((0, 1), (1, -1)), ((0, 3), (1, 1)), ((1, 2), (1, -1)), ((1, 1), (1, -1))],
    ),
    "in a corner": ([((0, 0, 0), (1, 1, 1))], [((0, 1), (1, 1)), ((1, 0), (1, 1)), ((1, 1), (1, 1))]),
}
FLOOR = 4
GRID = np.array([(x, y, 0) for x in (0, 0.5, 1) for y in (0, 0.5, 1)])  # on each surface, its corners too


def room(kind, place, sides, rounding, size=(4, 4, 3)):
    """The Transport of a closed room with crates: its 6 walls, which look inwards, are first."""
    surfaces = place.box((0, 0, 0), size, inward=True, reflectance=0.6)
    for low, high in CRATES[kind][0] if kind else ():
        surfaces += place.box(low, high, sides=sides, reflectance=0.5)
    if rounding > 2**-50:
        shapes = {id(s.shape): Plane.through(np.float32(s.shape.corners).astype(float)) for s in surfaces}
        surfaces = [Surface(shapes[id(s.shape)], s.reflectance, side=s.side) for s in surfaces]
    return transport_of(Scene(surfaces, rounding=rounding))


def seen(transport, surface, points, read=True):
    """Factors (n, n surfaces) at points (n, 3) m of a surface, where they are read, or just there."""
    own = transport.scene.surfaces[surface]
    points = own.shape.project(points - transport.origin)
    points = transport.field.inset(surface, points) if read else points
    every, number = np.full(len(points), surface), len(transport.scene)
    rows = transport.factors.matrix(points, own.normals(points), every, np.arange(number), False)[:, :number]
    return rows, transport.field.contacts.covered(points, every)


BOTH = ("front", "back")
ROUNDINGS = [2**-53, 2**-24]


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("sides", [BOTH[:1], BOTH], ids=["one-sided", "two-sided"])
@pytest.mark.parametrize("kind", CRATES)
def test_rows_close_at_all_vertices_of_crates_and_floors(kind, sides, rounding):
    """They summed to .3 to 1.7, at feet and, of two-sided crates that meet, all over a side."""
    for place in PLACES[1:]:
        transport = room(kind, place, sides, rounding)
        for k in range(FLOOR, len(transport.scene)):
            shape = transport.scene.surfaces[k].shape
            rows, covered = seen(transport, k, shape.world(GRID) + transport.origin)
            assert np.abs(rows.sum(axis=1) - 1)[~covered].max(initial=0) < 5e-3


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("sides", [BOTH[:1], BOTH], ids=["one-sided", "two-sided"])
@pytest.mark.parametrize("kind", CRATES)
def test_a_vertex_at_a_foot_sees_what_is_seen_from_the_open_beside_it(kind, sides, rounding):
    """As from the middle of what is open: it was as from close by one of the crates, 7 to 50 % of all that is seen."""
    at, open_ = (np.array([np.append(p[k], 0.0) for p in CRATES[kind][1]]) for k in (0, 1))
    for place in PLACES:
        transport = room(kind, place, sides, rounding)
        rows, covered = seen(transport, FLOOR, place(at))
        step = max(2e-4, 8 * transport.field.contacts.apart)
        beside = seen(transport, FLOOR, place(at + step * open_), read=False)[0]
        assert not covered.any()
        assert np.abs(rows - beside).sum(axis=1).max() / 2 < 8e-3


def test_where_two_crates_meet_in_an_edge_a_vertex_sees_one_of_both_sides():
    crates = [((1, 1, 0), (2, 2, 1)), ((2, 2, 0), (3, 3, 0.7))]
    for place in PLACES:
        surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True)
        transport = transport_of(Scene(surfaces + [s for c in crates for s in place.box(*c)]))
        rows = seen(transport, FLOOR, place([(2, 2, 0)]))[0]
        beside = seen(transport, FLOOR, place([(2 + 2e-4, 2 - 2e-4, 0), (2 - 2e-4, 2 + 2e-4, 0)]), read=False)[0]
        assert np.abs(rows - beside).sum(axis=1).min() / 2 < 2e-3


def test_what_stands_all_around_a_vertex_leaves_it_dark():
    corners = [(x, y) for x in (1, 2) for y in (1, 2)]
    surfaces = [s for x, y in corners for s in Place(0.3).box((x, y, 0), (x + 1, y + 1, 1))]
    transport = transport_of(Scene(Place(0.3).box((0, 0, 0), (4, 4, 3), inward=True) + surfaces))
    assert seen(transport, FLOOR, Place(0.3)([(2, 2, 0), (1.5, 2, 0)]))[1].all()


@pytest.mark.parametrize("long", [4.0, 0.25])
def test_the_corner_of_a_long_room_sees_both_walls_alike(long):
    """Along each edge vertices kept as much of it from the border: they saw the corner from 14 degrees off a wall."""
    for place in PLACES:
        transport = room(None, place, (), 2**-53, (long, 1, 0.5))
        corner = np.array([0.0, 0, 0])
        rows = seen(transport, FLOOR, place([corner]))[0]
        beside = seen(transport, FLOOR, place([corner + [1e-4, 1e-4, 0]]), read=False)[0]
        assert np.abs(rows - beside).sum() / 2 < 1e-3


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("sides", [BOTH[:1], BOTH], ids=["one-sided", "two-sided"])
@pytest.mark.parametrize("kind", ["one", "side by side", "edge on side"])
def test_rows_close_at_any_distance_from_a_foot(kind, sides, rounding):
    """Of edges of which a point is a thousand tolerances off, and far from their other end, up to half was lost."""
    rng = np.random.default_rng(3)
    at = np.array([np.append(p, 0.0) for p, _ in CRATES[kind][1]])
    for place in PLACES:
        transport = room(kind, place, sides, rounding)
        tolerance = transport.scene.tolerance
        for far in (64.0, 512.0, 4096.0):
            turn = rng.uniform(0, 2 * np.pi, (20, len(at)))
            points = (at + far * tolerance * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)).reshape(-1, 3)
            out = np.ones(len(points), bool)
            for low, high in CRATES[kind][0]:
                inside = (points[:, :2] > np.array(low)[:2] - 8 * tolerance) & (
                    points[:, :2] < np.array(high)[:2] + 8 * tolerance
                )
                out &= ~inside.all(axis=1)
            rows = seen(transport, FLOOR, place(points[out]), read=False)[0]
            assert np.abs(rows.sum(axis=1) - 1).max() < (0.03 if far < 100 else 2e-3)


@pytest.mark.parametrize("kind", ["edge on side", "against a wall"])
def test_white_crates_that_touch_are_a_furnace_to_their_feet(kind):
    """1.95 for 1 at a foot; light was said to come from nothing where they ran through others: they only touch."""
    place = PLACES[1]
    surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True, reflectance=0.95, emission=0.05)
    for low, high in CRATES[kind][0]:
        surfaces += place.box(low, high, sides=BOTH, reflectance=0.95, emission=0.05)
    solution = finish(link_steps(Scene(surfaces), 0.02, None, ""))
    feet = place([np.append(p, 0.0) for p, _ in CRATES[kind][1]])
    assert not solution.warnings and solution.error < 5e-3
    assert solution.radiance(FLOOR, feet) == pytest.approx(1, abs=1e-3)


SHEETS = {  # corner, u, v of each, on the floor's vertices at their feet, and the open there
    "partition": ([((2, 1, 0), (0, 2, 0), (0, 0, 2))], [((2, 1), (0, -1)), ((2, 3), (0, 1)), ((2, 2), (1, 0))]),
    "tee": (
        [((2, 0, 0), (0, 3, 0), (0, 0, 2)), ((2, 1.5, 0), (1, 0, 0), (0, 0, 1.5))],
        [((2, 1.5), (-1, 0)), ((3, 1.5), (1, 0)), ((2, 0), (1, 1))],
    ),
    "cross": (
        [((2, 1, 0), (0, 2, 0), (0, 0, 2)), ((1, 2, 0), (2, 0, 0), (0, 0, 1.5))],
        [((2, 2), (1, -1)), ((3, 2), (1, 0))],
    ),
    "leaning": ([((2, 1, 0), (0, 2, 0), (1, 0, 2))], [((2, 3), (0, 1)), ((2, 2), (1, 0))]),
    "carpet": ([((1, 1, 0), (2, 0, 0), (0, 2, 0))], [((1, 1), (-1, -1)), ((2, 1), (0, -1)), ((3, 2), (1, 0))]),
}


@pytest.mark.parametrize("kind", SHEETS)
def test_a_vertex_at_a_sheet_sees_what_is_seen_from_one_side_of_it(kind):
    """At a partition's end it was as from one side, a quarter off; at a carpet's rim half of the sky was hidden."""
    at, open_ = (np.array([np.append(p[k], 0.0) for p in SHEETS[kind][1]]) for k in (0, 1))
    for place in PLACES:
        surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True)
        transport = transport_of(Scene(surfaces + [s for sheet in SHEETS[kind][0] for s in place.sheet(*sheet)]))
        rows, covered = seen(transport, FLOOR, place(at))
        sides = [seen(transport, FLOOR, place(at + step * open_), read=False)[0] for step in (2e-4, -2e-4)]
        assert not covered.any()
        assert (np.min([np.abs(rows - side).sum(axis=1) for side in sides], axis=0) / 2 < 1e-3).all()


def lit_room(kind, place):
    """With crates or sheets, and a lamp below the ceiling; floor vertices at their feet, and the open there."""
    what, feet = (CRATES | SHEETS)[kind]
    surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True, reflectance=0.6)
    surfaces += [s for w in what for s in (place.box(*w, reflectance=0.5) if kind in CRATES else place.sheet(*w))]
    corner, along, across = place(np.array([(1.5, 1.5, 2.9), (1.5, 2.5, 2.9), (2.5, 1.5, 2.9)]))
    surfaces.append(Surface(Plane(corner, along - corner, across - corner), 0.0, 10.0))
    at, open_ = (np.array([np.append(foot[k], 0.0) for foot in feet]) for k in (0, 1))
    return Scene(surfaces), at, open_ / np.linalg.norm(open_, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("kind", "place"),
    list(zip(["three about a point", "edge on side", "against a wall", *SHEETS], itertools.cycle(PLACES[:2]))),
)
def test_by_rays_a_vertex_at_a_foot_is_lit_as_the_open_beside_it(kind, place):
    """.0073 for .069 in the corner of two crates, .26 for .44 at a partition's end, .08 for .44 at a carpet's rim."""
    scene, at, open_ = lit_room(kind, place)
    solution = by_rays(scene, 0.04)
    read, beside = (solution.incident(FLOOR, place(points))[:, 0] for points in (at, at + 2e-3 * open_))
    assert np.abs(read / beside - 1).max() < 0.2, (read, beside)
