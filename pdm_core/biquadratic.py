"""A cell of 3 x 3 nodes: its basis, its edges, its four children."""

import numpy as np


def basis(t):
    """t (...) -> (..., 3): the quadratics through nodes 0, 1/2, 1."""
    return np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)


def basis2(uv):
    """uv (..., 2) -> (..., 9): the biquadratics of a cell, node 3 * a + b at (a/2, b/2)."""
    a, b = basis(uv[..., 0]), basis(uv[..., 1])
    return (a[..., :, None] * b[..., None, :]).reshape(*uv.shape[:-1], 9)


STEPS = np.array([(a, b) for a in range(3) for b in range(3)])  # a cell's nodes in half cell widths
CHILDREN = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])  # the four children
CHILD_OF_PARENT = basis2((CHILDREN[:, None] + STEPS / 2) / 2)  # (4, 9, 9) child's nodes from its parent's
BILINEAR = np.array([[(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b] for a, b in STEPS / 2])  # from corners
EDGES = np.array([(0, 1, 2), (6, 7, 8), (0, 3, 6), (2, 5, 8)])  # a cell's edges as nodes
QUARTERS = np.array([(3, 6, -1), (-1, 6, 3)]) / 8  # the quadratic at 1/4 and 3/4 of an edge
