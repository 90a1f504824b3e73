"""Where hits of the nodes' rays count as: quarters of cells and of meshes' faces, in each of which light is one.

Light is linear on each of them, and rays are spread evenly over it: the mean is that in its middle. So a ray needs one
number instead of four nodes and their weights. Where something stands on a cell its sides are told apart.
"""

import numpy as np

from .lattice import QUARTERS
from .standing import SIDES

# of a triangle's quarters, those at its corners and the one between: the weights of its corners in their middles
WEIGHTS = np.array([[4.0, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6


class Spots:
    """Of Nodes: all sides of the cells' quarters, then quarters of the parts of meshes, first of all fronts; count."""

    def __init__(self, nodes):
        self.nodes, self.facets, self.meshes = nodes, nodes.facets, nodes.meshes
        self.cells = SIDES * QUARTERS * len(nodes.lattice)
        each = len(WEIGHTS) * np.where(self.meshes.cuts.touched, SIDES, 1)
        self.first, self.side = np.cumsum(each) - each, int(each.sum())
        self.count = self.cells + 2 * self.side
        # of places on a quarter's side, where something parts its cell or its face, their number and their sums: in
        # their mean it is told; one of them would tell of a foot's neighbours by luck
        self.met = np.zeros((3, self.count))

    def of(self, facet, at, back):
        """(h,) Spots at places (h, 2) of facets (h,), back (h,): 1 on the back, 0 on the front; -1 where nothing is
        carried."""
        nodes, out = self.nodes, np.full(len(facet), -1)
        own = self.facets.surface[facet, back]
        carries, has = (own >= 0) & (nodes.number[own] > 0), nodes.charts.has[own]
        some = np.flatnonzero(carries & has)
        there = self.facets.chart_at(facet[some], at[some])
        quarter = nodes.lattice.quarters(own[some], there)
        leaf = quarter // QUARTERS
        out[some] = SIDES * quarter + nodes.parted.sides(leaf, there)
        parted = np.flatnonzero(nodes.parted.touched[leaf])
        self._meet(out[some[parted]], there[parted])
        some = np.flatnonzero(carries & ~has)
        if len(some):
            part, inner = self.meshes.part(facet[some], self.facets.on_triangles(facet[some], at[some]))
            s, t = inner.T
            quarter = np.select([s + t < 0.5, s >= 0.5, t >= 0.5], [0, 1, 2], 3)
            parted = np.flatnonzero(self.meshes.cuts.touched[part])
            quarter[parted] += len(WEIGHTS) * self.meshes.cuts.sides(part[parted], inner[parted])
            out[some] = self.cells + self.side * back[some] + self.first[part] + quarter
            self._meet(out[some[parted]], inner[parted])
        return out

    def _meet(self, spot, at):
        """Takes places (h, 2) on spots (h,)."""
        for sums, one in zip(self.met, (1.0, *at.T)):
            np.add.at(sums, spot, one)

    def basis(self, spots):
        """Nodes and weights (k, 4) that interpolate in the middles of spots (k,), sorted."""
        nodes, split = self.nodes, np.searchsorted(spots, self.cells)
        node, weight = np.zeros((len(spots), 4), np.int32), np.zeros((len(spots), 4))
        number, *sums = self.met[:, spots]
        told = np.divide(sums, number, out=np.full((2, len(spots)), np.nan), where=number > 0).T
        if split:
            quarter = spots[:split] // SIDES
            node[:split], weight[:split] = nodes.means.node[quarter], nodes.means.basis[quarter]
            some = np.flatnonzero(~np.isnan(told[:split, 0]))
            chart = nodes.lattice.chart[quarter[some] // QUARTERS]
            node[some], weight[some] = nodes.parted.columns(chart, told[some])
        back, rest = np.divmod(spots[split:] - self.cells, max(self.side, 1))
        part = np.searchsorted(self.first, rest, side="right") - 1
        own, quarter = self.facets.surface[self.meshes.facet[part], back], (rest - self.first[part]) % len(WEIGHTS)
        there = np.where(np.isnan(told[split:]), WEIGHTS[quarter, 1:], told[split:])
        node[split:, :3], weight[split:, :3] = nodes.on_parts(own, part, there)
        return node, weight / weight.sum(axis=1, keepdims=True)  # between white walls 1 counts to the last digit
