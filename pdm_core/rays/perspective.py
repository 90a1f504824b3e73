"""Whether points see others: the scene is projected from each onto a cube about it, from whichever are fewer."""

import numpy as np

from ..closed_forms import cross
from .bundles import linear
from .grid import pairs_of, side_by_side
from .quadrics import Quadrics
from .sieve import over_from, worth_it


def seen_from(facets, points, receivers, point, who, skip=-1, beyond=None):
    """(n,) Whether nothing stands between points (k, 3) m, `point` (n,) of them, and receivers who (n,); skip: a shape
    that hides nothing; beyond (n,) m: how near the points nothing does. The fewer of the two are at most as many as
    grid.batches tells."""
    out, ends = np.ones(len(who), bool), (points, receivers.points)
    clear = np.zeros(len(who)) if beyond is None else np.nan_to_num(beyond)
    which, kept = (point, who), (clear + facets.tolerance, receivers.start.take(who))
    near = int(len(receivers) < len(points))
    far = 1 - near
    target = ends[far].take(which[far], axis=0)
    first, last = (np.maximum(kept[k], facets.tolerance) for k in (near, far))
    pairs = which[near], target, first, last, receivers.own.take(who), receivers.inside.take(who)
    offset = target - ends[near].take(which[near], axis=0)
    axis = np.abs(offset).argmax(axis=1)
    face = 2 * axis + (np.take_along_axis(offset, axis[:, None], axis=1)[:, 0] > 0)
    for number in np.unique(face):
        a, positive = divmod(int(number), 2)
        plane = np.zeros((3, 3))
        plane[0, (a + 1) % 3] = plane[1, (a + 2) % 3] = 1.0
        plane[2, a] = 1.0 if positive else -1.0
        some = np.flatnonzero(face == number)
        which, *rest = (value.take(some, axis=0) for value in pairs)
        used = np.bincount(which, minlength=len(ends[near])) > 0
        centres, which = ends[near][used], (np.cumsum(used) - 1).take(which)
        out[some] = ~_Seen(facets, centres, plane, skip, which, *rest).hidden()
    return out


class _Seen:
    """Of targets (n, 3) m, each before one face of a cube about which (n,) of the centres (k, 3): plane (3, 3), its
    axes; first and last (n,) m: what hides it is further than that from the centre and from the target; own, inside
    (n,): as those of receivers."""

    def __init__(self, facets, centres, plane, skip, which, target, first, last, own, inside):
        self.own, self.inside, shape, m, k = own, inside, facets.shape, facets.count, len(centres)
        a, b, c = plane @ (target - centres.take(which, axis=0)).T
        self.x, self.y = a / c, b / c
        before = _between(facets, centres, plane, target)
        before = before[shape[before] != skip]
        flat, ball = np.split(before, [np.searchsorted(before, m)])
        if k == 1 and worth_it(len(flat), len(self.x)):
            flat = over_from(facets, plane, centres[0], flat, self.x, self.y)
        self.inverse, *boxes = _projective(facets, centres, plane, flat)
        boxes = [np.concatenate(both, axis=1) for both in zip(boxes, _ball_cones(facets, centres, plane, ball - m))]
        self.flats = len(flat) * k
        self.candidates = side_by_side(self.x, self.y, *boxes, which, k, self.flats)
        start = (centres[:, None] - facets.ball_centre[ball - m]).reshape(-1, 3)
        inverse = np.tile(facets.ball_inverse[ball - m], (k, 1, 1))
        self.quadrics = Quadrics(inverse, start, np.zeros((3, 3)), plane.T, True)
        self.triangle, self.shape, self.ball_shape = (
            np.tile(values, k) for values in (facets.triangle[flat], shape[flat], shape[ball])
        )
        length = np.sqrt(1 + self.x**2 + self.y**2)
        self.near, self.far = first / length, np.maximum(c - last / length, 1e-300)

    def hidden(self):
        """(n,)"""
        out = np.zeros(len(self.x), bool)
        for who, found in pairs_of(*self.candidates, out):
            flat = np.flatnonzero(found < self.flats)
            out[self._behind_flat(who[flat], found[flat])] = True
            round_ = np.flatnonzero(found >= self.flats)
            if len(round_):
                out[self._behind_balls(who[round_], found[round_] - self.flats)] = True
        return out

    def _behind_flat(self, r, k):
        """(h,) Those of pairs r (p,) that facets k (p,) hide."""
        xr, yr = self.x.take(r), self.y.take(r)
        w = linear(self.inverse[2], k, xr, yr)  # 1 / depth
        keep = np.flatnonzero(w * self.far.take(r) > 1)
        r, k, xr, yr, w = (value.take(keep) for value in (r, k, xr, yr, w))
        s, t = (linear(row, k, xr, yr) for row in self.inverse[:2])
        most = np.where(self.triangle.take(k), s + t, np.maximum(s, t))
        keep = np.flatnonzero((s >= 0) & (t >= 0) & (most <= w))
        r, k, w = r[keep], k[keep], w[keep]
        return r[(w * self.near.take(r) < 1) & (self.own.take(r) != self.shape.take(k))]

    def _behind_balls(self, r, k):
        """(h,) Those of pairs r (p,) that balls k (p,) hide."""
        near, far = self.quadrics.ends(k, self.x.take(r), self.y.take(r))
        least, most = self.near.take(r), self.far.take(r)
        through = ((near > least) & (near < most)) | ((far > least) & (far < most))
        # from without nothing that is ahead is behind one's own ball
        return r[through & ((self.own.take(r) != self.ball_shape.take(k)) | self.inside.take(r))]


def _between(facets, centres, plane, targets):
    """(k,) Facets and balls that may come between centres (k, 3) and targets (n, 3) m, which lie before them: plane
    (3, 3), axes of the one face of a cube about each through which they are seen."""
    first, last = centres.min(axis=0), centres.max(axis=0)
    low, high = np.minimum(targets.min(axis=0), first), np.maximum(targets.max(axis=0), last)
    least, most = facets.boxes
    axis = int(np.abs(plane[2]).argmax())
    sign = plane[2, axis]
    ahead = (most[axis] > first[axis]) if sign > 0 else (least[axis] < last[axis])
    for k in range(3):
        ahead &= (most[k] >= low[k]) & (least[k] <= high[k])
    some = np.flatnonzero(ahead)
    # within the pyramid of the face: as far aside as ahead, at most
    far = most[axis, some] - first[axis] if sign > 0 else last[axis] - least[axis, some]
    for k in ((axis + 1) % 3, (axis + 2) % 3):
        keep = (least[k, some] - last[k] <= far) & (first[k] - most[k, some] <= far)
        some, far = some[keep], far[keep]
    return some


def _projective(facets, centres, plane, some):
    """Of facets `some` (m,) seen from each of the centres (k, 3) in turn: rows (3 times (3, k m)) that take (1, x, y)
    to s / depth, t / depth, 1 / depth, and boxes low, high (2, k m) of what lies before it."""
    o = _from_all(centres, plane, facets.origin[some])
    u, v = (np.tile(plane @ a[some].T, len(centres)) for a in (facets.u, facets.v))
    uv, vo, ou = cross(u, v), cross(v, o), cross(o, u)
    det = o[0] * uv[0] + o[1] * uv[1] + o[2] * uv[2]
    size = np.sqrt((uv * uv).sum(axis=0) * (o * o).sum(axis=0))
    seen = np.abs(det) > 1e-12 * size
    scale = 1 / np.where(seen, det, np.inf)
    triangle = np.tile(facets.triangle[some], len(centres))
    corners = np.stack([o, o + u, o + u + np.where(triangle, 0.0, v), o + v], axis=1)
    least = max(min(1e-9 * np.abs(corners).max(initial=0.0), facets.tolerance), 1e-300)  # layers are further apart
    ahead = corners[2] >= least
    flat = corners[:2] / np.maximum(corners[2], least)
    low, high = np.where(ahead, flat, np.inf).min(axis=1), np.where(ahead, flat, -np.inf).max(axis=1)
    cut = np.flatnonzero(~ahead.all(axis=0) & ahead.any(axis=0))
    if len(cut):  # what reaches behind the centre ends where it is no longer before it
        one, two = corners[:, :, cut], np.roll(corners[:, :, cut], -1, axis=1)
        crossing = (one[2] < least) != (two[2] < least)
        part = np.where(crossing, least - one[2], 0.0) / np.where(crossing, two[2] - one[2], 1.0)
        edge = (one + part * (two - one))[:2] / least
        low[:, cut] = np.minimum(low[:, cut], np.where(crossing, edge, np.inf).min(axis=1))
        high[:, cut] = np.maximum(high[:, cut], np.where(crossing, edge, -np.inf).max(axis=1))
    low[:, ~seen | ~ahead.any(axis=0)] = np.inf
    order = [2, 0, 1]  # 1, x, y
    return tuple((row * scale)[order] for row in (vo, ou, uv)), low, high


def _from_all(centres, plane, points):
    """(3, k m) Points (m, 3) as seen from each of the centres (k, 3) in turn, along the plane's axes."""
    return ((plane @ points.T)[:, None] - (plane @ centres.T)[:, :, None]).reshape(3, -1)


def _ball_cones(facets, centres, plane, some):
    """Boxes low, high (2, k b) of balls `some` (b,) seen from each of the centres in turn; all, where the box about one
    is not before it."""
    middle = _from_all(centres, plane, facets.ball_centre[some])
    reach = np.linalg.norm(np.einsum("ai,bij->abj", plane, facets.ball_linear[some]), axis=2)
    reach = np.tile(reach, len(centres))
    near = middle[2] - reach[2]
    ahead = near > 0
    ends = [(middle[:2] + k * reach[:2]) for k in (-1, 1)]
    over = [end / np.where(ahead, d, 1.0) for end in ends for d in (near, middle[2] + reach[2])]
    low, high = np.minimum.reduce(over), np.maximum.reduce(over)
    low, high = np.where(ahead, low, -np.inf), np.where(ahead, high, np.inf)
    low[:, middle[2] + reach[2] <= 0] = np.inf
    return low, high
