"""Which facets of meshes come near facets of other shapes: all that may run through each other."""

import numpy as np

from ..at_once import entries_of, runs
from ..boxes import near
from ..nearest import along_curve
from .near_flats import ON

TIGHTER = 3  # times that boxes of what is near the other's are drawn closer
CLUSTER = 16  # facets of a mesh, next to each other, that are compared as one


def near_facets(facets):
    """Yields facets (k,) of meshes and facets (k,) of others whose boxes come near theirs."""
    number = np.bincount(facets.shape[: facets.count], minlength=len(facets.first))
    is_mesh = (facets.own < 0) & (number > 0)
    for flat, facet in facets.near_flats:
        some = is_mesh[facets.shape[facet]]
        which, other = entries_of((facets.first, number), flat[some])
        yield facet[some][which], other
    low, high = (end[:, : facets.count].T.copy() for end in facets.boxes)
    low, near_others = low - ON * facets.tolerance, np.zeros(facets.count, bool)
    meshes, order = np.flatnonzero(is_mesh), np.flatnonzero(is_mesh[facets.shape[: facets.count]])
    count = number[meshes]
    for _, facet, _ in _drawn_closer(order, np.cumsum(count) - count, count, meshes, low, high):
        near_others[facet] = True
    order = _along(np.flatnonzero(near_others), facets.shape, low)
    shape = facets.shape[order]
    first = np.flatnonzero(_begins(shape, np.arange(len(order))))
    count = np.diff(first, append=len(order))
    for pair, facet, half in _drawn_closer(order, first, count, shape[first], low, high):
        each = np.bincount(pair, minlength=2 * half)
        one = np.flatnonzero(pair < half)
        which, other = entries_of((np.cumsum(each) - each, each), pair[one] + half)
        one, other = facet[one[which]], facet[other]
        meet = ((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)
        one, other = one[meet], other[meet]
        yield np.concatenate([one, other]), np.concatenate([other, one])


def _along(some, shape, low):
    """some (k,) facets of shapes (m,), with low (m, 3) m, in an order in which those of a shape that follow each other
    are next to each other."""
    if not len(some):
        return some
    place = low[some]
    code = along_curve(place, place.min(axis=0), np.ptp(place, axis=0).max())
    return some[np.lexsort([code, shape[some]])]


def _begins(shape, at):
    """(k,) Whether clusters begin at places at (k,) of a list, of shapes (k,) in turn."""
    new = np.diff(shape, prepend=-1) != 0
    return (at - np.maximum.accumulate(np.where(new, at, 0))) % CLUSTER == 0


def _drawn_closer(order, first, count, shape, low, high):
    """Of lists of facets, first, count (n,) in their order (k,), of shapes (n,): yields for pairs of lists of unlike
    shapes that come near each other pair (k,), sorted, facet (k,) of what comes near what comes near of the other, and
    how many pairs: of each pair's second list pair is so much more. low, high (m, 3) m of the facets."""
    if len(first) < 2:
        return
    least, most = np.minimum.reduceat(low[order], first), np.maximum.reduceat(high[order], first)
    i, j = near(least, most, 0.0)
    unlike = shape[i] != shape[j]
    i, j = i[unlike], j[unlike]
    for some in runs(count[i] + count[j]):
        half, who, facing = len(i[some]), np.append(i[some], j[some]), np.append(j[some], i[some])
        box = least[facing], most[facing]
        pair, entry = entries_of((first, count), who)
        facet = order[entry]
        for _ in range(TIGHTER):
            keep = ((low[facet] <= box[1][pair]) & (high[facet] >= box[0][pair])).all(axis=1)
            pair, facet = pair[keep], facet[keep]
            box = _boxes_faced(pair, low[facet], high[facet], half)
        yield pair, facet, half


def _boxes_faced(pair, low, high, half):
    """low, high (2 half, 3) m: for each list the box about what is left, low, high (k, 3) m, pair (k,) sorted, of the
    one that it faces, so many further; empty where nothing is."""
    out = np.full((2 * half, 3), np.inf), np.full((2 * half, 3), -np.inf)
    some, begin = np.unique(pair, return_index=True)
    if len(some):
        facing = (some + half) % (2 * half)
        out[0][facing], out[1][facing] = np.minimum.reduceat(low, begin), np.maximum.reduceat(high, begin)
    return out
