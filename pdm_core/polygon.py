"""Flat shapes of any simple outline, convex or not, with holes: one shape, exact.

Its field lives on the chart of its bounding rectangle, its light is a contour integral, its triangles are only for what
needs convex pieces.
"""

from functools import cached_property

import numpy as np

from .checked import SceneError, array
from .closed_forms import cross, divide, dot
from .coincident import REACHES
from .ears import triangulated
from .outlines import crossing, edges_of, enclosed, moments, nearest_on_edges, signed_area, without_repeats
from .scene import FLATTEST, Shape, square_lattice, unit

FLAT = 1e-4  # of the extent: corners no further from their plane are put into it, single precision's among them
SINGLE = 4 * 2**-24  # of the coordinates: what single precision and a matrix may move corners by
TOUCHING = 1e-6  # of the extent: by how much edges must cross each other, and holes leave the outline, to be refused
MISSED = 1e-6  # of the area: triangles that differ from it by more do not fill an outline that is simple
LONGEST = 64  # edges among which the bounding rectangle's direction is sought
TIED = 1e-4, 1e-6  # relative: areas of rectangles, and lengths of their edges, that count as equal
ENTRIES = 16384  # (point, edge) pairs in one contour integral: their arrays stay in a second-level cache
TRIES = 64  # points of the lattice, of those wanted, that are tried before triangles are gone through


class Polygon(Shape):
    """The flat area within an outline (n, 3) m and outside its holes [(m, 3)], simple loops of straight edges.

    Its front is the side from which the outline runs counter-clockwise; holes may run either way. Local coordinates
    are (s, t) in [0, 1]^2 on the bounding rectangle, and the height along the unit normal in units of the square root
    of the rectangle's area.
    """

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
        least = area <= (1 + TIED[0]) * area.min()
        k = np.flatnonzero(least & (length[some] >= (1 - TIED[1]) * length[some][least].max()))[0]
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
        if area < (1 - TIED[1]) * sides.prod():
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

    def project(self, points):
        """points (n, 3) -> nearest points (n, 3) on the shape."""
        corner, axes, _ = self._chart
        flat = (np.asarray(points, float) - corner) @ axes.T
        outside = np.flatnonzero(~enclosed(flat, self._flat_loops))
        flat[outside] = nearest_on_edges(flat[outside], self._flat_loops)
        return corner + flat @ axes

    def spread(self, count):
        """Points (count, 3) m spread evenly over the area."""
        wanted = int(min(1.2 * count * self._chart[2].prod() / self.area + 16, TRIES * count))
        local = square_lattice(wanted)
        local = local[self.contains(local)][:count]
        points = self.world(np.column_stack([local, np.zeros(len(local))]))
        rest = count - len(points)
        return np.concatenate([points, self._over_triangles(rest)]) if rest else points

    def _over_triangles(self, count):
        """Points (count, 3) m, of a share for each triangle by its area."""
        p, q, r = np.moveaxis(self.triangles, 1, 0)
        ends = np.cumsum(np.linalg.norm(np.cross(q - p, r - p), axis=1))
        s, t = square_lattice(count).T
        k = np.minimum(np.searchsorted(ends, s * ends[-1], side="right"), len(ends) - 1)
        s = (s * ends[-1] - ends[k]) / np.diff(ends, prepend=0.0)[k] + 1
        s = np.sqrt(np.clip(s, 0.0, 1.0))[:, None]
        return (1 - s) * p[k] + s * ((1 - t[:, None]) * q[k] + t[:, None] * r[k])

    def normals(self, points):
        """Unit normals (n, 3) of the front at points (n, 3)."""
        return np.broadcast_to(self.normal, (len(points), 3))

    def problem(self):
        """What is wrong with the shape, as a sentence, or None."""
        return self._problem

    @cached_property
    def _problem(self):
        if not all(np.isfinite(loop).all() for loop in self._given):
            return "its coordinates are not finite; apply a valid transform"
        size, reach = self._extent, np.abs(np.concatenate(self._given)).max()
        nothing = "it has no area; give it corners that are not in one line or remove it"
        if min(map(len, self._given)) < 3 or not size > 0:
            return nothing
        p = (self._given[0] - self._given[0][0]) / size
        if not np.linalg.norm(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)) > FLATTEST:
            return nothing
        off = np.abs(self._off_plane).max()
        if off > FLAT * size + SINGLE * reach:
            return f"its corners are up to {off:.2g} m off their plane; flatten it or split it into triangles"
        return self._crossed(size)

    def _crossed(self, size):
        """What is wrong with the loops, as a sentence, or None."""
        outline, *holes = loops = self._flat_loops
        if found := crossing(loops, TOUCHING * size):
            at = [np.concatenate(self._loops)[k].round(6).tolist() for k in found]
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
        if not self.area > FLATTEST * size**2 or abs(filled - self.area) > MISSED * self.area + FLATTEST * size**2:
            return "its outline or a hole runs over itself; give it one that encloses each place once"
        return None

    def factor(self, points, normals):
        """points (n, 3) m, unit normals (n, 3) -> (n,) irradiance / pi for radiance 1, nothing hiding it.

        Horizon-clipped and seen from either side; the contour integral (Lambert 1760), in which edges of holes run the
        other way. Absolute error about 1e-15. A point on an edge itself has no limit: move it off.
        """
        points, normals = np.asarray(points, float), np.asarray(normals, float)
        p, q = (np.ascontiguousarray(a.T)[:, :, None] for a in edges_of(self._loops))
        out = np.empty(len(points))
        step = max(1, ENTRIES // p.shape[1])
        for start in range(0, len(points), step):
            part = slice(start, start + step)
            x, n = (np.ascontiguousarray(a[part].T)[:, None] for a in (points, normals))
            out[part] = _contour(n, p - x, q - x)
        return out


def _longest_edge(loop):
    """Unit vector (3,) along the longest edge of a loop (k, 3)."""
    d = np.roll(loop, -1, axis=0) - loop
    return unit(d[np.argmax((d * d).sum(axis=1))])


def _contour(n, p, q):
    """Form factors (m,) of loops of edges p -> q (3, k, m) relative to the points, clipped by the horizon, n (3, 1, m).

    What closes the loops along the horizon needs no order: all their crossings with it lie on one line, so that each
    adds or takes the angle at which it is seen from their middle.
    """
    low, high = dot(n, p), dot(n, q)
    below = low < 0
    if below.any():
        up, down = below & (high >= 0), ~below & (high < 0)
        at = p + divide(low, low - high) * (q - p)
        crosses = up | down
        middle = np.where(crosses, at, 0.0).sum(axis=1) / np.maximum(crosses.sum(axis=0), 1)
        middle = middle[:, None]
        angle = np.arctan2(dot(n, cross(middle, at)), dot(middle, at))
        arcs = np.where(up, angle, np.where(down, -angle, 0.0)).sum(axis=0)
        p, q = np.where(up, at, p), np.where(down, at, np.where(below & ~up, p, q))
    else:
        arcs = 0.0
    c = cross(p, q)
    length = np.sqrt(dot(c, c))
    turn = divide(np.arctan2(length, dot(p, q)), length) * dot(n, c)
    return np.abs(turn.sum(axis=0) + arcs) / (2 * np.pi)
