"""Hits near by, in cells whose direct light is uneven: there it is worked out anew, at the hit itself.

What is read off next to the edge of a shadow sees the cells that it crosses from so near that their mean does not do.
"""

import numpy as np

from ..shapes.sphere import Sphere
from .direct import AT_NODES
from .placed import Placed

UNEVEN = 0.5  # of the target and the mean light: root mean square within a cell from which on it is looked at
REACH = 4.0  # sizes of a cell within which a hit is near
MOST, PAIRS = 1 << 16, 1 << 20  # hits, and pairs of them and sources, that are worked out anew: the nearest ones
KEPT = 4  # times as many are kept meanwhile


class NearHits:
    """Of receivers whose rays meet the nodes of a RayState."""

    def __init__(self, state, receivers):
        self.state, self.receivers, nodes = state, receivers, state.nodes
        # shadows may end between the places that tell how uneven a cell is: then it differs from the one beside it
        uneven = np.maximum(state.spread * nodes.reflectance.max(axis=1, initial=0.0), state.bent)
        least = UNEVEN * state.target * state.level * nodes.reflectance.max(initial=0.0)
        self.reach = np.where(uneven > least, REACH * np.sqrt(nodes.weight), 0.0)
        self.most = min(MOST, PAIRS // max(len(state.sources), 1))
        self.found, self.count = [], 0

    def add(self, bundle):
        """Takes the near ones of a Bundle's hits."""
        # a cell's unevenness is also beside it, as far as is interpolated
        reach = np.where(bundle.basis > 0, self.reach[bundle.node], 0.0).max(axis=1, initial=0.0)
        some = np.flatnonzero(reach > 0)
        if not len(some):
            return
        place = places_of(self.state.facets, bundle.facet[some], bundle.at[some])
        far = np.linalg.norm(place - self.receivers.points[bundle.who[some]], axis=1) / reach[some]
        near = np.flatnonzero(far < 1)
        some = some[near]
        parts = bundle.who[some], np.abs(bundle.cosine[bundle.ray[some]]), far[near], place[near]
        self.found.append((*parts, bundle.facet[some], bundle.front[some], bundle.node[some], bundle.basis[some]))
        self.count += len(some)
        if self.count > KEPT * self.most:
            self.found, self.count = [self._nearest()], self.most

    def _nearest(self):
        """The nearest of all that were found, as arrays."""
        parts = [np.concatenate(part) for part in zip(*self.found)]
        nearest = np.argsort(parts[2], kind="stable")[: self.most]
        return [part[nearest] for part in parts]

    def settle(self):
        """Generator with a sign of life a bundle; returns (n, 3), what they tell more."""
        out = np.zeros((len(self.receivers), 3))
        if not self.found:
            return out
        state, facets = self.state, self.state.facets
        who, cosine, _, place, facet, front, node, basis = self._nearest()
        own = facets.surface[facet, np.where(front, 0, 1)]
        triangle = facet - facets.first[facets.shape[facet]]
        there = Placed(facets, own, place + facets.centre, triangle=triangle)
        told = state.told * state.target
        factor = (yield from state.shares.at(there, told * state.level, told, AT_NODES))[0]
        light = np.where(state.beamed[:, None], 0.0, state.light)
        more = np.einsum("nkc,kc->nc", factor, light) - np.einsum("hk,hkc->hc", basis, state.direct[node])
        more *= cosine[:, None] * np.einsum("hk,hkc->hc", basis, state.nodes.reflectance[node])
        np.add.at(out, who, more)
        return out


def places_of(facets, facet, at):
    """(h, 3) m about the facets' centre, of positions at (h, 2) on facets and balls."""
    out, at = np.empty((len(facet), 3)), at.astype(float)
    flat = facet < facets.count
    k, s = facet[flat], at[flat]
    out[flat] = facets.origin[k] + s[:, :1] * facets.u[k] + s[:, 1:] * facets.v[k]
    k = facet[~flat] - facets.count
    out[~flat] = facets.ball_centre[k] + np.einsum("nij,nj->ni", facets.ball_linear[k], Sphere.from_chart(at[~flat]))
    return out
