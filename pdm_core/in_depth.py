"""Which of two convex shapes is before the other as a point sees them, which cross, which lie within the other."""

import numpy as np

from .boxes import near
from .closed_forms import divide, dot, transform
from .tolerances import TOUCHING

ASCENT = 300  # steps towards a separating direction of two ellipsoids


def _closest_on_polygon(corners):
    """Point (3, m) nearest the origin on parallelograms (3, 4, m), or triangles whose last corner is there twice."""
    c, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    uu, uv, vv, cu, cv = dot(u, u), dot(u, v), dot(v, v), dot(c, u), dot(c, v)
    det = uu * vv - uv * uv
    s, t = divide(uv * cv - vv * cu, det), divide(uv * cu - uu * cv, det)
    inner = (s > 0) & (s < 1) & (t > 0) & (t < 1) & (det > 0)
    inner &= (s + t < 1) | (corners[:, 2] != corners[:, 3]).any(axis=0)
    edge = corners[:, [1, 2, 3, 0]] - corners
    near = corners + np.clip(divide(-dot(corners, edge), dot(edge, edge)), 0.0, 1.0) * edge
    best = np.take_along_axis(near, np.argmin(dot(near, near), axis=0)[None, None], axis=1)[:, 0]
    return np.where(inner, c + s * u + t * v, best)


def ball_and_polygon(table, x, ball, corners):
    """Of balls (m,) and polygons (3, 4, m), relative to points x (3, m): (ball first, polygon first, they cross, the
    polygon is inside the ball), each (m,).

    Disjoint convex bodies hide each other in one order only: the point's side of a separating plane tells which.
    The plane used is the one at the polygon's point nearest the ball, in the space where the ball is round.
    """
    inverse = table.inverse.take(ball, axis=2)
    c = transform(inverse, table.origin.take(ball, axis=1) - x)
    corners = transform(inverse, corners) - c[:, None]
    near = _closest_on_polygon(corners)
    distance2, side = dot(near, near), -dot(c, near)
    cross = distance2 < (1 - TOUCHING) ** 2
    within = dot(corners, corners).max(axis=0) <= (1 + TOUCHING) ** 2
    return ~cross & (side < distance2), ~cross & (side > distance2), cross, within


def two_balls(table, x, occluder, source):
    """Of two balls: (the occluder first, they cross, the source inside the occluder), each (m,)."""
    d = table.origin[:, occluder] - table.origin[:, source]
    distance = np.sqrt(dot(d, d))
    ro, rs = table.radius[occluder], table.radius[source]
    do, ds = table.origin[:, occluder] - x, table.origin[:, source] - x
    # the radical plane separates disjoint round balls: the one of less power is before the other
    first = dot(do, do) - ro * ro < dot(ds, ds) - rs * rs
    within, around = distance + rs <= ro * (1 + TOUCHING), distance + ro <= rs * (1 + TOUCHING)
    cross = (distance < (ro + rs) * (1 - TOUCHING)) & ~within & ~around
    odd = (ro == 0) | (rs == 0)
    if odd.any():
        pick = np.nonzero(odd)[0]
        first[pick], cross[pick], within[pick] = _two_ellipsoids(table, x[:, pick], occluder[pick], source[pick])
    # of balls within each other the radical plane tells nothing, as points beyond it see both of them
    return within | (first & ~around), cross, within


def _two_ellipsoids(table, x, occluder, source):
    """As two_balls for ellipsoids, from a separating plane of each pair of shapes."""
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


def against_dome(table, dome, ball_of=None, polygon_of=None):
    """Whether shapes cross the sphere dome (m,), and whether they lie outside it."""
    index = polygon_of if ball_of is None else ball_of
    inverse, centre = table.inverse.take(dome, axis=2), table.origin.take(dome, axis=1)
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


def balls_that_cross(table):
    """(ball, other) shape indices (k,) of balls in whose surface another shape's surface runs through; of two balls
    once."""
    low, high = table.origin - table.bound, table.origin + table.bound
    flat = table.by_kind(np.arange(len(table.bound)))[1]
    low[:, flat], high[:, flat] = table.corners[:, :, flat].min(axis=1), table.corners[:, :, flat].max(axis=1)
    a, b = near(low.T, high.T, 0.0)
    a, b = np.concatenate([a, b]), np.concatenate([b, a])
    mine = table.by_kind(a)[0]
    ball, other = a[mine], b[mine]
    both, mixed = table.by_kind(other)
    both = both[ball[both] < other[both]]
    mixed = mixed[against_dome(table, ball[mixed], polygon_of=other[mixed])[0]]
    both = both[against_dome(table, ball[both], other[both])[0] & against_dome(table, other[both], ball[both])[0]]
    found = np.concatenate([mixed, both])
    return ball[found], other[found]
