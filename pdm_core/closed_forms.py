"""Closed forms: what an oriented point receives from a sphere or a disc.

Vectors are stored component first, (3, ...), so that every numpy operation runs over contiguous memory. Form
factors of points are irradiance / pi for unit radiance.
"""

import numpy as np

from .numerics import gauss_legendre

ROUND, ROUND_POINTS = 0.1, 32  # a circle seen from so near its axis: Gauss points that integrate it to rounding


def dot(a, b):
    """(3, ...) . (3, ...) -> (...)"""
    return np.einsum("i...,i...->...", a, b)


def cross(a, b):
    """(3, ...) x (3, ...) -> (3, ...)"""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def transform(matrix, v):
    """matrix (3, 3, m) applied to (3, ..., m)."""
    return np.einsum("ijm,j...m->i...m", matrix, v)


def divide(a, b):
    """a / b, and 0 where b is 0."""
    return a / np.where(b == 0, np.inf, b)


def across(n):
    """A unit vector (3, m) across each n (3, m); zero vectors stay zero."""
    seed = np.zeros_like(n)
    seed[np.argmin(np.abs(n), axis=0), np.arange(n.shape[1])] = 1.0
    e = cross(seed, n)
    return divide(e, np.sqrt(dot(e, e)))


def ways(points, places):
    """(3, k, n) m from points (n, 3) m to places (k, 3) m."""
    return places.T.copy()[:, :, None] - points.T.copy()[:, None]


def kernel(way, normal, normals, side=1.0):
    """(k, n) cosines over square distance, of sample places with normals (k, 3) or None, that are ways (3, k, n) m from
    points with normals (n, 3); side (n,): -1 where the points see the places' other sides."""
    square = np.maximum(dot(way, way), 1e-150)  # its own square is above 0
    out = np.maximum(dot(way, normals.T.copy()[:, None]), 0.0)
    if normal is None:
        return out / square**1.5
    out *= np.maximum(dot(way, normal.T[:, :, None]) * -side, 0.0)
    return out / square**2


def disc_kernel(place, normal, area, points, normals):
    """(n, k) Irradiance / pi of points (n, 3), normals (n, 3), from discs of areas (k,) m^2 at places (k, 3), normals
    (k, 3), of radiance 1 and 1 m^2 each: what is nearer than a disc is wide gets no more than from it. All about one
    middle, as it goes by products of matrices."""
    square = (points**2).sum(axis=1)[:, None] + (place**2).sum(axis=1) - 2 * points @ place.T
    square = np.maximum(square, 0.0)
    out = np.maximum(normals @ place.T - (points * normals).sum(axis=1)[:, None], 0.0)
    out *= np.maximum(points @ normal.T - (place * normal).sum(axis=1), 0.0)
    return out / np.maximum(square * (np.pi * square + area), 1e-300)


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


def disc_unoccluded(points, normals, centre, a, b):
    """What points (m, 3) m, unit normals (m, 3), receive from a disc about centre (3,) m -> (m,) form factor,
    horizon-clipped; a, b (3,) m are radii of it at a right angle, the points on its side a x b. Absolute error 1e-12.
    """
    n = np.ascontiguousarray(np.asarray(normals, float).T)
    # the outline is k0 + k1 cos f + k2 sin f, above the horizon within `half` of `middle`
    k0, k1, k2 = np.ascontiguousarray((centre - np.asarray(points, float)).T), b[:, None], a[:, None]
    height, along, across_ = dot(n, k0), dot(n, k1 + 0 * k0), dot(n, k2 + 0 * k0)
    half = np.arctan2(np.sqrt(np.maximum(along**2 + across_**2 - height**2, 0.0)), -height)
    middle = np.arctan2(across_, along)
    total = _circle_integral(n, k0, k1, k2, middle - half, middle + half)
    # the way back along the horizon is the angle about n between the ends, up to whole turns
    e = across(n)
    f = np.stack([middle - half, middle + half])
    r = k0[:, None] + k1[:, None] * np.cos(f) + k2[:, None] * np.sin(f)
    start, end = np.arctan2(dot(cross(n, e)[:, None], r), dot(e[:, None], r))
    share = np.mod((total + np.where((half > 0) & (half < np.pi), start - end, 0.0)) / (2 * np.pi), 1.0)
    return np.where(share > 1 - 1e-12, 0.0, share)


def _circle_integral(n, k0, k1, k2, f0, f1):
    """n . integral of r x dr / |r|^2 over r = k0 + k1 cos f + k2 sin f, |k1| = |k2| and square, f0 to f1 (m,)."""
    p, q, s = dot(n, cross(k1 + 0 * k0, k2 + 0 * k0)), dot(n, cross(k0, k2 + 0 * k0)), -dot(n, cross(k0, k1 + 0 * k0))
    a, b, c = dot(k0, k0) + dot(k1, k1), 2 * dot(k0, k1), 2 * dot(k0, k2)
    d, turn = np.hypot(b, c), np.arctan2(c, b)
    q, s = q * np.cos(turn) + s * np.sin(turn), s * np.cos(turn) - q * np.sin(turn)
    # (p + q cos g + s sin g) / (a + d cos g)
    root = np.sqrt(np.maximum((a - d) * (a + d), 0.0))
    narrow = np.sqrt(np.maximum(a - d, 0.0) / (a + d))

    def slow(g):
        """Integral of dg / (a + d cos g), times root."""
        turns = np.round(g / (2 * np.pi))
        h = (g - 2 * np.pi * turns) / 2
        return 2 * (np.arctan2(narrow * np.sin(h), np.cos(h)) + np.pi * turns)

    g0, g1 = f0 - turn, f1 - turn
    time = slow(g1) - slow(g0)
    even = divide(g1 - g0 - divide(a, root) * time, d)
    lowest, highest = a + d * np.cos(g0), a + d * np.cos(g1)
    odd = -divide(np.log(divide(highest, lowest) + (lowest == 0)), d)
    smooth = d < ROUND * a  # the differences above would cancel
    if smooth.any():
        nodes, weights = gauss_legendre(ROUND_POINTS)
        g = g0[..., None] + (g1 - g0)[..., None] * nodes
        weights = weights * (g1 - g0)[..., None] / (a[:, None] + d[:, None] * np.cos(g))
        even = np.where(smooth, (np.cos(g) * weights).sum(axis=-1), even)
        odd = np.where(smooth, (np.sin(g) * weights).sum(axis=-1), odd)
    return p * divide(time, root) + q * even + s * odd
