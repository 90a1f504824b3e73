"""What lies in the planes of others that have two sides: in a cube as a room, whose fronts look out, and on it."""

import itertools
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import Place
from rooms import by_rays

from pdm_core import Mesh, Plane, Scene, Sphere, Surface
from pdm_core.links.approach import link_steps
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from variants import as_it_is, with_polygons  # noqa: E402

SIDES = ("front", "back")
INSIDE = np.array([(s, t, 0.0) for s in (0.2, 0.45, 0.8) for t in (0.3, 0.7)])
X, Y, Z = np.eye(3)
PLACE = Place(0.3, (10, 20, 3))  # others are tried in test_contacts.py and test_lying.py


def by_links(scene, target):
    return finish(link_steps(scene, target, None, "for the test"))


def as_objects(scene):
    """Surfaces of one name and side as those of one mesh; the surfaces of the scene keep their numbers, as its own name
    tells."""
    shapes, out = {}, {}
    for surface in scene.surfaces:
        shapes.setdefault(surface.name, {})[id(surface.shape)] = surface.shape
    for name, parts in shapes.items():
        corners = [part.corners for part in parts.values() if isinstance(part, Plane)]
        if corners:
            vertices, index = np.unique(np.round(np.concatenate(corners), 9), axis=0, return_inverse=True)
            shapes[name] = Mesh(vertices, index.reshape(-1, 4).tolist())
        else:
            (shapes[name],) = parts.values()
    for surface in scene.surfaces:
        out[surface.name, surface.side] = replace(surface, shape=shapes[surface.name])
    return Scene(list(out.values()), scene.background, scene.rounding)


# which engine, as which kinds of shapes
WAYS = {
    "links": (by_links, as_it_is),
    "rays": (by_rays, as_it_is),
    "rays, polygons": (by_rays, with_polygons),
    "rays, meshes": (by_rays, as_objects),
}


@pytest.fixture(params=WAYS, ids=list(WAYS))
def way(request):
    return WAYS[request.param]


def rectangle(corner, u, v, up, sides=SIDES, **light):
    """Surfaces of a plane whose front looks along u x v, or the other way."""
    u, v = (u, v) if up else (v, u)
    return [Surface(PLACE.plane(corner, u, v), side=side, **light) for side in sides]


def incident(solution, scene, k):
    """(6,) Irradiance / pi on surface k of the scene, whatever it has become."""
    surface = scene.surfaces[k]
    points = surface.shape.world(INSIDE)
    names = [(s.name, s.side) for s in solution.scene.surfaces]
    if len(names) == len(scene):
        return solution.incident(k, points)[:, 0]
    normals = np.broadcast_to(surface.sign * surface.shape.normal, points.shape)
    return solution.incident(names.index((surface.name, surface.side)), points, normals)[:, 0]


@pytest.mark.parametrize("carpet_up", [True, False])
@pytest.mark.parametrize("floor_up", [True, False])
def test_a_crate_on_the_edge_of_a_carpet_is_closed(floor_up, carpet_up, way):
    """Where fronts looked another way than what lay on them they were parted to both sides of each other: a crate made
    light within, by links 23 % stated, and neither time nor memory would help."""
    solve, variant = way
    light = {"reflectance": 0.6, "emission": 0.4}
    surfaces = rectangle((0, 0, 0), 4 * X, 3 * Y, floor_up, name="floor", **light)
    surfaces += rectangle((1, 1, 0), X, Y, carpet_up, name="carpet", **light)
    surfaces += PLACE.box((1.7, 1.2, 0), (2.3, 1.8, 0.5), sides=SIDES, name="crate", **light)
    scene = Scene(surfaces, 1.0, rounding=2**-24)
    solution = solve(variant(scene), 0.02)
    assert solution.error < 0.02
    for k, surface in enumerate(scene.surfaces[4:], start=4):
        value = incident(solution, scene, k)
        covered = surface.side == "front" and np.allclose(PLACE.turn.T @ surface.shape.normal, -Z)
        np.testing.assert_allclose(value, 0.0 if covered else 1.0, atol=1e-9 if covered else 0.02)


@pytest.mark.parametrize("outward", [True, False])
def test_what_is_in_a_room_is_not_under_its_floor(outward, way):
    """A cube as a room: its fronts look out. A carpet, a picture and an open box in it were outside, black without a
    word. Their light is that of the same things a little before its walls."""
    solve, variant = way

    def scene_of(off):
        surfaces = PLACE.box((0, 0, 0), (4, 3, 2.5), inward=not outward, sides=SIDES, name="room", reflectance=0.6)
        surfaces.append(Surface(Sphere.at(PLACE((2, 1.5, 2)), 0.2), 0.0, 10.0, name="lamp"))
        surfaces += rectangle((1, 1, off), X, Y, True, ("front",), name="carpet", reflectance=0.3)
        surfaces += rectangle((1, off, 1), 0.5 * Z, 0.8 * X, True, ("front",), name="picture", reflectance=0.3)
        return Scene(
            surfaces + PLACE.box((2.5, 1.2, off), (3.1, 1.8, 0.5), sides=SIDES, name="box", reflectance=0.6)[:-2]
        )

    touching, before = scene_of(0.0), scene_of(2e-3)
    one, other = (solve(variant(scene), 0.02) for scene in (touching, before))
    box = [k for k, s in enumerate(touching.surfaces) if k > 14 and s.side == "back"]
    for k in (13, 14, *box):
        value, known = incident(one, touching, k), incident(other, before, k)
        assert known.min() > 0.02
        np.testing.assert_allclose(value, known, rtol=0.1)


def test_what_is_stuck_on_a_crate_is_on_it(way):
    """As its front tells: a sheet on the outside of what has two sides, whose fronts look out."""
    solve, variant = way
    crate = PLACE.box((-0.5, -0.5, 0), (0.5, 0.5, 1), sides=SIDES, name="crate", reflectance=0.5)
    sticker = rectangle((-0.2, -0.2, 1), 0.4 * X, 0.4 * Y, True, name="sticker", reflectance=0.5)
    inner = rectangle((-0.2, -0.2, 0), 0.4 * X, 0.4 * Y, True, name="inner", reflectance=0.5)
    scene = Scene([*crate, *sticker, *inner], 1.0)
    solution = solve(variant(scene), 0.02)
    outside, against, within, below = (incident(solution, scene, k) for k in (12, 13, 14, 15))
    np.testing.assert_allclose(outside, 1.0, atol=0.02)
    for dark in (against, within, below):
        np.testing.assert_allclose(dark, 0.0, atol=1e-6)


def test_a_storey_below_is_below(way):
    """A room under the floor of another, its ceiling in that floor, smaller: behind it, as its walls tell."""
    solve, variant = way
    light = {"reflectance": 0.5, "emission": 0.5}
    surfaces = rectangle((0, 0, 0), 4 * X, 3 * Y, True, name="floor", **light)
    surfaces += PLACE.box((1, 1, -1), (2, 2, 0), sides=SIDES, name="storey", **light)
    scene = Scene(surfaces, 1.0)
    solution = solve(variant(scene), 0.02)
    for k, surface in enumerate(scene.surfaces):
        covered = k == 1 or (surface.side == "front" and np.allclose(PLACE.turn.T @ surface.shape.normal, Z) and k > 1)
        if not covered:
            np.testing.assert_allclose(incident(solution, scene, k), 1.0, atol=0.02)
        elif k > 1:
            np.testing.assert_allclose(incident(solution, scene, k), 0.0, atol=1e-6)


def crate(low, high, front_out=True, lit=0.0):
    """A body of two sides, lit from without, within by what it emits itself, if anything."""
    surfaces = PLACE.box(low, high, inward=not front_out, sides=SIDES, name="crate", reflectance=0.6, emission=0.4)
    inner = "back" if front_out else "front"
    return [replace(s, emission=lit * (1 - s.reflectance)) if s.side == inner else s for s in surfaces]


def bottom_of(scene, name, axis=-Z):
    """Numbers of the surfaces of bodies of a name that look along an axis."""
    along = [np.allclose(s.sign * (PLACE.turn.T @ s.shape.normal), axis) for s in scene.surfaces]
    return [k for k, s in enumerate(scene.surfaces) if s.name == name and along[k]]


def test_a_crate_on_tiles_is_dark(way):
    """Of tiles smaller than its bottom each was said to be a sheet in it: .1 to .25 for 0 within, and black tiles."""
    solve, variant = way
    light = {"reflectance": 0.6, "emission": 0.4}
    surfaces = [
        s
        for x, y in itertools.product(range(4), range(3))
        for s in rectangle((x, y, 0), X, Y, True, name=f"tile {x} {y}", **light)
    ]
    scene = Scene(surfaces + crate((0.5, 0.5, 0), (2.5, 2.5, 1)), 1.0)
    solution = solve(variant(scene), 0.05)
    crate_faces = [k for k, s in enumerate(scene.surfaces) if s.name == "crate"]
    under = bottom_of(scene, "crate")
    for k in crate_faces:
        if k not in under:
            right = float(scene.surfaces[k].side == "front")
            np.testing.assert_allclose(incident(solution, scene, k), right, atol=0.05 if right else 1e-6)
    middle = next(k for k, s in enumerate(scene.surfaces) if (s.name, s.side) == ("tile 1 1", "front"))
    np.testing.assert_allclose(incident(solution, scene, middle), 0.0, atol=1e-6)


@pytest.mark.parametrize("sides", [SIDES, ("front",)], ids=["two-sided", "one-sided"])
def test_a_rug_that_comes_out_from_under_a_cupboard_is_not_in_it(sides, way):
    """As the cupboard's side is larger it was said to be within, as far as it is under it: .01 to .2 for 0."""
    solve, variant = way
    light = {"reflectance": 0.6, "emission": 0.4}
    surfaces = rectangle((-1, -1, 0), 6 * X, 5 * Y, True, name="floor", **light)
    surfaces += rectangle((1.8, 0.5, 0), X, 0.7 * Y, True, sides, name="rug", **light)
    scene = Scene(surfaces + crate((0, 0, 0), (2, 2, 2)), 1.0)
    solution = solve(variant(scene), 0.05)
    for k, s in enumerate(scene.surfaces):
        if s.name == "crate" and k not in bottom_of(scene, "crate"):
            right = float(s.side == "front")
            np.testing.assert_allclose(incident(solution, scene, k), right, atol=0.05 if right else 1e-6)


@pytest.mark.parametrize("above", [True, False])
def test_a_carpet_upstairs_is_upstairs(above, way):
    """Where the lower, larger room's fronts look inwards, the carpet lay against its ceiling: black, light below."""
    solve, variant = way
    lower = crate((0, 0, 0), (3, 3, 3), front_out=False)
    upper = [replace(s, name="upper") for s in crate((0, 0, 3), (2, 3, 5), above, 1.0)]
    carpet = rectangle((0.5, 0.5, 3), X, Y, True, name="carpet", reflectance=0.6, emission=0.4)
    scene = Scene(lower + upper + carpet, 1.0)
    solution = solve(variant(scene), 0.05)
    for k, s in enumerate(scene.surfaces):
        if s.name == "crate" and s.side == "front":
            np.testing.assert_allclose(incident(solution, scene, k), 0.0, atol=1e-6)
    np.testing.assert_allclose(incident(solution, scene, len(scene) - 2), 1.0, atol=0.05)


def test_pictures_on_both_sides_of_a_wall_are_apart(way):
    """The smaller lay on the larger, through the wall between: light came through, .3 for 0, or none to it."""
    solve, variant = way
    one = crate((0, 0, 0), (3, 3, 3))
    other = [replace(s, name="other") for s in crate((3, 0, 0), (5, 3, 3), lit=1.0)]
    surfaces = one + other
    light = {"reflectance": 0.6, "sides": ("front",)}
    surfaces += rectangle((3, 0.5, 1), 1.5 * Y, Z, False, name="picture", **light)
    surfaces += rectangle((3, 1, 1.2), 1.5 * Y, 0.8 * Z, True, name="opposite", emission=0.4, **light)
    scene = Scene(surfaces, 1.0)
    solution = solve(variant(scene), 0.05)
    for k, s in enumerate(scene.surfaces):
        if s.name in ("crate", "picture") and s.side == ("back" if s.name == "crate" else "front"):
            np.testing.assert_allclose(incident(solution, scene, k), 0.0, atol=1e-6)
    np.testing.assert_allclose(incident(solution, scene, len(scene) - 1), 1.0, atol=0.05)
