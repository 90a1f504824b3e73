"""Radiosity by rays: direct light by shares of sources, indirect light and the sky by fixed bundles, to a stated error.

E = D + S + A (rho E): D from sources, S from the sky, A the rows of hits over the nodes. Where colours are read, D is
worked out anew and A (rho E) gathered anew, by as many directions as the error there asks for.
"""

import time
from collections import Counter
from functools import cached_property

import numpy as np

from ..numerics import ROUGHLY, SOLVED, gcr
from ..signs_of_life import finish, in_thread
from .amplified import amplification
from .covered import covered
from .direct import COARSE, COMPARED, FACTOR, FINE, READ
from .facets import Facets
from .glare import glare_of
from .grid import batches
from .lit import LitNodes
from .near import NearHits, in_narrow
from .nodes import Nodes
from .rows import Gathered, Traced, bundle, directions, light_of
from .sources import foreseen_level, met_by_rays, relit, sources_of
from .thinned import FORETOLD, thinned

RAYS = 64  # directions of a node, and of a point where colours are read, at first
TOLD_BRIGHT = 0.5  # of what direct light may be off by, where it is brighter than in the mean: relative to that there
DIM = 0.05  # of the mean light: what is darker need not be right to its own


def is_same(now, before):
    """Whether a tuple holds the very things that one before did, if any: arrays are replaced, never written into."""
    return before is not None and all(one is other for one, other in zip(now, before))


class RayState:
    """Everything a solution by rays grows from."""

    def __init__(self, scene, target_error):
        self.scene, self.target, self.started = scene, target_error, time.perf_counter()
        self.counts = Counter()
        self.facets = Facets(scene)
        self.by_rays = met_by_rays(scene)
        self.reflects = (scene.reflectance > 0).any(axis=1)
        self.nodes = Nodes(self.facets, self.reflects | self.by_rays)
        self.lit = LitNodes(self.facets, sources_of(self.facets, self.by_rays), self.counts)
        self.traced = Traced(0, directions(RAYS // 2 if target_error > COARSE else RAYS))
        self.read = RAYS  # directions where colours are read
        self.told = 1.0  # of the target: what direct light may be off by where part of a source is seen, in few places
        self.level = 0.0
        self.solved_of = None  # rows and direct light
        self.glares = {}  # by the number of directions of those who see it

    def elapsed(self):
        """s since the beginning"""
        return time.perf_counter() - self.started

    # -- geometry ------------------------------------------------------------------------------------------------

    def extend(self, old, count=None, anew=False):
        """Rays and direct light of the nodes that old (n,) does not know, -1; rays of all of them along so many
        directions where a count is given, direct light of all where it is to be anew; yields."""
        if count is None:
            self.traced = yield from in_thread(self.traced.moved, old)
        else:
            self.traced = Traced(len(old), directions(count))
        new = np.flatnonzero(old < 0)
        yield from self.trace(new)
        hidden = yield from in_thread(covered, self.traced, self.nodes, new)
        hidden |= yield from in_thread(self.nodes.other_side, new, hidden)
        kept, changed = yield from in_thread(self.nodes.uncover, new, hidden)
        if len(kept) < len(old):
            self.traced, old = (yield from in_thread(self.traced.moved, kept)), old[kept]
        yield from self.trace(changed)
        if count is not None:
            yield from self.trace(np.flatnonzero(old >= 0))
        yield from self.lit.extend(self, np.full(len(old), -1) if anew else old)
        yield from in_thread(self.link)

    def trace(self, which):
        """Rays of the nodes which (k,), from each of their places in turn; yields."""
        yield from self.traced.trace(self.facets, self.nodes.from_place, which)
        self.counts["rays"] += len(which) * len(self.traced.directions)

    def scale(self):
        """Irradiance / pi that tolerances refer to: before any is known, the sources' own over the scene."""
        return self.level if self.level > 0 else foreseen_level(self.lit.sources, self.facets)

    def link(self):
        """The rows of all nodes, and their own light: what they send whatever they receive."""
        self.rows = Gathered(self.traced, self.nodes, self.scene)
        vars(self).pop("narrow", None)
        own = self.nodes.surface
        self.shining = np.where(self.by_rays[own, None], self.scene.emission[own], 0.0)

    # -- solving -------------------------------------------------------------------------------------------------

    def solve(self):
        """E at the nodes, and what they send on, where their rows or direct light are others than before; yields."""
        given = self.rows, self.lit.factor
        if not is_same(given, self.solved_of):
            yield from in_thread(self._solve)
            self.solved_of = given

    def _solve(self):
        rho = self.nodes.reflectance
        outer = self.lit.direct + self.rows.sky
        held = self.nodes.means.held
        # straight: what is held to keep means makes more of what rays make uneven, without end between white walls
        right = self.rows.times(rho * outer + self.shining)
        guess = right.copy()

        def scatter(value):
            return self.rows.times(rho * value)

        indirect, steps = finish(gcr(scatter, right, guess, SOLVED * self.target))
        self.counts["iterations"] += steps
        self.amplified = amplification(self.rows.times, rho)
        residual = right - indirect + scatter(indirect)
        self.received = outer + indirect
        sent = rho * self.received + self.shining  # in the mean of each node
        self.sent, self.shown, self.glares = held(sent), held(self.received), {}  # what is interpolated between
        self.bias = self.nodes.means.bias(sent, self.sent)
        weight, reflected = self.nodes.weight, rho * self.received
        square = np.bincount(self.nodes.surface, weight * (reflected**2).sum(axis=1), len(self.scene))
        spots = np.bincount([s.index for s in self.lit.spots], [s.square for s in self.lit.spots], len(self.scene))
        self.surface_norms = np.sqrt(square + spots)
        self.norm = float(np.sqrt((square + spots).sum()))
        reflecting = max(self.scene.areas[self.reflects].sum(), 1e-300)
        # the mean squares that errors count against; a bright spot in a dim room makes none good
        self.squares = square / self.scene.areas, square.sum() / reflecting
        usual = np.sqrt(square.sum()) if square.any() else self.norm
        self.level = float(usual / np.sqrt(reflecting) / max(rho.max(initial=0.0), 1e-3))
        once = (weight[:, None] * rho * (outer + self.rows.times(self.shining))).sum()
        self.gain = float((weight[:, None] * reflected).sum() / max(once, 1e-300))
        left = rho * finish(gcr(scatter, residual, residual.copy(), ROUGHLY))[0] / (1 - ROUGHLY)
        self.left = np.sqrt((weight * (left**2).sum(axis=1)).sum()) / max(self.norm, 1e-300)
        self.surplus = self.nodes.surplus(sent, self.lit.spread * rho.max(axis=1, initial=0.0))
        # how far what a node sends is off beside it, on meshes in the mean
        area = np.bincount(self.nodes.surface, weight, len(self.scene))
        self.bent = (self.surplus[1] / np.sqrt(np.maximum(area, 1e-300)))[self.nodes.surface]
        self.bent[: len(self.surplus[0])] = np.linalg.norm(self.surplus[0], axis=1)

    def own_square(self, dim):
        """(n surfaces,) The mean square of what each sends on of what it receives, at least that of dim of the mean."""
        each, usual = self.squares
        return np.maximum(np.maximum(each, dim**2 * usual), 1e-300)

    # -- reading -------------------------------------------------------------------------------------------------

    @cached_property
    def narrow(self):
        """(n,) Whether nodes lie in gaps narrower than they are."""
        return in_narrow(self.nodes, self.traced)

    def glare(self, count):
        """The Glare for receivers with so many directions, or None, found once; yields."""
        if count not in self.glares:
            self.glares[count] = yield from glare_of(self, count)
        return self.glares[count]

    def gather(self, receivers, count):
        """Indirect light and the sky's at receivers by `count` directions -> (n, 3); yields."""
        is_mesh = (self.facets.own < 0)[self.scene.shape_of]
        may = FORETOLD * self.target * self._level_at(receivers)
        return (yield from thinned(lambda some: self._gathered(some, count), receivers, is_mesh, may))

    def _gathered(self, receivers, count):
        """The same, at each of them."""
        n, every = len(receivers), directions(count)
        total, weight = np.zeros((n, 3)), np.zeros(n)
        sent, near = self.sent.astype(np.float32), NearHits(self, receivers, count)
        glare = yield from self.glare(count)
        for some in batches(count, n, self.facets):
            rays = bundle(self.facets, self.nodes, receivers, every[some])
            yield
            cosine = np.abs(rays.cosine)
            near.add(rays)
            if glare is not None:
                rays.basis[glare.told(rays, receivers)] = 0.0
            light = cosine[:, None] * light_of(rays, sent, self.scene, every[some])
            total += light.reshape(len(some), n, 3).sum(axis=0)
            weight += cosine.reshape(len(some), n).sum(axis=0)
        self.counts["rays"] += n * count
        total += yield from near.settle()
        total /= np.maximum(weight, 1e-300)[:, None]
        return total if glare is None else total + (yield from glare.at(receivers)).mean(axis=0)

    def straight(self, receivers, roughly=False, finer=1.0):
        """Factors of the sources (n, k, 3) at receivers and how far their light may be off (n,), so many times as
        little as usual; yields."""
        told = self.told / finer * self.target
        few, most = COMPARED if roughly and self.target > FINE else READ[roughly or self.target > COARSE]
        points = few, int(most * min(1 / self.told, FACTOR))  # most are soon enough, but not where it is to be less
        tolerance = told * self._level_at(receivers)
        return (yield from self.lit.shares.at(receivers, tolerance, TOLD_BRIGHT * told, points))[:2]

    def _level_at(self, receivers):
        """(n,) Irradiance / pi that tolerances at receivers refer to: on dark surfaces less than in the mean."""
        own = np.sqrt(self.own_square(DIM)) / np.maximum(self.scene.reflectance.max(axis=1), 1e-3)
        return np.append(np.minimum(own, self.level), self.level)[receivers.surface]  # the last in free space

    def incident(self, receivers, roughly=False):
        """Irradiance / pi (n, 3) at receivers; yields."""
        factor, _ = yield from self.straight(receivers, roughly)
        rest = yield from self.gather(receivers, min(RAYS, self.read) if roughly else self.read)
        return np.einsum("nkc,kc->nc", factor, self.lit.light) + rest

    def take_light(self, scene):
        """The same shapes under the light of another scene."""
        self.scene, self.started, self.counts = scene, time.perf_counter(), Counter()
        self.nodes = self.nodes.of(scene)
        self.facets = self.nodes.facets
        self.lit = self.lit.under(self.facets, relit(self.lit.sources, scene), self.counts)
        self.link()
