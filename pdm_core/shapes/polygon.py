"""Flat shapes of any simple outline, convex or not, with holes: one shape, exact.

Its field lives on the chart of its bounding rectangle, its light is a contour integral, its triangles are only for what
needs convex pieces.
"""

from functools import cached_property

import numpy as np

from ..at_once import CACHED, slices
from ..checked import SceneError, array
from ..closed_forms import cross, divide, dot, edge_sum
from ..coincident import REACHES
from ..ears import few_and_convex, triangulated
from ..outlines import crossing, edges_of, enclosed, moments, nearest_on_edges, signed_area, without_repeats
from ..tolerances import TOUCHING
from .pieces import rectangles
from .plane import Facet
from .shape import FLATTEST, INSET, Flat, square_lattice, unit
from .triangles import into_triangles, spread_over

FLAT = 1e-4  # of the extent: corners no further from their plane are put into it, single precision's among them
SINGLE = 4 * 2**-24  # of the coordinates: what single precision and a matrix may move corners by
LONGEST = 64  # edges among which the bounding rectangle's direction is sought
TRIED = 64  # places of a cell on the border, of which those inside are used
TRIES = 64  # points of the lattice, of those wanted, that are tried before triangles are gone through


class Polygon(Flat):
    """The flat area within an outline (n, 3) m and outside its holes [(m, 3)], simple loops of straight edges.

    Its front is the side from which the outline runs counter-clockwise; holes may run either way. Local coordinates
    are (s, t) in [0, 1]^2 on the bounding rectangle, and the height along the unit normal in units of the square root
    of the rectangle's area.
    """

    plural = "polygons"

    def __init__(self, outline, holes=()):
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
        self._given = loops

    def __repr__(self):
        return f"Polygon({self.outline.tolist()}, {[hole.tolist() for hole in self.holes]})"

    @cached_property
    def normal(self):
        """(3,) unit normal of the front: Newell's, of the outline."""
        p = self._given[0] - self._given[0].mean(axis=0)
        return unit(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0))

    @cached_property
    def _off_plane(self):
        """Heights (n,) m of all given corners over the plane through their middle."""
        corners = np.concatenate(self._given)
        return (corners - corners.mean(axis=0)) @ self.normal

    @cached_property
    def _extent(self):
        """m; the diagonal of the outline's box."""
        return float(np.linalg.norm(np.ptp(self._given[0], axis=0)))

    @cached_property
    def _loops(self):
        """The outline and the holes in their plane, [(k, 3)] m, those the other way round."""
        ends = np.cumsum([len(loop) for loop in self._given])[:-1]
        height = self._off_plane
        if np.abs(height).max() <= 16 * 2**-53 * np.abs(np.concatenate(self._given)).max():
            height = 0 * height  # in it as it is
        flat = [loop - h[:, None] * self.normal for loop, h in zip(self._given, np.split(height, ends))]
        e = _longest_edge(flat[0])
        frame = np.stack([e, np.cross(self.normal, e)])
        return flat[:1] + [h[::-1] if signed_area((h - flat[0][0]) @ frame.T) > 0 else h for h in flat[1:]]

    @property
    def outline(self):
        """(n, 3) m, counter-clockwise seen from the front."""
        return self._loops[0]

    @property
    def holes(self):
        """[(m, 3)] m, clockwise seen from the front."""
        return self._loops[1:]

    @cached_property
    def _chart(self):
        """Corner (3,) m of the bounding rectangle, unit vectors (2, 3) along it, its sides (2,) m."""
        p, q = edges_of(self._loops[:1])
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

    @property
    def origin(self):
        """(3,) m; the corner of the bounding rectangle."""
        return self._chart[0]

    @cached_property
    def linear(self):
        """(3, 3) with columns along the bounding rectangle's sides and the unit normal times the root of its area."""
        _, axes, sides = self._chart
        return np.column_stack([sides[0] * axes[0], sides[1] * axes[1], np.sqrt(sides.prod()) * self.normal])

    @cached_property
    def _flat_loops(self):
        """[(k, 2)] m along the bounding rectangle's sides, from its corner."""
        corner, axes, _ = self._chart
        return [(loop - corner) @ axes.T for loop in self._loops]

    @cached_property
    def _moments(self):
        return moments(self._flat_loops)

    @property
    def area(self):
        """m^2"""
        return self._moments[0]

    @cached_property
    def triangles(self):
        """(k, 3, 3) m, corners counter-clockwise seen from the front; no corner lies within an edge of another."""
        return np.concatenate(self._loops)[triangulated(self._flat_loops)]

    @cached_property
    def few_triangles(self):
        """As triangles, but without the corners that lie straight on between their neighbours: for rays, which no seam
        lets through."""
        straight = [_straight_on(loop, TOUCHING * self._extent) for loop in self._flat_loops]
        if not any(s.any() for s in straight):
            return self.triangles
        kept = [~s if (~s).sum() > 2 else np.ones(len(s), bool) for s in straight]
        loops = [loop[k] for loop, k in zip(self._loops, kept)]
        return np.concatenate(loops)[triangulated([loop[k] for loop, k in zip(self._flat_loops, kept)])]

    @property
    def _few_in_chart(self):
        """(k, 3, 2): few_triangles in local coordinates."""
        return self.local(self.few_triangles.reshape(-1, 3))[:, :2].reshape(-1, 3, 2)

    @cached_property
    def pieces(self):
        """[Plane] rectangles where all its corners are right angles, else triangles."""
        return rectangles(self) or [Facet.of(corners, self.thickness) for corners in self.triangles]

    @property
    def facet_count(self):
        """How many of `facets` there are."""
        return len(self.few_triangles)

    @property
    def facets(self):
        """What rays meet: origin, u, v (k, 3) m, whether triangles (k,), chart (k, 2, 3), see rays.facets."""
        corners, at = self.few_triangles, self._few_in_chart
        chart = np.stack([at[:, 0], at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]], axis=2)
        o, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return o, u, v, np.ones(len(o), bool), chart

    @cached_property
    def bounds(self):
        """Centre (3,) m, the bounding rectangle's, and radius of a sphere around the shape."""
        centre = self.origin + (self.linear[:, 0] + self.linear[:, 1]) / 2
        return centre, float(np.linalg.norm(self.outline - centre, axis=1).max())

    @property
    def marks(self):
        """(12,) m; the same of the same shape, and a Plane's where it is a rectangle."""
        corner, axes, sides = self._chart
        area, centroid, spread = self._moments
        centre = corner + centroid @ axes
        reach = np.abs((self.outline - centre) @ REACHES.T).max(axis=0)
        if area < (1 - TOUCHING) * sides.prod():
            along = REACHES @ axes.T
            reach = reach + np.sqrt(np.einsum("ki,ij,kj->k", along, spread, along))
        return np.concatenate([centre, np.sqrt(area) * self.normal, reach])

    @cached_property
    def thickness(self):
        """m; the area over the longer side of the bounding rectangle."""
        return self.area / float(self._chart[2].max())

    def contains(self, local, inset=0.0):
        """Whether local points (n, 2) are within the outline and outside the holes, by at least inset m -> (n,)"""
        points = np.asarray(local, float)[:, :2] * self._chart[2]
        inside = enclosed(points, self._flat_loops)
        if inset:
            away = np.linalg.norm(points - nearest_on_edges(points, self._flat_loops), axis=1)
            inside &= away >= inset
        return inside

    @property
    def chart_area(self):
        return float(np.linalg.norm(np.cross(*self.linear[:, :2].T)))

    @classmethod
    def cells(cls, shapes, own, low, high, places):
        share, at = super().cells(shapes, own, low, high, places)
        for k in np.unique(own):
            mine = np.flatnonzero(own == k)
            inside, chosen = shapes[k]._within_cells(low[mine], high[mine], places)
            if not inside.any() and share[mine].sum() > 1 - 1e-9:  # a sliver between all places: its triangles' middles
                middles = shapes[k].local(shapes[k].triangles.mean(axis=1))[:, :2]
                inside[0], chosen[0] = 1 / TRIED, middles[np.arange(places) % len(middles)]
            share[mine] *= inside
            at[mine] = np.where((inside == 1)[:, None, None], at[mine], chosen)
        return share, at

    def _within_cells(self, low, high, places):
        """Of cells low (k, 2) to high (k, 2): the part of each (k,) inside, and so many places there (k, places, 2)."""
        tried = low[:, None] + (high - low)[:, None] * square_lattice(TRIED)
        inside = self.contains(tried.reshape(-1, 2)).reshape(tried.shape[:2])
        count = inside.sum(axis=1)
        order = np.argsort(~inside, axis=1, kind="stable")
        pick = np.take_along_axis(order, np.arange(places) % np.maximum(count, 1)[:, None], axis=1)
        return count / TRIED, np.take_along_axis(tried, pick[..., None], axis=1)

    def project(self, points):
        """points (n, 3) -> nearest points (n, 3) on the shape."""
        corner, axes, _ = self._chart
        flat = (np.asarray(points, float) - corner) @ axes.T
        outside = np.flatnonzero(~enclosed(flat, self._flat_loops))
        flat[outside] = nearest_on_edges(flat[outside], self._flat_loops)
        return corner + flat @ axes

    def inset(self, points, least):
        """points (n, 3) m -> points (n, 3) m on it that keep at least so many m, and INSET, from the border."""
        local = self.local(points)
        border = max(INSET * np.sqrt(self.area), least)
        outer = np.flatnonzero(~self.contains(local, border))
        at = self.local(self.project(points[outer]))[:, :2]
        local[outer, :2] = into_triangles(at, self._few_in_chart) if len(outer) else at
        local[:, 2] = 0.0
        return self.world(local)

    def spread(self, count):
        """Points (count, 3) m spread evenly over the area."""
        wanted = int(min(1.2 * count * self._chart[2].prod() / self.area + 16, TRIES * count))
        local = square_lattice(wanted)
        local = local[self.contains(local)][:count]
        points = self.world(np.column_stack([local, np.zeros(len(local))]))
        rest = count - len(points)
        return np.concatenate([points, spread_over(self.triangles, rest)]) if rest else points

    def problem(self):
        """What is wrong with the shape, as a sentence, or None."""
        return self._problem

    @cached_property
    def _problem(self):
        return _what_is_wrong(self)

    def parametric(self, st):
        """Points (n, 3) m at parameters (n, 2), those of its bounding rectangle, and area vectors (n, 3) m^2 of the
        front; without area outside: patches that its loops trim."""
        area = np.cross(self.linear[:, 0], self.linear[:, 1])
        return self.world(np.column_stack([st, 0 * st[:, 0]])), self.contains(st)[:, None] * area

    def parameters(self, local):
        """Local coordinates (n, 3) -> s, t (n,)"""
        return local[:, 0], local[:, 1]

    def factor(self, points, normals):
        """points (n, 3) m, unit normals (n, 3) -> (n,) irradiance / pi for radiance 1, nothing hiding it.

        Horizon-clipped and seen from either side; the contour integral (Lambert 1760), in which edges of holes run the
        other way. Absolute error about 1e-15. A point on an edge itself has no limit: move it off.
        """
        points, normals = np.asarray(points, float), np.asarray(normals, float)
        corners = np.ascontiguousarray(np.concatenate(self._loops).T)[:, :, None]
        ends = np.cumsum([0, *map(len, self._loops)])
        following = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in zip(ends[:-1], ends[1:])])
        out = np.empty(len(points))
        step = max(1, CACHED // len(following))
        for part in slices(len(points), step):
            x, n = (np.ascontiguousarray(a[part].T)[:, None] for a in (points, normals))
            out[part] = _contour(n, corners - x, following)
        return out


def _what_is_wrong(polygon):
    """As a sentence, or None."""
    if not all(np.isfinite(loop).all() for loop in polygon._given):
        return "its coordinates are not finite; apply a valid transform"
    size, reach = polygon._extent, np.abs(np.concatenate(polygon._given)).max()
    nothing = "it has no area; give it corners that are not in one line or remove it"
    if min(map(len, polygon._given)) < 3 or not size > 0:
        return nothing
    p = (polygon._given[0] - polygon._given[0][0]) / size
    if not np.linalg.norm(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)) > FLATTEST:
        return nothing
    off = np.abs(polygon._off_plane).max()
    if off > FLAT * size + SINGLE * reach:
        return f"its corners are up to {off:.2g} m off their plane; flatten it or split it into triangles"
    return _what_crosses(polygon, size)


def _what_crosses(polygon, size):
    """The same of its loops among each other; size m: of the outline."""
    outline, *holes = loops = polygon._flat_loops
    if not holes and few_and_convex(outline / size):
        return None
    if found := crossing(loops, TOUCHING * size):
        at = [np.concatenate(polygon._loops)[k].round(6).tolist() for k in found]
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
    filled = np.linalg.norm(np.cross(*np.diff(polygon.triangles, axis=1).swapaxes(0, 1)), axis=1).sum() / 2
    least = FLATTEST * size**2
    if not polygon.area > least or abs(filled - polygon.area) > TOUCHING * polygon.area + least:
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


def _contour(n, p, following):
    """Form factors (m,) of loops of edges from corners p (3, k, m), relative to the points, to those following (k,),
    clipped by the horizon, n (3, 1, m)."""
    height = dot(n, p)
    low, high = height.min(axis=0), height.max(axis=0)
    total, whole, cut = np.zeros(len(low)), np.flatnonzero(low >= 0), np.flatnonzero((low < 0) & (high > 0))
    if len(whole):
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
    up, down = (low < 0) & (high >= 0), (low >= 0) & (high < 0)
    at = p + divide(low, low - high) * (q - p)
    crosses = up | down
    middle = (np.where(crosses, at, 0.0).sum(axis=1) / np.maximum(crosses.sum(axis=0), 1))[:, None]
    angle = np.arctan2(dot(n, cross(middle, at)), dot(middle, at))
    arcs = np.where(up, angle, np.where(down, -angle, 0.0)).sum(axis=0)
    start, end = np.where(up, at, p), np.where(down, at, np.where((low < 0) & (high < 0), p, q))
    return edge_sum(n[:, 0], start, end) + arcs
