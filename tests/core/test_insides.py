"""A sphere's two sides: who is inside sees the inner one, who is outside the outer one, on every path."""

import numpy as np
import pytest
from rooms import transport_of

from pdm_core import Plane, Scene, Sphere, Surface, form_factors, solve
from pdm_core.contour import polygon_unoccluded

SKY = (1.0, 1.0, 1.0)


def square(middle, size, side="front", reflectance=0.5, emission=0.0):
    corner = np.asarray(middle, float) - [size / 2, size / 2, 0]
    return Surface(Plane(corner, (size, 0, 0), (0, size, 0)), reflectance, emission, side)


def uv_sphere(radius, segments=32, rings=16):
    """Vertices (n, 3) of Blender's UV sphere about the origin."""
    polar, turn = np.meshgrid(np.arange(1, rings) * np.pi / rings, np.arange(segments) * 2 * np.pi / segments)
    ring = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    return radius * np.concatenate([ring.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])


@pytest.mark.parametrize("reflectance", (0.2, 0.5))
@pytest.mark.parametrize("radius, sunk", ((0.5, 0.1), (0.5, 1e-4), (2.0, 0.3)))
def test_top_of_a_sunk_ball_sees_the_sky_alone(radius, sunk, reflectance):
    ball, top = Sphere.at((0, 0, radius - sunk), radius), (0, 0, 2 * radius - sunk)
    sides = [Surface(ball, reflectance), Surface(ball, reflectance, side="back")]
    solution = solve(Scene([*sides, square((0, 0, 0), 12 * radius, reflectance=reflectance)], SKY))
    assert solution.radiance(0, [top])[0] == pytest.approx([reflectance] * 3, rel=0.01)


@pytest.mark.parametrize("height", (0.0, 1e-9))
def test_ball_whose_centre_lies_in_a_plane(height):
    plane, lamp = square((0, 0, 0), 2), square((0, 0, 2), 1, "back", 0, 10)
    ball = Sphere.at((0, 0, height), 0.5)
    solution = solve(Scene([plane, Surface(plane.shape, 0.5, side="back"), Surface(ball, 0.5), lamp]))
    beside, inside = solution.radiance(0, [(0.8, 0.1, 0), (0.1, 0.2, 0)])
    assert (beside > 0.2).all() and np.allclose(inside, 0, atol=1e-3)
    top, bottom = solution.radiance(2, [(0, 0, 0.5), (0, 0, -0.5)])
    assert (top > 0.5).all() and np.allclose(bottom, 0, atol=1e-3)


@pytest.mark.parametrize("two_sided", (False, True))
def test_shelf_in_the_plane_of_a_balls_centre(two_sided):
    shelf, ball = square((1.6, 0, 0), 2), Sphere.at((0, 0, 0), 0.5)
    surfaces = [Surface(ball, 0.5), shelf, Surface(shelf.shape, 0.5, side="back")]
    surfaces += [Surface(ball, 0.5, side="back")] * two_sided
    solution = solve(Scene(surfaces, SKY))
    assert solution.radiance(0, uv_sphere(0.5)).mean() == pytest.approx(0.494, rel=0.02)  # Cycles, 256 samples
    others = [square((0, 0, 2), 1, "back", 0, 10), square((0, 0, -1), 6)]
    lit, bare = (solve(Scene(s)).radiance(0, uv_sphere(0.5)) for s in (surfaces + others, surfaces[:1] + others))
    assert lit.mean() == pytest.approx(bare.mean(), rel=0.02)  # seen edge-on by lamp and floor, it adds little


@pytest.mark.parametrize("centre, radius", (((0, 0, 0), 2.0), ((0.3, -0.2, 0.1), 1.5), ((0, 0, 0.25), 40.0)))
def test_a_black_dome_takes_nothing_away(centre, radius):
    planes = [square((0, 0, 0), 1, "front", 0.8, 1), square((0, 0, 0.5), 1, "back", 0.8)]
    dome = Surface(Sphere.at(centre, radius), side="back")
    points = [(0, 0, 0), (0.3, 0.2, 0)]
    with_dome, without = (solve(Scene(s)).radiance(0, points) for s in ([*planes, dome], planes))
    assert with_dome == pytest.approx(without, rel=0.01)


@pytest.mark.parametrize("radius", (1e-3, 1.0, 1e3))
def test_a_balls_outside_does_not_see_its_inside(radius):
    ball = Sphere.at((0, 0, 0), radius)
    solution = solve(Scene([Surface(ball, 0.5), Surface(ball, 0, 1, "back")]))
    assert (solution.radiance(0, [(0, 0, radius), (radius, 0, 0)]) == 0).all()


def test_points_in_a_closed_ball_without_an_inner_side_are_dark():
    ball = Surface(Sphere.at((0, 0, 1), 0.5), 0.5, 1.0)
    solution = solve(Scene([ball, square((0, 0, 0), 4)], SKY))
    assert (solution.irradiance([(0, 0, 1), (0.2, 0.1, 0.8)], [(0, 0, 1), (1, 0, 0)]) == 0).all()


@pytest.mark.parametrize("radius", (1e-2, 0.5, 30.0))
@pytest.mark.parametrize("two_sided", (False, True))
def test_the_point_a_ball_rests_on_is_dark(radius, two_sided):
    ball, floor = Sphere.at((0, 0, radius), radius), square((0, 0, 0), 12 * radius)
    surfaces = [Surface(ball, 0.5), floor, Surface(floor.shape, 0.5, side="back")]
    surfaces += [Surface(ball, 0.5, side="back")] * two_sided
    solution = solve(Scene(surfaces, SKY))
    assert max(solution.radiance(k, [(0, 0, 0)]).max() for k in (0, 1)) < 0.02
    assert solution.radiance(0, [(0, 0, 2 * radius)])[0] == pytest.approx([0.5] * 3, rel=0.01)


def test_form_factors_of_a_balls_two_sides():
    ball = Sphere.at((0, 0, 0), 1)
    result = form_factors(Scene([Surface(ball, 0.5), Surface(ball, 0, 1, "back")]))
    assert result.F == pytest.approx(np.diag([0.0, 1.0]), abs=1e-12)
    assert result.background == pytest.approx([1, 0], abs=1e-12)


def test_what_sends_light_to_black_surfaces_alone_needs_no_rows():
    """A ceiling whose light falls on a black floor; a floor under a small black lamp."""
    ceiling, lamp = square((0, 0, 3), 4, "back", 0.7), square((0, 0, 2.9), 1, "front", 0, 10)
    solution = solve(Scene([ceiling, lamp, square((0, 0, 0), 4, reflectance=0)]), 5e-3)
    assert solution.error <= 5e-3
    solution = solve(Scene([square((0, 0, 0), 10), Surface(Sphere.at((0.3, 0.2, 0.02), 0.01), 0, 1)]), 0.05)
    right = 0.5 * 0.01**2 * 0.02 / (1 + 0.02**2) ** 1.5
    assert solution.radiance(0, [(1.3, 0.2, 0)])[0] == pytest.approx([right] * 3, rel=1e-6)


def crossed(kind, turn):
    """Surfaces, and the balls among them whose insides no light reaches: they cross each other, or a floor."""
    lamp = Plane(turn @ [-0.5, -0.5, 3], turn @ [0, 1, 0], turn @ [1, 0, 0])
    floor = Plane(turn @ [-2, -2, -0.3], turn @ [4, 0, 0], turn @ [0, 4, 0])
    balls = {
        "a plane": [Sphere.at(turn @ [0.1, 0.2, 0.0], 0.5)],
        "a plane at its edge": [Sphere.at(turn @ [2.0, 0.2, -0.1], 0.5)],
        "a plane through the middle": [Sphere.at(turn @ [0.0, 0.2, -0.3], 0.5)],
        "each other": [Sphere.at(turn @ [-0.2, 0.0, 0.6], 0.7), Sphere.at(turn @ [0.5, 0.2, 0.5], 0.5)],
    }[kind]
    surfaces = [Surface(shape, 0.5, side=side) for shape in [*balls, floor] for side in ("front", "back")]
    return [*surfaces, Surface(lamp, 0.0, 10.0)], balls


@pytest.mark.parametrize("kind", ["a plane", "a plane at its edge", "a plane through the middle", "each other"])
def test_no_light_comes_into_balls_that_are_crossed(kind):
    rng = np.random.default_rng(len(kind))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn[0] *= np.linalg.det(turn)
    surfaces, balls = crossed(kind, turn)
    solution = solve(Scene(surfaces, 0.3), 0.04)
    assert solution.error <= 0.04
    for k, surface in enumerate(surfaces[:-1]):
        points = surface.shape.project(surface.shape.bounds[0] + rng.normal(size=(2000, 3)))
        within = [np.linalg.norm(b.local(points), axis=1) < 1 - 1e-6 for b in balls if b is not surface.shape]
        dark = np.any([np.zeros(len(points), bool), *within], axis=0) | surface.is_inside
        assert not dark.any() or np.sqrt((solution.radiance(k, points[dark]) ** 2).mean()) < 0.02 * 0.3
        assert solution.radiance(k, points).max() < 3


def test_a_lamp_that_crosses_a_ball_lights_its_inside():
    ball, lamp = Sphere.at((0, 0, 0), 1), Plane((-0.2, -0.2, 0.5), (0, 0.4, 0), (2.0, 0, 0))
    scene = Scene([Surface(ball), Surface(ball, side="back"), Surface(lamp, 0, 1.0), Surface(lamp, side="back")])
    transport = transport_of(scene)
    points = transport.field.inset(1, np.array([[0, 0, -1.0], [0.6, 0, -0.8]]))
    found = transport.factors.matrix(points, scene.surfaces[1].normals(points), np.ones(2, int), [2], False)[:, 0]
    end = np.sqrt(1 - 0.25)  # of the lamp within, but for the bend of the ball over its narrow width
    within = Plane(lamp.origin, lamp.u, [0.2 + end, 0, 0])
    expected = polygon_unoccluded(points, -points, np.array([within.corners] * 2))
    np.testing.assert_allclose(found, expected, rtol=0.02)
