"""Textbook numerics: Gauss rules, a dense matrix that grows by rows, and GMRES for several right sides."""

from functools import cache

import numpy as np


@cache
def gauss_legendre(points):
    """Nodes (points,) in (0, 1) and weights (points,) that sum to 1; exact to degree 2 * points - 1."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    nodes, weights = (nodes + 1) / 2, weights / 2
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights


@cache
def gauss_square(points):
    """Tensor Gauss rule on the unit square: nodes (points**2, 2), weights (points**2,) that sum to 1."""
    nodes, weights = gauss_legendre(points)
    square = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.outer(weights, weights).ravel()
    square.flags.writeable = weights.flags.writeable = False
    return square, weights


class Rows:
    """A dense matrix grown by blocks of rows, each as wide as there were columns when it was made, never copied."""

    def __init__(self, blocks=()):
        self.blocks, self.count = list(blocks), sum(len(b) for b in blocks)

    def __len__(self):
        return self.count

    def copy(self):
        """The same rows, to be appended to apart."""
        return Rows(self.blocks)

    def append(self, block):
        self.blocks.append(block)
        self.count += len(block)

    def times(self, value, columns=None):
        """value (n columns, c) -> (n rows, c); columns: ascending, those that value stands for, if not all."""
        out = np.zeros((self.count, value.shape[1]))
        value, start = value.astype(np.float32), 0
        for block in self.blocks:
            width, part = block.shape[1], slice(start, start + len(block))
            if columns is None:
                out[part] = block @ value[:width]
            else:
                some = columns[: np.searchsorted(columns, width)]
                picked = block if len(some) == width else block[:, some]
                out[part] = picked @ value[: len(some)]
            start = part.stop
        return out


def gmres(apply, right, guess, tolerance, most):
    """Solve x - apply(x) = right for (n, c) at once, each column for itself (Saad and Schultz 1986).

    A generator with a sign of life a step; returns x, the steps taken and the greatest relative residual reached.
    """
    residual = right - guess + apply(guess)
    size = np.maximum(np.linalg.norm(right, axis=0), 1e-300)
    beta = np.linalg.norm(residual, axis=0)
    basis, columns = [residual / np.where(beta > 0, beta, 1.0)], []
    left, weights = beta, np.zeros((0, len(beta)))
    while len(columns) < most and (left > tolerance * size).any():
        v = basis[-1] - apply(basis[-1])
        column = []
        for b in basis:
            column.append(np.einsum("nc,nc->c", b, v))
            v = v - column[-1] * b
        column.append(np.linalg.norm(v, axis=0))
        columns.append(column)
        basis.append(v / np.where(column[-1] > 1e-300, column[-1], 1.0))
        weights, left = _least_squares(columns, beta)
        yield
    x = guess + sum((w * b for w, b in zip(weights, basis)), np.zeros_like(guess))
    return x, len(columns), float((left / size).max())


def _least_squares(columns, beta):
    """Minimise |beta e1 - H w| for each channel -> w (k, c), residuals (c,)"""
    k = len(columns)
    w, left = np.zeros((k, len(beta))), np.zeros(len(beta))
    for c in range(len(beta)):
        h = np.zeros((k + 1, k))
        for j, column in enumerate(columns):
            h[: j + 2, j] = [value[c] for value in column]
        right = np.zeros(k + 1)
        right[0] = beta[c]
        w[:, c] = np.linalg.lstsq(h, right, rcond=None)[0]
        left[c] = np.linalg.norm(right - h @ w[:, c])
    return w, left
