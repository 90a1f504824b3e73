"""Which candidate occluders may hide something of what a point sees, which hide it all, and which cross it."""

import numpy as np

from .closed_forms import cross, divide, dot
from .in_depth import against_dome, ball_and_polygon, two_balls
from .tolerances import TOUCHING


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


def sift(table, x, n, source, corners, pair, occluder, sky):
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
    inside, k = np.zeros(entries, bool), np.nonzero(dot(d, d) < (r * (1 + TOUCHING)) ** 2)[0]
    # the bounding sphere, then the ball
    inside[k] = table.within(x.take(pair[k], axis=1), n.take(pair[k], axis=1), occluder[k])
    first, (cross, within) = np.ones(entries, bool), np.zeros((2, entries), bool)
    if corners is not None:
        # what does not reach the source's plane is before it
        normal, offset = _planes_of(corners)
        k = np.nonzero(dot(normal.take(pair, axis=1), d) + offset[pair] < r * (1 + TOUCHING))[0]
        p = pair[k]
        order = ball_and_polygon(table, x.take(p, axis=1), occluder[k], corners.take(p, axis=2))
        first[k], _, cross[k], within[k] = order
    elif sky:
        if source[0] >= 0:  # the inner side of a sphere: what is outside of it hides nothing
            cross, within = against_dome(table, source[pair], ball_of=occluder)
            first = ~within
    else:
        first, cross, within = two_balls(table, x.take(pair, axis=1), occluder, source[pair])
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
        keep &= height_over(corners, polygon).max(axis=0) > slack
    elif not sky:
        source = source[pair]
        keep &= dot(normal, table.origin.take(source, axis=1) - x) + offset < table.bound[source] - slack
        _, before, cross, _ = ball_and_polygon(table, x, source, polygon)
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


def height_over(corners, points):
    """Heights (k, m) m of points (3, k, m) over the plane of corners (3, 4, m), positive on the origin's side."""
    normal, offset = _planes_of(corners)
    return dot(normal[:, None], points) + offset
