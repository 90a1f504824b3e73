"""GMRES for several right sides at once, without restarts."""

import numpy as np


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
