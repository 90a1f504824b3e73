"""Places of cells on which something stands, or that lie within solids: they are no part of what their cells send.

A cell under the edge of a box is half in the dark, and only its other half is ever seen. With the mean of both, all
that stands upright would be too dark at its foot, by as much as it sees of such cells.
"""

import numpy as np

from .bundles import CONTACT, along
from .nodes import LIT, PLACES
from .rows import DARK, directions

CONFIRMED = 8  # further directions, along all of which nothing carries light


def covered_places(state, new, each):
    """(n, PLACES) bool, which places of the nodes new (n,) of a RayState see nothing that carries light, not even the
    outside; each (n, LIT, sources, 3): the direct light at the first ones; yields."""
    facets, nodes, code = state.facets, state.nodes, state.traced.code[new]
    nothing = (code == DARK) | ((code >= 0) & (facets.surface[code >> 1, code & 1] < 0))
    out = np.stack([nothing[:, j::PLACES].all(axis=1) for j in range(PLACES)], axis=1)
    out[:, :LIT] &= ~(each > 0).any(axis=(2, 3))
    node, place = np.nonzero(out)
    receivers = nodes.places.take(new[node] * PLACES + place)
    for direction in directions(CONFIRMED):
        hits = along(facets, direction, receivers)
        met = facets.surface[np.maximum(hits.facet, 0), np.where(hits.front, 0, 1)]
        out[node, place] &= (hits.facet == CONTACT) | ((hits.facet >= 0) & (met < 0))
        yield
    return out


def without(traced, covered, which):
    """Rays of the rows `which` (n,) of Traced that start from covered places (n, PLACES) count no more."""
    for j in range(PLACES):
        part = traced.cosine[which, j::PLACES]
        traced.cosine[which, j::PLACES] = np.where(covered[:, j, None], 0.0, part)


def mean_over_open(each, covered):
    """each (n, LIT, ...) at the first places, covered (n, PLACES) -> mean (n, ...) over the open ones, and how far
    (n, LIT, ...) each is from it, 0 of covered ones."""
    share = ~covered[:, :LIT]
    share = (share / np.maximum(share.sum(axis=1, keepdims=True), 1)).reshape(*share.shape, *[1] * (each.ndim - 2))
    mean = (each * share).sum(axis=1)
    return mean, (each - mean[:, None]) * np.sqrt(share)
