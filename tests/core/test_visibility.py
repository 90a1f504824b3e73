"""What may stand in the way: candidates that are dropped hide nothing, and what is left is seen exactly."""

from collections import Counter

import numpy as np
import pytest
from rooms import cube_planes, scene_of
from test_view import BALLS, ELLIPSOIDS, SCREENS, floor_points, free_points

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.field import Field
from pdm_core.links.gather import Detail, Gather
from pdm_core.numerics import Rows
from pdm_core.sampled import segment_blocked
from pdm_core.shadows import Shadows
from pdm_core.visibility import Factors, Shafts

ROOM = [Surface(plane, 0.5, 1.0) for plane in cube_planes()]
BALL = [Surface(BALLS[0], 0.5), Surface(BALLS[1], 0.5), Surface(BALLS[2])]  # the last is black


@pytest.mark.parametrize("turned", range(6))
def test_what_lies_on_the_way_from_a_point_to_the_middle_of_the_ball_around_it_or_away_hides(turned):
    """A small ball just over a floor within a large one, its middle right over the floor's: r^2 / d^2 is hidden. It was
    no candidate, as it lies behind the floor's point as seen from the large ball's middle."""
    rng, axis = np.random.default_rng(turned), np.eye(3)[turned % 3]
    if turned >= 3:
        axis = np.linalg.qr(rng.normal(size=(3, 3)))[0][0]
    u = np.cross(axis, [0.3, 0.5, 0.7])
    u /= np.linalg.norm(u)
    v, point, distance = np.cross(axis, u), 0.5 * axis, rng.uniform(0.3, 0.5)
    floor, small = Plane(point - (u + v) / 2, u, v), Sphere.at(point + distance * axis, 0.2)
    shapes = [Sphere.at((0, 0, 0), 2.0), floor, small]
    scene = Scene([Surface(shape, 0.5, 0.5, side=side) for shape in shapes for side in ("front", "back")])
    factors = Factors(scene, Shafts(scene), Counter())
    seen = factors.pairs(point[None], axis[None], np.array([2]), np.array([1]))
    assert seen[0] == pytest.approx(1 - (0.2 / distance) ** 2, abs=1e-12)


def test_candidates_beside_the_source_hide_none_of_it():
    shapes = cube_planes() + BALLS[2:] + SCREENS + ELLIPSOIDS
    shafts = Shafts(scene_of(shapes))
    points, normals = free_points(shapes, 400)
    rng, count = np.random.default_rng(2), len(points)
    wall = rng.integers(0, 6, count)
    corners = np.array([shapes[k].corners for k in wall])
    everything = np.tile(np.arange(6, len(shapes)), (count, 1))
    kept = shafts.in_view(points, normals, corners, everything)
    dropped = ~(everything[:, :, None] == kept[:, None]).any(axis=2)
    place = rng.random((count, 6, 6, 2))
    target = corners[:, None, None, 0] + sum(
        place[..., i : i + 1] * (corners[:, j] - corners[:, 0])[:, None, None] for i, j in ((0, 1), (1, 3))
    )
    steps = target - points[:, None, None]
    ahead = np.einsum("nabi,ni->nab", steps, normals) > 0
    pair, slot = np.indices(everything.shape)
    pair, shape = pair.ravel(), everything[pair.ravel(), slot.ravel()]
    start, step = points[pair].T[:, None, None], np.moveaxis(steps[pair], (3, 0), (0, 3))
    hidden = segment_blocked(shafts.table, np.broadcast_to(start, step.shape), step, shape)
    hidden = (np.moveaxis(hidden, 2, 0) & ahead[pair]).any(axis=(1, 2))
    dropped = dropped.ravel()
    assert not (hidden & dropped).any()
    assert hidden.sum() > 100 and dropped.sum() > 2 * hidden.sum()


@pytest.mark.parametrize("sunk", [False, True])
def test_shadows_are_where_segments_are_blocked(sunk):
    """What is known of a shadow in the plane's coordinates, against the segment to every sample for itself."""
    shapes = cube_planes() + BALLS[2:] + SCREENS + ELLIPSOIDS
    if sunk:  # through the floor and through a wall: what lies behind them hides nothing
        shapes += [Sphere.at((1.0, -1.2, -3.1), 0.7), Sphere.at((3.2, 1.0, 0.5), 0.9)]
    shafts = Shafts(scene_of(shapes))
    points, _ = free_points(shapes, 300)
    rng, count = np.random.default_rng(4), len(points)
    wall = rng.integers(0, 6, count)
    frame = [np.array([getattr(shapes[k], name) for k in wall]).T for name in ("origin", "u", "v")]
    occluders = np.tile(np.arange(6, len(shapes)), (count, 1))
    occluders[rng.random(occluders.shape) < 0.3] = -1
    pair = rng.integers(0, count, 4000)
    low = rng.random((2, 4000)) * 0.8
    high = low + rng.random((2, 4000)) * 0.2
    place = low[:, None] + (high - low)[:, None] * rng.random((2, 3, 4000))
    hidden, near = Shadows(shafts.table, points, frame, occluders).over(pair, low, high, place)
    o, u, v = (axis[:, None, None, pair] for axis in frame)
    step = o + u * place[0][:, None] + v * place[1] - points[pair].T[:, None, None]
    start = np.broadcast_to(points[pair].T[:, None, None], step.shape)
    expected = np.zeros_like(hidden)
    for column in occluders[pair].T:
        valid = np.flatnonzero(column >= 0)
        expected[..., valid] |= segment_blocked(shafts.table, start[..., valid], step[..., valid], column[valid])
    assert (hidden == expected).all() and 0.02 < hidden.mean() < 0.9
    assert near[hidden.any(axis=(0, 1))].all() and near.mean() < 0.9


def test_rows_share_out_exact_factors():
    """However coarse the cells, each source's weights sum to its whole factor; in a closed room all of them to 1."""
    scene = Scene(ROOM + BALL)
    factors, field = Factors(scene, Shafts(scene), Counter()), Field(scene)
    points, normals = floor_points(200)
    own, sources = np.zeros(200, int), np.arange(9)
    flat = Detail(np.zeros(len(field.level)), np.zeros(len(field.level)), np.ones(9))
    blocks = Gather(field, factors, sources).blocks(points, normals, own, flat, np.full(200, 0.1))
    received = Rows([block for block in blocks if block], 200).times(field.node_surface[:, None] == sources)
    exact = factors.matrix(points, normals, own, sources, False)[:, :-1]
    assert np.abs(received - exact).max() < 1e-6  # rows are kept in single precision
    assert np.abs(exact.sum(axis=1) - 1).max() < 1e-12
