"""What oriented points receive from sources, behind candidate occluders: pairs in, form factors out.

Each (point, source) pair brings a list of candidate occluders. Here those that cannot hide anything are dropped,
the order in depth is decided, and the rest goes to the exact contour integral, some thousand entries at once.
"""

from collections import Counter

import numpy as np

from .at_once import AT_ONCE, CACHED, in_turn, parts, runs, slices
from .closed_forms import cross, divide, dot, sphere_unoccluded, transform
from .contour import polygon_unoccluded
from .regions import Occluders, ball_source, covers_directions, polygon_region, sky_source
from .sampled import sampled_factors
from .tolerances import TOUCHING
from .visible_integral import visible_integral

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


def _order_ball_polygon(table, x, ball, corners):
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


def _order_balls(table, x, occluder, source):
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
        first[pick], cross[pick], within[pick] = _order_ellipsoids(table, x[:, pick], occluder[pick], source[pick])
    # of balls within each other the radical plane tells nothing, as points beyond it see both of them
    return within | (first & ~around), cross, within


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


def _cones_apart(d, r, pair, e, radius):
    """(k,) Whether the cones around spheres at offsets d (3, k), radii r (k,), are apart from those around the spheres
    of their pairs (k,) at offsets e (3, m), radii (m,)."""
    dd, ee = dot(d, d), dot(e, e)
    outside = (dd > r * r) & (ee > radius * radius)[pair]
    # angle between the axes against the sum of half angles: cos(axes) < cos(sum), everything times |d| |e|
    tangent = np.sqrt(np.maximum(ee - radius * radius, 0.0))
    cosine = np.sqrt(np.maximum(dd - r * r, 0.0)) * tangent[pair] - r * radius[pair]
    return outside & (dot(d, e.take(pair, axis=1)) < cosine - 1e-9 * np.sqrt(dd * ee[pair]))


def over_edges(table, x, corners, pair, shape):
    """Least height of shapes (e,) over the planes through the points x (3, m) of their pair (e,) and the edges of the
    pair's polygon (3, 4, m) relative to it, in their bounding radii: below -1 the shape is beside the polygon in the
    view, above 1 no edge comes near it."""
    d, middle = table.origin.take(shape, axis=1) - x.take(pair, axis=1), corners.sum(axis=1)
    side = cross(corners, corners[:, [1, 2, 3, 0]])
    side = divide(side, np.copysign(np.sqrt(dot(side, side)), dot(side, middle[:, None])))
    least = dot(side[:, 0].take(pair, axis=1), d)
    for k in range(1, 4):
        least = np.minimum(least, dot(side[:, k].take(pair, axis=1), d))
    return least / table.bound[shape]


def _sift(table, x, n, source, corners, pair, occluder, sky):
    """Decide every (pair, occluder) entry; x, n, corners and source are per pair, pair and occluder per entry.

    Returns which entries may hide something (active), which pairs get nothing (dark) and which are left to sampling.
    """
    active = np.zeros(len(pair), bool)
    dark, crossing = np.zeros((2, x.shape[1]), bool)
    d, r = table.origin.take(occluder, axis=1) - x.take(pair, axis=1), table.bound[occluder]
    keep = (dot(n.take(pair, axis=1), d) > -r) & (occluder != source[pair])
    if corners is not None:
        middle = corners.mean(axis=1)
        radius = np.sqrt(dot(corners - middle[:, None], corners - middle[:, None]).max(axis=0))
        keep &= ~_cones_apart(d, r, pair, middle, radius)
    elif not sky:
        keep &= ~_cones_apart(d, r, pair, table.origin.take(source, axis=1) - x, table.bound[source])
    entry = np.nonzero(keep)[0]
    if corners is not None:
        entry = entry[over_edges(table, x, corners, pair[entry], occluder[entry]) > -1 - TOUCHING]
    for decide, of_kind in zip((_sift_balls, _sift_polygons), table.by_kind(occluder[entry])):
        e = entry[of_kind]
        if len(e):
            active[e], cross, blocked = decide(table, x, n, source, corners, pair[e], occluder[e], sky)
            crossing[pair[e[cross]]] = True
            dark[pair[e[blocked]]] = True
    return active, dark, crossing


def _sift_balls(table, x, n, source, corners, pair, occluder, sky):
    """Of entries whose occluder is a ball: active, crossing the source, all around the point but not the source."""
    entries, r = len(pair), table.bound[occluder]
    d = table.origin.take(occluder, axis=1) - x.take(pair, axis=1)
    inside, k = (
        np.zeros(entries, bool),
        np.nonzero(dot(d, d) < (r * (1 + TOUCHING)) ** 2)[0],
    )  # the bounding sphere, then the ball
    inside[k] = table.within(x.take(pair[k], axis=1), n.take(pair[k], axis=1), occluder[k])
    first, (cross, within) = np.ones(entries, bool), np.zeros((2, entries), bool)
    if corners is not None:
        # what does not reach the source's plane is before it
        normal, offset = _planes_of(corners)
        k = np.nonzero(dot(normal.take(pair, axis=1), d) + offset[pair] < r * (1 + TOUCHING))[0]
        p = pair[k]
        order = _order_ball_polygon(table, x.take(p, axis=1), occluder[k], corners.take(p, axis=2))
        first[k], _, cross[k], within[k] = order
    elif sky:
        if source[0] >= 0:  # the inner side of a sphere: what is outside of it hides nothing
            cross, within = against_dome(table, source[pair], ball_of=occluder)
            first = ~within
    else:
        first, cross, within = _order_balls(table, x.take(pair, axis=1), occluder, source[pair])
    cross &= ~(within & inside)
    return first & ~cross & ~inside, cross, inside & ~within & ~cross


def _sift_polygons(table, x, n, source, corners, pair, occluder, sky):
    """As _sift_balls; a polygon is never all around the point."""
    x = x.take(pair, axis=1)
    polygon = table.polygon(x, occluder)
    normal, offset = _planes_of(polygon)
    # what has the point and the whole source on one side of its plane cannot come between them
    slack = table.tolerance
    keep = (offset > slack) & (dot(n.take(pair, axis=1)[:, None], polygon) > slack).any(axis=0)
    cross = np.zeros(len(pair), bool)
    if corners is not None:
        corners = corners.take(pair, axis=2)
        keep &= (dot(normal[:, None], corners) + offset).min(axis=0) < -slack
        keep &= _height_over(corners, polygon).max(axis=0) > slack
    elif not sky:
        source = source[pair]
        keep &= dot(normal, table.origin.take(source, axis=1) - x) + offset < table.bound[source] - slack
        _, before, cross, _ = _order_ball_polygon(table, x, source, polygon)
        keep &= before | cross
    elif source[0] >= 0:
        cross, beyond = against_dome(table, source[pair], polygon_of=occluder)
        keep &= ~beyond
    cross &= keep
    return keep & ~cross, cross, np.zeros(len(pair), bool)


def _planes_of(corners):
    """Planes of polygons (3, 4, m): unit normals (3, m) towards the origin and its heights (m,) m over them."""
    normal = cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    normal = divide(normal, np.sqrt(dot(normal, normal)))
    offset = -dot(normal, corners[:, 0])
    return np.where(offset < 0, -1.0, 1.0) * normal, np.abs(offset)


def _height_over(corners, points):
    """Heights (k, m) m of points (3, k, m) over the plane of corners (3, 4, m), positive on the origin's side."""
    normal, offset = _planes_of(corners)
    return dot(normal[:, None], points) + offset


def _on_plane(height, tolerance):
    """Heights m of corners, those within the tolerance 0: what lies in a plane is not cut by it."""
    return np.where(np.abs(height) > tolerance, height, 0.0)


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


def _overlapping(table, x, pair, occluder):
    """Entries (pair, occluder), sorted by pair, that overlap another of the same pair: indices (entry, later entry)."""
    d, r = table.origin.take(occluder, axis=1) - x.take(pair, axis=1), table.bound[occluder]
    length = np.sqrt(dot(d, d))
    axis, sin = divide(d, length), np.minimum(divide(r, length), 1.0)
    cos = np.sqrt(1 - sin * sin)
    around = length <= r  # from within everything overlaps
    follow = np.searchsorted(pair, pair, side="right") - np.arange(len(pair)) - 1
    found = [np.zeros((2, 0), int)]
    for some in runs(follow):
        e, step = in_turn(follow[some])
        e += some.start
        other = e + 1 + step
        apart = dot(axis.take(e, axis=1), axis.take(other, axis=1)) < cos[e] * cos[other] - sin[e] * sin[other] - 1e-9
        found.append(np.stack([e, other])[:, ~apart | around[e] | around[other]])
    return np.concatenate(found, axis=1)


def padded(count, row, value):
    """Values of rows (ascending) as an array (count, width), padded with -1."""
    number = np.bincount(row, minlength=count)
    out = np.full((count, number.max(initial=0)), -1)
    out[row, np.arange(len(row)) - (np.cumsum(number) - number)[row]] = value
    return out


def _source(table, x, n, source, corners, sky):
    if sky:
        return sky_source(n)
    if corners is None:
        return ball_source(table.balls(x, source), n)
    height = _on_plane(dot(n[:, None], corners), table.tolerance)
    return polygon_region(corners, height, table.tolerance, closing=n)


def _occluders(table, x, corners, pair, occluder):
    """Occluders of entries (pair, occluder), sorted by pair; corners: of their sources, if these are polygons."""
    ball, polygon = table.by_kind(occluder)
    outlines = table.polygon(x.take(pair[polygon], axis=1), occluder[polygon])
    height = np.ones(outlines.shape[1:])
    if corners is not None:  # only what is before the source hides any of it
        height = _on_plane(_height_over(corners.take(pair[polygon], axis=2), outlines), table.tolerance)
    covers = covers_directions(outlines, height, table.tolerance)
    if not covers.all():
        keep = np.ones(len(pair), bool)
        keep[polygon] = covers
        pair, occluder = pair[keep], occluder[keep]
        outlines, height = outlines[:, :, covers], height[:, covers]
        ball, polygon = table.by_kind(occluder)
    number = np.empty(len(pair), int)
    number[polygon], number[ball] = np.arange(len(polygon)), np.arange(len(ball))
    e, other = _overlapping(table, x, pair, occluder)
    e, other = np.concatenate([e, other]), np.concatenate([other, e])
    one, two = (np.isin(k, ball) for k in (e, other))
    polygon_polygon, polygon_ball, ball_ball = (
        (number[e[both]], number[other[both]]) for both in (~one & ~two, ~one & two, one & two)
    )
    shape = occluder[polygon]
    return Occluders(
        polygon_region(outlines, height, table.tolerance),
        pair[polygon],
        table.balls(x.take(pair[ball], axis=1), occluder[ball]),
        pair[ball],
        polygon_polygon,
        polygon_ball,
        ball_ball,
        first=shape[polygon_polygon[1]] < shape[polygon_polygon[0]],
    )


def _visible(table, x, n, source, corners, sky, pair, occluder):
    """Factors (m,) of sources behind the occluders of entries (pair, occluder)."""
    region = _source(table, x, n, source, corners, sky)
    return visible_integral(n, region, _occluders(table, x, corners, pair, occluder), table.rounding)


def _unoccluded(table, x, n, source, corners, sky):
    if sky:
        return np.ones(x.shape[1])
    if corners is not None:
        return polygon_unoccluded(np.zeros_like(x.T), n.T, np.transpose(corners, (2, 1, 0)))
    radius = table.radius[source]
    out = sphere_unoccluded(x.T, n.T, table.origin[:, source].T, np.where(radius > 0, radius, table.bound[source]))
    nothing = np.zeros(0, int)
    for part in parts(np.nonzero(radius == 0)[0], CACHED):
        out[part] = _visible(table, x[:, part], n[:, part], source[part], None, False, nothing, nothing)
    return out


def visible_factors(table, points, normals, source, corners=None, occluders=None, sky=False, counts=None):
    """Exact form factors (m,) from points (m, 3) m with unit normals (m, 3) to the visible part of their sources.

    source (m,): shape indices. Planes: corners (m, 4, 3) m of the part that is the source. Balls: corners None,
    seen from outside. sky: all directions, up to the inner side of sphere `source`, or without end where it is -1.
    occluders (m, k): candidate shape indices padded with -1; may contain the source and shapes that hide nothing.
    counts: a Counter that is told how many pairs were free, exact or sampled. Error about 1e-14, or that of
    the sampled fallback (1e-3, at most 4e-3) where shapes cross each other.
    """
    counts = Counter() if counts is None else counts
    out = np.empty(len(points))
    source = np.broadcast_to(np.asarray(source), len(points))
    for part in slices(len(points), AT_ONCE):
        x, n = np.ascontiguousarray(points[part].T), np.ascontiguousarray(normals[part].T)
        c = None if corners is None else np.ascontiguousarray(np.transpose(corners[part], (2, 1, 0))) - x[:, None]
        candidates = None if occluders is None else occluders[part]
        out[part] = _batch(table, x, n, source[part], c, candidates, sky, counts)
    return out


def _groups(number):
    """Rows with number (m,) > 0 entries, ascending, in groups of about CACHED entries or of one row."""
    rows = np.nonzero(number)[0]
    return [rows[some] for some in runs(number[rows], CACHED)]


def _batch(table, x, n, source, corners, occluders, sky, counts):
    m = x.shape[1]

    def pick(index):
        part = None if corners is None else corners.take(index, axis=2)
        return x.take(index, axis=1), n.take(index, axis=1), source[index], part, sky

    pair, slot = np.nonzero(occluders >= 0) if occluders is not None and occluders.size else (np.zeros(0, int),) * 2
    if not len(pair):
        counts["free"] += m
        return _unoccluded(table, x, n, source, corners, sky)
    occluder = occluders[pair, slot]
    active, dark, crossing = _sift(table, x, n, source, corners, pair, occluder, sky)
    sampled, lit = crossing & ~dark, ~crossing & ~dark
    entry = active & lit[pair]
    pair, occluder = pair[entry], occluder[entry]
    number = np.bincount(pair, minlength=m)
    whole = np.nonzero(lit & (number == 0))[0]
    counts["free"] += len(whole)
    counts["exact"] += int(lit.sum()) - len(whole)
    out = np.zeros(m)
    out[whole] = _unoccluded(table, *pick(whole))
    if corners is not None:  # the rest get nothing
        number[~covers_directions(corners, dot(n[:, None], corners), table.tolerance)] = 0
        pair, occluder = pair[number[pair] > 0], occluder[number[pair] > 0]
    for group in _groups(number):
        e = slice(*np.searchsorted(pair, [group[0], group[-1] + 1]))
        out[group] = _visible(table, *pick(group), np.searchsorted(group, pair[e]), occluder[e])
    out = np.maximum(out, 0.0)
    index = np.nonzero(sampled)[0]
    counts["sampled"] += len(index)
    if len(index):
        these = pick(index)
        out[index] = sampled_factors(table, *these, occluders[index], _unoccluded(table, *these))
    return out
