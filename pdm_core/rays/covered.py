"""Which places of nodes nothing comes to: covered by what stands there, or within a body.

A floor's cell under the edge of a box is lit outside of the box alone, and seen from there alone: its light is the mean
of what is seen. Were the covered part counted, the feet of all that stands on a floor would be too dark.
"""

import numpy as np

from ..shapes.shape import lattice
from ..signs_of_life import finish
from .bundles import CONTACT, along
from .facets import Facets
from .near import places_of
from .nodes import PLACES, place_of
from .placed import read_places

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
    out[row, column] = hidden(nodes.facets, nodes.places.take(which[row] * PLACES + column))
    return out


def hidden(facets, receivers, is_lit=None):
    """(n,) Whether nobody can see the receivers: something lies against them, or all ways they see sides without light,
    as within a body; or, where is_lit(surface (k,), points (k, 3) m) is given, (k,), sides that none comes to."""
    out, within = np.zeros((2, len(receivers)), bool)
    within[:] = True
    for direction in lattice(2 * LOOKED)[:LOOKED]:
        some = np.flatnonzero(within)
        if not len(some):
            break
        hits = along(facets, direction[None], receivers.take(some))
        side = facets.surface[hits.facet, np.where(hits.front, 0, 1)]
        out[some] = against = hits.facet == CONTACT
        lit = side >= 0
        if is_lit is not None:
            met = np.flatnonzero(lit & (hits.facet >= 0))
            met = met[np.argsort(side[met], kind="stable")]  # surface by surface
            places = places_of(facets, hits.facet[met], hits.at[met]) + facets.centre
            lit[met] = is_lit(side[met], places)
        within[some] = ~against & (hits.facet >= 0) & ~lit
    return out | within


def unseen(solution, surface, points, normals=None, inward=None):
    """(n,) Whether black points (n, 3) m of surfaces (n,) lie where nobody looks: covered, within a body, or in a
    hollow that no light at all comes into, as a corner does that is only dark; normals, inward as Solution.incident
    has them."""
    facets = Facets(solution.scene)
    receivers = read_places(facets, surface, points, normals, inward)
    return hidden(facets, receivers, lambda *where: finish(solution.held_steps(*where)).any(axis=1))
