"""Outlines of flat groups of faces: closed loops of their borders, all at once. numpy only, no bpy."""

from dataclasses import dataclass

import numpy as np

from .mesh_flat import dot
from .mesh_topology import cross, next_in_loops

STRAIGHT = 1e-3  # rad; an outline that turns less at a vertex, and is off by no more than the rounding, goes on there


@dataclass(frozen=True, eq=False)
class PolygonShape:
    """A flat shape, local: outline (n, 3) counter-clockwise about the polygons' normals, holes [(m, 3)] clockwise."""

    outline: np.ndarray
    holes: list


def polygons_of(groups, wanted):
    """{group: PolygonShape} of those of the FlatGroups (g,) bool that are wanted, none of them tangled; without those
    whose loops are no outline with holes."""
    corner = np.flatnonzero(groups.rim & wanted[groups.of_corner])
    if not len(corner):
        return {}
    group, (start, end) = groups.of_corner[corner], groups.ends[:, corner]
    n = len(groups.faces.vertices)
    order = np.argsort(group * n + start)
    corner, group, start, end = corner[order], group[order], start[order], end[order]
    after = np.searchsorted(group * n + start, group * n + end)  # the border's next corner
    if (at_odds := groups.pinched[group]).any():  # several begin there
        place = np.full(len(groups.of_corner), -1)
        place[corner] = np.arange(len(corner))
        after[at_odds] = place[groups.around(corner[at_odds])]
    loop, rank = _loops(after)
    order = np.lexsort([rank, loop])
    loop, group, vertex = loop[order], group[order], start[order]
    begin = np.flatnonzero(np.append(True, loop[1:] != loop[:-1]))
    at = groups.faces.vertices[vertex]
    first = at[np.repeat(begin, np.diff(np.append(begin, len(loop))))]
    area = cross(at - first, at[next_in_loops(begin, len(loop))] - first) / 2
    normal = groups.normal[group[begin]]
    area = dot(np.add.reduceat(area, begin), normal) / np.maximum(groups.area[group[begin]], np.finfo(float).tiny)
    loops, sizes = _straightened(at, begin, groups.rounding[group[begin]])
    of_group = group[begin]
    sound = (np.bincount(of_group, area > 0, groups.count) == 1) & wanted
    sound &= np.bincount(of_group, sizes < 3, groups.count) == 0
    found = {}
    for k, is_outline, points in zip(of_group.tolist(), (area > 0).tolist(), loops):
        if sound[k]:
            outline, holes = found.setdefault(k, ([], []))
            (outline if is_outline else holes).append(points)
    return {k: PolygonShape(outline[0], holes) for k, (outline, holes) in found.items()}


def _loops(after):
    """loop (k,): the least place of each one's loop of a permutation; rank (k,): steps from that place, by doubling."""
    loop, jump = np.arange(len(after)), after
    for _ in range(int(len(after)).bit_length()):
        loop, jump = np.minimum(loop, loop[jump]), jump[jump]
    root = loop == np.arange(len(after))
    to_root, jump = np.where(root, 0, 1), np.where(root, np.arange(len(after)), after)
    for _ in range(int(len(after)).bit_length()):
        to_root, jump = to_root + to_root[jump], jump[jump]
    return loop, -to_root + np.where(root, -len(after), 0)  # the root first, then those farthest before it


def _straightened(at, begin, rounding):
    """[(n, 3)] points of each loop (at (k, 3), begins, rounding (l,) m) without those on a straight line, and their
    numbers.

    Vertices of what is finer than the outline lie there. A loop where the rest would be off keeps them all.
    """
    ahead = next_in_loops(begin, len(at))
    behind = np.empty_like(ahead)
    behind[ahead] = np.arange(len(at))
    before, after = at - at[behind], at[ahead] - at
    chord = at[ahead] - at[behind]
    twice = np.linalg.norm(cross(before, after), axis=1)
    off = twice / np.maximum(np.linalg.norm(chord, axis=1), np.finfo(float).tiny)
    turn = np.arctan2(twice, dot(before, after))
    short = np.minimum(np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1))
    size = np.diff(np.append(begin, len(at)))
    of = np.repeat(np.arange(len(begin)), size)
    slack = rounding[of]
    turns = ~((off <= slack) & (turn <= STRAIGHT + slack / np.maximum(short, np.finfo(float).tiny)))
    kept = np.bincount(of, turns, len(begin))
    # each point left out must lie on the line between the two kept about it
    place = np.where(turns, np.arange(len(at)), -1)
    last = np.maximum.accumulate(place)
    place = np.where(turns, np.arange(len(at)), len(at))
    following = np.minimum.accumulate(place[::-1])[::-1]
    firsts = np.minimum.reduceat(np.where(turns, np.arange(len(at)), len(at)), begin)
    lasts = np.maximum.reduceat(np.where(turns, np.arange(len(at)), -1), begin)
    last = np.where(last < begin[of], lasts[of], last)
    following = np.where(following >= (begin + size)[of], firsts[of], following)
    loose = kept < 3
    a, b = at[np.where(loose[of], 0, last)], at[np.where(loose[of], 0, following % len(at))]
    along = b - a
    share = dot(at - a, along) / np.maximum(dot(along, along), np.finfo(float).tiny)
    miss = np.linalg.norm(at - a - np.clip(share, 0, 1)[:, None] * along, axis=1)
    worst = np.maximum.reduceat(np.where(turns, 0.0, miss), begin)
    loose |= ~(worst <= 2 * rounding)
    kept = turns | loose[of]
    sizes = np.bincount(of, kept, len(begin)).astype(np.int64)
    return np.split(at[kept], np.cumsum(sizes)[:-1]), sizes
