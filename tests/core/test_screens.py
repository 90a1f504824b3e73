"""Screens: surfaces that shine in many colours, against plain lamps of the same colours side by side."""

import numpy as np
import pytest
from rooms import by_rays, cube_planes

from pdm_core import Mesh, Plane, Polygon, Scene, Sphere, Surface, solve

COLOURS = np.array([(8.0, 0.5, 0.1), (0.2, 6.0, 0.3), (1.0, 1.0, 9.0), (0.0, 0.0, 0.0)])


def room(screen):
    """A closed cube of side 6 with a ball, a screen high up in it that looks down."""
    surfaces = [Surface(plane, 0.6, name=f"wall {k}") for k, plane in enumerate(cube_planes())]
    return Scene([*surfaces, Surface(Sphere.at((0.5, 0.5, -1), 0.8), 0.7), *screen])


def one_screen(size):
    """A square of four stripes; u runs along them."""
    corner, u, v = np.array([-size, size, 2.0]), np.array([2 * size, 0, 0]), np.array([0, -2 * size, 0])

    def emission(points):
        at = np.clip((points - corner) @ u / (u @ u), 0, 0.999)
        return COLOURS[(4 * at).astype(int)]

    return [Surface(Plane(corner, u, v), 0.0, emission)]


def four_lamps(size):
    step, v = np.array([size / 2, 0, 0]), np.array([0, -2 * size, 0])
    corner = np.array([-size, size, 2.0])
    return [Surface(Plane(corner + k * step, step, v), 0.0, colour) for k, colour in enumerate(COLOURS)]


@pytest.mark.parametrize("size", [0.3, 1.5])
def test_a_screen_of_stripes_lights_as_its_stripes_do(size):
    """Direct and reflected light on floor, walls and ball; the target is what both may be off by."""
    target = 0.04
    one, four = (solve(room(screen), target) for screen in (one_screen(size), four_lamps(size)))
    rng, ours, theirs = np.random.default_rng(0), [], []
    for k in range(7):
        shape = one.scene.surfaces[k].shape
        points = shape.project(rng.uniform(-2.9, 2.9, (200, 3)) if k < 6 else shape.origin + rng.normal(size=(200, 3)))
        ours.append(one.radiance(k, points))
        theirs.append(four.radiance(k, points))
    ours, theirs = np.concatenate(ours), np.concatenate(theirs)
    assert np.linalg.norm(ours - theirs) < target * np.linalg.norm(theirs)
    assert one.error <= target


def test_a_screen_close_to_a_wall_lights_what_is_before_it():
    """2 cm before it a wall gets the colour of the stripe ahead, not the mean of all."""
    solution = solve(Scene([Surface(Plane((-4, -4, 1.98), (8, 0, 0), (0, 8, 0)), 0.5), *one_screen(1.0)]), 0.04)
    at = np.array([(-0.75, 0, 1.98), (-0.25, 0, 1.98), (0.25, 0, 1.98)])
    got = solution.radiance(0, at)
    np.testing.assert_allclose(got, 0.5 * COLOURS[:3], atol=0.05 * 8)


SHAPES = {
    "plane": lambda plane: plane,
    "polygon": lambda plane: Polygon(plane.corners),
    "mesh": lambda plane: Mesh(plane.corners, [(0, 1, 2), (0, 2, 3)], False),
}


@pytest.mark.parametrize(("gap", "kind"), [(0.003, "plane"), (0.005, "polygon"), (0.02, "mesh")])
def test_colours_close_to_a_screen_are_right_to_what_is_stated(gap, kind):
    """A millimetre before it they were off by twice what was stated, as both halves of too few points were alike;
    and 49 lamps stood for it."""
    screen = Surface(SHAPES[kind](one_screen(1.0)[0].shape), 0.0, one_screen(1.0)[0].emission)
    floor = Surface(Plane((-2, -2, 2 - gap), (4, 0, 0), (0, 4, 0)), 0.5)
    solution = by_rays(Scene([floor, screen]))
    at = np.random.default_rng(5).uniform(-1.05, 1.05, (600, 2))
    points, up = np.column_stack([at, np.full(600, 2 - gap)]), np.tile([0.0, 0, 1], (600, 1))
    each = [(lamp.shape.unhidden(points, up, 1, 0.0), lamp.emission) for lamp in four_lamps(1.0)]
    known = sum(factor[:, None] * np.array(colour) for factor, colour in each)
    off = np.linalg.norm(solution.incident(np.zeros(600, int), points) - known) / np.linalg.norm(known)
    assert off < solution.error < (0.04 if gap > 0.01 else 0.1)
    assert len(solution._state.lit.sources) == 1
