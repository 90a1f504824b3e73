"""Visibility by samples, where shapes cross each other: segments against shapes, and points of what is left of them."""

import numpy as np

from .closed_forms import cross, divide, dot, transform
from .numerics import gauss_legendre
from .regions import sky_source
from .tolerances import TINY, TOUCHING

SAMPLES = 24  # Gauss points a direction of the sampled fallback


def segment_blocked(table, x, d, shape):
    """Whether the open segment x + t d, 0 < t < 1, meets the shape; x, d (3, ..., m), shape (m,) -> (..., m)"""
    blocked = np.zeros(d.shape[1:], bool)
    for meets, index in zip((_meets_ball, _meets_flat), table.by_kind(shape)):
        if len(index):
            inverse = table.inverse[:, :, shape[index]]
            origin = table.origin[:, shape[index]].reshape(3, *(1,) * (x.ndim - 2), -1)
            blocked[..., index] = meets(
                transform(inverse, x[..., index] - origin),
                transform(inverse, d[..., index]),
                table.slack[shape[index]],
                table.half[shape[index]],
            )
    return blocked


def _meets_ball(p, d, slack, half):
    """Whether segments p + t d go through the unit sphere, into it or out of it."""
    a, b, c = dot(d, d), dot(p, d), dot(p, p) - 1
    reach = b * b - a * c
    root = np.sqrt(np.maximum(reach, 0.0))
    ends = (-b - root, root - b)
    through = [(t > TOUCHING * a) & (t < (1 - TOUCHING) * a) for t in ends]
    return (reach > 0) & (through[0] | through[1])


def _meets_flat(p, d, slack, half):
    """Whether segments p + t d meet the unit square about the origin, or half (m,) of it with s + t < 1, their ends off
    it by slack."""
    t = divide(-p[2], d[2])
    a, b = p[0] + t * d[0], p[1] + t * d[1]
    beside = np.maximum(np.abs(a), np.abs(b))
    if half.any():  # what goes through the seam of two triangles meets both
        beside = np.where(half, np.maximum(beside, a + b + 0.5) - TINY, beside)
    end = p[2] + d[2]
    return (p[2] * end < 0) & (np.minimum(np.abs(p[2]), np.abs(end)) > slack) & (beside <= 0.5)


def sampled_factors(table, x, n, source, corners, sky, occluders, free):
    """The fallback: the exact unoccluded factors free (m,) times the share that a Gauss rule with segment tests sees.

    The share is at most 1 however peaked the kernel is (near contact), so that a row cannot gain light.
    """
    nodes, weights = gauss_legendre(SAMPLES)
    s, t = (a.reshape(-1, 1) for a in np.meshgrid(nodes, nodes, indexing="ij"))
    weight = np.outer(weights, weights).reshape(-1, 1)
    m = x.shape[1]
    around = np.full(m, -1)
    if corners is not None:
        around = _ball_around(table, x, occluders)
        d, area = _flat_samples(table, x, corners, around, s, t, weight)
    elif sky:
        frame = sky_source(n)
        e, f = frame.p[:, 0], cross(n, frame.p[:, 0])
        radius, angle = np.sqrt(s), 2 * np.pi * t
        d = radius * np.cos(angle) * e[:, None] + radius * np.sin(angle) * f[:, None] + np.sqrt(1 - s) * n[:, None]
        area = np.pi * weight
    else:
        d, area = _cap_samples(table, x, source, s, 2 * np.pi * t, weight)
    dd = dot(d, d)
    cosine = np.maximum(dot(n[:, None], d), 0.0)
    kernel = np.broadcast_to(area, dd.shape).copy() if sky else cosine * divide(area, dd**2)
    if sky:
        d = d * _dome_distance(table, x, d, source)
    whole = kernel.sum(axis=0)
    for index in occluders.T:
        valid = (index >= 0) & (index != source)
        if valid.any():
            blocked = segment_blocked(table, np.broadcast_to(x[:, None], d.shape), d, _real(index))
            kernel[blocked & valid] = 0.0
    seen = kernel.sum(axis=0)
    return np.where(around < 0, free * divide(seen, whole), np.minimum(seen / np.pi, free))


def _ball_around(table, x, occluders):
    """(m,) A ball among occluders (m, k) that points x (3, m) are within, -1 for none."""
    around = np.full(x.shape[1], -1)
    for index in occluders.T:
        k = np.flatnonzero((index >= 0) & table.is_ball[index] & (around < 0))
        local = transform(table.inverse.take(index[k], axis=2), x[:, k] - table.origin.take(index[k], axis=1))
        k = k[dot(local, local) < (1 - TOUCHING) ** 2]
        around[k] = index[k]
    return around


def _flat_samples(table, x, corners, around, s, t, weight):
    """Offsets (3, j, m) to samples of parallelograms and area element times cosine times |d| there; of those points x
    that are within a ball, around (m,) not -1, only over what its section with the plane leaves of the parallelogram.
    """
    o, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    half = (corners[:, 2] == corners[:, 3]).all(axis=0)
    s, t, weight = (np.broadcast_to(a, (len(weight), o.shape[1])).copy() for a in (s, t, weight))
    k = np.flatnonzero(around >= 0)
    if len(k):
        inverse = table.inverse.take(around[k], axis=2)
        steps = [transform(inverse, a[:, k]) for a in (u, v)]
        c = transform(inverse, o[:, k] + x[:, k] - table.origin.take(around[k], axis=1))
        s[:, k], t[:, k], part = _over_section(c, *steps, s[:, k], t[:, k])
        weight[:, k] *= part
    # of triangles, rows of samples shrink towards the corner that is there twice
    weight = np.where(half & (around < 0), (1 - t) * weight, np.where(half & (s + t > 1), 0.0, weight))
    s = np.where(half & (around < 0), s * (1 - t), s)
    d = o[:, None] + s * u[:, None] + t * v[:, None]
    return d, np.abs(dot(cross(u, v)[:, None], d)) * weight


def _over_section(c, u, v, s, t):
    """Samples s, t (j, m) of the unit square -> those over its part in the disc where the plane c + s u + t v meets the
    unit ball, and the density (j, m) that they have there; smooth up to the disc's rim."""
    uu, uv, vv, cu, cv = dot(u, u), dot(u, v), dot(v, v), dot(c, u), dot(c, v)
    det = uu * vv - uv * uv
    middle = divide(uv * cv - vv * cu, det)
    foot = c + middle * u + divide(uv * cu - uu * cv, det) * v
    reach = np.sqrt(np.maximum(1 - dot(foot, foot), 0.0) * divide(vv, det))
    low, high = (np.arcsin(np.clip(divide(end - middle, reach), -1.0, 1.0)) for end in (0.0, 1.0))
    angle = low + (high - low) * s
    s, density = middle + reach * np.sin(angle), (high - low) * reach * np.cos(angle)
    half = cv + s * uv
    root = np.sqrt(np.maximum(half * half - vv * (dot(c, c) + s * (2 * cu + s * uu) - 1), 0.0))
    low, high = (np.clip((k * root - half) / vv, 0.0, 1.0) for k in (-1, 1))
    return s, low + (high - low) * t, density * (high - low)


def _dome_distance(table, x, d, source):
    """Where directions d (3, j, m) from inside meet sphere `source`; far away without one."""
    if source[0] < 0:
        return 4 * (table.bound.max() + np.abs(table.origin).max() + np.abs(x).max())
    inverse = table.inverse[:, :, source]
    p, e = transform(inverse, (x - table.origin[:, source])[:, None]), transform(inverse, d)
    a, b, c = dot(e, e), dot(p, e), dot(p, p) - 1
    return (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a


def _cap_samples(table, x, source, s, angle, weight):
    """Offsets (3, j, m) to samples of the visible cap of balls and area element times cosine times |d| there."""
    ball = table.balls(x, source)
    z = ball.sin + (1 - ball.sin) * s  # cosine from the axis towards the point, in the ball's own space
    radius = np.sqrt(np.maximum(1 - z * z, 0.0))
    normal = -z * ball.axis[:, None] + radius * (np.cos(angle) * ball.u[:, None] + np.sin(angle) * ball.v[:, None])
    linear = table.linear[:, :, source]
    d = transform(linear, ball.c[:, None] + normal)
    determinant = np.linalg.det(np.moveaxis(linear, -1, 0))
    area = determinant * transform(np.moveaxis(table.inverse[:, :, source], 0, 1), normal)
    return d, np.maximum(-dot(area, d), 0.0) * weight * 2 * np.pi * (1 - ball.sin)


def _real(index):
    """Padding replaced by some real entry of the same kind, so that it computes without special cases."""
    return np.where(index >= 0, index, index.max())
