"""Where lines that are functions of two coordinates meet balls."""

import numpy as np

from ..closed_forms import dot

# of the square of a linear function of x, y and 1: which two of these each of its terms is of, and how often
TERMS = (2, 2, 1), (0, 2, 2), (1, 2, 2), (0, 0, 1), (0, 1, 2), (1, 1, 1)


class Quadrics:
    """Where lines meet unit balls about 0, as each of the balls (k, b) sees them: from start @ (x, y, 1) along step or,
    where the direction moves with the place, from start along step @ (x, y, 1). even (3, k, b): which of both does not
    move; moving: the other, three times (3, k or 1, b), for x, y and 1.

    Both roots t of the ball's quadratic in t are known from functions of (x, y) that are worked out once a ball.
    """

    def __init__(self, even, moving, moves):
        self.moves = moves  # whether it is the direction that does
        square = [times * dot(moving[i], moving[j]) for i, j, times in TERMS]
        own, b = dot(even, even), [dot(even, a) for a in moving]
        if moves:
            own -= 1
        else:
            square[0] -= 1
        reach = [times * b[i] * b[j] - own * two for (i, j, times), two in zip(TERMS, square)]
        self.own, self.b, self.reach = own.ravel(), *(np.stack(a).reshape(len(a), -1) for a in (b, reach))
        self.square = np.stack([np.broadcast_to(a, own.shape) for a in square]).reshape(6, -1) if moves else None

    def ends(self, k, x, y):
        """(2, p) the roots t, the lesser first, of balls k (p,) at x, y (p,); nan where the line misses the ball."""
        reach = _quadratic(self.reach, k, x, y)
        out = np.full((2, len(k)), np.nan)
        some = np.flatnonzero(reach > 0)
        k, x, y, root = k[some], x[some], y[some], np.sqrt(reach[some])
        b = self.b.take(k, axis=1)
        b = b[0] * x + b[1] * y + b[2]
        own = self.own.take(k)
        if not self.moves:
            out[:, some] = (-b - root) / own, (root - b) / own
            return out
        # t^2 a + 2 t b + own = 0 by the root that does not cancel
        s = -(b + np.where(b >= 0, root, -root))
        a = _quadratic(self.square, k, x, y)  # not from the others, which tell nothing where the start is on the ball
        one, two = s / np.where(a == 0, 1e-300, a), own / np.where(s == 0, 1e-300, s)
        out[:, some] = np.minimum(one, two), np.maximum(one, two)
        return out


def _quadratic(terms, k, x, y):
    """(p,) Functions of terms (6, n), in the order of TERMS, k (p,) of them, at x, y (p,)."""
    q = terms.take(k, axis=1)
    return q[0] + x * (q[1] + x * q[3]) + y * (q[2] + x * q[4] + y * q[5])
