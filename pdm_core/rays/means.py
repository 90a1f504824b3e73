"""Cells whose means are kept: what is interpolated between their middles is, over each cell, its light in the mean.

Interpolated straight between their means, light that bends comes out too bright or too dark over each cell, at the edge
of a chart by an eighth of a step, and all around with one sign: whoever sees many cells sees the sum. So the values
held at the middles are moved by as much as the mean of what is interpolated is off.
"""

import numpy as np

from .lattice import QUARTERS


class CellMeans:
    """Of parted (PartedCells) k cells, with their places (k, PLACES, 2) on the charts that are seen: node, basis
    (QUARTERS k, 4): what is interpolated in the middle of each quarter; weight (QUARTERS k, 4): the same by the part of
    a cell's places that the quarter has."""

    def __init__(self, parted, places):
        lattice = parted.lattice
        self.count, each = len(lattice), places.shape[1]
        own = np.repeat(np.arange(self.count), each)
        quarter = lattice.quarters(lattice.chart[own], places.reshape(-1, 2)) % QUARTERS
        # of a cell in which things stand only some is seen: what that tells of its middle is off by as much again
        self.whole = np.flatnonzero(~parted.touched)
        number = np.bincount(QUARTERS * own + quarter, minlength=QUARTERS * self.count)
        self.node, self.basis = parted.columns(*lattice.middles(np.arange(QUARTERS * self.count)))
        self.weight = self.basis * (number / max(each, 1))[:, None]

    def interpolated(self, value):
        """value (n >= k, c) at the middles of the cells -> (k, c) means over the cells of what lies between."""
        out = np.empty((self.count, value.shape[1]))
        for c, one in enumerate(value.T):
            told = np.einsum("qk,qk->q", self.weight, one.take(self.node))
            out[:, c] = told.reshape(-1, QUARTERS).sum(axis=1)
        return out

    def held(self, value):
        """Means (n, c) of nodes, of which the cells are the first -> values to hold at their middles (n, c)."""
        out, whole = value.copy(), self.whole
        out[whole] += value[whole] - self.interpolated(value)[whole]
        return out

    def bias(self, value, held):
        """(n, c) How far off means of what is interpolated between held values (n, c) are from means (n, c)."""
        out = np.zeros_like(value)
        out[: self.count] = self.interpolated(held) - value[: self.count]
        return out
