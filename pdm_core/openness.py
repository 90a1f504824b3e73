"""How open points are: the share of their hemisphere, weighted by the cosine, in which nothing is, or nothing near.

By rays along fixed directions, the same for all points: free of noise to the eye.
"""

import numpy as np

from .rays.bundles import CONTACT, along
from .rays.facets import Facets
from .rays.near import places_of
from .rays.placed import Placed
from .rays.rows import directions

DIRECTIONS = 256  # of the half sphere, each with its opposite: shares are off by about .01


def openness_steps(scene, surface, points, distances, normals=None, inward=None):
    """Shares (n, d) in [0, 1] at points (n, 3) m of surfaces (n,) of what is farther than distances (d,) m, inf: the
    sky; normals and inward as Solution.incident has them. Generator of the fraction done."""
    facets = Facets(scene)
    receivers = Placed(facets, surface, points, normals, inward)
    out, total = np.zeros((len(receivers), len(distances))), np.zeros(len(receivers))
    for j, direction in enumerate(directions(DIRECTIONS)):
        hits = along(facets, direction[None], receivers)
        depth, weight = _depth(facets, hits, receivers), np.abs(hits.cosine)
        out += weight[:, None] * (depth[:, None] >= np.asarray(distances, float))
        total += weight
        yield j / DIRECTIONS
    return out / np.maximum(total, 1e-300)[:, None]


def _depth(facets, hits, receivers):
    """(n,) m from the receivers to what they meet, inf where nothing."""
    place = np.full((len(receivers), 3), np.inf)
    against = hits.facet == CONTACT
    place[against] = receivers.points[against]
    hit = np.flatnonzero(hits.facet >= 0)
    place[hit] = places_of(facets, hits.facet[hit], hits.at[hit])
    return np.linalg.norm(place - receivers.points, axis=1)
