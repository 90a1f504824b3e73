"""Planes in one plane: corners that are one, which of them lies on which side, and layers parted in turn."""

import numpy as np

from .at_once import entries_of, lowest
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


def lies_toward(lit, body, two_sided, area, rank, i, j, beyond):
    """(k, 3) The unit normals of the sides of flat things i (k,) that j, which lie in their planes, lie on.

    Of all of them lit (n, 3), the unit normals of their lit sides, fronts where both are; body (n,): see bodies;
    two_sided, area (n,), rounded; rank (n,), of i below that of j; beyond: of pairs (p,) whether j reaches beyond i.
    """
    lit, loose, first = lit.copy(), body[j] == 0, lowest(j, rank[i])  # of each j, of those that it lies on
    equal, may_be = area[i] == area[j], two_sided[i] & loose & (body[i] != 0)
    may_be[may_be] = ~beyond(np.flatnonzero(may_be))
    first = first[loose[first]]
    own, on_body = lit[j], np.zeros(len(lit), bool)
    on_body[j[first]] = body[i[first]] != 0
    sheets = on_body[i] & on_body[j]
    while True:
        behind = _behind(lit, own, body, two_sided, i, j, equal, may_be)
        # a wall between two rooms parts what is on its sides
        behind = np.where(sheets, np.einsum("ki,ki->k", lit[i], lit[j]) < 0, behind)
        toward = np.where(behind[:, None], -lit[i], lit[i])
        # what a sheet lies on is below what lies on the sheet too, whichever is its front
        if (lit[j[first]] == toward[first]).all():
            return toward
        lit[j[first]] = toward[first]


def _behind(lit, own, body, two_sided, i, j, equal, may_be):
    """(k,) Whether j, own (k, 3) their lit sides, lie on the dark sides of i, or backs, see lies_toward.

    may_be (k,): whether j is a sheet that may be in the box or room that i is a side of.
    """
    same = np.einsum("ki,ki->k", lit[i], own) > 0
    # against the other one's face lies what faces it; but walls of two rooms are behind each other, and equal sheets
    # show a side each
    behind = ~same & (np.minimum(body[i], body[j]) >= np.where(equal, 0, 1))
    # what has two sides may have others on either: a body where the rest of it is, a sheet on a box or inside, as its
    # front is to be seen; what reaches beyond a side is not inside, and what looks into one room is in no other
    sheet, room = body[j] == 0, body[i] > 0
    inside = may_be & (same == room)
    elsewhere = np.isin(j, j[inside]) | ~may_be | ~two_sided[j]
    behind |= two_sided[i] & sheet & np.where(room, ~same & elsewhere, inside)
    return np.where(two_sided[i] & ~sheet, (body[j] > 0) ^ same, behind)


def bodies(corners, lit, i, j, tolerance):
    """Of flat shapes, corners (n, c, 3) m, nan where there are fewer, lit normals (n, 3), pairs i, j (k,) near each
    other: body, whole.

    body (n,): where the rest of what they belong to is: 1 on their lit side, as of a room's walls, -1 behind it, as of
    a solid's faces, 0 where nothing shares an edge with them. whole (n,): a number for those that go on beyond an edge
    in their plane, as tiles do: these belong to one.
    """
    shared = np.zeros((len(i), corners.shape[1]), bool)
    for corner, found in enumerate(shared.T):
        found[:] = (np.abs(corners[i, corner][:, None] - corners[j]) <= tolerance).all(axis=2).any(axis=1)
    edge = shared.sum(axis=1) == 2
    i, j, shared = i[edge], j[edge], shared[edge]
    known = np.isfinite(corners)
    middle = np.where(known, corners, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    along = np.where(shared[:, :, None], corners[i], 0.0).sum(axis=1) / 2
    apart = np.einsum("ki,ki->k", middle[i] - along, middle[j] - along) < 0
    one, other = np.concatenate([i, j]), np.concatenate([j, i])
    ahead, back = (np.einsum("ki,ki->k", middle[b] - middle[a], lit[a]) for a, b in ((one, other), (other, one)))
    goes_on = (np.maximum(np.abs(ahead), np.abs(back)) <= tolerance)[: len(i)] & apart
    goes_on &= np.einsum("ki,ki->k", lit[i], lit[j]) > 0
    whole = connected(len(lit), i[goes_on], j[goes_on])
    same_body = ahead * back > 0  # else another's, which begins where this one ends
    rest = np.bincount(whole[one[same_body]], ahead[same_body], minlength=len(lit))
    return np.sign(rest)[whole], whole


def reaches_beyond(corners, normal, piece, i, j, tolerance):
    """(k,) Whether pieces j (k,) reach beyond i (k,), in whose planes they are: of facets, corners (n, 4, 3) m, normal
    (n, 3), piece (n,) that of each, numbered by one of its facets. By their extent along the edges of i."""
    (i, j), pair = np.unique(np.stack([i, j]), axis=1, return_inverse=True)
    order, count = np.argsort(piece, kind="stable"), np.bincount(piece, minlength=len(piece))
    ends = []
    along = corners[i, 1] - corners[i, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    axes = np.stack([along, np.cross(normal[i], along)], axis=1)
    for which in (i, j):
        place, entry = entries_of((np.cumsum(count) - count, count), which)
        facet = order[entry]
        at = np.einsum("kci,kai->kca", corners[facet] - corners[i[place], :1], axes[place])
        low, high = np.full((len(i), 2), np.inf), np.full((len(i), 2), -np.inf)
        np.minimum.at(low, place, at.min(axis=1))
        np.maximum.at(high, place, at.max(axis=1))
        ends.append((low, high))
    (low, high), (first, last) = ends
    return ((first < low - tolerance) | (last > high + tolerance)).any(axis=1)[pair.reshape(-1)]


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
    stays, base = lowest(label, rank), np.zeros(len(normal), int)
    base[label[stays]] = level[stays]
    return up * (level - base[label])
