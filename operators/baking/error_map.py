"""Each vertex's estimated error as a colour."""

from dataclasses import dataclass

import numpy as np

from ..reading.picture import linear_of_srgb
from ..reporting.ramp import ramp
from .bake_points import each_of, joined
from .colour_attribute import colours_of
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
    error = error / max(size, 1e-300)
    top = float(error.max(initial=0.0))
    colours = ramp_colours(error / max(top, 1e-300))
    return ErrorMap(colours_of(targets, points, each_of(colours, points)), top)


def ramp_colours(share):
    """share (n,) of 0 to 1 -> (n, 3) linear colours of the ramp"""
    return linear_of_srgb(ramp(share))
