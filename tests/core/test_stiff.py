"""Where light is caught, errors are amplified: the stated error has to know it."""

from dataclasses import replace

import numpy as np
import pytest

from pdm_core import Plane, Scene, Sphere, Surface, solve


def gap(width, reflectance, both=False):
    """Two white planes under a white sky, each emitting what makes all light 1."""
    planes = [Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), Plane((0, 0, width), (0, 1, 0), (1, 0, 0))]
    sides = ("front", "back") if both else ("front",)
    return Scene([Surface(p, reflectance, 1 - reflectance, side) for p in planes for side in sides], np.ones(3))


@pytest.mark.parametrize("target", [0.04, 0.01])
@pytest.mark.parametrize(
    "width, reflectance, both",
    [(0.01, 0.9, False), (0.01, 0.99, False), (0.01, 0.999, False), (0.01, 0.999, True), (0.1, 0.99, False)],
)
def test_the_stated_error_between_white_planes_is_true(width, reflectance, both, target):
    scene = gap(width, reflectance, both)
    solution, rng = solve(scene, target), np.random.default_rng(0)
    wrong = []
    for k, surface in enumerate(scene.surfaces):
        s, t = rng.random((2, 400, 1))
        shape = surface.shape
        wrong.append(solution.radiance(k, shape.origin + s * shape.u + t * shape.v) - 1)
    measured = np.sqrt(np.mean(np.square(wrong))) / reflectance
    assert measured <= solution.error <= target


def lit_room(lamp, wall=0.0):
    shapes = [
        Plane((0, 0, 0), (4, 0, 0), (0, 4, 0)),
        Plane((0, 0, 3), (0, 4, 0), (4, 0, 0)),
        Plane((0, 0, 0), (0, 4, 0), (0, 0, 3)),
        Plane((4, 0, 0), (0, 0, 3), (0, 4, 0)),
        Plane((0, 0, 0), (0, 0, 3), (4, 0, 0)),
        Plane((0, 4, 0), (4, 0, 0), (0, 0, 3)),
        Plane((1.5, 1.5, 2.9), (0, 1, 0), (1, 0, 0)),
    ]
    surfaces = [Surface(p, 0.7, wall * (k == 2)) for k, p in enumerate(shapes[:6])]
    return Scene([*surfaces, Surface(shapes[6], 0, lamp), Surface(shapes[6], 0, lamp, side="back")])


def relit(scene, lamp, wall=0.0):
    """The scene's shapes with the light of lit_room."""
    lights = lit_room(lamp, wall).surfaces
    return Scene([replace(s, emission=light.emission) for s, light in zip(scene.surfaces, lights, strict=True)])


@pytest.mark.parametrize("before, lamp, wall", [(10, 1e-11, 0), (10, 0, 0), (10, 0, 1), (10, 10, 1), (1e-11, 10, 0)])
def test_relighting_is_right_and_states_it(before, lamp, wall):
    """To as good as nothing, to black, to a wall that begins to shine, from next to nothing."""
    scene = lit_room(before)
    solution = solve(scene).relight(relit(scene, lamp, wall))
    points = np.random.default_rng(0).random((200, 3)) * [4, 4, 3]
    found = np.array([solution.radiance(k, points) for k in (0, 1, 3)])
    if not lamp and not wall:
        assert (found == 0).all() and solution.error == 0
        return
    right = solve(relit(scene, lamp, wall), 2e-3)
    right = np.array([right.radiance(k, points) for k in (0, 1, 3)])
    measured = np.linalg.norm(found - right) / np.linalg.norm(right)
    assert measured < solution.error + 4e-3 < 0.05


def test_a_lamp_alone_has_no_error():
    lamp = Plane((0, 0, 0), (1, 0, 0), (0, 1, 0))
    solution = solve(Scene([Surface(lamp, 0, 10), Surface(lamp, 0, 10, side="back")]))
    assert solution.error == 0 and solution.warnings == []
    assert (solution.radiance(0, [(0.5, 0.5, 0)]) == 10).all()
    assert solve(Scene([Surface(Sphere.at((0, 0, 0), 1), 0, 1)])).error == 0
