"""Direct light of the nodes: what they get of each source, by a few points each at a few of a node's places."""

import copy

import numpy as np

from .aimed import spots_of
from .direct import AT_NODES, Shares
from .nodes import LIT

TOLD = 3.0  # of the target: what light at one of the places of a node may be off by, which stand for it together
# of a lamp's points, which set each of the places LIT sees, as by one set all nodes would be wrong alike: places of
# a set are about the middle of their cell; what halves of the sets tell more than the others
SETS = np.array([0, 1, 2, 3, 1, 0, 3, 2])
HALVES = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]])[:, SETS] / LIT
NEXT = np.array([[1, 1], [1, -1]])  # signs of errors of nodes in turn, which have sets of their own


class LitNodes:
    """Of n nodes under k sources: factor (n, k, 3) of the sources' light; direct (n, 3) irradiance / pi; spread (n,) of
    it within each one's cell; unsure (n,): how far it may be off at one place; lamps (n, 6): in their mean, as three
    halves of the places tell, of nodes in turn of either sign; lost (n,): what of it is of no point of a source."""

    def __init__(self, facets, sources, counts):
        self.facets, self.counts = facets, counts
        self.finer = 1  # times as many points of sources as usual
        self.aimed = False  # whether spots of narrow beams are among the sources
        self.take(sources)
        self.factor = np.zeros((0, len(sources), 3), np.float32)
        self.spread, self.unsure, self.lost = np.zeros((3, 0))
        self.lamps = np.zeros((0, len(NEXT) * len(HALVES)))

    def take(self, sources):
        """Takes sources, of which those known before are the first."""
        self.sources = sources
        self.light = np.array([s.colour for s in sources]).reshape(-1, 3)
        self.shares = Shares(self.facets, sources, self.counts)
        self.beamed = np.zeros(len(sources), bool)  # whether its light goes on by way of spots, sources too
        self.spots = [s for s in sources if s.is_spot]
        self.beamed[[s.beam_of for s in self.spots]] = True
        # each is off by itself, in all places alike: as many draws of the signs as of what halves of the places tell
        signs = np.random.default_rng(len(sources)).choice([-1, 1], (len(sources), len(NEXT) * len(HALVES)))
        self.doubt = signs * np.reshape([s.unsure for s in sources], (-1, 1))

    @property
    def direct(self):
        return np.einsum("nkc,kc->nc", self.factor, self.light)

    def extend(self, state, old):
        """Takes the nodes of a RayState, which old (n,) of those before they were, -1 for none; yields."""
        for name in ("factor", "spread", "unsure", "lamps", "lost"):
            setattr(self, name, _carried(getattr(self, name), old))
        new = np.flatnonzero(old < 0)
        places, told = state.nodes.lit_places(new), TOLD * state.target / self.finer
        points = tuple(self.finer * count for count in AT_NODES)
        each, off, lost = yield from self.shares.at(places, told * state.scale(), told, points, SETS)
        if not self.aimed:
            each = np.concatenate([each, (yield from self._spots(state, each, places, told))], axis=1)
            self.factor = np.zeros((len(new), *each.shape[1:]), np.float32)
        each[:, self.beamed] = 0.0
        each = each.reshape(len(new), LIT, *each.shape[1:])
        self.unsure[new] = np.sqrt((off.reshape(len(new), LIT) ** 2).mean(axis=1))
        self.lost[new] = lost.reshape(len(new), LIT).mean(axis=1)
        self.factor[new] = each.mean(axis=1)
        light = np.einsum("nlkc,kc->nlc", each, self.light)
        self.spread[new] = np.linalg.norm(light.std(axis=1), axis=1)
        halves = light.mean(axis=2) @ HALVES.T
        turn = NEXT[:, np.arange(len(new)) % len(NEXT) * self.shares.in_turn].T[:, :, None]
        self.lamps[new] = (turn * halves[:, None]).reshape(len(new), self.lamps.shape[1])
        self.lamps[new] += (self.factor[new] * self.light).mean(axis=2) @ self.doubt

    def _spots(self, state, each, places, told):
        """Adds spots of narrow beams to the sources, where places have factors each (n, k, 3); returns those of the
        spots (n, spots, 3), of which so much may be off; yields."""
        spots = yield from spots_of(state, (each > 0).any(axis=2).sum(axis=0))
        steps = Shares(self.facets, spots, self.counts).at(places, told * state.scale(), told, AT_NODES, SETS)
        own = (yield from steps)[0]
        self.take(self.sources + spots)
        self.aimed = True
        return own

    def under(self, facets, sources, counts):
        """The same nodes under other light of the same sources."""
        new = copy.copy(self)
        new.facets, new.counts = facets, counts
        new.take(sources)
        before, now = (np.linalg.norm(lit.direct, axis=1) for lit in (self, new))
        usual = now.sum() / before.sum() if before.any() else 1.0  # of what is lost where no light was found
        brighter = np.divide(now, before, out=np.full(len(now), usual), where=before > 0)
        new.spread, new.unsure, new.lost = (a * brighter for a in (self.spread, self.unsure, self.lost))
        new.lamps = self.lamps * brighter[:, None]
        return new


def _carried(values, old):
    """Values of nodes known before, old (n,) >= 0 which, as an array for all (n, ...), 0 for the others."""
    out = np.zeros((len(old), *values.shape[1:]), values.dtype)
    out[old >= 0] = values[old[old >= 0]]
    return out
