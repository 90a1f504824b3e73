"""Which samples of rectangles on planes are hidden from points, before any factor is worked out."""

import numpy as np

from .at_once import entries_of
from .closed_forms import cross, dot, transform


class Shadows:
    """What occluders hide of planes from points, as regions of the planes in coordinates (a, b) along their edges.

    The ray to o + a u + b v meets a ball where a quadratic in (a, b) is positive, a parallelogram where five linear
    functions are. Both are known once for each (point, plane) pair, whatever cells the plane is cut into.
    """

    def __init__(self, table, points, frame, occluders):
        """points (n, 3) m; frame (o, u, v), each (3, n) m, of the planes; occluders (n, k) padded with -1."""
        pair, slot = np.nonzero(occluders >= 0)
        shape = occluders[pair, slot]
        self.kinds = []
        for kind, some in zip((_BallShadows, _FlatShadows), table.by_kind(shape)):
            if len(some):
                number = np.bincount(pair[some], minlength=len(points))
                inverse, at = table.inverse.take(shape[some], axis=2), pair[some]
                x = np.ascontiguousarray(points.T).take(at, axis=1)
                local = [transform(inverse, x - table.origin.take(shape[some], axis=1))]
                local += [transform(inverse, frame[0].take(at, axis=1) - x)]
                local += [transform(inverse, edge.take(at, axis=1)) for edge in frame[1:]]
                self.kinds.append((number, np.cumsum(number) - number, kind(*local, table.slack[shape[some]])))

    def over(self, pair, low, high, place):
        """Of rectangles low..high (2, n) of pairs (n,): which of their samples at place (2, j, n) are hidden
        (j, j, n), and whether a shadow may come near at all (n,)."""
        middle, half = (low + high) / 2, (high - low) / 2
        j, n = place.shape[1:]
        near, hidden = np.zeros(n, bool), np.zeros(j * j * n, bool)
        for number, first, shadows in self.kinds:
            cell, entry = entries_of((first, number), pair)
            keep = np.flatnonzero(shadows.near(entry, middle.take(cell, axis=1), half.take(cell, axis=1)))
            cell, entry = cell[keep], entry[keep]
            near[cell] = True
            shadow = shadows.hides(entry, *place.take(cell, axis=2)).reshape(j * j, -1)
            sample, which = np.nonzero(shadow)
            hidden[sample * n + cell[which]] = True
        return hidden.reshape(j, j, n), near


def _on_lattice(q, a, b):
    """q0 + qa a + qb b + qaa a^2 + qab a b + qbb b^2, q (6, m), or only its first three terms, at a, b (j, m)."""
    if len(q) == 3:
        return (q[0] + q[1] * a)[:, None] + q[2] * b
    rows, slope = q[0] + a * (q[1] + a * q[3]), q[2] + a * q[4]
    return rows[:, None] + b * (slope[:, None] + b * q[5])


def _highest(q, middle, half):
    """An upper bound (m,) of such functions over rectangles with these middles and halves (2, m)."""
    (a, b), (da, db) = middle, half
    if len(q) == 3:
        return q[0] + q[1] * a + q[2] * b + np.abs(q[1]) * da + np.abs(q[2]) * db
    value = q[0] + a * (q[1] + a * q[3]) + b * (q[2] + a * q[4] + b * q[5])
    slope = np.abs(q[1] + 2 * q[3] * a + q[4] * b) * da + np.abs(q[2] + 2 * q[5] * b + q[4] * a) * db
    return value + slope + np.abs(q[3]) * da**2 + np.abs(q[4]) * da * db + np.abs(q[5]) * db**2


class _BallShadows:
    """p (3, m) the point, d = o + a u + b v the step from it, where the ball is the unit ball."""

    def __init__(self, p, o, u, v, slack):
        self.ahead = np.stack([dot(p, o), dot(p, u), dot(p, v)])  # p . d, negative towards the ball
        oo, ou, ov, uu, uv, vv = (dot(*k) for k in ((o, o), (o, u), (o, v), (u, u), (u, v), (v, v)))
        length2 = np.stack([oo, 2 * ou, 2 * ov, uu, 2 * uv, vv])
        power = dot(p, p) - 1
        (c, ca, cb), zero = self.ahead, np.zeros(len(power))
        self.meets = np.stack([c * c, 2 * c * ca, 2 * c * cb, ca * ca, 2 * ca * cb, cb * cb]) - power * length2
        # of a ball that reaches through the plane: its nearest point of the ray, or the end of it, is before the plane
        self.before = length2 + np.stack([c, ca, cb, zero, zero, zero])
        self.end = length2 + np.stack([2 * c + power, 2 * ca, 2 * cb, zero, zero, zero])
        normal = cross(u, v)
        self.through = np.abs(dot(normal, p + o)) < (1 - slack) * np.sqrt(dot(normal, normal))
        inside = power < -2 * slack  # then it hides what is outside of it, beyond its far side
        self.meets[:, inside], self.ahead[:, inside] = self.end[:, inside], 0.0
        self.ahead[0, inside], self.through[inside] = -1.0, False

    def near(self, entry, middle, half):
        ahead = _highest(-self.ahead.take(entry, axis=1), middle, half) > 0
        return ahead & (_highest(self.meets.take(entry, axis=1), middle, half) > 0)

    def hides(self, entry, a, b):
        hidden = (_on_lattice(self.meets.take(entry, axis=1), a, b) > 0) & (
            _on_lattice(self.ahead.take(entry, axis=1), a, b) < 0
        )
        some = np.flatnonzero(self.through[entry])
        if len(some):
            e, a, b = entry[some], a[:, some], b[:, some]
            reached = (_on_lattice(self.before[:, e], a, b) > 0) | (_on_lattice(self.end[:, e], a, b) < 0)
            hidden[..., some] &= reached
        return hidden


class _FlatShadows:
    """As for balls, where the parallelogram is the unit square about the origin."""

    def __init__(self, p, o, u, v, slack):
        d = np.stack([o, u, v], axis=1)  # (3, 3 of 1, a and b, m)
        sign = np.where(p[2] < 0, -1.0, 1.0)
        height = np.abs(p[2])  # of the point over the parallelogram's plane, on its side
        fall = -sign * d[2]  # of the ray
        beyond = fall.copy()
        beyond[0] -= height + slack
        beyond[:, height < slack] = 0.0  # seen edge-on
        # the ray crosses the plane at p + (height / fall) d
        sides = [0.5 * fall + k * (p[i] * fall + height * d[i]) for i in (0, 1) for k in (1, -1)]
        self.meets = np.stack([beyond, *sides])

    def near(self, entry, middle, half):
        return np.logical_and.reduce([_highest(q, middle, half) > 0 for q in self.meets.take(entry, axis=2)])

    def hides(self, entry, a, b):
        return np.logical_and.reduce([_on_lattice(q, a, b) > 0 for q in self.meets.take(entry, axis=2)])
