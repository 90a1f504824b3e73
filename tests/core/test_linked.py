"""Lights that are for some surfaces alone, or that some alone block, against closed forms."""

import numpy as np
import pytest

from pdm_core import AreaLight, Plane, PointLight, Scene, SceneError, SpotLight, SunLight, Surface, solve

FLOOR = Plane((-2, -2, 0), (4, 0, 0), (0, 4, 0))
LID = Plane((-1, -1, 0.5), (2, 0, 0), (0, 2, 0))  # over the middle of the floor
WALL = Plane((-2, 2, 0), (4, 0, 0), (0, 0, 1))  # looks to -y
UNDER = np.array([(x, y, 0) for x in (-0.6, 0.1, 0.5) for y in (-0.5, 0.2, 0.6)])
LAMPS = [
    lambda: PointLight((0, 0, 2), 50.0),
    lambda: PointLight((0.2, 0, 2), 50.0, radius=0.2),
    lambda: SunLight((0, 0.2, -1), 3.0),
    lambda: SunLight((0, 0.2, -1), 3.0, angle=0.3),
    lambda: AreaLight((0, 0, 2), (1, 0, 0), (0, -1, 0), 50.0),
    lambda: SpotLight((0, 0, 2), (0, 0, -1), 50.0, 2.5),
]


def linked(make, receivers=None, blockers=None):
    light = make()
    light.receivers, light.blockers = receivers, blockers
    return light


def scene(light):
    surfaces = [Surface(FLOOR, 0.0), Surface(LID, 0.0), Surface(LID, 0.0, side="back"), Surface(WALL, 0.0)]
    return Scene(surfaces, lights=[light])


@pytest.mark.parametrize("make", LAMPS, ids=["point", "ball", "sun", "wide sun", "area", "spot"])
def test_what_alone_blocks(make):
    """Nothing is black under the lid where the lid does not block, all is where it does, whatever else blocks."""
    up = np.tile([0.0, 0, 1], (len(UNDER), 1))
    for blockers in ({WALL}, {FLOOR, WALL}, set()):
        light = linked(make, blockers=blockers)
        got = solve(scene(light), 0.01).incident(0, UNDER)
        expected = light.unoccluded(UNDER, up)[:, None] * light.colour
        np.testing.assert_allclose(got, expected, rtol=1e-6)
    for blockers in (None, {LID}):
        got = solve(scene(linked(make, blockers=blockers)), 0.01).incident(0, UNDER[4:5])
        assert got.max() < 1e-9 or make in (LAMPS[1], LAMPS[3])  # what is large is seen a little past the lid


@pytest.mark.parametrize("make", LAMPS, ids=["point", "ball", "sun", "wide sun", "area", "spot"])
def test_what_alone_is_lit(make):
    """The lid keeps its shadow where it is not lit itself; what is lit is as bright as ever."""
    every, some = (solve(scene(linked(make, receivers=own)), 0.01) for own in (None, {FLOOR, WALL}))
    beside = np.array([(1.5, 1.2, 0), (-1.4, 0.3, 0), *UNDER])
    np.testing.assert_allclose(some.incident(0, beside), every.incident(0, beside), rtol=1e-6, atol=1e-12)
    on_lid = UNDER + [0, 0, 0.5]
    assert every.incident(1, on_lid).min() > 0 and some.incident(1, on_lid).max() == 0


def test_reflected_light_goes_everywhere():
    """Of a room lit on its floor alone the ceiling gets what the floor reflects."""
    top = Plane((-2, 2, 3), (4, 0, 0), (0, -4, 0))
    light = linked(LAMPS[0], receivers={FLOOR})
    solution = solve(Scene([Surface(FLOOR, 0.5), Surface(top, 0.5)], lights=[light]), 0.01)
    apart = solve(Scene([Surface(FLOOR, 0.5), Surface(top, 0.5)], lights=[LAMPS[0]()]), 0.01)
    at = np.array([(0.3, 0.2, 3.0)])
    assert 0 < solution.radiance(1, at).max()
    # the lamp is below the ceiling, and would light it
    assert apart.radiance(1, at).max() > 2 * solution.radiance(1, at).max()


def test_links_are_no_colours():
    """Relighting changes no links; the same links to equal shapes of another scene are the same."""
    solution = solve(scene(linked(LAMPS[0], receivers={FLOOR})), 0.05)
    with pytest.raises(SceneError, match="solve again"):
        solution.relight(scene(linked(LAMPS[0], receivers={LID})))
    with pytest.raises(SceneError, match="solve again"):
        solution.relight(scene(LAMPS[0]()))
    brighter = linked(lambda: PointLight((0, 0, 2), 100.0), receivers={FLOOR})
    at = np.array([(1.5, 1.2, 0)])
    np.testing.assert_allclose(solution.relight(scene(brighter)).incident(0, at), 2 * solution.incident(0, at))
