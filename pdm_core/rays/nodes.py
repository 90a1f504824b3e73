"""Where reflected light is kept: in cells over the charts of surfaces, at merged vertices of meshes.

The light of a cell is its mean over what is seen of it: each direction starts at another place of it, so that what is
sent on is right in sum wherever shadows end, and nothing hangs on single points in corners. Between the cells' middles
it is bilinear.
"""

import copy
from functools import cached_property

import numpy as np

from ..shapes.mesh import Mesh
from ..shapes.polygon import Polygon
from ..shapes.shape import square_lattice
from ..shapes.sphere import Sphere
from .bundles import ball_place
from .lattice import NEXT, Lattice
from .merged import PLACES, Merged
from .placed import Placed

FIRST = 64  # cells along an axis to begin with at most
USUAL = 3000  # cells to begin with, where there are fewer shapes
BALL = 4, 2  # cells about the axis of a ball and along it, at least
LIT = 8  # of them where direct light is worked out
TRIED = 64  # places of a cell on a polygon's border, of which those inside are used


class Nodes:
    """Cells of the surfaces that send light on, then merged vertices of meshes: n nodes.

    lattice: the cells, of as many charts as there are surfaces; surface (n,); places: Placed, PLACES of each node in
    turn; number (n surfaces,) of their nodes, first (n surfaces,) of meshes; hidden (n, PLACES) bool: places that
    nothing comes to, for which others of the node stand in; old (n,): see refined.
    """

    def __init__(self, facets, sends):
        self.facets, self.sends, scene = facets, sends, facets.scene
        shapes = [s.shape for s in scene.surfaces]
        self.is_mesh, self.is_ball, self.is_polygon = (
            np.array([isinstance(shape, kind) for shape in shapes]) for kind in (Mesh, Sphere, Polygon)
        )
        self.extent = np.array([_extent(shape) for shape in shapes])
        area = scene.areas[sends].sum() or 1.0
        self.size = np.sqrt(area / USUAL)  # m, of a cell, and of those in which a mesh's vertices are merged
        self.meshes = Merged(facets, np.flatnonzero(self.is_mesh & sends), self.size)
        lattice = Lattice.even(self._first_cells(), self.is_ball)
        self._lay_out(lattice, np.full(len(lattice), -1), None)

    def __len__(self):
        return len(self.surface)

    def _first_cells(self):
        scene = self.facets.scene
        extent = np.zeros((len(scene), 2))
        for k in np.flatnonzero(~self.is_mesh & self.sends):
            shape = scene.surfaces[k].shape
            if isinstance(shape, Sphere):
                extent[k] = 2 * np.pi * shape.semi_axes[0], np.pi * shape.semi_axes[0]
            else:
                extent[k] = np.linalg.norm(shape.linear[:, :2], axis=0)
        level = np.round(np.log2(np.maximum(extent / self.size, 1.0)))
        cells = np.minimum(2 ** level.astype(int), FIRST)
        cells[self.is_ball] = np.maximum(cells[self.is_ball], BALL)
        cells[self.is_mesh | ~self.sends] = 0
        return cells

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
        share[new], at = self._cells(lattice, np.flatnonzero(new))
        if before is not None:
            share[~new] = before.share[known[~new]]
        at, some = at[share[new] > 0], share > 0
        self.lattice = lattice.without(~some)
        points = self._on_charts(lattice.chart[some & new], at)
        unknown = np.full(points.shape, np.nan), np.full(points.shape[:2], -1)
        return lattice.chart[some], known[some], share[some], points, *unknown

    def _cells(self, lattice, some):
        """Of leaves (k,): the part of the chart that each is (k,), 0 of those that hold nothing of it, and PLACES of it
        on the chart (k, PLACES, 2)."""
        own, size = lattice.chart[some], lattice.size[lattice.chart[some]]
        corner, step = lattice.corner[some], lattice.step[some]
        at = (corner[:, None] + step[:, None] * square_lattice(PLACES)) / size[:, None]
        share = lattice.share()[some]
        ball = np.flatnonzero(self.is_ball[own])
        low, high = (np.cos(np.pi * (corner[ball, 1] + k * step[ball, 1]) / size[ball, 1]) for k in (0, 1))
        share[ball] = (low - high) / 2 * step[ball, 0] / size[ball, 0]
        # by area: the cosine of the polar angle evenly
        across = low[:, None] + square_lattice(PLACES)[:, 1] * (high - low)[:, None]
        at[ball, :, 1] = np.arccos(np.clip(across, -1.0, 1.0)) / np.pi
        for k in np.unique(own[self.is_polygon[own]]):
            mine = np.flatnonzero(own == k)
            inside = _inside(self.facets.scene.surfaces[k].shape, corner[mine], step[mine], lattice.size[k], at[mine])
            share[mine] *= inside[0]
            at[mine] = inside[1]
        return share, at

    @cached_property
    def weight(self):
        """(n,) m^2 of what is seen of each."""
        return self.share * self.extent[self.surface] * (1 - self.hidden.mean(axis=1))

    def _on_charts(self, own, at):
        """Points (k, j, 3) m at chart positions (k, j, 2) of surfaces (k,)."""
        shapes = [s.shape for s in self.facets.scene.surfaces]
        local = np.concatenate([at, np.zeros((*at.shape[:2], 1))], axis=2)
        ball = self.is_ball[own]
        local[ball] = ball_place(at[ball].reshape(-1, 2)).reshape(-1, at.shape[1], 3)
        flat = ~self.is_mesh
        linear, origin = np.zeros((len(shapes), 3, 3)), np.zeros((len(shapes), 3))
        linear[flat] = np.array([shapes[k].linear for k in np.flatnonzero(flat)]).reshape(-1, 3, 3)
        origin[flat] = np.array([shapes[k].origin for k in np.flatnonzero(flat)]).reshape(-1, 3)
        return origin[own][:, None] + np.einsum("nij,nkj->nki", linear[own], local)

    def uncover(self, new, hidden):
        """Leaves out places, hidden (k, PLACES) bool of the nodes new (k,), that nothing comes to: others of the same
        cell stand in for them, and cells without any are no nodes. Returns which of the nodes (n,) are left, and which
        of these (k,) start from other places than before."""
        self.hidden[new] = hidden
        alive = PLACES - self.hidden.sum(axis=1)
        lost = (alive == 0) & ~self.is_mesh[self.surface]
        kept = np.flatnonzero(~lost)
        changed = new[(alive[new] > 0) & (alive[new] < PLACES)]
        order = np.argsort(self.hidden[changed], axis=1, kind="stable")
        pick = np.take_along_axis(order, np.arange(PLACES) % alive[changed, None], axis=1)
        index = np.arange(len(self) * PLACES).reshape(-1, PLACES)
        index[changed] = changed[:, None] * PLACES + pick
        self.places.reorder(index[kept].ravel())
        self.number -= np.bincount(self.surface[lost], minlength=len(self.number))
        self.first[self.is_mesh] -= lost.sum()
        self.lattice = self.lattice.without(lost[: len(self.lattice)])
        for name in ("surface", "share", "hidden"):
            setattr(self, name, getattr(self, name)[kept])
        self.__dict__.pop("weight", None)
        return kept, np.searchsorted(kept, changed)

    def of(self, scene):
        """The same nodes on the same shapes of another scene."""
        new = copy.copy(self)
        new.facets = copy.copy(self.facets)
        new.facets.scene = scene
        new.__dict__.pop("reflectance", None)
        return new

    def from_place(self, which, j):
        """Receivers of nodes which (k,) at the j-th of their places, j (k,)."""
        return self.places.take(which * PLACES + j % PLACES)

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
        own = self.facets.surface[facet, np.where(front, 0, 1)]
        carries = (own >= 0) & (self.number[own] > 0)
        node, weight = np.zeros((len(facet), 4), np.int32), np.zeros((len(facet), 4), np.float32)
        mesh = np.flatnonzero(carries & self.is_mesh[own])
        if len(mesh):
            node[mesh, :3], weight[mesh, :3] = self.on_meshes(own[mesh], facet[mesh], at[mesh])
        flat = np.flatnonzero(carries & ~self.is_mesh[own])
        if len(flat):
            node[flat], weight[flat] = self.lattice.columns(own[flat], self._chart_at(facet[flat], at[flat]))
        return node, weight

    def on_meshes(self, own, facet, at):
        """Nodes and weights (h, 3) of surfaces (h,) at places (h, 2) of their facets (h,)."""
        group, weight = self.meshes.corners(facet, at)
        return self.first[own][:, None] + group, weight

    def _chart_at(self, facet, at):
        """Chart positions (h, 2) of hits; a facet's own (s, t) are on it."""
        local = np.flatnonzero(facet < self.facets.count)
        chart = self.facets.chart.take(facet[local], axis=0)
        at = at.astype(float)
        at[local] = chart[:, :, 0] + chart[:, :, 1] * at[local, :1] + chart[:, :, 2] * at[local, 1:]
        return np.clip(at, 0.0, 1.0)

    def surplus(self, value, uneven):
        """Values (n, c) of the nodes, and how uneven (n,) the light within each is -> how far values of cells half as
        wide along each axis may be off (k cells, 2), and those of finer groups of meshes, in L2 (n surfaces,): m times
        the value's unit."""
        meshes = np.zeros(len(self.number))
        for k in self.meshes.which:
            meshes[k] = NEXT * self.meshes.surplus(k, value[self.first[k] :])
        cells = len(self.lattice)
        return self.lattice.surplus(value[:cells], uneven[:cells]), meshes

    def refined(self, cells, meshes):
        """cells (k, 2) bool: which are halved along which axis; meshes (n surfaces,) bool: which are merged less ->
        Nodes, whose `old` (n,) is which node of these each was, -1 of new ones."""
        new = copy.copy(self)
        for name in ("weight", "reflectance"):
            new.__dict__.pop(name, None)
        new.meshes = self.meshes.finer(meshes)
        new._lay_out(*self.lattice.split(cells), self)
        return new


def _extent(shape):
    """m^2 of a shape's whole chart; 1 of a mesh, whose parts are told in m^2."""
    if isinstance(shape, Mesh):
        return 1.0
    return np.linalg.norm(np.cross(*shape.linear[:, :2].T)) if isinstance(shape, Polygon) else shape.area


def _as_before(k, before):
    """As Nodes._of_cells, of a mesh whose nodes are those of before."""
    old, none = before.first[k] + np.arange(before.number[k]), np.zeros((0, PLACES, 3))
    return np.full(len(old), k), old, before.share[old], none, none, np.zeros((0, PLACES), int)


def _inside(polygon, corner, step, size, at):
    """Of cells from corners (k, 2) on, step (k, 2) wide, in a polygon's chart of size (2,): the part of each (k,) that
    lies in the polygon, and places (k, PLACES, 2) in it, at (k, PLACES, 2) where it is all."""
    tried = (corner[:, None] + step[:, None] * square_lattice(TRIED)) / size
    inside = polygon.contains(tried.reshape(-1, 2)).reshape(tried.shape[:2])
    count = inside.sum(axis=1)
    order = np.argsort(~inside, axis=1, kind="stable")
    pick = order[np.arange(len(corner))[:, None], np.arange(PLACES) % np.maximum(count, 1)[:, None]]
    chosen = np.take_along_axis(tried, pick[..., None], axis=1)
    if not count.any() and len(count) == size.prod():  # a sliver between all places: its triangles' middles
        middles = polygon.local(polygon.triangles.mean(axis=1))[:, :2]
        count[0], chosen[0] = 1, middles[np.arange(PLACES) % len(middles)]
    return count / TRIED, np.where((count == TRIED)[:, None, None], at, chosen)
