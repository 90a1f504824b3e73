"""Hits near by, in cells whose light is uneven: there it is worked out anew, at the hit itself.

What is read off next to the edge of a shadow sees the cells that it crosses from so near that their mean does not do;
nor does the mean of what these get, as in a corner two walls show each other the very next of their points alone. So a
ray goes on from each near hit, and from what that meets near by, until what is met is the light of cells.
"""

from dataclasses import dataclass, fields

import numpy as np

from ..at_once import AT_ONCE, slices
from ..shapes.sphere import Sphere
from .nodes import PLACES, place_of
from .placed import at_hits
from .rows import bundle, directions, light_of

UNEVEN = 2.5  # of the target and the mean light: root mean square within a cell from which on it is uneven
REACH = 4.0, 0.5  # sizes of a cell within which a hit is near, where it is uneven and where it is lit by such
SHOWN = 0.1  # of all that a cell sees: uneven ones from which on it is lit by such
# directions of a receiver whose hits are looked at: of fewer several rays may go on from each, of more only some are
# taken
FEW, ENOUGH = 512, 1024
ASKED = 64  # rays of a node that tell whether it lies in a gap
NARROW, MOSTLY = 0.5, 0.5  # sizes of a cell within which, and of all that it sees, most is where it lies in a gap
MOST, PAIRS = 1 << 18, 1 << 20  # hits, and pairs of them and sources, that are worked out anew: the nearest ones
KEPT = 2  # times as many are kept meanwhile
# steps from one hit to the next in what is drawn for it, of each time that rays go on, unlike those in which directions
# turn about their axis
TURNS = np.sqrt([2, 3, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41]) % 1
SURE = 2  # of a usual hit's worth the part, one by this, that still goes on for certain where one ray goes on at most
WAYS, BUNDLED = (16, 128), 1 << 11  # directions in which rays go on, at least and at most; rays in each, at least


@dataclass
class _Hits:
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


class NearHits:
    """Of receivers whose rays, along `count` directions, meet the nodes of a RayState."""

    def __init__(self, state, receivers, count):
        self.state, self.receivers, nodes = state, receivers, state.nodes
        # shadows may end between the places that tell how uneven a cell is: then it differs from the one beside it
        bright = nodes.reflectance.max(axis=1, initial=0.0)
        most = UNEVEN * state.target * state.level * bright.max(initial=0.0)
        self.uneven = np.maximum(state.spread * bright, state.bent)
        uneven = self.uneven > most
        shown = state.rows.times(uneven[:, None].astype(float))[:, 0] > SHOWN if uneven.any() else uneven
        self.reach = np.select([uneven, shown | state.narrow], REACH) * np.sqrt(nodes.weight)
        # the light of gaps is none of what their cells tell
        gap = np.linalg.norm(state.sent[state.narrow], axis=1).max(initial=0.0)
        self.uneven = np.maximum(self.uneven, np.where(state.narrow, gap, most))  # (nodes,) of what they send
        self.most = min(MOST, PAIRS // max(len(state.sources), 1))
        self.found, self.count = [], 0
        self.every, self.again, self.bundles = -(-count // ENOUGH), -(-FEW // count), 0

    def add(self, rays):
        """Takes the near ones of the hits of Bundles, of all directions in turn."""
        if not self.reach.any():
            return
        near, each = self._near(rays, self.receivers), max(len(self.receivers), 1)
        near.weight *= self.every * np.abs(rays.cosine[near.number])[:, None]
        skipped = (self.bundles + near.number // each) % self.every
        self.bundles += len(rays.cosine) // each
        self.found.append(near.take(skipped == 0))
        self.count += len(self.found[-1])
        if self.count > KEPT * self.most:
            self.found, self.count = [self._nearest()], self.most

    def _near(self, rays, receivers):
        """The near _Hits of a Bundle of receivers, each for its own receiver, of weight 1; their numbers are rays'."""
        # a cell's unevenness is also beside it, as far as is interpolated
        reach = np.where(rays.basis > 0, self.reach[rays.node], 0.0).max(axis=1, initial=0.0)
        near = np.flatnonzero(reach > 0)
        place = places_of(self.state.facets, rays.facet[near], rays.at[near])
        far = np.linalg.norm(place - receivers.points[rays.who[near]], axis=1) / reach[near]
        some = np.flatnonzero(far < 1)
        near, far, place = near[some], far[some], place[some]
        told = (getattr(rays, name)[near] for name in ("facet", "front", "node", "basis"))
        return _Hits(rays.who[near], np.ones((len(near), 3)), rays.ray[near], far, place, *told)

    def _nearest(self):
        """The nearest of all that were found, in the order in which they were."""
        found = _Hits.joined(self.found)
        nearest = np.argsort(found.far, kind="stable")[: self.most]
        return found.take(np.sort(nearest))

    def settle(self, off):
        """Generator with signs of life; returns (n, 3), what they tell more, of which so much, off (n,), may be wrong
        as only some are asked."""
        out = np.zeros((len(self.receivers), 3))
        if not self.found:
            return out
        state, hits = self.state, self._nearest()
        hits = hits.take(np.argsort(hits.who, kind="stable"))
        unit = self._unit(hits, off)
        for turn in TURNS:
            hits, each = _asked(hits, np.minimum(self._worth(hits) / unit[hits.who], self._most(hits)), turn)
            if not len(hits):
                break
            hits.weight *= hits.of(state.nodes.reflectance)
            there = at_hits(state.facets, hits.facet, hits.front, hits.place)
            yield
            light = np.where(state.beamed[:, None], 0.0, state.light)
            factor = yield from state.shares.scattered(there)
            out += self._summed(hits, np.einsum("nkc,kc->nc", factor, light) - hits.of(state.received))
            yield
            index = np.repeat(np.arange(len(hits)), each)
            hits, there, each = hits.take(index), there.take(index), each[index]
            hits.weight /= each[:, None]
            more, onward = yield from self._onward(hits, there, turn)
            yield
            out += self._summed(hits, more)
            hits = onward
        return out

    def _worth(self, hits):
        """(h,) How much _Hits may tell their receivers."""
        there = np.where(hits.basis > 0, self.uneven[hits.node], 0.0).max(axis=1, initial=0.0)
        return hits.weight.mean(axis=1) * there

    def _unit(self, hits, off):
        """(n,) Of receivers the worth of _Hits from which one ray goes on: so that off (n,) is what they are wrong by
        in the root mean square, or that as many go on as there may be."""
        n = len(self.receivers)
        total = np.maximum(np.bincount(hits.who, self._worth(hits), n), 1e-150)
        most = self._most(hits)
        most = np.bincount(hits.who, np.where(most > 1, most, SURE), n)
        return np.maximum(off**2 / total, total / np.maximum(most, 1))

    def _most(self, hits):
        """(h,) How many rays may go on from each of _Hits."""
        return np.where(self.state.narrow[hits.node].any(axis=1), 1, self.again)

    def _summed(self, hits, more):
        """(n receivers, 3) What more (h, 3) the _Hits tell, by their weights."""
        return np.stack([np.bincount(hits.who, c, len(self.receivers)) for c in (hits.weight * more).T], axis=1)

    def _onward(self, hits, there, turn):
        """One ray from each hit, along one of some ways: what it tells of the light of others and the sky (h, 3), and
        the near _Hits of those rays; yields."""
        state, found = self.state, [hits.take(slice(0))]
        ways = directions(int(np.clip(len(hits) // BUNDLED, *WAYS)))
        way, light, sent = _drawn(there.normals, ways, turn), np.zeros((len(hits), 3)), state.sent.astype(np.float32)
        order = np.argsort(way, kind="stable")
        for some in np.split(order, np.flatnonzero(np.diff(way[order])) + 1):
            from_, one = there.take(some), ways[way[some[:1]]]
            rays = bundle(state.facets, state.nodes, from_, one)
            yield
            light[some] = light_of(rays, sent, state.scene, one)
            near = self._near(rays, from_)
            near.number = some[near.who]
            found.append(near)
        state.counts["rays"] += len(hits)
        onward = _Hits.joined(found)
        onward = onward.take(np.argsort(onward.number, kind="stable"))
        parent = onward.number
        onward.who, onward.weight = hits.who[parent], hits.weight[parent]
        return light, onward


def _asked(hits, number, turn):
    """Of _Hits by their receivers those of which any ray goes on, if number (h,) do in the mean: with the weights of
    all, and how many do of each (k,); evenly spread over what each receiver is told."""
    upto = np.cumsum(number)
    first = np.flatnonzero(np.diff(hits.who, prepend=-1))
    length = np.diff(first, append=len(upto))
    begin = np.repeat((upto - number)[first] - (hits.who[first] + 1) * turn % 1, length)
    upto -= begin
    each = np.floor(upto + 1e-9).astype(int) - np.floor(upto - number + 1e-9).astype(int)
    some = np.flatnonzero(each)
    hits = hits.take(some)
    hits.weight = hits.weight / np.minimum(number[some], 1.0)[:, None]
    return hits, each[some]


def _drawn(normals, ways, turn):
    """(h,) Which of ways (m, 3), or their opposites, rays at normals (h, 3) take: as often as the cosine tells."""
    out, step = np.empty(len(normals), int), np.arange(len(normals)) * turn % 1
    for part in slices(len(normals), AT_ONCE // len(ways)):
        upto = np.abs(normals[part] @ ways.T).cumsum(axis=1)
        out[part] = (upto < step[part, None] * upto[:, -1:]).sum(axis=1)
    return np.minimum(out, len(ways) - 1)


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
