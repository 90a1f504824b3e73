"""Closed forms of the inner integral: what an oriented point receives from a polygon or a sphere.

Vectors are stored component first, (3, ...), so that every numpy operation runs over contiguous memory. All
form factors are from the point: irradiance / pi for unit radiance. Lambert 1760 for the contour integral.
"""

import numpy as np

CHUNK = 4096  # pairs; some 40 arrays of this length stay in a core's second-level cache


def dot(a, b):
    """(3, ...) . (3, ...) -> (...)"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """(3, ...) x (3, ...) -> (3, ...)"""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def divide(a, b):
    """a / b, and 0 where b is 0."""
    return np.divide(a, b, out=np.zeros(np.broadcast_shapes(np.shape(a), np.shape(b))), where=b != 0)


def clip_edges(p, q, height_p, height_q):
    """The part of each edge p -> q with height >= 0, and the chord that closes a convex loop of them.

    p, q (3, k, m); heights (k, m). Returns start, end (3, k, m) (equal where nothing is left) and
    leave, enter (3, m), the points where the loop crosses height 0 (zero vectors where it does not).
    """
    up, down = (height_p < 0) & (height_q >= 0), (height_p >= 0) & (height_q < 0)
    crossing = p + divide(height_p, height_p - height_q) * (q - p)
    below = (height_p < 0) & (height_q < 0)
    start = np.where(up, crossing, p)
    end = np.where(down, crossing, np.where(below, p, q))
    leave = np.where(down, crossing, 0.0).sum(axis=1)
    enter = np.where(up, crossing, 0.0).sum(axis=1)
    return start, end, leave, enter


def _edge_sum(n, p, q):
    """Sum over edges of angle(p, q) * n . unit(p x q); n (3, m), p, q (3, k, m) -> (m,)"""
    c = cross(p, q)
    length = np.sqrt(dot(c, c))
    return (divide(np.arctan2(length, dot(p, q)), length) * dot(n[:, None], c)).sum(axis=0)


def _polygon_chunk(x, n, corners):
    p = corners - x[:, None]
    q = np.roll(p, -1, axis=1)
    height = dot(n[:, None], p)
    cut = (height < 0).any(axis=0)
    if not cut.any():
        return np.abs(_edge_sum(n, p, q)) / (2 * np.pi)
    total = np.zeros(x.shape[1])
    whole = ~cut
    total[whole] = _edge_sum(n[:, whole], p[:, :, whole], q[:, :, whole])
    cut &= (height > 0).any(axis=0)  # the rest lies below the horizon: 0
    n, p, q, height = n[:, cut], p[:, :, cut], q[:, :, cut], height[:, cut]
    start, end, leave, enter = clip_edges(p, q, height, np.roll(height, -1, axis=0))
    # the horizon arc that closes the loop turns about n itself: its contribution is the signed angle
    arc = np.arctan2(dot(n, cross(leave, enter)), dot(leave, enter))
    total[cut] = _edge_sum(n, start, end) + arc
    return np.abs(total) / (2 * np.pi)


def polygon_unoccluded(points, normals, corners):
    """points (m, 3) m, unit normals (m, 3), corners (m, k, 3) of a convex planar polygon -> (m,) form factor.

    Horizon-clipped and seen from either side (who faces whom is the caller's knowledge). Absolute error
    about 1e-15. A point on an edge itself has no limit: move it off.
    """
    x, n = np.ascontiguousarray(points.T), np.ascontiguousarray(normals.T)
    c = np.ascontiguousarray(np.transpose(corners, (2, 1, 0)))
    m = x.shape[1]
    out = np.empty(m)
    for start in range(0, m, CHUNK):
        part = slice(start, start + CHUNK)
        out[part] = _polygon_chunk(x[:, part], n[:, part], c[:, :, part])
    return out


def sphere_unoccluded(points, normals, centres, radii):
    """points, normals (m, 3), centres (m, 3), radii (m,) of round spheres seen from outside -> (m,).

    Horizon-clipped; on the sphere (H = 1) the limit of coming near. Naraghi and Chung 1982, design section 6.
    """
    d = centres - points
    distance = np.sqrt(np.einsum("ij,ij->i", d, d))
    h = np.maximum(distance / radii, 1.0)
    c = np.clip(divide(np.einsum("ij,ij->i", d, normals), distance), -1.0, 1.0)
    above, below = c * h >= 1, c * h <= -1
    out = np.where(above, c / h**2, 0.0)
    between = ~(above | below)
    h, c = h[between], c[between]
    x, s = np.sqrt((h - 1) * (h + 1)), np.sqrt((1 - c) * (1 + c))
    # sqrt(1 - y^2) from c h, not from y: a sphere that touches the horizon is then exact to rounding
    y, root = -x * c / s, np.sqrt((1 - c * h) * (1 + c * h)) / s
    angle = np.arctan2(root, y)
    out[between] = (c * angle - x * s * root) / (np.pi * h**2) + np.arctan2(s * root, x) / np.pi
    return out
