"""Each vertex's estimated error as a colour."""

from dataclasses import dataclass

import numpy as np

from ..reading.picture import linear_of_srgb
from ..reporting.ramp import ramp
from .bake_points import joined
from .colour_attribute import Colours
from .passes import SUFFIX as SUFFIXES
from .passes import names_of

SUFFIX = " Error"


@dataclass
class ErrorMap:
    """items: [Colours]; top: the error that the last colour of the ramp stands for, relative to the mean light."""

    items: list
    top: float


def error_name(attribute):
    return attribute + SUFFIX


def names_written(attribute, heat_map=True, passes=tuple(SUFFIXES)):
    """The attributes that a bake may write."""
    return (attribute, *[error_name(attribute)] * heat_map, *names_of(attribute, passes))


def heat_map_steps(solution, targets, points):
    """Generator of the fraction done; returns the ErrorMap of a Solution at the BakePoints of each target."""
    size = solution.norm / max(np.sqrt(solution.scene.areas.sum()), 1e-300)
    error = yield from solution.estimated_error_steps(*joined(points)[:2])
    errors = np.split(error / max(size, 1e-300), np.cumsum([len(p.points) for p in points])[:-1])
    top = max(float(error.max(initial=0.0)) for error in errors)
    items = [
        Colours(target.name, p.domain, p.colours(ramp_colours(error / max(top, 1e-300))))
        for target, p, error in zip(targets, points, errors, strict=True)
    ]
    return ErrorMap(items, top)


def ramp_colours(share):
    """share (n,) of 0 to 1 -> (n, 3) linear colours of the ramp"""
    return linear_of_srgb(ramp(share))
