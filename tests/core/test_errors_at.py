"""Estimated errors at many points of many surfaces at once are those of each surface, of both kinds of solution."""

import numpy as np
import pytest
from rooms import ball_room, mixed_room

from pdm_core import solve
from pdm_core.compare import points_over
from pdm_core.signs_of_life import finish


@pytest.mark.parametrize("make", [ball_room, mixed_room])
def test_all_at_once_are_those_of_each(make):
    scene = make()
    solution = solve(scene, 0.05)
    surface, points = points_over(scene, 3000)
    error = finish(solution.estimated_error_steps(surface, points))
    assert (error >= 0).all() and error.max() > 0
    for k in np.unique(surface):
        alone = solution.estimated_error(int(k), points[surface == k])
        np.testing.assert_allclose(error[surface == k], alone, rtol=1e-12)
    # over a surface they are its own error
    floor = surface == 0
    own = solution.surface_errors[0] * solution.surface_norms[0] / np.sqrt(scene.areas[0])
    assert 0.5 < np.sqrt((error[floor] ** 2).mean()) / own < 2
