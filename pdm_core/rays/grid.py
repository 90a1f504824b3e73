"""Which shapes may be over which places of a plane: a grid whose lines are quantiles of the places, no tree.

Several planes lie side by side, so that few places in each do not leave most of the time to setting a grid up.
"""

import numpy as np

from ..at_once import in_turn, runs

PER_CELL = 2.0  # receivers, or twice as many boxes, whichever makes more cells
CELLS = 250  # along each axis at most: their product, planes side by side, fits the sixteen bits that are sorted fast
TABLE = 16  # entries, for each line, of the table that finds shapes' cells
SAMPLED = 4096  # receivers whose places tell the quantiles
CANDIDATES = 1 << 15  # pairs tested at once
AT_FIRST, MORE = 4, 3  # shapes of a receiver that is done by any, and times as many each time that none was
SIDE_BY_SIDE = 8192, 16384, 16  # places and shapes in all planes together, and planes, at most


def batches(count, places, facets):
    """Indices of `count` planes in turn: so many at once that few places and shapes in each do not waste time."""
    at_once = min(SIDE_BY_SIDE[0] // max(places, 1), SIDE_BY_SIDE[1] // max(facets.count, 1), SIDE_BY_SIDE[2])
    at_once = max(at_once, 1)
    return np.split(np.arange(count), np.arange(at_once, count, at_once))


def pairs_of(x, y, low, high, parted=(), done=None):
    """Yields (receiver, shape) (p,) index arrays, sorted by cell and receiver: shapes whose boxes low, high (2, m) may
    hold the receivers' places x, y (n,); parted: values of x that nothing goes across; done (n,) bool, where it is
    given: receivers that need no more, whoever asks sets them meanwhile; where pairs are many each comes with a few
    shapes at a time then, the largest ones first."""
    n = len(x)
    if not n:
        return
    planes = len(parted) + 1
    side = int(np.clip(np.sqrt(max(n, len(low[0]) / 2) / PER_CELL / planes), 1, CELLS / np.sqrt(planes)))
    lines = [_quantiles(x, side * planes), _quantiles(y, side)]
    if len(parted):
        lines[0] = np.sort(np.concatenate([lines[0], parted]))
    cell = np.searchsorted(lines[0], x, "right") * side + np.searchsorted(lines[1], y, "right")
    cell = cell.astype(np.uint16)
    order = np.argsort(cell, kind="stable")
    bounds = [(a.min(), a.max()) for a in (x, y)]
    over = (high[0] >= bounds[0][0]) & (low[0] <= bounds[0][1]) & (high[1] >= bounds[1][0]) & (low[1] <= bounds[1][1])
    shape = np.flatnonzero(over & (low <= high).all(axis=0))
    if done is not None:
        ends = zip(low[:, shape], high[:, shape], bounds)
        wide = [np.minimum(b, most) - np.maximum(a, least) for a, b, (least, most) in ends]
        shape = shape[np.argsort(-wide[0] * wide[1], kind="stable")]
    spans = [_span(line, *bound, low[k, shape], high[k, shape]) for k, (line, bound) in enumerate(zip(lines, bounds))]
    first = np.stack([span[0] for span in spans])
    wide = np.stack([span[1] for span in spans]) - first + 1
    of, column = in_turn(wide[0])
    rows, base = wide[1].take(of), (first[0].take(of) + column) * side + first[1].take(of)
    base -= np.cumsum(rows) - rows
    place = (np.repeat(base, rows) + np.arange(rows.sum())).astype(np.uint16)
    shape = np.repeat(shape.take(of), rows).take(np.argsort(place, kind="stable"))
    number = np.bincount(place, minlength=(len(lines[0]) + 1) * side)
    start = np.cumsum(number) - number
    own = cell.take(order)
    begin, left = start.take(own), number.take(own)
    most = len(shape) if done is None or left.sum() <= CANDIDATES else AT_FIRST  # few are tested sooner than sorted out
    while len(order):
        each = np.minimum(left, most)
        for run in runs(each, CANDIDATES):
            some = each[run]
            total = int(some.sum())
            if total:
                who = np.repeat(order[run], some)
                base = begin[run] - (np.cumsum(some) - some)
                yield who, shape.take(np.arange(total) + np.repeat(base, some))
        more = np.flatnonzero(left > most)
        if done is not None:
            more = more[~done.take(order.take(more))]
        order, begin, left, most = order.take(more), begin.take(more) + most, left.take(more) - most, MORE * most


def _span(lines, least, most, low, high):
    """The first and the last of the cells between lines, of places from least to most, that low..high (m,) may meet: by
    a table of evenly spaced places, not by a search for each."""
    entries = TABLE * max(len(lines), 1)
    edges = np.linspace(least, most, entries + 1)
    first, last = np.searchsorted(lines, edges[:-1], "left"), np.searchsorted(lines, edges[1:], "right")
    scale = entries / (most - least) if most > least else 0.0
    begin, end = ((np.clip(a, least, most) - least) * scale for a in (low, high))
    # a little aside, as the edges are rounded
    begin = np.clip(begin - 1e-6, 0, entries - 1).astype(np.int64)
    end = np.clip(end + 1e-6, 0, entries - 1).astype(np.int64)
    return first.take(begin), last.take(end)


def _quantiles(values, count):
    """(count - 1,) lines that part the values into about equal numbers."""
    some = np.sort(values[:: max(1, len(values) // SAMPLED)])
    return some[(np.arange(1, count) * len(some)) // count]


def side_by_side(x, y, low, high, which, of_box, count):
    """What pairs_of takes of places x, y (n,) and boxes low, high (2, m), which (n,) and of_box (m,) of `count` planes
    they lie in."""
    if count == 1 or not len(x):
        return x, y, low, high, ()
    least, most = x.min(), x.max()
    width = 1.5 * (most - least) or 1.0
    begin = np.arange(count) * width
    offset = begin.take(of_box)
    low[:, (low[0] > most) | (high[0] < least)] = np.inf
    low[0], high[0] = np.maximum(low[0], least) + offset, np.minimum(high[0], most) + offset
    return x + begin.take(which), y, low, high, most + width / 6 + begin[:-1]
