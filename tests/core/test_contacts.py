"""What touches: carpets, lamps on ceilings, crates, partitions, slabs, in rooms however they are turned and moved."""

from itertools import product

import numpy as np
import pytest
from places import PLACES, Place, each_somewhere
from rooms import transport_of

from pdm_core import Plane, Scene, SceneError, Sphere, Surface, form_factors, solve
from pdm_core.contacts import contacts_of, settle


def mean(solution, index, count=24):
    shape = solution.scene.surfaces[index].shape
    at = (np.arange(count) + 0.5) / count
    s, t = (a.reshape(-1, 1) for a in np.meshgrid(at, at))
    return solution.radiance(index, shape.origin + s * shape.u + t * shape.v).mean()


def random_placements(count, seed=3):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        angle, size = rng.uniform(0, 2 * np.pi), 10 ** rng.uniform(-6, 6)
        yield Place(angle, rng.normal(size=3) * size * 10 ** rng.uniform(-2, 4)), size


@pytest.mark.parametrize("furnished", [False, True])
def test_rows_of_closed_rooms_close_wherever_they_are(furnished):
    for place, size in random_placements(24):
        surfaces = place.box((0, 0, 0), size * np.array([1, 1.3, 0.8]), inward=True, sides=("front", "back"))
        if furnished:
            surfaces += place.box(size * np.array([0.2, 0.3, 0]), size * np.array([0.5, 0.6, 0.3]))
        transport = transport_of(Scene(surfaces, 1.0 * np.ones(3)))
        field, everyone = transport.field, np.arange(len(surfaces))
        sums = transport.factors.matrix(field.points, field.normals, field.node_surface, everyone, True).sum(axis=1)
        sums = sums[~field.contacts.covered(field.points, field.node_surface)]  # by the box: they see nothing
        far = np.linalg.norm(place.offset) / size
        # nodes lie 1e-7 of an edge from the next wall: rounding far away is what their distance to a box is off by
        assert np.abs(sums - 1).max() < (1e-9 if not furnished else 1e-8 + 1e-9 * far)


def test_furnace_is_exact_in_every_placement():
    for place, size in random_placements(12, seed=5):
        surfaces = place.box(
            (0, 0, 0), (size,) * 3, inward=True, sides=("front", "back"), reflectance=0.7, emission=0.3
        )
        solution = solve(Scene(surfaces, 1.0 * np.ones(3)))
        points = place(np.random.default_rng(0).random((50, 3)) * size)
        for k in range(len(surfaces)):
            assert solution.radiance(k, points) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("size", [(1e6, 1e6, 1), (1, 1, 1e3), (1e3, 1, 1e-3), (1e-6, 1e-6, 1e-6)])
def test_flat_and_long_rooms_are_furnaces(place, size):
    place.offset = place.offset * min(size)  # further away double precision does not hold it
    surfaces = place.box((0, 0, 0), size, inward=True, reflectance=0.7, emission=0.3)
    solution = solve(Scene(surfaces))
    points = place(np.random.default_rng(0).random((50, 3)) * size)
    assert max(np.abs(solution.radiance(k, points) - 1).max() for k in range(6)) < 1e-5


def single(surfaces):
    """Each wall with its corners as single precision holds them, on its own."""
    corners = [s.shape.corners.astype(np.float32).astype(float) for s in surfaces]
    return [Surface(Plane(c[0], c[1] - c[0], c[3] - c[0]), s.reflectance) for s, c in zip(surfaces, corners)]


@pytest.mark.parametrize("where", PLACES)
def test_a_closed_box_is_dark_inside_under_a_sky(where):
    place = Place(*PLACES[where])
    surfaces = place.box((-1, -1, -1), (1, 1, 1), inward=True, reflectance=0.7)
    solution = solve(Scene(surfaces, np.ones(3)))
    points = place(np.random.default_rng(1).uniform(-1, 1, (200, 3)))
    assert max(solution.radiance(k, points).max() for k in range(6)) == 0


def test_a_closed_box_of_rounded_walls_is_dark_inside_under_a_sky():
    """Parts of 2^-24 make quadrilaterals of rectangles, whose opposite corners lie in no plane: wherever it stands."""
    rng = np.random.default_rng(7)
    for _ in range(12):
        away, size = rng.normal(size=3), 10 ** rng.uniform(-0.5, 0.5, 3)
        place = Place(rng.uniform(0, 2 * np.pi), away * 10 ** rng.uniform(-1, 4))
        scene = Scene(single(place.box(-size, size, inward=True, reflectance=0.7)), np.ones(3), rounding=2**-24)
        solution = solve(scene)
        points = place(rng.uniform(-size, size, (500, 3)))
        assert max(solution.radiance(k, points).max() for k in range(6)) == 0


@pytest.mark.parametrize("reflectance, right", [(0.8, 0.53), (0.95, 1.86)])
def test_a_carpet_in_the_floors_plane_is_as_one_just_above_it(place, reflectance, right):
    """Energy: what the room's surfaces absorb is what the lamp sends out, less what the lamp takes itself."""
    light = {"reflectance": reflectance}
    surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True, **light)
    surfaces += place.sheet((0.05, 0.05, 0), (3.9, 0, 0), (0, 3.9, 0), **light)
    surfaces += place.sheet((1.5, 1.5, 2.9), (0, 1, 0), (1, 0, 0), emission=10)
    solution = solve(Scene(surfaces))
    area = np.array([s.shape.area for s in surfaces])
    radiance = np.array([mean(solution, k) for k in range(len(surfaces))])
    room = np.array([0, 1, 2, 3, 4, 5, 6])
    absorbed = (area * radiance)[room].sum() * (1 - reflectance) / reflectance
    grid = (np.arange(24) + 0.5) / 24
    on_lamp = place(np.column_stack([1.5 + a.ravel() for a in np.meshgrid(grid, grid)] + [np.full(24 * 24, 2.9)]))
    taken = sum(solution.incident(k, on_lamp).mean() for k in (8, 9))
    assert absorbed + taken == pytest.approx(20, rel=0.025)
    assert np.average(radiance[:6], weights=area[:6]) == pytest.approx(right, rel=0.05)
    assert solution.error < 0.01


@each_somewhere("gap, rounding", product([2.4e-7, 1e-5, 1e-3, 0], [2**-24, 2**-53]))
def test_a_lamp_may_come_as_near_to_the_ceiling_as_it_likes(place, gap, rounding):
    surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True, reflectance=0.7)
    surfaces += place.sheet((1.5, 1.5, 3 - gap), (0, 1, 0), (1, 0, 0), emission=10)
    solution = solve(Scene(surfaces, rounding=rounding), 0.03)
    assert solution.radiance(4, place([(2, 2, 0)])) == pytest.approx(0.4253, rel=0.03)


@pytest.mark.parametrize("thick", [1e-5, 1e-2])
def test_no_light_comes_through_a_partition(place, thick):
    surfaces = place.box((0, 0, 0), (4, 4, 3), inward=True, reflectance=0.7)
    surfaces += place.box((2 - thick / 2, 0, 0), (2 + thick / 2, 4, 3), reflectance=0.7)
    surfaces += place.sheet((0.5, 1.5, 2.9), (0, 1, 0), (1, 0, 0), emission=10)
    solution = solve(Scene(surfaces), 0.05)
    assert mean(solution, 1) < 1e-6 < 0.3 < mean(solution, 0)
    assert solution.radiance(4, place([(3, 2, 0)])).max() < 0.02  # the field's own smoothing


def test_crates_side_by_side_are_dark_where_they_touch(place):
    surfaces = [s for x in range(3) for s in place.box((x, 0, 0), (x + 1, 1, 1), reflectance=0.5)]
    solution = solve(Scene(surfaces, np.ones(3)))
    touching = {1, 6, 7, 12}
    for k in range(18):
        assert mean(solution, k) == pytest.approx(0 if k in touching else 0.5, abs=1e-6)


def test_rooms_back_to_back_are_both_lit(place):
    first = place.box((0, 0, 0), (1, 1, 1), inward=True, reflectance=0.7, emission=0.3)
    second = place.box((1, 0, 0), (2, 1, 1), inward=True, reflectance=0.5, emission=1)
    solution = solve(Scene(first + second))
    assert [mean(solution, k) for k in range(12)] == pytest.approx([1] * 6 + [2] * 6, rel=1e-5)


def test_a_cube_on_a_floor_is_the_same_on_all_sides(place):
    """At the contact the floor has the light of outside; at the middle, under the cube, none."""
    surfaces = place.sheet((-3, -3, 0), (6, 0, 0), (0, 6, 0), reflectance=0.5)
    surfaces += place.box((-0.5, -0.5, 0), (0.5, 0.5, 1), reflectance=0.5)
    solution = solve(Scene(surfaces, np.ones(3)))
    contact = solution.radiance(0, place([(0.5, 0, 0), (-0.5, 0, 0), (0, 0.5, 0), (0, -0.5, 0)]))[:, 0]
    assert contact == pytest.approx(1 / 3, rel=0.06)
    assert np.ptp(contact) < 1e-3
    corners = solution.radiance(0, place([(x, y, 0) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]))[:, 0]
    assert np.ptp(corners) < 2e-3
    assert solution.radiance(0, place([(0, 0, 0), (0.3, -0.2, 0)])).max() == 0
    assert mean(solution, 6) == 0  # the cube's own face there


def test_a_room_of_touching_slabs_is_dark_inside(place):
    slabs = [((-2, -2, -0.1), (2, 2, 0)), ((-2, -2, 3), (2, 2, 3.1)), ((-2.1, -2, 0), (-2, 2, 3))]
    slabs += [((2, -2, 0), (2.1, 2, 3)), ((-2, -2.1, 0), (2, -2, 3)), ((-2, 2, 0), (2, 2.1, 3))]
    surfaces = [s for slab in slabs for s in place.box(*slab, reflectance=0.7)]
    solution = solve(Scene(surfaces, np.ones(3)), 0.05)
    rng = np.random.default_rng(0)
    points, normals = place(rng.uniform((-2, -2, 0), (2, 2, 3), (50, 3))), rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    # moved far away, the slabs' coordinates are off by 1e-13 of their size, each by its own
    assert solution.irradiance(points, normals).max() < (1e-3 if place.offset.any() else 1e-12)
    assert solution.error <= 0.05


def test_the_smaller_lies_on_top_and_of_equal_ones_the_later():
    floor, rug, mat = Plane((0, 0, 0), (4, 0, 0), (0, 4, 0)), Plane((1, 1, 0), (2, 0, 0), (0, 2, 0)), None
    mat = Plane((1.2, 1.2, 0), (0, 1, 0), (1, 0, 0))  # it looks down: its back is what one sees
    scene = Scene([Surface(rug), Surface(mat), Surface(floor), Surface(Plane((1.5, 1, 0), (2, 0, 0), (0, 2, 0)))])
    settled = settle(scene)[0]
    rug, mat, floor, later = (s.shape.corners[:, 2].max() for s in settled.surfaces)
    assert floor == 0 < rug < later < mat < 2000 * scene.tolerance


def same_shape():
    yield Plane((1, 1, 0), (2, 0, 0), (0, 3, 0)), Plane((3, 1, 0), (0, 3, 0), (-2, 0, 0))  # from another corner
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for matrix in (np.eye(4), np.diag([2, 1, 0.5, 1])):
        other = matrix.copy()
        other[:3, :3] = matrix[:3, :3] @ turn
        yield Sphere(matrix), Sphere(other)


@pytest.mark.parametrize(("one", "other"), list(same_shape()))
def test_the_same_shape_given_twice_is_one_shape_or_refused(one, other):
    scene = Scene([Surface(one), Surface(other, side="back")])
    assert len(scene.shapes) == 1 and list(scene.shape_of) == [0, 0]
    with pytest.raises(SceneError, match="'a'.*'b'|'b'.*'a'"):
        Scene([Surface(one, name="a"), Surface(other, name="b")])


def test_shapes_that_differ_are_two():
    square = Plane((1, 1, 0), (2, 0, 0), (0, 2, 0))
    askew = Plane((2 - 2**0.5, 2, 0), (2**0.5, -(2**0.5), 0), (2**0.5, 2**0.5, 0))  # turned about its middle
    for other in (askew, Plane((1, 1, 0), (0, 2, 0), (2, 0, 0)), Plane((1, 1, 1e-9), (2, 0, 0), (0, 2, 0))):
        assert len(Scene([Surface(square), Surface(other)]).shapes) == 2


def test_gaps_thinner_than_the_rounding_are_said():
    floor, sheet = Plane((0, 0, 0), (4, 0, 0), (0, 4, 0)), Plane((1, 1, 3e-7), (2, 0, 0), (0, 2, 0))
    surfaces = [Surface(floor, name="floor"), Surface(sheet, name="sheet")]
    assert contacts_of(Scene(surfaces)).warnings == []
    (warning,) = contacts_of(Scene(surfaces, rounding=2**-24)).warnings
    assert "'floor'" in warning and "'sheet'" in warning
    assert contacts_of(Scene([surfaces[0], Surface(Sphere.at((0, 0, 9), 1))], rounding=2**-24)).warnings == []


def test_contacts_are_found_in_a_time_that_grows_with_their_number():
    """3,000 boxes on a floor: pairs looked at, not all pairs."""
    rng = np.random.default_rng(2)
    place = Place()
    boxes = rng.uniform(-100, 100, (500, 2))
    surfaces = [s for x, y in boxes for s in place.box((x, y, 0), (x + 0.5, y + 0.5, 0.5), reflectance=0.5)]
    surfaces += place.sheet((-110, -110, 0), (220, 0, 0), (0, 220, 0), reflectance=0.5)
    contacts = contacts_of(Scene(surfaces))
    assert 500 <= len(contacts.covers[0]) <= 1100  # each bottom, and the floor under it
    assert 500 * (4 + 12) * 2 <= len(contacts.stands[0]) <= 500 * (4 + 12) * 2 * 1.2


def test_form_factors_of_a_floor_under_a_carpet():
    place = Place(0.3)
    room = place.box((0, 0, 0), (2, 2, 2), inward=True)
    carpet = Surface(place.plane((0, 0, 0), (1, 0, 0), (0, 2, 0)))
    result = form_factors(Scene([*room, carpet]), rtol=1e-6)
    opposite = 0.199824895698387
    assert result.F[5, 4] + result.F[5, 6] == pytest.approx(opposite, abs=1e-9)
    assert result.F[5, 4] == pytest.approx(opposite / 2, abs=1e-9)
    assert result.F[6].sum() == pytest.approx(1, abs=1e-9)
    area = np.array([s.shape.area for s in [*room, carpet]])
    assert area[:, None] * result.F == pytest.approx((area[:, None] * result.F).T, abs=1e-7)


def rounded(corners):
    """A plane whose corners (4, 3) m are of single precision, each for itself."""
    return Plane.through(np.float32(corners).astype(float))


@pytest.mark.parametrize("inward", [False, True])
def test_both_sides_of_the_walls_of_rounded_boxes_are_read_on_their_own_side(inward):
    """Next to another wall they were moved to that one's front, out of the box: 1.4 for 1, 40 % stated."""
    for place, size in random_placements(4, seed=8):
        place.offset *= 3 * size / np.linalg.norm(place.offset)
        walls = place.box((0, 0, 0), (size, size, size), inward=inward)
        shapes = [rounded(wall.shape.corners) for wall in walls]
        surfaces = [Surface(shape, 0.6, 0.4, side) for shape in shapes for side in ("front", "back")]
        solution = solve(Scene(surfaces, 1.0, 2**-24), 0.1)
        assert "links" in str(solution.plan)
        at = np.array([0.0, 1e-6, 1e-3, 0.4, 1 - 1e-6, 1.0])
        local = np.stack([*np.meshgrid(at, at), np.zeros((6, 6))], axis=-1).reshape(-1, 3)
        for k, surface in enumerate(surfaces):
            assert np.abs(solution.radiance(k, surface.shape.world(local)) - 1).max() < 1e-3
        assert solution.error < 1e-3


@pytest.mark.parametrize("twist", [1e-9, 1e-7, 1e-6])
@pytest.mark.parametrize("width", [1.0, 1e-3])
def test_a_plane_whose_corners_are_rounded_apart_does_not_see_itself(width, twist):
    """1.6 for 1 in the mean, 200 % stated."""
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, width, twist * width], [0, width, 0]])
    surfaces = [Surface(rounded(corners), 0.7, 0.3, side) for side in ("front", "back")]
    solution = solve(Scene(surfaces, 1.0, 2**-24), 0.1)
    for k in range(2):
        assert mean(solution, k) == pytest.approx(1, abs=1e-6)


def test_corners_that_are_no_parallelograms_are_refused():
    with pytest.raises(SceneError, match="no parallelogram"):
        Surface(Plane.through(np.array([[0, 0, 0], [1, 0, 0], [1.2, 1, 0], [0, 1, 0.0]])))


@pytest.mark.parametrize("rounding", [2**-53, 2**-24])
@pytest.mark.parametrize("near", [8.0, 20.0, 1e3])
def test_a_wall_close_before_a_point_hides_half_of_the_sky(near, rounding):
    """All its corners are seen on one great circle, as those of what is seen edge-on are: it hid nothing."""
    wall = Plane((0, -1, 0), (0, 2, 0), (0, 0, 1))
    partition = Plane((0, 0, 0), (2, 0, 0), (0, 0, 1))
    sides = [Surface(shape, 0.5, side=side) for shape in (wall, partition) for side in ("front", "back")]
    scene = Scene(sides, 1.0, rounding)
    factors = transport_of(scene).factors
    points, normals = np.array([[near * factors.scene.tolerance, 0, 0.5]]), np.array([[0.0, -1, 0]])
    seen = factors.matrix(points, normals, np.array([2]), np.arange(4), True)[0]
    assert seen[0] == pytest.approx(0.5, abs=1e-3) and seen[-1] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("seed", [1, 2, 5])
def test_rows_close_in_a_rounded_room_with_a_partition(seed):
    """Edges that nodes pass by as close as they keep from a wall are turned by rounding more than was taken: rows next
    to the partition summed to .5 to 1.5."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn[0] *= np.linalg.det(turn)
    walls = [surface.shape for surface in Place(0.0, np.zeros(3)).box((0, 0, 0), (3, 2, 1), inward=True)]
    walls.append(Plane((1, 0, 0), (0, 1.9, 0), (0, 0, 1)))
    sides = [Surface(rounded(w.corners @ turn.T), 0.5, side=side) for w in walls for side in ("front", "back")]
    transport = transport_of(Scene(sides, 1.0, 2**-24))
    field, everyone = transport.field, np.arange(len(sides))
    sums = transport.factors.matrix(field.points, field.normals, field.node_surface, everyone, True).sum(axis=1)
    assert np.abs(sums - 1).max() < 2e-3
