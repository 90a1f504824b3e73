"""Which of the two engines a scene takes."""

import numpy as np
import pytest

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.choice import MOST, choose
from pdm_core.in_depth import balls_that_cross
from pdm_core.shape_table import ShapeTable


@pytest.mark.parametrize("target", [0.1, 1e-2, 1e-6])
def test_tables_of_all_pairs_are_bounded(target):
    """However fine the target: links are for few surfaces."""
    tiles = [Surface(Plane((2.0 * k, 0, 0), (1, 0, 0), (0, 1, 0)), 0.5, 1.0) for k in np.arange(MOST + 1)]
    many, few = choose(Scene(tiles), target), choose(Scene(tiles[:8]), target)
    assert many.by_rays and not few.by_rays
    assert f"more than {MOST} surfaces" in many.why and "predicted" in few.why


@pytest.mark.parametrize(
    ("shapes", "count"),
    [
        ([Sphere.at((0, 0, 0), 1), Sphere.at((1.5, 0, 0), 1)], 1),
        ([Sphere.at((0, 0, 0), 1), Sphere.at((2.5, 0, 0), 1)], 0),  # apart
        ([Sphere.at((0, 0, 0), 1), Sphere.at((0.2, 0, 0), 0.5)], 0),  # within
        ([Sphere.at((0, 0, 0), 1), Plane((-2, -2, 0.3), (4, 0, 0), (0, 4, 0))], 1),
        ([Sphere.at((0, 0, 0), 1), Plane((-2, -2, -1), (4, 0, 0), (0, 4, 0))], 0),  # stands on it
        ([Sphere.at((0, 0, 0), 1), Plane((1.1, -2, 0.3), (4, 0, 0), (0, 4, 0))], 0),  # in its plane, but beside it
        ([Sphere.at((0, 0, 0), 1), Plane((-0.2, -0.2, 0.3), (0.4, 0, 0), (0, 0.4, 0))], 0),  # within
        ([Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), Plane((0, 0.5, -1), (1, 0, 0), (0, 0, 2))], 0),  # no ball
        ([Sphere.at((2.0 * k * 0.9, 0, 0), 1) for k in range(6)], 5),  # a chain
    ],
)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_balls_that_cross_are_counted(shapes, count, scale):
    table = ShapeTable([_grown(shape, scale) for shape in shapes])
    assert len(balls_that_cross(table)[0]) == count


def _grown(shape, scale):
    if isinstance(shape, Plane):
        return Plane(*(scale * np.array(part) for part in (shape.origin, shape.u, shape.v)))
    return Sphere.at(scale * shape.origin, scale * shape.bounds[1])


@pytest.mark.parametrize("target", [0.04, 0.01])
def test_crossings_ask_for_rays(target):
    """Links get finer all along the curve in which a ball runs through a floor; one that rests on it has none."""
    floor, lamp = Plane((-2, -2, 0), (4, 0, 0), (0, 4, 0)), Plane((-1, -1, 3), (0, 2, 0), (2, 0, 0))
    rests, sunk = (
        Scene([Surface(floor, 0.5), Surface(lamp, 0, 5.0), Surface(Sphere.at((0, 0, z), 0.5), 0.5)]) for z in (0.5, 0.3)
    )
    assert choose(sunk, target).by_rays and not choose(rests, target).by_rays
