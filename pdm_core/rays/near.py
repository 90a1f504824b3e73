"""Hits near by, in cells whose light is uneven: there it is worked out anew, at the hit itself.

What is read off next to the edge of a shadow sees the cells that it crosses from so near that their mean does not do;
nor does the mean of what these get, as in a corner two walls show each other the very next of their points alone. So a
ray goes on from each near hit, and from what that meets near by, until what is met is the light of cells.
"""

from dataclasses import dataclass, fields

import numpy as np

from ..at_once import in_turn, slices
from ..shapes.sphere import Sphere
from ..signs_of_life import in_thread
from .direct import GOLDEN
from .grid import batches
from .nodes import PLACES, place_of
from .placed import at_hits
from .rows import bundle, directions, light_of

UNEVEN = 2.5  # of the target and the mean light: root mean square within a cell from which on it is uneven
MOST_UNEVEN = 0.25  # of the mean light, from which on all rays go on
REACH = 4.0, 0.5  # sizes of a cell within which a hit is near, where it is uneven and where it is lit by such
SHOWN = 0.1  # of all that a cell sees: uneven ones from which on it is lit by such
# directions of a receiver whose hits are looked at: of fewer several rays go on from each, of more only some are taken
FEW, ENOUGH = 384, 1024
ASKED = 64  # rays of a node that tell whether it lies in a gap
NARROW, MOSTLY = 0.5, 0.5  # sizes of a cell within which, and of all that it sees, most is where it lies in a gap
MOST, PAIRS = 1 << 18, 1 << 20  # hits, and pairs of them and sources, that are worked out anew: the nearest ones
KEPT = 2  # times as many are kept meanwhile
# of each time that rays go on, at first in a quarter as many directions as they came in, then in half as many as
# before, spread over the hits: steps from one hit to the next, unlike those in which directions turn about their axis
TURNS = np.sqrt([2, 3, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41]) % 1
LEAST_WAYS = 16  # directions: of fewer the steep ones, which lead out of gaps, would count for too much
USUAL = 5  # of them, but for those in gaps
PARTS = 1 << 20  # of a hit, in which they are counted: no sum of them hangs on what was added before


@dataclass
class Hits:
    """who (h,): the receiver that they are found for; weight (h, 3) of what they send in its light; number (h,): of the
    receiver's direction that led to them; far (h,): of their reach; place (h, 3) m about the facets' centre; facet
    (h,), front (h,), node, basis (h, 4) as of a Bundle."""

    who: np.ndarray
    weight: np.ndarray
    number: np.ndarray
    far: np.ndarray
    place: np.ndarray
    facet: np.ndarray
    front: np.ndarray
    node: np.ndarray
    basis: np.ndarray

    @classmethod
    def joined(cls, parts):
        """All hits of parts in turn."""
        return cls(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(cls)))

    def take(self, index):
        """Those of the index."""
        return type(self)(*(getattr(self, one.name)[index] for one in fields(self)))

    def __len__(self):
        return len(self.who)

    def of(self, value):
        """value (nodes, 3) -> (h, 3) at the hits"""
        return np.einsum("hk,hkc->hc", self.basis, value[self.node])

    def usual(self, count):
        """(count,) What those of each of so many receivers weigh in the mean."""
        weight = self.weight.max(axis=1)
        number, total = (np.bincount(self.who, w, count) for w in (None, weight))
        return total / np.maximum(number, 1)

    def thinned(self, usual):
        """Of those that weigh less than is usual (n receivers,) so many that each left weighs that: a receiver's in
        turn, whatever others there are, so that they weigh as much as before together, in the mean. What is left out is
        then less unsure than what the first hits tell, all of which are usual."""
        order = np.argsort(self.who, kind="stable")
        who, weight = self.who[order], self.weight.max(axis=1)[order]
        first = np.flatnonzero(np.diff(who, prepend=-1))
        share = np.minimum(weight / np.maximum(usual[who], 1e-300), 1.0)
        share = np.ceil(PARTS * share).astype(np.int64)
        turn = (PARTS * (GOLDEN * self.number[order[first]] % 1)).astype(np.int64)
        upto = share.cumsum()
        upto -= np.repeat(upto[first] - share[first] - turn, np.diff(first, append=len(who)))
        kept = np.flatnonzero(upto // PARTS > (upto - share) // PARTS)
        hits = self.take(order[kept])
        hits.weight *= PARTS / share[kept, None]
        hits.number = in_turn(np.unique(hits.who, return_counts=True)[1])[1]
        return hits


class NearHits:
    """Of receivers whose rays, along `count` directions, meet the nodes of a RayState."""

    def __init__(self, state, receivers, count):
        self.state, self.receivers, nodes = state, receivers, state.nodes
        # shadows may end between the places that tell how uneven a cell is: then it differs from the one beside it
        uneven = np.maximum(state.lit.spread * nodes.reflectance.max(axis=1, initial=0.0), state.bent)
        uneven = uneven / max(state.level * nodes.reflectance.max(initial=0.0), 1e-300)
        self.ways = np.minimum(uneven / MOST_UNEVEN, 1.0)  # (nodes,) of the rays that go on, as many as are worth it
        self.ways[state.narrow] = 0.0  # there all go on, again and again
        uneven = uneven > UNEVEN * state.target
        shown = state.rows.times(uneven[:, None].astype(float))[:, 0] > SHOWN if uneven.any() else uneven
        self.reach = np.select([uneven, shown | state.narrow], REACH) * np.sqrt(nodes.weight)
        self.most = min(MOST, PAIRS // max(len(state.lit.sources), 1))
        self.found, self.count = [], 0
        self.every, self.again, self.bundles = -(-count // ENOUGH), -(-FEW // count), 0

    def add(self, rays):
        """Takes the near ones of the hits of Bundles, of all directions in turn."""
        if not self.reach.any():
            return
        each = max(len(self.receivers), 1)
        looked_at = (self.bundles + rays.ray // each) % self.every == 0
        near = self._near(rays, self.receivers, np.flatnonzero(looked_at))
        near.weight *= self.every * np.abs(rays.cosine[near.number])[:, None]
        near.number = (self.bundles + near.number // each) // self.every
        self.bundles += len(rays.cosine) // each
        self.found.append(near)
        self.count += len(near)
        if self.count > KEPT * self.most:
            self.found, self.count = [self._nearest()], self.most

    def _near(self, rays, receivers, some):
        """The near Hits among `some` (k,) of those of a Bundle of receivers, each for its own receiver, of weight 1;
        their numbers are rays'."""
        # a cell's unevenness is also beside it, as far as is interpolated
        reach = np.where(rays.basis[some] > 0, self.reach[rays.node[some]], 0.0).max(axis=1, initial=0.0)
        near = some[reach > 0]
        place = places_of(self.state.facets, rays.facet[near], rays.at[near])
        far = np.linalg.norm(place - receivers.points[rays.who[near]], axis=1) / reach[reach > 0]
        some = np.flatnonzero(far < 1)
        near, far, place = near[some], far[some], place[some]
        told = (getattr(rays, name)[near] for name in ("facet", "front", "node", "basis"))
        return Hits(rays.who[near], np.ones((len(near), 3)), rays.ray[near], far, place, *told)

    def _nearest(self):
        """The nearest of all that were found, in the order in which they were."""
        found = Hits.joined(self.found)
        if len(found) <= self.most:
            return found
        furthest = np.partition(found.far, self.most - 1)[self.most - 1]
        return found.take(np.flatnonzero(found.far <= furthest)[: self.most])

    def settle(self):
        """Generator with signs of life; returns (n, 3), what they tell more."""
        out = np.zeros((len(self.receivers), 3))
        if not self.found:
            return out
        state, hits = self.state, (yield from in_thread(self._nearest))
        again, ways = self.again, self.again * self.bundles // self.every // 2
        for k, turn in enumerate(TURNS):
            hits = hits if k < USUAL else hits.take(state.narrow[hits.node[:, 0]])
            hits.weight *= hits.of(state.nodes.reflectance)
            if k == 0:
                usual = hits.usual(len(self.receivers))
            else:
                hits = yield from in_thread(hits.thinned, usual)
            if not len(hits):
                break
            there = yield from in_thread(at_hits, state.facets, hits.facet, hits.front, hits.place)
            light = np.where(state.lit.beamed[:, None], 0.0, state.lit.light)
            factor = yield from state.lit.shares.scattered(there)
            more = np.einsum("nkc,kc->nc", factor, light) - hits.of(state.shown)
            out += self._summed(hits.who, hits.weight * more)
            yield
            rays = yield from in_thread(self._going_on, hits, again)
            again, ways = 1, max(ways // 2, LEAST_WAYS)
            more, hits = yield from self._onward(*rays, there, turn, directions(ways))
            yield
            out += more
        return out

    def _summed(self, who, light):
        """(n receivers, 3) The light (h, 3) that comes to receivers who (h,), of each together."""
        return np.stack([np.bincount(who, c, len(self.receivers)) for c in light.T], axis=1)

    def _going_on(self, hits, again):
        """Which of Hits rays go on from, again at most from each: the more, the more is at stake; their receivers,
        weights and numbers (r, ...)."""
        each = np.ceil(again * hits.of(self.ways[:, None])[:, 0]).clip(1, again).astype(int)
        start, turn_of = in_turn(each)
        weight, number = hits.weight / each[:, None], again * hits.number
        return start, hits.who[start], weight[start], number[start] + turn_of * again // each[start]

    def _onward(self, start, who, weight, number, there, turn, ways):
        """Rays (r,), see _going_on, from Receivers `there`, along one of ways (m, 3) each: what they tell of the light
        of others and the sky (n receivers, 3), and their near Hits; yields."""
        state, found = self.state, []
        light, cosine, sent = np.zeros((len(who), 3)), np.zeros(len(who)), state.sent.astype(np.float32)
        order = np.argsort(number * turn % 1, kind="stable")
        each = -(-len(order) // len(ways))  # along each way, the last one again for what lacks
        order = np.append(order, np.repeat(order[-1:], each * len(ways) - len(order)))
        for k in batches(len(ways), each, state.facets):
            some = order[k[0] * each : (k[-1] + 1) * each]
            rays = bundle(state.facets, state.nodes, there, ways[k], start[some])
            yield
            light[some], cosine[some] = light_of(rays, sent, state.scene, ways[k]), np.abs(rays.cosine)
            near = self._near(rays, there, np.flatnonzero(k[0] * each + rays.ray < len(who)))
            near.number = some[near.number]
            found.append(near)
        state.counts["rays"] += len(who)
        # as directions are spread evenly each counts by its cosine, all of a receiver's together as much as before
        mean = weight.mean(axis=1)
        whole, by_cosine = (np.bincount(who, w, len(self.receivers)) for w in (mean, mean * cosine))
        weight *= (cosine * (whole / np.maximum(by_cosine, 1e-300))[who])[:, None]
        onward = yield from in_thread(Hits.joined, found)
        parent = onward.number
        onward.who, onward.number, onward.weight = who[parent], number[parent], weight[parent]
        return self._summed(who, weight * light), onward


def in_narrow(nodes, traced):
    """(n,) Whether nodes see most of what they see nearer than NARROW of their own size, as ASKED rays tell."""
    every = np.arange(0, len(traced.directions), max(len(traced.directions) // ASKED, 1))
    total, close = np.abs(traced.cosine[:, every]).sum(axis=1), np.zeros(len(nodes))
    start, size = nodes.places.points.reshape(len(nodes), PLACES, 3), np.sqrt(nodes.weight)
    for part in slices(len(every), PLACES):
        row, column = np.nonzero(traced.code[:, every[part]] >= 0)
        column = every[part][column]
        code, at = traced.code[row, column], traced.at[row, column]
        place = places_of(nodes.facets, code >> 1, at)
        near = np.linalg.norm(place - start[row, place_of(column)], axis=1) < NARROW * size[row]
        row, column = row[near], column[near]
        close += np.bincount(row, np.abs(traced.cosine[row, column]), len(nodes))
    return close > MOSTLY * total


def places_of(facets, facet, at):
    """(h, 3) m about the facets' centre, of positions at (h, 2) on facets and balls."""
    out, at = np.empty((len(facet), 3)), at.astype(float)
    flat = facet < facets.count
    k, s = facet[flat], at[flat]
    out[flat] = facets.origin[k] + s[:, :1] * facets.u[k] + s[:, 1:] * facets.v[k]
    k = facet[~flat] - facets.count
    out[~flat] = facets.ball_centre[k] + np.einsum("nij,nj->ni", facets.ball_linear[k], Sphere.from_chart(at[~flat]))
    return out
