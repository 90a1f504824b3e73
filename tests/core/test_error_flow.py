"""Errors passed on as light is: a closed room of known gain, and the transposed way back against the way there."""

import numpy as np
import pytest
from rooms import cube_planes

from pdm_core import Plane, Scene, Surface, solve
from pdm_core.error_estimates import Look, Residual
from pdm_core.error_flow import ONE_SIGNED, Flow, areas_of_nodes, density, norms
from pdm_core.links.approach import Approach
from pdm_core.links.check import Check
from pdm_core.signs_of_life import finish


@pytest.fixture(scope="module")
def state():
    """A lit room of reflectance .5 with rows at the first nodes."""
    surfaces = [Surface(plane, 0.5, float(k == 1)) for k, plane in enumerate(cube_planes())]
    approach = Approach(Scene(surfaces), 0.01, "")
    finish(approach.transport.grow(approach.transport.sent.halvings[:0]))
    approach.light.follow()
    approach.refinement.link_up(0.01)
    finish(approach.light.extend())
    return approach.transport


@pytest.fixture
def flow(state):
    rho = state.scene.reflectance.max(axis=1)[state.sent.node_surface]
    return Flow(state.field, state.sent, state.rows, state.placed, rho)


def test_an_even_error_is_received_as_even_light_is(state, flow):
    even = np.sqrt(state.field.sizes())  # of density 1
    assert np.allclose(density(state.field, even), 1)
    nothing = np.zeros((len(state.sent.keys), 3))
    received = finish(flow.received(even, 0 * state.sent.sizes(), nothing))
    # all that a point sees emits ONE_SIGNED and reflects half of what it receives
    assert np.allclose(received, ONE_SIGNED / (1 - 0.5), rtol=0.1)
    areas = [s.shape.area for s in state.scene.surfaces]
    assert np.allclose(norms(state.sent, np.ones(len(received))), np.sqrt(areas))


def test_blame_adds_up_to_what_is_received(state, flow):
    rng = np.random.default_rng(3)
    error, weight = rng.random(len(state.field.level)), areas_of_nodes(state.sent)
    weight = np.where(state.sent.node_surface == 2, weight, 0.0)
    nothing = np.zeros((len(state.sent.keys), 3))
    received = finish(flow.received(error, 0 * state.sent.sizes(), nothing))
    blamed = finish(flow.blame(weight, error[:, None] * (1, 0)))
    assert (blamed >= 0).all() and not blamed[state.field.child >= 0].any() and not blamed[:, 1].any()
    blamed = blamed[:, 0]
    assert np.isclose(blamed.sum(), weight @ received, rtol=0.1)
    # half the error of one leaf is half of its part
    worst = np.argmax(blamed)
    error[worst] /= 2
    less = weight @ received - weight @ finish(flow.received(error, 0 * state.sent.sizes(), nothing))
    assert np.isclose(less, blamed[worst] / 2, rtol=0.2)


def test_what_links_are_off_by_is_told_at_a_few_nodes():
    surfaces = [Surface(plane, 0.5, float(k == 1)) for k, plane in enumerate(cube_planes())]
    approach = Approach(Scene(surfaces), 0.01, "")
    finish(approach.transport.grow(approach.transport.sent.halvings[:0]))
    approach.light.follow()
    light, f = approach.light, approach.transport.field
    found, told = [], []
    for target in (1.0, 1e-3):
        approach.refinement.link_up(target)
        finish(light.extend())
        finish(light.solve(1e-6))
        rows = finish(light.rows_at(f.points, f.normals, f.node_surface, 0.01))
        off = 0.5 * (rows.times(light.radiosity()) - light.indirect)
        found.append(norms(f, np.linalg.norm(off, axis=1))[[0, 2, 3]])
        told.append(finish(approach.check.own.linked(np.array([0, 2, 3]))))
    found, told = np.array(found), np.array(told)
    assert (told < 2 * found).all() and (told > found / 2).all()
    assert (told[1] < told[0] / 10).all()


def test_what_is_sent_too_dark_is_received_so(state, flow):
    """By a tenth, from every surface of a closed room: all of them together receive that much too little."""
    nothing = 0 * state.field.sizes()
    wrong = np.full((len(state.sent.keys), 3), (0.1, 0, 0))
    received = finish(flow.received(nothing, 0 * state.sent.sizes(), wrong))
    assert np.allclose(received, 0.1 / (1 - 0.5), rtol=0.1)
    assert np.allclose(finish(flow.received(nothing, 0 * state.sent.sizes(), -wrong)), received)


def test_links_before_the_light_is_known():
    """The ceiling is seen by no lamp: its first links are as fine as others', later ones finer if it is dark then."""
    shelf, lamp = Plane((-3, -3, 2.9), (5.9, 0, 0), (0, 6, 0)), Plane((-1, -1, 2.8), (0, 2, 0), (2, 0, 0))
    surfaces = [Surface(plane, 0.5) for plane in cube_planes()]
    surfaces += [Surface(shelf, 0.5), Surface(shelf, 0.5, side="back"), Surface(lamp, 0.5, 1.0)]
    approach = Approach(Scene(surfaces), 0.04, "")
    light, f = approach.light, approach.transport.field
    finish(approach.transport.grow(approach.transport.sent.halvings[:0]))
    light.follow()
    finish(approach.refinement.light_up(0.16, 0.04))
    finish(light.extend())
    made = approach.transport.tolerance
    reached = approach.transport.reached[f.node_surface]
    assert np.allclose(made[reached], made[reached][0]) and not len(light.coarse())
    finish(light.solve(1e-3))
    coarse = light.coarse()
    own = f.node_surface[coarse]
    assert (own == 1).sum() > 0.8 * (f.node_surface == 1).sum() and not (own == 0).any()
    finish(light.extend())
    assert (approach.transport.tolerance[coarse] < made[coarse] / 2).all() and not len(light.coarse())


def test_only_what_was_too_large_is_looked_at_again(monkeypatch):
    """The dark back of a panel close under a ceiling: the whole scene's error is small long before its own."""
    panel, seen, told = Plane((-1, -1, 2.93), (0, 2, 0), (2, 0, 0)), [], []
    surfaces = [Surface(plane, 0.7, name="wall") for plane in cube_planes()]
    surfaces += [Surface(panel, 0.2, 5.0), Surface(panel, 0.2, side="back")]
    look = Check._look

    def watched(check, seed, samples, some):
        told.append(check.own.errors)
        seen.append((some, samples))
        return look(check, seed, samples, some)

    monkeypatch.setattr(Check, "_look", watched)
    solution = solve(Scene(surfaces), 0.04)
    assert solution.error <= 0.04 and not solution.warnings and solution.surface_errors[7] <= 0.16
    (first, many), (again, few) = seen[0], seen[1]
    assert first.sum() > 6 and again[7] and told[1][7] > 0.16 and again.sum() < 4 and few < many


def test_what_points_have_in_common_is_told_from_chance():
    """Of four points on each of 30 surfaces all are a tenth too dark, by chance as much either way; one by half."""
    rng = np.random.default_rng(2)
    surface, light = np.repeat(np.arange(30), 4), 1 + rng.random((120, 3))
    wrong = 0.1 + 0.1 * rng.normal(size=(120, 3))
    wrong[surface == 7] = 0.5
    ratio = Residual([Look(surface, light, np.ones(120), None, None)], wrong * light).ratios(light, 31)
    assert np.allclose(ratio[7], 0.5) and not ratio[30].any()
    common = np.median(ratio[:30], axis=0)
    assert np.allclose(common, 0.11, atol=0.03) and (np.abs(ratio[:30] - common) < 1e-9).mean() > 0.5


@pytest.mark.parametrize("gap", [0.1, 0.2, 0.4])
def test_first_links_of_what_sees_only_what_no_lamp_shines_on(gap):
    """A panel's back close under the ceiling: the links were as coarse as can be, as if that were evenly black."""
    panel = Plane((-1, -1, 3 - gap), (0, 2, 0), (2, 0, 0))
    surfaces = [Surface(plane, 0.5) for plane in cube_planes()]
    approach = Approach(Scene([*surfaces, Surface(panel, 0.5, 5.0), Surface(panel, 0.5, side="back")]), 0.04, "")
    light = approach.light
    finish(approach.transport.grow(approach.transport.sent.halvings[:0]))
    light.follow()
    finish(approach.refinement.light_up(0.16, 0.04))
    finish(light.extend())
    finish(light.solve(1e-3))
    off = finish(approach.check.own.linked(np.array([7])))
    assert off < 0.5 * light.shared.norm[7]
