"""A cell of 3 x 3 nodes: its basis, its edges, its children: four, or two along either axis."""

import numpy as np


def basis(t):
    """t (...) -> (..., 3): the quadratics through nodes 0, 1/2, 1."""
    return np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)


def basis2(uv):
    """uv (..., 2) -> (..., 9): the biquadratics of a cell, node 3 * a + b at (a/2, b/2)."""
    a, b = basis(uv[..., 0]), basis(uv[..., 1])
    return (a[..., :, None] * b[..., None, :]).reshape(*uv.shape[:-1], 9)


STEPS = np.array([(a, b) for a in range(3) for b in range(3)])  # a cell's nodes in half cell widths
# roles of children: of the four of a cell halved both ways, of the two of one halved along the first axis, the second
CHILDREN = np.array([(0, 0), (0, 1), (1, 0), (1, 1), (0, 0), (1, 0), (0, 0), (0, 1)])  # which half, along both axes
HALVED = np.array([(1, 1)] * 4 + [(1, 0)] * 2 + [(0, 1)] * 2)  # along which axes their parents were
CHILD_OF_PARENT = basis2(CHILDREN[:, None] / 2 + STEPS / (2 << HALVED)[:, None])  # (8, 9, 9) their nodes from these'
FIRST_ROLE = np.array([-1, 4, 6, 0])  # of the children of cells halved along the first axis, the second, both
BILINEAR = np.array([[(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b] for a, b in STEPS / 2])  # from corners
EDGES = np.array([(0, 1, 2), (6, 7, 8), (0, 3, 6), (2, 5, 8)])  # a cell's edges as nodes
EDGE_AXES = np.array([1, 1, 0, 0])  # that they run along
QUARTERS = np.array([(3, 6, -1), (-1, 6, 3)]) / 8  # the quadratic at 1/4 and 3/4 of an edge
