"""Form factors between whole convex polygons that nothing hides: the contour integral around both of them.

A1 F12 = 1 / (2 pi) * integral around both of ln r dr1 . dr2 (Sparrow 1963), each clipped by the other's plane. The
integral along one edge is elementary; that along the other has its singularities where the two come nearest, at known
places between which a double exponential rule (Takahasi and Mori 1974) converges whatever they are.
"""

from functools import cache

import numpy as np

from .at_once import CACHED, slices
from .closed_forms import divide, dot
from .contour import clip_edges
from .tolerances import ROUNDING

STEP, REACH = 1 / 14, 3.0  # of the double exponential rule: 85 points between two breaks, 1e-15 at any distance


@cache
def _rule():
    """Nodes (k,) in (0, 1) and weights (k,), which sum to 1."""
    t = np.arange(-round(REACH / STEP), round(REACH / STEP) + 1) * STEP
    nodes, weights = 1 / (1 + np.exp(-np.pi * np.sinh(t))), np.cosh(t) / np.cosh(np.pi / 2 * np.sinh(t)) ** 2
    return nodes, weights / weights.sum()


def polygon_exchange(a, b, normal_a, normal_b, tolerance=0.0):
    """Area times form factor (m,) between polygons a, b (m, k, 3) m, and its absolute error (m,), m^2.

    Corners are counter-clockwise seen from the sides in question, of normals (m, 3), and may be there twice.
    tolerance m: heights over the other's plane that are none.
    """
    value, error = np.zeros(len(a)), np.zeros(len(a))
    for part in slices(len(a), CACHED // 64):
        one, other, n, m = (np.ascontiguousarray(np.moveaxis(x[part], 0, -1)) for x in (a, b, normal_a, normal_b))
        one, other = np.moveaxis(one, 1, 0), np.moveaxis(other, 1, 0)
        (one, sees), (other, seen) = _before(one, other, m, tolerance), _before(other, one, n, tolerance)
        found, error[part] = _exchange(one, other)
        value[part] = np.where(sees & seen, found, 0.0)
    return value, error


def _before(corners, other, normal, tolerance):
    """Edges (p, q), (3, k + 1, m) each, of what of polygons (3, k, m) is before others, and whether anything is (m,)"""
    height = dot(normal[:, None], corners - other[:, :1])
    height = np.where(np.abs(height) > tolerance, height, 0.0)
    p, q, leave, enter = clip_edges(corners, np.roll(corners, -1, axis=1), height, np.roll(height, -1, axis=0))
    edges = np.concatenate([p, leave[:, None]], axis=1), np.concatenate([q, enter[:, None]], axis=1)
    return edges, (height > 0).any(axis=0)


def _exchange(one, other):
    """Of edges (p, q), each (3, k, m), of loops: area times form factor (m,), error (m,)."""
    reach = [np.sqrt(dot(q - p, q - p)).sum(axis=0) for p, q in (one, other)]
    away = one[0].mean(axis=1) - other[0].mean(axis=1)
    scale = np.maximum(np.sqrt(dot(away, away)), np.maximum(*reach))  # then logarithms are small
    scale = np.where(scale > 0, scale, 1.0)
    total = np.zeros(len(scale))
    for p, q in zip(*(np.moveaxis(x / scale, 1, 0) for x in one)):
        for c, d in zip(*(np.moveaxis(x / scale, 1, 0) for x in other)):
            k = np.flatnonzero(dot(q - p, d - c))  # upright or nothing: no part
            if len(k):
                total[k] += _edges(*(x.take(k, axis=1) for x in (p, q, c, d)))
    return np.maximum(total * scale**2 / (2 * np.pi), 0.0), ROUNDING * reach[0] * reach[1]


def _edges(p, q, c, d):
    """Integral of ln r dr1 . dr2 (m,) over edges p -> q and c -> d (3, m)."""
    u, v = q - p, d - c
    uu, uv, vv, cu, cv = dot(u, u), dot(u, v), dot(v, v), dot(c - p, u), dot(c - p, v)
    # where along the first edge the other's line, and either of its ends, is nearest
    crossing = divide(cu * vv - cv * uv, uu * vv - uv * uv)
    breaks = np.clip([0 * uu, crossing, divide(cu, uu), divide(cu + uv, uu), 1 + 0 * uu], 0.0, 1.0)
    breaks = np.sort(breaks, axis=0)
    nodes, weights = _rule()
    width = np.diff(breaks, axis=0)
    s = breaks[:-1] + width * nodes[:, None, None]  # (nodes, parts, m)
    length = np.sqrt(vv)
    offset = (c - p)[:, None, None] - s * u[:, None, None]
    low = dot(offset, (v / length)[:, None, None])
    foot = offset - low * (v / length)[:, None, None]
    h2 = dot(foot, foot)
    value = _primitive(low + length, h2) - _primitive(low, h2)
    return uv / length * np.einsum("k,kpm,pm->m", weights, value, width)


def _primitive(t, h2):
    """Of ln sqrt(t^2 + h^2) with respect to t."""
    h, r2 = np.sqrt(h2), t * t + h2
    return t * (np.log(np.where(r2 > 0, r2, 1.0)) / 2 - 1) + h * np.arctan2(t, h)
