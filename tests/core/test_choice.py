"""Which of the two engines a scene takes."""

import numpy as np
import pytest

from pdm_core import Plane, Scene, Surface
from pdm_core.choice import MOST, choose


@pytest.mark.parametrize("target", [0.1, 1e-2, 1e-6])
def test_tables_of_all_pairs_are_bounded(target):
    """However fine the target: links are for few surfaces."""
    tiles = [Surface(Plane((2.0 * k, 0, 0), (1, 0, 0), (0, 1, 0)), 0.5, 1.0) for k in np.arange(MOST + 1)]
    many, few = choose(Scene(tiles), target), choose(Scene(tiles[:8]), target)
    assert many.by_rays and not few.by_rays
    assert f"more than {MOST} surfaces" in many.why and "predicted" in few.why
