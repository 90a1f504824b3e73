"""Solutions by rays against radiances of an independent path tracer."""

import pytest
import references

from pdm_core import solve


@pytest.mark.parametrize("name", references.NAMES)
def test_the_stated_error_covers_the_measured_one(name):
    data, scene, front = references.load(name)
    solution = solve(scene, 0.04)
    assert solution.error <= 0.04 and "rays" in solution.plan.lines[1]
    assert references.measured(data, scene, front, solution) <= solution.error + 0.003  # their noise
