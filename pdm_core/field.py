"""A field on the scene's surfaces: biquadratic cells of adaptive quadtrees, on lattices that share their nodes.

Each surface carries charts: a plane the unit square, cut where light bends or jumps, a sphere the six faces of a cube
(equi-angular, so no pole and no seam). A cell holds 3 x 3 nodes at 0, 1/2, 1; its four children hold the same nodes and
new ones between, so a value once computed is kept, and (child's value - parent's interpolant) is the hierarchical
surplus, an error measure.

Where shapes nearly touch, light varies over the width of the gap's mouth and surpluses cannot tell: in a gap both
sides see little but each other, so a coarse field there agrees with itself. Cells are made that small beforehand.
"""

import numpy as np

from .charts import CHARTS, FACING
from .contacts import contacts_of
from .field_charts import Cubes, Rectangles
from .shapes.shape import unit
from .tolerances import TOUCHING

DEEPEST = 10  # levels of cells below a chart
GRID = 2 ** (DEEPEST + 1)  # integer lattice steps across a chart
SPAN = CHARTS * (GRID + 1)
ROOT = 0.4  # a root's surplus over the bilinear interpolant counts this much
# cells in a gap between planes: no larger than so many gaps or that part of the other plane's radius, or, in charts
# that end where the gap does, so that nodes crowd there anyway, that one
GAPS, EXTENT, GRADED_EXTENT = 4.0, 0.2, 0.5


def basis(t):
    """t (...) -> (..., 3): the quadratics through nodes 0, 1/2, 1."""
    return np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)


def basis2(uv):
    """uv (..., 2) -> (..., 9): the biquadratics of a cell, node 3 * a + b at (a/2, b/2)."""
    a, b = basis(uv[..., 0]), basis(uv[..., 1])
    return (a[..., :, None] * b[..., None, :]).reshape(*uv.shape[:-1], 9)


_STEPS = np.array([(a, b) for a in range(3) for b in range(3)])  # a cell's nodes in half cell widths
_CORNER = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])  # the four children
_CHILD_OF_PARENT = basis2((_CORNER[:, None] + _STEPS / 2) / 2)  # (4, 9, 9) child's nodes from its parent's
_BILINEAR = np.array([[(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b] for a, b in _STEPS / 2])  # from corners
_EDGES = np.array([(0, 1, 2), (6, 7, 8), (0, 3, 6), (2, 5, 8)])  # a cell's edges as nodes
_QUARTERS = np.array([(3, 6, -1), (-1, 6, 3)]) / 8  # the quadratic at 1/4 and 3/4 of an edge


class Field:
    """The lattice; values live outside, as arrays (n nodes, channels)."""

    def __init__(self, scene):
        self.scene, self.contacts = scene, contacts_of(scene)
        self._frames()
        self.kinds = Rectangles(scene, GRID), Cubes(scene, GRID, self.depth)
        self.kind = np.array([s.shape.is_ball for s in scene.surfaces], int)  # (n surfaces,) which of the kinds
        self.charts = charts = np.choose(self.kind, [kind.count for kind in self.kinds])
        self.root = np.concatenate([[0], np.cumsum(charts)[:-1]])  # first root cell of each surface
        surface = np.repeat(np.arange(len(scene)), charts)
        face = np.arange(len(surface)) - self.root[surface]
        zero = np.zeros(len(surface), int)
        self.surface, self.face, self.level = surface, face, zero  # face: of a sphere's cube, or a plane's chart
        self.corner = self._starts(np.arange(len(surface)))  # of the cell, in lattice steps
        self.node_surface = np.zeros(0, int)
        self.keys = np.zeros(0, np.int64)
        self._order = np.zeros(0, int)
        self.points, self.normals = np.zeros((0, 3)), np.zeros((0, 3))
        self.parent, self.child = zero - 1, zero - 1  # child: the first of four, -1 for a leaf
        self.nodes = self._nodes_of(np.arange(len(surface)))
        self.refine(np.flatnonzero(self.charts[surface] == 1))  # planes of one chart start at 25 nodes, spheres have 26

    def _frames(self):
        shapes = [s.shape for s in self.scene.surfaces]
        self.origin = np.array([s.origin for s in shapes])
        self.linear, self.twist = np.array([s.linear for s in shapes]), np.array([s.twist for s in shapes])
        self.inverse = np.array([s.inverse for s in shapes])
        self.sign = np.array([s.sign for s in self.scene.surfaces])
        self.depth = np.ones(len(shapes))  # of the unit sphere: off its own inner side, where that hides something
        self.depth[self.contacts.shells[0]] = 1 - 4 * TOUCHING

    def _each(self, what, surface, *given):
        """What the charts of each one's kind tell of surfaces (n,), and given (n, ...): arrays (n, ...)."""
        kind = self.kind[surface]
        first = kind[0] if len(kind) else 0
        if (kind == first).all():
            return getattr(self.kinds[first], what)(surface, *given)
        out, places = [], [np.flatnonzero(kind == k) for k in range(len(self.kinds))]
        for charts, some in zip(self.kinds, places):
            out.append(getattr(charts, what)(surface.take(some), *(a.take(some, axis=0) for a in given)))
        return _merged(out, places) if isinstance(out[0], np.ndarray) else [_merged(p, places) for p in zip(*out)]

    # -- nodes ---------------------------------------------------------------------------------------------------

    def _key(self, surface, face, steps):
        """surface, face (n,), steps (n, 2) on the face -> (n,) keys; a point on two faces has one key."""
        place = self._each("lattice", surface, face, steps)
        return ((surface * SPAN + place[:, 0]) * SPAN + place[:, 1]) * SPAN + place[:, 2]

    def _unpack(self, keys):
        rest, z = np.divmod(keys, SPAN)
        rest, y = np.divmod(rest, SPAN)
        surface, x = np.divmod(rest, SPAN)
        return surface, np.stack([x, y, z], axis=1)

    def find(self, keys):
        """keys (...) -> node indices (...), -1 where there is no such node."""
        at = np.searchsorted(self.keys[self._order], keys)
        at = self._order[np.minimum(at, len(self._order) - 1)]
        return np.where(self.keys[at] == keys, at, -1)

    def _add_nodes(self, keys):
        new = np.unique(keys)
        if len(self.keys):
            new = new[self.find(new) < 0]
        surface, steps = self._unpack(new)
        local = self._each("local", surface, steps)
        points = self.contacts.clear(self._world(surface, local), surface)
        self.points = np.concatenate([self.points, points])
        self.normals = np.concatenate([self.normals, self._normal(surface, local)])
        self.keys = np.concatenate([self.keys, new])
        self._order = np.argsort(self.keys)
        self.node_surface = self._unpack(self.keys)[0]

    @property
    def part(self):
        """(n cells,): the chart of a plane or the sphere that each lies on, by the number of its first root cell."""
        return self.root[self.surface] + self._each("parts", self.surface, self.face)

    def chart_of(self, cells):
        """(n, 2): numbers along both edges of the charts that cells of planes lie on; 0 of spheres."""
        return self._each("number", self.surface[cells], self.face[cells])

    def _starts(self, cells):
        return self.kinds[0].starts[self.surface[cells][:, None], (0, 1), self.chart_of(cells)]

    def in_chart(self, cells):
        """(n, 2): lower corners of cells in coordinates of their charts, from 0 to 1."""
        return (self.corner[cells] - self._starts(cells)) / GRID

    def _world(self, surface, local):
        affine = np.einsum("nij,nj->ni", self.linear.take(surface, axis=0), local * self.depth[surface][:, None])
        twist = (local[:, 0] * local[:, 1])[:, None] * self.twist.take(surface, axis=0)
        return self.origin.take(surface, axis=0) + affine + twist

    def _normal(self, surface, local):
        across = np.einsum("nji,nj->ni", self.inverse.take(surface, axis=0), local)
        return unit(self._each("normals", surface, local, across)) * self.sign[surface][:, None]

    def _nodes_of(self, cells):
        half = (GRID >> self.level[cells]) // 2
        steps = self.corner[cells][:, None] + _STEPS * half[:, None, None]
        count = len(cells)
        keys = self._key(np.repeat(self.surface[cells], 9), np.repeat(self.face[cells], 9), steps.reshape(-1, 2))
        self._add_nodes(keys)
        return self.find(keys).reshape(count, 9)

    # -- cells ---------------------------------------------------------------------------------------------------

    @property
    def leaves(self):
        return np.flatnonzero(self.child < 0)

    def refine(self, cells):
        """Split these leaves, and coarser neighbours until no edge is halved twice (2:1 balance)."""
        while len(cells):
            self._split(cells[(self.child[cells] < 0) & (self.level[cells] < DEEPEST)])
            cells = self._unbalanced()

    def _split(self, cells):
        count, first = len(cells), len(self.level)
        repeat = np.repeat(cells, 4)
        half = (GRID >> self.level[repeat]) // 2
        corner = self.corner[repeat] + np.tile(_CORNER, (count, 1)) * half[:, None]
        self.child = self.child.copy()  # a solution may hold the field as it was
        self.child[cells] = first + 4 * np.arange(count)
        for name in ("surface", "face"):
            setattr(self, name, np.concatenate([getattr(self, name), getattr(self, name)[repeat]]))
        self.level = np.concatenate([self.level, self.level[repeat] + 1])
        self.corner = np.concatenate([self.corner, corner])
        self.parent = np.concatenate([self.parent, repeat])
        self.child = np.concatenate([self.child, np.full(4 * count, -1)])
        self.nodes = np.concatenate([self.nodes, self._nodes_of(first + np.arange(4 * count))])

    def _edge_nodes(self, cells, parts):
        """Nodes at odd multiples of 1/parts on the edges of cells -> (n, 4 edges, parts / 2), -1 where none."""
        odd = np.arange(1, parts, 2)
        along = [np.array([(0, k), (parts, k), (k, 0), (k, parts)]) for k in odd]
        step = (GRID >> self.level[cells]) // parts
        steps = self.corner[cells][:, None, None] + np.stack(along, axis=1)[None] * step[:, None, None, None]
        shape = steps.shape[:3]
        each = shape[1] * shape[2]
        keys = self._key(np.repeat(self.surface[cells], each), np.repeat(self.face[cells], each), steps.reshape(-1, 2))
        return self.find(keys).reshape(shape)

    def _unbalanced(self):
        leaves = self.leaves
        leaves = leaves[self.level[leaves] < DEEPEST - 2]
        return leaves[(self._edge_nodes(leaves, 8) >= 0).any(axis=(1, 2))]

    def conform_of(self, leaves, index, values):
        """Values (m, c) of some surface's nodes, continuous: those that hang on a coarser neighbour's edge set to it.

        leaves: all of the surface's; index (n nodes,): place of each of its nodes in values.
        """
        values = values.copy()
        hanging = self._edge_nodes(leaves, 4)
        for level in range(self.level[leaves].max() + 1):
            cell, edge, part = np.nonzero((hanging >= 0) & (self.level[leaves] == level)[:, None, None])
            ends = index[self.nodes[leaves[cell][:, None], _EDGES[edge]]]
            values[index[hanging[cell, edge, part]]] = np.einsum("nk,nkc->nc", _QUARTERS[part], values[ends])
        return values

    def sizes(self):
        """(n cells,) m^2: areas; a sphere's cells by their share of the equi-angular chart."""
        low = self.in_chart(np.arange(len(self.level)))
        high = low + 1 / (1 << self.level)[:, None]
        return self._each("areas", self.surface, self.face, low, high)

    def surplus_of(self, cells, index, values):
        """Values (m, c), at nodes through index (n nodes,) -> (n cells, 9, c): value minus the parent's interpolant.

        A root has no parent: its bilinear interpolant takes the place, weakened, being one order less.
        """
        at, parent = values.take(index.take(self.nodes.take(cells, axis=0)), axis=0), self.parent[cells]
        root, below = np.flatnonzero(parent < 0), np.flatnonzero(parent >= 0)
        out = np.empty(at.shape)
        out[root] = ROOT * (at[root] - np.einsum("ij,njc->nic", _BILINEAR, at[root][:, [0, 2, 6, 8]]))
        which = cells[below] - self.child[parent[below]]
        out[below] = at[below] - _CHILD_OF_PARENT[which] @ values[index[self.nodes[parent[below]]]]
        return out

    def surplus(self, values):
        """As surplus_of, for all cells and values (n nodes, c)."""
        return self.surplus_of(np.arange(len(self.level)), np.arange(len(self.keys)), values)

    def predict(self, values, old):
        """values (old, c) of the first nodes -> (n - old, c) at the others, from their cells' parents, coarse first."""
        full = np.concatenate([values, np.zeros((len(self.keys) - old, values.shape[1]))])
        known = np.arange(len(full)) < old
        for level in range(1, self.level.max() + 1):
            cells = np.flatnonzero((self.level == level) & ~known[self.nodes].all(axis=1))
            parent = self.parent[cells]
            guess = np.einsum("nij,njc->nic", _CHILD_OF_PARENT[cells - self.child[parent]], full[self.nodes[parent]])
            new = ~known[self.nodes[cells]]
            full[self.nodes[cells][new]] = guess[new]
            known[self.nodes[cells]] = True
        return full[old:]

    def inset(self, surface, points):
        """Points (n, 3) on a surface moved off a plane's border and off what stands on it."""
        points = self.kinds[self.kind[surface]].inset(surface, points)
        return self.contacts.clear(points, np.full(len(points), surface))

    def place(self, cells, uv):
        """Points and normals (n, 3) of cells (n,) at uv (n, 2) in [0, 1]."""
        surface, at = self.surface[cells], self.in_chart(cells) + uv * 0.5 ** self.level[cells][:, None]
        local = self._each("within", surface, self.face[cells], at)
        return self.contacts.clear(self._world(surface, local), surface), self._normal(surface, local)

    def local(self, surface, points):
        """points (n, 3) m on surfaces (n,) -> their local coordinates (n, 3)"""
        return np.einsum("nij,nj->ni", self.inverse.take(surface, axis=0), points - self.origin.take(surface, axis=0))

    # -- reading off ---------------------------------------------------------------------------------------------

    def chart(self, surface, local):
        """Local coordinates (n, 3) on surfaces (n,) -> root cells (n,) and chart coordinates (n, 2) in [0, 1]."""
        face, at = self._each("at", surface, local)
        return self.root[surface] + face, at

    def part_at(self, surface, points):
        """points (n, 3) m on surfaces (n,) -> the parts (n,) of them; -1 of points in space"""
        out, on = np.full(len(points), -1), np.flatnonzero(surface >= 0)
        own = surface[on]
        face = self.chart(own, self.local(own, points[on]))[0] - self.root[own]
        out[on] = self.root[own] + self._each("parts", own, face)
        return out

    def locate(self, surface, local):
        """Local coordinates (n, 3) on surfaces (n,) -> leaves (n,) and the weights (n, 9) of their nodes."""
        cell, uv = self.chart(surface, local)
        while (split := np.flatnonzero(self.child[cell] >= 0)).size:
            inner = uv.take(split, axis=0)
            upper = inner >= 0.5
            uv[split] = 2 * inner - upper
            cell[split] = self.child.take(cell[split]) + 2 * upper[:, 0] + upper[:, 1]
        return cell, basis2(uv)

    def interpolate(self, placed, value):
        """placed: what `locate` returned of n places; value (n nodes, c) -> (n, c) the field there"""
        cell, weight = placed
        return np.einsum("nk,nkc->nc", weight, value.take(self.nodes.take(cell, axis=0), axis=0))


def _merged(parts, places):
    """Parts (k, ...) of arrays, each at its places (k,), as one."""
    out = np.empty((sum(map(len, places)), *parts[0].shape[1:]), parts[0].dtype)
    for part, some in zip(parts, places):
        out[some] = part
    return out


def crowded(field, touching, flat, wanted):
    """Leaves that can be split and are larger than the scale of a nearby contact, and than touching (n shapes,) m of
    the two shapes, `flat` of it in gaps between planes: as large as those are, contacts of spheres are points.

    wanted (n surfaces,): whether a surface is to be resolved at all.
    """
    leaves = field.leaves[field.level[field.leaves] < DEEPEST]
    leaves = leaves[wanted[field.surface[leaves]]]
    leaves = leaves[np.sqrt(field.sizes()[leaves]) > min(flat, 1.0) * touching.min()]
    if not len(leaves):
        return leaves
    points, size = field.points[field.nodes[leaves, 4]], np.sqrt(field.sizes()[leaves])
    own = field.scene.shape_of[field.surface[leaves]]
    split, bend = np.zeros(len(leaves), bool), np.array([shape.bend for shape in field.scene.shapes])
    for k, shape in enumerate(field.scene.shapes):
        centre, radius = shape.bounds
        near = np.flatnonzero((own != k) & (np.linalg.norm(points - centre, axis=1) < radius + 3 * size))
        if not len(near):
            continue
        gap, least = shape.gap(points[near]), np.minimum(touching[k], touching[own[near]])
        radius = np.minimum(shape.bend, bend[own[near]])
        tangent = np.sqrt(gap * (gap + 2 * np.where(np.isfinite(radius), radius, 0.0)))
        wide = _flat_gap(field, leaves[near], points[near], size[near], shape)
        scale = np.where(np.isfinite(radius), np.maximum(tangent, least), np.maximum(wide, flat * least))
        split[near] |= size[near] > scale
    return leaves[split]


def _flat_gap(field, cells, points, size, plane):
    """Sizes (n,) m to which cells of planes, by their centres and sizes, are resolved before another plane."""
    normal = field.normals[field.nodes[cells, 4]]
    offset = plane.project(points) - points
    across = np.abs(np.einsum("ni,ni->n", normal, offset))
    beside = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - across**2, 0.0))
    gap = np.hypot(across, np.maximum(beside - size / 2, 0.0))
    own = field.surface[cells]
    ends = (field.charts[own] > 1) | (field.scene.areas[own] <= plane.area)
    # within the gap surpluses can tell
    scale = np.maximum(GAPS * gap, np.where(ends, GRADED_EXTENT, EXTENT) * plane.bounds[1])
    closed = across <= field.contacts.apart  # nothing lies between
    return np.where((np.abs(normal @ plane.normal) > FACING) & ~closed, scale, np.inf)
