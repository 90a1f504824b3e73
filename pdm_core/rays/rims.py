"""Rims of flat shapes close before others, as of a lamp below a ceiling: light in the gap is none beside it.

The gap may be far narrower than cells can become, which would spread what is within it over what is not.
"""

import numpy as np

from ..at_once import in_turn
from ..boxes import near
from ..shapes.shape import PARALLEL
from .near_flats import ON

NARROW = 0.01  # width of a gap, of the radius of the smaller shape


def rims(facets, charts):
    """surface (k,) that segments lie on, a, b (k, 2) on its chart: the outlines of what is close before them."""
    flat, shapes = facets.flat, facets.scene.shapes
    if len(flat) < 2:
        return np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2))
    of = [shapes[k] for k in flat]
    normal, radius = np.array([s.normal for s in of]), np.array([s.bounds[1] for s in of])
    origin = np.array([s.outline[0] for s in of])
    low, high = (np.array(part) for part in zip(*(s.box for s in of)))
    reach = NARROW * radius[:, None]
    i, j = near(low - reach, high + reach, facets.tolerance)
    i, j = np.concatenate([i, j]), np.concatenate([j, i])
    height = np.einsum("ni,ni->n", origin[j] - origin[i], normal[i])
    narrow = (np.abs(height) > ON * facets.tolerance) & (np.abs(height) < NARROW * np.minimum(radius[i], radius[j]))
    narrow &= np.linalg.norm(np.cross(normal[i], normal[j]), axis=1) < PARALLEL
    i, j, height = i[narrow], j[narrow], height[narrow]
    surface = facets.surface[facets.first[flat[i]], np.where(height > 0, 0, 1)]
    i, j, surface = (a[(surface >= 0) & charts.has[surface]] for a in (i, j, surface))
    start = np.concatenate([np.zeros((0, 3)), *(s.outline for s in of)])
    end = np.concatenate([np.zeros((0, 3)), *(np.roll(s.outline, -1, axis=0) for s in of)])
    count = np.array([len(s.outline) for s in of])
    first = np.cumsum(count) - count
    which, step = in_turn(count[j])
    own, edge = surface[which], first[j[which]] + step
    a, b = (np.einsum("nij,nj->ni", charts.inverse[own, :2], p[edge] - charts.origin[own]) for p in (start, end))
    return own, a, b
