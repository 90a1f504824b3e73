"""Textbook numerics: Gauss rules, a matrix that grows by blocks of rows, and GMRES for several right sides."""

from dataclasses import dataclass
from functools import cache

import numpy as np

STEPS = 60  # of the solver at most
SOLVED = 0.02  # relative residual of a linear system, of the relative error aimed at
ROUGHLY = 0.05  # the same of an error that is solved for in its turn; where bodies are closed and white the rest counts


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


@dataclass
class Block:
    """Rows (k,) of a matrix over the columns (c,) that they use, ascending by what they belong to: values (k, c)."""

    rows: np.ndarray
    columns: np.ndarray
    values: np.ndarray


class Rows:
    """A matrix of few columns a row, as dense blocks of rows that use much the same ones; grown, never copied."""

    def __init__(self, blocks=(), count=0, dropped=()):
        self.blocks, self.count, self.dropped = list(blocks), count, np.array(dropped, int)

    def grown(self, blocks, count):
        """With more blocks, and `count` rows in all; rows in no block are zero."""
        return Rows([*self.blocks, *blocks], count)

    def without(self, rows):
        """With these rows (k,) in no block, to be made anew."""
        gone = np.zeros(self.count, bool)
        gone[rows] = True
        kept = [(block, ~gone[block.rows]) for block in self.blocks]
        blocks = [
            block if keep.all() else Block(block.rows[keep], block.columns, block.values[keep])
            for block, keep in kept
            if keep.any()
        ]
        return Rows(blocks, self.count, np.union1d(self.dropped, rows))

    def missing(self, count):
        """(k,) Which of so many rows are to be made."""
        return np.concatenate([self.dropped, np.arange(self.count, count)])

    @property
    def bytes(self):
        return sum(block.values.nbytes for block in self.blocks)

    def times(self, value):
        """value (n columns, c) -> (n rows, c)"""
        out, (value, scale) = np.zeros((self.count, value.shape[1])), _single(value)
        for block in self.blocks:
            out[block.rows] = block.values @ value.take(block.columns, axis=0)
        return out * scale

    def times_transposed(self, value, columns):
        """value (n rows, c) -> (columns, c): the transposed matrix, of so many columns, times it"""
        out, (value, scale) = np.zeros((columns, value.shape[1])), _single(value)
        for block in self.blocks:
            out[block.columns] += block.values.T @ value.take(block.rows, axis=0)
        return out * scale

    def times_by_part(self, value, part, count):
        """value (n columns, c), split by the part (n columns,) that columns belong to -> (n rows, count, c).

        A generator with a sign of life a block.
        """
        out, (value, scale) = np.zeros((self.count, count, value.shape[1])), _single(value)
        for block in self.blocks:
            own = part[block.columns]
            start = np.flatnonzero(np.diff(own, prepend=-1))
            for k, low, high in zip(own[start], start, np.append(start[1:], len(own))):
                out[block.rows, k] = block.values[:, low:high] @ value[block.columns[low:high]]
            yield
        return out * scale


def _single(value):
    """value (n, c) in single precision, and what its columns are divided by, (c,), lest that round them away"""
    size = np.abs(value).max(axis=0, initial=0)
    scale = np.where(size > 0, size, 1.0)
    return (value / scale).astype(np.float32), scale


def gmres(apply, right, guess, tolerance):
    """Solve x - apply(x) = right for (n, c) at once, each column for itself (Saad and Schultz 1986).

    A generator with a sign of life a step; returns x and the steps taken.
    """
    residual = right - guess + apply(guess) if guess.any() else right
    yield
    size = np.maximum(np.linalg.norm(right, axis=0), 1e-300)
    beta = np.linalg.norm(residual, axis=0)
    basis, columns = [residual / np.where(beta > 0, beta, 1.0)], []
    left, weights = beta, np.zeros((0, len(beta)))
    while len(columns) < STEPS and (left > tolerance * size).any():
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
    return x, len(columns)


def _least_squares(columns, beta):
    """Minimise |beta e1 - H w| for each channel -> w (k, c), residuals (c,)"""
    k = len(columns)
    h, right = np.zeros((len(beta), k + 1, k)), np.zeros((len(beta), k + 1))
    for j, column in enumerate(columns):
        h[:, : j + 2, j] = np.transpose(column)
    right[:, 0] = beta
    w = np.einsum("cjk,ck->cj", np.linalg.pinv(h), right)
    return w.T, np.linalg.norm(right - np.einsum("cjk,ck->cj", h, w), axis=1)
