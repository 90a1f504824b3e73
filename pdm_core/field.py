"""A field on the scene's surfaces: biquadratic cells of adaptive trees, on lattices that share their nodes.

Each surface carries charts: a plane the unit square, cut where light bends or jumps, a sphere the six faces of a cube
(equi-angular, so no pole and no seam). A cell holds 3 x 3 nodes at 0, 1/2, 1. It is halved along one axis, where light
bends one way only, or both: its two or four children hold the same nodes and new ones between, so a value once computed
is kept, and (child's value - parent's interpolant) is the hierarchical surplus, an error measure of that axis.
A halving is a number: 2 * cell + axis.
"""

import numpy as np

from .at_once import in_turn
from .biquadratic import CHILDREN, EDGE_AXES, FIRST_ROLE, STEPS, basis2
from .contacts import contacts_of
from .field_charts import FieldCharts

DEEPEST = 10  # halvings of a chart along each axis
GRID = 2 ** (DEEPEST + 1)  # integer lattice steps across a chart


class Field:
    """The lattice; values live outside, as arrays (n nodes, channels)."""

    def __init__(self, scene):
        self.scene, self.contacts = scene, contacts_of(scene)
        self.on = FieldCharts(scene, self.contacts, GRID)
        self.charts = charts = self.on.count
        self.root = np.concatenate([[0], np.cumsum(charts)[:-1]])  # first root cell of each surface
        surface = np.repeat(np.arange(len(scene)), charts)
        face = np.arange(len(surface)) - self.root[surface]
        zero = np.zeros(len(surface), int)
        self.surface, self.face = surface, face  # face: of a sphere's cube, or a plane's chart
        self.level = np.zeros((len(surface), 2), int)  # halvings along both axes
        self.halved = np.zeros((len(surface), 2), bool)  # whether its children are halves along them
        self.made = np.tile(np.arange(len(surface))[:, None], 2)  # the last, of its ancestors and itself, that is such
        self.corner = self._starts(np.arange(len(surface)))  # of the cell, in lattice steps
        self.node_surface = np.zeros(0, int)
        self.keys = np.zeros(0, np.int64)
        self._order = np.zeros(0, int)
        self.points, self.normals = np.zeros((0, 3)), np.zeros((0, 3))
        self.parent, self.child, self.role = zero - 1, zero - 1, zero - 1  # child: the first, -1 for a leaf; see roles
        self.nodes = self._nodes_of(np.arange(len(surface)))
        self.refine(self.both(np.flatnonzero(self.charts[surface] == 1)))  # planes of one chart start at 25 nodes

    # -- nodes ---------------------------------------------------------------------------------------------------

    def _keys(self, cells, steps):
        """Keys (n, ...) of lattice steps (n, ..., 2) on the charts of cells (n,)."""
        each = int(np.prod(steps.shape[1:-1]))
        surface, face = (np.repeat(which[cells], each) for which in (self.surface, self.face))
        return self.on.keys(surface, face, steps.reshape(-1, 2)).reshape(steps.shape[:-1])

    def find(self, keys):
        """keys (...) -> node indices (...), -1 where there is no such node."""
        at = np.searchsorted(self.keys[self._order], keys)
        at = self._order[np.minimum(at, len(self._order) - 1)]
        return np.where(self.keys[at] == keys, at, -1)

    def _add_nodes(self, keys):
        new = np.unique(keys)
        if len(self.keys):
            new = new[self.find(new) < 0]
        surface, steps = self.on.of_keys(new)
        local = self.on.each("local", surface, steps)
        points = self.contacts.clear(self.on.points(surface, local), surface)
        self.points = np.concatenate([self.points, points])
        self.normals = np.concatenate([self.normals, self.on.normals(surface, local)])
        self.keys = np.concatenate([self.keys, new])
        self._order = np.argsort(self.keys)
        self.node_surface = np.concatenate([self.node_surface, surface])

    @property
    def part(self):
        """(n cells,): the chart of a plane or the sphere that each lies on, by the number of its first root cell."""
        return self.root[self.surface] + self.on.part(self.surface, self.face)

    def chart_of(self, cells):
        """(n, 2): numbers along both edges of the charts that cells of planes lie on; 0 of spheres."""
        return self.on.each("number", self.surface[cells], self.face[cells])

    def _starts(self, cells):
        return self.on.rectangles.starts[self.surface[cells][:, None], (0, 1), self.chart_of(cells)]

    def in_chart(self, cells):
        """(n, 2): lower corners of cells in coordinates of their charts, from 0 to 1."""
        return (self.corner[cells] - self._starts(cells)) / GRID

    def _nodes_of(self, cells):
        half = (GRID >> self.level[cells]) // 2
        steps = self.corner[cells][:, None] + STEPS * half[:, None]
        keys = self._keys(cells, steps)
        self._add_nodes(keys)
        return self.find(keys)

    # -- cells ---------------------------------------------------------------------------------------------------

    @property
    def leaves(self):
        return np.flatnonzero(self.child < 0)

    @property
    def halvings(self):
        """(k,) Those of leaves that there may be."""
        halvings = self.both(self.leaves)
        return halvings[self.level.ravel()[halvings] < DEEPEST]

    def both(self, cells):
        """(2n,) Halvings of cells (n,) along both axes."""
        return (2 * cells[:, None] + np.arange(2)).ravel()

    def siblings(self, cells):
        """Cells (n,) -> the children (k,) of their parents, or these themselves of roots, and whose (k,) each is."""
        parent = self.parent[cells]
        first = np.where(parent >= 0, self.child[parent], cells)
        whose, number = in_turn(np.where(parent >= 0, 1 << self.halved[parent].sum(axis=1), 1))
        return first[whose] + number, whose

    def refine(self, halvings):
        """Halve leaves, and coarser neighbours until no edge is halved twice (2:1 balance)."""
        while len(halvings):
            may = (self.child[halvings // 2] < 0) & (self.level.ravel()[halvings] < DEEPEST)
            self._split(halvings[may])
            halvings = self._unbalanced()

    def _split(self, halvings):
        cells, place = np.unique(halvings // 2, return_inverse=True)
        halved = np.zeros((len(cells), 2), bool)
        halved[place.ravel(), halvings % 2] = True
        count = 1 << halved.sum(axis=1)
        which, number = in_turn(count)
        parent, new = cells[which], len(self.level) + np.arange(len(which))
        role = FIRST_ROLE[halved @ (1, 2)][which] + number
        level = self.level[parent] + halved[which]
        self.child, self.halved = self.child.copy(), self.halved.copy()  # a solution may hold the field as it was
        self.child[cells], self.halved[cells] = new[np.cumsum(count) - count], halved
        corner = self.corner[parent] + CHILDREN[role] * (GRID >> level)
        added = {
            "surface": self.surface[parent],
            "face": self.face[parent],
            "level": level,
            "corner": corner,
            "parent": parent,
            "child": np.full(len(new), -1),
            "role": role,
            "halved": np.zeros((len(new), 2), bool),
            "made": np.where(halved[which], new[:, None], self.made[parent]),
        }
        for name, value in added.items():
            setattr(self, name, np.concatenate([getattr(self, name), value]))
        self.nodes = np.concatenate([self.nodes, self._nodes_of(new)])

    def edge_nodes(self, cells, parts):
        """Nodes at odd multiples of 1/parts on the edges of cells -> (n, 4 edges, parts / 2), -1 where none."""
        odd = np.arange(1, parts, 2)
        along = np.stack([np.array([(0, k), (parts, k), (k, 0), (k, parts)]) for k in odd], axis=1)
        width = GRID >> self.level[cells]
        steps = self.corner[cells][:, None, None] + along * width[:, None, None] // parts
        return np.where((width[:, EDGE_AXES] >= parts)[:, :, None], self.find(self._keys(cells, steps)), -1)

    def _unbalanced(self):
        leaves = self.leaves
        leaf, edge = np.nonzero((self.edge_nodes(leaves, 8) >= 0).any(axis=2))
        return 2 * leaves[leaf] + EDGE_AXES[edge]

    def sizes(self):
        """(n cells,) m^2: areas; a sphere's cells by their share of the equi-angular chart."""
        low = self.in_chart(np.arange(len(self.level)))
        high = low + 0.5**self.level
        return self.on.each("areas", self.surface, self.face, low, high)

    def place(self, cells, uv):
        """Points and normals (n, 3) of cells (n,) at uv (n, 2) in [0, 1]."""
        surface, at = self.surface[cells], self.in_chart(cells) + uv * 0.5 ** self.level[cells]
        local = self.on.each("within", surface, self.face[cells], at)
        return self.contacts.clear(self.on.points(surface, local), surface), self.on.normals(surface, local)

    def inset(self, surface, points):
        """Points (n, 3) on a surface moved off a plane's border and off what stands on it."""
        points = self.on.inset(surface, points)
        return self.contacts.clear(points, np.full(len(points), surface))

    # -- reading off ---------------------------------------------------------------------------------------------

    def chart(self, surface, local):
        """Local coordinates (n, 3) on surfaces (n,) -> root cells (n,) and chart coordinates (n, 2) in [0, 1]."""
        face, at = self.on.each("at", surface, local)
        return self.root[surface] + face, at

    def part_at(self, surface, points):
        """points (n, 3) m on surfaces (n,) -> the parts (n,) of them; -1 of points in space"""
        out, on = np.full(len(points), -1), np.flatnonzero(surface >= 0)
        own = surface[on]
        face = self.chart(own, self.on.local(own, points[on]))[0] - self.root[own]
        out[on] = self.root[own] + self.on.part(own, face)
        return out

    def locate(self, surface, local):
        """Local coordinates (n, 3) on surfaces (n,) -> leaves (n,) and the weights (n, 9) of their nodes."""
        cell, uv = self.below(*self.chart(surface, local))
        return cell, basis2(uv)

    def below(self, cell, uv):
        """Cells (n,) and places (n, 2) in them, from 0 to 1 -> leaves (n,) and the places in these; both changed."""
        while (split := np.flatnonzero(self.child[cell] >= 0)).size:
            inner, own = uv.take(split, axis=0), cell.take(split)
            halved = self.halved.take(own, axis=0)
            upper = halved & (inner >= 0.5)
            uv[split] = np.where(halved, 2 * inner - upper, inner)
            cell[split] = self.child.take(own) + upper[:, 0] * (1 + halved[:, 1]) + upper[:, 1]
        return cell, uv

    def interpolate(self, placed, value):
        """placed: what `locate` returned of n places; value (n nodes, c) -> (n, c) the field there"""
        cell, weight = placed
        return np.einsum("nk,nkc->nc", weight, value.take(self.nodes.take(cell, axis=0), axis=0))
