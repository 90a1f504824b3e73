"""Which facets come near flat shapes that they are no part of: all that may stand on these."""

import numpy as np

from ..at_once import entries_of, runs
from ..boxes import near
from ..tolerances import FLUSH

WIDER = 2.0  # tolerances that facets reach beyond their borders, lest rays slip between those that touch
ON = FLUSH + WIDER  # within which a facet's corner lies in a plane


def near_flats(facets):
    """Yields flat shapes (k,) and facets (k,) of others whose boxes are near theirs."""
    number = np.bincount(facets.shape[: facets.count], minlength=len(facets.first))
    shapes = np.flatnonzero(number)
    if not len(shapes):
        return
    each_low, each_high = (corner[:, : facets.count] for corner in facets.boxes)
    reach = ON * facets.tolerance
    low, high = np.full((3, len(number)), np.inf), np.full((3, len(number)), -np.inf)
    low[:, shapes] = np.minimum.reduceat(each_low, facets.first[shapes], axis=1) - reach
    high[:, shapes] = np.maximum.reduceat(each_high, facets.first[shapes], axis=1) + reach
    i, j = (shapes[k] for k in near(low[:, shapes].T, high[:, shapes].T, 0.0))
    i, j = np.concatenate([i, j]), np.concatenate([j, i])
    keep = np.isin(i, facets.flat)
    i, j = i[keep], j[keep]
    for some in runs(number[j]):
        whose, facet = entries_of((facets.first, number), j[some])
        flat = i[some][whose]
        over = np.ones(len(flat), bool)
        for axis in range(3):
            over &= each_low[axis].take(facet) <= high[axis].take(flat)
            over &= each_high[axis].take(facet) >= low[axis].take(flat)
        yield flat[over], facet[over]
