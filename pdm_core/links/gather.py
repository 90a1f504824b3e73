"""Indirect light at points as rows over the field's nodes: geometry alone, no reflectance and no emission.

A row entry is (exact visible form factor of a source cell) x (kernel-weighted mean of the cell's biquadratics), so
a constant field is gathered exactly whatever the cells. Cells are taken as coarse as the tolerance allows.
"""

from dataclasses import dataclass

import numpy as np

from ..at_once import CACHED, parts
from ..numerics import Block
from .from_planes import FromPlanes
from .from_spheres import FromSpheres

BLOCK = 128  # rows of a dense block: neighbours, which use much the same nodes


@dataclass
class Detail:
    """What the field looks like, per cell, in the units of the tolerance: decides how finely sources are taken."""

    variation: np.ndarray  # (n cells,) range of the field over the cell
    below: np.ndarray  # (n cells,) largest surplus of its descendants: lost where the cell stands for them
    surface: np.ndarray  # (n surfaces,) range of the field over the surface


class Gather:
    """Rows of the indirect operator for receivers (points, normals, surface); sources: surfaces that may reflect."""

    def __init__(self, field, factors, sources):
        self.flat, self.balls, self.rooms = (sources[k] for k in factors.by_kind(sources))
        self.planes = FromPlanes(field, factors, self.flat)
        self.spheres = FromSpheres(field, factors, self.balls, self.rooms)
        self.by_surface = np.argsort(field.node_surface, kind="stable")  # nodes in the order of a block's columns
        self.rank = np.argsort(self.by_surface)

    def blocks(self, points, normals, surface, detail, tolerance):
        """Yield Blocks of the receivers' rows over the field's nodes, and None between as a sign of life.

        tolerance (m,): of one link, in detail's units.
        """
        step = max(2 * CACHED // max(len(self.flat) + len(self.balls) + len(self.rooms), 8), BLOCK)
        for some in parts(np.arange(len(points)), step):
            entries = []
            for entry in self._entries(points[some], normals[some], surface[some], detail, tolerance[some]):
                yield None
                if entry is not None:
                    entries.append(entry)
            yield from self._dense(entries, some)

    def _dense(self, entries, rows):
        """Entries (receiver (k,), nodes (k, j), weights (k, j)), receivers counted within rows (m,) -> Blocks, and
        None between."""
        each = [node.shape[1] // 9 for _, node, _ in entries]
        receiver = np.concatenate([np.zeros(0, int), *(np.repeat(e[0], k) for e, k in zip(entries, each))])
        node = np.concatenate([np.zeros((0, 9), int), *(e[1].reshape(-1, 9) for e in entries)])
        yield None
        weight = np.concatenate([np.zeros((0, 9)), *(e[2].reshape(-1, 9) for e in entries)])
        yield None
        order = np.argsort(receiver, kind="stable")
        starts = np.arange(0, len(rows), BLOCK)
        ends = np.searchsorted(receiver[order], np.append(starts, len(rows)))
        for start, low, high in zip(starts, ends[:-1], ends[1:]):
            pick, some = order[low:high], rows[start : start + BLOCK]
            nodes, used = self.rank.take(node.take(pick, axis=0)), np.zeros(len(self.rank), bool)
            used[nodes] = True
            columns = np.flatnonzero(used)
            place = (np.cumsum(used) - 1).take(nodes)
            place += (receiver[pick] - start)[:, None] * len(columns)
            dense = np.bincount(place.ravel(), weight.take(pick, axis=0).ravel(), minlength=len(some) * len(columns))
            yield Block(some, self.by_surface[columns], dense.astype(np.float32).reshape(len(some), len(columns)))

    def _entries(self, x, n, own, detail, tol):
        if len(self.balls):
            yield from self.spheres.from_balls(x, n, own, detail, tol)
        if len(self.flat):
            yield from self.planes.entries(x, n, own, detail, tol)
        if len(self.rooms):
            yield from self.spheres.from_rooms(x, n, own, detail, tol)
