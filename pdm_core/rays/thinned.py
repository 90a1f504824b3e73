"""Indirect light at many places of a surface: gathered at a few of them and interpolated between, where it is smooth.

Between its neighbours light is linear in the place and in the normal, by least squares whose weights end smoothly: no
seam shows. Each place where it is gathered is foretold by the others there too; where one of them is not foretold,
more are taken, in the end all. What lamps give is no part of this: shadows are as sharp as they are.
"""

import numpy as np

from ..at_once import AT_ONCE, entries_of, in_turn, runs
from ..nearest import BITS
from ..shapes.shape import SIDES, side_of
from ..signs_of_life import in_thread

MANY = 64  # places of a surface from which on they may be too many: of fewer, several looks cost more than one
EACH = 32, 8  # of them in a cell, of which light is gathered at two, at first and where that does not tell
AROUND = 1.5  # cells within which others count
ALIKE = 0.5  # cosine of normals from which on they do
FORETOLD = 1.0  # of the target: how far a place may be off what the others foretell
RIDGE = 1e-3  # of the sum of weights: what slopes cost that nothing tells


def thinned(gather, receivers, tolerance, apart):
    """gather(receivers) -> light (n, 3), a generator; the light (n, 3) of receivers, whose light may be off by
    tolerance (n,), and is gathered where apart (n,) bool, as it may jump there; yields."""
    number = np.where(receivers.surface >= 0, receivers.surface, receivers.surface.max(initial=0) + 1)
    surfaces = np.unique(receivers.surface[receivers.surface >= 0])
    many = surfaces[np.bincount(number[~apart], minlength=number.max(initial=0) + 1)[surfaces] >= MANY]
    out, known = np.zeros((len(receivers), 3)), np.zeros(len(receivers), bool)
    sheets = [Sheet(receivers, np.flatnonzero(number == k), tolerance, apart) for k in many]
    which = np.flatnonzero(apart | ~np.isin(number, many))
    for each in EACH:
        which = np.concatenate([which, *(sheet.chosen(each) for sheet in sheets)])
        out[which] = yield from gather(receivers.take(which))
        known[which] = True
        for sheet in sheets:
            yield from in_thread(sheet.interpolate, out, known)
        which = np.zeros(0, int)
    rest = np.concatenate([which, *(sheet.left for sheet in sheets)])
    if len(rest):
        out[rest] = yield from gather(receivers.take(rest))
    return out


class Sheet:
    """The receivers `mine` (n,) of one surface; left (k,): those whose light is not known yet."""

    def __init__(self, receivers, mine, tolerance, apart):
        self.mine = self.left = mine = mine[~apart[mine]]
        self.points, self.normals, self.tolerance = receivers.points, receivers.normals, np.maximum(tolerance, 1e-150)
        self.low = self.points[mine].min(axis=0)
        self.size = max(float(np.ptp(self.points[mine], axis=0).max()), 1e-300)
        self.level, self.off = np.zeros(len(receivers), np.int8), np.full(len(receivers), np.inf)
        self.is_bent = np.ptp(self.normals[mine], axis=0).any()

    def chosen(self, each):
        """(k,) Of those of each cell that look one way the lowest and the highest, which are of two layers where these
        lie close; cells are halved until they hold at most `each`: sets `level`, how often."""
        self.level[self.mine] += 1  # of those that are known, as the others lie closer from now on
        side, open_ = side_of(self.normals[self.left]), np.arange(len(self.left))
        out = [np.zeros(0, int)]
        for level in range(BITS - 2):
            mine = self.left[open_]
            points, own = self.points[mine], side[open_]
            key = SIDES * _numbered(self._cells(points, self.size / 2**level)) + own
            order = np.lexsort((points[np.arange(len(points)), own // 2], key))
            ends = np.flatnonzero(np.diff(key[order], prepend=-1, append=-1))
            few = np.diff(ends) <= each
            self.level[mine] = level
            out += [mine[order[ends[:-1][few]]], mine[order[ends[1:][few] - 1]]]
            open_ = open_[np.sort(order[np.repeat(~few, np.diff(ends))])]
            if not len(open_):
                break
        return np.unique(np.concatenate([*out, self.left[open_]]))

    def interpolate(self, out, known):
        """Fills in the light out (all, 3) where it is foretold well by that of those that are known."""
        some, rest = self.mine[known[self.mine]], self.left[~known[self.left]]
        good = np.zeros(len(rest), bool)
        for level, which in self._by_level(some):
            told, _ = self._fitted(some[which], out, some, level)
            off = np.linalg.norm(told - out[some[which]], axis=1) / self.tolerance[some[which]]
            self.off[some[which]] = np.fmin(self.off[some[which]], off)
        for level, which in self._by_level(rest):
            told, worst = self._fitted(rest[which], out, some, level, self.off)
            good[which] = np.isfinite(told).all(axis=1) & (worst <= 1)
            out[rest[which]] = told
        self.left = rest[~good]

    def _by_level(self, which):
        """Yields how often cells are halved, and which (k,) of places (n,) lie in such."""
        for level in np.unique(self.level[which]):
            yield level, np.flatnonzero(self.level[which] == level)

    def _cells(self, points, width):
        return np.minimum((points - self.low) / width, (1 << BITS) - 4).astype(np.int64) + 1

    def _fitted(self, which, light, some, level, off=None):
        """The light (k, 3) of places which (k,), from light (all, 3) at the places some (m,), themselves left out: nan
        where too few are near, of cells halved so often; and the largest of off (all,) that counts there."""
        width = AROUND * self.size / 2.0**level
        numbers = _numbered(self._cells(self.points[some], width))
        order = np.argsort(numbers, kind="stable")
        numbers, ordered = numbers[order], some[order]
        cells, cell_of = np.unique(_numbered(self._cells(self.points[which], width)), return_inverse=True)
        steps = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 3, indexing="ij"), -1).reshape(-1, 3)
        beside = cells[:, None] + (steps << (BITS * np.arange(2, -1, -1))).sum(axis=1)
        first = np.searchsorted(numbers, beside, "left")
        count = np.searchsorted(numbers, beside, "right") - first
        lists, total = (first.ravel(), count.ravel()), count.sum(axis=1)
        told, worst = np.full((len(which), 3), np.nan), np.full(len(which), np.inf)
        for run in runs(total[cell_of], 4 * AT_ONCE):
            block, _ = in_turn(np.full(run.stop - run.start, 27))
            key = (27 * cell_of[run][:, None] + np.arange(27)).ravel()
            whose, entry = entries_of(lists, key)
            weight, row, other = self._weighed(which[run], block[whose], ordered[entry], width)
            if not len(row):
                continue
            own, begin = which[run][row], np.flatnonzero(np.diff(row, prepend=-1))
            mine = run.start + row[begin]
            terms = [(self.points[other] - self.points[own]) / width]
            terms += [self.normals[other] - self.normals[own]] if self.is_bent else []
            terms = np.concatenate([np.ones((len(row), 1)), *terms], axis=1)
            told[mine], enough = _least_squares(weight, terms, light[other], begin)
            told[mine[~enough]] = np.nan
            if off is not None:
                worst[mine] = np.maximum.reduceat(off[other], begin)
        return told, worst

    def _weighed(self, which, whose, other, width):
        """Of pairs of places which[whose] (p,) and others (p,) those that count: weights, whose, and the others."""
        gap = self.points[other] - self.points[which[whose]]
        near = 1 - np.einsum("pi,pi->p", gap, gap) / width**2
        some = np.flatnonzero((near > 0) & (other != which[whose]))
        near, whose, other = near[some], whose[some], other[some]
        cosine = np.einsum("pi,pi->p", self.normals[other], self.normals[which[whose]])
        weight = (near * np.maximum((cosine - ALIKE) / (1 - ALIKE), 0.0)) ** 2
        keep = weight > 0
        return weight[keep], whose[keep], other[keep]


def _numbered(cell):
    """(n,) one number of each cell (n, 3)."""
    return (cell << (BITS * np.arange(2, -1, -1))).sum(axis=1)


def _least_squares(weight, term, value, begin):
    """The constant (k, 3) of the linear function of terms (p, t), the first of them 1, nearest to values (p, 3), of
    pairs that begin at (k,); and whether enough of them tell it."""
    count = term.shape[1]
    a, b = np.triu_indices(count)
    products = np.add.reduceat(weight[:, None] * term[:, a] * term[:, b], begin)
    matrix = np.empty((len(begin), count, count))
    matrix[:, a, b] = matrix[:, b, a] = products
    right = np.add.reduceat((weight[:, None] * term)[:, :, None] * value[:, None], begin)
    total = matrix[:, 0, 0].copy()
    slope = np.arange(1, count)
    matrix[:, slope, slope] += RIDGE * total[:, None]
    enough = total**2 >= 3 * np.add.reduceat(weight**2, begin)  # as many as three alike
    return np.linalg.solve(matrix, right)[:, 0], enough
