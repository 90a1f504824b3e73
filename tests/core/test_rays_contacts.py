"""Rays between what touches, encloses and lies in layers: each of these was wrong without a word once."""

import sys
from pathlib import Path

import numpy as np
import pytest
from rooms import by_rays

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from kinds import Place, furnace  # noqa: E402
from variants import as_it_is, as_one_mesh, with_meshes, with_polygons  # noqa: E402

UPRIGHT = Place(np.random.default_rng(0))
UPRIGHT.turn = np.eye(3)
TURNED = Place(np.random.default_rng(1))
INSIDE = np.array([[0.3, 0.2, 0.1], [-0.2, 0.9, 0.4], [0.1, -0.3, -0.9]])


def on(surface, count=40):
    """Points of a surface, on none of its lines of symmetry."""
    shape, rng = surface.shape, np.random.default_rng(2)
    if isinstance(shape, Plane):
        return shape.world(np.column_stack([rng.random((count, 2)), np.zeros(count)]))
    return shape.spread(4 * count)[rng.choice(4 * count, count, replace=False)]


def worst(scene, solution, surfaces):
    """Greatest distance of the radiance from 1 over surfaces whose own light is 1."""
    return max(np.abs(solution.radiance(k, on(scene.surfaces[k])) - 1).max() for k in surfaces)


@pytest.mark.parametrize("axes", [(1, 1, 1), (1, 0.7, 0.3)])
def test_a_two_sided_shining_ball_lights_its_inside_once(axes):
    """Its outside shone into it as well, and so did a floor that the ball does not touch: twice the light."""
    floor = UPRIGHT.plane((-2, -2, -2), [4, 0, 0], [0, 4, 0])
    scene = furnace([Sphere(np.diag([*axes, 1.0])), floor], 0.5)
    assert worst(scene, by_rays(scene), [1]) < 0.02  # faint light is judged by a single point


def test_a_dome_is_no_lamp_for_what_is_closed_within_it():
    """No point of the dome that stood for it was ahead of the box's floor: that counted as all of it seen."""
    shapes = [UPRIGHT.ball((0, 0, 0), 80), *UPRIGHT.box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))]
    scene = with_meshes(furnace(shapes, 0.6))
    inner = [k for k, s in enumerate(scene.surfaces) if s.side == "back" and k > 1]
    assert worst(scene, by_rays(scene), inner) < 0.02


@pytest.mark.parametrize("thick", [1e-5, 1e-4, 1e-2])
def test_a_flat_pebble_on_a_floor_touches_it_in_one_point(thick):
    """What of it was so near as layers are to each other was dark, and the floor below it: all of the thinnest."""
    pebble = Sphere([[1, 0, 0, 0], [0, 0.7, 0, 0], [0, 0, thick, thick], [0, 0, 0, 1]])
    scene = furnace([pebble, UPRIGHT.plane((-3, -3, 0), [6, 0, 0], [0, 6, 0])], 0.7, 2**-24)
    solution = by_rays(scene)
    places = 0.6 * np.array([[0.0, 1.0, 0], [0.5, -0.3, 0], [-0.2, 0.1, 0]])
    for k in (0, 2):
        # of the pebble its lower half: below where its middle is
        at = places if k else pebble.world(np.column_stack([places[:, :2], -np.sqrt(1 - (places**2).sum(axis=1))]))
        assert np.abs(solution.radiance(k, at) - 1).max() < 0.02


@pytest.mark.parametrize("place, rounding", [(UPRIGHT, 2**-53), (TURNED, 2**-24)], ids=["upright", "turned"])
def test_a_shining_carpet_against_a_closed_room_leaves_it_as_it_was(place, rounding):
    """It lies a layer off the floor, its points did not: a fifth more light in the room."""
    room = place.box((0, 0, 0), (4, 4, 3))
    carpet = place.plane((0.05, 0.05, 0), [3.9, 0, 0], [0, 3.9, 0])
    scene = furnace([*room, carpet], 0.7, rounding)
    assert worst(scene, by_rays(scene), [3, 5, 7, 9, 11]) < 1e-3


def test_a_box_on_a_shining_floor_is_dark_to_it_within():
    """In double precision the floor's layer was nearer to a lamp's point than what counts as behind it."""
    shapes = [*UPRIGHT.box((0, 0, 0), (1, 1, 1)), UPRIGHT.plane((-5, -5, 0), [10, 0, 0], [0, 10, 0])]
    scene = furnace(shapes, 0.5)
    assert worst(scene, by_rays(scene), [3, 5, 7, 9, 11]) < 1e-3


@pytest.mark.parametrize("variant", [with_meshes, as_one_mesh])
def test_a_closed_room_of_meshes_keeps_its_light(variant):
    """Points that stood for a wall's light lay on its edge, within the next wall: .5 % lost at a reflectance of .92.
    One in the same place as a vertex was not a number."""
    scene = variant(furnace(TURNED.box((0, 0, 0), (1, 1.3, 0.8)), 0.92))
    solution = by_rays(scene)
    inner = [k for k, s in enumerate(scene.surfaces) if s.side == "back"]
    assert worst(scene, solution, inner) < 1e-5
    corners = scene.surfaces[inner[0]].shape.vertices
    assert np.isfinite(solution.radiance(inner[0], corners)).all()


@pytest.mark.parametrize("variant", [as_it_is, with_polygons, with_meshes], ids=lambda v: v.__name__)
@pytest.mark.parametrize("lost", [1e-3, 1e-6])
def test_white_walls_keep_what_they_emit(variant, lost):
    """Weights of rays were rounded alike at all nodes: .5 % off at 1 - 8e-6, while .03 % were stated."""
    both = variant(furnace(TURNED.box((0, 0, 0), (1, 1, 1)), 1 - lost))
    alone = Scene([s for s in both.surfaces if s.side == "back"])
    for scene in (both, alone):
        solution = by_rays(scene)
        off = worst(scene, solution, [k for k, s in enumerate(scene.surfaces) if s.side == "back"])
        assert off < min(2e-3, 1e-3 + solution.error)
        assert solution.error < 0.02  # it told 47,000 % once


def test_what_stops_between_nodes_has_lamps_that_light_something():
    """Where the time limit came while nodes were added, lamps seemed to light nothing."""
    room = [Surface(s, 0.5, side="back") for s in UPRIGHT.box((0, 0, 0), (3, 4, 2.5))]
    steps = ray_steps(Scene([*room, Surface(Sphere.at((1.5, 2, 2), 0.2), 0.0, 5.0)]), 0.001, None, "", enough)
    enough.steps = 0
    assert not any("no surface" in w for w in finish(steps).warnings)


@pytest.mark.parametrize("lit", [True, False], ids=["at work", "hidden"])
@pytest.mark.parametrize("kind", ["panel", "box"])
def test_a_lamp_of_which_a_side_lights_something_is_at_work(kind, lit):
    """A panel's back towards a ceiling, and the lid of a box, were told of."""
    room = [Surface(s, 0.5, side="back") for s in UPRIGHT.box((0, 0, 0), (3, 4, 2.5))]
    lamp = (
        UPRIGHT.box((1, 1, 2.2), (2, 2, 2.4)) if kind == "box" else [UPRIGHT.plane((1, 1, 2.4), [0, 1, 0], [1, 0, 0])]
    )
    sides = ("front",) if kind == "box" else ("front", "back")
    shining = [Surface(s, 0.0, 5.0, side, f"Lamp {k} {side}") for k, s in enumerate(lamp) for side in sides]
    cover = UPRIGHT.box((0.9, 0.9, 2.1 if not lit else 2.402), (2.1, 2.1, 2.45))  # black, over it or all about it
    shade = [Surface(s, 0.0, side=side) for s in cover for side in ("front", "back")]
    told = [w for w in by_rays(Scene([*room, *shining, *shade]), 0.3).warnings if "no surface" in w]
    assert bool(told) == (not lit)


def enough():
    """After a while of the second round."""
    enough.steps += 1
    return enough.steps > 300
