"""Indirect light at very many places of meshes: gathered at a few of them and interpolated between, where it is smooth.

Between its neighbours light is linear in the place and in the normal, by least squares whose weights end smoothly: no
seam shows. Each place where it is gathered is foretold by the others there too; where one of them is not foretold,
more are taken, in the end all. What lamps give is no part of this: shadows are as sharp as they are.
"""

import numpy as np

from ..at_once import AT_ONCE, entries_of, in_turn, runs
from ..nearest import BITS
from ..shapes.shape import SIDES, side_of
from ..signs_of_life import in_thread

MANY = 1 << 15  # places of a surface from which on they may be too many: below, two looks cost more than one at all
EACH = 48  # of them in a cell, of which light is gathered at two: one look costs as much as many more in it
FINER = 0.25  # halvings of a cell's width, from one that is tried to the next
AROUND = 1.5  # cells within which others count
ALIKE = 0.5  # cosine of normals from which on they do
FORETOLD = 0.7  # of the target: how far a place may be off what the others foretell
RIDGE = 1e-3  # of the sum of weights: what slopes cost that nothing tells


def thinned(gather, receivers, is_mesh, tolerance):
    """gather(receivers) -> light (n, 3), a generator; the light (n, 3) of receivers, whose light may be off by
    tolerance (n,), is_mesh (n surfaces,) bool; yields."""
    number = np.where(receivers.surface >= 0, receivers.surface, len(is_mesh))
    many = (np.bincount(number, minlength=len(is_mesh) + 1) >= MANY) & np.append(is_mesh, False)
    if not many.any():
        return (yield from gather(receivers))
    out, known = np.zeros((len(receivers), 3)), np.zeros(len(receivers), bool)
    sheets = [Sheet(receivers, np.flatnonzero(number == k), tolerance) for k in np.flatnonzero(many)]

    def take(which):
        out[which] = yield from gather(receivers.take(which))
        known[which] = True

    yield from take(np.concatenate([np.flatnonzero(~many[number]), *(sheet.chosen() for sheet in sheets)]))
    for sheet in sheets:
        yield from in_thread(sheet.interpolate, out, known)
    rest = np.concatenate([sheet.left for sheet in sheets])
    if len(rest):
        yield from take(rest)
    return out


class Sheet:
    """The receivers `mine` (n,) of one surface of a mesh; left (k,): those whose light is not known yet."""

    def __init__(self, receivers, mine, tolerance):
        self.mine, self.left = mine, mine
        self.points, self.normals, self.tolerance = receivers.points, receivers.normals, tolerance
        self.low = self.points[mine].min(axis=0)
        self.size = max(float(np.ptp(self.points[mine], axis=0).max()), 1e-300)

    def chosen(self):
        """(k,) Of those of each cell that look one way the lowest and the highest, which are of two layers where these
        lie close; cells of about EACH in all: sets `cell`, their width, m."""
        points, side = self.points[self.left], side_of(self.normals[self.left])
        for halvings in np.arange(0, BITS - 1, FINER):
            self.cell = self.size / 2**halvings
            key = SIDES * _numbered(self._cells(points, self.cell)) + side
            if len(np.unique(key)) * EACH >= len(key):
                break
        order = np.lexsort((points[np.arange(len(points)), side // 2], key))
        ends = np.flatnonzero(np.diff(key[order], prepend=-1, append=-1))
        return self.left[np.union1d(order[ends[:-1]], order[ends[1:] - 1])]

    def interpolate(self, out, known):
        """Fills in the light out (all, 3) where it is foretold well by that of those that are known."""
        some, rest = self.mine[known[self.mine]], self.left[~known[self.left]]
        told, _ = self._fitted(some, out, some)
        off = np.full(len(out), np.inf)
        off[some] = np.linalg.norm(told - out[some], axis=1) / self.tolerance[some]
        off[np.isnan(off)] = np.inf
        told, worst = self._fitted(rest, out, some, off)
        good = np.isfinite(told).all(axis=1) & (worst <= 1)
        out[rest[good]] = told[good]
        self.left = rest[~good]

    def _cells(self, points, width):
        return np.minimum((points - self.low) / width, (1 << BITS) - 4).astype(np.int64) + 1

    def _fitted(self, which, light, some, off=None):
        """The light (k, 3) of places which (k,), from light (all, 3) at the places some (m,), themselves left out: nan
        where too few are near; and the largest of off (all,) that counts there."""
        width = AROUND * self.cell
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
            terms = (self.points[other] - self.points[own]) / width, self.normals[other] - self.normals[own]
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
