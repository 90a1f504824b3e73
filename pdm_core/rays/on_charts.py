"""The charts of surfaces, [0, 1]^2 each: cells of them, places on them, points of them, many surfaces at once."""

import numpy as np


class OnCharts:
    """Of surfaces: has (n,) bool: which have a chart; area (n,) m^2 of all of it, 1 where there is none; lengths, least
    (n, 2): m along its axes, cells at least; wraps (n,) bool: whether the first axis runs around."""

    def __init__(self, shapes):
        self.shapes, count = shapes, len(shapes)
        self.has = ~np.array([shape.is_mesh for shape in shapes], bool)
        self.area, self.lengths, self.least = np.ones(count), np.zeros((count, 2)), np.zeros((count, 2), int)
        self.linear, self.inverse, self.origin = np.zeros((count, 3, 3)), np.zeros((count, 3, 3)), np.zeros((count, 3))
        self.wraps = np.array([shape.wraps for shape in shapes], bool)
        for k in np.flatnonzero(self.has):
            shape = shapes[k]
            self.area[k], self.lengths[k], self.least[k] = shape.chart_area, shape.chart_lengths, shape.least_cells
            self.linear[k], self.inverse[k], self.origin[k] = shape.linear, shape.inverse, shape.origin
        kinds = list(dict.fromkeys(map(type, shapes)))
        self.kind = np.array([kinds.index(type(shape)) for shape in shapes], int)
        self.kinds = list(enumerate(kinds))

    def _by_kind(self, own):
        """Yields each kind among surfaces own (k,) and which of those are of it."""
        for number, kind in self.kinds:
            some = np.flatnonzero(self.kind[own] == number)
            if len(some):
                yield kind, some

    def cells(self, own, low, high, places):
        """Shares (k,) and places (k, places, 2) of cells of surfaces own (k,): see Shape.cells."""
        share, at = np.empty(len(own)), np.empty((len(own), places, 2))
        for kind, some in self._by_kind(own):
            share[some], at[some] = kind.cells(self.shapes, own[some], low[some], high[some], places)
        return share, at

    def points(self, own, at):
        """Points (n, 3) m at places (n, 2) of surfaces own (n,)."""
        local = np.empty((len(own), 3))
        for kind, some in self._by_kind(own):
            local[some] = kind.from_chart(at[some])
        return self.origin.take(own, axis=0) + np.einsum("nij,nj->ni", self.linear.take(own, axis=0), local)

    def places(self, own, points):
        """Places (n, 2) of points (n, 3) m of surfaces own (n,)."""
        local = np.einsum("nij,nj->ni", self.inverse.take(own, axis=0), points - self.origin.take(own, axis=0))
        at = np.empty((len(own), 2))
        for kind, some in self._by_kind(own):
            at[some] = kind.to_chart(local[some])
        return np.clip(at, 0.0, 1.0)
