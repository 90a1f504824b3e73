"""Geometry to rows: where light is gathered and sent from, factors of the lights there, and rows of what is between.

The same whatever the light: under other light the same shapes have the same transport.
"""

import copy
from collections import Counter

import numpy as np

from ..at_once import CACHED, slices
from ..biquadratic import STEPS
from ..contacts import contacts_of, settle
from ..field import Field
from ..numerics import Rows
from ..plan import MEMORY
from ..visibility import Factors, shafts_of
from .gather import Gather

HALVING_NODES = 10  # that halving a cell along one axis adds, with the neighbours that have to follow
BESIDE = 1e-4  # of a cell: less than of the smallest in it
DENSER = 1.2  # what the next rows may take, of what the last ones took


class Transport:
    """Of a Scene: field, whose nodes (n) gather indirect light, and sent, whose nodes send all of it on.

    lights, reflectors (k,): surfaces that shine and that reflect; background: whether it shines; fractions (n sent
    nodes, lights + 1): factors of the lights and of the background; rows (n nodes, n sent nodes); placed: where the
    nodes of sent lie in the field. Points are those of the given scene less the origin (3,) m.
    """

    def __init__(self, scene, plan):
        self.scene, self.origin = settle(scene)
        self.counts, self.plan, self.reached = Counter(), plan, plan.reached
        self.factors = Factors(self.scene, shafts_of(self.scene), self.counts)
        scene = self.scene
        self.area = scene.areas[self.reached].sum() or scene.areas.sum()  # m^2, of what light may come to
        self.field = Field(scene)
        self.sent = Field(scene)  # finer: it carries direct light with its shadows
        self.lights = np.flatnonzero((scene.emission > 0).any(axis=1))
        self.reflectors = np.flatnonzero((scene.reflectance > 0).any(axis=1) & self.reached)
        self.background = bool((scene.background > 0).any())
        self.fractions = np.zeros((0, len(self.lights) + 1))
        self.rows, self.density, self.full = Rows(), 1.0, False  # the part of all nodes that blocks of rows use
        self.tolerance = np.zeros(0)  # (n nodes,) of the links of each row
        self._remembered = {}

    def snapshot(self):
        """As it is now, whatever becomes of this one: arrays are replaced as it grows on, never written into."""
        new = copy.copy(self)
        new.field, new.sent = copy.copy(self.field), copy.copy(self.sent)
        return new

    def spread(self, value):
        """Values (n nodes, c) of the field at the nodes of `sent`."""
        return self.field.interpolate(self.placed, value)

    # -- nodes ---------------------------------------------------------------------------------------------------

    def grow(self, halvings):
        """Of leaves of `sent`; direct light at its new nodes, exact; yields."""
        f, old = self.sent, len(self.fractions)
        f.refine(halvings)
        new = yield from self.received_directly(f.points[old:], f.normals[old:], f.node_surface[old:])
        self.fractions = np.concatenate([self.fractions, new])
        self._place()

    def split(self, halvings):
        """Of leaves of the field, and those of `sent` that would be coarser; yields."""
        self.field.refine(halvings)
        self._place()
        while len(coarser := self._coarser()):
            yield from self.grow(coarser)

    def _place(self):
        """Where the nodes of `sent` lie in the field: cells (n,) and weights (n, 9)."""
        f = self.sent
        self.placed = self.field.locate(f.node_surface, f.on.local(f.node_surface, f.points))

    def _coarser(self):
        """Halvings of leaves of `sent` that are coarser than the field: it has to have all of its nodes."""
        f = self.field
        leaf, number = np.nonzero(self.sent.find(f.keys)[f.nodes[f.leaves]] < 0)
        leaf = f.leaves[leaf]
        within = (1 - BESIDE) * STEPS[number] / 2 + BESIDE / 2  # a node on an edge of the leaf is on others' as well
        root, place = f.root[f.surface[leaf]] + f.face[leaf], f.in_chart(leaf) + within * 0.5 ** f.level[leaf]
        there = self.sent.below(root, place)[0]
        coarser = self.sent.level[there] < f.level[leaf]
        there, which = np.unique(there, return_inverse=True)
        count = np.stack([np.bincount(which, lacks, len(there)) for lacks in coarser.T], axis=1)
        # where parts of it lack halves along other axes, first along that which all lack
        first = count == np.bincount(which, minlength=len(there))[:, None]
        some = np.where(first.any(axis=1, keepdims=True), first, count > 0)
        return self.sent.both(there)[some.ravel()]

    # -- factors of the lights -----------------------------------------------------------------------------------

    def direct(self, points, normals, surface):
        """Factors (n, lights + 1) of all lights at points (n, 3) m on surfaces (n,), and the background's last."""
        return self.factors.matrix(points, normals, surface, self.lights, self.background)

    def received_directly(self, points, normals, surface):
        """As direct; yields."""
        step = max(1, CACHED // 4 // (len(self.lights) + len(self.scene.shapes) * self.background + 1))
        parts = [np.zeros((0, len(self.lights) + 1))]
        for k in slices(len(points), step):
            parts.append(self.direct(points[k], normals[k], surface[k]))
            yield
        return np.concatenate(parts)

    def seen(self, surface, points, exact):
        """Of points (n, 3) m near surfaces (n,), what each surface's see of the sources, and where they lie in the
        field: [(s, index (k,), factors (k, lights + 1), of exact sources (k, e), cells (k,), weights (k, 9), covered)];
        exact: of each surface, which of the reflectors are taken so.
        """
        x, normals = np.empty((2, *points.shape))
        present = np.unique(surface)
        parts = [np.flatnonzero(surface == s) for s in present]
        sources = [self.reflectors[exact[s]] for s in present]
        wanted = [np.union1d(self.lights, some) for some in sources]
        for s, part in zip(present, parts):
            own = self.scene.surfaces[s]
            x[part] = self.field.inset(s, own.shape.project(points[part]))
            normals[part] = own.normals(x[part])
        factors = self._factors(x, normals, surface, parts, wanted)
        covered, out = contacts_of(self.scene).covered(x, surface), []
        for s, part, needed, some, factor in zip(present, parts, wanted, sources, factors):
            lights = np.append(np.searchsorted(needed, self.lights), -1)
            own = np.full(len(part), s)
            placed = self.field.locate(own, self.field.on.local(own, x[part]))
            some = factor[:, np.searchsorted(needed, some)]
            out.append((s, part, factor[:, lights], some, *placed, covered[part]))
        return out

    def _factors(self, x, normals, surface, parts, wanted):
        """Factors of the wanted sources, and the background's last, at parts of the points; kept for relighting."""
        key = hash(x.tobytes()), tuple(surface[part[0]] for part in parts)
        if key not in self._remembered:
            self._remembered[key] = self.factors.lists(x, normals, surface, parts, wanted, self.background)
        return self._remembered[key]

    def forget(self):
        """Factors at points that will not be asked for again."""
        self._remembered = {}

    # -- rows ----------------------------------------------------------------------------------------------------

    def links(self, points, normals, surface, detail, tolerance):
        """Yield Blocks of rows over the nodes of `sent` at points, and None between as a sign of life. detail: how
        what they send varies; tolerance (n,): of one link, in its units."""
        gather = Gather(self.sent, self.factors, self.reflectors)
        yield from gather.blocks(points, normals, surface, detail, tolerance)
        self.counts["links"] += gather.planes.links  # those to planes

    def missing(self):
        """Nodes (k,) of the field that have no rows, of those that light reaches."""
        new = self.rows.missing(len(self.field.keys))
        return new[self.reached[self.field.node_surface[new]] & bool(len(self.reflectors))]

    def extend(self, new, detail, tolerance):
        """Rows for these nodes (k,); see links; where they do not fit the memory it is `full`; yields now and then."""
        f, blocks, size, most = self.field, [], 0, MEMORY - self.rows.bytes
        for block in self.links(f.points[new], f.normals[new], f.node_surface[new], detail, tolerance):
            if block:
                block.rows = new[block.rows]
                blocks.append(block)
                size += block.values.nbytes
            if size > most:
                self.full = True
                return
            yield
        if blocks:
            self.density = max(size / (4 * len(new)), 1.0) / len(self.sent.keys)  # an entry a row at least
        self.rows = self.rows.grown(blocks, len(f.keys))
        made, self.tolerance = self.tolerance, np.zeros(len(f.keys))
        self.tolerance[: len(made)] = made
        self.tolerance[new] = tolerance

    def drop(self, rows=None):
        """Rows (k,) are to be made anew, or all."""
        self.rows = Rows() if rows is None else self.rows.without(rows)

    def from_nothing(self, received):
        """(n nodes, 3) What rows make or lose of the light received by them (n nodes, 3), where shapes run through each
        other: factors of all that is seen then do not sum to 1. Where not all of them are known, what is made alone."""
        over = self.over(self.rows, self.fractions[self.sent.find(self.field.keys)])
        over[self.missing()] = 0.0
        over[contacts_of(self.scene).covered(self.field.points, self.field.node_surface)] = 0.0  # nobody sees them
        return over[:, None] * received

    def over(self, rows, fractions):
        """(k,) What part of the light that comes by rows (k) these make, with fractions (k, lights + 1) of the rest."""
        sums = rows.times(np.ones((len(self.sent.keys), 1)))[:, 0]
        seen = np.setdiff1d(np.flatnonzero(self.reached), self.reflectors)  # by no row
        known = np.isin(self.lights, seen)
        over = sums + fractions[:, np.append(known, self.background)].sum(axis=1) - 1
        if not self.background or known.sum() < len(seen):
            over = np.maximum(over, 0.0)
        return over / np.maximum(sums, 1e-300)

    @property
    def crowded(self):
        """Whether rows take so much of the memory that the next may not fit."""
        return self.rows.bytes > MEMORY / 2

    def room(self, share=1.0):
        """How many halvings there may still be within this share of the memory."""
        rows, columns = len(self.field.keys), len(self.sent.keys)
        entries = share * MEMORY / 4 / min(1.0, DENSER * self.density)
        # (rows + more) (columns + more) = entries
        more = (np.sqrt((columns - rows) ** 2 + 4 * entries) - rows - columns) / 2
        return int(max(more, 0.0)) // HALVING_NODES
