"""Planes in one plane: corners that are one, which of them looks where, and layers parted in turn."""

import numpy as np

from .connected import connected
from .tolerances import TOUCHING


def welded(corners, i, j, tolerance):
    """Corners (n, 4, 3) m of planes, pairs i, j (k,) near each other: those that coincide made the same, their mean."""
    pair, a, b = np.nonzero((np.abs(corners[i][:, :, None] - corners[j][:, None]) <= tolerance).all(axis=3))
    label = connected(4 * len(corners), 4 * i[pair] + a, 4 * j[pair] + b)
    flat, count = corners.reshape(-1, 3), np.bincount(label)
    first = flat[label]
    off = np.stack([np.bincount(label, (flat - first)[:, k]) for k in range(3)], axis=1) / np.maximum(count, 1)[:, None]
    return (first + off[label]).reshape(corners.shape)


def rounded(area):
    """Areas (n,) with those that differ by their rounding alone made equal."""
    order = np.argsort(area)
    steps = np.diff(area[order], prepend=area[order][:1]) > TOUCHING * area[order]
    out = np.empty(len(area), int)
    out[order] = np.cumsum(steps)
    return out


def side_of(planes, i, j, inward):
    """Of overlapping planes i, j (k,): whether they look the same way (k,), and +1 or -1 (k,), on which side of planes
    i those of j lie: the lit one, but behind it where both are walls that look into rooms of their own."""
    same = planes.lit[i] * planes.lit[j] * np.einsum("ki,ki->k", planes.normal[i], planes.normal[j]) > 0
    return same, np.where(~same & inward[i] & inward[j], -1.0, 1.0) * planes.lit[i]


def bodies(planes, i, j, tolerance):
    """Of planes, see look_inward."""
    corners = planes.corners.copy()
    corners[planes.half, 3] = np.nan  # the third one again
    return look_inward(corners, planes.lit[:, None] * planes.normal, i, j, 2 * tolerance)


def look_inward(corners, lit, i, j, tolerance):
    """(n,), (n,) Whether flat shapes, corners (n, c, 3) m, nan where there are fewer, lit normals (n, 3), pairs i, j
    (k,) near each other, look towards those that share an edge with them, as a room's walls do and a solid's do not;
    and whether they share none."""
    shared = np.zeros(len(i), int)
    for corner in range(corners.shape[1]):
        shared += (np.abs(corners[i, corner][:, None] - corners[j]) <= tolerance).all(axis=2).any(axis=1)
    i, j = i[shared == 2], j[shared == 2]
    one, other = np.concatenate([i, j]), np.concatenate([j, i])
    known = np.isfinite(corners)
    middle = np.where(known, corners, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    ahead, back = (np.einsum("ki,ki->k", middle[b] - middle[a], lit[a]) for a, b in ((one, other), (other, one)))
    same_body = ahead * back > 0  # else another's, which begins where this one ends
    loose = np.bincount(one[same_body], minlength=len(lit)) == 0
    return np.bincount(one[same_body], ahead[same_body], minlength=len(lit)) > 0, loose


def levels(n, lower, upper):
    """(n,) How many of them lie below each of n things in turn, of which those of lower (k,) lie below those of upper
    (k,)."""
    level = np.zeros(n, int)
    for _ in range(n):
        above = level.copy()
        np.maximum.at(above, upper, level[lower] + 1)
        if (above == level).all():
            break
        level = above
    return level


def lifted(corners, normal, i, j, side, step):
    """Lift planes j off planes i by `step` m to that side, in place, layer by layer -> the greatest height in m."""
    level = levels(len(corners), i, j)
    for layer in range(1, level.max(initial=0) + 1):
        top = np.flatnonzero((level[j] == layer) & (level[i] == layer - 1))
        upper, first = np.unique(j[top], return_index=True)
        pair = top[first]
        toward = side[pair][:, None] * normal[i[pair]]
        height = np.einsum("kci,ki->kc", corners[upper] - corners[i[pair], :1], toward)
        corners[upper] += (step - height)[..., None] * toward[:, None]
    return step * float(level.max(initial=0))
