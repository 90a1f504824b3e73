"""Where hits of the nodes' rays count as: quarters of cells and of meshes' faces, in each of which light is one.

Light is linear on each of them, and rays are spread evenly over it: the mean is that in its middle. So a ray needs one
number instead of four nodes and their weights.
"""

import numpy as np

from .lattice import QUARTERS

# of a triangle's quarters, those at its corners and the one between: the weights of its corners in their middles
WEIGHTS = np.array([[4.0, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6


class Spots:
    """Of Nodes: quarters of the cells, then of the parts of meshes, of all fronts and of all backs; count of them."""

    def __init__(self, nodes):
        self.nodes, self.facets, self.meshes = nodes, nodes.facets, nodes.meshes
        self.cells = QUARTERS * len(nodes.lattice)
        self.side = len(WEIGHTS) * len(self.meshes.corner)
        self.count = self.cells + 2 * self.side

    def of(self, facet, at, back):
        """(h,) Spots at places (h, 2) of facets (h,), back (h,): 1 on the back, 0 on the front; -1 where nothing is
        carried."""
        nodes, out = self.nodes, np.full(len(facet), -1)
        own = self.facets.surface[facet, back]
        carries, has = (own >= 0) & (nodes.number[own] > 0), nodes.charts.has[own]
        some = np.flatnonzero(carries & has)
        out[some] = nodes.lattice.quarters(own[some], nodes.chart_at(facet[some], at[some]))
        some = np.flatnonzero(carries & ~has)
        if len(some):
            part, (s, t) = self._parts(facet[some], at[some])
            quarter = np.select([s + t < 0.5, s >= 0.5, t >= 0.5], [0, 1, 2], 3)
            out[some] = self.cells + self.side * back[some] + len(WEIGHTS) * part + quarter
        return out

    def _parts(self, facet, at):
        part, at = self.meshes.part(facet, at)
        return part, at.T

    def basis(self, spots):
        """Nodes and weights (k, 4) that interpolate in the middles of spots (k,), sorted."""
        nodes, split = self.nodes, np.searchsorted(spots, self.cells)
        node, weight = np.zeros((len(spots), 4), np.int32), np.zeros((len(spots), 4))
        if split:
            node[:split], weight[:split] = nodes.lattice.columns(*nodes.lattice.middles(spots[:split]))
        back, rest = np.divmod(spots[split:] - self.cells, max(self.side, 1))
        part, quarter = np.divmod(rest, len(WEIGHTS))
        own = self.facets.surface[self.meshes.facet[part], back]
        node[split:, :3], weight[split:, :3] = nodes.first[own][:, None] + self.meshes.corner[part], WEIGHTS[quarter]
        return node, weight
