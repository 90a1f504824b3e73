"""Lamps that go through many rooms, as many lamps: of one, few of the points that stand for it would be in each room.

How long each may be is asked of the scene: it hangs on how much of them one sees where their light comes to.
"""

import numpy as np

from ..shapes.shape import box_of, tile_counts
from ..shapes.triangle_tiles import MOST, WIDER
from .bundles import Receivers, along
from .direct import visible
from .near import places_of
from .rows import directions

LARGE = 0.1  # of the scene's size: what is smaller is in one room
WAYS = 16  # along which light leaves each of as many points of a lamp
MOSTLY = 0.75  # of the places that these come to are no further than what is asked for from all of it that they see
# of that, how long lamps are that are parted, and parts: where a wall goes through one its points tell but roughly what
# is on either side
LONG, PARTS = 2.0, 0.5


def parted(facets, sources):
    """[Source] that sources are as several, or themselves where they are small."""
    low, high = box_of(facets.scene.shapes)
    large = [s for s in sources if s.sizes.max() > LARGE * np.linalg.norm(high - low)]
    if not large:
        return sources
    sizes, far = np.array([s.sizes for s in large]), _usual_reach(facets, large)
    length = np.where(sizes.max(axis=1) > LONG * far, PARTS * far, np.inf)
    while tile_counts(sizes, length[:, None]).prod(axis=1).sum() > MOST + len(large):
        length = length * WIDER
    length = {source: one for source, one in zip(large, length) if one < np.inf}
    return [part for s in sources for part in (s.cut(facets, length[s]) if s in length else [s])]


def _usual_reach(facets, sources):
    """(k,) m, what MOSTLY of the places that each source's light comes to are no further from any of its points that
    shine on them, inf where it meets nothing: of both sides of what shines on both."""
    samples = [source.samples(WAYS)[:2] for source in sources]
    points, normals = (np.concatenate(a) for a in zip(*samples))
    points, which = points - facets.centre, np.repeat(np.arange(len(sources)), [len(place) for place, _ in samples])
    rays = _free(facets, np.tile(points, (WAYS, 1)), np.tile(normals, (WAYS, 1)))
    hits, which = along(facets, directions(WAYS), rays), np.tile(which, WAYS)
    reach, met = np.full(len(rays), np.inf), np.flatnonzero(hits.facet >= 0)
    there = places_of(facets, hits.facet[met], hits.at[met])
    reach[met] = np.linalg.norm(there - rays.points[met], axis=1)
    # from the middle of the way, where no wall that is met hides less than it does
    middle = (there + rays.points[met]) / 2
    for k, source in enumerate(sources):
        mine = np.flatnonzero(which[met] == k)
        point, who = (a.ravel() for a in np.indices((len(samples[k][0]), len(mine))))
        seen = visible(facets, source, samples[k][0], _free(facets, middle[mine], 0 * middle[mine]), point, who)
        apart = np.linalg.norm(samples[k][0][point] - facets.centre - there[mine][who], axis=1)
        np.maximum.at(reach, met[mine[who[seen]]], apart[seen])
    own = np.array([id(source.whole) for source in sources])
    each = {one: np.quantile(reach[own[which] == one], MOSTLY, method="lower") for one in np.unique(own)}
    return np.array([each[one] for one in own])


def _free(facets, points, normals):
    """Receivers at points (n, 3) m about the facets' centre, of normals (n, 3), on nothing."""
    n = len(points)
    return Receivers(points, normals, np.full(n, -1), np.full(n, facets.tolerance), np.zeros(n, bool))
