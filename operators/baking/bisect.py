"""Triangles that are halved where wanted, without cracks: newest vertex bisection. numpy only, no bpy.

A triangle is halved across its edge 0-1, which is the longest at first and lies opposite the newest vertex later on. An
edge to be cut takes the edges 0-1 of the triangles on both its sides along (Mitchell 1988; all the edges at once as in
Funken, Praetorius and Wissgott 2011), so that no vertex is ever left hanging on an edge.
"""

from dataclasses import dataclass, field

import numpy as np

from ..reading.mesh_topology import MeshArrays

CORNERS = np.array([[2, 0], [1, 2]])  # of the halves, beside the new vertex: their own edges 0-1


@dataclass(frozen=True, eq=False)
class Cut:
    """One round, for replaying it on another mesh. edges (k, 2): vertices between which new ones are made, numbered
    from `first` on; passes [(triangle (h,), vertices (h, 4))]: triangles halved in turn, their corners and the vertex
    in the middle of the first two. Of a triangle's halves that at its corner 0 keeps its number, the others are
    numbered on."""

    edges: np.ndarray
    first: int
    passes: list


@dataclass(eq=False)
class Bisected:
    """corner (t, 3): vertices of the triangles; values {name: (t, 3, ...)} at the corners, middle {name: (t, 3, ...)}
    at the middles of the edges 0-1, 1-2, 2-0, nan where unknown; root (t,): the triangle each was at first; points
    (n,): the triangle in which each of n places lies, weight (n, 3) of its corners."""

    corner: np.ndarray
    values: dict
    middle: dict
    root: np.ndarray
    points: np.ndarray
    weight: np.ndarray
    size: int
    cuts: list = field(default_factory=list)

    @classmethod
    def make(cls, vertices, corner, values, points, weight):
        """Of vertices (n, 3) m and corner (t, 3), with values at the corners, and places in them; turns each triangle's
        longest edge to be its first, the same from both of its sides."""
        ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1), axis=-1)
        length = np.linalg.norm(vertices[ends[..., 1]] - vertices[ends[..., 0]], axis=-1)
        rank = np.lexsort((*ends.reshape(-1, 2).T, length.ravel())).argsort().reshape(length.shape)
        turned = (rank.argmax(axis=1)[:, None] + np.arange(3)) % 3
        values = {name: _taken(value, turned) for name, value in values.items()}
        middle = {name: np.full(value.shape, np.nan) for name, value in values.items()}
        weight = np.take_along_axis(weight, turned[points], axis=1)
        corner = np.take_along_axis(corner, turned, axis=1)
        return cls(corner, values, middle, np.arange(len(corner)), points, weight, len(vertices))

    @property
    def arrays(self):
        """As MeshArrays, without vertices' places."""
        return MeshArrays.make(np.zeros((self.size, 3)), self.corner.ravel(), np.full(len(self.corner), 3))

    def edges_of(self, wanted):
        """edge (t, 3): number of each triangle's edges; cut (e,): those of triangles wanted (t,) bool, and of what
        else has to be cut then."""
        edge = self.arrays.edge.reshape(-1, 3)
        cut = np.zeros(edge.max(initial=-1) + 1, bool)
        cut[edge[wanted]] = True
        while True:
            also = cut[edge].any(axis=1) & ~cut[edge[:, 0]]
            if not also.any():
                break
            cut[edge[also, 0]] = True
        return edge, cut

    def bisect(self, wanted):
        """Cuts all edges of the triangles wanted (t,) bool, and what else has to be."""
        edge, cut = self.edges_of(wanted)
        number = np.where(cut, self.size + np.cumsum(cut) - 1, -1)
        ends = np.empty((len(cut), 2), np.int64)
        ends[edge.ravel()] = np.stack([self.corner, np.roll(self.corner, -1, axis=1)], axis=-1).reshape(-1, 2)
        done = Cut(ends[cut], self.size, [])
        self.size += int(cut.sum())
        made = number[edge]  # (t, 3) the new vertex on each edge, or -1
        while (halved := np.flatnonzero(made[:, 0] >= 0)).size:
            done.passes.append((halved, np.column_stack([self.corner[halved], made[halved, 0]])))
            made = self._halve(halved, made)
        self.cuts.append(done)

    def _halve(self, halved, made):
        """Halves triangles (h,); made (t, 3): vertices on their edges -> the same of all there are then."""
        low = self._move_points(halved)
        added = len(self.corner) + np.arange(len(halved))
        self.points = np.where(low == 1, added[np.searchsorted(halved, self.points) % len(halved)], self.points)
        here = made[halved]
        none = np.full(len(halved), -1)
        halves = [np.column_stack([here[:, k], none, none]) for k in (2, 1)]
        self.corner, made = (
            _grown(whole, halved, parts)
            for whole, parts in (
                (self.corner, [np.column_stack([self.corner[halved][:, c], here[:, 0]]) for c in CORNERS]),
                (made, halves),
            )
        )
        for name, value in self.values.items():
            own, middle = value[halved], self.middle[name][halved]
            parts = [np.concatenate([own[:, c], middle[:, :1]], axis=1) for c in CORNERS]
            self.values[name] = _grown(value, halved, parts)
            unknown = np.full(own[:, :2].shape, np.nan)
            parts = [np.concatenate([middle[:, k : k + 1], unknown], axis=1) for k in (2, 1)]
            self.middle[name] = _grown(self.middle[name], halved, parts)
        self.root = np.concatenate([self.root, self.root[halved]])
        return made

    def _move_points(self, halved):
        """Weights of the places in the halves; (n,) 0 and 1 where a place is in the first and second, else -1."""
        is_halved = np.zeros(len(self.corner), bool)
        is_halved[halved] = True
        moved, (a, b, c) = is_halved[self.points], self.weight.T
        first = np.column_stack([c, a - b, 2 * b])
        second = np.column_stack([b - a, c, 2 * a])
        self.weight = np.where(moved[:, None], np.where((a >= b)[:, None], first, second), self.weight)
        return np.where(moved, (a < b).astype(int), -1)


def _taken(value, turned):
    return np.take_along_axis(value, turned.reshape(turned.shape + (1,) * (value.ndim - 2)), axis=1)


def _grown(whole, halved, parts):
    """`whole` with rows `halved` replaced by the first of `parts`, the second at the end."""
    whole = whole.copy()
    whole[halved] = parts[0]
    return np.concatenate([whole, parts[1]])
