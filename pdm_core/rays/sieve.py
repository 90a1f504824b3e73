"""Of very many facets those that may lie over any of a few places: a picture of the places, summed up, tells at once
whether a rectangle of it is empty."""

import numpy as np

from .facets import WIDER_SINGLE

MANY, RARE = 8192, 8  # facets from which on, and for each place, they are sifted before they are projected
PICTURE = 512  # cells of the picture along each axis
ASIDE = 0.01  # of a cell: more than what single precision rounds off


def worth_it(facets, places):
    """Whether so many facets are to be sifted for so many places."""
    return 0 < places and facets > max(MANY, RARE * places)


def over(x, y, low, high):
    """(k,) Those of boxes low, high (2, m), in single precision, that may hold any of the places x, y (n,)."""
    seen, ends = np.zeros((PICTURE + 1, PICTURE + 1), np.int32), []
    at = []
    for a, first, last in zip((x, y), low, high):
        least = a.min()
        scale = PICTURE / max((a.max() - least) * (1 + 1e-6), 1e-30)
        at.append(((a - least) * scale).astype(int) + 1)
        bounds = ((first, -ASIDE), (last, 1 + ASIDE))
        ends.append([np.clip((b - np.float32(least)) * np.float32(scale) + c, 0, PICTURE) for b, c in bounds])
    seen[tuple(at)] = 1
    before = seen.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32).ravel()  # lower along both axes
    (a, b), (c, d) = ([e.astype(np.int32) for e in pair] for pair in ends)
    a, b = a * np.int32(PICTURE + 1), b * np.int32(PICTURE + 1)
    return np.flatnonzero(before.take(b + d) - before.take(a + d) - before.take(b + c) + before.take(a + c))


def over_along(facets, plane, x, y):
    """(k,) Those of Facets, projected along the last axis of the plane (3, 3), that may be over places x, y (n,)."""
    centre, radius = facets.spheres
    middle = plane[:2].astype(np.float32) @ centre
    return over(x, y, middle - radius, middle + radius)


def over_from(facets, plane, point, some, x, y):
    """(k,) Those of the facets `some` (m,), seen from a point (3,) m through a plane (3, 3), that may be before places
    x, y (n,)."""
    centre, radius = (a.take(some, axis=-1) for a in facets.spheres)
    radius = radius + np.float32(WIDER_SINGLE * np.abs(point).max())
    middle = plane.astype(np.float32) @ centre - (plane @ point).astype(np.float32)[:, None]
    near, far = middle[2] - radius, middle[2] + radius
    ahead = near > 1e-3 * far
    near, far = np.where(ahead, near, 1.0), np.where(ahead, far, 1.0)
    low, high = middle[:2] - radius, middle[:2] + radius
    low, high = low / np.where(low < 0, near, far), high / np.where(high > 0, near, far)
    return some[over(x, y, np.where(ahead, low, -np.inf), np.where(ahead, high, np.inf))]
