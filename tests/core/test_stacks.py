"""Crates of all kinds on and beside each other: nothing comes into them nor out, whatever else lies in their planes."""

import numpy as np
import pytest
from places import PLACES, Place
from rooms import by_rays
from test_flush_meshes import box

from pdm_core import Mesh, Plane, Polygon, Scene, Surface

SHEETS = {
    "plane": lambda plane: plane,
    "polygon": lambda plane: Polygon(plane.corners),
    "mesh": lambda plane: Mesh(plane.corners, [[0, 1, 2, 3]], False),
}


def crate(kind, place, low, high):
    """Its shapes: six sheets of a kind, or all of it one mesh."""
    if kind == "whole":
        vertices, faces = box(low, high)
        return [Mesh(place(vertices), faces, False)]
    return [SHEETS[kind](surface.shape) for surface in place.box(low, high)]


KINDS = [*SHEETS, "whole"]


def middles(shape):
    """(n, 3) m, of each of its faces."""
    if shape.is_mesh:
        return shape.corners.reshape(-1, 6, 3).mean(axis=1)
    return shape.outline.mean(axis=0)[None]


class Single(Place):
    """Coordinates as single precision holds them."""

    def __call__(self, points):
        return np.float32(super().__call__(points)).astype(float)

    def plane(self, corner, u, v):
        corner, u, v = np.array([corner, u, v], float)
        return Plane.through(self(np.array([corner, corner + u, corner + u + v, corner + v])))


def wall_of_crates(rng, size):
    """[(kind, low, high)] Layers of crates, each layer on the gaps of the one below, many as wide as others."""
    crates, z = [], 0.0
    for _ in range(3):
        x, high = rng.uniform(-0.5, 0.5), rng.choice([0.5, 1.0, 1.3])
        for _ in range(3):
            wide, y, deep = rng.choice([0.6, 1.0, 1.4]), rng.choice([0.0, 0.25]), rng.choice([0.8, 1.0])
            low = np.array([x, y, z])
            crates.append((rng.choice(KINDS), size * low, size * (low + [wide, deep, high])))
            x += wide + rng.choice([0.0, 0.0, 0.2])
        z += high
    return crates


def furnaces(place, crates, lit, rng, rounding, extra=()):
    """A Scene of closed crates under a bright sky, in each of which light is 1, where lit (n,), or none; the number of
    the crate that each surface is the inside of, -1 of others."""
    surfaces, inside = list(extra), [-1] * len(extra)
    for k, (kind, low, high) in enumerate(crates):
        for shape in crate(kind, place, low, high):
            rho = rng.uniform(0.1, 0.9)
            surfaces += [Surface(shape, rho, 1 - rho), Surface(shape, rho, (1 - rho) * lit[k], "back")]
            inside += [-1, k]
    return Scene(surfaces, 1.0, rounding=rounding), np.array(inside)


def judged(scene, inside, lit):
    """All middles of crates' insides have the light that is right."""
    solution = by_rays(scene, 0.1)
    for k in np.flatnonzero(inside >= 0):
        at, right = middles(scene.surfaces[k].shape), lit[inside[k]]
        found = solution.incident(np.full(len(at), k), at)
        np.testing.assert_allclose(found, right, rtol=0.0, atol=0.05 * right)


@pytest.mark.parametrize("seed", range(12))
def test_no_light_comes_into_crates_nor_out(seed):
    """Planes and polygons were parted into layers, meshes in the same plane were not: .65 to .93 for 1, .3 for 0."""
    rng = np.random.default_rng(seed)
    size, rounding = 10 ** rng.uniform(-2, 2), (2**-24, 2**-53)[seed % 2]
    place = Single() if seed % 2 == 0 else Place()
    place.turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    place.turn[0] *= np.linalg.det(place.turn)
    place.offset = rng.normal(size=3) * size * 10 ** rng.uniform(-1, 1.5)
    crates = wall_of_crates(rng, size)
    lit = 1.0 * rng.integers(2, size=len(crates))
    floor = place.plane(size * np.array([-8, -8, 0.0]), size * np.array([20.0, 0, 0]), size * np.array([0, 20.0, 0]))
    floor = Surface(SHEETS[rng.choice(list(SHEETS))](floor), 0.5, 0.5)
    scene, inside = furnaces(place, crates, lit, rng, rounding, [floor])
    judged(scene, inside, lit)


@pytest.mark.parametrize("rounding", [2**-53, 2**-24])
@pytest.mark.parametrize("one", KINDS)
@pytest.mark.parametrize("other", KINDS)
def test_equal_crates_are_a_tower(one, other, rounding):
    """Of lids as large as what stands on them each was met within the other's crate: 0 for 1."""
    place, rng = Place(*PLACES["turned"]), np.random.default_rng(1)
    crates = [(kind, (0, 0, z), (1, 1.2, z + 0.7)) for kind, z in ((one, 0.0), (other, 0.7), (one, 1.4))]
    lit = np.array([1.0, 0.0, 1.0])
    judged(*furnaces(place, crates, lit, rng, rounding), lit)


@pytest.mark.parametrize("kind", KINDS)
def test_the_end_of_a_neighbours_side_hides_nothing_within(kind):
    """Places in the plane of a side that ends there, beyond the wall, met it, where nothing lay on the wall."""
    place, rng = Place(), np.random.default_rng(1)
    crates = [(kind, (0, 0, 0), (1, 1, 1)), (kind, (1, 0.25, 0), (1.6, 1.25, 1))]
    scene, inside = furnaces(place, crates, [0.0, 0.0], rng, 2**-53)
    solution = by_rays(scene, 0.1)
    at = np.array([[1.0, y, z] for y in (0.25, 1.0) for z in (0.25, 0.5, 0.75)])
    for k in np.flatnonzero(inside >= 0):
        assert not solution.incident(np.full(len(at), k), at).any()


@pytest.mark.parametrize("kind", SHEETS)
@pytest.mark.parametrize("made", KINDS)
def test_what_stands_on_the_back_of_a_floor_is_not_seen_from_below(kind, made):
    """A crate's bottom looks as such a floor does, and lay before it: the black bottom was seen through the floor."""
    floor = SHEETS[kind](Plane((-2, -2, 0), (0, 4, 0), (4, 0, 0)))
    stands = [Surface(shape, 0.0) for shape in crate(made, Place(), (-1, -1, 0), (1, 1, 1))]
    below = Surface(Plane((-1, -1, -0.1), (2, 0, 0), (0, 2, 0)), 0.0)
    sides = [Surface(floor, 0.0, 1.0), Surface(floor, 0.5, 0.0, "back")]
    solution = by_rays(Scene([*sides, below, *stands], 1.0, rounding=2**-24), 0.1)
    at = np.array([[0.1, 0.2, -0.1], [-0.5, 0.4, -0.1]])
    np.testing.assert_allclose(solution.incident(np.full(2, 2), at), 1.0, atol=0.03)
    assert not solution.incident(np.full(2, 1), at * (1, 1, 0)).any()
