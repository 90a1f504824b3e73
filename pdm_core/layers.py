"""Planes in one plane: corners that are one, which of them lies on which side, and layers parted in turn."""

import numpy as np

from .coincident import ALONG
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


def ranks(area, order):
    """(n,) Which comes first of flat things that lie on each other: the larger, by rounded areas (n,), of equal ones
    the earlier in order (n,)."""
    rank = np.empty(len(area), int)
    rank[np.lexsort((order, -area))] = np.arange(len(area))
    return rank


def lies_toward(lit, body, two_sided, area, rank, i, j):
    """(k, 3) The unit normals of the sides of flat things i (k,) that j, which lie in their planes, lie on.

    Of all of them lit (n, 3), the unit normals of their lit sides, fronts where both are; body (n,): see bodies;
    two_sided, area (n,), rounded; rank (n,), of i below that of j.
    """
    lit, loose, first = lit.copy(), body[j] == 0, np.lexsort((rank[i], j))
    equal = area[i] == area[j]
    first = first[np.diff(j[first], prepend=-1) != 0]  # of each j the one that comes first of those it lies on
    first = first[loose[first]]
    own = lit[j]
    while True:
        toward = np.where(_behind(lit, own, body, two_sided, i, j, equal)[:, None], -lit[i], lit[i])
        # what a sheet lies on is below what lies on the sheet too, whichever is its front
        if (lit[j[first]] == toward[first]).all():
            return toward
        lit[j[first]] = toward[first]


def _behind(lit, own, body, two_sided, i, j, equal):
    """(k,) Whether j, own (k, 3) their lit sides, lie on the dark sides of i, or backs, see lies_toward."""
    same = np.einsum("ki,ki->k", lit[i], own) > 0
    # against the other one's face lies what faces it; but walls of two rooms are behind each other, and equal sheets
    # show a side each
    behind = ~same & (np.minimum(body[i], body[j]) >= np.where(equal, 0, 1))
    # what has two sides may have others on either: a body where the rest of it is, a sheet on a box or inside, as its
    # front is to be seen
    sheet = body[j] == 0
    behind |= two_sided[i] & sheet & (body[i] < 0) & ~same
    return np.where(two_sided[i] & ~sheet, (body[j] > 0) ^ same, behind)


def bodies(corners, lit, i, j, tolerance):
    """(n,) Where the rest of what flat shapes belong to is: 1 on their lit side, as of a room's walls, -1 behind it, as
    of a solid's faces, 0 where nothing shares an edge with them.

    corners (n, c, 3) m, nan where there are fewer, lit normals (n, 3), pairs i, j (k,) near each other.
    """
    shared = np.zeros(len(i), int)
    for corner in range(corners.shape[1]):
        shared += (np.abs(corners[i, corner][:, None] - corners[j]) <= tolerance).all(axis=2).any(axis=1)
    i, j = i[shared == 2], j[shared == 2]
    one, other = np.concatenate([i, j]), np.concatenate([j, i])
    known = np.isfinite(corners)
    middle = np.where(known, corners, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    ahead, back = (np.einsum("ki,ki->k", middle[b] - middle[a], lit[a]) for a, b in ((one, other), (other, one)))
    same_body = ahead * back > 0  # else another's, which begins where this one ends
    return np.sign(np.bincount(one[same_body], ahead[same_body], minlength=len(lit)))


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


def moves(normal, rank, i, j, toward):
    """(n,) By how many layers flat things, normals (n, 3), ranks (n,), are moved along these, so that of pairs i, j
    (k,) the one lies on the other's side toward (k, 3): the lowest in rank of those that lie on each other stays."""
    up = np.where(normal @ ALONG[:3] > 0, 1, -1)
    rises = up[i] * np.einsum("ki,ki->k", toward, normal[i]) > 0
    lower, upper = np.where(rises, (i, j), (j, i))
    level, label = levels(len(normal), lower, upper), connected(len(normal), lower, upper)
    order = np.lexsort((rank, label))
    stays = order[np.flatnonzero(np.diff(label[order], prepend=-1))]
    base = np.zeros(len(normal), int)
    base[label[stays]] = level[stays]
    return up * (level - base[label])
