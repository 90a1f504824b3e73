"""Polygons as rectangles, where they are made of those."""

import numpy as np

from ..coincident import apart
from ..outlines import edges_of
from ..tolerances import TINY
from .plane import Plane

NARROW = 1e-5  # of the longer side: how far apart edges of rectangles are


def rectangles(loops):
    """[Plane], from one height at which it has a corner to the next; None if it has edges that are not upright or
    level, or corners at all but the same height."""
    corner, axes, sides = loops.rectangle
    p, q = edges_of(loops.in_rectangle)
    size = sides.max()
    if (np.abs(q - p).min(axis=1) > TINY * size).any():
        return None
    y = apart(np.concatenate([p[:, 1], q[:, 1]]), TINY * size)
    x = apart(p[:, 0], TINY * size)
    if min(np.diff(x).min(), np.diff(y).min()) < NARROW * size:
        return None
    upright = np.abs(q - p)[:, 1] > NARROW * size
    at, low, high = p[upright, 0], *np.sort([p[upright, 1], q[upright, 1]], axis=0)
    open_, done = {}, []  # spans, (start, end) in x, that go on upwards: the height at which each began
    for middle, bottom in zip(np.append((y[:-1] + y[1:]) / 2, np.inf), y):
        spans = np.sort(at[(low < middle) & (middle < high)])
        spans = {tuple(span) for span in np.searchsorted(x, spans.reshape(-1, 2) - NARROW * size / 2).tolist()}
        for span in open_.keys() - spans:
            done.append((*x[list(span)], open_.pop(span), bottom))
        for span in spans - open_.keys():
            open_[span] = bottom
    ends = np.array(done)[:, [0, 2, 1, 2, 1, 3, 0, 3]].reshape(-1, 4, 2)
    return [Plane.through(corners) for corners in corner + ends @ axes]
