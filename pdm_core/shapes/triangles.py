"""Points of triangles, by their barycentric coordinates."""

import numpy as np

INNER = 2e-3  # least barycentric coordinate of points on triangles that receive light


def barycentric(points, corners):
    """Coordinates (n, 3) of points (n, 3) in the planes of triangles (n, 3, 3)."""
    u, v, d = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    uu, uv, vv, du, dv = (np.einsum("ni,ni->n", *pair) for pair in ((u, u), (u, v), (v, v), (d, u), (d, v)))
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
    return np.stack([1 - s - t, s, t], axis=1)


def inner(bary):
    """Barycentric coordinates (n, 3) moved into their triangles."""
    bary = np.maximum(bary, INNER)
    return bary / bary.sum(axis=1, keepdims=True)
