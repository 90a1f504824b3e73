"""Where surfaces of triangles end: what is read off there keeps away from what may touch them."""

import numpy as np

FOLDED = 0.1  # of what a corner moves along one border alone: where borders nearly meet it moves no more than it can


def ways_in(names, points, normals):
    """names (t, 3) of the places of triangles' corners, points (t, 3, 3) m, unit normals (t, 3) -> names (k,), sorted,
    of corners on borders, edges of one triangle alone, and vectors (k, 3): along each a point of such a corner gets as
    far from all borders there as the vector's factor."""
    edges = names ^ np.roll(names, -1, axis=1)
    _, which, count = np.unique(edges, return_inverse=True, return_counts=True)
    triangle, k = np.nonzero((count == 1)[which].reshape(edges.shape))
    next_ = (k + 1) % 3
    inward = np.cross(normals[triangle], points[triangle, next_] - points[triangle, k])
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-300)
    ends = np.concatenate([names[triangle, k], names[triangle, next_]])
    name, which = np.unique(ends, return_inverse=True)
    number, way = np.bincount(which), np.zeros((len(name), 3))
    np.add.at(way, which.reshape(-1), np.concatenate([inward, inward]))
    square = np.maximum((way**2).sum(axis=1), FOLDED * number**2)
    return name, way * (number / square)[:, None]
