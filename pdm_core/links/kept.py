"""Light of points by links, kept as matrices over groups of nodes: see kept.KeptGroups."""

import numpy as np

from ..at_once import slices
from ..checked import SceneError
from ..error_flow import areas_of_nodes
from ..field_values import conform
from ..kept import KeptGroups, group
from ..tolerances import TINY
from .received import mean_seen


class KeptLinks(KeptGroups):
    """Of a solution by links."""

    def __init__(self, scene, light, surface, points):
        """scene: as it was handed over"""
        t, sent = light.transport, light.transport.sent
        areas = areas_of_nodes(sent)
        of = group(sent.node_surface, sent.points, areas)
        super().__init__(scene, surface, points, of, sent.node_surface, areas, len(t.lights) + 1)
        self.areas = np.bincount(of, areas, self.count)
        self.lights, self.reflectors, self.has_background = t.lights, t.reflectors, t.background
        self.reached = t.reached
        self.take_nodes(t.fractions[..., None], light.reflectance)
        self.added = ~np.isin(self.group_surface, t.lights)[:, None]

    def steps(self, solved, chunk):
        """Generator of the fraction done, that works out what is kept of a SolvedLight; chunk: points at once."""
        t = solved.transport
        columns = yield from _grouped(t.rows, self.of, self.count, len(t.field.keys))
        node, weight = t.field.nodes[t.placed[0]], t.placed[1] * self.part[:, None]
        size = self.count * len(columns)
        spread = np.bincount((self.of[:, None] * len(columns) + node).ravel(), weight.ravel(), size)
        self.group_rows[:] = spread.astype(np.float32).reshape(self.count, -1) @ columns
        yield 0.1
        light, order = np.zeros((len(self.points), 3)), np.argsort(self.surface, kind="stable")
        for part in slices(len(order), chunk):
            self._see(solved, columns, order[part], light)
            yield 0.1 + 0.9 * min(part.stop, len(order)) / len(order)
        self.settle(light)

    def _see(self, solved, columns, index, light):
        t = solved.transport
        seen = solved.seen(self.surface[index], self.points[index] - t.origin)
        for s, part, lights, exact, cell, weight, covered in seen:
            received, mine = solved.received[s], index[part]
            value, scale = self._means(t, received, columns[t.field.node_surface == s], exact)
            nodes = received.local[t.field.nodes[cell]]
            for k in range(nodes.shape[1]):
                self.rows[mine] += weight[:, k, None].astype(np.float32) * value[nodes[:, k]]
            self.rows[mine] *= scale
            light[mine], self.factor[mine, :, 0] = received.between(cell, weight, exact), lights
            for array in (self.rows, light, self.factor):
                array[mine[covered]] = 0.0

    def _means(self, transport, received, columns, exact):
        """Of one surface's nodes: what they receive from the groups, of exact sources by their factor (n, count), and
        what points see of these instead (k, count)."""
        value, scale = columns.copy(), np.ones((len(exact), self.count), np.float32)
        for factor, e in zip(exact.T, received.exact, strict=True):
            own = np.flatnonzero(self.group_surface == transport.reflectors[e])
            seen = received.factors[:, e]
            even = self.areas[own] / self.areas[own].sum()
            overall = mean_seen(columns[:, own].sum(axis=0, keepdims=True), seen.sum(keepdims=True), even)
            known = (seen > TINY)[:, None]
            value[:, own] = np.where(known, columns[:, own] / np.where(known, seen[:, None], 1.0), overall)
            scale[:, own] = factor[:, None]
        return conform(transport.field, received.leaves, received.local, value), scale

    def check(self, scene):
        lit = (scene.emission > 0).any(axis=1)
        sends = (scene.reflectance > 0).any(axis=1) & self.reached
        dark = np.ones(len(scene), bool)
        dark[self.reflectors] = False
        shone = np.isin(np.arange(len(scene)), self.lights)
        if scene.lights or scene.sky is not None or (dark & (sends | (lit & ~shone))).any():
            raise SceneError("kept light: what was black or dark now sends light; solve again")
        if scene.background.any() and not self.has_background:
            raise SceneError("kept light: the background was dark and now sends light; solve again")

    def colours(self, scene):
        return np.concatenate([scene.emission[self.lights], scene.background[None]])

    def shining(self, scene):
        return np.where(self.added, scene.emission[self.group_surface], 0.0)


def _grouped(rows, of, count, length):
    """The matrix with columns summed by group: (length, count); yields."""
    out = np.zeros((length, count), np.float32)
    for block in rows.blocks:
        order = np.argsort(of[block.columns], kind="stable")
        first = np.flatnonzero(np.diff(of[block.columns][order], prepend=-1))
        if len(first):
            groups = of[block.columns][order[first]]
            out[np.ix_(block.rows, groups)] = np.add.reduceat(block.values[:, order], first, axis=1)
        yield 0.0
    return out
