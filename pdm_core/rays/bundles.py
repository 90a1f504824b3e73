"""Bundles: rays of all receivers along one direction are parallel, so that the scene is projected along it once.

The shapes' boxes go into a grid in the plane, and each receiver tests the shapes over its own cell. Towards a point of
a lamp the same projection is perspective.
"""

import copy
from dataclasses import dataclass, fields

import numpy as np

from ..shapes.shape import PARALLEL, frames
from ..shapes.sphere import Sphere
from .grid import pairs_of, side_by_side
from .near_flats import ON
from .quadrics import Quadrics
from .sieve import worth_it

AGAINST = 64.0  # tolerances: what faces a flat shape so near lies against it
SUNK = 3.0  # tolerances: what lies further behind a face is no longer against it, but thinner than rounding tells
NOTHING, CONTACT = -1, -2  # instead of a facet


@dataclass
class Receivers:
    """points, normals (n, 3) m about the facets' centre; own (n,): of Lying.plane what is not met, or -1; start (n,)
    m: the distance from which on shapes are met, negative where those in contact are; inside (n,): whether within own
    ball, whose far side is met all the same; surface (n,): which they lie on, -1 or None in free space; faces (n, 3):
    the normals of what they lie on, 0 or None in free space; under (n,): whether something lies on them, None: nothing.
    """

    points: np.ndarray
    normals: np.ndarray
    own: np.ndarray
    start: np.ndarray
    inside: np.ndarray
    surface: np.ndarray = None
    faces: np.ndarray = None
    under: np.ndarray = None

    def __post_init__(self):
        if self.surface is None:
            self.surface = np.full(len(self), -1)
        if self.faces is None:
            self.faces = np.zeros((len(self), 3))
        if self.under is None:
            self.under = np.zeros(len(self), bool)

    def __len__(self):
        return len(self.points)

    def take(self, index):
        """Those of the index."""
        return Receivers(*(getattr(self, one.name).take(index, axis=0) for one in fields(Receivers)))

    def joined(self, other):
        """These and then the other's."""
        both = copy.copy(self)
        for name, value in vars(self).items():
            setattr(both, name, np.concatenate([value, getattr(other, name)]))
        return both


@dataclass
class Hits:
    """What rays meet: facet (n,), balls counted after facets, NOTHING, or CONTACT with what is dark to them; at (n, 2):
    (s, t) on it, of a ball its chart position; front (n,): whether they meet its front; cosine (n,) of the direction to
    the receiver's normal, negative where the ray goes against it."""

    facet: np.ndarray
    at: np.ndarray
    front: np.ndarray
    cosine: np.ndarray


def along(facets, directions, receivers):
    """Hits of rays from receivers, so many in turn along each of the unit directions (k, 3), or against it where their
    normal looks that way. The projections along all directions lie side by side."""
    planes = frames(directions)
    x, y, z = _turned(planes, receivers.points)
    if len(planes) > 1 or not worth_it(facets.count, len(x)):
        return _along(facets, directions, receivers, planes, (x, y, z))
    some = facets.sieve.along(planes[0], x, y)
    balls = np.arange(len(facets.ball_centre))
    hits = _along(facets.only(some, balls), directions, receivers, planes, (x, y, z))
    hits.facet = np.concatenate([some, facets.count + balls, [CONTACT, NOTHING]])[hits.facet]
    return hits


def _along(facets, directions, receivers, planes, places):
    """As along, in planes (k, 3, 3), where the receivers are at places (3, n)."""
    x, y, z = places
    which = np.repeat(np.arange(len(planes)), len(x) // len(planes))
    ray = directions.take(which, axis=0)
    cosine = np.einsum("ni,ni->n", receivers.normals, ray)
    sign = np.where(cosine >= 0, 1.0, -1.0)
    affine, *boxes = _affine(facets, planes)
    quadrics = _quadrics_along(facets, planes)
    boxes = [np.concatenate(both, axis=1) for both in zip(boxes, _ball_boxes(facets, planes))]
    n, m, flats = len(x), facets.count, facets.count * len(planes)
    nearest, reached, own_of = np.full(n, NOTHING), np.full(n, np.inf), facets.plane  # as receivers' own
    triangle, later = np.tile(facets.triangle, len(planes)), _later(facets, planes)
    of = np.append(np.tile(np.arange(m), len(planes)), np.tile(np.arange(m, len(own_of)), len(planes)))
    plane = np.concatenate([np.repeat(np.arange(len(planes)), k) for k in (m, len(own_of) - m)])
    for who, found in pairs_of(*side_by_side(x, y, *boxes, which, plane, len(planes))):
        depth = np.full(len(who), np.inf)
        flat = np.flatnonzero(found < flats)
        r, k = who[flat], found[flat]
        inside = _within(affine, k, x.take(r), y.take(r), triangle)
        flat, r, k = flat[inside], r[inside], k[inside]
        d = sign.take(r) * (linear(affine[2], k, x.take(r), y.take(r)) - z.take(r))
        start, k = receivers.start.take(r), of.take(k)
        met = (d > np.maximum(start, -SUNK * facets.tolerance)) & (receivers.own.take(r) != own_of.take(k))
        close = np.flatnonzero(met & (d < -start))
        met[close] = _stand_before(facets, k[close], receivers, r[close], sign.take(r[close])[:, None] * ray[r[close]])
        if later is not None:
            d += later[(sign.take(r) < 0).astype(int), found.take(flat)]
        depth[flat[met]] = d[met]
        round_ = np.flatnonzero(found >= flats)
        if len(round_):
            r, k = who[round_], found[round_]
            ends = quadrics.ends(k - flats, x.take(r), y.take(r)) - z.take(r)
            own = receivers.own.take(r) == own_of.take(of.take(k))
            depth[round_] = _first(np.where(sign.take(r) > 0, ends, -ends[::-1]), r, own, receivers)
        first = np.flatnonzero(np.diff(who, prepend=-1))
        best = np.minimum.reduceat(depth, first)
        length = np.diff(first, append=len(who))
        hit = np.flatnonzero((depth == np.repeat(best, length)) & (depth < np.inf))
        nearest[who[hit]], reached[who[hit]] = found[hit], depth[hit]
    facet = np.where(nearest >= 0, of.take(nearest), NOTHING) if len(of) else nearest
    at = np.zeros((n, 2), np.float32)
    r = np.flatnonzero((facet >= 0) & (facet < m))
    for axis in range(2):
        at[r, axis] = np.clip(linear(affine[axis], nearest[r], x.take(r), y.take(r)), 0.0, 1.0)
    hits = _described(facets, facet, at, reached, sign[:, None] * ray, cosine, receivers)
    hits.facet[receivers.under] = CONTACT
    hits.facet[_in_contact(facets, facet, reached, ray, receivers)] = CONTACT
    return hits


def _stand_before(facets, facet, receivers, r, ray):
    """(k,) Whether facets (k,), at which receivers r (k,) are, hide anything from them along ray (k, 3): those that
    face them, and of what is at a flat shape what is not behind it, as a crate's side that ends there."""
    out = np.einsum("ni,ni->n", ray, facets.normal[facet]) < 0
    if not len(r):
        return out
    faces = flat_faces(facets, receivers.take(r))
    height = np.einsum("nci,ni->nc", facets.corners(facet) - receivers.points[r, None], faces)
    return out & ((height.max(axis=1) > ON * facets.tolerance) | ~faces.any(axis=1))


def _later(facets, planes):
    """(2, k m) m: how much further facets count along the last axes of planes (k, 3, 3), and against them. Where faces
    that look opposite ways lie on each other, as those of a mesh that is flat, the one is met that faces the ray. None:
    all are met alike on both sides."""
    late = facets.late
    if (late[:, 0] == late[:, 1]).all():
        return None
    cosine = (planes[:, 2] @ facets.normal.T).ravel()
    front, back = np.tile(late, (len(planes), 1)).T * ON * facets.tolerance / np.maximum(np.abs(cosine), PARALLEL)
    return np.where(cosine < 0, (front, back), (back, front))


def _described(facets, facet, at, best, direction, cosine, receivers):
    """The Hits of the nearest facets and balls (n,), at (n, 2) of facets, at distances best (n,) m of rays along
    direction (n, 3)."""
    n, m = len(facet), facets.count
    front = np.zeros(n, bool)
    r = np.flatnonzero((facet >= 0) & (facet < m))
    front[r] = np.einsum("ni,ni->n", direction.take(r, axis=0), facets.normal.take(facet[r], axis=0)) < 0
    r = np.flatnonzero(facet >= m)
    if len(r):
        k = facet[r] - m
        ray, inverse = direction.take(r, axis=0), facets.ball_inverse.take(k, axis=0)
        place = receivers.points.take(r, axis=0) + best[r, None] * ray
        local = np.einsum("nij,nj->ni", inverse, place - facets.ball_centre.take(k, axis=0))
        at[r] = Sphere.to_chart(local)
        front[r] = np.einsum("ni,ni->n", ray, np.einsum("nji,nj->ni", inverse, local)) < 0
    return Hits(facet, at, front, cosine)


def flat_faces(facets, receivers):
    """(n, 3) Normals of the flat faces that receivers lie on; 0 of those on balls, which touch in points alone, and in
    free space."""
    own = receivers.own
    return np.where(((own >= 0) & facets.is_ball[own])[:, None], 0.0, receivers.faces)


def _in_contact(facets, nearest, reached, ray, receivers):
    """(k,) Which receivers on flat shapes meet what lies against these, or on meshes flat shapes: facets (n,), at
    distances reached (n,) m along unit directions ray (n, 3)."""
    some = np.flatnonzero((nearest >= 0) & (nearest < facets.count))
    faces, ray = receivers.faces.take(some, axis=0), ray.take(some, axis=0)
    height = reached.take(some) * np.abs(np.einsum("ni,ni->n", faces, ray))
    some = some[height < AGAINST * facets.tolerance]  # with all of those on balls, of which none lies on a flat face
    some = some[(receivers.start[some] < 0) | (facets.own[facets.shape[nearest[some]]] >= 0)]
    faces = flat_faces(facets, receivers.take(some))
    along_ = np.einsum("ni,ni->n", faces, facets.normal[nearest[some]])
    return some[1 - along_**2 < PARALLEL**2]


def _turned(planes, points):
    """x, y and z (n,) in planes (k, 3, 3) of points (n, 3), of which so many are in each plane in turn."""
    parts = points.reshape(len(planes), -1, 3)
    return np.moveaxis(planes @ np.moveaxis(parts, 1, 2), 1, 0).reshape(3, -1)


def _affine(facets, planes):
    """Of facets projected along the last axes of planes (k, 3, 3), all in one plane after the other: s, t and depth,
    each (3, k m) times (1, x, y), and boxes low, high (2, k m)."""
    o, u, v = (np.moveaxis(planes @ a.T, 1, 0).reshape(3, -1) for a in (facets.origin, facets.u, facets.v))
    det = u[0] * v[1] - u[1] * v[0]
    seen = np.abs(det) > 1e-12 * (np.abs(u).sum(axis=0) * np.abs(v).sum(axis=0))
    scale = 1 / np.where(seen, det, np.inf)
    s = np.stack([(v[0] * o[1] - v[1] * o[0]) * scale, v[1] * scale, -v[0] * scale])
    t = np.stack([(u[1] * o[0] - u[0] * o[1]) * scale, -u[1] * scale, u[0] * scale])
    depth = s * u[2] + t * v[2]
    depth[0] += o[2]
    last = np.where(np.tile(facets.triangle, len(planes)), 0.0, v[:2])
    corners = np.stack([o[:2], o[:2] + u[:2], o[:2] + v[:2], o[:2] + u[:2] + last])
    low, high = corners.min(axis=0), corners.max(axis=0)
    low[:, ~seen] = np.inf
    return (s, t, depth), low, high


def _within(affine, k, x, y, triangle):
    """(p,) indices of those of facets k (p,) that rays at x, y (p,) meet."""
    s = linear(affine[0], k, x, y)
    keep = np.flatnonzero((s >= 0) & (s <= 1))
    k, s = k.take(keep), s.take(keep)
    t = linear(affine[1], k, x.take(keep), y.take(keep))
    most = np.where(triangle.take(k), 1 - s, 1.0)
    return keep[(t >= 0) & (t <= most)]


def linear(row, k, x, y):
    """A linear function of (1, x, y) of facets k (p,): row (3, m) -> (p,)"""
    a = row.take(k, axis=1)
    return a[0] + a[1] * x + a[2] * y


def _ball_boxes(facets, planes):
    """Boxes low, high (2, k b) of balls projected along the last axes of planes (k, 3, 3)."""
    middle = np.moveaxis(planes[:, :2] @ facets.ball_centre.T, 1, 0).reshape(2, -1)
    reach = _turned_balls(planes[:, :2], facets.ball_linear.transpose(0, 2, 1))
    reach = np.sqrt((reach**2).sum(axis=1)).reshape(2, -1)
    return middle - reach, middle + reach


def _quadrics_along(facets, planes):
    """The Quadrics of all balls along the last axes of planes (k, 3, 3), of one plane after the other."""
    x, y, step = _turned_balls(planes, facets.ball_inverse)
    middle = np.einsum("bij,bj->ib", facets.ball_inverse, facets.ball_centre)[:, None]
    return Quadrics(step, (x, y, -middle), False)


def _turned_balls(planes, matrices):
    """(c, 3, k, b) Matrices (b, 3, 3) of the balls times the c axes of planes (k, c, 3)."""
    k, c, _ = planes.shape
    out = planes.reshape(-1, 3) @ matrices.transpose(2, 1, 0).reshape(3, -1)
    return out.reshape(k, c, 3, -1).transpose(1, 2, 0, 3)


def _first(ends, r, own, receivers):
    """Of both ends (2, p) m of a ball along the rays of receivers r (p,) the one met first: not what is behind them,
    nor their own ball but its far side from inside; inf where there is none."""
    near, far = ends
    start = receivers.start.take(r)
    least = np.abs(start)  # from within, the wall at hand is not met
    inside = own & receivers.inside.take(r)
    out = np.where(
        (near > start) & ~own, near, np.where((far > least) & ((near <= start) & ~own | inside), far, np.inf)
    )
    return np.where(np.isnan(out), np.inf, out)
