"""The outline and the holes of a flat area: as given, in their plane, in the rectangle around them, in triangles."""

from functools import cached_property

import numpy as np

from ..checked import SceneError, array, within
from ..ears import few_and_convex, triangulated
from ..outlines import crossing, edges_of, enclosed, moments, nearest_on_edges, signed_area, without_repeats
from ..tolerances import SINGLE, TOUCHING
from .shape import ARITHMETIC, FLATTEST, ROUNDINGS, unit

FLAT = 1e-4  # of the extent: corners no further from their plane are put into it, single precision's among them
LONGEST = 64  # edges among which the bounding rectangle's direction is sought


class Loops:
    """Of the arguments of Polygon, given: [(k, 3)] m."""

    def __init__(self, outline, holes):
        try:
            given = [outline, *holes]
        except TypeError:
            raise SceneError(f"Polygon: holes are {holes!r}; give a list of outlines (n, 3)") from None
        loops = []
        for k, loop in enumerate(given):
            what = f"Polygon hole {k - 1}" if k else "Polygon outline"
            loop = array(loop, what)
            if loop.ndim != 2 or loop.shape[1] != 3 or len(loop) < 3:
                raise SceneError(f"{what} must have shape (n, 3) with at least 3 corners, not {loop.shape}")
            loops.append(without_repeats(loop))
        self.given = loops

    @cached_property
    def normal(self):
        """(3,) unit normal of the front: Newell's, of the outline."""
        p = self.given[0] - self.given[0].mean(axis=0)
        return unit(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0))

    @cached_property
    def off_plane(self):
        """Heights (n,) m of all given corners over the plane through their middle."""
        corners = np.concatenate(self.given)
        return (corners - corners.mean(axis=0)) @ self.normal

    @cached_property
    def extent(self):
        """m; the diagonal of the outline's box."""
        return float(np.linalg.norm(np.ptp(self.given[0], axis=0)))

    @cached_property
    def in_plane(self):
        """The outline and the holes in their plane, [(k, 3)] m, those the other way round."""
        ends = np.cumsum([len(loop) for loop in self.given])[:-1]
        height = self.off_plane
        if np.abs(height).max() <= ARITHMETIC * np.abs(np.concatenate(self.given)).max():
            height = 0 * height  # in it as it is
        flat = [loop - h[:, None] * self.normal for loop, h in zip(self.given, np.split(height, ends))]
        e = _longest_edge(flat[0])
        frame = np.stack([e, np.cross(self.normal, e)])
        return flat[:1] + [h[::-1] if signed_area((h - flat[0][0]) @ frame.T) > 0 else h for h in flat[1:]]

    @cached_property
    def rectangle(self):
        """Corner (3,) m of the bounding rectangle, unit vectors (2, 3) along it, its sides (2,) m."""
        p, q = edges_of(self.in_plane[:1])
        length = np.linalg.norm(q - p, axis=1)
        some = np.sort(np.argsort(-length, kind="stable")[:LONGEST])
        e = (q - p)[some] / length[some, None]
        e = unit(e - (e @ self.normal)[:, None] * self.normal)
        f = np.cross(self.normal, e)
        along, across = (p - p[0]) @ e.T, (p - p[0]) @ f.T
        area = np.ptp(along, axis=0) * np.ptp(across, axis=0)
        least = area <= (1 + FLAT) * area.min()
        k = np.flatnonzero(least & (length[some] >= (1 - TOUCHING) * length[some][least].max()))[0]
        low = along[:, k].min(), across[:, k].min()
        return p[0] + low[0] * e[k] + low[1] * f[k], np.stack([e[k], f[k]]), np.ptp([along[:, k], across[:, k]], axis=1)

    @cached_property
    def in_rectangle(self):
        """[(k, 2)] m along the bounding rectangle's sides, from its corner."""
        corner, axes, _ = self.rectangle
        return [(loop - corner) @ axes.T for loop in self.in_plane]

    @cached_property
    def moments(self):
        """See outlines.moments, of them in the rectangle."""
        return moments(self.in_rectangle)

    @cached_property
    def triangles(self):
        """(k, 3, 3) m, corners counter-clockwise seen from the front; no corner lies within an edge of another."""
        return np.concatenate(self.in_plane)[triangulated(self.in_rectangle)]

    @cached_property
    def few_triangles(self):
        """As triangles, but without the corners that lie straight on between their neighbours: for rays, which no seam
        lets through."""
        straight = [_straight_on(loop, TOUCHING * self.extent) for loop in self.in_rectangle]
        if not any(s.any() for s in straight):
            return self.triangles
        kept = [~s if (~s).sum() > 2 else np.ones(len(s), bool) for s in straight]
        loops = [loop[k] for loop, k in zip(self.in_plane, kept)]
        return np.concatenate(loops)[triangulated([loop[k] for loop, k in zip(self.in_rectangle, kept)])]

    @cached_property
    def problem(self):
        """What is wrong with them, as a sentence, or None."""
        if not all(map(within, self.given)):
            return "its coordinates are not finite or beyond all bounds; apply a valid transform"
        nothing = "it has no area; give it corners that are not in one line or remove it"
        if min(map(len, self.given)) < 3 or not self.extent > 0:
            return nothing
        size, reach = self.extent, np.abs(np.concatenate(self.given)).max()
        p = (self.given[0] - self.given[0][0]) / size
        if not np.linalg.norm(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)) > FLATTEST:
            return nothing
        off = np.abs(self.off_plane).max()
        if off > FLAT * size + ROUNDINGS * SINGLE * reach:  # what single precision and a matrix may move corners by
            return f"its corners are up to {off:.2g} m off their plane; flatten it or split it into triangles"
        return self._what_crosses()

    def _what_crosses(self):
        """The same of the loops among each other."""
        size = self.extent
        outline, *holes = loops = self.in_rectangle
        if not holes and few_and_convex(outline / size):
            return None
        if found := crossing(loops, TOUCHING * size):
            at = [np.concatenate(self.in_plane)[k].round(6).tolist() for k in found]
            return f"its edges cross each other, those from {at[0]} and {at[1]} on; give it an outline that does not"
        for k, hole in enumerate(holes):
            away = np.linalg.norm(hole - nearest_on_edges(hole, [outline]), axis=1) > TOUCHING * size
            if (away & ~enclosed(hole, [outline])).any():
                return f"its hole {k} is not within its outline; remove it or move it there"
            others = [other for other in holes if other is not hole]
            if others and enclosed(hole, others).any():
                away = np.linalg.norm(hole - nearest_on_edges(hole, others), axis=1) > TOUCHING * size
                if (away & enclosed(hole, others)).any():
                    return f"its hole {k} is within another one; remove it"
        filled = np.linalg.norm(np.cross(*np.diff(self.triangles, axis=1).swapaxes(0, 1)), axis=1).sum() / 2
        area, least = self.moments[0], FLATTEST * size**2
        if not area > least or abs(filled - area) > TOUCHING * area + least:
            return "its outline or a hole runs over itself; give it one that encloses each place once"
        return None


def _straight_on(loop, margin):
    """(k,) Which corners of a loop (k, 2) are no further than the margin from the line between their neighbours."""
    p, q = loop - np.roll(loop, 1, axis=0), np.roll(loop, -1, axis=0) - loop
    chord = p + q
    off = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) / np.maximum(np.hypot(*chord.T), 1e-300)
    return (off <= margin) & ((p * q).sum(axis=1) > 0)


def _longest_edge(loop):
    """Unit vector (3,) along the longest edge of a loop (k, 3)."""
    d = np.roll(loop, -1, axis=0) - loop
    return unit(d[np.argmax((d * d).sum(axis=1))])
