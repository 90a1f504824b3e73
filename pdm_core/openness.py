"""How open points are: the share of their hemisphere, weighted by the cosine, in which nothing is, or nothing near.

By rays along fixed directions, the same for all points: free of noise to the eye.
"""

import numpy as np

from .rays.bundles import CONTACT
from .rays.facets import Facets
from .rays.near import places_of
from .rays.placed import Placed
from .rays.rows import Traced, directions

DIRECTIONS = 256  # of the half sphere, each with its opposite: shares are off by about .01


def openness_steps(scene, surface, points, distances, normals=None, inward=None):
    """Shares (n, d) in [0, 1] at points (n, 3) m of surfaces (n,) of what is farther than distances (d,) m, inf: the
    sky; normals and inward as Solution.incident has them. Generator of the fraction done."""
    facets = Facets(scene)
    receivers = Placed(facets, surface, points, normals, inward)
    every, n = np.arange(len(receivers)), len(receivers)
    out, total = np.zeros((n, len(distances))), np.zeros(n)
    traced = Traced(n, directions(1))
    for j, direction in enumerate(directions(DIRECTIONS)):
        traced.directions = direction[None]
        yield from _told(traced.trace(facets, lambda rows, _: receivers.take(rows), every), j / DIRECTIONS)
        depth, weight = _depth(facets, traced, receivers), np.abs(traced.cosine[:, 0])
        out += weight[:, None] * (depth[:, None] >= np.asarray(distances, float))
        total += weight
    return out / np.maximum(total, 1e-300)[:, None]


def _told(steps, done):
    for _ in steps:
        yield done


def _depth(facets, traced, receivers):
    """(n,) m from the receivers to what they meet along the one direction traced, inf where nothing."""
    code, at = traced.code[:, 0], traced.at[:, 0]
    place = np.full((len(code), 3), np.inf)
    place[code == CONTACT] = receivers.points[code == CONTACT]  # it lies against them
    hit = np.flatnonzero(code >= 0)
    place[hit] = places_of(facets, code[hit] >> 1, at[hit])
    return np.linalg.norm(place - receivers.points, axis=1)
