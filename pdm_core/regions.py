"""Exact occlusion: what an oriented point receives from a source behind any number of convex occluders.

Seen from the point every convex source S and every occluder O is a convex region of directions, bounded by
great-circle arcs (straight edges) and conic arcs (outlines of ellipsoids). The visible region S minus the union
of the O has as boundary the pieces of S's boundary outside all O, and the pieces of each O's boundary inside S
and outside all other O; the form factor is the contour integral n . sum of integral r x dr / (2 pi) over them.
What one region hides of another's edge or outline is a set of intervals, whose ends are roots of linear, quadratic or
quartic equations: nothing is sampled. Coinciding boundaries (boxes, screens standing on floors) are told apart by
nudging the edge in question to its inner or outer side, by what the rounding of the coordinates can move it.

Arrays are component first and flat, (3, edges, regions); everything is relative to the point. Which region meets which
is a list of index pairs, an interval a triple (row, start, end): all of a batch are found at once.
"""

from dataclasses import dataclass

import numpy as np

from .at_once import CACHED, parts
from .closed_forms import across, clip_edges, cross, divide, dot
from .numerics import gauss_legendre
from .tolerances import ROUNDING, TINY

ASIDE = 0.4323  # where a piece of an outline is tested against an elliptic cone
INNER, OUTER, BOTH = range(3)
TURN = 2 * np.pi
LEAVE_ENTER = np.array([1.0, -1.0])  # which way an outline crosses a plane
GRAZING_ANGLE = 1e-4  # sine of the angle above which no polygon is seen edge-on
EDGE_ON = 8  # turns by rounding: a polygon no wider than so many in the view hides nothing
NOTHING = 1e-6  # a factor above which nothing is made by rounding
STEEPEST = 1e-3  # tilt of a plane, as a sine, that rounding is taken to cause at most: of edges seen end-on
CONIC_POINTS, CONIC_PARTS = 16, 4  # Gauss rule for arcs of elliptic cones, per part of a piece


def _unit(a):
    return divide(a, np.sqrt(dot(a, a)))


class Balls:
    """Ellipsoids as unit balls at centres c (3, m) of the spaces that `linear` (3, 3, m) maps to the world.

    round (m,): whether `linear` only scales. inverse (3, 3, m): of `linear`; both None if all are round.
    conic (k, 3, m): vectors k0, k1, k2 of the outline's directions r(f) = k0 + k1 cos f + k2 sin f, counter-clockwise
    seen from the point. |r| <= 1; of round balls |r| = 1, a circle about the axis.
    """

    def __init__(self, c, round_, linear=None, inverse=None):
        h = np.sqrt(dot(c, c))
        self.c, self.round, self.inverse = c, round_, inverse
        self.sin = 1 / np.maximum(h, 1.0)
        self.cos = np.sqrt(np.maximum((h - 1) * (h + 1), 0.0)) * self.sin
        self.axis = divide(c, h)
        self.u = across(self.axis)
        self.v = cross(self.axis, self.u)
        self.conic = np.array([self.cos * self.axis, self.sin * self.u, self.sin * self.v])
        odd = np.nonzero(~round_)[0]
        if len(odd):
            size = np.sqrt((linear[:, :, odd] ** 2).sum(axis=(0, 1)))
            self.conic[:, :, odd] = np.einsum("ijm,cjm->cim", linear[:, :, odd] / size, self.conic[:, :, odd])


@dataclass
class Region:
    """Convex sets of directions: inside all planes (3, k, m) (inward unit normals, zero where unbounded) and, if there
    are any, balls (m).

    p, q (3, e, m): the straight edges, counter-clockwise; on (e,): which of the planes each edge is in.
    tilt (k, m): sine of the angle by which the rounding of an edge's ends may turn its plane.
    """

    p: np.ndarray
    q: np.ndarray
    planes: np.ndarray
    on: np.ndarray
    tilt: np.ndarray
    balls: Balls | None = None

    def edges(self, index):
        """p, q and the planes of the edges of regions index (k,), each (3, e, k), and their tilt (e, k)"""
        planes, tilt = self.planes[:, self.on].take(index, axis=2), self.tilt[self.on].take(index, axis=1)
        return self.p.take(index, axis=2), self.q.take(index, axis=2), planes, tilt


@dataclass
class Occluders:
    """What stands before sources: polygons and balls, the sources polygon_of (i,) and ball_of (j,) that each is before,
    and which overlap in the view of one source: index pairs ((k,), (k,)).

    first: of the pairs of polygons, whether the other comes before the one: of two coinciding edges on the same side
    the first one's counts, on opposite sides neither.
    """

    polygons: Region
    polygon_of: np.ndarray
    balls: Balls
    ball_of: np.ndarray
    polygon_polygon: tuple
    polygon_ball: tuple
    ball_ball: tuple
    first: np.ndarray


def covers_directions(corners, height, tolerance):
    """(m,) Whether polygons (3, k, m) have a part of height (k, m) > 0 and are not seen edge-on: then they are no wider
    than what the rounding of their corners, tolerance m, can turn their edges' planes by."""
    area = cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    distance = np.abs(dot(corners[:, 0], area))  # from their planes, times their areas
    size = np.sqrt(dot(area, area))
    covers = (height > 0).any(axis=0) & (distance > tolerance * size)
    narrow = np.nonzero(covers & (distance < GRAZING_ANGLE * size * np.sqrt(dot(corners, corners).max(axis=0))))[0]
    covers[narrow] = _width(corners[:, :, narrow], tolerance) > EDGE_ON
    return covers


def _width(corners, tolerance):
    """(m,) The least width of polygons (3, k, m) in the view, of what rounding can turn their edges' planes by."""
    reach = np.sqrt(dot(corners, corners))
    following = np.r_[1 : corners.shape[1], 0]
    planes = cross(corners, corners[:, following])
    length = np.sqrt(dot(planes, planes))
    turn = _tilt(corners, corners[:, following], length, tolerance).max(axis=0)
    directions = corners / reach
    middle = _unit(directions + directions[:, following])  # an edge close by turns half around the point
    height = np.einsum("ikm,icm->kcm", divide(planes, length), np.concatenate([directions, middle], axis=1))
    # a corner that is there twice makes no edge
    return np.where(length > 0, np.abs(height).max(axis=1), np.inf).min(axis=0) / turn


def polygon_region(corners, height, tolerance, closing=None):
    """Region of polygons that cover directions, corners (3, k, m) relative to the point, clipped to height (k, m) >= 0.

    tolerance m: of the corners. closing (3, m): inward normal of the plane it is clipped by, if that contains the
    point (the horizon).
    """
    count = corners.shape[1]
    following = np.r_[1:count, 0]
    p, q = corners, corners[:, following]
    planes = cross(p, q)
    clockwise = dot(p[:, 0], planes[:, 1]) < 0
    length = np.sqrt(dot(planes, planes))
    tilt, planes = _tilt(p, q, length, tolerance), divide(np.where(clockwise, -1.0, 1.0) * planes, length)
    if (height < 0).any():
        p, q, leave, enter = clip_edges(p, q, height, height[following])
        bent = np.zeros(leave.shape[1])
        if closing is None:
            closing = np.where(clockwise, -1.0, 1.0) * cross(leave, enter)
            length = np.sqrt(dot(closing, closing))
            bent, closing = _tilt(leave, enter, length, tolerance), divide(closing, length)
        planes, tilt = np.concatenate([planes, closing[:, None]], axis=1), np.concatenate([tilt, bent[None]])
        p, q = np.concatenate([p, leave[:, None]], axis=1), np.concatenate([q, enter[:, None]], axis=1)
    p, q = np.where(clockwise, q, p), np.where(clockwise, p, q)
    return Region(p, q, planes, np.arange(planes.shape[1]), tilt)


def _tilt(p, q, length, tolerance):
    """What moving the ends of edges p, q (3, ..., m) by tolerance may turn their planes; length (..., m): |p x q|."""
    reach = np.sqrt(dot(p, p)) + np.sqrt(dot(q, q))
    return np.minimum(tolerance * divide(reach, length), STEEPEST)


def ball_source(balls, n):
    """Region of ellipsoids above the horizon of n (3, m): their outlines and the horizon's chord, in two edges."""
    a = _levels(balls.conic, n[:, None])[:, 0]
    cos, sin = _crossings(a)
    k0, k1, k2 = balls.conic[:, :, None]
    ends = np.where(_crosses(a), k0 + k1 * cos + k2 * sin, 0.0)
    # their bisector on the horizon, well defined up to a half turn (contact)
    leave, enter = ends[:, 0], ends[:, 1]
    a, b = _unit(leave), _unit(enter)
    middle = _unit(a + b + cross(n, a - b)) * np.sqrt(dot(leave, leave))
    p, q = np.stack([leave, middle], axis=1), np.stack([middle, enter], axis=1)
    return Region(p, q, n[:, None], np.zeros(2, int), np.zeros((1, n.shape[1])), balls)


def sky_source(n):
    """Region of all directions above the horizon of n (3, m); its circle in three edges."""
    u = across(n)
    v = cross(n, u)
    p = np.stack([u * np.cos(f) + v * np.sin(f) for f in (0.0, TURN / 3, 2 * TURN / 3)], axis=1)
    return Region(p, p[:, [1, 2, 0]], n[:, None], np.zeros(3, int), np.zeros((1, n.shape[1])))


def _gaps(low, high, row, start, end):
    """What intervals [start, end] (k,) of rows (k,) leave of each row's [low, high] (r,): lists row, start, end.

    What is before low and after high counts as hidden too. With starts and ends sorted apart, the gap after the i-th
    end is from there to the next start, if that is later: as many intervals have then begun as have ended.
    """
    rows = np.concatenate([np.arange(len(low)), row])
    # sorted as complex numbers: by rows, then within a row; stable, because there are long runs
    ends = np.sort(rows + 1j * np.concatenate([low, end]), kind="stable")
    starts = np.sort(rows + 1j * np.concatenate([high, start]), kind="stable")
    left = np.nonzero(starts.imag > ends.imag)[0]
    return ends.real[left].astype(int), ends.imag[left], starts.imag[left]


def _gaps_of_turn(count, row, start, end):
    """As _gaps for arcs [start, end] of whole turns, at most a turn long each, in rows 0 .. count - 1."""
    turns = TURN * np.floor(start / TURN)  # np.mod takes ten times as long
    start, end = start - turns, end - turns
    over = np.nonzero(end > TURN)[0]
    row, start = np.concatenate([row, row[over]]), np.concatenate([start, np.zeros(len(over))])
    end = np.concatenate([end, end[over] - TURN])
    return _gaps(np.zeros(count), np.full(count, TURN), row, start, end)


def _joined(lists):
    """Lists of intervals (row, start, end) as one."""
    return [np.concatenate(part) for part in zip((np.zeros(0, int), np.zeros(0), np.zeros(0)), *lists)]


def _levels(conic, planes):
    """Coefficients (3, k, m) of planes . r(f) = a0 + a1 cos f + a2 sin f, planes (3, k, m)"""
    return np.stack([np.einsum("im,ikm->km", k, planes) for k in conic])


def _crosses(a):
    """Whether a0 + a1 cos f + a2 sin f, a (3, ...), changes its sign (...)"""
    rho2 = a[1] * a[1] + a[2] * a[2]
    # a sliver too thin for its ends to be told apart is none: it would hold less than TINY ** 1.5
    return rho2 - a[0] * a[0] > TINY * rho2


def _crossings(a):
    """(cos f, sin f) (2, ...) on leaving the positive side of a0 + a1 cos f + a2 sin f, a (3, ...), and on entering."""
    a0, a1, a2 = a
    rho2 = a1 * a1 + a2 * a2
    root = np.sqrt(np.maximum(rho2 - a0 * a0, 0.0)) * LEAVE_ENTER.reshape(2, *(1,) * a0.ndim)
    return divide(-a0 * a1 - a2 * root, rho2), divide(-a0 * a2 + a1 * root, rho2)


def _positive(a):
    """The arc [start, end] (m,), (m,) where a0 + a1 cos f + a2 sin f is positive, a (3, m)"""
    a0, a1, a2 = a
    half = np.arctan2(np.sqrt(np.maximum(a1 * a1 + a2 * a2 - a0 * a0, 0.0)), -a0)
    middle = np.arctan2(a2, a1)
    return middle - half, middle + half


def _planes_and_balls(region, one, balls, other):
    """Of regions one (k,) and balls other (k,): what the balls hide of the regions' edges, intervals of rows
    (edge * m + region), and the arcs of the balls' outlines outside the planes, of rows 0 .. k - 1.

    Both come from the outline's crossings with the edge's plane, the very same numbers: a grazing ball is then either
    on both or on neither, however rounding falls.
    """
    a = _levels(balls.conic.take(other, axis=2), region.planes.take(one, axis=2))
    crosses = _crosses(a)
    outside = np.nonzero(((a[0] < -ROUNDING) & ~crosses).any(axis=0))[0]
    plane, pair = np.nonzero(crosses)
    a = a.reshape(3, -1).take(plane * len(one) + pair, axis=1)
    up, down = _positive(a)
    arcs = (pair, down, up + TURN), (outside, np.zeros(len(outside)), np.full(len(outside), TURN))
    # the edges in the planes that are crossed
    edge, crossing = np.nonzero(region.on[:, None] == plane)
    plane, pair, m = plane[crossing], pair[crossing], region.p.shape[2]
    row = edge * m + one[pair]
    p, q = (r.reshape(3, -1).take(row, axis=1) for r in (region.p, region.q))
    normal = region.planes.reshape(3, -1).take(plane * m + one[pair], axis=1)
    start, end = _edges_in_cones(p, q, normal, balls.conic.take(other[pair], axis=2), a.take(crossing, axis=1))
    keep = np.nonzero(end > start)[0]
    return (row[keep], start[keep], end[keep]), _joined(arcs)


def _edges_in_cones(p, q, normal, conic, a):
    """The part [start, end] (m,) of each edge whose directions are in the cone: one interval, the cone being convex.

    p, q, normal (3, m), a (3, m): levels of the conic over the edge's plane, which it crosses.
    """
    cos, sin = _crossings(a)
    k0, k1, k2 = conic[:, :, None]
    r = k0 + k1 * cos + k2 * sin
    along = cross(r, normal[:, None])  # r turned back by a right angle
    # the edge turns as the directions inside do: from where the outline leaves the plane's inner side to its entry
    d = q - p
    at_p, at_d = dot(p[:, None], along), dot(d[:, None], along)
    t = divide(at_p, -at_d)
    valid = (t > 0) & (t < 1) & (dot(p[:, None] + t * d[:, None], r) > 0)
    in_p, in_q = ((LEAVE_ENTER[:, None] * at < 0).all(axis=0) for at in (at_p, at_p + at_d))
    start = np.where(in_p, 0.0, np.where(valid[0], t[0], 2.0))
    return start, np.where(in_q, 1.0, np.where(valid[1], t[1], -1.0))


def _edges_in_planes(edges, planes, tilt, nudge, first=False):
    """The part [start, end] (e, m) of edges (p, q, their planes and tilt) inside all planes (3, k, m) of tilt (k, m),
    for edges that may coincide with a region's boundary.

    What rounding can turn the two planes by is what the edge is nudged by before it is tested, the same whichever of
    the two is the edge: INNER or OUTER, to that side of it; BOTH, to both sides.
    first (m,): where it is enough that one side is inside.
    """
    p, q, normals, own = edges
    along = np.einsum("ikm,iem->kem", planes, normals)
    shift = {INNER: along, OUTER: -along, BOTH: -np.abs(along)}[nudge]
    shift = np.where(first, np.abs(along), shift)
    shift = shift * (tilt[:, None] + own)
    a, b = (np.einsum("ikm,iem->kem", planes, r) + shift * np.sqrt(dot(r, r)) for r in (p, q))
    t = divide(a, a - b)
    start = np.where((a < 0) & (b >= 0), t, 0.0).max(axis=0)
    end = np.where((a >= 0) & (b < 0), t, 1.0).min(axis=0)
    return start, np.where(((a < 0) & (b < 0)).any(axis=0), -1.0, end)


def _edges_in_polygons(region, one, polygons, other, nudge, first=False):
    """What polygons other (k,) hide of the edges of regions one (k,): intervals of rows (edge * m + region)."""
    planes, tilt = polygons.planes.take(other, axis=2), polygons.tilt.take(other, axis=1)
    start, end = _edges_in_planes(region.edges(one), planes, tilt, nudge, first)
    edge, pair = np.nonzero(end > start)
    return edge * region.p.shape[2] + one[pair], start[edge, pair], end[edge, pair]


def _arcs_in_cones(balls, one, others, other):
    """Arcs of the outlines of balls one (k,) inside the cones of others other (k,), of rows 0 .. k - 1."""
    round_ = balls.round[one] & others.round[other]
    lists = []
    pair = np.nonzero(round_)[0]
    if len(pair):
        i, j = one[pair], other[pair]
        # |r| = 1 on a circular cone, so that the other cone is the plane r . axis = cos
        a = np.einsum("cim,im->cm", balls.conic.take(i, axis=2), others.axis.take(j, axis=1))
        a[0] -= others.cos[j]
        start, end = _positive(a)
        lists.append((pair, start, end))
    pair = np.nonzero(~round_)[0]
    if len(pair):
        row, start, end = _arcs_in_elliptic_cones(balls.conic.take(one[pair], axis=2), others, other[pair])
        lists.append((pair[row], start, end))
    return _joined(lists)


def _arcs_in_elliptic_cones(conic, others, other):
    """As _arcs_in_cones, for outlines conic (3, 3, k) of any kind: roots of a quartic, and a test between them."""
    c, k = others.c[:, other], conic
    if others.inverse is not None:  # else all are round, and directions need no scale
        k = np.einsum("ijm,cjm->cim", others.inverse[:, :, other], conic)
    w = [cross(c, v) for v in k]

    def form(i, j):
        return dot(k[i], k[j]) - dot(w[i], w[j])

    # Q(f) = s0 + s1 cos f + t1 sin f + s2 cos 2f + t2 sin 2f, as a quartic in z = exp(i f)
    s0, s2, t2 = form(0, 0) + (form(1, 1) + form(2, 2)) / 2, (form(1, 1) - form(2, 2)) / 2, form(1, 2)
    s1, t1 = 2 * form(0, 1), 2 * form(0, 2)
    z4, z3 = (s2 - 1j * t2) / 2, (s1 - 1j * t1) / 2
    least = 1e-14 * (np.abs(z3) + np.abs(s0)) + 1e-300  # two equal cones have no quartic: keep the division finite
    lead = np.where(np.abs(z4) > least, z4, least)
    companion = np.zeros((len(s0), 4, 4), complex)
    companion[:, 1, 0] = companion[:, 2, 1] = companion[:, 3, 2] = 1.0
    for row, coefficient in enumerate((np.conj(z4), np.conj(z3), s0 + 0j, z3)):
        companion[:, row, 3] = -coefficient / lead
    f = np.sort(np.mod(np.angle(np.linalg.eigvals(companion)).T, TURN), axis=0)
    f = np.concatenate([np.zeros((1, len(s0))), f, np.full((1, len(s0)), TURN)])
    # not the midpoint: in symmetric scenes that is where an outline touches a cone without crossing it
    middle = f[:-1] + ASIDE * np.diff(f, axis=0)
    k0, k1, k2 = k[:, :, None]
    r = k0 + k1 * np.cos(middle) + k2 * np.sin(middle)
    u = cross(c[:, None], r)
    piece, row = np.nonzero((dot(r, r) > dot(u, u)) & (dot(c[:, None], r) > 0))
    return row, f[piece, row], f[piece + 1, row]


def _along_edges(n, region, start, end, hidden):
    """Contour integral (m,) over the parts [start, end] (e, m) of the regions' edges outside the hidden intervals."""
    p, d = region.p, region.q - region.p
    c = cross(p, region.q)
    length, pp, pd, dd = np.sqrt(dot(c, c)).ravel(), dot(p, p).ravel(), dot(p, d).ravel(), dot(d, d).ravel()
    height = dot(n[:, None], region.planes)[region.on].ravel()
    row, a, b = _gaps(start.ravel(), np.where(dd > 0, end.ravel(), -1.0), *hidden)
    angle = np.arctan2((b - a) * length[row], pp[row] + (a + b) * pd[row] + a * b * dd[row])
    return np.bincount(row % n.shape[1], angle * height[row], minlength=n.shape[1])


def _along_outlines(n, balls, hidden):
    """Contour integral (m,) over the balls' outlines outside the hidden arcs; n (3, m)."""
    row, f0, f1 = _gaps_of_turn(n.shape[1], *hidden)
    nu, nv, na = (balls.sin * dot(n, k) for k in (balls.u, balls.v, balls.axis))
    wave = (np.cos(f1) - np.cos(f0)) * nv[row] - (np.sin(f1) - np.sin(f0)) * nu[row]
    value = balls.cos[row] * wave + (balls.sin * na)[row] * (f1 - f0)
    odd = np.nonzero(~balls.round[row])[0]
    if len(odd):
        value[odd] = _conic_integral(n[:, row[odd]], balls.conic[:, :, row[odd]], f0[odd], f1[odd])
    return np.bincount(row, value, minlength=n.shape[1])


def _conic_integral(n, conic, f0, f1):
    """n . integral of r x dr / |r|^2 (m,) over outlines conic (3, 3, m) from angle f0 to f1 (m,)"""
    nodes, weights = gauss_legendre(CONIC_POINTS)
    k0, k1, k2 = conic
    # n . (r x r') is a trigonometric polynomial: n . (k0 x k1), (k0 x k2), (k1 x k2)
    n01, n02, n12 = dot(n, cross(k0, k1)), dot(n, cross(k0, k2)), dot(n, cross(k1, k2))
    step, total = (f1 - f0) / CONIC_PARTS, np.zeros_like(f0)
    for part in range(CONIC_PARTS):
        f = f0 + step * (part + nodes[:, None])
        cos, sin = np.cos(f), np.sin(f)
        r = k0[:, None] + k1[:, None] * cos + k2[:, None] * sin
        total += step * (weights @ ((n12 - n01 * sin + n02 * cos) / dot(r, r)))
    return total


def _noise(region, tolerance):
    """(m,) What moving the corners of polygons by tolerance may change of the integrals along their edges."""
    p, q = region.p, region.q
    c = cross(p, q)
    length, reach = np.sqrt(dot(c, c)), np.minimum(dot(p, p), dot(q, q))
    turn = divide(np.sqrt(np.maximum(dot(p, p), dot(q, q))), length) * np.arctan2(length, dot(p, q))
    return tolerance * (turn + divide(1.0, np.sqrt(reach))).sum(axis=0)


def visible_integral(n, source, occluders, rounding):
    """Contour integral over 2 pi (m,) along the boundary of what is visible of the sources; n (3, m) unit normals.

    rounding m: of differences of coordinates; what it may have made of nothing is 0.
    """
    m, o = n.shape[1], occluders
    every, polygon, ball = np.arange(m), np.arange(len(o.polygon_of)), np.arange(len(o.ball_of))
    # what is hidden of each boundary: of sources by occluders, of occluders by each other and what is not the source
    edges, outside = _planes_and_balls(source, o.ball_of, o.balls, ball)
    source_edges = [edges, _edges_in_polygons(source, o.polygon_of, o.polygons, polygon, INNER)]
    outlines, source_outlines, polygon_edges = [outside], [], []
    planes, tilt = source.planes.take(o.polygon_of, axis=2), source.tilt.take(o.polygon_of, axis=1)
    low, high = _edges_in_planes(o.polygons.edges(polygon), planes, tilt, BOTH)
    if source.balls is not None:
        source_outlines.append(_planes_and_balls(source, every, source.balls, every)[1])
        row, *arc = _arcs_in_cones(source.balls, o.ball_of, o.balls, ball)
        source_outlines.append((o.ball_of[row], *arc))
        outlines.append(_gaps_of_turn(len(ball), *_arcs_in_cones(o.balls, ball, source.balls, o.ball_of)))
        edges, outside = _planes_and_balls(o.polygons, polygon, source.balls, o.polygon_of)
        polygon_edges.append(_gaps(0 * low.ravel(), 1 + 0 * low.ravel(), *edges))
        row, *arc = _gaps_of_turn(len(polygon), *outside)
        source_outlines.append((o.polygon_of[row], *arc))
    for i, j in zip(*(parts(a, CACHED) for a in o.polygon_ball)):
        edges, outside = _planes_and_balls(o.polygons, i, o.balls, j)
        polygon_edges.append(edges)
        row, *arc = _gaps_of_turn(len(i), *outside)
        outlines.append((j[row], *arc))
    for i, j in zip(*(parts(a, CACHED) for a in o.ball_ball)):
        row, *arc = _arcs_in_cones(o.balls, i, o.balls, j)
        outlines.append((i[row], *arc))
    for i, j, first in zip(*(parts(a, CACHED) for a in (*o.polygon_polygon, o.first))):
        polygon_edges.append(_edges_in_polygons(o.polygons, i, o.polygons, j, OUTER, first))
    whole = np.zeros(source.p.shape[1:]), np.ones(source.p.shape[1:])
    total = _along_edges(n, source, *whole, _joined(source_edges))
    if source.balls is not None:
        total = total + _along_outlines(n, source.balls, _joined(source_outlines))
    of_polygons = _along_edges(n.take(o.polygon_of, axis=1), o.polygons, low, high, _joined(polygon_edges))
    of_balls = _along_outlines(n.take(o.ball_of, axis=1), o.balls, _joined(outlines))
    hidden = np.bincount(o.polygon_of, of_polygons, minlength=m) + np.bincount(o.ball_of, of_balls, minlength=m)
    left = (total - hidden) / TURN
    dark = np.nonzero(left < NOTHING)[0]
    if len(dark):
        noise = _noise(o.polygons, rounding)
        noise = np.bincount(o.polygon_of, noise, minlength=m)[dark]
        left[dark[left[dark] < noise]] = 0.0
    return left
