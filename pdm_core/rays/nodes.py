"""Where reflected light is kept: in cells over the charts of surfaces, at merged vertices of meshes.

The light of a cell is its mean: each direction starts at another place of it, so that what is sent on is right in sum
wherever shadows end, and nothing hangs on single points in corners. Between the cells' middles it is bilinear; on the
faces of a mesh linear.
"""

import copy
from functools import cached_property

import numpy as np

from ..mesh import Mesh
from ..polygon import Polygon
from ..scene import Sphere, square_lattice
from .bundles import ball_place
from .placed import Placed

FINEST = 256  # cells along an axis
USUAL = 3000  # cells to begin with, where there are fewer shapes
BALL = 4, 2  # cells about the axis of a ball and along it, at least
PLACES = 16  # of a cell from which rays start in turn
LIT = 8  # of them where direct light is worked out
TRIED = 64  # places of a cell on a polygon's border, of which those inside are used
NEXT = 0.4  # of the surplus that cells show: what is left within them
BENT = 0.2  # of how far values vary over a face between its own vertices: how far linear ones are off
WHOLE = 0.95  # of a mesh's vertices, with their normals: when so many are on their own it is no use to part the others
MERGED = 1.0  # size of the cells in which a mesh's vertices are merged, of a chart's cell
BESIDE = (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)  # steps to a cell's neighbours
SIDES = 6  # of the directions in which their normals are told apart


class Nodes:
    """Cells of the surfaces that send light on, and merged vertices of meshes: n nodes.

    cells (n surfaces, 2): along each chart, 0 of meshes and of surfaces that send nothing; first, number (n surfaces,):
    each one's nodes; surface (n,); weight (n,) m^2; places: Placed, PLACES of each node in turn.
    """

    def __init__(self, facets, sends, cells=None, merged=None):
        self.facets, self.sends, scene = facets, sends, facets.scene
        self.is_mesh = np.array([isinstance(s.shape, Mesh) for s in scene.surfaces])
        self.is_ball = np.array([isinstance(s.shape, Sphere) for s in scene.surfaces])
        area = scene.areas[sends].sum() or 1.0
        self.size = np.sqrt(area / USUAL)  # m, of a cell
        self.cells = self._first_cells() if cells is None else cells
        self.merged = np.full(len(scene), MERGED * self.size) if merged is None else merged
        self.grid = self.cells.prod(axis=1)
        self.grid_first = np.cumsum(self.grid) - self.grid
        self._lay_out()

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
        cells = np.minimum(2 ** level.astype(int), FINEST // 4)
        cells[self.is_ball] = np.maximum(cells[self.is_ball], BALL)
        cells[self.is_mesh | ~self.sends] = 0
        return cells

    def _lay_out(self):
        """Nodes of all cells that hold part of their surface, and of all meshes; the places of each."""
        scene = self.facets.scene
        own = np.repeat(np.arange(len(scene)), self.grid)
        index = np.arange(len(own)) - self.grid_first[own]
        corner = np.column_stack(np.divmod(index, np.maximum(self.cells[own, 1], 1)))
        at = (corner[:, None] + square_lattice(PLACES)) / self.cells[own][:, None]
        self._even_on_balls(at, own, corner)
        polar = np.pi * (corner[:, 1:] + [0, 1]) / np.maximum(self.cells[own, 1:], 1)
        share = np.where(self.is_ball[own], -np.diff(np.cos(polar), axis=1)[:, 0] * self.cells[own, 1] / 2, 1.0)
        share /= np.maximum(self.grid[own], 1)
        is_polygon = np.array([isinstance(s.shape, Polygon) for s in scene.surfaces])
        for k in np.flatnonzero(is_polygon & (self.grid > 0)):
            part = slice(self.grid_first[k], self.grid_first[k] + self.grid[k])
            share[part], at[part] = _inside(scene.surfaces[k].shape, corner[part], self.cells[k], at[part])
        self.alias = _nearest_kept(own, corner, share > 0, self.grid_first)
        kept = np.flatnonzero(share > 0)
        total = np.bincount(own[kept], share[kept], len(scene))
        self._merge()
        number = np.bincount(own[kept], minlength=len(scene)) + self.mesh_number
        self.number, self.first = number, np.cumsum(number) - number
        self.surface = np.repeat(np.arange(len(scene)), number)
        self.weight, points = np.zeros(len(self)), np.zeros((len(self), PLACES, 3))
        normals, triangle = np.full(points.shape, np.nan), np.full(points.shape[:2], -1)
        flat = np.flatnonzero(~self.is_mesh[self.surface])
        self.alias = flat.astype(np.int32)[self.alias] if len(flat) else self.alias
        self.weight[flat] = share[kept] / total[own[kept]] * scene.areas[own[kept]]
        points[flat] = self._on_charts(own[kept], at[kept])
        for k in np.flatnonzero(self.mesh_number > 0):
            part = slice(self.first[k], self.first[k] + number[k])
            points[part], normals[part], triangle[part], self.weight[part] = self._on_mesh(k)
        own = np.repeat(self.surface, PLACES)
        self.places = Placed(self.facets, own, points.reshape(-1, 3), normals.reshape(-1, 3), triangle=triangle.ravel())

    def _even_on_balls(self, at, own, corner):
        """Places at (g, PLACES, 2) of cells on balls spread by area: the cosine of the polar angle evenly."""
        ball = self.is_ball[own]
        cells = self.cells[own[ball], 1:]
        low, high = (np.cos(np.pi * (corner[ball, 1:] + k) / cells) for k in (0, 1))
        part = at[ball, :, 1] * cells - corner[ball, 1:]
        at[ball, :, 1] = np.arccos(np.clip(low + part * (high - low), -1.0, 1.0)) / np.pi

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

    def _merge(self):
        """Groups of each mesh's corners: corner (m facets, 3), which of its surface's nodes a facet's corners are."""
        scene, facets = self.facets.scene, self.facets
        self.corner = np.zeros((facets.count, 3), np.int32)
        self.mesh_number, self.unmerged = np.zeros(len(scene), int), np.zeros(len(scene))
        done = {}
        for k in np.flatnonzero(self.is_mesh & self.sends):
            shape, key = scene.surfaces[k].shape, scene.shape_of[k]
            if key not in done:
                group = merged_corners(shape, self.merged[k])
                start = facets.first[key]
                self.corner[start : start + len(shape.triangles)] = group
                done[key] = group.max() + 1, len(np.unique(shape.triangles.ravel() * SIDES + _side(shape)))
            self.mesh_number[k], self.unmerged[k] = done[key][0], done[key][0] / done[key][1]

    def _on_mesh(self, k):
        """Points, normals (g, j, 3), triangles (g, j) and areas (g,) of the groups of a mesh's corners: each corner
        stands for a third of its triangle, at the middle of that third."""
        scene = self.facets.scene
        shape, start = scene.surfaces[k].shape, self.facets.first[scene.shape_of[k]]
        group = self.corner[start : start + len(shape.triangles)].ravel()
        area = np.repeat(shape.areas / 3, 3)
        corners = shape.vertices[shape.triangles]
        points = (corners / 2 + corners.mean(axis=1, keepdims=True) / 2).reshape(-1, 3)
        weight = np.bincount(group, area)
        # of each group places by equal parts of its area
        order = np.argsort(group, kind="stable")
        begin = np.searchsorted(group[order], np.arange(len(weight)))
        cumulated = np.cumsum(area[order])
        before = np.concatenate([[0.0], cumulated])[begin]
        want = before[:, None] + (np.arange(PLACES) + 0.5) / PLACES * weight[:, None]
        last = np.append(begin[1:], len(order)) - 1
        pick = np.clip(np.searchsorted(cumulated, want), begin[:, None], last[:, None])
        pick = order[pick[:, np.argsort(square_lattice(PLACES)[:, 0])]]  # in an order that the first few are spread
        normals = scene.surfaces[k].sign * shape.corner_normals.reshape(-1, 3)
        return points[pick], normals[pick], pick // 3, weight

    def shut(self, closed):
        """The same nodes; cells that are closed (n,), which nobody sees, are taken for an open one beside them, if any:
        what is seen next to them is then between open ones."""
        own = np.repeat(np.arange(len(self.grid)), self.grid)
        shut = np.flatnonzero(closed[self.alias])
        own, alias = own[shut], self.alias.copy()
        column, row = np.divmod(shut - self.grid_first[own], np.maximum(self.cells[own, 1], 1))
        found = np.zeros(len(shut), bool)
        for a, b in BESIDE:
            i = np.where(self.is_ball[own], (column + a) % np.maximum(self.cells[own, 0], 1), column + a)
            there = (i >= 0) & (i < self.cells[own, 0]) & (row + b >= 0) & (row + b < self.cells[own, 1])
            some = np.flatnonzero(there & ~found)
            beside = self.alias[self.grid_first[own[some]] + i[some] * self.cells[own[some], 1] + row[some] + b]
            some, beside = some[~closed[beside]], beside[~closed[beside]]
            alias[shut[some]], found[some] = beside, True
        new = copy.copy(self)
        new.alias = alias
        return new

    def of(self, scene):
        """The same nodes on the same shapes of another scene."""
        new = copy.copy(self)
        new.facets = copy.copy(self.facets)
        new.facets.scene = scene
        new.__dict__.pop("reflectance", None)
        return new

    def from_place(self, which, j):
        """Receivers of nodes which (k,) at the j-th of their places."""
        return self.places.take(which * PLACES + j % PLACES)

    def lit_places(self, which):
        """Receivers at LIT places of each of the nodes which (k,), in turn."""
        return self.places.take((which[:, None] * PLACES + np.arange(LIT)).ravel())

    @cached_property
    def reflectance(self):
        """(n, 3) of the surfaces at the nodes, where they vary its mean over each."""
        scene = self.facets.scene
        out = scene.reflectance[self.surface].copy()
        for k in np.flatnonzero([callable(s.reflectance) for s in scene.surfaces]):
            if self.number[k]:
                part = slice(self.first[k], self.first[k] + self.number[k])
                points = self.places.exact.reshape(-1, PLACES, 3)[part]
                value = scene.surfaces[k].reflectance_at(points.reshape(-1, 3))
                out[part] = value.reshape(-1, PLACES, 3).mean(axis=1)
        return out

    def columns(self, facet, at, front):
        """Hits -> nodes (h, 4) and weights (h, 4) that interpolate there; weights of hits that carry nothing are 0."""
        own = self.facets.surface[facet, np.where(front, 0, 1)]
        carries = (own >= 0) & self.sends[own]
        node, weight = np.zeros((len(facet), 4), np.int32), np.zeros((len(facet), 4), np.float32)
        mesh = np.flatnonzero(carries & self.is_mesh[own])
        if len(mesh):
            s, t = at[mesh].T
            node[mesh, :3] = self.first[own[mesh], None] + self.corner[facet[mesh]]
            weight[mesh, :3] = np.stack([1 - s - t, s, t], axis=1)
        flat = np.flatnonzero(carries & ~self.is_mesh[own])
        if len(flat):
            node[flat], weight[flat] = self.on_lattice(own[flat], self._chart_at(facet[flat], at[flat]))
        return node, weight

    def _chart_at(self, facet, at):
        """Chart positions (h, 2) of hits; a facet's own (s, t) are on it."""
        local = np.flatnonzero(facet < self.facets.count)
        chart = self.facets.chart.take(facet[local], axis=0)
        at = at.astype(float)
        at[local] = chart[:, :, 0] + chart[:, :, 1] * at[local, :1] + chart[:, :, 2] * at[local, 1:]
        return np.clip(at, 0.0, 1.0)

    def on_lattice(self, own, at):
        """Nodes and weights (h, 4) of surfaces (h,) at chart positions (h, 2); a ball's turn goes round."""
        cells = self.cells.take(own, axis=0)
        scaled = at * cells - 0.5
        low = np.floor(scaled).astype(np.int64)
        x, y = (scaled - low).T.astype(np.float32)
        high = low + 1
        ball = self.is_ball[own]
        for end in (low, high):
            turned = np.where(ball, end[:, 0] % cells[:, 0], end[:, 0])
            end[:, 0] = np.clip(turned, 0, cells[:, 0] - 1)
            end[:, 1] = np.clip(end[:, 1], 0, cells[:, 1] - 1)
        first, row = self.grid_first.take(own), cells[:, 1]
        node = np.stack([first + a * row + b for a in (low[:, 0], high[:, 0]) for b in (low[:, 1], high[:, 1])], axis=1)
        return self.alias.take(node), np.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], axis=1)

    def surpluses(self, value, uneven):
        """Values (n, c) of the nodes, and how uneven (n,) the light within each is -> (n surfaces, 2): L2 errors, m
        times the value's unit, that cells half as large may show along each axis of the charts; of meshes once."""
        out = np.zeros((len(self.number), 2))
        areas = self.facets.scene.areas
        within = np.bincount(self.surface, self.weight * uneven**2, len(out))
        for kind, some in self._alike():
            nodes = self.alias[self.grid_first[some][:, None] + np.arange(kind[0] * kind[1])]
            v = value[nodes].reshape(len(some), *kind, -1)
            for axis in range(2):
                if kind[axis] == 1:
                    out[some, axis] = np.sqrt(within[some] / 2)
                    continue
                off = _halves_off(np.moveaxis(v, 1 + axis, 0), self.is_ball[some[0]] and axis == 0)
                out[some, axis] = np.sqrt((off**2).sum(axis=-1).mean(axis=(0, 2)) * areas[some])
        for k in np.flatnonzero(self.is_mesh & (self.number > 0)):
            out[k, 0] = self._mesh_surplus(k, value)
        return NEXT * out

    def _alike(self):
        """((cells along both axes), surfaces (k,)) of charts of as many cells; balls apart."""
        some = np.flatnonzero(self.cells[:, 0] > 0)
        kinds, which = np.unique(np.column_stack([self.cells[some], self.is_ball[some]]), axis=0, return_inverse=True)
        which = which.reshape(-1)
        return [(tuple(kind[:2]), some[which == k]) for k, kind in enumerate(kinds.tolist())]

    def _mesh_surplus(self, k, value):
        """How far values vary over the faces of a mesh, in L2."""
        scene = self.facets.scene
        shape, start = scene.surfaces[k].shape, self.facets.first[scene.shape_of[k]]
        v = value[self.first[k] + self.corner[start : start + len(shape.triangles)]]
        spread = ((v - v.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1)
        # between merged vertices it may jump so far; between the mesh's own it bends a little
        jumps = np.clip(2 * (1 - self.unmerged[k]), BENT, 1.0)
        return float(jumps * np.sqrt((spread * shape.areas).sum()))

    @property
    def is_finest(self):
        """(n surfaces,) of meshes: whether all but all of their vertices stand for themselves."""
        return self.unmerged > WHOLE

    def refined(self, along):
        """along (n surfaces, 2) bool: axes of charts whose cells are halved -> Nodes, and old (n,) in it: which node of
        this one each was, -1 of new ones."""
        cells = np.where(along & (self.cells > 0), np.minimum(2 * self.cells, FINEST), self.cells)
        merged = np.where(along[:, 0] & self.is_mesh, self.merged / 2, self.merged)
        new = Nodes(self.facets, self.sends, cells, merged)
        old = np.full(len(new), -1)
        same = np.flatnonzero(~along.any(axis=1) & (self.number > 0))
        for k in same:
            old[new.first[k] + np.arange(self.number[k])] = self.first[k] + np.arange(self.number[k])
        return new, old


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


def _inside(polygon, corner, cells, at):
    """Of cells with corners (k, 2) in a polygon's chart of cells (2,): the share of each in the chart (k,) that lies in
    the polygon, and places (k, PLACES, 2) in it, at (k, PLACES, 2) where it is all."""
    tried = (corner[:, None] + square_lattice(TRIED)) / cells
    inside = polygon.contains(tried.reshape(-1, 2)).reshape(tried.shape[:2])
    count = inside.sum(axis=1)
    order = np.argsort(~inside, axis=1, kind="stable")
    pick = order[np.arange(len(corner))[:, None], np.arange(PLACES) % np.maximum(count, 1)[:, None]]
    chosen = np.take_along_axis(tried, pick[..., None], axis=1)
    if not count.any():  # a sliver between all places: its triangles' middles
        middles = polygon.local(polygon.triangles.mean(axis=1))[:, :2]
        count[0], chosen[0] = 1, middles[np.arange(PLACES) % len(middles)]
    return count / TRIED / cells.prod(), np.where((count == TRIED)[:, None, None], at, chosen)


def _nearest_kept(own, corner, kept, first):
    """(g,) For each cell of all charts the number, among those kept, of the one that stands for it: itself, or of those
    of its own surface (g,) the nearest."""
    number = np.cumsum(kept) - 1
    lost = np.flatnonzero(~kept)
    for k in np.unique(own[lost]):
        mine = np.flatnonzero(own == k)
        there, gone = mine[kept[mine]], mine[~kept[mine]]
        if len(there):
            far = ((corner[gone][:, None] - corner[there]) ** 2).sum(axis=2)
            number[gone] = number[there[far.argmin(axis=1)]]
    return number


def merged_corners(mesh, size):
    """(t, 3) group of each corner of a mesh's triangles: those in one cell of that size, m, whose normals look much the
    same way are one."""
    corner_vertex = mesh.triangles.ravel()
    points = mesh.vertices[corner_vertex]
    cell = np.floor((points - points.min(axis=0)) / max(size, 1e-300)).astype(np.int64)
    cell = np.minimum(cell, 1 << 15)
    key = ((cell[:, 0] << 40) + (cell[:, 1] << 20) + cell[:, 2]) * SIDES + _side(mesh)
    return np.unique(key, return_inverse=True)[1].reshape(-1, 3).astype(np.int32)


def _side(mesh):
    """(3 t,) which of SIDES the normal of each corner of a mesh's triangles looks to."""
    normals = mesh.corner_normals.reshape(-1, 3)
    axis = np.argmax(np.abs(normals), axis=1)
    return axis * 2 + (normals[np.arange(len(normals)), axis] > 0)
