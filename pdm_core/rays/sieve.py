"""Of very many facets those that may lie over any of a few places: a picture of the places, summed up, tells at once
whether a rectangle of it is empty. Runs of facets that lie near each other are looked up first, then theirs alone."""

import numpy as np

from ..nearest import along_curve

MANY, RARE = 8192, 8  # facets from which on, and for each place, they are sifted before they are projected
PICTURE = 512  # cells of the picture along each axis
ASIDE = 0.01  # of a cell: more than what single precision rounds off
WIDER_SINGLE = 1e-6  # of lengths: more than what single precision rounds off
RUN = 16  # facets that are looked up as one first


def worth_it(facets, places):
    """Whether so many facets are to be sifted for so many places."""
    return 0 < places and facets > max(MANY, RARE * places)


class Sieve:
    """Of Facets, balls aside: each in a ball, along a Morton curve, and runs of RUN of them in one each, all in single
    precision, a little wider."""

    def __init__(self, facets):
        middle = facets.middles()
        radius = np.linalg.norm(facets.corners(slice(None)) - middle[:, None], axis=2).max(axis=1)
        low = middle.min(axis=0)
        order = np.argsort(along_curve(middle, low, np.ptp(middle, axis=0).max()), kind="stable")
        self.facet = np.append(order, np.repeat(order[-1], -len(order) % RUN)).reshape(-1, RUN)
        self.wider = WIDER_SINGLE * (np.abs(middle).max() + radius.max())
        middle, radius = middle[self.facet], radius[self.facet]
        about = (middle.min(axis=1) + middle.max(axis=1)) / 2
        reach = (np.linalg.norm(middle - about[:, None], axis=2) + radius).max(axis=1)
        self.runs, self.each = self._single(about, reach), self._single(middle, radius)

    def _single(self, centre, radius):
        wider = radius * (1 + WIDER_SINGLE) + self.wider
        return np.ascontiguousarray(np.moveaxis(centre, -1, 0), np.float32), wider.astype(np.float32)

    def _over(self, x, y, boxes):
        """(k,) Facets, in order, that may be over places x, y (n,): boxes(centre (3, m), radius (m,)) -> low, high (2,
        m) of balls."""
        over, (centre, radius) = _picture(x, y), self.each
        run = over(*boxes(*self.runs))
        some = over(*boxes(centre.take(run, axis=1).reshape(3, -1), radius.take(run, axis=0).ravel()))
        some = np.sort(self.facet.take(run, axis=0).ravel().take(some))
        return some[np.diff(some, prepend=-1) > 0]  # the last run may hold one several times

    def along(self, plane, x, y):
        """(k,) Those that, projected along the last axis of the plane (3, 3), may be over places x, y (n,)."""

        def boxes(centre, radius):
            middle = plane[:2].astype(np.float32) @ centre
            return middle - radius, middle + radius

        return self._over(x, y, boxes)

    def seen_from(self, point, plane, x, y):
        """(k,) Those that, seen from a point (3,) m through a plane (3, 3), may be before places x, y (n,)."""
        wider, at = np.float32(WIDER_SINGLE * np.abs(point).max()), (plane @ point).astype(np.float32)[:, None]

        def boxes(centre, radius):
            radius = radius + wider
            middle = plane.astype(np.float32) @ centre - at
            near, far = middle[2] - radius, middle[2] + radius
            ahead = near > 1e-3 * far
            near, far = np.where(ahead, near, 1.0), np.where(ahead, far, 1.0)
            low, high = middle[:2] - radius, middle[:2] + radius
            low, high = low / np.where(low < 0, near, far), high / np.where(high > 0, near, far)
            # all around where it is not ahead, and nowhere where it is behind
            low, high = np.where(ahead, low, -np.inf), np.where(ahead, high, np.inf)
            low[:, middle[2] + radius <= 0] = np.inf
            return low, high

        return self._over(x, y, boxes)


def _picture(x, y):
    """The function of boxes low, high (2, m), in single precision, that tells which (k,) may hold any of the places x,
    y (n,)."""
    lines, at = [], []
    for a in (x, y):
        least = a.min()
        scale = PICTURE / max((a.max() - least) * (1 + 1e-6), 1e-30)
        at.append(((a - least) * scale).astype(int) + 1)
        lines.append((np.float32(least), np.float32(scale)))
    seen = np.zeros((PICTURE + 1, PICTURE + 1), np.int32)
    seen[tuple(at)] = 1
    before = seen.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32).ravel()  # lower along both axes

    def over(low, high):
        ends = []
        for (least, scale), *bounds in zip(lines, low, high):
            both = ((b - least) * scale + c for b, c in zip(bounds, (-ASIDE, 1 + ASIDE)))
            ends.append([np.clip(b, 0, PICTURE).astype(np.int32) for b in both])
        (a, b), (c, d) = ends
        a, b = a * np.int32(PICTURE + 1), b * np.int32(PICTURE + 1)
        return np.flatnonzero(before.take(b + d) - before.take(a + d) - before.take(b + c) + before.take(a + c))

    return over
