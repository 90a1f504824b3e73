"""What oriented points receive from sources, behind candidate occluders: pairs in, form factors out.

Each (point, source) pair brings a list of candidate occluders. Here those that cannot hide anything are dropped,
the order in depth is decided, and the rest goes to the exact contour integral in groups of like size.
"""

from collections import Counter

import numpy as np

from .closed_forms import cross, divide, dot, polygon_unoccluded, sphere_unoccluded
from .numerics import gauss_legendre
from .regions import (
    Ball,
    ball_region,
    ball_source,
    occluder_integral,
    polygon_region,
    sky_source,
    source_integral,
    transform,
)
from .scene import Sphere

# Depth, relative to the shapes' size, up to which shapes that cross count as touching and planes as flush: Blender's
# single-precision vertices are off by a tenth of it. What it costs is of the same size, and only in such places.
TOUCHING = 1e-6
IN_PLANE = 1e-9  # height over a polygon, relative to its size, at which it is seen edge-on: a point by a wall is not
BATCH = 32768  # pairs whose candidates are sifted at once
GROUP = 32768  # (pair, region) entries in one contour integral
OVERLAPS = 1 << 18  # pairs of occluders compared at once
ASCENT = 300  # steps towards a separating direction of two ellipsoids
FEW = 512  # rows worth a group of their own: below, the calls cost more than the padding
SAMPLES = 24  # Gauss points a direction of the sampled fallback


class ShapeTable:
    """The scene's shapes as arrays, component first, for gathering per pair."""

    def __init__(self, shapes):
        count = len(shapes)
        self.is_ball = np.array([isinstance(s, Sphere) for s in shapes])
        self.origin = np.array([s.bounds[0] for s in shapes]).T.copy()
        self.bound = np.array([s.bounds[1] for s in shapes])  # radius of a sphere about the origin
        self.corners = np.zeros((3, 4, count))
        self.linear, self.inverse = np.zeros((3, 3, count)), np.zeros((3, 3, count))
        self.radius = np.zeros(count)  # of round balls; 0 for ellipsoids
        for k, shape in enumerate(shapes):
            if not self.is_ball[k]:
                self.corners[:, :, k], self.inverse[:, :, k] = shape.corners.T, shape.inverse
                continue
            # the unit ball is the same under any rotation of its own space: keep the symmetric factor of the map
            u, axes, _ = np.linalg.svd(shape.linear)
            self.linear[:, :, k] = (u * axes) @ u.T
            self.inverse[:, :, k] = (u / axes) @ u.T
            self.radius[k] = axes[0] if shape.is_round else 0.0

    def ball(self, x, index):
        """Ball of the shapes index (m,) relative to points x (3, m)."""
        offset, radius = self.origin[:, index] - x, self.radius[index]
        if (radius > 0).all():
            return Ball(offset / radius, scale=1 / radius)
        inverse = self.inverse[:, :, index]
        return Ball(transform(inverse, offset), linear=self.linear[:, :, index], inverse=inverse)

    def polygon(self, x, index):
        """Corners (3, 4, m) of the shapes index (m,) relative to points x (3, m)."""
        return self.corners[:, :, index] - x[:, None]


def _closest_on_polygon(corners):
    """Point (3, m) nearest the origin on parallelograms (3, 4, m)."""
    c, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    uu, uv, vv, cu, cv = dot(u, u), dot(u, v), dot(v, v), dot(c, u), dot(c, v)
    det = uu * vv - uv * uv
    s, t = divide(uv * cv - vv * cu, det), divide(uv * cu - uu * cv, det)
    inner = (s > 0) & (s < 1) & (t > 0) & (t < 1) & (det > 0)
    edge = np.roll(corners, -1, axis=1) - corners
    near = corners + np.clip(divide(-dot(corners, edge), dot(edge, edge)), 0.0, 1.0) * edge
    best = np.take_along_axis(near, np.argmin(dot(near, near), axis=0)[None, None], axis=1)[:, 0]
    return np.where(inner, c + s * u + t * v, best)


def _order_ball_polygon(ball, corners):
    """Of a ball and a polygon (3, 4, m), both relative to the point: (ball first, polygon first, they cross), (m,).

    Disjoint convex bodies hide each other in one order only: the point's side of a separating plane tells which.
    The plane used is the one at the polygon's point nearest the ball, in the space where the ball is round.
    """
    near = _closest_on_polygon(ball.points_to_local(corners) - ball.c[:, None])
    distance2, side = dot(near, near), -dot(ball.c, near)
    cross = distance2 < (1 - TOUCHING) ** 2
    return ~cross & (side < distance2), ~cross & (side > distance2), cross


def _order_balls(table, x, occluder, source):
    """Of two balls: (the occluder first, they cross, the source inside the occluder), each (m,)."""
    d = table.origin[:, occluder] - table.origin[:, source]
    distance = np.sqrt(dot(d, d))
    ro, rs = table.radius[occluder], table.radius[source]
    do, ds = table.origin[:, occluder] - x, table.origin[:, source] - x
    # the radical plane separates disjoint round balls: the one of less power is before the other
    first = dot(do, do) - ro * ro < dot(ds, ds) - rs * rs
    within = distance + rs <= ro * (1 + TOUCHING)
    cross = (distance < (ro + rs) * (1 - TOUCHING)) & ~within & (distance + ro > rs * (1 + TOUCHING))
    odd = (ro == 0) | (rs == 0)
    if odd.any():
        pick = np.nonzero(odd)[0]
        first[pick], cross[pick], within[pick] = _order_ellipsoids(table, x[:, pick], occluder[pick], source[pick])
    return first, cross, within


def _order_ellipsoids(table, x, occluder, source):
    """As _order_balls for ellipsoids, from a separating plane of each pair of shapes."""
    pairs, back = np.unique(np.stack([occluder, source]), axis=1, return_inverse=True)
    normal, offset, gap, within = (a[..., back.ravel()] for a in _separate(table, *pairs))
    return dot(normal, x) < offset, (gap < -TOUCHING) & ~within, within


def _separate(table, a, b):
    """Planes normal . x = offset with ellipsoid a (m,) below and b above, by the relative gap (m,) between them.

    The gap w . (cb - ca) - |A^T w| - |B^T w| is concave in w; subgradient ascent with shrinking steps finds a
    direction where it is positive if there is one. Where there is none the two cross, or b lies within a.
    """
    d = table.origin[:, b] - table.origin[:, a]
    maps = table.linear[:, :, a], table.linear[:, :, b]
    size = table.bound[a] + table.bound[b]
    w = divide(d, np.sqrt(dot(d, d)))
    best, best_gap = w, np.full(len(a), -np.inf)
    for step in 1 / np.sqrt(1 + np.arange(ASCENT)):
        pulled = [transform(m, w) for m in maps]
        reach = [np.sqrt(dot(p, p)) for p in pulled]
        gap = (dot(w, d) - reach[0] - reach[1]) / size
        best, best_gap = np.where(gap > best_gap, w, best), np.maximum(gap, best_gap)
        slope = (d - sum(transform(m, divide(p, r)) for m, p, r in zip(maps, pulled, reach))) / size
        w = w + step * slope
        w = divide(w, np.sqrt(dot(w, w)))
    reach = [np.sqrt(dot(p, p)) for p in (transform(m, best) for m in maps)]
    offset = dot(best, table.origin[:, a]) + reach[0] + best_gap * size / 2
    centre = transform(table.inverse[:, :, a], d)
    product = np.moveaxis(table.inverse[:, :, a], -1, 0) @ np.moveaxis(maps[1], -1, 0)
    within = np.sqrt(dot(centre, centre)) + np.linalg.norm(product, 2, axis=(1, 2)) <= 1 + TOUCHING
    return best, offset, best_gap, within


class _Sifted:
    """Which (pair, occluder) entries matter: active, and may hide the source's boundary: near; pairs that get nothing:
    dark; pairs left to sampling: crossing."""

    def __init__(self, count, entries):
        self.active, self.near = np.zeros(entries, bool), np.ones(entries, bool)
        self.dark, self.crossing = np.zeros(count, bool), np.zeros(count, bool)


def _may_overlap(table, x, n, occluder, centre, radius):
    """(m,) False where the occluder is below the horizon or its bounding cone misses the source's."""
    d = table.origin[:, occluder] - x
    r = table.bound[occluder]
    keep = dot(n, d) > -r
    if centre is None:
        return keep
    return keep & ~_cones_apart(table, x, occluder, centre, radius)


def _cones_apart(table, x, shape, centre, radius):
    """(m,) Whether the cone around a shape's bounding sphere is apart from the one around another sphere."""
    d, r = table.origin[:, shape] - x, table.bound[shape]
    e = centre - x
    dd, ee = dot(d, d), dot(e, e)
    outside = (dd > r * r) & (ee > radius * radius)
    # angle between the axes against the sum of half angles: cos(axes) < cos(sum), everything times |d| |e|
    cosine = np.sqrt(np.maximum(dd - r * r, 0.0) * np.maximum(ee - radius * radius, 0.0)) - r * radius
    return outside & (dot(d, e) < cosine - 1e-9 * np.sqrt(dd * ee))


def over_edges(table, x, corners, pair, shape):
    """Least height of shapes (e,) over the planes through the points x (3, m) of their pair (e,) and the edges of the
    pair's polygon (3, 4, m) relative to it, in their bounding radii: below -1 the shape is beside the polygon in the
    view, above 1 no edge comes near it."""
    d, middle = table.origin[:, shape] - x[:, pair], corners[:, 0] + corners[:, 2]
    least = np.full(len(shape), np.inf)
    for k in range(4):
        side = cross(corners[:, k], corners[:, (k + 1) % 4])
        side = divide(side, np.copysign(np.sqrt(dot(side, side)), dot(side, middle)))
        least = np.minimum(least, dot(side[:, pair], d))
    return least / table.bound[shape]


def _sift(table, x, n, source, corners, pair, occluder, sky):
    """Decide every (pair, occluder) entry; x, n, corners and source are per pair, pair and occluder per entry."""
    sifted = _Sifted(x.shape[1], len(pair))
    if corners is not None:
        centre = (corners[:, 0] + corners[:, 2]) / 2
        radius = np.sqrt(dot(corners - centre[:, None], corners - centre[:, None]).max(axis=0))
        e = (centre + x)[:, pair], radius[pair]
    elif sky:
        e = None, None
    else:
        e = table.origin[:, source[pair]], table.bound[source[pair]]
    keep = _may_overlap(table, x[:, pair], n[:, pair], occluder, *e) & (occluder != source[pair])
    if corners is not None:
        entry = np.nonzero(keep)[0]
        p, shape = pair[entry], occluder[entry]
        height = over_edges(table, x, corners, p, shape)
        keep[entry] = height > -1 - TOUCHING
        horizon = dot(n[:, p], table.origin[:, shape] - x[:, p]) / table.bound[shape]
        sifted.near[entry] = ~table.is_ball[shape] | (np.minimum(height, horizon) < 1 + TOUCHING)
    for is_ball, decide in ((True, _sift_balls), (False, _sift_polygons)):
        entry = np.nonzero(keep & (table.is_ball[occluder] == is_ball))[0]
        if len(entry):
            p = pair[entry]
            part = None if corners is None else corners[:, :, p]
            decide(sifted, table, x[:, p], n[:, p], source[p], part, entry, p, occluder[entry], sky)
    return sifted


def _sift_balls(sifted, table, x, n, source, corners, entry, pair, occluder, sky):
    ball = table.ball(x, occluder)
    inside = ball.distance < 1 - TOUCHING
    if corners is not None:
        first, _, cross = _order_ball_polygon(ball, corners)
        local = ball.points_to_local(corners) - ball.c[:, None]
        within = dot(local, local).max(axis=0) <= (1 + TOUCHING) ** 2
    elif sky:
        first = np.ones(len(entry), bool)
        within = cross = ~first
        if source[0] >= 0:  # the inner side of a sphere: what is outside of it hides nothing
            cross, beyond = _against_dome(table, source, ball_of=occluder)
            first = ~beyond
            within = beyond
    else:
        first, cross, within = _order_balls(table, x, occluder, source)
    cross = cross & ~(within & inside)
    np.logical_or.at(sifted.crossing, pair[cross], True)
    np.logical_or.at(sifted.dark, pair[inside & ~within & ~cross], True)
    sifted.active[entry] = first & ~cross & ~inside


def _sift_polygons(sifted, table, x, n, source, corners, entry, pair, occluder, sky):
    polygon = table.polygon(x, occluder)
    normal = np.stack(np.cross(polygon[:, 1] - polygon[:, 0], polygon[:, 3] - polygon[:, 0], axis=0))
    edge_on = np.abs(dot(normal, polygon[:, 0])) <= IN_PLANE * np.sqrt(dot(normal, normal)) * table.bound[occluder]
    keep = ~edge_on & (dot(n[:, None], polygon) > 0).any(axis=0)
    # what has the point and the whole source on one side of its plane cannot come between them
    slack = TOUCHING * table.bound[occluder]
    if corners is not None:
        keep &= _height_over(polygon, corners).min(axis=0) < -slack
    elif not sky:
        offset = (table.origin[:, source] - x)[:, None]
        keep &= _height_over(polygon, offset)[0] < table.bound[source] - slack
    cross = np.zeros(len(entry), bool)
    if corners is not None:
        height = _height_over(corners, polygon)
        keep &= height.max(axis=0) > TOUCHING * table.bound[occluder]
    elif sky:
        if source[0] >= 0:
            cross, beyond = _against_dome(table, source, polygon_of=occluder)
            keep &= ~beyond
    else:
        _, first, cross = _order_ball_polygon(table.ball(x, source), polygon)
        keep &= first | cross
    cross &= keep
    np.logical_or.at(sifted.crossing, pair[cross], True)
    sifted.active[entry] = keep & ~cross


def _height_over(corners, points):
    """Heights (k, m) m of points (3, k, m) over the plane of corners (3, 4, m), positive on the origin's side."""
    normal = np.stack(np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0], axis=0))
    normal = divide(normal, np.sqrt(dot(normal, normal)))
    offset = dot(normal, corners[:, 0])
    return np.where(offset < 0, 1.0, -1.0) * (dot(normal[:, None], points) - offset)


def _against_dome(table, dome, ball_of=None, polygon_of=None):
    """Whether shapes cross the sphere dome (m,), and whether they lie outside it."""
    index = polygon_of if ball_of is None else ball_of
    inverse, centre = table.inverse[:, :, dome], table.origin[:, dome]
    if ball_of is None:
        local = transform(inverse, table.corners[:, :, index] - centre[:, None])
        far = np.sqrt(dot(local, local).max(axis=0))
        near = _closest_on_polygon(local)
        near = np.sqrt(dot(near, near))
    else:
        local = transform(inverse, table.origin[:, index] - centre)
        product = np.moveaxis(inverse, -1, 0) @ np.moveaxis(table.linear[:, :, index], -1, 0)
        reach = np.linalg.norm(product, 2, axis=(1, 2))
        distance = np.sqrt(dot(local, local))
        far, near = distance + reach, distance - reach
    beyond = (near >= 1 - TOUCHING) | (index == dome)
    return ~beyond & (far > 1 + TOUCHING), beyond


def _overlapping(table, x, pair, occluder):
    """Entries (pair, occluder), sorted by pair, that overlap another of the same pair: indices (entry, other entry)."""
    d, r = table.origin[:, occluder] - x[:, pair], table.bound[occluder]
    length = np.sqrt(dot(d, d))
    axis, sin = divide(d, length), np.minimum(divide(r, length), 1.0)
    cos = np.where(length > r, np.sqrt(1 - sin * sin), -1.0)  # from within everything overlaps
    follow = np.searchsorted(pair, pair, side="right") - np.arange(len(pair)) - 1
    ends, found = np.cumsum(follow), []
    cuts = np.unique(np.searchsorted(ends, np.arange(0, follow.sum(), OVERLAPS)))
    for low, high in zip(cuts, np.append(cuts[1:], len(pair))):
        some = follow[low:high]
        e = low + np.repeat(np.arange(high - low), some)
        other = e + 1 + np.arange(len(e)) - np.repeat(np.cumsum(some) - some, some)
        apart = dot(axis[:, e], axis[:, other]) < cos[e] * cos[other] - sin[e] * sin[other] - 1e-9
        keep = ~apart | (cos[e] < 0) | (cos[other] < 0)
        found.append((e[keep], other[keep]))
    if not found:
        return np.zeros(0, int), np.zeros(0, int)
    e, other = (np.concatenate(part) for part in zip(*found))
    e, other = np.concatenate([e, other]), np.concatenate([other, e])
    order = np.argsort(e, kind="stable")
    return e[order], other[order]


def padded(count, row, value):
    """Values of rows (ascending) as an array (count, width), padded with -1."""
    number = np.bincount(row, minlength=count)
    out = np.full((count, number.max(initial=0)), -1)
    out[row, np.arange(len(row)) - (np.cumsum(number) - number)[row]] = value
    return out


def _groups(m, row, is_ball, value):
    """Rows with the values of their entries (sorted by row), of planes first, in groups of like numbers:
    (rows, slots (rows, k) padded with -1)."""
    number = np.stack([np.bincount(row[kind], minlength=m) for kind in (~is_ball, is_ball)])
    slots = [padded(m, row[kind], value[kind]) for kind in (~is_ball, is_ball)]
    order = np.lexsort(number)  # by balls, then by planes
    order = order[number[:, order].any(axis=0)]
    start = 0
    while start < len(order):
        # rows alike, and as many more as it takes to be worth the calls
        alike = (number[:, order[start:]] == number[:, order[start], None]).all(axis=0)
        count = max(len(alike) if alike.all() else int(np.argmin(alike)), FEW)
        rows = order[start : start + count]
        a, b = number[:, rows].max(axis=1)
        for group in _parts(rows, max(GROUP // (1 + a + b), 64)):
            yield group, np.concatenate([slots[0][group, :a], slots[1][group, :b]], axis=1)
        start += count


class _Views:
    """Regions of sources and of (pair, occluder) entries as each pair's point sees them, made once for many groups.

    Pairs as for `_batch`; ellipsoids are made anew where they are asked for, lest round balls be taken for ellipsoids.
    """

    def __init__(self, table, pairs, pair, occluder):
        self.table, self.pairs, self.pair, self.shape = table, pairs, pair, occluder
        x, n, source, corners, sky = pairs
        self.is_ball, self.is_round = table.is_ball[occluder], table.radius[occluder] > 0
        self.place, self.made = np.zeros(len(pair), int), {}
        for kind, some in ((True, np.nonzero(self.is_round)[0]), (False, np.nonzero(~self.is_ball)[0])):
            self.place[some] = np.arange(len(some))
            self.made[kind] = self._make(some, np.ones(len(some), bool)) if len(some) else None
        self.behind = np.unique(pair)
        some_round = corners is not None or sky or (table.radius[source[self.behind]] > 0).all()
        self.sources = _source(table, *_pick(pairs, self.behind)) if some_round else None

    def _make(self, entry, active):
        x, corners = self.pairs[0].take(self.pair[entry], axis=1), self.pairs[3]
        if self.is_ball[entry[0]]:
            return ball_region(self.table.ball(x, self.shape[entry]), active)
        polygon = self.table.polygon(x, self.shape[entry])
        if corners is None:
            return polygon_region(polygon, np.ones(polygon.shape[1:]), active)
        return polygon_region(polygon, _height_over(corners[:, :, self.pair[entry]], polygon), active)

    def source(self, pair):
        if self.sources is None:
            return _source(self.table, *_pick(self.pairs, pair))
        return self.sources.take(np.searchsorted(self.behind, pair))

    def occluders(self, slots):
        """Regions of the entries in slots (m, k), each column of one kind and padded with -1."""
        regions = []
        for index in slots.T[(slots >= 0).any(axis=0)]:
            entry = _real(index)
            if self.is_ball[entry[0]] and not self.is_round[entry].all():
                regions.append(self._make(entry, index >= 0))
            else:
                regions.append(self.made[bool(self.is_ball[entry[0]])].take(self.place[entry], index >= 0))
        return regions


def _real(index):
    """Padding replaced by some real entry of the same kind, so that it computes without special cases."""
    return np.where(index >= 0, index, index.max())


def _source(table, x, n, source, corners, sky):
    if sky:
        return sky_source(n)
    if corners is None:
        return ball_source(table.ball(x, source), n)
    return polygon_region(corners, dot(n[:, None], corners), np.ones(len(source), bool), closing=n)


def _unoccluded(table, x, n, source, corners, sky):
    if sky:
        return np.ones(x.shape[1])
    if corners is not None:
        return polygon_unoccluded(np.zeros_like(x.T), n.T, np.transpose(corners, (2, 1, 0)))
    radius = table.radius[source]
    out = sphere_unoccluded(x.T, n.T, table.origin[:, source].T, np.where(radius > 0, radius, table.bound[source]))
    for part in _parts(np.nonzero(radius == 0)[0], GROUP):
        out[part] = source_integral(n[:, part], ball_source(table.ball(x[:, part], source[part]), n[:, part]), [])
    return out


def _parts(index, size):
    return [index[k : k + size] for k in range(0, len(index), size)]


def visible_factors(table, points, normals, source, corners=None, occluders=None, sky=False, counts=None):
    """Exact form factors (m,) from points (m, 3) m with unit normals (m, 3) to the visible part of their sources.

    source (m,): shape indices. Planes: corners (m, 4, 3) m of the part that is the source. Balls: corners None,
    seen from outside. sky: all directions, up to the inner side of sphere `source`, or without end where it is -1.
    occluders (m, k): candidate shape indices padded with -1; may contain the source and shapes that hide nothing.
    counts: a Counter that is told how many pairs were free, exact or sampled. Error about 1e-14, or that of
    the sampled fallback (1e-3 of the factor) where shapes cross each other.
    """
    counts = Counter() if counts is None else counts
    out = np.empty(len(points))
    source = np.broadcast_to(np.asarray(source), len(points))
    for start in range(0, len(points), BATCH):
        part = slice(start, start + BATCH)
        x, n = np.ascontiguousarray(points[part].T), np.ascontiguousarray(normals[part].T)
        c = None if corners is None else np.ascontiguousarray(np.transpose(corners[part], (2, 1, 0))) - x[:, None]
        candidates = None if occluders is None else occluders[part]
        out[part] = _batch(table, x, n, source[part], c, candidates, sky, counts)
    return out


def _pick(pairs, index):
    """Of pairs, (x, n, source, corners or None, sky), those of index (k,)."""
    x, n, source, corners, sky = pairs
    some = None if corners is None else corners.take(index, axis=2)
    return x.take(index, axis=1), n.take(index, axis=1), source[index], some, sky


def _batch(table, x, n, source, corners, occluders, sky, counts):
    m, pairs = x.shape[1], (x, n, source, corners, sky)
    pair, slot = np.nonzero(occluders >= 0) if occluders is not None and occluders.size else (np.zeros(0, int),) * 2
    if not len(pair):
        counts["free"] += m
        return _unoccluded(table, *pairs)
    occluder = occluders[pair, slot]
    sifted = _sift(table, x, n, source, corners, pair, occluder, sky)
    sampled, lit = sifted.crossing & ~sifted.dark, ~sifted.crossing & ~sifted.dark
    entry = sifted.active & lit[pair]
    pair, occluder, near = pair[entry], occluder[entry], np.nonzero(sifted.near[entry])[0]
    hidden = int((np.bincount(pair, minlength=m) > 0).sum())
    counts["free"] += int(lit.sum()) - hidden
    counts["exact"] += hidden
    out = np.zeros(m)
    whole = np.nonzero(lit & (np.bincount(pair[near], minlength=m) == 0))[0]
    out[whole] = _unoccluded(table, *_pick(pairs, whole))
    if len(pair):
        _integrate(_Views(table, pairs, pair, occluder), near, out)
    out = np.maximum(out, 0.0)
    index = np.nonzero(sampled)[0]
    counts["sampled"] += len(index)
    for group in _parts(index, 64):
        out[group] = _sampled(table, *_pick(pairs, group), occluders[group])
    return out


def _integrate(views, near, out):
    """Add to out (m,) what each pair's point receives past its entries; near: those that source's edges may meet."""
    x, n = views.pairs[:2]
    pair, is_ball = views.pair, views.is_ball
    # the source's own boundary outside all occluders
    for group, slots in _groups(len(out), pair[near], is_ball[near], near):
        out[group] += source_integral(n.take(group, axis=1), views.source(group), views.occluders(slots))
    # each occluder's boundary inside the source and outside the other occluders that it meets in the view
    e, other = _overlapping(views.table, x, pair, views.shape)
    alone = np.nonzero(np.bincount(e, minlength=len(pair)) == 0)[0]
    lists = [*_groups(len(pair), e, is_ball[other], other)]
    lists += [(part, np.zeros((len(part), 0), int)) for part in _parts(alone, GROUP)]
    for group, slots in lists:
        for kind in (False, True):
            of_kind = is_ball[group] == kind
            index, others = group[of_kind], slots[of_kind]
            if not len(index):
                continue
            own = views.occluders(index[:, None])[0]
            used = others.T[(others >= 0).any(axis=0)]
            first = [(column >= 0) & (views.shape[column] < views.shape[index]) for column in used]
            source, at = views.source(pair[index]), n.take(pair[index], axis=1)
            value = occluder_integral(at, own, source, views.occluders(others), first)
            np.subtract.at(out, pair[index], value)


def segment_blocked(table, x, d, shape):
    """Whether the open segment x + t d, 0 < t < 1, meets the shape; x, d (3, ..., m), shape (m,) -> (..., m)"""
    blocked = np.zeros(d.shape[1:], bool)
    is_ball = table.is_ball[shape]
    for kind, meets in ((True, _meets_ball), (False, _meets_square)):
        index = np.nonzero(is_ball == kind)[0]
        if len(index):
            inverse = table.inverse[:, :, shape[index]]
            origin = table.origin[:, shape[index]].reshape(3, *(1,) * (x.ndim - 2), -1)
            blocked[..., index] = meets(_spread(inverse, x[..., index] - origin), _spread(inverse, d[..., index]))
    return blocked


def _spread(matrix, v):
    """(3, 3, m) applied to (3, ..., m)."""
    return np.stack([sum(matrix[i, j] * v[j] for j in range(3)) for i in range(3)])


def _meets_ball(p, d):
    """Whether segments p + t d meet the unit ball."""
    a, b, c = dot(d, d), dot(p, d), dot(p, p) - 1
    reach = b * b - a * c
    root = np.sqrt(np.maximum(reach, 0.0))
    return (reach > 0) & (-b - root < (1 - TOUCHING) * a) & (root - b > TOUCHING * a)


def _meets_square(p, d):
    """Whether segments p + t d meet the unit square about the origin."""
    t = divide(-p[2], d[2])
    beside = np.maximum(np.abs(p[0] + t * d[0]), np.abs(p[1] + t * d[1]))
    return (t > TOUCHING) & (t < 1 - TOUCHING) & (beside <= 0.5)


def _sampled(table, x, n, source, corners, sky, occluders):
    """The fallback: the exact unoccluded factor times the share of it that a Gauss rule with segment tests sees.

    The share is at most 1 however peaked the kernel is (near contact), so that a row cannot gain light.
    """
    nodes, weights = gauss_legendre(SAMPLES)
    s, t = (a.reshape(-1, 1) for a in np.meshgrid(nodes, nodes, indexing="ij"))
    weight = np.outer(weights, weights).reshape(-1, 1)
    m = x.shape[1]
    if corners is not None:
        u, v = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
        d = corners[:, 0][:, None] + s * u[:, None] + t * v[:, None]
        area = np.abs(dot(np.stack(np.cross(u, v, axis=0))[:, None], d)) * weight
    elif sky:
        frame = sky_source(n)
        e, f = frame.p[:, 0], np.stack(np.cross(n, frame.p[:, 0], axis=0))
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
    return _unoccluded(table, x, n, source, corners, sky) * divide(kernel.sum(axis=0), whole).reshape(m)


def _dome_distance(table, x, d, source):
    """Where directions d (3, j, m) from inside meet sphere `source`; far away without one."""
    if source[0] < 0:
        return 4 * (table.bound.max() + np.abs(table.origin).max() + np.abs(x).max())
    inverse = table.inverse[:, :, source]
    p, e = _spread(inverse, (x - table.origin[:, source])[:, None]), _spread(inverse, d)
    a, b, c = dot(e, e), dot(p, e), dot(p, p) - 1
    return (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a


def _cap_samples(table, x, source, s, angle, weight):
    """Offsets (3, j, m) to samples of the visible cap of balls and area element times cosine times |d| there."""
    ball = table.ball(x, source)
    z = ball.sin + (1 - ball.sin) * s  # cosine from the axis towards the point, in the ball's own space
    radius = np.sqrt(np.maximum(1 - z * z, 0.0))
    normal = -z * ball.axis[:, None] + radius * (np.cos(angle) * ball.u[:, None] + np.sin(angle) * ball.v[:, None])
    linear = table.linear[:, :, source]
    d = _spread(linear, ball.c[:, None] + normal)
    determinant = np.linalg.det(np.moveaxis(linear, -1, 0))
    area = determinant * _spread(np.moveaxis(table.inverse[:, :, source], 0, 1), normal)
    return d, np.maximum(-dot(area, d), 0.0) * weight * 2 * np.pi * (1 - ball.sin)
