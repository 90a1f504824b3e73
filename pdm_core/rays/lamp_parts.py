"""Lamps that go through many rooms, as many lamps: of one, few of the points that stand for it would be in each room.

How long each may be is asked of the scene: it hangs on how far their light goes.
"""

import numpy as np

from ..shapes.shape import box_of, tile_counts
from ..shapes.triangle_tiles import MOST, WIDER
from .bundles import Receivers, along
from .near import places_of
from .rows import directions

LARGE = 0.1  # of the scene's size: what is smaller is in one room
WAYS = 16  # along which light leaves each of as many points of a lamp
MOSTLY = 0.75  # of these are shorter than what is asked for
# of that, how long lamps are that are parted, and parts: where a wall goes through one its points tell but roughly what
# is on either side
LONG, PARTS = 2.0, 0.5


def parted(facets, sources):
    """[Source] that sources are as several, or themselves where they are small."""
    low, high = box_of(facets.scene.shapes)
    large = [s for s in sources if s.sizes.max() > LARGE * np.linalg.norm(high - low)]
    if not large:
        return sources
    sizes, ways = np.array([s.sizes for s in large]), _usual_ways(facets, large)
    length = np.where(sizes.max(axis=1) > LONG * ways, PARTS * ways, np.inf)
    while tile_counts(sizes, length[:, None]).prod(axis=1).sum() > MOST + len(large):
        length = length * WIDER
    length = {source: one for source, one in zip(large, length) if one < np.inf}
    return [part for s in sources for part in (s.cut(facets, length[s]) if s in length else [s])]


def _usual_ways(facets, sources):
    """(k,) m, what MOSTLY of the ways of each source's light are no longer than, inf where it meets nothing: of both
    sides of what shines on both."""
    samples = [source.samples(WAYS)[:2] for source in sources]
    points, normals = (np.concatenate(a) for a in zip(*samples))
    points = points - facets.centre
    own = np.repeat([id(source.whole) for source in sources], [len(place) for place, _ in samples])
    n = len(points) * WAYS
    start, nothing = np.full(n, facets.tolerance), np.full(n, -1)
    rays = Receivers(np.tile(points, (WAYS, 1)), np.tile(normals, (WAYS, 1)), nothing, start, np.zeros(n, bool))
    hits = along(facets, directions(WAYS), rays)
    length, met = np.full(n, np.inf), np.flatnonzero(hits.facet >= 0)
    length[met] = np.linalg.norm(places_of(facets, hits.facet[met], hits.at[met]) - rays.points[met], axis=1)
    length = length.reshape(WAYS, -1)
    each = {one: np.quantile(length[:, own == one], MOSTLY, method="lower") for one in np.unique(own)}
    return np.array([each[id(source.whole)] for source in sources])
