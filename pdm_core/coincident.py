"""What is one and the same although given twice: found by sorting, not by comparing each with each."""

import numpy as np

from .tolerances import CLEAR

_RANDOM = np.random.default_rng(7)
REACHES = _RANDOM.normal(size=(6, 3)) / 2  # directions along which shapes' reach tells them from each other
ALONG = _RANDOM.normal(size=12)  # one along which different ones hardly ever have the same place


def apart(values, tolerance):
    """Values (k,) in order, of those within the tolerance of each other the first."""
    values = np.sort(values)
    return values[np.diff(values, prepend=-np.inf) > tolerance]


def one_and_the_same(shapes, tolerance):
    """(n,) Of each shape the first that coincides with it, front on front, to a few tolerances, m, (n,) or one."""
    marks, tolerance = np.array([shape.marks for shape in shapes]), np.broadcast_to(tolerance, len(shapes))
    place = marks @ ALONG
    order, first = np.argsort(place, kind="stable"), np.arange(len(shapes))
    reach = CLEAR * tolerance.max(initial=0.0) * np.abs(ALONG).sum()
    for step in range(1, len(shapes)):
        near = np.flatnonzero(place[order[step:]] - place[order[:-step]] <= reach)
        if not len(near):
            break
        a, b = order[near], order[near + step]
        same = np.abs(marks[a] - marks[b]).max(axis=1) <= CLEAR * np.minimum(tolerance[a], tolerance[b])
        np.minimum.at(first, np.maximum(a, b)[same], np.minimum(a, b)[same])
    return first[first]
