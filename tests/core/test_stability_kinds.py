"""Stiff, extreme and everyday kinds at random sizes, places and rotations: right to what is stated, or refused."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from fuzz import TARGET, scene  # noqa: E402
from judge import judge  # noqa: E402
from kinds import KINDS, Place, box_on_floor, boxes_side_by_side, furnace, gap, slit, stiff_room  # noqa: E402
from variants import VARIANTS, knows, solve_by_links  # noqa: E402

SLOW = {"ball_over_cube", "maze"}  # seconds each: left to `make stability`
SEEDS = 2


@pytest.mark.parametrize("kind", [k for k in KINDS if k.__name__ not in SLOW], ids=lambda k: k.__name__)
@pytest.mark.parametrize("seed", range(SEEDS))
def test_right_to_what_is_stated_or_refused(kind, seed):
    verdict = judge(kind, seed)
    assert verdict.holds, verdict


@pytest.mark.parametrize("number", [k for k in range(len(KINDS)) if KINDS[k].__name__ not in SLOW])
def test_by_rays_too(number):
    """As they are, of polygons, of meshes, all planes as one mesh, in turns; `make stability` takes every one."""
    kind, variant = KINDS[number], VARIANTS[number % len(VARIANTS)]
    if not knows(variant, kind):
        variant = VARIANTS[0]
    verdict = judge(kind, 0, limit=None, variant=variant)  # however slow the machine is
    assert verdict.holds and not verdict.refused, verdict


@pytest.mark.parametrize("seed", [2008, 2051, 500025])
def test_light_that_rows_make_from_nothing_is_stated(seed):
    """Of the fuzz's scenes: balls and planes run through each other. Factors at the crossing do not sum to 1, and white
    walls amplify that: .29 was measured where .05 was stated. They are read off by such factors too: .045 for .028."""
    verdict = judge(scene, seed, target=TARGET, limit=None, solver=solve_by_links)
    assert verdict.holds and not verdict.refused, verdict


@pytest.mark.parametrize("seed", [9700077, 9700147])
def test_what_the_solver_left_is_stated(seed):
    """Of the fuzz's scenes: in balls that nothing looks into, at reflectances of .9, what it left comes back more often
    than in the rest, so that .28 % was stated for .39."""
    verdict = judge(scene, seed, target=TARGET, limit=None, solver=solve_by_links)
    assert verdict.holds and not verdict.refused, verdict


@pytest.mark.parametrize("seed", [70032, 1000167, 1000271, 7001054, 7001206, 8000146])
def test_shining_balls_that_are_partly_within_others_by_rays(seed):
    """Of the fuzz's scenes, between white walls: the same two points of a ball told all nodes how much of it is seen,
    so that it gave too little to all: 2.9 % was measured where 1.3 was stated. What of a plane's points is within a
    white ball, one or two of twelve, is passed on as one error of all who see it: 3.7 % for 1.4."""
    verdict = judge(scene, seed, target=TARGET, limit=None, variant=VARIANTS[seed % len(VARIANTS)])
    assert verdict.holds and not verdict.refused, verdict


@pytest.mark.parametrize("seed", [9300155, 9300630, 9301481, 9301932, 9301954, 9302584, 8000070])
def test_what_few_rays_meet_is_met_by_chance(seed):
    """Of the fuzz's scenes, by rays: all that is off is how much of a lamp's dimmer face rays meet next to it. Half of
    them differ from all as two draws do, not as halves of even directions: 1.1 to 1.6 times what was stated."""
    verdict = judge(scene, seed, target=TARGET, limit=None, variant=VARIANTS[seed % len(VARIANTS)])
    assert verdict.holds and verdict.stated < 3 * verdict.measured, verdict


SEEDS_OF_WHITE_WALLS = [
    (s, VARIANTS[s % len(VARIANTS)]) for s in (9300301, 9301302, 9302676, 9302801, 9000186, 9000229)
]


@pytest.mark.parametrize(("seed", "variant"), [(9710167, VARIANTS[0]), *SEEDS_OF_WHITE_WALLS])
def test_errors_of_one_sign_between_white_walls_by_rays(seed, variant):
    """Of the fuzz's scenes: nodes share their directions, and what these are off by in the mean, which white balls
    amplify, may by chance all but cancel in one way of halving them: 1.2 % was stated for 2.9, .4 for .46."""
    verdict = judge(scene, seed, target=TARGET, limit=None, variant=variant)
    assert verdict.holds and not verdict.refused, verdict


@pytest.mark.parametrize("seed", [9950002, 9900074])
def test_what_a_few_points_of_a_lamp_agree_about_and_are_wrong(seed):
    """Of the fuzz's scenes, by rays: within a shining mesh nobody sees more than a few of its points, and these see all
    of it or nothing: 1.04 and 1.3 times what was stated."""
    verdict = judge(scene, seed, target=TARGET, limit=None, variant=VARIANTS[seed % len(VARIANTS)])
    assert verdict.holds and verdict.stated < 3 * verdict.measured, verdict


@pytest.mark.parametrize("kind", [slit, boxes_side_by_side, gap, stiff_room], ids=lambda k: k.__name__)
@pytest.mark.parametrize("seed", [101, 102])
def test_not_much_more_is_stated_than_is_wrong(kind, seed):
    """80 times as much was, and 5 % where all but nothing is: the worst that a solver may have left, bends of the
    lamps' light that others cancel, and what lies between boxes in contact."""
    verdict = judge(kind, seed, solver=solve_by_links)
    assert verdict.holds and verdict.stated <= 10 * max(verdict.measured, 1e-4), verdict


def test_not_much_more_is_stated_by_rays_either():
    """Between white planes the worst that a solver may have left is 37 times what it has."""

    def narrow(rng):
        place = Place(rng)
        planes = [place.plane((0, 0, 0), [1, 0, 0], [0, 1, 0]), place.plane((0, 0, 0.01), [0, 1, 0], [1, 0, 0])]
        return "", furnace(planes, 0.999), "furnace"

    verdict = judge(narrow, 0, target=0.08, variant=VARIANTS[0])
    assert verdict.measured <= verdict.stated <= 10 * max(verdict.measured, 1e-3), verdict


@pytest.mark.parametrize("seed", [101, 103])
def test_a_floor_sees_nothing_of_what_lies_against_it(seed):
    """A box of two-sided planes stands on it: far from it the floor took up to 1.2 % too much light of its base."""
    verdict = judge(box_on_floor, seed)
    assert verdict.measured < 1e-4, verdict


def test_what_is_too_far_away_for_its_coordinates_is_refused_by_name():
    def lost(rng):
        return "", furnace(Place(rng, 1e17).box((0, 0, 0), (1, 1, 1)), 0.5), "furnace"

    verdict = judge(lost, 0)
    assert verdict.refused and "'shape " in verdict.said and "nearer to the origin" in verdict.said


def test_the_judge_finds_a_wrong_answer(monkeypatch):
    """A check that cannot fail is none: light that is a tenth too bright is found out, by furnace and by tracer."""
    from pdm_core.radiosity import Solution

    right = Solution.incident_steps

    def brighter(self, *where):
        return 1.1 * (yield from right(self, *where))

    monkeypatch.setattr(Solution, "incident_steps", brighter)
    for name in ("gap", "ball_over_plane"):
        assert not judge(next(k for k in KINDS if k.__name__ == name), 0).holds
