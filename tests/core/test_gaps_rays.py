"""Narrow gaps by rays: a lamp that shines both ways a millimetre below a ceiling, where no cell can be so small."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdm_core import Plane, Polygon, Scene, Surface
from pdm_core.rays import glare
from pdm_core.rays.engine import RayState
from pdm_core.rays.facets import Facets
from pdm_core.rays.placed import read_places
from pdm_core.rays.rims import closed
from pdm_core.rays.solution import ray_steps
from pdm_core.shapes.shape import square_lattice
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from tracer import Tracer  # noqa: E402

SIZE, WHITE, GREY, EMITTED = 5.5, 0.737, 0.6, 18.0
TURNS = [np.eye(3), np.linalg.qr(np.array([[0.9, -0.4, 0.1], [0.3, 0.8, 0.5], [-0.3, -0.4, 0.9]]))[0]]


def square(corners, turn, polygon):
    corners = np.asarray(corners, float) @ turn.T
    if polygon:
        return Polygon(corners)
    return Plane(corners[0], corners[1] - corners[0], corners[3] - corners[0])


def room(gap, turn, polygon):
    """A box without a front, its ceiling second, and the lamp's two sides last."""
    s, h = SIZE, SIZE - gap
    walls = [
        [(0, 0, 0), (s, 0, 0), (s, s, 0), (0, s, 0)],
        [(0, 0, s), (0, s, s), (s, s, s), (s, 0, s)],
        [(0, 0, 0), (0, s, 0), (0, s, s), (0, 0, s)],
        [(s, 0, 0), (s, 0, s), (s, s, s), (s, s, 0)],
        [(0, s, 0), (s, s, 0), (s, s, s), (0, s, s)],
    ]
    lamp = [(2.1, 2.2, h), (2.1, 3.25, h), (3.4, 3.25, h), (3.4, 2.2, h)]
    turn = turn * np.sign(np.linalg.det(turn))
    surfaces = [Surface(square(wall, turn, polygon), WHITE) for wall in walls]
    lamp = square(lamp, turn, polygon)
    surfaces += [Surface(lamp, GREY, EMITTED, side=side) for side in ("front", "back")]
    return Scene(surfaces, rounding=2**-24), turn


@pytest.mark.parametrize(("turn", "polygon"), [(TURNS[0], True), (TURNS[1], False)])
def test_light_in_a_narrow_gap_is_none_beside_it(turn, polygon):
    scene, turn = room(1e-3, turn, polygon)
    solution = finish(ray_steps(scene, 0.02, None, "asked for"))
    assert solution.error <= 0.02
    # between parallel planes without end, but for what leaves at the rims
    within = np.array([[2.7, 2.7, SIZE], [2.14, 2.5, SIZE], [3.36, 3.21, SIZE]]) @ turn.T
    held = finish(solution.held_steps(np.ones(3, int), within))[:, 0] * WHITE
    endless = WHITE * EMITTED / (1 - WHITE * GREY)
    assert (held > 0.9 * endless).all()
    assert (held < 1.02 * endless).all()
    # a wall's light as a path tracer tells it: the ceiling beside the lamp sends no light of the gap
    places = np.array([[2.78, SIZE, 2.7], [0.3, SIZE, 0.3], [2.7, 2.7, 0.0], [1.0, 1.0, 0.0]]) @ turn.T
    surface = np.array([4, 4, 0, 0])
    traced = Tracer(scene).incident(surface, places, 4000, np.random.default_rng(1))[:, 0]
    np.testing.assert_allclose(solution.incident(surface, places)[:, 0], traced, rtol=0.045)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("gap, told", [(5e-5, True), (1e-3, False), (0.0, False)])
def test_a_gap_that_is_closed_to_a_lamp_is_told_with_both_names(turn, gap, told):
    scene, _ = room(gap, turn, polygon=True)
    named = [replace(s, name=f"object {k}") for k, s in enumerate(scene.surfaces)]
    facets = Facets(Scene(named, rounding=2**-24))
    said = closed(facets)
    assert len(said) == told
    if told:
        assert "'object 1' and 'object 6'" in said[0]


@pytest.fixture(scope="module", params=TURNS)
def glaring(request):
    """The Scene with a narrow gap, how it is turned, and its Solution."""
    scene, turn = room(1e-3, request.param, False)
    return scene, turn, finish(ray_steps(scene, 0.04, None, "asked for"))


@pytest.mark.parametrize("kept", [False, True])
def test_no_place_is_lit_by_a_ray_that_happens_to_meet_the_glare_in_a_gap(glaring, kept):
    """One of 64 rays through a slit of a millimetre made single places three times as bright."""
    scene, turn, solution = glaring
    x, z = np.meshgrid(np.linspace(0.3, SIZE - 0.3, 60), np.linspace(2.5, SIZE - 0.1, 40))
    walls = [[0 * x, x, z], [0 * x + SIZE, x, z], [x, 0 * x + SIZE, z]]
    surface, places = np.repeat([2, 3, 4], x.size), np.moveaxis(walls, 1, -1).reshape(-1, 3) @ turn.T
    read = solution.kept(surface, places).incident(scene) if kept else solution.incident(surface, places)
    light = read[:, 0].reshape(3, *x.shape)
    around = [light[:, 1:-1, :-2], light[:, 1:-1, 2:], light[:, :-2, 1:-1], light[:, 2:, 1:-1]]
    assert (light[:, 1:-1, 1:-1] < 1.1 * np.median(around, axis=0)).all()


@pytest.mark.parametrize("gap", [0.05, 0.15])
@pytest.mark.parametrize("turn", TURNS)
def test_all_that_glare_sends_arrives(turn, gap, monkeypatch):
    """By points, if more than usual, as much as by very many rays, where no other light is."""
    monkeypatch.setattr(glare, "POINTS", 1000)
    scene, turn = room(gap, turn, False)
    paint = [replace(s, reflectance=WHITE * (k == 1), emission=float(k == 6)) for k, s in enumerate(scene.surfaces)]
    state = finish(ray_steps(Scene(paint), 0.04, None, "asked for"))._state
    x, y = square_lattice(200).T * SIZE
    wall = read_places(state.facets, np.full(len(x), 4), np.stack([x, 0 * x + SIZE, y], axis=1) @ turn.T)
    by_points, state.glares = finish(state.gather(wall, 64)), {1024: None}
    by_rays = finish(state.gather(wall, 1024))
    assert by_points.mean() == pytest.approx(by_rays.mean(), rel=0.1)


def test_where_light_jumps_at_what_stands_there_cells_are_not_bent():
    floor = Plane((0, 0, 0), (4, 0, 0), (0, 4, 0))
    wall = Plane((2.3, 0, 0), (0, 4, 0), (0, 0, 1))
    surfaces = [Surface(floor, 0.5), *(Surface(wall, 0.5, side=side) for side in ("front", "back"))]
    nodes = RayState(Scene(surfaces, 1.0), 0.04).nodes
    lattice = nodes.lattice
    mine = np.flatnonzero(lattice.chart == 0)
    middle = nodes.parted.centre[mine, 0] * 4 > 2.3
    value = np.zeros((len(nodes), 3))
    value[mine] = np.where(middle, 1.0, 0.2)[:, None]
    cells, _ = nodes.surplus(value, np.zeros(len(nodes)))
    assert np.abs(lattice.surplus(value[: len(lattice)], np.zeros(len(lattice))))[mine].max() > 0.1
    np.testing.assert_allclose(cells[mine], 0.0, atol=1e-12)


def two_boxes(gap, rho=0.7):
    """Two boxes on the floor of a lit room, so far apart, m; the first one's face at x = -gap / 2 is surface 7."""
    room = faces((-2.5, -2.5, 0), (2.5, 2.5, 3), inward=True)
    left, right = (faces((x, -0.5, 0), (x + 1, 0.5, 1)) for x in (-gap / 2 - 1, gap / 2))
    lamp = Surface(Plane((-0.5, -0.5, 2.9), (0, 1, 0), (1, 0, 0)), 0.5, 10.0)
    walls = [Surface(p, rho) for p in [*room, *left, *right]]
    return Scene([*walls, lamp], rounding=2**-24)


def faces(low, high, inward=False):
    """Planes of a box: of each axis the low, then the high one."""
    low, size, out = np.asarray(low, float), np.diag(np.subtract(high, low)), []
    for axis in range(3):
        u, v = size[(axis + 1) % 3], size[(axis + 2) % 3]
        for corner, turned in ((low, not inward), (low + size[axis], inward)):
            out.append(Plane(corner, v, u) if turned else Plane(corner, u, v))
    return out


@pytest.mark.parametrize("gap", [0.001, 0.003, 0.01])
def test_light_between_boxes_falls_within_a_few_widths_of_the_gap(gap):
    scene = two_boxes(gap)
    solution = finish(ray_steps(scene, 0.04, None, "asked for"))
    # from the middle to the mouth above: cells of .25 m held .03 there, and sent it on
    depth = np.array([0.5, 0.25, 30 * gap, 5 * gap, gap, gap / 4])
    points = np.column_stack([np.full(6, -gap / 2), np.full(6, 0.13), 1 - depth])
    on = np.full(6, 7)
    traced = Tracer(scene).incident(on, points, 2000, np.random.default_rng(1))[:, 0]
    told = solution.incident(on, points)[:, 0]
    np.testing.assert_allclose(told, traced, rtol=0, atol=0.08 * traced.max())
    assert told[0] < 0.012 * traced.max()
    # what little light is in there is known less well than that of the room
    assert solution.surface_errors[7] > 1.5 * solution.error


def test_few_points_of_a_lamp_tell_what_is_seen_through_a_slit_in_the_mean():
    state = RayState(two_boxes(0.003), 0.04)
    n = 400
    points = np.column_stack([np.full(n, -0.0015), np.linspace(-0.4, 0.4, n), 1 - np.linspace(0.03, 0.08, n)])
    there = read_places(state.facets, np.full(n, 7), points)
    few = finish(state.lit.shares.scattered(there))[:, 0, 0]
    all_, _, _ = finish(state.lit.shares.at(there, 1e-6, 1e-6, (1024, 16384)))
    np.testing.assert_allclose(few.mean(), all_[:, 0, 0].mean(), rtol=0.3)
