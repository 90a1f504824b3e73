"""Which places of nodes nothing comes to: covered by what stands there, or within a body.

A floor's cell under the edge of a box is lit outside of the box alone, and seen from there alone: its light is the mean
of what is seen. Were the covered part counted, the feet of all that stands on a floor would be too dark.
"""

import numpy as np

from ..shapes.shape import lattice
from .bundles import CONTACT, along
from .nodes import PLACES, place_of

LOOKED = 16  # directions, and their opposites, from places that all rays leave towards sides without light


def covered(traced, nodes, which):
    """(k, PLACES) bool of nodes `which` (k,), by their traced rays."""
    code = traced.code[which]
    place = place_of(np.arange(code.shape[1]))
    lost = code == CONTACT
    out = np.zeros((len(which), PLACES), bool)
    dead = np.ones_like(out)
    meets_no_light = lost | (nodes.facets.surface[code >> 1, code & 1] < 0) & (code >= 0)
    for k in range(min(PLACES, code.shape[1])):
        out[:, k], dead[:, k] = lost[:, place == k].any(axis=1), meets_no_light[:, place == k].all(axis=1)
    row, column = np.nonzero(dead & ~out)
    within = np.ones(len(row), bool)
    for direction in lattice(2 * LOOKED)[:LOOKED]:
        some = np.flatnonzero(within)
        if not len(some):
            break
        hits = along(nodes.facets, direction[None], nodes.places.take(which[row[some]] * PLACES + column[some]))
        side = nodes.facets.surface[hits.facet, np.where(hits.front, 0, 1)]
        within[some] = (hits.facet >= 0) & (side < 0)
    out[row, column] = within
    return out
