"""Cells over the charts of surfaces: leaves of a tree each, halved along either axis where the light bends.

A leaf covers a rectangle of the chart's finest cells. Between the middles of leaves of one size values are bilinear;
where a leaf's neighbour is larger or smaller, that of the finest cell next to it stands for it.
"""

import numpy as np

from ..at_once import in_turn

FINEST = 1 << 10  # finest cells along an axis
MOST = 1 << 20  # of them on a chart
QUARTERS = 4  # of a leaf
NEXT = 0.4  # of the surplus that cells show: what is left within them


class Lattice:
    """Of n charts, with k leaves.

    size (n, 2): finest cells along each axis, powers of 2, 0 of charts without any; round_ (n,) bool: whether the last
    along the first axis is next to the first; chart (k,); corner (k, 2): the first finest cell of each leaf; level
    (k, 2): of how many halvings it is short of the finest along each axis.
    """

    def __init__(self, size, round_, chart, corner, level):
        self.size, self.round_, self.chart, self.corner, self.level = size, round_, chart, corner, level
        self.step = np.left_shift(1, level)
        self.grid = size.prod(axis=1)
        self.first = np.cumsum(self.grid) - self.grid
        self.leaf = np.full(self.grid.sum(), -1, np.int32)
        self.leaf[self._cells()] = np.repeat(np.arange(len(chart), dtype=np.int32), self.step.prod(axis=1))
        self.number = np.bincount(chart, minlength=len(size))
        self._fill()

    @classmethod
    def even(cls, size, round_):
        """All leaves are finest cells."""
        grid = size.prod(axis=1)
        chart = np.repeat(np.arange(len(size)), grid)
        index = np.arange(len(chart)) - (np.cumsum(grid) - grid)[chart]
        corner = np.column_stack(np.divmod(index, np.maximum(size[chart, 1], 1)))
        return cls(size, round_, chart, corner, np.zeros_like(corner))

    def __len__(self):
        return len(self.chart)

    def _cells(self):
        """Numbers of the finest cells of all leaves in turn."""
        count, row = self.step.prod(axis=1), self.size[self.chart, 1]
        start = self.first[self.chart] + self.corner[:, 0] * row + self.corner[:, 1]
        leaf, index = in_turn(count)
        along, across = np.divmod(index, self.step[leaf, 1])
        return start[leaf] + along * row[leaf] + across

    def _fill(self):
        """Finest cells that no leaf covers are those of the nearest leaf."""
        chart = np.repeat(np.arange(len(self.grid)), self.grid)
        for k in np.unique(chart[self.leaf < 0]):
            if self.number[k]:
                part = slice(self.first[k], self.first[k] + self.grid[k])
                self.leaf[part] = _filled(self.leaf[part].reshape(self.size[k]), self.round_[k]).ravel()

    def without(self, leaves):
        """The same but for leaves (k,) bool."""
        keep = ~leaves
        return Lattice(self.size, self.round_, self.chart[keep], self.corner[keep], self.level[keep])

    # -- values --------------------------------------------------------------------------------------------------

    def at(self, chart, at):
        """Leaves (h,) at places (h, 2) in [0, 1]^2 on charts (h,); these in finest cells, and those cells (h, 2)."""
        size = self.size.take(chart, axis=0)
        scaled = at * size
        cell = np.minimum(scaled.astype(np.int32), size - 1)
        return self.leaf.take(self.first.take(chart) + cell[:, 0] * size[:, 1] + cell[:, 1]), scaled, cell

    def around(self, own, at, offset):
        """Leaves (h, k) at places (h, 2) on the charts of leaves own (h,), moved by offset (k, 2) times their sizes."""
        chart, step = self.chart[own], self.step[own][:, None]
        size, first = self.size[chart][:, None], self.first[chart][:, None]
        cell = (at[:, None] * size + offset * step).astype(int)
        cell[..., 0] = np.where(self.round_[chart][:, None], cell[..., 0] % size[..., 0], cell[..., 0])
        cell = np.clip(cell, 0, size - 1)
        return self.leaf[first + cell[..., 0] * size[..., 1] + cell[..., 1]]

    def columns(self, chart, at):
        """Leaves (h, 4) and weights (h, 4) that interpolate at places (h, 2) in [0, 1]^2 on charts (h,)."""
        own, scaled, cell = self.at(chart, at)
        size, first = self.size.take(chart, axis=0), self.first.take(chart)
        row = size[:, 1]
        level, step = self.level.take(own, axis=0), self.step.take(own, axis=0)
        block = cell >> level
        part = (scaled / step - block).astype(np.float32)
        beyond = part >= 0.5
        next_ = np.where(beyond, (block + 1) << level, (block << level) - 1)
        next_[:, 0] = np.where(self.round_.take(chart), next_[:, 0] % size[:, 0], next_[:, 0])
        next_ = np.where((next_ < 0) | (next_ >= size), cell, next_)
        x, y = np.abs(part - 0.5).T
        ends = [(cell[:, 0], next_[:, 1]), (next_[:, 0], cell[:, 1]), (next_[:, 0], next_[:, 1])]
        leaf = np.stack([own, *(self.leaf.take(first + a * row + b) for a, b in ends)], axis=1)
        return leaf, np.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], axis=1)

    def quarters(self, chart, at):
        """(h,) Numbers of the quarters of leaves, QUARTERS of each in turn, at places (h, 2) in [0, 1]^2 on charts."""
        own, scaled, cell = self.at(chart, at)
        step = self.step.take(own, axis=0)
        upper = 2 * (scaled - (cell & -step)) >= step
        return QUARTERS * own + 2 * upper[:, 0] + upper[:, 1]

    def middles(self, quarter):
        """Charts (h,) and places (h, 2) of the middles of quarters of leaves (h,)."""
        own, part = np.divmod(quarter, QUARTERS)
        chart, upper = self.chart[own], np.column_stack(np.divmod(part, 2))
        return chart, (self.corner[own] + (upper + 0.5) / 2 * self.step[own]) / self.size[chart]

    def surplus(self, value, within):
        """value (k, c) of the leaves -> (k, 2): how far values half as wide along each axis may be off; within (k,):
        what is told instead of charts that are one leaf wide."""
        out = np.repeat(within[:, None] / np.sqrt(2), 2, axis=1)
        charts = np.flatnonzero(self.number > 0)
        kinds, which = np.unique(np.column_stack([self.size[charts], self.round_[charts]]), axis=0, return_inverse=True)
        of_kind = np.full(len(self.size), -1)
        of_kind[charts] = which.reshape(-1)
        for k, (wide, high, round_) in enumerate(kinds.tolist()):
            some = np.flatnonzero(of_kind == k)
            place = np.zeros(len(self.size), int)
            place[some] = np.arange(len(some))
            finest = value[self.leaf[self.first[some][:, None] + np.arange(wide * high)]]
            finest = finest.reshape(len(some), wide, high, -1)
            leaves = np.flatnonzero(of_kind[self.chart] == k)
            for level in np.unique(self.level[leaves], axis=0):
                mine = leaves[(self.level[leaves] == level).all(axis=1)]
                a, b = 1 << level
                pooled = finest.reshape(len(some), wide // a, a, high // b, b, -1).mean(axis=(2, 4))
                at = (place[self.chart[mine]], *(self.corner[mine] >> level).T)
                for axis in range(2):
                    if pooled.shape[1 + axis] > 1:
                        off = _halves_off(np.moveaxis(pooled, 1 + axis, 0), round_ and axis == 0)
                        out[mine, axis] = np.linalg.norm(np.moveaxis(off, 0, 1 + axis)[at], axis=1)
        return NEXT * out

    # -- refinement ----------------------------------------------------------------------------------------------

    def may_split(self):
        """(k, 2) Which leaves may be halved along each axis."""
        room = (self.size < FINEST) & (2 * self.grid[:, None] <= MOST)
        return (self.level > 0) | room[self.chart]

    def split(self, marked):
        """marked (k, 2) bool, of those that may be -> the Lattice where they are halved along the axes; old (new k,):
        which leaf each was before, -1 of new ones."""
        finer = np.zeros(self.size.shape, bool)
        for axis in range(2):
            finer[self.chart[marked[:, axis] & (self.level[:, axis] == 0)], axis] = True
        both = finer.all(axis=1) & (4 * self.grid > MOST)  # no room for both
        finer[both, 1] = False
        size = np.where(finer, 2 * self.size, self.size)
        chart, old = self.chart, np.where(marked.any(axis=1), -1, np.arange(len(self)))
        corner, level = self.corner << finer[chart], self.level + finer[chart]
        for axis in range(2):
            some = np.flatnonzero(marked[:, axis] & (level[:, axis] > 0))
            level[some, axis] -= 1
            other = corner[some].copy()
            other[:, axis] += 1 << level[some, axis]
            chart, old, marked = (np.concatenate([a, a[some]]) for a in (chart, old, marked))
            corner, level = np.concatenate([corner, other]), np.concatenate([level, level[some]])
        return Lattice(size, self.round_, chart, corner, level), old


def _filled(leaf, round_):
    """leaf (a, b) of cells, -1 of those without -> those of the nearest instead; round_: whether the last along the
    first axis is next to the first."""
    while (leaf < 0).any():
        before = leaf
        for axis in range(2):
            for step in (1, -1):
                near = np.roll(before, step, axis=axis)
                if not (round_ and axis == 0):
                    np.moveaxis(near, axis, 0)[0 if step > 0 else -1] = -1
                leaf = np.where(leaf < 0, near, leaf)
    return leaf


def _halves_off(v, round_):
    """Values v (cells, ...) along an axis, an even number -> of the same shape: what they differ from those
    interpolated between the means of pairs; round_: whether the last is next to the first."""
    mean = (v[::2] + v[1::2]) / 2
    if round_:
        before, after = np.roll(mean, 1, axis=0), np.roll(mean, -1, axis=0)
    else:
        before, after = np.concatenate([mean[:1], mean[:-1]]), np.concatenate([mean[1:], mean[-1:]])
    out = np.empty(v.shape)
    out[::2], out[1::2] = v[::2] - (3 * mean + before) / 4, v[1::2] - (3 * mean + after) / 4
    return out
