"""Visibility by samples, where shapes cross each other: what rays meet first, and segments against shapes."""

import numpy as np

from .at_once import AT_ONCE, parts, slices
from .closed_forms import across, cross, divide, dot, transform
from .names import names_of
from .shapes.shape import square_lattice
from .tolerances import TINY, TOUCHING

RAYS = 2048  # of a point
NOISE = 0.01  # what they may be off by, of the root of a factor
SMALL, SAMPLES = 0.1, 1024  # factor of a source below which so many points spread over it tell more


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


def sampled_factors(met, table, x, n, source, corners, sky, occluders, free):
    """What points x (3, m) receive from sources where shapes cross: the share of rays that meet the source first, and
    of small sources, which few rays meet, the exact unoccluded factor free (m,) times the share that points spread over
    them see, within what the rays may be off by. Rays tell all sources of a point alike: together they sum to 1.
    """
    out = met(x, n, 2 * source + (sky and source[0] >= 0))
    small = np.flatnonzero(free < SMALL)
    for k in parts(small, AT_ONCE // SAMPLES):
        noise = NOISE * np.sqrt(free[k])
        its = None if corners is None else corners[..., k]
        seen = free[k] * _share_seen(table, x[:, k], n[:, k], source[k], its, occluders[k])
        out[k] = np.clip(seen, out[k] - noise, out[k] + noise)
    return out


class Met:
    """What rays from points meet first of the shapes of a table, kept for those asked for last: a point's sources come
    one after another."""

    def __init__(self, table):
        self.table, self.keys, self.shares = table, np.zeros(0, np.uint64), None

    def __call__(self, x, n, what):
        """Of rays from points x (3, m) with unit normals n (3, m), as many to each direction as an even sky sends from
        there, the part (m,) that meets what (m,) first: 2 k are flat shapes and balls' outer sides, 2 k + 1 inner
        sides, -2 is nothing."""
        key, first, at = np.unique(names_of(np.concatenate([x, n]).T), return_index=True, return_inverse=True)
        place = np.minimum(np.searchsorted(self.keys, key), len(self.keys) - 1)
        old = self.keys[place] == key if len(self.keys) else np.zeros(len(key), bool)
        shares = np.empty((len(key), 2 * len(self.table.bound) + 2))
        if old.any():
            shares[old] = self.shares[place[old]]
        shares[~old] = _met_first(self.table, x[:, first[~old]], n[:, first[~old]])
        self.keys, self.shares = key, shares
        return shares[at.reshape(-1), what]


def _met_first(table, x, n):
    """The parts (m, 2 shapes + 2) of all that may be met; see Met."""
    width = 2 * len(table.bound) + 2
    shares = [np.zeros((0, width))]
    for some in slices(x.shape[1], AT_ONCE // 4 // RAYS):
        what = _first_of_all(table, x[:, some], n[:, some])
        what += width * np.arange(len(what))[:, None]
        shares.append(np.bincount(what.ravel(), minlength=width * len(what)).reshape(-1, width) / RAYS)
    return np.concatenate(shares)


def _first_of_all(table, x, n):
    """What rays from points x (3, m) with unit normals n (3, m) meet first (m, RAYS), as Met numbers it."""
    e = across(n)
    frame = np.stack([e, cross(n, e), n], axis=1)
    nearest, what = np.full((x.shape[1], RAYS), np.inf), np.full((x.shape[1], RAYS), 2 * len(table.bound))
    for k, is_ball in enumerate(table.is_ball):
        p = table.inverse[..., k] @ (x - table.origin[:, k, None])
        steps = np.einsum("ij,jkm->mik", table.inverse[..., k], frame)
        if is_ball:
            within = table.within(x, n, np.full(len(what), k))
            t, number = _ball_ahead(p, steps, within), 2 * k + within[:, None]
        else:
            t, number = _flat_ahead(p, steps, table.slack[k], table.half[k]), 2 * k
        nearer = t < nearest
        np.copyto(nearest, t, where=nearer)
        np.copyto(what, number, where=nearer)
    return what


def _ball_ahead(p, steps, within):
    """How far (m, RAYS) along rays from p (3, m), steps (m, 3, 3) of the frame that _LATTICE tells directions in, the
    unit sphere is met, from within (m,) or from outside; beyond all if not."""
    form = np.einsum("mki,mkj->mij", steps, steps)
    a, b = form.reshape(-1, 9) @ _SQUARES, np.einsum("km,mki->mi", p, steps) @ _LATTICE
    reach = b * b - a * (dot(p, p) - 1)[:, None]
    root = np.sqrt(np.maximum(reach, 0.0))
    t = (np.where(within[:, None], root, -root) - b) / a
    return np.where(within[:, None] | ((reach > 0) & (b < -TOUCHING * np.sqrt(a))), np.maximum(t, 0.0), np.inf)


def _flat_ahead(p, steps, slack, half):
    """As _ball_ahead of the unit square about the origin, or half of it, for points off it by slack."""
    t = divide(-p[2][:, None], steps[:, 2] @ _LATTICE)
    a, b = (p[k][:, None] + t * (steps[:, k] @ _LATTICE) for k in (0, 1))
    beside = np.maximum(np.abs(a), np.abs(b))
    if half:
        beside = np.maximum(beside, a + b + 0.5)
    return np.where((t > 0) & (np.abs(p[2]) > slack)[:, None] & (beside <= 0.5), t, np.inf)


def _lattice():
    """Directions (3, RAYS) over the third axis, as many in each as an even glow sends from there."""
    k = np.arange(RAYS) + 0.5
    ring, turn = np.sqrt(k / RAYS), np.pi * (1 + np.sqrt(5)) * k
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), np.sqrt(1 - k / RAYS)])


_LATTICE = _lattice()
_SQUARES = (_LATTICE[:, None] * _LATTICE).reshape(9, -1)


def _share_seen(table, x, n, source, corners, occluders):
    """Share (m,) of sources that segments to points spread over them see past occluders (m, k); kernel-weighted."""
    s, t = square_lattice(SAMPLES).T[..., None]
    d, area = _cap_samples(table, x, source, s, 2 * np.pi * t) if corners is None else _flat_samples(corners, s, t)
    kernel = np.maximum(dot(n[:, None], d), 0.0) * divide(area, dot(d, d) ** 2)
    whole = kernel.sum(axis=0)
    for index in occluders.T:
        some = np.flatnonzero((index >= 0) & (index != source))
        if len(some):
            blocked = segment_blocked(table, x[:, None, some], d[..., some], index[some])
            kernel[:, some] = np.where(blocked, 0.0, kernel[:, some])
    return divide(kernel.sum(axis=0), whole)


def _flat_samples(corners, s, t):
    """Offsets (3, j, m) to samples of parallelograms and area element times cosine times |d| there."""
    o, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    # of triangles, rows of samples shrink towards the corner that is there twice
    shrink = np.where((corners[:, 2] == corners[:, 3]).all(axis=0), 1 - t, 1.0)
    d = o[:, None] + s * shrink * u[:, None] + t * v[:, None]
    return d, np.abs(dot(cross(u, v)[:, None], d)) * shrink


def _cap_samples(table, x, source, s, angle):
    """Offsets (3, j, m) to samples of the visible cap of balls and area element times cosine times |d| there."""
    ball = table.balls(x, source)
    z = ball.sin + (1 - ball.sin) * s  # cosine from the axis towards the point, in the ball's own space
    radius = np.sqrt(np.maximum(1 - z * z, 0.0))
    normal = -z * ball.axis[:, None] + radius * (np.cos(angle) * ball.u[:, None] + np.sin(angle) * ball.v[:, None])
    d = transform(table.linear[:, :, source], ball.c[:, None] + normal)
    area = transform(np.moveaxis(table.inverse[:, :, source], 0, 1), normal)  # but for a factor of each ball
    return d, np.maximum(-dot(area, d), 0.0)
