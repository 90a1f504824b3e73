"""Quadrature rules on [0, 1] and on the unit square."""

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
