"""What points receive of areas within straight edges: the contour integral (Lambert 1760), clipped by the horizon."""

import numpy as np

from .at_once import CACHED, slices
from .closed_forms import cross, divide, dot


def clip_edges(p, q, height_p, height_q):
    """The part of each edge p -> q with height >= 0, and the chord that closes a convex loop of them.

    p, q (3, k, m); heights (k, m). Returns start, end (3, k, m) (equal where nothing is left) and
    leave, enter (3, m), the points where the loop crosses height 0 (zero vectors where it does not).
    """
    start, end, crossing, up, down = _above(p, q, height_p, height_q)
    return start, end, *(np.where(which, crossing, 0.0).sum(axis=1) for which in (down, up))


def _above(p, q, low, high):
    """start, end (3, k, m) of the part above 0 of edges from heights low to high (k, m), where they cross it (3, k, m),
    and whether they do upwards and downwards (k, m)."""
    up, down = (low < 0) & (high >= 0), (low >= 0) & (high < 0)
    crossing = p + divide(low, low - high) * (q - p)
    end = np.where(down, crossing, np.where((low < 0) & (high < 0), p, q))
    return np.where(up, crossing, p), end, crossing, up, down


def edge_sum(n, p, q):
    """Sum over edges of angle(p, q) * n . unit(p x q); n (3, m), p, q (3, k, m) -> (m,)"""
    c = cross(p, q)
    length = np.sqrt(dot(c, c))
    return (divide(np.arctan2(length, dot(p, q)), length) * dot(n[:, None], c)).sum(axis=0)


def polygon_unoccluded(points, normals, corners):
    """points (m, 3) m, unit normals (m, 3), corners (m, k, 3) of a convex planar polygon -> (m,) form factor.

    Horizon-clipped and seen from either side (who faces whom is the caller's knowledge). Absolute error
    about 1e-15. A point on an edge itself has no limit: move it off.
    """
    x, n = (np.ascontiguousarray(a.T)[:, None] for a in (points, normals))
    c, following = np.ascontiguousarray(np.transpose(corners, (2, 1, 0))), np.r_[1 : corners.shape[1], 0]
    out = np.empty(len(points))
    for part in slices(len(points), CACHED):
        out[part] = _contour(n[..., part], c[..., part] - x[..., part], following)
    return out


def loops_unoccluded(points, normals, loops):
    """points (n, 3) m, unit normals (n, 3), loops [(k, 3)] m in a plane, holes the other way round -> (n,) form factor.

    As polygon_unoccluded, but of any simple outline.
    """
    points, normals = np.asarray(points, float), np.asarray(normals, float)
    corners = np.ascontiguousarray(np.concatenate(loops).T)[:, :, None]
    ends = np.cumsum([0, *map(len, loops)])
    following = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in zip(ends[:-1], ends[1:])])
    out = np.empty(len(points))
    for part in slices(len(points), CACHED // len(following)):
        x, n = (np.ascontiguousarray(a[part].T)[:, None] for a in (points, normals))
        out[part] = _contour(n, corners - x, following)
    return out


def _contour(n, p, following):
    """Form factors (m,) of loops of edges from corners p (3, k, m), relative to the points, to those following (k,),
    clipped by the horizon, n (3, 1, m)."""
    height = dot(n, p)
    low, high = height.min(axis=0), height.max(axis=0)
    total, whole, cut = np.zeros(len(low)), np.flatnonzero(low >= 0), np.flatnonzero((low < 0) & (high > 0))
    if len(whole) == len(low):
        total = edge_sum(n[:, 0], p, p[:, following])
    elif len(whole):
        up = p.take(whole, axis=2)
        total[whole] = edge_sum(n[:, 0].take(whole, axis=1), up, up[:, following])
    if len(cut):
        n, p, height = n.take(cut, axis=2), p.take(cut, axis=2), height.take(cut, axis=1)
        total[cut] = _clipped(n, p, p[:, following], height, height[following])
    return np.abs(total) / (2 * np.pi)


def _clipped(n, p, q, low, high):
    """As edge_sum, of what has a height low to high (k, m) above 0, and of the way along the horizon that closes it.

    That needs no order: all the loops' crossings with the horizon lie on one line, so that each adds or takes the angle
    at which it is seen from their middle.
    """
    start, end, at, up, down = _above(p, q, low, high)
    crosses = up | down
    middle = (np.where(crosses, at, 0.0).sum(axis=1) / np.maximum(crosses.sum(axis=0), 1))[:, None]
    angle = np.arctan2(dot(n, cross(middle, at)), dot(middle, at))
    arcs = np.where(up, angle, np.where(down, -angle, 0.0)).sum(axis=0)
    return edge_sum(n[:, 0], start, end) + arcs
