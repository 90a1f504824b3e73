"""Where reflected light is kept: in cells over the charts of surfaces, at merged vertices of meshes.

The light of a cell is its mean over what is seen of it: each direction starts at another place of it, so that what is
sent on is right in sum wherever shadows end, and nothing hangs on single points in corners. Between the cells' middles
it is bilinear.
"""

import copy
from functools import cached_property

import numpy as np

from .lattice import NEXT, Lattice
from .means import CellMeans
from .merged import PLACES, Merged
from .on_charts import OnCharts
from .placed import Placed
from .standing import PartedCells, Standing

FIRST = 64  # cells along an axis to begin with at most
USUAL = 3000  # cells to begin with, where there are fewer shapes
LIT = PLACES // 2  # of a node where direct light is worked out
NEXT_TURN = 5  # places further on in each next turn: an odd number


def place_of(j):
    """(k,) From which place of a node the j-th directions (k,) start: from each of them in turn, but so that every
    second direction comes to all of them, and those of one place are spread around."""
    return (j + NEXT_TURN * (j // PLACES)) % PLACES


class Nodes:
    """Cells of the surfaces that send light on, then merged vertices of meshes: n nodes.

    lattice: the cells, of as many charts as there are surfaces; surface (n,); places: Placed, PLACES of each node in
    turn; number (n surfaces,) of their nodes, first (n surfaces,) of meshes; hidden (n, PLACES) bool: places that
    nothing comes to, for which others of the node stand in; old (n,): see refined.
    """

    def __init__(self, facets, sends):
        self.facets, self.sends, scene = facets, sends, facets.scene
        self.charts = charts = OnCharts([s.shape for s in scene.surfaces])
        self.standing = Standing(facets, charts)
        area = scene.areas[sends].sum() or 1.0
        size = np.sqrt(area / USUAL)  # m, of a cell, and of those in which a mesh's vertices are merged
        self.meshes = Merged(facets, np.flatnonzero(~charts.has & sends), size)
        level = np.round(np.log2(np.maximum(charts.lengths / size, 1.0)))
        cells = np.maximum(np.minimum(2 ** level.astype(int), FIRST), charts.least)
        lattice = Lattice.even(np.where((charts.has & sends)[:, None], cells, 0), charts.wraps)
        self._lay_out(lattice, np.full(len(lattice), -1), None)

    def __len__(self):
        return len(self.surface)

    def _lay_out(self, lattice, known, before):
        """The nodes of a lattice's cells, known (k,) which of those before each was, -1 of new ones, and of meshes."""
        parts, meshes = [self._of_cells(lattice, known, before)], self.meshes
        self.first, begin = np.zeros(len(self.sends), int), len(self.lattice)
        for k in meshes.which:
            self.first[k], begin = begin, begin + meshes.number[k]
            parts.append(meshes.nodes(k) if meshes.anew[k] else _as_before(k, before))
        self.surface, self.old, self.share, points, normals, triangle = (np.concatenate(a) for a in zip(*parts))
        self.number = np.bincount(self.surface, minlength=len(self.sends))
        new, count = self.old < 0, 0 if before is None else len(before)
        own = np.repeat(self.surface[new], PLACES)
        added = Placed(self.facets, own, points.reshape(-1, 3), normals.reshape(-1, 3), triangle=triangle.ravel())
        self.places = added if before is None else before.places.joined(added)
        index = np.where(new, count + np.cumsum(new) - 1, self.old)
        self.places.reorder((index[:, None] * PLACES + np.arange(PLACES)).ravel())
        self.hidden = np.zeros((len(self), PLACES), bool)
        if before is not None:
            self.hidden[~new] = before.hidden[self.old[~new]]

    def _of_cells(self, lattice, known, before):
        """Of the nodes of cells: surface, old, share (k,); of the new ones points, normals and triangles."""
        share, new = np.zeros(len(lattice)), known < 0
        own, corner, step = (a[new] for a in (lattice.chart, lattice.corner, lattice.step))
        low, high = (end / lattice.size[own] for end in (corner, corner + step))
        share[new], at = self.charts.cells(own, low, high, PLACES)
        if before is not None:
            share[~new] = before.share[known[~new]]
        at, some = at[share[new] > 0], share > 0
        self.lattice = lattice.without(~some)
        own = np.repeat(lattice.chart[some & new], PLACES)
        points = self.charts.points(own, at.reshape(-1, 2)).reshape(-1, PLACES, 3)
        unknown = np.full(points.shape, np.nan), np.full(points.shape[:2], -1)
        return lattice.chart[some], known[some], share[some], points, *unknown

    @cached_property
    def weight(self):
        """(n,) m^2 of what is seen of each."""
        return self.share * self.charts.area[self.surface] * (1 - self.hidden.mean(axis=1))

    @cached_property
    def parted(self):
        """PartedCells of the cells."""
        cells = np.arange(len(self.lattice))
        return PartedCells(self.standing, self.lattice, self._on_charts(cells), self.hidden[cells])

    @cached_property
    def means(self):
        """CellMeans of the cells."""
        return CellMeans(self.parted, self._on_charts(np.arange(len(self.lattice))))

    def _on_charts(self, cells):
        """Places (k, PLACES, 2) of cells (k,) on their charts."""
        points = self.places.exact.reshape(-1, PLACES, 3)[cells].reshape(-1, 3)
        return self.charts.places(np.repeat(self.surface[cells], PLACES), points).reshape(-1, PLACES, 2)

    def other_side(self, new, hidden):
        """(k, PLACES) bool of the nodes new (k,): which places what stands there parts from most of the others; hidden
        (k, PLACES) bool: which nothing comes to."""
        out, cells = np.zeros_like(hidden), np.flatnonzero(new < len(self.lattice))
        out[cells] = self.parted.other_side(new[cells], self._on_charts(new[cells]), hidden[cells])
        return out

    def uncover(self, new, hidden):
        """Leaves out places, hidden (k, PLACES) bool of the nodes new (k,), that nothing comes to: others of the same
        cell stand in for them, and cells without any are no nodes. Returns which of the nodes (n,) are left, and which
        of these (k,) start from other places than before."""
        self.hidden[new] = hidden
        alive = PLACES - self.hidden.sum(axis=1)
        lost = (alive == 0) & self.charts.has[self.surface]
        kept = np.flatnonzero(~lost)
        changed = new[(alive[new] > 0) & (alive[new] < PLACES)]
        order = np.argsort(self.hidden[changed], axis=1, kind="stable")
        pick = np.take_along_axis(order, np.arange(PLACES) % alive[changed, None], axis=1)
        index = np.arange(len(self) * PLACES).reshape(-1, PLACES)
        index[changed] = changed[:, None] * PLACES + pick
        self.places.reorder(index[kept].ravel())
        self.number -= np.bincount(self.surface[lost], minlength=len(self.number))
        self.first[~self.charts.has] -= lost.sum()
        self.lattice = self.lattice.without(lost[: len(self.lattice)])
        for name in ("surface", "share", "hidden"):
            setattr(self, name, getattr(self, name)[kept])
        self._forget()
        return kept, np.searchsorted(kept, changed)

    def _forget(self):
        """What is worked out of the nodes as they were."""
        for name in ("weight", "reflectance", "parted", "means", "lost"):
            vars(self).pop(name, None)

    def of(self, scene):
        """The same nodes on the same shapes of another scene."""
        new = copy.copy(self)
        new.facets = copy.copy(self.facets)
        new.facets.scene = scene
        new.__dict__.pop("reflectance", None)
        return new

    def from_place(self, which, j):
        """Receivers of nodes which (k,) at their places of the j-th directions, j (k,)."""
        return self.places.take(which * PLACES + place_of(j))

    def lit_places(self, which):
        """Receivers at LIT places of each of the nodes which (k,), in turn."""
        return self.places.take((which[:, None] * PLACES + np.arange(LIT)).ravel())

    @cached_property
    def reflectance(self):
        """(n, 3) of the surfaces at the nodes, where they vary its mean over each."""
        scene = self.facets.scene
        out = scene.reflectance[self.surface].copy()
        places = self.places.exact.reshape(-1, PLACES, 3)
        for k in np.flatnonzero([callable(s.reflectance) for s in scene.surfaces] & (self.number > 0)):
            mine = np.flatnonzero(self.surface == k)
            value = scene.surfaces[k].reflectance_at(places[mine].reshape(-1, 3))
            out[mine] = value.reshape(-1, PLACES, 3).mean(axis=1)
        return out

    def columns(self, facet, at, front):
        """Hits -> nodes (h, 4) and weights (h, 4) that interpolate there; weights of hits that carry nothing are 0."""
        facets = self.facets
        own = facets.surface[facet, np.where(front, 0, 1)]
        carries = (own >= 0) & (self.number[own] > 0)
        node, weight = np.zeros((len(facet), 4), np.int32), np.zeros((len(facet), 4), np.float32)
        mesh = np.flatnonzero(carries & ~self.charts.has[own])
        if len(mesh):
            there = facets.on_triangles(facet[mesh], at[mesh]).astype(np.float32)  # weights sum to 1 all but exactly
            node[mesh, :3], weight[mesh, :3] = self.on_meshes(own[mesh], facet[mesh], there)
        flat = np.flatnonzero(carries & self.charts.has[own])
        if len(flat):
            there = facets.chart_at(facet[flat], at[flat])
            node[flat], weight[flat] = self.parted.columns(own[flat], there)
        return node, weight

    def on_meshes(self, own, facet, at):
        """Nodes and weights (h, 3) of surfaces (h,) at places (h, 2) of their facets (h,)."""
        return self.on_parts(own, *self.meshes.part(facet, at))

    def on_parts(self, own, part, at):
        """As on_meshes, at places (h, 2) of parts (h,): those count for nothing that nothing comes to, as where a mesh
        is sunk in others, and those beyond what runs through the part, but where all are such."""
        node, cuts = self.first[own][:, None] + self.meshes.corner.take(part, axis=0), self.meshes.cuts
        s, t = at.T
        weight, none = np.stack([1 - s - t, s, t], axis=1), self.lost[node]
        some, beyond = np.flatnonzero(cuts.touched[part]), none.copy()
        beyond[some] |= cuts.apart(part[some], at[some])
        for gone in (none, beyond):
            left = np.where(gone, 0, weight)
            total = left.sum(axis=1, keepdims=True)
            weight = np.where(total > 0, left / np.where(total > 0, total, 1), weight)
        return node, weight

    @cached_property
    def lost(self):
        """(n,) bool: of which no place has any light."""
        return self.hidden.all(axis=1)

    def surplus(self, value, uneven):
        """Values (n, c) of the nodes, and how uneven (n,) the light within each is -> how far values of cells half as
        wide along each axis may be off (k cells, 2), and those of finer groups of meshes, in L2 (n surfaces,): m times
        the value's unit."""
        meshes = np.zeros(len(self.number))
        for k in self.meshes.which:
            mine = slice(self.first[k], self.first[k] + self.number[k])
            meshes[k] = NEXT * self.meshes.surplus(k, value[mine], self.lost[mine])
        cells = len(self.lattice)
        off = self.lattice.surplus(value[:cells], uneven[:cells])
        return self.parted.surplus(value[:cells], off), meshes

    def refined(self, cells, meshes):
        """cells (k, 2) bool: which are halved along which axis; meshes (n surfaces,) bool: which are merged less ->
        Nodes, whose `old` (n,) is which node of these each was, -1 of new ones."""
        new = copy.copy(self)
        new._forget()
        new.meshes = self.meshes.finer(meshes)
        new._lay_out(*self.lattice.split(cells), self)
        return new


def _as_before(k, before):
    """As Nodes._of_cells, of a mesh whose nodes are those of before."""
    old, none = before.first[k] + np.arange(before.number[k]), np.zeros((0, PLACES, 3))
    return np.full(len(old), k), old, before.share[old], none, none, np.zeros((0, PLACES), int)
