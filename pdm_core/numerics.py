"""Textbook numerics: Gauss rules, a matrix that grows by blocks of rows, and GCR for several right sides."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from .tolerances import TINY

STEPS = 60  # of the solver at most
SOLVED = 0.02  # relative error of the solution of a linear system, of the relative error aimed at
ROUGHLY = 0.1  # the same of an error that is solved for in its turn


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


def gcr(apply, right, guess, tolerance):
    """Solve x - apply(x) = right for (n, c) at once, each column for itself, by least residuals, the guess among what
    they are sought in (GCR; Eisenstat, Elman and Schultz 1983).

    Until the error of x, not the residual, is below the relative tolerance: between white walls one comes to many times
    the other, at most by what the inverse is known to make of the residuals so far. A generator with a sign of life a
    step; returns x and the steps taken.
    """
    x, residual, steps = np.zeros_like(right), right, 0
    found, images, gram = [], [], np.zeros((right.shape[1], STEPS, STEPS))
    following = guess if guess.any() else right
    while True:
        image = following - apply(following)
        whole = np.linalg.norm(image, axis=0)
        for v, its in zip(found, images):
            share = np.einsum("nc,nc->c", its, image)
            image, following = image - share * its, following - share * v
        size = np.linalg.norm(image, axis=0)
        scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > TINY * whole)  # 0: this channel is done
        found.append(following * scale)
        images.append(image * scale)
        share = np.einsum("nc,nc->c", images[-1], residual)
        x, residual = x + share * found[-1], residual - share * images[-1]
        for k, v in enumerate(found):
            gram[:, k, steps] = gram[:, steps, k] = np.einsum("nc,nc->c", v, found[-1])
        steps += 1
        yield
        caught = np.sqrt(np.linalg.eigvalsh(gram[:, :steps, :steps])[:, -1])
        error = np.linalg.norm(residual, axis=0) * np.maximum(caught, 1.0)
        if steps == STEPS or (error <= tolerance * np.linalg.norm(x, axis=0)).all():
            return x, steps
        following = residual
