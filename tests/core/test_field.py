"""Charts and cells: planes are cut where a narrow gap ends, and the field knows its way over the cuts."""

from collections import Counter

import numpy as np
import pytest
from rooms import cube_planes, transport_of

from pdm_core import Plane, Scene, Sphere, Surface, each_surface, solve
from pdm_core.biquadratic import basis2
from pdm_core.charts import STRIP, charts_of
from pdm_core.error_estimates import SOURCE, leaf_errors
from pdm_core.field import Field
from pdm_core.field_values import conform, predict
from pdm_core.gaps import crowded
from pdm_core.links.gather import Detail, Gather
from pdm_core.numerics import Rows, gauss_square
from pdm_core.signs_of_life import finish
from pdm_core.visibility import Factors, Shafts

CEILING = 1


def room_with(panel, emission=0.0, reflectance=0.5):
    lit = [Surface(panel, reflectance, emission), Surface(panel, reflectance, 0.0, side="back")]
    return Scene([Surface(plane, reflectance) for plane in cube_planes()] + lit)


GAP = 0.02


def hanging(gap=GAP, turn=0.0, low=(-1.0, -0.5), size=(1.5, 1.2)):
    """A panel under the ceiling of the room that faces down, turned about the vertical."""
    u = np.array([0.0, size[1], 0.0])
    v = np.array([size[0], 0.0, 0.0])
    cos, sin = np.cos(turn), np.sin(turn)
    rotate = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])
    return Plane((*low, 3.0 - gap), rotate @ u, rotate @ v)


def test_charts_end_at_the_rims_of_a_narrow_gap_and_of_nothing_else():
    cuts = charts_of(room_with(hanging())).cuts
    # the ceiling's first edge runs along y, its second along x, both from -3 over 6 m
    # and a strip of STRIP gaps on either side of each rim, on the panel within it
    for axis, rims in enumerate([(2.5, 3.7), (2.0, 3.5)]):
        inner = [at + side * STRIP * GAP for at in rims for side in (-1, 0, 1)]
        assert np.allclose(cuts[CEILING, axis], np.array([0, *inner, 6]) / 6)
    for axis, edge in enumerate(np.linalg.norm([hanging().u, hanging().v], axis=1)):
        assert np.allclose(cuts[-1, axis, :4], [0, STRIP * GAP / edge, 1 - STRIP * GAP / edge, 1])
    assert (np.delete(cuts, (CEILING, len(cuts) - 1), axis=0)[:, :, 1] == 1).all()
    for k, rims in enumerate([(2.5, 3.7), (2.0, 3.5)]):  # strips that are too narrow to be cells leave the rims alone
        cuts = charts_of(room_with(hanging(gap=1e-3))).cuts
        assert np.isclose(cuts[CEILING, k][:, None], np.array(rims) / 6).any(axis=0).all()
    beside = hanging(low=(-1.0, 3.5))
    for panel in (hanging(gap=1.0), hanging(gap=1e-6), hanging(turn=0.3), beside):
        assert (charts_of(room_with(panel)).cuts[:, :, 1] == 1).all()


def test_strips_along_the_rim_of_a_gap_are_halved_across_it_alone():
    field = Field(room_with(hanging()))
    while len(halvings := crowded(field, np.zeros(len(field.scene.shapes)), 0.1, np.ones(len(field.scene), bool))):
        field.refine(halvings)
    panel = len(field.scene) - 1  # its back, of 3 x 3 charts, faces the ceiling
    leaves = field.leaves[field.surface[field.leaves] == panel]
    level, (first, second) = field.level[leaves], field.chart_of(leaves).T
    strip = (first != 1) & (second == 1)
    assert level[strip, 0].min() >= 2 and level[strip, 1].max() <= 1
    strip = (first == 1) & (second != 1)
    assert level[strip, 1].min() >= 2 and level[strip, 0].max() <= 1
    assert not field.level[field.surface == 0].max() > 1  # the floor has nothing near


def test_no_end_of_a_long_cell_reaches_into_a_contact():
    """A floor's cells, 2 m long and .1 wide, lay with an end in a ball that is sunk in it."""
    ball, least = Sphere.at((0.3, 0.1, 0.2), 0.6), 0.08
    field = Field(Scene([Surface(Plane((-2, -2, 0), (4, 0, 0), (0, 4, 0)), 0.9), Surface(ball, 0.9)]))
    while len(halvings := crowded(field, np.full(2, least), 1.0, np.ones(2, bool))):
        field.refine(halvings)
    leaves = field.leaves[field.surface[field.leaves] == 0]
    nodes = field.points[field.nodes[leaves]]
    length = np.linalg.norm(nodes[:, (7, 5)] - nodes[:, (1, 3)], axis=2).max(axis=1)
    gap = np.abs(np.linalg.norm(nodes - ball.origin, axis=2) - 0.6).min(axis=1)
    assert (length < 4 * np.maximum(least, np.sqrt(gap * (gap + 2 * 0.6)))).all()


def test_light_jumps_where_a_plane_stands_on_another():
    standing = Plane((-1, 0.5, 1.0), (2, 0, 0), (0, 0, 2.0))
    scene = room_with(standing)
    charts, field = charts_of(scene), Field(scene)
    assert np.allclose(charts.cuts[CEILING, 0, :2], [0, 3.5 / 6]) and charts.jumps[CEILING, 0, 1]
    assert charts.jumps.sum() == 1 and charts.cuts[CEILING, 1, 1] == 1
    y = field.points[field.node_surface == CEILING, 1]
    assert 0 < 0.5 - y[y < 0.5].max() < 1e-5 and 0 < y[y > 0.5].min() - 0.5 < 1e-5  # nodes on both its sides
    off, skew = Plane((-1, 0.5, 1.0), (2, 0, 0), (0, 0, 1.9)), Plane((-1, 0.5, 1.0), (2, 0.1, 0), (0, 0, 2.0))
    for panel in (off, skew):
        assert not charts_of(room_with(panel)).jumps.any()


def test_cells_of_cut_planes_cover_them_and_are_found_again():
    field = Field(room_with(hanging()))
    rng = np.random.default_rng(3)
    for _ in range(3):
        leaves = field.leaves
        field.refine(field.halvings[rng.random(len(field.halvings)) < 0.3])
    leaves = field.leaves
    assert np.allclose(np.bincount(field.surface[leaves], field.sizes()[leaves]), field.scene.areas)
    uv = rng.uniform(0.1, 0.9, (len(leaves), 2))
    points, _ = field.place(leaves, uv)
    found, weights = field.locate(field.surface[leaves], field.on.local(field.surface[leaves], points))
    assert (found == leaves).all()
    nodes = np.stack(
        [(weights * at).sum(axis=1) for at in np.array([(a, b) for a in range(3) for b in range(3)]).T / 2], 1
    )
    assert np.allclose(nodes, uv, atol=1e-3)  # the nodes are a hair inside of the border


def sheet():
    return Field(Scene([Surface(Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), 0.5, 1.0)]))


def halved(field, rng, times=4):
    """Some of its leaves along one axis or both, so many times."""
    for _ in range(times):
        field.refine(field.halvings[rng.random(len(field.halvings)) < 0.2])


def resolved(bending):
    """A sheet refined until what is told of its error is .1 % of a field (n,) of its nodes' places (n, 2)."""
    field, allowed = sheet(), np.array([1e-3])
    while True:
        value = bending(field.points[:, :2])[:, None]
        halvings = each_surface.worst_of_parts(field, leaf_errors(field, value) / SOURCE, allowed, field.part)
        if not len(halvings):
            return field, value
        field.refine(halvings)


def test_cells_are_halved_along_the_axis_that_light_bends_along():
    decay = lambda x: np.exp(-x / 0.02)  # noqa: E731
    at = np.random.default_rng(4).random((4000, 2))
    level, nodes = [], []
    for bending in (
        lambda x: decay(x[:, 0]),
        lambda x: decay(x[:, 1]),
        lambda x: decay(x[:, 0]) * (1 + 0.5 * x[:, 1]),
        lambda x: decay(x[:, 0]) + decay(x[:, 1]),
    ):
        field, value = resolved(bending)
        placed = field.locate(np.zeros(len(at), int), np.column_stack([at, 0 * at[:, 0]]))
        off = field.interpolate(placed, value)[:, 0] - bending(at)
        assert np.sqrt(np.mean(off**2)) < 2e-3
        level.append(field.level[field.leaves].max(axis=0).tolist())
        nodes.append(len(field.keys))
    assert level[0] == level[1][::-1] and level[0][0] >= 3 and level[0][1] == 1
    assert nodes[0] == nodes[1] and nodes[2] < 2 * nodes[0] < nodes[3]


def test_what_cells_halved_one_way_hold_is_continuous_and_exact_for_their_polynomials():
    field, rng = sheet(), np.random.default_rng(6)
    halved(field, rng)
    old = len(field.keys)
    place = lambda: field.on.each("at", field.node_surface, field.points)[1]  # noqa: E731
    parabolic = lambda t: ((1 + t[:, 0] - 3 * t[:, 0] ** 2) * (2 - t[:, 1] + t[:, 1] ** 2))[:, None]  # noqa: E731
    known = parabolic(place())
    halved(field, rng, 2)
    assert np.abs(predict(field, known, old) - parabolic(place()[old:])).max() < 1e-3  # nodes are a hair off the border
    value = conform(field, field.leaves, np.arange(len(field.keys)), rng.random((len(field.keys), 1)))
    leaves = field.leaves[rng.integers(0, len(field.leaves), 3000)]
    edge, along = rng.integers(0, 4, 3000), rng.random(3000)
    uv = np.where((edge < 2)[:, None], np.column_stack([edge % 2, along]), np.column_stack([along, edge % 2]))
    at, step = field.in_chart(leaves) + uv * 0.5 ** field.level[leaves], np.where((edge < 2)[:, None], (1, 0), (0, 1))
    inner = ((at > 1e-6) & (at < 1 - 1e-6)).all(axis=1)
    sides = []
    for side in (-1e-9, 1e-9):
        cell, within = field.below(np.zeros(inner.sum(), int), (at + side * step)[inner])
        sides.append((basis2(within) * value[field.nodes[cell], 0]).sum(axis=1))
    assert np.abs(sides[0] - sides[1]).max() < 1e-5


def test_what_is_sent_has_all_nodes_of_the_field_and_no_more_than_it_needs():
    transport, rng = transport_of(room_with(hanging(), emission=1.0)), np.random.default_rng(2)
    finish(transport.grow(transport.sent.halvings[:0]))
    for _ in range(3):
        halvings = transport.field.halvings
        finish(transport.split(halvings[rng.random(len(halvings)) < 0.2]))
        assert np.array_equal(np.sort(transport.sent.keys), np.sort(transport.field.keys))
    finish(transport.grow(transport.sent.halvings[::7]))
    finish(transport.split(transport.field.halvings[::5]))
    assert (transport.sent.find(transport.field.keys) >= 0).all()


@pytest.mark.parametrize("v", [(0, 3, 0), (1.5, 3, 0), (-2.5, 2, 0)])
def test_light_from_a_plane_that_varies_over_it(v):
    """Rows times a field against brute quadrature, for edges that are orthogonal and edges that are not."""
    source, receiver = Plane((0, 0, 0), (2, 0, 0), v), Plane((0.5, 0.5, 0.7), (0.3, 0.1, 0.5), (0.2, 0.6, -0.3))
    scene = Scene([Surface(source, 0.5, 1.0), Surface(receiver, 0.5, side="back"), Surface(receiver, 0.5)])
    factors, field = Factors(scene, Shafts(scene), Counter()), Field(scene)
    for _ in range(2):
        field.refine(field.halvings)
    at = np.random.default_rng(2).random((40, 2))
    points = receiver.origin + at[:, :1] * receiver.u + at[:, 1:] * receiver.v
    nodes, weights = gauss_square(80)
    y = source.origin + nodes[:, :1] * source.u + nodes[:, 1:] * source.v
    count = len(field.level)
    every = Detail(np.ones(count), np.full(count, 1.0), np.ones(3))
    for own in (1, 2):
        normals = np.tile(scene.surfaces[own].sign * receiver.normal, (40, 1))
        gather = Gather(field, factors, np.array([0]))
        blocks = gather.blocks(points, normals, np.full(40, own), every, np.full(40, 1e-4))
        rows = Rows([block for block in blocks if block], 40)
        found = rows.times(brightness(field.points)[:, None])[:, 0]
        e = y - points[:, None]
        cosine = np.maximum(np.einsum("nji,ni->nj", e, normals), 0.0) * np.maximum(-e @ source.normal, 0.0)
        kernel = cosine / (np.pi * np.einsum("nji,nji->nj", e, e) ** 2)
        assert np.abs(found - (kernel * weights) @ brightness(y) * source.area).max() < 2e-3


def brightness(points):
    return 1 + np.sin(2 * points[:, 0]) * np.cos(1.5 * points[:, 1])


def test_the_gap_over_a_lamp_has_the_light_it_has_without_cuts():
    """Turned by more than counts as straight along the chart the same panel cuts nothing: another way to the light."""
    straight, turned = (solve(room_with(hanging(turn=turn), emission=5.0), 0.01) for turn in (0.0, 2e-4))
    assert (charts_of(turned.scene).cuts[:, :, 1] == 1).all()
    rng = np.random.default_rng(5)
    within = np.column_stack([rng.uniform(-1.3, 0.8, 400), rng.uniform(-0.8, 1.0, 400), np.full(400, 3.0)])
    a, b = (solution.radiance(CEILING, within)[:, 0] for solution in (straight, turned))
    assert np.sqrt(np.mean((a - b) ** 2)) < 0.05 * np.sqrt(np.mean(a**2))
    assert a.min() < 0.1 * a.max()  # it is dark in the gap
    assert straight.nodes < turned.nodes


def test_what_bends_beside_a_gap_do_to_the_dark_side_of_a_lamp_is_mended_where_they_are():
    """Cells that pass on little were halved in eight rounds, until it were by chance those that bend."""
    lamp = Plane((-1, -1, 2.9), (0, 2, 0), (2, 0, 0))
    surfaces = [Surface(plane, 0.6) for plane in cube_planes()]
    surfaces += [Surface(lamp, 0.5, 5.0), Surface(lamp, 0.5, side="back")]
    solution = solve(Scene([*surfaces, Surface(Sphere.at((0.5, 0.3, -2.0), 1.0), 0.7)]), 0.02)
    assert not solution.warnings and solution.nodes < 3300


def test_light_is_one_where_every_surface_emits_what_it_does_not_reflect():
    panel = hanging()
    surfaces = [Surface(plane, 0.6, 0.4) for plane in cube_planes()] + [
        Surface(panel, 0.6, 0.4, side=side) for side in ("front", "back")
    ]
    solution = solve(Scene(surfaces), 0.01)
    points = np.column_stack([np.random.default_rng(1).uniform(-2.9, 2.9, (200, 2)), np.full(200, 3.0)])
    assert np.abs(solution.radiance(CEILING, points) - 1).max() < 1e-4
