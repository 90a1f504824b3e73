"""Where lines that are functions of two coordinates meet balls."""

import numpy as np


class Quadrics:
    """Where lines meet balls, inverse (b, 3, 3), which lie at -start (b, 3): lines of the points fixed @ (x, y, 1) +
    t step @ (0, 0, 1), or, where the direction moves with the place, t step @ (x, y, 1); fixed, step (b, 3, 3).

    Both roots t of the ball's quadratic in t are known from functions of (x, y) that are worked out once a ball.
    """

    def __init__(self, inverse, start, fixed, step, moves):
        w, q = inverse @ step, inverse @ fixed
        q[:, :, 2] += np.einsum("bij,bj->bi", inverse, start)
        self.moves = moves
        if self.moves:
            p = q[:, :, 2]
            self.c = np.einsum("bi,bi->b", p, p) - 1
            self.b, a = np.einsum("bi,bij->jb", p, w), np.einsum("bij,bik->jkb", w, w)
            self.reach = _six(self.b[:, None] * self.b[None] - self.c * a)
        else:
            d = w[:, :, 2]
            self.a = np.einsum("bi,bi->b", d, d)
            self.b, c = np.einsum("bi,bij->jb", d, q), np.einsum("bij,bik->jkb", q, q)
            c[2, 2] -= 1
            self.reach = _six(self.b[:, None] * self.b[None] - self.a * c)

    def ends(self, k, x, y):
        """(2, p) the roots t, the lesser first, of balls k (p,) at x, y (p,); nan where the line misses the ball."""
        q = self.reach.take(k, axis=1)
        reach = q[0] + x * (q[1] + x * q[3]) + y * (q[2] + x * q[4] + y * q[5])
        out = np.full((2, len(k)), np.nan)
        some = np.flatnonzero(reach > 0)
        k, x, y, root = k[some], x[some], y[some], np.sqrt(reach[some])
        b = self.b.take(k, axis=1)
        b = b[0] * x + b[1] * y + b[2]
        if not self.moves:
            a = self.a.take(k)
            out[:, some] = (-b - root) / a, (root - b) / a
            return out
        # t^2 a + 2 t b + c = 0 by the root that does not cancel
        c, s = self.c.take(k), -(b + np.where(b >= 0, root, -root))
        a = (b * b - root * root) / np.where(c == 0, 1e-300, c)
        one, two = s / np.where(a == 0, 1e-300, a), c / np.where(s == 0, 1e-300, s)
        out[:, some] = np.minimum(one, two), np.maximum(one, two)
        return out


def _six(matrix):
    """Symmetric (3, 3, b) of (x, y, 1) -> (6, b): 1, x, y, x^2, x y, y^2"""
    m = matrix
    return np.stack([m[2, 2], 2 * m[0, 2], 2 * m[1, 2], m[0, 0], 2 * m[0, 1], m[1, 1]])
