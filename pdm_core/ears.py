"""Triangles of a flat outline with holes, by ear clipping: only the given vertices, none left in the middle of an edge.

Holes are joined to the outline by bridges (Eberly, Triangulation by Ear Clipping, 2002), vertices that lie on edges
are put into them, then the best-shaped ear is cut off until nothing is left. Coordinates are scaled to an extent of 1.
"""

import numpy as np

from .at_once import AT_ONCE, parts, slices
from .tolerances import TINY, TOUCHING

SPIKE = 2.0  # the quality, above any ear's, of what goes there and back
FAR = 1e9  # where vertices are put that have been cut off


def triangulated(loops):
    """loops [(k, 2)]: the outline counter-clockwise, holes clockwise -> (t, 3) indices into all of their vertices.

    Triangles are counter-clockwise and have an area. Of loops that cross themselves something is left out or doubled.
    """
    points = np.concatenate(loops)
    points = (points - points.min(axis=0)) / np.ptp(points, axis=0).max()
    if len(loops) == 1 and few_and_convex(points):
        a, b, c, d = points[[0, 1, 2, -1]]
        if len(points) == 3:
            return np.array([[0, 1, 2]])
        first = np.hypot(*(c - a)) <= np.hypot(*(d - b))  # the shorter diagonal
        return np.array([[0, 1, 2], [0, 2, 3]] if first else [[0, 1, 3], [1, 2, 3]])
    ends = np.cumsum([0, *map(len, loops)])
    rings = [_with_touching(points, np.arange(a, b)) for a, b in zip(ends[:-1], ends[1:])]
    ring = rings[0]
    for hole in sorted(rings[1:], key=lambda hole: -points[hole, 0].max()):
        ring = _bridged(points, ring, hole)
    return _Clipper(points, ring).triangles()


def few_and_convex(points):
    """Whether a loop (k, 2) of an extent of about 1 is a triangle or a convex quadrilateral, counter-clockwise."""
    if len(points) > 4:
        return False
    return bool((_turn(np.roll(points, 1, axis=0), points, np.roll(points, -1, axis=0)) > TOUCHING).all())


def _with_touching(points, ring):
    """The ring (k,) with every vertex that lies on one of its edges put in there."""
    p, q = points[ring], points[np.roll(ring, -1)]
    d = q - p
    length = np.maximum(np.hypot(*d.T), 1e-300)
    edges, vertices, places = [], [], []
    for part in slices(len(ring), AT_ONCE // len(points)):
        offset = points - p[part, None]
        along = (offset * d[part, None]).sum(axis=2) / length[part, None]
        beside = np.abs(d[part, :1] * offset[..., 1] - d[part, 1:] * offset[..., 0]) / length[part, None]
        on = (beside < TOUCHING) & (along > TOUCHING) & (along < length[part, None] - TOUCHING)
        edge, vertex = np.nonzero(on)
        edges.append(edge + part.start), vertices.append(vertex), places.append(along[edge, vertex])
    edge, vertex, place = (np.concatenate(a) for a in (edges, vertices, places))
    order = np.lexsort((place, edge))
    return np.insert(ring, edge[order] + 1, vertex[order])


def _turn(a, b, c):
    """Twice the area of triangles, points (..., 2); positive if counter-clockwise."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def _opens(points, ring, target):
    """Whether the ring's inside at each of its vertices lies in the direction of the target -> (k,)"""
    before, here, after = points[np.roll(ring, 1)], points[ring], points[np.roll(ring, -1)]
    left, right = _turn(before, here, target) >= -TINY, _turn(here, after, target) >= -TINY
    return np.where(_turn(before, here, after) > 0, left & right, left | right)


def _bridged(points, ring, hole):
    """The ring with a hole joined to it, all holes that reach further right having been so before."""
    start = int(np.argmax(points[hole, 0]))
    m, here, after = points[hole[start]], points[ring], points[np.roll(ring, -1)]
    opens = _opens(points, ring, m)
    same = np.flatnonzero(np.abs(here - m).max(axis=1) < TINY)
    if len(same):
        into = _opens(points, ring, points[hole[(start + 1) % len(hole)]])[same]
        at = same[np.argmax(into)]
    else:
        rise = after[:, 1] - here[:, 1]
        x = here[:, 0] + (m[1] - here[:, 1]) * (after[:, 0] - here[:, 0]) / np.where(rise > 0, rise, 1.0)
        ahead = (here[:, 1] <= m[1]) & (after[:, 1] > m[1]) & (x > m[0] - TOUCHING)
        if not ahead.any():  # not within the ring
            at = np.argmin(np.hypot(*(here - m).T))
        else:
            hit = np.argmin(np.where(ahead, x, np.inf))
            end = here[hit] if here[hit, 0] > after[hit, 0] else after[hit]
            at = _seen_along(here, opens, m, np.array([x[hit], m[1]]), end)
    hole = np.roll(hole, -start)
    return np.concatenate([ring[: at + 1], hole, hole[:1], ring[at:]])


def _seen_along(here, opens, m, hit, end):
    """Of vertices (k, 2) in the triangle of m, the point hit and the end of the edge there, that nearest the ray."""
    corners = [m, hit, end] if end[1] > m[1] else [m, end, hit]
    inside = np.all([_turn(a, b, here) >= -TINY for a, b in zip(corners, corners[1:] + corners[:1])], axis=0)
    step = here - m
    inside |= (here == end).all(axis=1)
    candidate = np.flatnonzero(inside & opens) if (inside & opens).any() else np.flatnonzero(inside)
    slope = np.round(np.arctan2(np.abs(step[candidate, 1]), step[candidate, 0]), 12)
    return candidate[np.lexsort((np.hypot(*step[candidate].T), slope))[0]]


class _Clipper:
    """A ring of nodes, each a vertex (several where holes are joined), from which ears are cut."""

    def __init__(self, points, ring):
        self.vertex, self.at = ring, points[ring].T.copy()
        self.site = np.unique(points[ring], axis=0, return_inverse=True)[1].ravel()  # nodes at one place
        count = len(ring)
        self.before, self.after = np.roll(np.arange(count), 1), np.roll(np.arange(count), -1)
        self.margin = TOUCHING
        self.quality = self._qualities(np.arange(count))

    def _qualities(self, nodes):
        """Of nodes (k,): area over squared longest side of the triangle cut off there, 0 where it is no ear."""
        return np.concatenate([self._ears(some) for some in parts(nodes, AT_ONCE // len(self.vertex))])

    def _ears(self, nodes):
        corners = self.before[nodes], nodes, self.after[nodes]
        (ax, ay), (bx, by), (cx, cy) = (self.at[:, k, None] for k in corners)
        x, y = self.at
        longest = np.maximum(np.hypot(bx - ax, by - ay), np.hypot(cx - bx, cy - by))
        diagonal = np.hypot(ax - cx, ay - cy)
        area = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))[:, 0]
        quality = np.maximum(area - TINY, 0.0) / np.maximum(np.maximum(longest, diagonal)[:, 0], TINY) ** 2
        over = (ax - cx) * (y - cy) - (ay - cy) * (x - cx) >= -self.margin * diagonal
        over &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -TINY
        over &= (cx - bx) * (y - by) - (cy - by) * (x - bx) >= -TINY
        for k in corners:
            over &= self.site != self.site[k, None]
        quality[over.any(axis=1)] = 0.0
        a, b, c = (self.site[k] for k in corners)
        quality[(a == c) | (a == b) | (b == c)] = SPIKE
        return quality

    def triangles(self):
        out, left = [], len(self.vertex)
        while left > 2:
            ear = int(np.argmax(self.quality))
            flat = self.quality[ear] == SPIKE
            if self.quality[ear] <= 0:
                ear, flat = self._next_best()
                if ear < 0:
                    continue
            a, c = self.before[ear], self.after[ear]
            if not flat:
                out.append((self.vertex[a], self.vertex[ear], self.vertex[c]))
            self.after[a], self.before[c] = c, a
            self.at[:, ear], self.quality[ear] = FAR, -1.0
            left -= 1
            self.quality[[a, c]] = self._ears(np.array([a, c]))
        return np.array(out, int).reshape(-1, 3)

    def _next_best(self):
        """Where no ear is left: -1 after a look with less margin; then a node without area, else the most convex."""
        nodes = np.flatnonzero(self.quality >= 0)
        if self.margin > TINY:
            self.margin = TINY
            self.quality[nodes] = self._qualities(nodes)
            return -1, False
        a, b, c = (self.at[:, k].T for k in (self.before[nodes], nodes, self.after[nodes]))
        area = _turn(a, b, c)
        flat = int(np.argmin(np.abs(area)))
        if abs(area[flat]) <= 10 * TINY:
            return int(nodes[flat]), True
        return int(nodes[np.argmax(area)]), area.max() <= 0
