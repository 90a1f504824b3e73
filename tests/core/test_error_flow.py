"""Errors passed on as light is: a closed room of known gain, and the transposed way back against the way there."""

import numpy as np
import pytest
from rooms import cube_planes

from pdm_core import Scene, Surface
from pdm_core.error_flow import ONE_SIGNED, Flow, areas_of_nodes, density, norms
from pdm_core.links.approach import Approach
from pdm_core.signs_of_life import finish


@pytest.fixture(scope="module")
def state():
    """A lit room of reflectance .5 with rows at the first nodes."""
    surfaces = [Surface(plane, 0.5, float(k == 1)) for k, plane in enumerate(cube_planes())]
    approach = Approach(Scene(surfaces), 0.01)
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
    received = finish(flow.received(even, 0 * state.sent.sizes()))
    # all that a point sees emits ONE_SIGNED and reflects half of what it receives
    assert np.allclose(received, ONE_SIGNED / (1 - 0.5), rtol=0.1)
    areas = [s.shape.area for s in state.scene.surfaces]
    assert np.allclose(norms(state.sent, np.ones(len(received))), np.sqrt(areas))


def test_blame_adds_up_to_what_is_received(state, flow):
    rng = np.random.default_rng(3)
    error, weight = rng.random(len(state.field.level)), areas_of_nodes(state.sent)
    weight = np.where(state.sent.node_surface == 2, weight, 0.0)
    received = finish(flow.received(error, 0 * state.sent.sizes()))
    blamed = finish(flow.blame(weight, error[:, None] * (1, 0)))
    assert (blamed >= 0).all() and not blamed[state.field.child >= 0].any() and not blamed[:, 1].any()
    blamed = blamed[:, 0]
    assert np.isclose(blamed.sum(), weight @ received, rtol=0.1)
    # half the error of one leaf is half of its part
    worst = np.argmax(blamed)
    error[worst] /= 2
    less = weight @ received - weight @ finish(flow.received(error, 0 * state.sent.sizes()))
    assert np.isclose(less, blamed[worst] / 2, rtol=0.2)


def test_what_links_are_off_by_is_told_at_a_few_nodes():
    surfaces = [Surface(plane, 0.5, float(k == 1)) for k, plane in enumerate(cube_planes())]
    approach = Approach(Scene(surfaces), 0.01)
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
        told.append(finish(approach.check.linked(np.array([0, 2, 3]))))
    found, told = np.array(found), np.array(told)
    assert (told < 2 * found).all() and (told > found / 2).all()
    assert (told[1] < told[0] / 10).all()
