"""Rims of flat shapes close before others, as of a lamp below a ceiling: light in the gap is none beside it.

The gap may be far narrower than cells can become, which would spread what is within it over what is not.
"""

import numpy as np

from ..at_once import in_turn
from ..boxes import near
from ..shapes.shape import PARALLEL
from .bundles import AGAINST
from .near_flats import ON

NARROW = 0.01  # width of a gap, of the radius of the smaller shape


def rims(facets, charts):
    """surface (k,) that segments lie on, a, b (k, 2) on its chart: the outlines of what is close before them."""
    flat, shapes = facets.flat, facets.scene.shapes
    if len(flat) < 2:
        return np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2))
    of = [shapes[k] for k in flat]
    i, j, height = _parallel(of, NARROW * np.array([s.bounds[1] for s in of]), facets.tolerance)
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


def closed(facets):
    """Sentences for pairs of flat shapes of which one shines at the other from so near that no light is between them:
    further than their coordinates are rounded, but no further than what is taken as in contact or in one plane."""
    flat, scene = facets.flat, facets.scene
    if len(flat) < 2:
        return []
    of = [scene.shapes[k] for k in flat]
    i, j, height = _parallel(of, np.full(len(of), AGAINST * facets.tolerance), scene.tolerance)
    one, other = (facets.surface[facets.first[flat[k]]] for k in (i, j))
    turned = np.einsum("ni,ni->n", *(np.array([s.normal for s in of])[k] for k in (i, j))) > 0
    each, ahead = np.arange(len(i)), height > 0
    one, other = one[each, np.where(ahead, 0, 1)], other[each, np.where(ahead == turned, 1, 0)]
    shines = np.append((scene.emission > 0).any(axis=1), False)
    some = (i < j) & (one >= 0) & (other >= 0) & (shines[one] | shines[other])
    names = sorted({tuple(sorted(scene.surfaces[k].name for k in pair)) for pair in zip(one[some], other[some])})
    return [f"{a!r} and {b!r} are too near each other for light between them: taken as in contact" for a, b in names]


def _parallel(of, reach, tolerance):
    """i, j (k,): pairs, either way round, of flat shapes `of` in parallel planes that come nearer than the smaller
    one's reach (n,) m but no nearer than what lies in one plane, by a tolerance m, and how far before i's front j is
    (k,) m."""
    normal, origin = np.array([s.normal for s in of]), np.array([s.outline[0] for s in of])
    low, high = (np.array(part) for part in zip(*(s.box for s in of)))
    i, j = near(low - reach[:, None], high + reach[:, None], tolerance)
    i, j = np.concatenate([i, j]), np.concatenate([j, i])
    height = np.einsum("ni,ni->n", origin[j] - origin[i], normal[i])
    narrow = (np.abs(height) > ON * tolerance) & (np.abs(height) < np.minimum(reach[i], reach[j]))
    narrow &= np.linalg.norm(np.cross(normal[i], normal[j]), axis=1) < PARALLEL
    return i[narrow], j[narrow], height[narrow]
