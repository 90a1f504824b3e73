"""Indirect light between the nodes of a surface, source by source.

What x receives from source s is F(x, s) M(x, s), the visible form factor, with all its shadows, corners and contacts,
times the mean radiance of what x sees of s, which varies little. For the sources that matter M is interpolated and F
is taken exactly at x; the others are interpolated as a sum.
"""

import copy

import numpy as np

from ..error_estimates import DECAY, decay
from ..field_values import by_axis, conform, surpluses_of
from ..tolerances import TINY

MOST = 12  # sources taken exactly on one surface: each costs a form factor for every point evaluated


class Received:
    """Indirect light on one surface: values on its nodes (n,) of one surface.

    received (n, s, 3): irradiance / pi from each source; factors (n, s); sent (s, 3): mean radiance of each source.
    """

    def __init__(self, field, surface, received, factors, sent):
        self.field = copy.copy(field)
        self.cells = np.flatnonzero(field.surface == surface)
        self.local = np.zeros(len(field.keys), int)
        nodes = np.flatnonzero(field.node_surface == surface)
        self.local[nodes] = np.arange(len(nodes))
        self.received, self.factors = received, factors
        self.means = self._fill(
            np.divide(received, factors[..., None], out=np.zeros_like(received), where=factors[..., None] > 0), sent
        )

    def _fill(self, means, sent):
        """Means where nothing of the source is seen: those of the cells around, else of the whole surface."""
        leaves = self.cells[self.field.child[self.cells] < 0]
        nodes = self.local[self.field.nodes[leaves]]
        weight = self.factors
        overall = mean_seen((weight[..., None] * means).sum(axis=0), weight.sum(axis=0), sent)
        total, share = np.zeros_like(means), np.zeros_like(weight)
        near = weight[nodes].sum(axis=1)
        around = (weight[nodes][..., None] * means[nodes]).sum(axis=1)
        np.add.at(share, nodes, near[:, None])
        np.add.at(total, nodes, around[:, None])
        unseen = weight <= TINY
        means = means.copy()
        guess = np.where((share > 0)[..., None], total / np.maximum(share, 1e-300)[..., None], overall)
        means[unseen] = guess[unseen]
        return means

    def choose(self, reflectance, allowed, always, only):
        """Decide which sources are exact, so that the rest interpolates to `allowed` (in L2 of L); keep the errors.

        always: those exact in any case; only: no others.
        """
        f = self.field
        is_leaf = f.child[self.cells] < 0
        leaves = self.cells[is_leaf]
        nodes, size = self.local[f.nodes[self.cells]], f.sizes()[leaves]
        shape = (len(self.means), -1)
        lump = surpluses_of(f, self.cells, self.local, self.received.reshape(shape)).reshape(*nodes.shape, -1, 3)
        split = surpluses_of(f, self.cells, self.local, self.means.reshape(shape)).reshape(lump.shape)
        split = reflectance * split * self.factors[nodes][..., None]
        lump = reflectance * lump
        each_split = (split**2).sum(axis=3)
        cost_lump, cost_split = (
            DECAY**2 * np.einsum("n,nas->s", size, by_axis(f, square, self.cells)[is_leaf])
            for square in ((lump**2).sum(axis=3), each_split)
        )
        order = np.argsort(cost_split - cost_lump)
        order = np.concatenate([always, order[~np.isin(order, always)]]).astype(int)
        rest = cost_lump.sum() - np.cumsum(cost_lump[order])
        count = len(always)
        while not only and count < min(len(order), MOST):
            left = rest[count - 1] if count else cost_lump.sum()
            if left <= allowed**2 or cost_split[order[count]] >= cost_lump[order[count]]:
                break
            count += 1
        others = order[count:]
        self.take(order[:count])
        lumped = (lump[:, :, others].sum(axis=2) ** 2).sum(axis=2)
        surplus = np.zeros((len(f.level), 2))
        surplus[self.cells] = np.sqrt(by_axis(f, lumped + each_split[:, :, self.exact].sum(axis=2), self.cells))
        self.leaf_error = decay(f, leaves, surplus) * surplus[leaves] * np.sqrt(size)[:, None]

    def take(self, exact):
        """The values to interpolate where the sources `exact` (k,) are those."""
        self.leaves = self.cells[self.field.child[self.cells] < 0]
        self.exact, others = exact, np.setdiff1d(np.arange(self.received.shape[1]), exact)
        means = self.means[:, exact].reshape(len(self.means), 3 * len(exact))
        self.values = np.concatenate([self.received[:, others].sum(axis=1), means], axis=1)

    def conform(self):
        self.values = conform(self.field, self.leaves, self.local, self.values)
        return self

    def between(self, cell, weight, factors):
        """Where cells (n,) and weights (n, 9) interpolate, factors (n, exact sources) -> irradiance / pi (n, 3)"""
        value = np.einsum("nk,nkc->nc", weight, self.values[self.local[self.field.nodes[cell]]])
        means = value[:, 3:].reshape(len(value), -1, 3)
        return value[:, :3] + np.einsum("ns,nsc->nc", factors, means)


def mean_seen(received, factor, sent):
    """What all nodes of a surface together see in the mean of sources: received (k, c) of factor (k,), sent (k, c) of
    what none of them sees; points between the nodes may see it where shapes run through each other."""
    return np.where(factor[:, None] > TINY, received / np.maximum(factor, TINY)[:, None], sent)
