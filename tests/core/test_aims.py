"""Lamps that light nothing, and that light only what is right in front of them, over sizes and turns."""

import numpy as np
import pytest
from rooms import cube_planes

from pdm_core import AreaLight, Mesh, PointLight, Polygon, Scene, Sphere, SpotLight, SunLight, Surface, solve
from pdm_core.aims import aims

UP, DOWN = np.array([0.0, 0, 1]), np.array([0.0, 0, -1])
TURNS = [(size, seed) for seed, size in enumerate((1e-3, 1.0, 1e3))]


@pytest.fixture(params=TURNS, ids=lambda p: f"{p[0]:g}")
def place(request):
    """Function of points (n, 3): moved, turned and scaled, all together."""
    size, seed = request.param
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = rng.normal(size=3)
    return lambda points, way=1.0: size * (np.asarray(points, float) @ turn.T + way * shift)


def floor(place, half=4.0):
    shape = Polygon(place([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]))
    return [Surface(shape, 0.5, name="floor"), Surface(shape, 0.5, side="back", name="below")]


def area(place, at, way, size=1.0, spread=np.pi):
    u, v = place(np.diag([size, np.sign(way) * size, 0])[:2], 0.0)
    return AreaLight(place([at])[0], u, v, 10.0, spread=spread)


def spot(place, at, way, angle):
    return SpotLight(place([at])[0], place([way], 0.0)[0], 10.0, angle)


def kinds(found):
    return [(aim.light, aim.surface >= 0) for aim in found]


def test_lamps_over_a_floor(place):
    """Up: at nothing. Down, sideways over the edge, all around: at something. Right above the floor: shut in."""
    lamps = [
        area(place, (0, 0, 2), 1), area(place, (0, 0, 2), -1), area(place, (0, 0, 2), 1, spread=0.5),
        spot(place, (0, 0, 2), UP, 1.0), spot(place, (0, 0, 2), (1, 0, -0.3), 0.5), spot(place, (0, 0, 2), UP, np.pi),
        spot(place, (0, 0, 2), (1, 0, 0.3), 0.5), PointLight(place([(0, 0, 2)])[0], 10.0),
        SunLight(place([UP], 0.0)[0], 1.0), area(place, (0, 0, 0.02), -1), area(place, (0, 0, 0.02), 1),
    ]  # fmt: skip
    found = aims(Scene(floor(place), lights=lamps))
    assert kinds(found) == [(0, False), (2, False), (3, False), (5, False), (6, False), (9, True), (10, False)]
    near = found[5]
    size = np.linalg.norm(place([UP], 0.0))
    assert near.surface == 0 and 0.02 * size < near.distance < 0.1 * size


def test_small_and_far_things_are_lit(place):
    """A ball that no ray happens to meet is no reason to say that nothing is lit; behind the lamp it is."""
    ball = Surface(Sphere.at(place([(0, 0, -30)])[0], np.linalg.norm(place([UP], 0.0)) * 0.5), 0.5)
    lamps = [area(place, (0, 0, 0), -1), spot(place, (0, 0, 0), DOWN, 2.0), area(place, (0, 0, 0), 1)]
    assert kinds(aims(Scene([ball], lights=lamps))) == [(2, False)]


@pytest.mark.parametrize("height", [1e5, 1e7])
def test_a_point_light_straight_above_lights_what_is_tiny_from_there(height):
    """That all around is not quite all was taken for a cone that looks up: bakes were refused, nothing is lit."""
    ground = floor(lambda points: np.asarray(points, float))
    scene = Scene(ground, lights=[PointLight((0, 0, height), height**2)])
    assert aims(scene) == []
    assert solve(scene).radiance(0, (0, 0, 0)) == pytest.approx(0.5 / (4 * np.pi**2), rel=1e-3)


def test_a_lamp_within_a_bulb_is_shut_in(place):
    """In a ball, or a mesh, far smaller than the room, and not in the room itself."""
    corners = place(0.1 * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1.0)]))
    faces = [
        (a, b, c) if s > 0 else (b, a, c) for a, b, s in ((0, 2, 1), (2, 1, 1), (1, 3, 1), (3, 0, 1)) for c in (4,)
    ]
    faces += [(b, a, 5) for a, b in ((0, 2), (2, 1), (1, 3), (3, 0))]
    bulb = Mesh(corners, np.array(faces), smooth=False)
    room = [Surface(Polygon(place(p.outline)), 0.5) for p in cube_planes()]
    sides = [Surface(bulb, 0.5, name="bulb"), Surface(bulb, 0.5, side="back", name="bulb (inside)")]
    lamps = [PointLight(place([at])[0], 10.0) for at in ((0, 0, 0), (0, 0, 1))]
    found = aims(Scene([*room, *sides], lights=lamps))
    assert kinds(found) == [(0, True)] and found[0].surface == len(room) + 1
    assert kinds(aims(Scene(room, lights=lamps))) == []


def test_a_lamp_on_the_ceiling_is_not_shut_in(place):
    """Flush with what it is mounted on, a little below it, and turned to the ceiling by mistake."""
    room = [Surface(Polygon(place(p.outline)), 0.5) for p in cube_planes()]
    lamps = [area(place, (0, 0, 3), -1), area(place, (0, 0, 2.999), -1), area(place, (0, 0, 2.95), 1)]
    assert kinds(aims(Scene(room, lights=lamps))) == [(2, True)]
