"""Light of lamps where few points stand for it: near large ones, beside what hides a part of them."""

import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pdm_core import Mesh, Plane, Polygon, Scene, Sphere, Surface, solve
from pdm_core.rays.check import Check
from pdm_core.rays.direct import POWER, Shares
from pdm_core.rays.engine import RayState
from pdm_core.rays.facets import Facets
from pdm_core.rays.placed import Placed
from pdm_core.rays.refinement import improve
from pdm_core.rays.solution import ray_steps
from pdm_core.rays.sources import met_by_rays, sources_of
from pdm_core.rays.tally import unseen
from pdm_core.read_off import spread_points
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from fuzz import TARGET, scene  # noqa: E402
from judge import judge  # noqa: E402
from kinds import Place  # noqa: E402
from variants import with_meshes  # noqa: E402


@pytest.mark.parametrize("seed, lamps", [(10, False), (2, True), (18, True)])
def test_balls_as_meshes_that_cross_and_shine_are_right_to_what_is_stated(seed, lamps):
    """Furnaces: 25 % off at 8 % stated where nodes took a few points of large lamps."""

    def at_random(rng):
        return scene(rng, lamps)

    at_random.__name__ = scene.__name__  # what seeds are drawn by
    verdict = judge(at_random, seed, TARGET, None, with_meshes)
    assert verdict.holds and not verdict.refused, verdict


def test_only_what_is_broad_and_no_brighter_than_others_is_met_by_rays():
    walls = Place(np.random.default_rng(0)).box((0, 0, 0), (1, 1, 1))

    def shining(emission, *more):
        own = [Surface(wall, 0.5, e, side="back") for wall, e in zip(walls, emission, strict=True)]
        return met_by_rays(Scene([*own, *more]))

    lamp = Surface(Sphere.at((0.5, 0.5, 0.5), 0.1), 0.0, 10.0)
    assert shining([1.0] * 6).all()
    assert not shining([1.0, 0, 0, 0, 0, 0]).any()  # a ceiling alone is a lamp
    np.testing.assert_array_equal(shining([1.0] * 6, lamp), [True] * 6 + [False])
    np.testing.assert_array_equal(shining([0.0] * 6, lamp), [False] * 7)


@pytest.mark.parametrize("number", [2, 4, 16])
@pytest.mark.parametrize("partly", [0.1, 0.5])
def test_what_points_that_agree_may_have_missed(number, partly):
    """An edge moves over points in a row; of many places some see a part, of any size."""
    rng = np.random.default_rng(number)
    part = np.where(rng.random(400_000) < partly, rng.random(400_000), rng.integers(0, 2, 400_000))
    told = (((np.arange(number) + 0.5) / number)[:, None] < part).mean(axis=0)
    agree = (told == 0) | (told == 1)
    missed = np.sqrt(((told - part)[agree] ** 2).mean())
    np.testing.assert_allclose(unseen(np.array([float(number)]), partly), missed, rtol=0.03)


def test_light_of_a_lamp_that_no_point_stands_for_is_told():
    """Of a large lamp a strip alone is ahead of a wall, without any of its points, and a screen hides it: whatever is
    taken of its light is told to be lost."""
    lamp = Mesh([(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)], [(0, 1, 2, 3)], False)
    wall, screen = Plane((0.01, 4, 0.001), (0, 1, 0), (0, 0, 1)), Plane((-1, 3, 5e-4), (1.00999, 0, 0), (0, 3, 0))
    surfaces = [Surface(lamp, 0.0, 1.0, name="Lamp"), Surface(wall, 0.5, side="back"), Surface(screen)]
    facets = Facets(Scene(surfaces))
    shares = Shares(facets, sources_of(facets, np.zeros(3, bool)), Counter())
    z = np.geomspace(2e-3, 0.5, 20)
    there = Placed(facets, np.ones(20, int), np.column_stack([np.full(20, 0.01), np.full(20, 4.5), z]))
    factor, off, lost = finish(shares.at(there, 0.01, 0.01, (4, 16)))
    assert factor.max() > 0.1  # no point tells that it is hidden
    np.testing.assert_allclose(lost, factor[:, 0, 0], rtol=1e-6)
    assert (off >= (1 - 1e-6) * lost).all()


def test_lamp_light_that_no_point_stands_for_asks_for_no_more_rays():
    """Three sheets through one another, of which one shines: at 2 % 12 million rays went where they could not help."""
    room = [Surface(face, 0.5) for face in _box((-2, -2, -1.2), (4, 4, 3.2))]
    lamp, *sheets = [
        Plane((-0.5, -0.4, 0), (1, 0, 0), (0, 0.8, 0)),
        Plane((-0.2, -0.6, -0.3), (0.3, 1.2, 0.1), (0.1, 0.1, 0.7)),
        Plane((-0.6, -0.25, -0.4), (1.2, 0.2, 0.1), (0, 0.3, 0.8)),
    ]
    both = [Surface(sheet, 0.5, side=side) for sheet in sheets for side in ("front", "back")]
    state = RayState(Scene([*room, Surface(lamp, 0.5, 5.0), *both]), 0.02)
    finish(state.extend(np.full(len(state.nodes), -1)))
    finish(state.solve())
    check = Check(state)
    finish(check.measure())
    before, state.lit.lost = dict(check.parts), state.lit.lost + 1.0
    finish(check.measure())
    assert check.parts["nodes"] == before["nodes"] > 0
    assert check.parts["shadows"] > 0.1 > before["shadows"]


def test_what_direct_light_may_be_off_by_is_kept_close_to_a_lamp_too():
    """A ceiling close above a ball that shines, of which a smaller one hides a part: at most 256 points of it told."""
    room = [Surface(face, 0.5) for face in _box((-3, -2.5, -2.4), (6, 5, 3))]
    room += [Surface(Sphere.at((0, 0, 0), 0.24), 0.0, 12.0), Surface(Sphere.at((0.11, 0.13, 0.31), 0.06), 0.5)]
    state = RayState(Scene(room), 0.04)
    finish(state.extend(np.full(len(state.nodes), -1)))
    finish(state.solve())
    rng = np.random.default_rng(3)
    at = np.column_stack([rng.uniform(0.05, 0.3, 200), rng.uniform(0.05, 0.3, 200), np.full(200, 0.6)])
    places = Placed(state.facets, np.ones(200, int), at)
    exact = finish(state.lit.shares.at(places, 1e-9, 1e-9, (16384, 16384)))[0]
    state.told = 0.05
    off = np.sqrt(((finish(state.straight(places))[0] / exact - 1) ** 2).mean())
    assert off < 1 / (2 * 256) ** POWER


def test_where_cells_and_points_of_lamps_get_finer_together_all_are_lit_once():
    """The new cells were lit, and then all of them anew."""
    room = [Surface(face, 0.5) for face in _box((-2, -2, -1.2), (4, 4, 3.2))]
    room.append(Surface(Plane((-0.5, -0.4, 1.9), (0, 0.8, 0), (1, 0, 0)), 0.0, 5.0))
    state = RayState(Scene([*room, Surface(Sphere.at((0.3, 0.2, 0), 0.4), 0.5)]), 0.02)
    finish(state.extend(np.full(len(state.nodes), -1)))
    finish(state.solve())
    check = Check(state)
    finish(check.measure())
    check.parts |= {"lamps": 0.1, "sent": 0.1}
    lit, extend = [], state.lit.extend
    state.lit.extend = lambda state, old: lit.append(old) or extend(state, old)
    assert finish(improve(check))
    (old,) = lit
    assert len(old) == len(state.nodes) and (old < 0).all() and (state.nodes.old >= 0).any()


def test_what_is_shut_in_near_a_lamp_hangs_on_no_light_that_few_points_do_not_stand_for():
    """Closed boxes beside a ball that shines, in a room: nothing of it comes into them, and a target is met."""
    surfaces = [Surface(face, 0.6) for face in _box((-3, -2.5, -2.4), (6, 5, 3))]
    surfaces.append(Surface(Sphere.at((0, 0, 0), 0.24), 0.0, 12.0))
    for corner in ((-0.33, 0.26, -0.35), (0.3, -0.05, -0.1), (-0.1, -0.4, -0.3), (0.1, 0.3, 0.1)):
        for face in _box(corner, (0.1, 0.09, 0.11)):
            surfaces += [Surface(face, 0.7, side=side) for side in ("front", "back")]
    assert finish(ray_steps(Scene(surfaces), 0.04, None, "")).error <= 0.04


FLAT = np.array([(1.5, 1, 0), (1.5, 3, 0), (3.5, 3, 0), (3.5, 1, 0)])
PANELS = {
    "plane": Plane.through,
    "polygon": lambda corners: Polygon(corners + np.outer([0, 0, 1, 0], [-0.001, 0, 0])),
    "mesh": lambda corners: Mesh(corners, [(0, 1, 2), (0, 2, 3)], False),
    "box": lambda corners: Mesh.of(np.concatenate([f.corners[[[0, 1, 2], [0, 2, 3]]] for f in _box(corners[0], BOX)])),
}
BOX = 2, 2, 0.05


@pytest.mark.parametrize("kind", PANELS)
@pytest.mark.parametrize("gap", [0.001, 0.005, 0.02])
def test_a_lamp_close_to_a_wall_is_one(gap, kind):
    """It was 49 lamps, as its light goes no further than the gap is wide, and took as many times as long as one."""
    panel = PANELS[kind](FLAT + [0, 0, gap])
    room = [Surface(face, 0.5) for face in _box((0, 0, 0), (5, 4, 2.5))]
    for surfaces in (room, room[:1]):
        facets = Facets(Scene([*surfaces, Surface(panel, 0.0, 1.0)]))
        assert len(sources_of(facets, np.zeros(len(surfaces) + 1, bool))) == 1


def _box(corner, size):
    """Faces of a box, which look inwards."""
    o, (x, y, z) = np.array(corner, float), np.diag(size).astype(float)
    edges = [(o, x, y), (o + z, y, x), (o, y, z), (o + x, z, y), (o, z, x), (o + y, x, z)]
    return [Plane(*edge) for edge in edges]


def test_beside_a_lamp_as_large_as_a_wall_the_target_is_met():
    """One of its points a hand's breadth away counted for all of it there, however many there were."""
    a, corners = 3.0, [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    walls = [Plane((-a, -a, -a), (6, 0, 0), (0, 6, 0))]
    walls += [
        Plane((a * x, a * y, -a), (a * (z - x), a * (w - y), 0), (0, 0, 6))
        for (x, y), (z, w) in pairwise([*corners, corners[0]])
    ]
    surfaces = [Surface(wall, 0.5, side=side) for wall in walls for side in ("front", "back")]
    surfaces += [Surface(Plane((-a, -a, a), (0, 6, 0), (6, 0, 0)), 0.5, 1.0), Surface(Sphere.at((0, 0, 0), 1), 0.8)]
    scene = Scene(surfaces)
    solution, exact = finish(ray_steps(scene, 0.01, None, "asked for")), solve(scene, 0.002)
    assert solution.error <= 0.01
    rng = np.random.default_rng(3)
    surface = rng.choice(len(scene), 2000, p=scene.areas / scene.areas.sum())
    points = spread_points(scene, surface, rng)
    found, known = (scene.reflectance[surface] * s.incident(surface, points) for s in (solution, exact))
    assert np.linalg.norm(found - known) <= solution.error * np.linalg.norm(known)
