"""What stands on flat surfaces parts their cells: light on one side of a partition is no light on the other.

Where a facet of another shape meets a surface lies a segment of its chart. A cell that it runs through is one of the
side where most of it is; what is met on the other side takes the light of the cells there.
"""

import numpy as np

from ..at_once import AT_ONCE, entries_of, in_turn, parts
from ..names import names_of
from ..shapes.shape import PARALLEL
from .lattice import NEXT
from .near_flats import ON
from .rims import rims

BORDER = 1e-4  # of a chart: on its border nothing lies beyond a segment
DENSE = 4  # points along a segment, for each of the finest cells, that tell which cells it runs through
ASIDE = 1e-7  # of the chart: to both sides of a segment that runs between cells
AROUND = np.stack(np.divmod(np.arange(25), 5), axis=1) - 2  # leaves around one, by its own size, that may stand for it
NEXT_TO = np.array([-2, -1, 1, 2])  # leaves along an axis whose values tell how they bend
SIDES = 4  # of a cell that are told apart: a power of 2
ASKED = 4  # of the places of a cell that count: from which it is tried to reach most of the others


class Standing:
    """Of Facets, and the charts of their surfaces: surface (k,) that segments lie on, ends a, b (k, 2) on its chart."""

    def __init__(self, facets, charts):
        parts = [(np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2)))]
        parts += [_segments(facets, charts, own, facet) for own, facet in facets.near_flats]
        parts.append(rims(facets, charts))
        self.surface, self.a, self.b = (np.concatenate(part) for part in zip(*parts))

    def through(self, lattice):
        """Which segments run through which leaves: Lists of segments by leaf."""
        size = lattice.size[self.surface]
        length = (np.abs(self.b - self.a) * size).max(axis=1)
        count = np.where(lattice.number[self.surface] > 0, np.ceil(DENSE * length).astype(int) + 1, 0)
        which, step = in_turn(count)
        step = step / np.maximum(count - 1, 1)[which]
        at, along = self.a[which] + step[:, None] * (self.b - self.a)[which], (self.b - self.a)[which]
        across = along[:, ::-1] * (-1, 1) / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        at = np.concatenate([at - ASIDE * across, at + ASIDE * across])
        which = np.tile(which, 2)
        some = np.flatnonzero(((at > 0) & (at < 1)).all(axis=1))
        leaf = lattice.at(self.surface[which[some]], at[some])[0]
        pairs = np.unique(leaf * len(count) + which[some])
        return Lists(*np.divmod(pairs, max(len(count), 1)), len(lattice))

    def part(self, k, p, q):
        """Whether segments k (n,) lie between places p and q (n, ..., 2) of their charts -> (n, ...)"""
        shape = (len(k), *(1,) * (p.ndim - 2), 2)
        a, b = self.a.take(k, axis=0).reshape(shape), self.b.take(k, axis=0).reshape(shape)
        along = b - a
        out = _turn(along, p - a) * _turn(along, q - a) < 0
        some = np.nonzero(out)  # few: the rest is worked out for them alone
        p, q, a, b = (np.broadcast_to(value, (*out.shape, 2))[some] for value in (p, q, a, b))
        out[some] = _turn(q - p, a - p) * _turn(q - p, b - p) <= 0
        return out

    def about(self, k, low, high):
        """(n,) Whether segments k (n,) may come into the boxes low, high (n, 2) of their charts."""
        a, b = self.a.take(k, axis=0), self.b.take(k, axis=0)
        return ((np.minimum(a, b) <= high) & (np.maximum(a, b) >= low)).all(axis=1)


class Lists:
    """Of `count` keys values (k,), keys (k,) sorted."""

    def __init__(self, keys, values, count):
        self.values, self.number = values, np.bincount(keys, minlength=count)
        self.first = np.cumsum(self.number) - self.number

    def of(self, keys):
        """keys (n,) -> positions (m,) among them and the values (m,) of each in turn."""
        which, entry = entries_of((self.first, self.number), keys)
        return which, self.values[entry]


class PartedCells:
    """Cells of a lattice, and segments that part them: places (k, PLACES, 2) of the cells on their charts."""

    def __init__(self, standing, lattice, places, hidden):
        self.standing, self.lattice, self.lists = standing, lattice, standing.through(lattice)
        self.touched = self.lists.number > 0
        alive = ~hidden[..., None]
        self.centre = (places * alive).sum(axis=1) / np.maximum(alive.sum(axis=1), 1)

    def columns(self, chart, at):
        """As Lattice.columns, without leaves beyond what stands there; where that leaves none, the nearest other."""
        leaf, weight = self.lattice.columns(chart, at)
        some = np.flatnonzero(self.touched.take(leaf).any(axis=1))
        for part in parts(some, AT_ONCE):
            left = np.where(self._apart(leaf[part], at[part], leaf.shape[1]), 0, weight[part])
            total = left.sum(axis=1, keepdims=True)
            weight[part] = np.where(total > 0, left / np.where(total > 0, total, 1), weight[part])
            self._take_nearest(leaf, at, part[total[:, 0] <= 0])
        return leaf, weight

    def _apart(self, on, at, count):
        """(h, count) Whether what stands on any of leaves on (h, j) parts places (h, 2) from the middle of each of the
        last `count` of these. Hits among the same leaves come together: of what stands there little is about them."""
        name, first, group = np.unique(names_of(on), return_index=True, return_inverse=True)
        order, number = np.argsort(group, kind="stable"), np.bincount(group, minlength=len(name))
        middles, begin = self.centre[on[first, -count:]], np.cumsum(number) - number
        low, high = (
            end(of.reduceat(at[order], begin, axis=0), of.reduce(middles, axis=1))
            for end, of in ((np.minimum, np.minimum), (np.maximum, np.maximum))
        )
        which, segment = self.lists.of(on[first].ravel())
        which //= on.shape[1]
        some = np.flatnonzero(self.standing.about(segment, low[which], high[which]))
        pairs = Lists(*np.divmod(np.unique((which[some] << 32) + segment[some]), 1 << 32), len(name))
        hit, segment = pairs.of(group)
        rows, columns = np.nonzero(self.standing.part(segment, at[hit][:, None], middles[group[hit]]))
        out = np.zeros((len(on), count), bool)
        out[hit[rows], columns] = True
        return out

    def _take_nearest(self, leaf, at, some):
        """Puts the nearest of the leaves around that are reached from places in for those of hits some (k,), if any."""
        for part in parts(some, AT_ONCE // len(AROUND)):
            around = self.lattice.around(leaf[part, 0], at[part], AROUND)
            size = self.lattice.size[self.lattice.chart[around]]
            far = np.linalg.norm((self.centre[around] - at[part][:, None]) * size, axis=2)
            far = np.where(self._apart(around, at[part], len(AROUND)), np.inf, far)
            best = far.argmin(axis=1)
            found = np.isfinite(far[np.arange(len(part)), best])
            leaf[part[found]] = around[found, best[found]][:, None]

    def surplus(self, value, off):
        """off (k, 2): how far values (k, c) of leaves half as wide along each axis may be off -> the same, where what
        stands there parts leaves, by those that it does not: light may jump there."""
        lattice, every = self.lattice, np.arange(len(off))
        middle = (lattice.corner + lattice.step / 2) / lattice.size[lattice.chart]
        out = off.copy()
        for axis in range(2):
            beside = lattice.around(every, middle, np.eye(2, dtype=int)[axis] * NEXT_TO[:, None])
            some = np.flatnonzero(self.touched | self.touched[beside].any(axis=1))
            for part in parts(some, AT_ONCE):
                two = beside[part][:, np.abs(NEXT_TO) == 1]
                apart = self._apart(np.column_stack([part, two]), self.centre[part], 2)
                there = value[np.where(apart, part[:, None], two)]
                out[part, axis] = NEXT * np.linalg.norm(there.sum(axis=1) - 2 * value[part], axis=1) / 2
        return out

    def sides(self, leaf, at):
        """(h,) On which side, < SIDES, of what stands on leaves (h,) places (h, 2) lie: 0 on that of their middles.
        Two sheets make three of them, which are told apart; of more some may not be."""
        out, some = np.zeros(len(leaf), np.int64), np.flatnonzero(self.touched.take(leaf))
        for part in parts(some, AT_ONCE):
            hit, segment = self.lists.of(leaf[part])
            apart = self.standing.part(segment, at[part][hit], self.centre[leaf[part]][hit])
            number = np.arange(len(hit)) - np.searchsorted(hit, hit)
            for bit in range(SIDES.bit_length() - 1):
                of_these = apart & (number % (SIDES.bit_length() - 1) == bit)
                out[part[hit[of_these]]] |= 1 << bit
        return out

    def other_side(self, which, places, hidden):
        """(k, PLACES) bool of cells which (k,), their places (k, PLACES, 2): those that what stands there parts from
        most of the others; hidden (k, PLACES) bool: which do not count."""
        out = np.zeros(hidden.shape, bool)
        some = np.flatnonzero(self.touched[which])
        for part in parts(some, AT_ONCE // places.shape[1]):
            cell, segment = self.lists.of(which[part])
            asked = _spread_over(~hidden[part], ASKED)
            origin = np.take_along_axis(places[part], asked[..., None], axis=1)[:, :, None]
            apart = np.zeros((*asked.shape, places.shape[1]), bool)
            found = self.standing.part(segment, origin[cell], places[part][cell][:, None])
            rows = np.nonzero(found)
            apart[cell[rows[0]], rows[1], rows[2]] = True
            number = (~apart & ~hidden[part][:, None]).sum(axis=2)
            out[part] = apart[np.arange(len(part)), number.argmax(axis=1)]
        return out


def _spread_over(which, count):
    """which (k, n) bool -> (k, count): columns of them spread over those that are, over all where none is."""
    number = np.where(which.any(axis=1), which.sum(axis=1), which.shape[1])
    order = np.argsort(~which, axis=1, kind="stable")
    return np.take_along_axis(order, np.arange(count) * number[:, None] // count, axis=1)


def _turn(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _segments(facets, charts, own, facet):
    """surface (k,), a, b (k, 2): where facets (n,) stand on flat shapes own (n,)."""
    sides, normal = facets.surface[facets.first[own]], facets.normal[facets.first[own]]
    known = sides.max(axis=1)  # of either side, whose chart is the shape's
    origin = charts.origin[known] - facets.centre
    corners = facets.corners(facet) - origin[:, None]
    height = np.einsum("nci,ni->nc", corners, normal)
    height[np.abs(height) <= ON * facets.tolerance] = 0.0
    after, above = np.roll(corners, -1, axis=1), np.roll(height, -1, axis=1)
    through = height * above < 0
    part = np.divide(height, height - above, out=np.zeros_like(height), where=through)[..., None]
    ends = np.concatenate([corners, corners + part * (after - corners)], axis=1)
    there = np.concatenate([height == 0, through], axis=1)
    along = np.cross(normal, facets.normal[facet])
    far, each = np.einsum("nci,ni->nc", ends, along), np.arange(len(ends))
    first, last = np.where(there, far, np.inf).argmin(axis=1), np.where(there, far, -np.inf).argmax(axis=1)
    a, b = (np.einsum("nij,nj->ni", charts.inverse[known, :2], ends[each, k]) for k in (first, last))
    keep = (np.linalg.norm(along, axis=1) > PARALLEL) & (first != last) & charts.has[known]
    keep &= ((np.maximum(a, b) > BORDER) & (np.minimum(a, b) < 1 - BORDER)).all(axis=1)
    out = []
    for side, sign in enumerate((1, -1)):
        some = np.flatnonzero(keep & (sides[:, side] >= 0) & (sign * height > 0).any(axis=1))
        out.append((sides[some, side], a[some], b[some]))
    return [np.concatenate(part) for part in zip(*out)]
