"""The nearest of many triangles to many points: boxes around runs of triangles along a Morton curve, eight to a box.

Each point first goes down to one triangle near it; then all go down together, a list of (point, box) pairs from which
boxes further than that are dropped.
"""

import numpy as np

from .at_once import AT_ONCE, CACHED, parts
from .closed_forms import cross, divide, dot
from .tolerances import TINY

FEW = 8  # boxes to a box; the smallest hold one triangle each
BITS = 20  # of a coordinate, as on the curve: three of them, and a side, in 63


class NearestTriangle:
    """corners (t, 3, 3) m of triangles, looked up by points."""

    def __init__(self, corners):
        self.low_corner, self.size = corners.min(axis=(0, 1)), np.ptp(corners, axis=(0, 1)).max()
        code = self._code(corners.mean(axis=1))
        self.order = np.argsort(code, kind="stable")
        self.code = code[self.order]
        self.corners = np.ascontiguousarray(corners[self.order].transpose(2, 1, 0))  # (3, corner, t)
        low, high, some = self.corners.min(axis=1), self.corners.max(axis=1), self.corners.mean(axis=1)
        self.levels = [(low, high, some)]  # (low, high, a point of the triangles within) (3, boxes), smallest first
        while low.shape[1] > 1:
            first = np.arange(0, low.shape[1], FEW)
            low, high = np.minimum.reduceat(low, first, axis=1), np.maximum.reduceat(high, first, axis=1)
            some = some[:, np.minimum(first + FEW // 2, some.shape[1] - 1)]
            self.levels.append((low, high, some))

    def _code(self, points):
        """Places (n,) along the curve of points (n, 3) m, those outside moved to the border."""
        return along_curve(points, self.low_corner, self.size)

    def find(self, points):
        """points (n, 3) m -> nearest triangle (n,), barycentric coordinates (n, 3) of the nearest point on it."""
        triangle, weights = np.empty(len(points), int), np.empty((len(points), 3))
        left = parts(np.argsort(self._code(points), kind="stable"), CACHED)
        while left:
            part = left.pop()
            x = np.ascontiguousarray(points[part].T)
            found = self._find(x, most=AT_ONCE if len(part) > 1 else np.inf)
            if found is None:  # in the middle of a ball everything is equally near
                left += np.array_split(part, 2)
            else:
                triangle[part], weights[part] = found
        return triangle, weights

    def _first(self, x):
        """Squared distances (m,) of points (3, m) from triangles (m,) near them."""
        last = self.corners.shape[2] - 1
        guess = np.minimum(np.searchsorted(self.code, self._code(x.T)), last)
        best = self._distance2(x, guess)[0]
        box = np.zeros(x.shape[1], int)
        for _, _, some in self.levels[-2::-1]:
            child = np.minimum(FEW * box + np.arange(FEW)[:, None], some.shape[1] - 1)
            away = some[:, child] - x[:, None]
            box = np.take_along_axis(child, np.argmin(dot(away, away), axis=0)[None], axis=0)[0]
        other = self._distance2(x, box)[0]
        return np.minimum(best, other), np.where(other < best, box, guess)

    def _find(self, x, most):
        """As find, for points (3, m); None where more than `most` pairs are to be looked at."""
        best, nearest = self._first(x)
        point = np.flatnonzero(best > (TINY * self.size) ** 2)
        box = np.zeros(len(point), int)
        on = np.setdiff1d(np.arange(len(best)), point)
        best = best * (1 + TINY)
        for low, high, _ in self.levels[-2::-1]:
            point, box = _children(point, box, low.shape[1])
            at = x.take(point, axis=1)
            off = np.maximum(np.maximum(low.take(box, axis=1) - at, at - high.take(box, axis=1)), 0.0)
            keep = np.flatnonzero(dot(off, off) <= best[point])
            if len(keep) * FEW > most:
                return None
            point, box = point[keep], box[keep]
        point, box = np.concatenate([point, on]), np.concatenate([box, nearest[on]])
        distance2, weights = self._distance2(x.take(point, axis=1), box)
        order = np.lexsort((self.order[box], distance2, point))
        order = order[np.unique(point[order], return_index=True)[1]]
        return self.order[box[order]], weights[:, order].T

    def _distance2(self, x, triangle):
        """Squared distances (m,) of points (3, m) from triangles (m,), barycentric coordinates (3, m) nearest them."""
        a, b, c = self.corners.take(triangle, axis=2).transpose(1, 0, 2) - x
        normal = cross(b - a, c - a)
        inner = np.stack([dot(normal, cross(b, c)), dot(normal, cross(c, a)), dot(normal, cross(a, b))])
        total = inner.sum(axis=0)
        weights = divide(inner, total)
        foot = np.einsum("km,kim->im", weights, np.stack([a, b, c]))
        within = (inner >= 0).all(axis=0) & (total > 0)
        best = np.where(within, dot(foot, foot), np.inf)
        for k, (p, q) in enumerate(((a, b), (b, c), (c, a))):
            d = q - p
            t = np.clip(divide(-dot(p, d), dot(d, d)), 0.0, 1.0)
            near = p + t * d
            distance2 = dot(near, near)
            closer = np.flatnonzero(distance2 < best)
            best[closer] = distance2[closer]
            weights[:, closer] = 0.0
            weights[k, closer], weights[(k + 1) % 3, closer] = 1 - t[closer], t[closer]
        return best, weights


def _children(point, box, count):
    """Pairs of points and boxes one level down, of which there are count."""
    child = (FEW * box[:, None] + np.arange(FEW)).ravel()
    point = np.repeat(point, FEW)
    real = child < count
    return point[real], child[real]


def along_curve(points, low, size):
    """Places (n,) along a Morton curve of points (n, 3) m in a cube of so wide a size m, its corner low (3,), those
    outside moved to the border: what is next to each other there is near each other."""
    cell = np.clip((points - low) * ((2**BITS - 1) / max(size, 1e-300)), 0, 2**BITS - 1).astype(np.uint64)
    return sum(_spread_bits(cell[:, k]) << np.uint64(k) for k in range(3))


def _spread_bits(value):
    """The bits of numbers below 2^20, uint64, three places apart."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        value = (value | value << np.uint64(shift)) & np.uint64(mask)
    return value
