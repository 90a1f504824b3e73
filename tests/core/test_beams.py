"""Beams narrower than any cell: all that they carry is reflected, in enclosures whose light is known."""

import numpy as np
import pytest
from test_rays import ball_mesh, box, by_rays

from pdm_core import AreaLight, Mesh, Plane, Scene, Sphere, SpotLight, Surface

RADIUS, RHO, TARGET = 2.0, 0.5, 0.04
TOWARDS = np.array([0.3, 0.4, -1.0])


def watts(degrees):
    """What a spot of 1 W sends into its cone, where it does not fade."""
    return (1 - np.cos(np.radians(degrees) / 2)) / 2


def in_ball(light, rho=RHO, shape=None):
    return Scene([Surface(shape or Sphere.at((0, 0, 0), RADIUS), rho, side="back")], lights=[light])


def unlit(light, count=200):
    """Points of the ball that the light itself does not come to."""
    points = RADIUS * ball_mesh(3)[0]
    return points[light.unoccluded(points, -points / RADIUS) == 0][:count]


def reflected(light, sent, rho=RHO):
    """Irradiance / pi that comes back from all over a ball of which nothing is hidden: the same everywhere."""
    return np.asarray(light.colour) * sent * rho / (1 - np.asarray(rho)) / (4 * np.pi**2 * RADIUS**2)


@pytest.mark.parametrize(
    "degrees, place, radius", [(0.5, (0, 0, 0), 0), (2, (0, 0, 0), 1e-3), (2, (0.3, 0.2, 0.5), 0), (8, (1, 0, 0), 1e-3)]
)
def test_a_spot_in_a_ball(degrees, place, radius):
    light = SpotLight(place, TOWARDS, (100.0, 50.0, 10.0), np.radians(degrees), radius=radius)
    solution = by_rays(in_ball(light), TARGET)
    found = solution.incident(0, unlit(light))
    assert solution.warnings == []
    assert np.abs(found / reflected(light, watts(degrees)) - 1).max() < 0.01


def test_an_area_with_a_narrow_spread_in_a_ball():
    light = AreaLight((0.1, 0, 0), (0.05, 0, 0), (0, 0.05, 0), 100.0, spread=np.radians(2))
    found = by_rays(in_ball(light), TARGET).incident(0, unlit(light))
    assert np.abs(found / reflected(light, 1.0) - 1).max() < 0.01


def test_a_beam_meets_a_mesh():
    points, faces = ball_mesh(4, RADIUS)
    light = SpotLight((0.3, 0.2, 0.5), TOWARDS, 100.0, np.radians(2))
    scene = in_ball(light, shape=Mesh(points, faces))
    found = by_rays(scene, TARGET).incident(0, unlit(light))
    assert np.abs(found / reflected(light, watts(2)) - 1).mean() < 0.02  # the mesh is a little smaller than the ball


@pytest.mark.parametrize("degrees, count, told_by_nodes", [(3, 33, False), (25, 99, True)])
def test_many_beams_in_a_ball(degrees, count, told_by_nodes):
    """What they light is made sources of their own only where nodes do not tell of it."""
    rng = np.random.default_rng(3)
    lights = [SpotLight(rng.uniform(-0.2, 0.2, 3), rng.normal(size=3), 10.0, np.radians(degrees)) for _ in range(count)]
    surface = Surface(Sphere.at((0, 0, 0), RADIUS), RHO, side="back")
    solution, points = by_rays(Scene([surface], lights=lights), TARGET), RADIUS * ball_mesh(3)[0]
    assert (len(solution._state.lit.sources) == len(lights)) == told_by_nodes
    direct = np.sum([10.0 * light.unoccluded(points, -points / RADIUS) for light in lights], axis=0)
    received, known = solution.incident(0, points)[:, 0], reflected(lights[0], watts(degrees))[0] * len(lights)
    off = received - direct - known
    assert abs(off.mean() / known) < 0.01
    assert np.linalg.norm(off) < solution.error * np.linalg.norm(received)


def test_a_card_takes_half_of_a_beam():
    light = SpotLight((0, 0, 0), (0, 0, -1), 100.0, np.radians(2))
    card = Plane((0, -0.01, -0.1), (0.01, 0, 0), (0, 0.02, 0))  # too small to take of what comes back
    sides = [Surface(card, side=side, name="Card") for side in ("front", "back")]
    scene = Scene([*in_ball(light).surfaces, *sides], lights=[light])
    found = by_rays(scene, TARGET).incident(0, unlit(light))
    assert np.abs(found / reflected(light, watts(2) / 2) - 1).mean() < 0.02


@pytest.mark.parametrize("degrees", [2, 6])
def test_a_white_floor_reflects_all_of_a_spot(degrees):
    """Into a black room: the light of a small disc, right to its size."""
    light = SpotLight((0.4, -0.3, 2.2), (0.1, 0.2, -1), 100.0, np.radians(degrees))
    walls = box((-3, -3, 0), (3, 3, 3), 0.0, inward=True)
    floor = next(k for k, s in enumerate(walls) if abs(s.shape.normal[2]) > 0.5 and s.shape.corners[:, 2].max() == 0)
    walls[floor] = Surface(walls[floor].shape, 0.9, name="floor")
    solution = by_rays(Scene(walls, lights=[light]), TARGET)
    spot = light.position + light.direction * (2.2 / -light.direction[2])
    for k, wall in enumerate(walls):
        if k == floor:
            continue
        points = wall.shape.spread(50)
        d = spot - points
        distance = np.linalg.norm(d, axis=1)
        cosine, leaving = np.einsum("ij,ij->i", d, wall.normals(points)) / distance, -d[:, 2] / distance
        known = 0.9 * 100 * watts(degrees) / np.pi**2 * cosine * leaving / distance**2
        found = solution.incident(k, points)[:, 0]
        assert np.abs(found - known).max() < 0.03 * known.max()


@pytest.mark.parametrize("degrees", [2, 6])
def test_a_grey_room_swallows_all_of_a_spot(degrees):
    light = SpotLight((0.4, -0.3, 2.2), (0.1, 0.2, -1), 100.0, np.radians(degrees))
    walls = box((-3, -3, 0), (3, 3, 3), RHO, inward=True)
    solution, swallowed = by_rays(Scene(walls, lights=[light]), TARGET), 0.0
    for k, wall in enumerate(walls):
        points = wall.shape.spread(400)
        back = solution.incident(k, points)[:, 0] - 100 * light.unoccluded(points, wall.normals(points))
        swallowed += np.pi * back.mean() * wall.shape.area * (1 - RHO)
    assert swallowed == pytest.approx(RHO * 100 * watts(degrees), rel=0.02)


def test_other_light_of_a_beam():
    light = SpotLight((0.3, 0.2, 0.5), TOWARDS, 100.0, np.radians(2))
    solution, points = by_rays(in_ball(light), TARGET), unlit(light)
    kept = solution.kept(np.zeros(len(points), int), points)
    rho = np.array([0.2, 0.5, 0.8])
    other = SpotLight(light.position, TOWARDS, (10.0, 20.0, 30.0), light.angle)
    scene = Scene([Surface(solution.scene.shapes[0], rho, side="back")], lights=[other])
    known = reflected(other, watts(2), rho)
    assert np.abs(solution.relight(scene).incident(0, points) / known - 1).max() < 0.01
    straight, back = kept.parts(scene)
    assert np.abs(straight).max() < 1e-5 * known.max() and np.abs(back / known - 1).max() < 0.01


def test_what_varies_under_a_beam():
    """Dark on one half of the spot, bright on the other."""
    light = SpotLight((0, 0, 0), (0, 0, -1), 100.0, np.radians(2))
    rho = np.array([0.2, 0.6])
    scene = in_ball(light, lambda p: np.repeat(np.where(p[:, :1] > 0, rho[0], rho[1]), 3, axis=1))
    found = by_rays(scene, TARGET).incident(0, unlit(light))
    # the halves of the ball reflect their mean of what is the same everywhere
    known = 100 * watts(2) * rho.mean() / (1 - rho.mean()) / (4 * np.pi**2 * RADIUS**2)
    assert np.abs(found / known - 1).max() < TARGET
