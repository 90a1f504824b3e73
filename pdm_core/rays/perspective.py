"""Whether points see others: the scene is projected from each onto a cube about it, from whichever are fewer."""

import numpy as np

from ..closed_forms import cross
from .bundles import linear
from .grid import pairs_of, side_by_side
from .quadrics import Quadrics
from .sieve import MANY, worth_it

AXES = np.array([[1, 2, 0], [2, 0, 1], [0, 1, 2]])  # of the plane of a cube's face, the last the one it looks along


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
    offset = target - ends[near].take(which[near], axis=0)
    axis = np.abs(offset).argmax(axis=1)
    offset = np.take_along_axis(offset, AXES.take(axis, axis=0), axis=1)
    face = 2 * axis + (offset[:, 2] > 0)
    pairs = which[near], face, target, offset, first, last, receivers.own.take(who), receivers.inside.take(who)
    # of very many facets, which may be sifted for each face, one face after the other
    for one in np.unique(face) if facets.count > MANY else [face]:
        some = np.flatnonzero(face == one)
        if len(some):
            out[some] = ~_Seen(facets, ends[near], skip, *(value.take(some, axis=0) for value in pairs)).hidden()
    return out


class _Seen:
    """Of targets (n, 3) m, seen from which (n,) of the centres (k, 3) through which `face` (n,) of a cube about each, 0
    to 5: offset (n, 3) m along its plane's AXES; first and last (n,) m: what hides it is further than that from the
    centre and from the target; own, inside (n,): as those of receivers. All the planes lie side by side."""

    def __init__(self, facets, centres, skip, which, face, target, offset, first, last, own, inside):
        self.own, self.inside, shape, m, k = own, inside, facets.shape, facets.count, len(centres)
        a, b, c = offset.T
        c = np.abs(c)
        self.x, self.y = a / c, b / c
        faces, face = np.unique(face, return_inverse=True)
        before = [self._before(facets, centres, one, target, face == j) for j, one in enumerate(faces)]
        through = np.repeat(np.arange(len(faces)), [len(some) for some in before])
        before = np.concatenate(before)
        kept = shape.take(before) != skip
        before, through = before[kept], through[kept]
        round_ = before >= m
        flat = _Views(centres, faces, before[~round_], through[~round_])
        ball = _Views(centres, faces, before[round_] - m, through[round_])
        self.inverse, *boxes = _projective(facets, flat)
        boxes = [np.concatenate(both, axis=1) for both in zip(boxes, _ball_cones(facets, ball))]
        self.flats, planes = len(flat.plane), np.concatenate([flat.plane, ball.plane])
        self.candidates = side_by_side(self.x, self.y, *boxes, which * len(faces) + face, planes, k * len(faces))
        self.quadrics = _quadrics(facets, ball) if len(ball.item) else None
        self.triangle, self.own_of, self.ball_of = (
            np.tile(values, k)
            for values in (facets.triangle[flat.item], facets.plane[flat.item], facets.plane[m + ball.item])
        )
        length = np.sqrt(1 + self.x**2 + self.y**2)
        self.near, self.far = first / length, np.maximum(c - last / length, 1e-300)

    def _before(self, facets, centres, face, target, mine):
        """(h,) Facets and balls that may hide any of the targets, of which `mine` (n,) bool are seen through a face."""
        if len(centres) > 1 or not worth_it(facets.count, mine.sum()):
            return _between(facets.boxes, centres, target[mine], face)
        plane = np.eye(3)[AXES[face >> 1]]
        plane[2] *= 2 * (face & 1) - 1
        flat = facets.sieve.seen_from(centres[0], plane, self.x[mine], self.y[mine])
        balls = [box[:, facets.count :] for box in facets.boxes]
        return np.concatenate([flat, facets.count + _between(balls, centres, target[mine], face)])

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
        return r[(w * self.near.take(r) < 1) & (self.own.take(r) != self.own_of.take(k))]

    def _behind_balls(self, r, k):
        """(h,) Those of pairs r (p,) that balls k (p,) hide."""
        near, far = self.quadrics.ends(k, self.x.take(r), self.y.take(r))
        least, most = self.near.take(r), self.far.take(r)
        through = ((near > least) & (near < most)) | ((far > least) & (far < most))
        # from without nothing that is ahead is behind one's own ball
        return r[through & ((self.own.take(r) != self.ball_of.take(k)) | self.inside.take(r))]


class _Views:
    """Of facets or balls item (m,) seen from each of the centres (k, 3) in turn, through faces[through] (m,): plane (k
    m,), in which of all planes each is."""

    def __init__(self, centres, faces, item, through):
        self.centres, self.item, face = centres, item, faces.take(through)
        self.axes, self.sign = AXES.take(face >> 1, axis=0).T, 2.0 * (face & 1) - 1
        self.plane = (np.arange(len(centres))[:, None] * len(faces) + through).ravel()

    def turned(self, vectors):
        """(3, m) Of vectors (n, 3) those of the items, along the axes of their planes."""
        out = vectors.ravel().take(3 * self.item + self.axes)
        out[2] *= self.sign
        return out

    def from_all(self, points):
        """(3, k m) The items' points, of (n, 3), from all centres."""
        out = self.turned(points)[:, None] - self._centres
        return out.reshape(3, -1)

    def for_all(self, vectors):
        """(3, k m) The items' vectors, of (n, 3), for all centres."""
        return np.tile(self.turned(vectors), len(self.centres))

    @property
    def _centres(self):
        out = np.moveaxis(self.centres.take(self.axes, axis=1), 1, 0).copy()
        out[2] *= self.sign
        return out


def _between(boxes, centres, targets, face):
    """(k,) What may come between centres (k, 3) and targets (n, 3) m, which are seen through this face of the cubes
    about these, by its boxes: low, high (3, m)."""
    first, last = centres.min(axis=0), centres.max(axis=0)
    low, high = np.minimum(targets.min(axis=0), first), np.maximum(targets.max(axis=0), last)
    least, most = boxes
    axis, positive = divmod(int(face), 2)
    ahead = (most[axis] > first[axis]) if positive else (least[axis] < last[axis])
    for k in range(3):
        ahead &= (most[k] >= low[k]) & (least[k] <= high[k])
    some = np.flatnonzero(ahead)
    # within the pyramid of the face: as far aside as ahead, at most
    far = most[axis, some] - first[axis] if positive else last[axis] - least[axis, some]
    for k in AXES[axis, :2]:
        keep = (least[k, some] - last[k] <= far) & (first[k] - most[k, some] <= far)
        some, far = some[keep], far[keep]
    return some


def _projective(facets, views):
    """Of the facets of _Views: rows (3 times (3, k m)) that take (1, x, y) to s / depth, t / depth, 1 / depth, and
    boxes low, high (2, k m) of what lies before the centres."""
    o, u, v = views.from_all(facets.origin), views.for_all(facets.u), views.for_all(facets.v)
    uv, vo, ou = cross(u, v), cross(v, o), cross(o, u)
    det = o[0] * uv[0] + o[1] * uv[1] + o[2] * uv[2]
    size = np.sqrt((uv * uv).sum(axis=0) * (o * o).sum(axis=0))
    seen = np.abs(det) > 1e-12 * size
    scale = 1 / np.where(seen, det, np.inf)
    triangle = np.tile(facets.triangle[views.item], len(views.centres))
    corners = np.stack([o, o + u, o + u + np.where(triangle, 0.0, v), o + v], axis=1)
    least = max(min(1e-9 * np.abs(corners).max(initial=0.0), facets.tolerance), 1e-300)
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


def _ball_cones(facets, views):
    """Boxes low, high (2, k b) of the balls of _Views; all, where the box about one is not before the centre."""
    middle, reach = views.from_all(facets.ball_centre), np.abs(views.for_all(facets.ball_reach))
    near = middle[2] - reach[2]
    ahead = near > 0
    ends = [(middle[:2] + k * reach[:2]) for k in (-1, 1)]
    over = [end / np.where(ahead, d, 1.0) for end in ends for d in (near, middle[2] + reach[2])]
    low, high = np.minimum.reduce(over), np.maximum.reduce(over)
    low, high = np.where(ahead, low, -np.inf), np.where(ahead, high, np.inf)
    low[:, middle[2] + reach[2] <= 0] = np.inf
    return low, high


def _quadrics(facets, views):
    """The Quadrics of the balls of _Views."""
    inverse = facets.ball_inverse.take(views.item, axis=0)
    step = np.take_along_axis(inverse, views.axes.T[:, None], axis=2).transpose(2, 1, 0)[:, :, None].copy()
    step[2] *= views.sign
    middle = views.from_all(facets.ball_centre).reshape(3, len(views.centres), -1)
    return Quadrics(-sum(a * b for a, b in zip(step, middle)), step, True)
