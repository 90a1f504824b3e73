"""Loops of straight edges in a plane, (k, 2) each: what they enclose, what crosses them, what of them is nearest.

Edges are p -> q, (k, 2) each, of all loops together.
"""

import numpy as np

from .at_once import AT_ONCE, slices


def edges_of(loops):
    """Loops [(k, 2 or 3)] -> starts and ends of all their edges, (n, 2 or 3) each."""
    return np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])


def without_repeats(loop):
    """A loop (k, 3) without corners that repeat the one before them."""
    return loop[(loop != np.roll(loop, 1, axis=0)).any(axis=1)]


def signed_area(loop):
    """Of a loop (k, 2); positive if counter-clockwise."""
    x, y = (loop - loop[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def moments(loops):
    """Area, centroid (2,) and second moments (2, 2) about it, over the area, of what loops enclose with their sign."""
    p, q = edges_of(loops)
    middle = p.mean(axis=0)
    p, q = p - middle, q - middle
    part = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) / 2
    area = part.sum()
    centroid = part @ (p + q) / (3 * area)
    sums = [np.einsum("k,ki,kj->ij", part, a, b) for a, b in ((p, p), (q, q), (p + q, p + q))]
    return float(area), middle + centroid, sum(sums) / (12 * area) - np.outer(centroid, centroid)


def enclosed(points, loops):
    """Whether points (n, 2) are within an odd number of loops -> (n,)"""
    (px, py), (qx, qy) = (a.T for a in edges_of(loops))
    slope = (qx - px) / np.where(qy == py, 1.0, qy - py)
    out = np.empty(len(points), bool)
    for part in slices(len(points), AT_ONCE // len(px)):
        x, y = points[part].T[..., None]
        crossed = ((py <= y) != (qy <= y)) & (x < px + (y - py) * slope)
        out[part] = crossed.sum(axis=1) % 2 == 1
    return out


def nearest_on_edges(points, loops):
    """Nearest points (n, 2) of the loops' edges to points (n, 2)."""
    p, q = edges_of(loops)
    d = q - p
    square = np.maximum((d * d).sum(axis=1), 1e-300)
    out = np.empty((len(points), 2))
    for part in slices(len(points), AT_ONCE // len(p)):
        offset = points[part, None] - p
        t = np.clip((offset * d).sum(axis=2) / square, 0.0, 1.0)
        step = offset - t[..., None] * d
        best = np.argmin((step * step).sum(axis=2), axis=1)
        out[part] = p[best] + np.take_along_axis(t, best[:, None], axis=1) * d[best]
    return out


def crossing(loops, margin):
    """Two edges (indices) that cross each other by more than margin, or None."""
    p, q = edges_of(loops)
    low, high = np.minimum(p, q), np.maximum(p, q)
    for part in slices(len(p), AT_ONCE // len(p)):
        near = (low[part, None] <= high).all(axis=2) & (high[part, None] >= low).all(axis=2)
        i, j = np.nonzero(near)
        i = i + part.start
        i, j = i[i < j], j[i < j]
        parted = _parts(p[i], q[i], p[j], q[j], margin) & _parts(p[j], q[j], p[i], q[i], margin)
        if parted.any():
            return int(i[parted][0]), int(j[parted][0])
    return None


def _parts(p, q, a, b, margin):
    """Whether lines p q (n, 2) have points a and b (n, 2) on either side, further than margin from them."""
    d = q - p
    d = d / np.maximum(np.hypot(*d.T), 1e-300)[:, None]
    sides = [d[:, 0] * (c - p)[:, 1] - d[:, 1] * (c - p)[:, 0] for c in (a, b)]
    return (np.minimum(*sides) < -margin) & (np.maximum(*sides) > margin)
