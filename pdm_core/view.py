"""What oriented points receive from sources, behind candidate occluders: pairs in, form factors out.

Each (point, source) pair brings a list of candidate occluders. Here those that cannot hide anything are dropped,
the order in depth is decided, and the rest goes to the exact contour integral, some thousand entries at once.
"""

from collections import Counter

import numpy as np

from .at_once import AT_ONCE, CACHED, later, parts, runs, slices
from .closed_forms import divide, dot, sphere_unoccluded
from .contour import polygon_unoccluded
from .regions import Occluders, ball_source, covers_directions, polygon_region, sky_source
from .sampled import Met, sampled_factors
from .sift import height_over, sift
from .visible_integral import visible_integral


def _on_plane(height, tolerance):
    """Heights m of corners, those within the tolerance 0: what lies in a plane is not cut by it."""
    return np.where(np.abs(height) > tolerance, height, 0.0)


def _overlapping(table, x, pair, occluder):
    """Entries (pair, occluder), sorted by pair, that overlap another of the same pair: indices (entry, later entry)."""
    d, r = table.origin.take(occluder, axis=1) - x.take(pair, axis=1), table.bound[occluder]
    length = np.sqrt(dot(d, d))
    axis, sin = divide(d, length), np.minimum(divide(r, length), 1.0)
    cos = np.sqrt(1 - sin * sin)
    around = length <= r  # from within everything overlaps
    follow = np.searchsorted(pair, pair, side="right") - np.arange(len(pair)) - 1
    found = [np.zeros((2, 0), int)]
    for e, other in later(follow):
        apart = dot(axis.take(e, axis=1), axis.take(other, axis=1)) < cos[e] * cos[other] - sin[e] * sin[other] - 1e-9
        found.append(np.stack([e, other])[:, ~apart | around[e] | around[other]])
    return np.concatenate(found, axis=1)


def padded(count, row, value):
    """Values of rows (ascending) as an array (count, width), padded with -1."""
    number = np.bincount(row, minlength=count)
    out = np.full((count, number.max(initial=0)), -1)
    out[row, np.arange(len(row)) - (np.cumsum(number) - number)[row]] = value
    return out


def _source(table, x, n, source, corners, sky):
    if sky:
        return sky_source(n)
    if corners is None:
        return ball_source(table.balls(x, source), n)
    height = _on_plane(dot(n[:, None], corners), table.tolerance)
    return polygon_region(corners, height, table.tolerance, closing=n)


def _occluders(table, x, corners, pair, occluder):
    """Occluders of entries (pair, occluder), sorted by pair; corners: of their sources, if these are polygons."""
    ball, polygon = table.by_kind(occluder)
    outlines = table.polygon(x.take(pair[polygon], axis=1), occluder[polygon])
    height = np.ones(outlines.shape[1:])
    if corners is not None:  # only what is before the source hides any of it
        height = _on_plane(height_over(corners.take(pair[polygon], axis=2), outlines), table.tolerance)
    covers = covers_directions(outlines, height, table.tolerance)
    if not covers.all():
        keep = np.ones(len(pair), bool)
        keep[polygon] = covers
        pair, occluder = pair[keep], occluder[keep]
        outlines, height = outlines[:, :, covers], height[:, covers]
        ball, polygon = table.by_kind(occluder)
    number = np.empty(len(pair), int)
    number[polygon], number[ball] = np.arange(len(polygon)), np.arange(len(ball))
    e, other = _overlapping(table, x, pair, occluder)
    e, other = np.concatenate([e, other]), np.concatenate([other, e])
    one, two = (np.isin(k, ball) for k in (e, other))
    polygon_polygon, polygon_ball, ball_ball = (
        (number[e[both]], number[other[both]]) for both in (~one & ~two, ~one & two, one & two)
    )
    shape = occluder[polygon]
    return Occluders(
        polygon_region(outlines, height, table.tolerance),
        pair[polygon],
        table.balls(x.take(pair[ball], axis=1), occluder[ball]),
        pair[ball],
        polygon_polygon,
        polygon_ball,
        ball_ball,
        first=shape[polygon_polygon[1]] < shape[polygon_polygon[0]],
    )


def _visible(table, x, n, source, corners, sky, pair, occluder):
    """Factors (m,) of sources behind the occluders of entries (pair, occluder)."""
    region = _source(table, x, n, source, corners, sky)
    return visible_integral(n, region, _occluders(table, x, corners, pair, occluder), table.rounding)


def _unoccluded(table, x, n, source, corners, sky):
    if sky:
        return np.ones(x.shape[1])
    if corners is not None:
        return polygon_unoccluded(np.zeros_like(x.T), n.T, np.transpose(corners, (2, 1, 0)))
    radius = table.radius[source]
    out = sphere_unoccluded(x.T, n.T, table.origin[:, source].T, np.where(radius > 0, radius, table.bound[source]))
    nothing = np.zeros(0, int)
    for part in parts(np.nonzero(radius == 0)[0], CACHED):
        out[part] = _visible(table, x[:, part], n[:, part], source[part], None, False, nothing, nothing)
    return out


def visible_factors(table, points, normals, source, corners=None, occluders=None, sky=False, counts=None, met=None):
    """Exact form factors (m,) from points (m, 3) m with unit normals (m, 3) to the visible part of their sources.

    source (m,): shape indices. Planes: corners (m, 4, 3) m of the part that is the source. Balls: corners None,
    seen from outside. sky: all directions, up to the inner side of sphere `source`, or without end where it is -1.
    occluders (m, k): candidate shape indices padded with -1; may contain the source and shapes that hide nothing.
    counts: a Counter that is told how many pairs were free, exact or sampled; met: Met of the table, kept from call to
    call. Error about 1e-14, or that of the sampled fallback (1e-3, at most 4e-3) where shapes cross each other.
    """
    counts, met = Counter() if counts is None else counts, Met(table) if met is None else met
    out = np.empty(len(points))
    source = np.broadcast_to(np.asarray(source), len(points))
    for part in slices(len(points), AT_ONCE):
        x, n = np.ascontiguousarray(points[part].T), np.ascontiguousarray(normals[part].T)
        c = None if corners is None else np.ascontiguousarray(np.transpose(corners[part], (2, 1, 0))) - x[:, None]
        candidates = None if occluders is None else occluders[part]
        out[part] = _batch(table, x, n, source[part], c, candidates, sky, counts, met)
    return out


def _batch(table, x, n, source, corners, occluders, sky, counts, met):
    m = x.shape[1]

    def pick(index):
        part = None if corners is None else corners.take(index, axis=2)
        return x.take(index, axis=1), n.take(index, axis=1), source[index], part, sky

    pair, slot = np.nonzero(occluders >= 0) if occluders is not None and occluders.size else (np.zeros(0, int),) * 2
    if not len(pair):
        counts["free"] += m
        return _unoccluded(table, x, n, source, corners, sky)
    occluder = occluders[pair, slot]
    active, dark, crossing = sift(table, x, n, source, corners, pair, occluder, sky)
    sampled, lit = crossing & ~dark, ~crossing & ~dark
    entry = active & lit[pair]
    pair, occluder = pair[entry], occluder[entry]
    number = np.bincount(pair, minlength=m)
    whole = np.nonzero(lit & (number == 0))[0]
    counts["free"] += len(whole)
    counts["exact"] += int(lit.sum()) - len(whole)
    out = np.zeros(m)
    out[whole] = _unoccluded(table, *pick(whole))
    if corners is not None:  # the rest get nothing
        number[~covers_directions(corners, dot(n[:, None], corners), table.tolerance)] = 0
        pair, occluder = pair[number[pair] > 0], occluder[number[pair] > 0]
    rows = np.nonzero(number)[0]
    for group in (rows[some] for some in runs(number[rows], CACHED)):
        e = slice(*np.searchsorted(pair, [group[0], group[-1] + 1]))
        out[group] = _visible(table, *pick(group), np.searchsorted(group, pair[e]), occluder[e])
    out = np.maximum(out, 0.0)
    index = np.nonzero(sampled)[0]
    counts["sampled"] += len(index)
    if len(index):
        these = pick(index)
        out[index] = sampled_factors(met, table, *these, occluders[index], _unoccluded(table, *these))
    return out
