"""Meshes that stand on flat shapes and against them, by rays: dark where they touch, and no way out there."""

from functools import cache

import numpy as np
import pytest
from places import PLACES, Place, each_somewhere

from pdm_core import AreaLight, Mesh, Plane, PointLight, Polygon, Scene, Surface
from pdm_core.rays.facets import Facets
from pdm_core.rays.placed import at_hits
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

SIZE = np.array([4.0, 3.6, 2.5])  # m, of the room
LEAN = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])


def by_rays(scene, target=0.04):
    return finish(ray_steps(scene, target, None, ""))


def box(low, high):
    """(8, 3) m, faces."""
    low, high = np.array(low, float), np.array(high, float)
    at = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return np.where(at, high, low), faces


def cylinder(centre, radius, low, high, count=24):
    """With its two caps: (2 count, 3) m, faces."""
    turn = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) * radius + [*centre, 0]
    faces = [[k, (k + 1) % count, count + (k + 1) % count, count + k] for k in range(count)]
    faces += [list(range(count))[::-1], list(range(count, 2 * count))]
    return np.concatenate([ring + [0, 0, low], ring + [0, 0, high]]), faces


FLUSH = {
    "box in a corner": box((0, 0, 0), (1.2, 0.5, 0.8)),
    "cupboard to the ceiling": box((0, 1.2, 0), (0.6, 3.6, 2.5)),
    "drum": cylinder((2.1, 1.8), 0.5, 0.0, 0.9),
    "column": cylinder((2.1, 1.8), 0.3, 0.0, 2.5),
}


@each_somewhere("kind, made", [*((kind, "planes") for kind in FLUSH), ("drum", "polygons"), ("drum", "outward")])
def test_no_light_comes_in_where_a_smooth_mesh_stands(place, kind, made):
    """Places of its feet lay beyond the floor, in the bright sky, and counted at the rim, whose vertices are of the
    side as well: up to 13 in the room, under a sky of 100, and the target was never met."""
    vertices, faces = FLUSH[kind]
    sides = ("back", "front") if made == "outward" else ("front",)
    room = place.box((0, 0, 0), SIZE, made != "outward", sides, reflectance=0.6)
    if made == "polygons":
        room = [Surface(Polygon(wall.shape.corners), wall.reflectance) for wall in room]
    scene = Scene([*room, Surface(Mesh(place(vertices), faces), 0.6)], 100.0, rounding=2**-24)
    solution = by_rays(scene)
    inside = place(np.random.default_rng(1).uniform(0, SIZE, (300, 3)))
    mesh = len(room)
    assert max(solution.radiance(len(sides) * k, inside).max() for k in range(6)) == 0
    assert max(solution.radiance(mesh, points).max() for points in (inside, place(vertices))) == 0


@pytest.fixture(scope="module")
def cornered():
    """cornered(angle, offset, smooth, turn): a room with a box of a mesh in its corner, its faces in that order; the
    Solution and the Mesh."""

    @cache
    def solved(angle, offset, smooth, turn):
        place, (vertices, faces) = Place(angle, offset), FLUSH["box in a corner"]
        lamp = place.box((1.6, 1.6, 2.2), (2.2, 2.2, 2.4), emission=10.0)
        room = place.box((0, 0, 0), SIZE, inward=True, reflectance=0.6)
        mesh = Mesh(place(vertices), faces[::turn], smooth)
        return by_rays(Scene([*room, *lamp, Surface(mesh, 0.6)], rounding=2**-24)), mesh

    return solved


@pytest.mark.parametrize("smooth, where", [(False, "turned and far"), (True, "turned"), (True, "as made")])
def test_what_lies_against_a_wall_is_dark(cornered, smooth, where):
    """It took a sixth of the light of the wall beside it, where shaded smoothly still a tenth of what is shown."""
    place, (solution, _) = Place(*PLACES[where]), cornered(*PLACES[where], smooth, 1)
    hidden = place(np.array([[0, 0.3, 0.4], [0.6, 0, 0.4], [0.3, 0.3, 0], [1.0, 0.1, 0]]))
    shown = place(np.array([[1.2, 0.2, 0.4], [0.6, 0.5, 0.4], [0.6, 0.3, 0.8]]))
    least = solution.radiance(12, shown).min()
    assert least > 0.05 and solution.radiance(12, hidden).max() < 0.002 * least


def test_a_cap_flush_with_a_floor_looks_up(place):
    """A drum let into a floor: its cap looks the way the floor does, and was black."""
    vertices, faces = cylinder((0.2, -0.1), 0.6, -0.5, 0.0)
    floor = place.plane((-3, -3, 0), [6, 0, 0], [0, 6, 0])
    scene = Scene([Surface(floor, 0.2), Surface(Mesh(place(vertices), faces, False), 0.5)], 0.7, rounding=2**-24)
    cap = place(np.array([[0.2, -0.1, 0], [0.5, 0.1, 0], [0.0, -0.4, 0]]))
    assert np.abs(by_rays(scene).radiance(1, cap) / 0.35 - 1).max() < 1e-3  # all of the sky


def test_what_is_sunk_in_the_ground_takes_no_light_from_beside_it(place):
    """Vertices under ground, where nothing comes to, counted on the faces that rise from it: beside a drum a quarter of
    the light was lost, where .2 % were stated."""
    ground = place.box((-2, -2, -1), (2, 2, 0), reflectance=0.8, emission=0.2)
    vertices, faces = cylinder((0, 0), 0.4, -0.4, 0.4)
    drum = Mesh(place(vertices @ LEAN.T), faces, False)
    solution = by_rays(Scene([*ground, Surface(drum, 0.8, 0.2)], 1.0, rounding=2**-24), 0.02)
    turn = 2 * np.pi * np.arange(40) / 40
    beside = np.column_stack([0.403 * np.cos(turn) / 0.8, 0.403 * np.sin(turn), 0 * turn])
    assert np.abs(solution.radiance(5, place(beside)) - 1).mean() < 0.005


@pytest.mark.parametrize("turn, where", [(1, "turned"), (1, "as made"), (-1, "turned and far")])
def test_vertices_where_a_smooth_mesh_stands_against_walls_are_of_faces_that_are_seen(cornered, turn, where):
    """Which of its faces a vertex was read on hung on their order: a box's corner on show was black."""
    solution, mesh = cornered(*PLACES[where], True, turn)
    middles = mesh.corners.mean(axis=1)[[np.flatnonzero((mesh.triangles == k).any(axis=1))[0] for k in range(8)]]
    at = mesh.vertices
    told = 0.6 * solution.incident(np.full(8, 12), at, mesh.normals(at), middles)
    for light in (told, solution.radiance(12, at)):
        assert light[0].max() < 0.03 and light[1:].min() > 0.05


def test_rays_that_meet_a_foot_go_on_within_what_stands_there(place):
    """They went on from under the floor, where the sky is, as far from the origin a floor's cells see feet."""
    vertices, faces = FLUSH["drum"]
    mesh = Mesh(place(vertices), faces)
    facets = Facets(Scene([*place.box((0, 0, 0), SIZE, True), Surface(mesh, 0.6)], 100.0, rounding=2**-24))
    foot = np.flatnonzero(mesh.triangle_normals @ place.turn[:, 2] < -0.9)
    there = at_hits(facets, facets.first[6] + foot, foot >= 0, mesh.corners[foot].mean(axis=1) - facets.centre)
    assert len(foot) and ((there.exact - place.offset) @ place.turn[:, 2]).min() > 0


def test_what_leans_out_over_the_ground_it_is_sunk_in_is_lit_from_the_ground_on(place):
    """Points so near to the ground that what they are lifted by led under it were black, and those that were moved into
    a long face."""
    ground = place.box((-2, -2, -1), (2, 2, 0), reflectance=0.8, emission=0.2)
    vertices, faces = cylinder((0, 0), 0.4, -0.4, 0.4)
    drum = Mesh(place(vertices @ LEAN.T), faces, False)
    solution = by_rays(Scene([*ground, Surface(drum, 0.8, 0.2)], 1.0, rounding=2**-24), 0.02)
    height, turn = (a.ravel() for a in np.meshgrid([0.0005, 0.002, 0.006], np.pi * np.array([0, 0.5, 1])))
    x, y = 0.4 * np.cos(turn), 0.4 * np.sin(turn)
    low = place(np.column_stack([x, y, (height + 0.6 * x) / 0.8]) @ LEAN.T)
    assert np.abs(solution.radiance(6, low) - 1).max() < 0.025


SHEET = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [-1, 2, 1]])
FLOORS = {
    "plane that looks down": lambda place: place.plane((0, 0, 0), [0, 4, 0], [4, 0, 0]),
    "bent sheet": lambda place: Mesh(place(SHEET), [[0, 1, 2, 3], [0, 3, 4]], False),
}


@each_somewhere("kind, gap, rounding", [(k, *gap) for k in FLOORS for gap in ((0.0, 2**-24), (1e-5, 2**-53))])
def test_a_shining_mesh_gives_nothing_through_the_floor_that_it_stands_on(place, kind, gap, rounding):
    """The storey below got .42, where the lamp's own is 10: points that stand for it lay off it by a part in 10,000 of
    its size, beyond the floor."""
    vertices, faces = box((1.8, 1.8, gap), (2.2, 2.2, 0.3))
    lamp, floor = Mesh(place(vertices), faces, False), FLOORS[kind](place)
    below = Surface(place.plane((1, 1, -1), [2, 0, 0], [0, 2, 0]), 0.5)
    sides = [Surface(floor, 0.5, side=side) for side in ("front", "back")]
    solution = by_rays(Scene([Surface(lamp, 0.0, 10.0), *sides, below], rounding=rounding), 0.1)
    points = place(np.array([[2.3, 2.1, -1.0], [2, 2, -1]]))
    np.testing.assert_array_equal(solution.incident(np.array([3, 3]), points), 0.0)


def test_crates_of_sheets_on_each_other_are_furnaces_within(place):
    """The lower one's lid shone through the floor of the other, which is in its plane, and rays met either by chance:
    light was up to 1.3 and 1.7 where it is 1."""
    crates = place.box((0, 0, 0), (1, 1, 1)), place.box((0.3, 0.3, 1), (1.6, 1.5, 1.7))
    surfaces = []
    for k, wall in enumerate(crates[0] + crates[1]):
        mesh, rho = Mesh(wall.shape.corners, [[0, 1, 2, 3]], False), 0.1 if k == 5 else 0.9
        surfaces += [Surface(mesh, rho, 1 - rho, side=side) for side in ("front", "back")]
    solution = by_rays(Scene(surfaces, 1.0, rounding=2**-24), 0.1)
    within = np.arange(1, 24, 2)
    middles = np.array([surfaces[k].shape.corners.mean(axis=(0, 1)) for k in within])
    assert np.abs(solution.incident(within, middles) - 1).max() < 2 * solution.error < 0.2


@pytest.mark.parametrize("kind", ["tray", "box"])
def test_a_floor_is_dark_under_a_body_that_is_open_or_shines_within(kind):
    """What lay against a point hid no lamp from it: the floor under a tray was as bright as beside it, and that under a
    shining box was lit by the box's inside."""
    corners = np.array([(x, y, z) for z in (0, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    faces = [(0, 2, 3, 1), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6)]
    body = Mesh(corners, faces[:5] if kind == "tray" else faces, smooth=False)
    lights = [PointLight((0, 0, 2), 100), AreaLight((0, 0, 2), (0, 1, 0), (1, 0, 0), 100)] if kind == "tray" else []
    within = 0.0 if kind == "tray" else 1.0
    sides = [Surface(body, 0.5), Surface(body, 0.5, within, "back")]
    floor = Surface(Plane((-2, -2, 0), (4, 0, 0), (0, 4, 0)), 0.5)
    solution = by_rays(Scene([floor, *sides], lights=lights), 0.1)
    assert not solution.incident(0, [[0.1, 0.2, 0], [-0.3, 0.1, 0], [0.45, -0.45, 0]]).any()
    assert (solution.incident(0, [[1.5, 1.5, 0]]) > 0).all() == (kind == "tray")
