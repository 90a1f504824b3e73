"""Bundles: rays of all receivers along one direction are parallel, so that the scene is projected along it once.

The shapes' boxes go into a grid in the plane, whose lines are quantiles of the receivers, and each receiver tests the
shapes over its own cell. Towards a point of a lamp the same projection is perspective. No tree, no traversal.
"""

from dataclasses import dataclass

import numpy as np

from ..closed_forms import cross
from ..shapes.shape import PARALLEL

PER_CELL = 2.0  # receivers
CELLS = 250  # along each axis at most: their product fits the sixteen bits that are sorted fast
TABLE = 64, 16, 4096  # entries of the table that finds shapes' cells: at least, for each line, at most
SAMPLED = 4096  # receivers whose places tell the quantiles
CANDIDATES = 1 << 15  # pairs tested at once
FAR = 1e-9  # part of its distance that a lamp's point is nearer than
OUTSIDE = 1e-9  # of a ball: what is further out than this is not within it
TOUCHING = 64.0  # tolerances: what faces a flat shape so near lies against it, layers between them included
NOTHING, CONTACT = -1, -2  # instead of a facet


@dataclass
class Receivers:
    """points, normals (n, 3) m about the facets' centre; own (n,): the shape that is not met, or -1; start (n,) m: the
    distance from which on shapes are met, negative where those in contact are; inside (n,): whether within own ball,
    whose far side is met all the same."""

    points: np.ndarray
    normals: np.ndarray
    own: np.ndarray
    start: np.ndarray
    inside: np.ndarray

    def __len__(self):
        return len(self.points)

    def take(self, index):
        """Those of the index."""
        return Receivers(*(a[index] for a in (self.points, self.normals, self.own, self.start, self.inside)))


@dataclass
class Hits:
    """What rays meet: facet (n,), balls counted after facets, NOTHING, or CONTACT with what is dark to them; at (n, 2):
    (s, t) on it, of a ball its chart position; front (n,): whether they meet its front."""

    facet: np.ndarray
    at: np.ndarray
    front: np.ndarray


def along(facets, direction, receivers):
    """Hits of rays from receivers along the unit direction, or against it where their normal looks that way."""
    e1, e2 = _frame(direction)
    plane = np.stack([e1, e2, direction])
    x, y, z = plane @ receivers.points.T
    sign = np.where(receivers.normals @ direction >= 0, 1.0, -1.0)
    affine, low, high = _affine(facets, plane)
    ball = _ball_boxes(facets, plane)
    low, high = np.concatenate([low, ball[0]], axis=1), np.concatenate([high, ball[1]], axis=1)
    quadrics = _Quadrics(facets, plane.T @ np.diag([1.0, 1.0, 0.0]), plane[2], np.zeros(3))
    n, m = len(x), facets.count
    nearest, reached, shape = np.full(n, NOTHING), np.full(n, np.inf), facets.shape
    for who, which in _pairs(x, y, low, high):
        depth = np.full(len(who), np.inf)
        flat = np.flatnonzero(which < m)
        r, k = who[flat], which[flat]
        inside = _within(affine, k, x.take(r), y.take(r), facets.triangle)
        flat, r, k = flat[inside], r[inside], k[inside]
        d = sign.take(r) * (_at(affine[2], k, x.take(r), y.take(r)) - z.take(r))
        start = receivers.start.take(r)
        met = (d > start) & (receivers.own.take(r) != shape.take(k))
        # in contact only what faces the point hides anything from it
        close = np.flatnonzero(met & (d < -start))
        ray = sign.take(r[close])[:, None] * direction
        met[close] = np.einsum("ni,ni->n", ray, facets.normal.take(k[close], axis=0)) < 0
        depth[flat[met]] = d[met]
        round_ = np.flatnonzero(which >= m)
        if len(round_):
            r, k = who[round_], which[round_]
            ends = quadrics.ends(k - m, x.take(r), y.take(r)) - z.take(r)
            own = receivers.own.take(r) == shape.take(k)
            depth[round_] = _first(np.sort(sign.take(r) * ends, axis=0), r, own, receivers)
        first = np.flatnonzero(np.diff(who, prepend=-1))
        best = np.minimum.reduceat(depth, first)
        length = np.diff(first, append=len(who))
        hit = np.flatnonzero((depth == np.repeat(best, length)) & (depth < np.inf))
        nearest[who[hit]], reached[who[hit]] = which[hit], depth[hit]
    hits = _described(facets, nearest, reached, affine, x, y, sign[:, None] * direction, receivers)
    hits.facet[_in_contact(facets, nearest, reached * np.abs(receivers.normals @ direction), receivers)] = CONTACT
    return hits


def _in_contact(facets, nearest, height, receivers):
    """(k,) Which receivers on flat shapes meet what lies against these: facets (n,), at heights (n,) m."""
    some = np.flatnonzero((receivers.start < 0) & (height < TOUCHING * facets.tolerance) & (nearest < facets.count))
    along_ = np.einsum("ni,ni->n", receivers.normals[some], facets.normal[nearest[some]])
    return some[1 - along_**2 < PARALLEL**2]


def _described(facets, nearest, best, affine, x, y, direction, receivers):
    """The Hits of the nearest facets and balls (n,), at distances best (n,) m of rays along direction (n, 3)."""
    n, m = len(nearest), facets.count
    at, front = np.zeros((n, 2), np.float32), np.zeros(n, bool)
    r = np.flatnonzero((nearest >= 0) & (nearest < m))
    k = nearest[r]
    for axis in range(2):
        at[r, axis] = np.clip(_at(affine[axis], k, x.take(r), y.take(r)), 0.0, 1.0)
    front[r] = np.einsum("ni,ni->n", direction.take(r, axis=0), facets.normal.take(k, axis=0)) < 0
    r = np.flatnonzero(nearest >= m)
    if len(r):
        k = nearest[r] - m
        place = receivers.points[r] + best[r, None] * direction[r]
        local = np.einsum("nij,nj->ni", facets.ball_inverse[k], place - facets.ball_centre[k])
        at[r] = ball_chart(local)
        out = np.einsum("nji,nj->ni", facets.ball_inverse[k], local)
        front[r] = np.einsum("ni,ni->n", direction[r], out) < 0
    return Hits(nearest, at, front)


def ball_chart(local):
    """Directions (n, 3) in a ball's own space -> chart positions (n, 2) in [0, 1]: turn about its axis, polar angle."""
    turn = np.arctan2(local[:, 1], local[:, 0]) / (2 * np.pi) % 1.0
    polar = np.arctan2(np.hypot(local[:, 0], local[:, 1]), local[:, 2]) / np.pi
    return np.column_stack([turn, polar])


def ball_place(at):
    """Chart positions (n, 2) -> unit directions (n, 3) in the ball's own space."""
    turn, polar = 2 * np.pi * at[:, 0], np.pi * at[:, 1]
    ring = np.sin(polar)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), np.cos(polar)])


def seen_from(facets, centre, receivers, skip=-1):
    """(n,) Whether nothing stands between receivers and a point, centre (3,) m; skip: a shape that hides nothing."""
    out = np.ones(len(receivers), bool)
    if not len(receivers):
        return out
    offset = receivers.points - centre
    size = np.abs(offset)
    axis = size.argmax(axis=1)
    positive = offset[np.arange(len(offset)), axis] > 0
    for a in range(3):
        for sign in (1.0, -1.0):
            some = np.flatnonzero((axis == a) & (positive == (sign > 0)))
            if len(some):
                plane = np.zeros((3, 3))
                plane[0, (a + 1) % 3] = plane[1, (a + 2) % 3] = 1.0
                plane[2, a] = sign
                out[some] = _seen_through(facets, centre, plane, receivers.take(some), skip)
    return out


def _seen_through(facets, centre, plane, receivers, skip):
    """As seen_from, of receivers before one face of a cube about the centre: plane (3, 3), its axes."""
    a, b, c = plane @ (receivers.points - centre).T
    x, y = a / c, b / c
    m, shape = facets.count, facets.shape
    before = _between(facets, centre, plane, receivers)
    inverse, low, high = _projective(facets, centre, plane, before)
    low[:, shape[before] == skip] = np.inf
    ball = _ball_cones(facets, centre, plane)
    ball[0][:, shape[m:] == skip] = np.inf
    low, high = np.concatenate([low, ball[0]], axis=1), np.concatenate([high, ball[1]], axis=1)
    quadrics = _Quadrics(facets, np.zeros((3, 3)), plane.T, centre)
    triangle, of, count = facets.triangle[before], np.append(before, np.arange(m, len(shape))), len(before)
    length = np.sqrt(1 + x * x + y * y)
    # what ends before the receiver by as much as it keeps from its own surface hides it; layers are further apart
    limit = 1 / np.maximum(c - np.maximum(receivers.start, facets.tolerance) / length, 1e-300)
    out = np.ones(len(x), bool)
    for who, which in _pairs(x, y, low, high):
        flat = np.flatnonzero(which < count)
        r, k = who[flat], which[flat]
        xr, yr = x.take(r), y.take(r)
        w = _at(inverse[2], k, xr, yr)
        keep = np.flatnonzero((w > limit.take(r)) & (receivers.own.take(r) != shape.take(of.take(k))))
        r, k, xr, yr, w = r[keep], k[keep], xr[keep], yr[keep], w[keep]
        s, t = (_at(row, k, xr, yr) for row in inverse[:2])
        met = (s >= 0) & (t >= 0) & (np.where(triangle.take(k), s + t, np.maximum(s, t)) <= w)
        out[r[met]] = False
        round_ = np.flatnonzero(which >= count)
        if len(round_):
            r, k = who[round_], which[round_] - count
            near, far = quadrics.ends(k, x.take(r), y.take(r))
            end = 1 / limit.take(r) * (1 - FAR)
            least = FAR * end
            through = ((near > least) & (near < end)) | ((far > least) & (far < end))
            own = receivers.own.take(r) == shape.take(k + m)
            # from within a ball all that is outside is hidden by it
            out[r[np.where(own, receivers.inside.take(r) & (quadrics.c.take(k) > OUTSIDE), through)]] = False
    return out


def _frame(direction):
    seed = np.zeros(3)
    seed[np.argmin(np.abs(direction))] = 1.0
    e1 = np.cross(seed, direction)
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(direction, e1)


def _affine(facets, plane):
    """Of facets projected along plane[2]: s, t and depth, each (3, m) times (1, x, y), and boxes low, high (2, m)."""
    o, u, v = (plane @ a.T for a in (facets.origin, facets.u, facets.v))
    det = u[0] * v[1] - u[1] * v[0]
    seen = np.abs(det) > 1e-12 * (np.abs(u).sum(axis=0) * np.abs(v).sum(axis=0))
    scale = 1 / np.where(seen, det, np.inf)
    s = np.stack([(v[0] * o[1] - v[1] * o[0]) * scale, v[1] * scale, -v[0] * scale])
    t = np.stack([(u[1] * o[0] - u[0] * o[1]) * scale, -u[1] * scale, u[0] * scale])
    depth = s * u[2] + t * v[2]
    depth[0] += o[2]
    corners = np.stack([o[:2], o[:2] + u[:2], o[:2] + v[:2], o[:2] + u[:2] + np.where(facets.triangle, 0.0, v[:2])])
    low, high = corners.min(axis=0), corners.max(axis=0)
    low[:, ~seen] = np.inf
    return (s, t, depth), low, high


def _within(affine, k, x, y, triangle):
    """(p,) indices of those of facets k (p,) that rays at x, y (p,) meet."""
    s = _at(affine[0], k, x, y)
    keep = np.flatnonzero((s >= 0) & (s <= 1))
    k, s = k.take(keep), s.take(keep)
    t = _at(affine[1], k, x.take(keep), y.take(keep))
    most = np.where(triangle.take(k), 1 - s, 1.0)
    return keep[(t >= 0) & (t <= most)]


def _at(row, k, x, y):
    """A linear function of (1, x, y) of facets k (p,): row (3, m) -> (p,)"""
    a = row.take(k, axis=1)
    return a[0] + a[1] * x + a[2] * y


def _between(facets, centre, plane, receivers):
    """(k,) Facets that may come between a point and the receivers, which lie before it: plane (3, 3), axes of the one
    face of a cube about it through which they are seen."""
    low = np.minimum(receivers.points.min(axis=0), centre)
    high = np.maximum(receivers.points.max(axis=0), centre)
    least, most = facets.boxes
    axis = int(np.abs(plane[2]).argmax())
    sign = plane[2, axis]
    ahead = (most[axis] > centre[axis]) if sign > 0 else (least[axis] < centre[axis])
    for k in range(3):
        ahead &= (most[k] >= low[k]) & (least[k] <= high[k])
    some = np.flatnonzero(ahead)
    # within the pyramid of the face: as far aside as ahead, at most
    far = most[axis, some] - centre[axis] if sign > 0 else centre[axis] - least[axis, some]
    for k in ((axis + 1) % 3, (axis + 2) % 3):
        keep = (least[k, some] - centre[k] <= far) & (centre[k] - most[k, some] <= far)
        some, far = some[keep], far[keep]
    return some


def _projective(facets, centre, plane, some):
    """Of facets `some` (k,) seen from the centre: rows (3 times (3, k)) that take (1, x, y) to s / depth, t / depth,
    1 / depth, and boxes low, high (2, k) of what lies before it."""
    o, u, v = (plane @ a.T for a in (facets.origin[some] - centre, facets.u[some], facets.v[some]))
    uv, vo, ou = cross(u, v), cross(v, o), cross(o, u)
    det = o[0] * uv[0] + o[1] * uv[1] + o[2] * uv[2]
    size = np.sqrt((uv * uv).sum(axis=0) * (o * o).sum(axis=0))
    seen = np.abs(det) > 1e-12 * size
    scale = 1 / np.where(seen, det, np.inf)
    triangle = facets.triangle[some]
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


def _ball_boxes(facets, plane):
    """Boxes low, high (2, b) of balls projected along plane[2]."""
    middle = plane[:2] @ facets.ball_centre.T
    reach = np.linalg.norm(np.einsum("ai,bij->abj", plane[:2], facets.ball_linear), axis=2)
    return middle - reach, middle + reach


def _ball_cones(facets, centre, plane):
    """Boxes low, high (2, b) of balls seen from the centre; all, where the box about one is not before it."""
    middle = plane @ (facets.ball_centre - centre).T
    reach = np.linalg.norm(np.einsum("ai,bij->abj", plane, facets.ball_linear), axis=2)
    near = middle[2] - reach[2]
    ahead = near > 0
    ends = [(middle[:2] + k * reach[:2]) for k in (-1, 1)]
    over = [end / np.where(ahead, d, 1.0) for end in ends for d in (near, middle[2] + reach[2])]
    low, high = np.minimum.reduce(over), np.maximum.reduce(over)
    low, high = np.where(ahead, low, -np.inf), np.where(ahead, high, np.inf)
    low[:, middle[2] + reach[2] <= 0] = np.inf
    return low, high


class _Quadrics:
    """Where lines meet the balls: lines of the points start + fixed @ (x, y, 1) + t step, or of those start + t step @
    (x, y, 1) where step is (3, 3).

    Both roots t of the ball's quadratic in t are known from functions of (x, y) that are worked out once a ball.
    """

    def __init__(self, facets, fixed, step, start):
        inverse = facets.ball_inverse
        w = inverse @ (step if step.ndim == 2 else np.zeros((3, 3)))
        if step.ndim == 1:
            w[:, :, 2] = inverse @ step
        q = inverse @ fixed
        q[:, :, 2] += np.einsum("bij,bj->bi", inverse, start - facets.ball_centre)
        self.moves = step.ndim == 2  # the direction, not the point, depends on (x, y)
        if self.moves:
            p = q[:, :, 2]
            self.c = np.einsum("bi,bi->b", p, p) - 1
            self.b, a = np.einsum("bi,bij->jb", p, w), np.einsum("bij,bik->jkb", w, w)
            self.reach = _six(self.b[:, None] * self.b[None] - self.c * a)
        else:
            d = w[:, :, 2]
            self.a = np.einsum("bi,bi->b", d, d)
            self.b, c = np.einsum("bi,bij->jb", d, q), np.einsum("bij,bik->jkb", q, q)
            c[2, 2] -= 1
            self.reach = _six(self.b[:, None] * self.b[None] - self.a * c)

    def ends(self, k, x, y):
        """(2, p) the roots t, the lesser first, of balls k (p,) at x, y (p,); nan where the line misses the ball."""
        q = self.reach.take(k, axis=1)
        reach = q[0] + x * (q[1] + x * q[3]) + y * (q[2] + x * q[4] + y * q[5])
        out = np.full((2, len(k)), np.nan)
        some = np.flatnonzero(reach > 0)
        k, x, y, root = k[some], x[some], y[some], np.sqrt(reach[some])
        b = self.b.take(k, axis=1)
        b = b[0] * x + b[1] * y + b[2]
        if not self.moves:
            a = self.a.take(k)
            out[:, some] = (-b - root) / a, (root - b) / a
            return out
        # t^2 a + 2 t b + c = 0 by the root that does not cancel
        c, s = self.c.take(k), -(b + np.where(b >= 0, root, -root))
        a = (b * b - root * root) / np.where(c == 0, 1e-300, c)
        one, two = s / np.where(a == 0, 1e-300, a), c / np.where(s == 0, 1e-300, s)
        out[:, some] = np.minimum(one, two), np.maximum(one, two)
        return out


def _six(matrix):
    """Symmetric (3, 3, b) of (x, y, 1) -> (6, b): 1, x, y, x^2, x y, y^2"""
    m = matrix
    return np.stack([m[2, 2], 2 * m[0, 2], 2 * m[1, 2], m[0, 0], 2 * m[0, 1], m[1, 1]])


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


def _pairs(x, y, low, high):
    """Yields (receiver, shape) (p,) index arrays, sorted by cell and receiver: shapes whose boxes low, high (2, m) may
    hold the receivers' places x, y (n,)."""
    n = len(x)
    if not n:
        return
    side = int(np.clip(np.sqrt(n / PER_CELL), 1, CELLS))
    lines = [_quantiles(a, side) for a in (x, y)]
    cell = np.searchsorted(lines[0], x, "right") * side + np.searchsorted(lines[1], y, "right")
    cell = cell.astype(np.uint16)
    order = np.argsort(cell, kind="stable")
    bounds = [(a.min(), a.max()) for a in (x, y)]
    over = (high[0] >= bounds[0][0]) & (low[0] <= bounds[0][1]) & (high[1] >= bounds[1][0]) & (low[1] <= bounds[1][1])
    shape = np.flatnonzero(over & (low <= high).all(axis=0))
    spans = [_span(line, *bound, low[k, shape], high[k, shape]) for k, (line, bound) in enumerate(zip(lines, bounds))]
    first = np.stack([span[0] for span in spans])
    wide = np.stack([span[1] for span in spans]) - first + 1
    count = wide.prod(axis=0)
    entry = np.repeat(np.arange(len(shape)), count)
    step = np.arange(len(entry)) - np.repeat(np.cumsum(count) - count, count)
    column, row = np.divmod(step, wide[1].take(entry))
    place = ((first[0].take(entry) + column) * side + first[1].take(entry) + row).astype(np.uint16)
    sorted_ = np.argsort(place, kind="stable")
    shape = shape.take(entry.take(sorted_))
    number = np.bincount(place, minlength=side * side)
    start = np.cumsum(number) - number
    own = cell.take(order)
    each = number.take(own)
    ends = np.cumsum(each)
    cuts = np.unique(np.searchsorted(ends, np.arange(0, ends[-1], CANDIDATES)))
    for a, b in zip(cuts, np.append(cuts[1:], n)):
        some = each[a:b]
        total = int(some.sum())
        if total:
            who = np.repeat(order[a:b], some)
            base = start.take(own[a:b]) - (np.cumsum(some) - some)
            yield who, shape.take(np.arange(total) + np.repeat(base, some))


def _span(lines, least, most, low, high):
    """The first and the last of the cells between lines, of places from least to most, that low..high (m,) may meet: by
    a table of evenly spaced places, not by a search for each."""
    entries = int(np.clip(TABLE[1] * len(lines), TABLE[0], TABLE[2]))
    edges = np.linspace(least, most, entries + 1)
    first, last = np.searchsorted(lines, edges[:-1], "left"), np.searchsorted(lines, edges[1:], "right")
    scale = entries / (most - least) if most > least else 0.0
    begin, end = ((np.clip(a, least, most) - least) * scale for a in (low, high))
    # a little aside, as the edges are rounded
    begin = np.clip(begin - 1e-6, 0, entries - 1).astype(np.int64)
    end = np.clip(end + 1e-6, 0, entries - 1).astype(np.int64)
    return first.take(begin), last.take(end)


def _quantiles(values, count):
    """(count - 1,) lines that part the values into about equal numbers."""
    some = np.sort(values[:: max(1, len(values) // SAMPLED)])
    return some[(np.arange(1, count) * len(some)) // count]
