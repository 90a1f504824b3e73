"""By rays what lies on a face in its plane covers it where one of the two is a mesh, as a plane on a plane does."""

from itertools import product

import numpy as np
import pytest
from places import each_somewhere
from rooms import by_rays
from test_flush_meshes import box

from pdm_core import Mesh, Plane, Polygon, Scene, Surface
from pdm_core.rays.engine import RayState
from pdm_core.rays.facets import Facets

SQUARE = np.array([(1, 1, 0), (2.5, 1, 0), (2.5, 2.2, 0), (1, 2.2, 0)], float)
CENTRE = np.array([(1.75, 1.6, 0)])
CARPETS = {
    "triangle": lambda p: Mesh(p, [[0, 1, 2]], False),
    "triangles": lambda p: Mesh(np.append(p, p.mean(axis=0)[None], axis=0), [[k, (k + 1) % 4, 4] for k in range(4)]),
}
STICKERS = {
    "plane": lambda p: Plane(p[0], p[1] - p[0], p[3] - p[0]),
    "polygon": Polygon,
    "mesh": lambda p: Mesh(p, [[0, 1, 2, 3]], False),
}
SIDES = {"one side": ("front",), "both sides": ("front", "back")}


@each_somewhere("kind, sides", product(CARPETS, SIDES))
def test_a_floor_is_dark_under_a_mesh_in_its_plane(place, kind, sides):
    """It took the light of the room through the carpet; and a triangle's own light was that of the floor's other side,
    as the middle of its box is not in its plane."""
    room = place.box((0, 0, 0), (4, 4, 3), True, SIDES[sides], reflectance=0.5, emission=0.5)
    carpet = CARPETS[kind](place(SQUARE))
    both = [Surface(carpet, 0.7, 0.3, side) for side in ("front", "back")]
    solution = by_rays(Scene([*room, *both], rounding=2**-24))
    floor, n = 4 * len(SIDES[sides]), len(room)
    under, beside = place([(2.2, 1.3, 0), (1.9, 1.4, 0)]), place([(0.9, 1.4, 0), (2.7, 1.3, 0), (2.0, 2.4, 0)])
    np.testing.assert_array_equal(solution.incident(np.full(2, floor), under), 0.0)
    np.testing.assert_allclose(solution.incident(np.full(3, floor), beside), 1.0, atol=0.02)
    np.testing.assert_allclose(solution.incident(np.full(2, n), under), 1.0, atol=0.02)
    np.testing.assert_array_equal(solution.incident(np.full(2, n + 1), under), 0.0)


@pytest.mark.parametrize("kind", STICKERS)
def test_a_picture_covers_the_mesh_that_it_hangs_on(place, kind):
    """The wall behind it was as bright as beside it, and shone through it."""
    vertices, faces = box((0, 0, 0), (4, 4, 3))
    walls = Mesh(place(vertices), [face[::-1] for face in faces], False)
    picture = STICKERS[kind](place(SQUARE[:, [2, 0, 1]]))
    surfaces = [
        Surface(walls, 0.5),
        *(Surface(picture, 0.5, light, side) for side, light in (("front", 1), ("back", 0))),
    ]
    solution = by_rays(Scene(surfaces, rounding=2**-24))
    at = place(CENTRE[:, [2, 0, 1]])
    assert solution.incident(0, at).max() == 0 and solution.incident(1, at).min() > 0
    assert solution.incident(0, place([(0, 0.5, 1.6)])).min() > 0


@pytest.mark.parametrize("covered, kind", [("plane", "mesh"), *(("mesh", kind) for kind in STICKERS)])
def test_what_shines_beneath_a_cover_gives_nothing(place, covered, kind):
    """Of a lamp half beneath a sheet all shone, if either was a mesh."""
    lamp, half = STICKERS[covered](place(SQUARE)), SQUARE * [0.5, 1, 1] + [0.5, 0, 0]
    cover = STICKERS[kind](place(half))
    above = Plane(place((0.6, 1.2, 1.5)), place.turn @ (0, 0.8, 0), place.turn @ (0.8, 0, 0))

    at = place([(1.0, 1.6, 1.5)])
    shown = Plane(place((1.75, 1, 0)), place.turn @ (0.75, 0, 0), place.turn @ (0, 1.2, 0))
    scene = Scene([Surface(lamp, 0.0, 5.0), Surface(above, 0.0), Surface(cover, 0.0)], rounding=2**-24)
    right = 5 * shown.unhidden(at, np.array([place.turn @ (0, 0, -1)]), 1, 0.0)
    np.testing.assert_allclose(by_rays(scene, 0.1).incident(1, at)[:, 0], right, rtol=0.1)


@each_somewhere("kind", STICKERS)
def test_a_lamp_flush_with_a_ceiling_is_seen_from_below(place, kind):
    """Let into the ceiling from above, it lit nothing."""
    vertices, faces = box((1, 1, 0), (2.5, 2.2, 0.2))
    ceiling = STICKERS[kind](place([(0, 0, 0), (0, 4, 0), (4, 4, 0), (4, 0, 0)]))
    floor = Plane(place((0, 0, -2)), place.turn @ (4, 0, 0), place.turn @ (0, 4, 0))
    lamp = Surface(Mesh(place(vertices), faces, False), 0.0, 5.0)
    below = place(CENTRE - [0, 0, 2])
    solution = by_rays(Scene([Surface(ceiling, 0.5), Surface(floor, 0.0), lamp], rounding=2**-24), 0.1)
    panel = Plane(place(SQUARE[0]), place.turn @ (0, 1.2, 0), place.turn @ (1.5, 0, 0))
    right = 5 * panel.unhidden(below, np.array([place.turn @ (0, 0, 1)]), 1, 0.0)
    np.testing.assert_allclose(solution.incident(1, below)[:, 0], right, rtol=0.05)
    # what rounding left of its light in its own plane was to be as right as light: ten times as long, over 100 % stated
    assert solution.error == 0 and not solution.incident(0, place([(0.5, 0.5, 0), (3, 3, 0)])).any()


@pytest.mark.parametrize("rounding", [2**-53, 2**-24])
def test_layers_are_counted_in_turn(place, rounding):
    """Two table tops that overlap, and a leg under the smaller one: each was a layer off the larger one, so that the
    leg's lid lay in the plane of the top that it bears, and was met within it instead of this."""
    tops = [place.plane(low, (0, d, 0), (w, 0, 0)) for low, w, d in (((0, 0, 1), 3, 2), ((2, 1, 1), 2, 1.5))]
    lid = place.plane((3.5, 2, 1), (0.2, 0, 0), (0, 0.2, 0))
    surfaces = [Surface(s, 0.5, side=side) for s in (*tops, lid) for side in ("front", "back")]
    facets = Facets(Scene(surfaces, rounding=rounding))
    above = [shape.normal @ place.turn[:, 2] > 0 for shape in (*tops, lid)]
    late = [facets.late[facets.first[k], 0 if up else 1] for k, up in enumerate(above)]
    assert late == [0, 1, 2] and len(set(facets.plane)) == 1


def test_light_before_a_plank_on_a_mesh_is_not_of_what_is_under_it(place):
    """Middles of a floor's thirds lay just in the plank's side: nothing came to them, and .46 was seen for 1."""
    at = np.linspace(-3, 3, 9)
    x, y = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    k = np.arange(81).reshape(9, 9)
    faces = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    floor = Surface(Mesh(place(np.stack([x, y, 0 * x], axis=1)), faces, False), 0.5)
    plank = [Surface(Polygon(s.shape.corners), 0.5) for s in place.box((1.0, 0.5, 0), (1.5, 1.25, 0.05))]
    cuts = RayState(Scene([floor, *plank], 1.0, rounding=2**-24), 0.1).nodes.meshes.cuts
    corner, third = (
        (points + cuts.facets.centre - place.offset).reshape(-1, 3) @ place.turn for points in (cuts.points, cuts.third)
    )
    about = (third[:, 0] > 1.0) & (third[:, 0] < 1.5) & (corner[:, 1] < 0.49) & (corner[:, 1] > 0)
    assert about.any() and (third[about, 1] < 0.49).all()


@pytest.mark.parametrize("thick", [0, 2, 5, 8, 14, 20, 100])
def test_a_partition_as_thin_as_few_tolerances_is_dark_within(place, thick):
    """Points of its inside were lifted out of it, by a part in 10,000 of its size or by 16 tolerances, and took the
    light outside."""
    wall = Plane(place((0, 0, 0)), place.turn @ (4, 0, 0), place.turn @ (0, 3, 0))
    tolerance = Scene([Surface(wall)], rounding=2**-24).tolerance
    vertices, faces = box((0, 0, 0), (4, 3, thick * tolerance))
    partition = Mesh(place(vertices), faces, False)
    scene = Scene([Surface(partition, 0.5), Surface(partition, 0.5, 0, "back")], 1.0, rounding=2**-24)
    at, solution = place([(1, 1, 0), (2.2, 1.7, 0), (3, 2, thick * tolerance)]), by_rays(scene)
    np.testing.assert_allclose(solution.incident(np.zeros(3, int), at), 1.0, atol=1e-3)
    np.testing.assert_array_equal(solution.incident(np.ones(3, int), at), 0.0)
