"""Colours are read by no more directions than the target asks for: vertices are many, and each takes them all."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rooms import mixed_room

from pdm_core import Scene
from pdm_core.rays.check import SAFETY
from pdm_core.rays.engine import RAYS
from pdm_core.rays.refinement import REACHED, fewer_directions
from pdm_core.rays.solution import RayApproach
from pdm_core.signs_of_life import finish


def asked(read, rays, others, target=0.01):
    """What fewer_directions says where rays and the other parts are so much of what the target leaves for all."""
    allowed = REACHED * target / SAFETY
    parts = {"rays": rays * allowed, "sent": others * allowed}
    return fewer_directions(SimpleNamespace(state=SimpleNamespace(read=read, target=target), parts=parts))


@pytest.mark.parametrize("read", [512, 2048])
def test_as_few_as_the_other_parts_leave_room_for(read):
    assert asked(read, 0.2, 0.6) == read / 4
    assert asked(read, 0.2, np.sqrt(0.84)) == read / 2


def test_hardly_fewer_are_not_tried_nor_any_where_the_target_is_all_but_missed():
    assert asked(1024, 0.6, 0.6) is None
    assert asked(1024, 0.2, 1.0) is None and asked(1024, 1.2, 0.6) is None
    assert asked(RAYS, 1e-3, 0.1) is None and asked(2 * RAYS, 0.0, 0.1) == RAYS


@pytest.mark.parametrize("target", [0.02, 0.04])
def test_a_solution_with_too_many_gets_fewer_and_still_meets_its_target(target):
    approach = RayApproach(mixed_room(), target, "")
    approach.state.read = 1024
    finish(approach.steps())
    best, history = approach.best, approach.history
    assert best._state.read <= 1024 / 1.5 and best.error <= target and history[-1][1] == best.error
    assert history[-2][1] < best.error, "it stated less before"


def test_where_there_is_no_light_there_is_nothing_to_read_by_fewer():
    dark = Scene([replace(surface, emission=np.zeros(3)) for surface in mixed_room().surfaces])
    approach = RayApproach(dark, 0.04, "")
    finish(approach.steps())
    assert approach.best.error == 0 and approach.best._state.read == RAYS
