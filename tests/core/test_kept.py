"""Kept light under other light is what relighting and reading off anew give."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rooms import ball_room, mixed_room

from pdm_core import Plane, PointLight, Polygon, Scene, SceneError, Sphere, Surface, solve
from pdm_core.compare import points_over
from pdm_core.signs_of_life import finish

TARGET = 0.05


def changed(scene, paint=None, shine=1.0, watts=None, background=None):
    """Of the same shapes: surface 0 of another colour, emission and lamps times so much."""
    surfaces = [replace(s, emission=s.emission * shine) for s in scene.surfaces]
    if paint is not None:
        surfaces[0] = replace(surfaces[0], reflectance=paint)
    lamps = [PointLight(lamp.position, lamp.colour if watts is None else watts, lamp.radius) for lamp in scene.lights]
    return Scene(surfaces, scene.background if background is None else background, lights=lamps)


def off(value, truth):
    return np.linalg.norm(value - truth) / np.linalg.norm(truth)


@pytest.fixture(scope="module", params=[ball_room, mixed_room])
def solved(request):
    scene = request.param()
    solution = solve(scene, TARGET)
    surface, points = points_over(scene, 1500)
    return scene, solution, surface, points


@pytest.fixture(scope="module")
def kept(solved):
    _, solution, surface, points = solved
    return solution.kept(surface, points)


def test_the_same_light_is_what_was_solved(solved, kept):
    scene, solution, surface, points = solved
    truth = finish(solution.radiance_steps(surface, points))
    assert off(kept.radiance(scene), truth) < TARGET / 4
    assert kept.bytes > 0


@pytest.mark.parametrize(
    "other", [{"paint": (0.1, 0.3, 0.8)}, {"shine": 0.2}, {"watts": 900.0}, {"paint": 0.0, "shine": 3.0, "watts": 10.0}]
)
def test_other_light_is_that_of_relighting(solved, kept, other):
    scene, solution, surface, points = solved
    new = changed(scene, **other)
    again = solution.relight(new)
    truth = finish(again.radiance_steps(surface, points))
    assert off(kept.radiance(new), truth) < TARGET / 2
    assert off(kept.incident(new), finish(again.incident_steps(surface, points))) < TARGET / 2
    # and back: nothing of the way stays
    assert off(kept.radiance(scene), finish(solution.radiance_steps(surface, points))) < TARGET / 4


def test_parts_are_all_of_the_light(solved, kept):
    scene, solution, surface, points = solved
    direct, rest = kept.parts(scene)
    np.testing.assert_allclose(direct + rest, kept.incident(scene), rtol=1e-6)  # single precision
    assert (direct >= 0).all() and (rest > 0).mean() > 0.9
    black = Scene([replace(s, reflectance=0.0) for s in scene.surfaces], lights=scene.lights)
    alone, none = kept.parts(black)
    np.testing.assert_allclose(alone, direct, atol=1e-6 * direct.max())
    assert not none.any()


def test_off_and_on_again(solved, kept):
    scene, solution, surface, points = solved
    assert not kept.radiance(changed(scene, shine=0.0, watts=0.0)).any()
    assert off(kept.radiance(scene), finish(solution.radiance_steps(surface, points))) < TARGET / 4


def test_a_sky_of_other_strength():
    scene = changed(mixed_room(), background=0.5)
    scene = Scene(scene.surfaces[1:], scene.background, lights=scene.lights)  # without the floor
    solution = solve(scene, TARGET)
    surface, points = points_over(scene, 1000)
    kept = solution.kept(surface, points)
    for sky in (2.0, lambda directions: 1 + directions):
        new = Scene(scene.surfaces, sky, lights=scene.lights)
        if callable(sky):
            with pytest.raises(SceneError, match="varies"):
                kept.radiance(new)
            continue
        again = solution.relight(new)
        assert off(kept.radiance(new), finish(again.radiance_steps(surface, points))) < TARGET / 2
    varied = Scene(scene.surfaces, lambda directions: 1 + directions, lights=scene.lights)
    solution = solve(varied, TARGET)
    kept = solution.kept(surface, points)
    new = Scene(scene.surfaces, lambda directions: 2 - directions, lights=scene.lights)
    assert off(kept.radiance(new), finish(solution.relight(new).radiance_steps(surface, points))) < TARGET / 2


def test_what_is_not_known_is_said(solved, kept):
    scene, _, _, _ = solved
    with pytest.raises(SceneError, match="solve"):
        kept.radiance(Scene(scene.surfaces[:-1], lights=scene.lights))
    dark = [k for k, s in enumerate(scene.surfaces) if not np.any(s.emission)][0]
    surfaces = list(scene.surfaces)
    surfaces[dark] = replace(surfaces[dark], emission=5.0)
    if scene.lights:
        with pytest.raises(SceneError, match="solve again"):
            kept.radiance(Scene(surfaces, lights=scene.lights))


def test_what_stands_there_is_read_beside_as_the_solution_does():
    """A floor's points in the edge of a box are read beside it, not under it, whether their light is kept or not."""
    floor = Surface(Polygon([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (0, 2, 0), (0, 3, 0), (-2, 3, 0)]), 0.5, name="Floor")
    faces = [((0.5, -0.5, 0), (0, 1, 0), (0, 0, 1)), ((-0.5, -0.5, 0), (0, 0, 1), (0, 1, 0))]
    faces += [((-0.5, 0.5, 0), (0, 0, 1), (1, 0, 0)), ((-0.5, -0.5, 0), (1, 0, 0), (0, 0, 1))]
    box = [Surface(Plane(*face), 0.3, name="Box") for face in [*faces, ((-0.5, -0.5, 1), (1, 0, 0), (0, 1, 0))]]
    solution = solve(Scene([floor, *box], (1, 1, 1), rounding=2**-24), TARGET)
    edge = np.array([(0.5, 0.1, 0), (-0.5, 0.2, 0), (0.1, 0.5, 0)]) * (1 - 1e-6)  # rounded to under it
    kept = solution.kept(np.zeros(3, int), edge)
    assert solution.radiance(0, edge).min() > 0.15  # half of the sky is open there
    assert off(kept.radiance(solution.scene), solution.radiance(0, edge)) < 1e-5


def test_what_is_remembered_does_not_make_the_next_step_long(monkeypatch):
    surfaces = [Surface(Plane((-1, -1, 0), (2, 0, 0), (0, 2, 0)), 0.5), Surface(Sphere.at((0, 0, 1), 0.2), 0.0, 1.0)]
    solution, points = solve(Scene(surfaces), 0.1), np.random.default_rng(0).uniform((-1, -1, 0), (1, 1, 0), (4000, 3))
    monkeypatch.setattr("pdm_core.links.solution.time", SimpleNamespace(perf_counter=lambda: 0.0))  # at once, each
    done = np.array([0.0, *solution.incident_steps(np.zeros(len(points), int), points)])
    step = len(points) * np.diff(done)
    assert (step[1:] <= 2.01 * step[:-1]).all() and len(step) > 3
