"""Points of triangles, by their barycentric coordinates."""

import numpy as np

from ..at_once import AT_ONCE, slices
from .shape import square_lattice

INNER = 2e-3  # least barycentric coordinate of points on triangles that receive light
WITHIN = 1e-3  # of a triangle's area: how far from its borders points are spread at least
MEET = 1e-7  # difference of barycentric coordinates up to which a point is next to several triangles alike


def barycentric(points, corners):
    """Coordinates (n, 3) of points (n, 3) in the planes of triangles (n, 3, 3)."""
    u, v, d = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    uu, uv, vv, du, dv = (np.einsum("ni,ni->n", *pair) for pair in ((u, u), (u, v), (v, v), (d, u), (d, v)))
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
    return np.stack([1 - s - t, s, t], axis=1)


def facets_of(corners, chart):
    """What rays meet of triangles (k, 3, 3) m, chart (k, 2, 3): see rays.facets."""
    p, q, r = np.moveaxis(corners, 1, 0)
    return p, q - p, r - p, np.ones(len(p), bool), chart


def inner(bary):
    """Barycentric coordinates (n, 3) moved into their triangles."""
    bary = np.maximum(bary, INNER)
    return bary / bary.sum(axis=1, keepdims=True)


def into_triangles(at, corners):
    """Points (n, 2) moved into the triangles (k, 3, 2) that they lie in or next to; where several meet, to the middle:
    at a corner that points inwards a single one would see along one of its edges alone."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    det = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    det = np.where(det == 0, np.inf, det)
    out = np.empty_like(at)
    for part in slices(len(at), AT_ONCE // len(a)):
        d = at[part, None] - a
        s = (d[..., 0] * v[:, 1] - d[..., 1] * v[:, 0]) / det
        t = (u[:, 0] * d[..., 1] - u[:, 1] * d[..., 0]) / det
        bary = np.stack([1 - s - t, s, t], axis=-1)
        least = bary.min(axis=-1)
        point, k = np.nonzero(least >= least.max(axis=1, keepdims=True) - MEET)
        place = np.einsum("nk,nki->ni", inner(bary[point, k]), corners[k])
        count = np.bincount(point, minlength=len(least))
        out[part] = np.stack([np.bincount(point, c, len(least)) / count for c in place.T], axis=1)
    return out


def spread_over(corners, count):
    """Points (count, 3) m spread over triangles (t, 3, 3), in their order, of a share for each by its area."""
    p, q, r = np.moveaxis(corners, 1, 0)
    areas = np.linalg.norm(np.cross(q - p, r - p) / 2, axis=1)
    ends = np.cumsum(areas)
    s, t = square_lattice(count).T
    k = np.minimum(np.searchsorted(ends, s * ends[-1], side="right"), len(ends) - 1)
    s = (s * ends[-1] - ends[k]) / areas[k] + 1
    # on no corner: what is off one along a normal may be within what meets there
    s = np.sqrt(np.clip(s, WITHIN, 1 - WITHIN))[:, None]
    return (1 - s) * p[k] + s * ((1 - t[:, None]) * q[k] + t[:, None] * r[k])


def halves(some, places):
    """An index some (k,) of places (n, 3) as two of about half as many, apart along where they are furthest so."""
    places = places[some]
    some = some[np.argsort(places[:, np.ptp(places, axis=0).argmax()], kind="stable")]
    return [some[: len(some) // 2], some[len(some) // 2 :]]
