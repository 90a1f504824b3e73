"""Exact occlusion: what an oriented point receives from a source behind any number of convex occluders.

Seen from the point every convex source S and every occluder O is a convex region of directions, bounded by
great-circle arcs (straight edges) and conic arcs (outlines of ellipsoids). The visible region S minus the union
of the O has as boundary the pieces of S's boundary outside all O, and the pieces of each O's boundary inside S
and outside all other O; the form factor is the contour integral n . sum of integral r x dr / (2 pi) over them.
Breakpoints are roots of linear and quadratic equations, so nothing is sampled. The predicates of what hides what
are those of `Region`; coinciding boundaries (boxes, screens standing on floors) are told apart by nudging the arc
in question to its inner or outer side by COINCIDENT.

Arrays are component first, (3, pieces, pairs); everything is relative to the point.
"""

import copy
from dataclasses import dataclass

import numpy as np

from .closed_forms import across, clip_edges, cross, divide, dot
from .numerics import gauss_legendre

COINCIDENT = 1e-12  # sine of the angle below which two arcs count as one; the error made is of this size
GRAZING = 1e-12  # relative depth of a sliver that is none
ROUNDING = 1e-15
SHORTEST = 1e-15  # angle of a piece of an outline
ASIDE = 0.4323  # where a piece of an outline is tested
INNER, OUTER, BOTH = range(3)
TURN = 2 * np.pi
EDGE_ON = 1e-14  # of the cube of its reach: a polygon of less volume with the point is seen edge-on
CONIC_POINTS, CONIC_PARTS = 16, 4  # Gauss rule for arcs of elliptic cones, per part of a piece


def _unit(a):
    return divide(a, np.sqrt(dot(a, a)))


@dataclass
class Ball:
    """An ellipsoid as the unit ball at centre c (3, m) of the space that `linear` (3, 3, m) maps to the world.

    For a round sphere `linear` is None and `scale` (m,) is 1 / radius: directions need no scale. `conic` are the
    vectors k0, k1, k2 (3, m) of its outline's directions r(f) = k0 + k1 cos f + k2 sin f, counter-clockwise seen from
    the point.
    """

    c: np.ndarray
    scale: np.ndarray | None = None
    linear: np.ndarray | None = None
    inverse: np.ndarray | None = None

    def __post_init__(self):
        h = np.sqrt(dot(self.c, self.c))
        axis = divide(self.c, h)
        cos = np.sqrt(np.maximum((h - 1) * (h + 1), 0.0)) / np.maximum(h, 1.0)
        sin = 1 / np.maximum(h, 1.0)
        u = across(axis)
        v = cross(axis, u)
        conic = [self.to_world(k) for k in (cos * axis, sin * u, sin * v)]
        self._unpack(np.concatenate([self.c, axis, u, v, *conic, [h, cos, sin]]))

    def _unpack(self, packed):
        self.packed = packed  # all in one array, to be taken from at once
        self.c, self.axis, self.u, self.v = packed[0:3], packed[3:6], packed[6:9], packed[9:12]
        self.conic = packed[12:15], packed[15:18], packed[18:21]
        self.distance, self.cos, self.sin = packed[21:]

    def take(self, index):
        """The balls index (k,) of these, which have to be round."""
        taken = copy.copy(self)
        taken.scale = self.scale.take(index)
        taken._unpack(self.packed.take(index, axis=1))
        return taken

    def points_to_local(self, p):
        """Offsets (3, ...) m from the point to the ball's own space."""
        return p * self.scale if self.inverse is None else transform(self.inverse, p)

    def to_local(self, r):
        return r if self.inverse is None else transform(self.inverse, r)

    def to_world(self, r):
        return r if self.linear is None else transform(self.linear, r)

    def form(self, r):
        """Q (e, m) >= 0 where the line of direction r (3, e, m) meets the ball, and b > 0 where it does so ahead."""
        r = self.to_local(r)
        u = cross(self.c[:, None], r)
        return dot(r, r) - dot(u, u), dot(self.c[:, None], r)


def transform(matrix, r):
    """matrix (3, 3, m) applied to r (3, m) or (3, e, m)."""
    m = matrix if r.ndim == 2 else matrix[:, :, None]
    return np.stack([m[i, 0] * r[0] + m[i, 1] * r[1] + m[i, 2] * r[2] for i in range(3)])


@dataclass
class Region:
    """A convex set of directions: inside all planes (3, p, m) (unit inward normals, zero where unbounded) and the ball.

    p, q (3, e, m): its straight edges, counter-clockwise; edge_planes (3, e, m) their inward normals.
    active (m,): padding and what lies behind the source is not.
    """

    p: np.ndarray
    q: np.ndarray
    edge_planes: np.ndarray
    planes: np.ndarray
    ball: Ball | None
    active: np.ndarray

    def take(self, index, active=None):
        """The regions index (k,) of these; active (k,): which of them are, if not those that were."""
        edges = (self.p, self.q, self.edge_planes, self.planes)
        p, q, edge_planes, planes = (a.take(index, axis=-1) for a in edges)
        ball = self.ball and self.ball.take(index)
        own = self.active.take(index)
        return Region(p, q, edge_planes, planes, ball, own if active is None else own & active)


def polygon_region(corners, height, active, closing=None):
    """Region of a polygon, corners (3, k, m) relative to the point, clipped to height (k, m) >= 0.

    closing (3, m): inward normal of the plane it is clipped by, if that contains the point (the horizon).
    """
    following = np.roll(corners, -1, axis=1)
    start, end, leave, enter = clip_edges(corners, following, height, np.roll(height, -1, axis=0))
    planes = cross(corners, following)
    facing = dot(corners[:, 0], planes[:, 1])
    reach = np.sqrt(dot(corners, corners).max(axis=0))
    # edge-on, or seen from its own plane: covers no directions
    active = active & (height > 0).any(axis=0) & (np.abs(facing) > EDGE_ON * reach**3)
    sign = np.where(facing < 0, -1.0, 1.0)
    if closing is None:
        closing = _unit(sign * cross(leave, enter))
    planes = np.concatenate([_unit(sign * planes), closing[:, None]], axis=1)
    p = np.concatenate([start, leave[:, None]], axis=1)
    q = np.concatenate([end, enter[:, None]], axis=1)
    clockwise = sign < 0
    return Region(np.where(clockwise, q, p), np.where(clockwise, p, q), planes, planes, None, active)


def ball_region(ball, active):
    """Region of an ellipsoid as an occluder: no straight edges."""
    none = np.zeros((3, 0, ball.c.shape[1]))
    return Region(none, none, none, none, ball, active)


def ball_source(ball, n):
    """Region of an ellipsoid above the horizon of n (3, m): its outline and the horizon's chord, in two edges."""
    crosses, *ends = _conic_crossings(ball.conic, n[:, None])
    cut = crosses[0]
    k0, k1, k2 = ball.conic
    enter, leave = (np.where(cut, k0 + k1 * cos[0] + k2 * sin[0], 0.0) for cos, sin in ends)
    # their bisector on the horizon, well defined up to a half turn (contact)
    a, b = _unit(leave), _unit(enter)
    middle = _unit(a + b + cross(n, a - b)) * np.sqrt(dot(leave, leave))
    p, q = np.stack([leave, middle], axis=1), np.stack([middle, enter], axis=1)
    return Region(p, q, np.stack([n, n], axis=1), n[:, None], ball, np.ones(n.shape[1], bool))


def sky_source(n):
    """Region of all directions above the horizon of n (3, m); its circle in three edges."""
    u = across(n)
    v = cross(n, u)
    p = np.stack([u * np.cos(f) + v * np.sin(f) for f in (0.0, TURN / 3, 2 * TURN / 3)], axis=1)
    return Region(p, np.roll(p, -1, axis=1), np.stack([n] * 3, axis=1), n[:, None], None, np.ones(n.shape[1], bool))


def _edges_in_planes(p, q, planes, edge_planes, nudge, first):
    """The part [lo, hi] (e, m) of each edge inside all planes, for edges that may coincide with a region's boundary.

    nudge says where the edge is tested: INNER or OUTER, just on that side of it; BOTH, on both sides.
    first (m,): where it is enough that one side is inside.
    """
    lo, hi = np.zeros(p.shape[1:]), np.ones(p.shape[1:])
    length_p, length_q = np.sqrt(dot(p, p)), np.sqrt(dot(q, q))
    for k in range(planes.shape[1]):
        m = planes[:, k][:, None]
        along = dot(edge_planes, m)
        shift = COINCIDENT * {INNER: along, OUTER: -along, BOTH: -np.abs(along)}[nudge]
        if first is not None:
            shift = np.where(first, COINCIDENT * np.abs(along), shift)
        a, b = dot(m, p) + shift * length_p, dot(m, q) + shift * length_q
        t = divide(a, a - b)
        lo = np.where((a < 0) & (b >= 0), np.maximum(lo, t), lo)
        hi = np.where((a >= 0) & (b < 0), np.minimum(hi, t), hi)
        hi = np.where((a < 0) & (b < 0), -1.0, hi)
    return lo, hi


def _conic_crossings(conic, planes):
    """Where the conic crosses each plane (3, p, m): a mask (p, m) and (cos f, sin f) on entering and on leaving."""
    a0, a1, a2 = (dot(planes, k[:, None]) for k in conic)
    rho2 = a1 * a1 + a2 * a2
    reach = rho2 - a0 * a0
    # a sliver too thin for its midpoint to be told from its edge is none: it would hold less than GRAZING ** 1.5
    crosses = reach > GRAZING * rho2
    root = np.sqrt(np.where(crosses, reach, 0.0))
    scale = np.where(crosses, 1 / np.where(crosses, rho2, 1.0), 0.0)
    enter = (-a0 * a1 + a2 * root) * scale, (-a0 * a2 - a1 * root) * scale
    leave = (-a0 * a1 - a2 * root) * scale, (-a0 * a2 + a1 * root) * scale
    return crosses, enter, leave


def _edges_in_ball(p, q, planes, ball):
    """The part [lo, hi] (e, m) of each edge whose directions meet the ball: one interval, the cone being convex.

    Found from the outline's crossings with the edge's plane, the very numbers that split the outline: a grazing
    ball is then either on both or on neither, however rounding falls.
    """
    crosses, *ends = _conic_crossings(ball.conic, planes)
    d = q - p
    k0, k1, k2 = (k[:, None] for k in ball.conic)
    # the edge turns as the directions inside do: from where the outline leaves the plane's inner side to its entry
    found = []
    in_p, in_q = crosses.copy(), crosses.copy()
    for (cos, sin), turn in zip(ends[::-1], (1.0, -1.0)):
        r = k0 + k1 * cos + k2 * sin
        along = cross(r, planes)  # r turned back by a right angle
        at_p, at_d = dot(p, along), dot(d, along)
        t = divide(at_p, -at_d)
        valid = crosses & (t > 0) & (t < 1) & (dot(p + t * d, r) > 0)
        found.append((t, valid))
        in_p &= turn * at_p < 0
        in_q &= turn * (at_p + at_d) < 0
    (t_in, valid_in), (t_out, valid_out) = found
    first = np.where(in_p, 0.0, np.where(valid_in, t_in, 2.0))
    last = np.where(in_q, 1.0, np.where(valid_out, t_out, -1.0))
    return first, last


def _edges_in(region, p, q, edge_planes, nudge, first=None):
    lo, hi = _edges_in_planes(p, q, region.planes, edge_planes, nudge, first)
    if region.ball is not None:
        from_, to = _edges_in_ball(p, q, edge_planes, region.ball)
        lo, hi = np.maximum(lo, from_), np.minimum(hi, to)
    return lo, np.where(region.active, hi, -1.0)


def _edge_pieces(n, p, q, planes, lo, hi, hidden):
    """Contour integral (m,) over the parts of the edges in [lo, hi] outside the hidden intervals [(lo, hi), ...]."""
    c = cross(p, q)
    length = np.sqrt(dot(c, c))
    d = q - p
    pp, pd, dd = dot(p, p), dot(p, d), dot(d, d)
    if hidden:
        starts = np.stack([np.where(b > a, a, 1.0) for a, b in hidden])
        ends = np.stack([np.where(b > a, b, 1.0) for a, b in hidden])
        order = np.argsort(starts, axis=0)
        starts, ends = np.take_along_axis(starts, order, 0), np.take_along_axis(ends, order, 0)
        ends = np.maximum.accumulate(ends, axis=0)
        a = np.concatenate([lo[None], np.maximum(ends, lo)])
        b = np.concatenate([np.minimum(starts, hi), hi[None]])
    else:
        a, b = lo[None], hi[None]
    angle = np.arctan2(np.maximum(b - a, 0.0) * length, pp + (a + b) * pd + a * b * dd)
    angle = np.where(b > a, angle, 0.0).sum(axis=0)
    return (angle * dot(n[:, None], planes)).sum(axis=0)


def _conic_plane_breaks(conic, planes):
    """Angles (2 p, m) where the conic crosses each plane; 0 where it does not."""
    crosses, *ends = _conic_crossings(conic, planes)
    return np.concatenate([np.where(crosses, np.arctan2(sin, cos), 0.0) for cos, sin in ends])


def _both_round(ball, other):
    return other is not None and ball.linear is None and other.linear is None


def _arc_within(ball, other):
    """Of round balls: the angle (m,) in [0, a turn) at which the outline of `ball` enters the cone of `other`, and the
    one at which it leaves it again: the same where they are apart, a turn later where it never does."""
    # |r| = 1 on a circular cone, so that the other cone is the plane r . axis = cos
    a0 = ball.cos * dot(ball.axis, other.axis) - other.cos
    a1, a2 = ball.sin * dot(ball.u, other.axis), ball.sin * dot(ball.v, other.axis)
    half = np.arctan2(np.sqrt(np.maximum(a1 * a1 + a2 * a2 - a0 * a0, 0.0)), -a0)
    start = np.mod(np.arctan2(a2, a1) - half, TURN)
    return start, start + 2 * half


def _conic_ball_breaks(ball, other):
    """Angles (2 or 4, m) where the outline of `ball` crosses the outline of `other`."""
    if _both_round(ball, other):
        return np.stack(_arc_within(ball, other))
    k = [other.to_local(k) for k in ball.conic]
    w = [cross(other.c, v) for v in k]

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
    return np.angle(np.linalg.eigvals(companion)).T


def _inside(region, r):
    """r (3, j, m) -> (j, m)"""
    result = np.broadcast_to(region.active, r.shape[1:]).copy()
    least = -ROUNDING * np.sqrt(dot(r, r))
    for k in range(region.planes.shape[1]):
        result &= dot(region.planes[:, k][:, None], r) >= least
    if region.ball is not None:
        q0, b0 = region.ball.form(r)
        result &= (q0 > 0) & (b0 > 0)
    return result


def _conic_breaks(ball, region):
    breaks = [_conic_plane_breaks(ball.conic, region.planes)]
    if region.ball is not None:
        breaks.append(_conic_ball_breaks(ball, region.ball))
    return breaks


def _arc_integral(n, ball, f0, f1):
    """n . integral of r x dr over the outline from angle f0 to f1 >= f0; (j, m) -> (j, m)"""
    if ball.linear is None:
        nu, nv, na = dot(n, ball.u), dot(n, ball.v), dot(n, ball.axis)
        wave = (np.cos(f1) - np.cos(f0)) * nv - (np.sin(f1) - np.sin(f0)) * nu
        return ball.cos * ball.sin * wave + ball.sin**2 * (f1 - f0) * na
    nodes, weights = gauss_legendre(CONIC_POINTS)
    k0, k1, k2 = ball.conic
    # n . (r x r') is a trigonometric polynomial: n . (k0 x k1), (k0 x k2), (k1 x k2)
    n01, n02, n12 = dot(n, cross(k0, k1)), dot(n, cross(k0, k2)), dot(n, cross(k1, k2))
    total = np.zeros_like(f0)
    step = (f1 - f0) / CONIC_PARTS
    for part in range(CONIC_PARTS):
        for node, weight in zip(nodes, weights):
            f = f0 + step * (part + node)
            cos, sin = np.cos(f), np.sin(f)
            r = [k0[i] + k1[i] * cos + k2[i] * sin for i in range(3)]
            total += weight * step * (n12 - n01 * sin + n02 * cos) / (r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
    return total


def _arc_above(ball, planes):
    """Of round balls: the angle (p, m) in [0, a turn) at which the outline comes above planes (3, p, m), and how far
    from there it stays so."""
    a0, a1, a2 = (dot(planes, k[:, None]) for k in ball.conic)
    rho2 = a1 * a1 + a2 * a2
    reach = rho2 - a0 * a0
    half = np.arctan2(np.sqrt(np.maximum(reach, 0.0)), -a0)
    half = np.where(reach > GRAZING * rho2, half, np.where(a0 >= 0, TURN / 2, 0.0))  # as in _conic_crossings
    return np.mod(np.arctan2(a2, a1) - half, TURN), 2 * half


def _round_pieces(n, ball, inside, outside):
    """As _conic_pieces where all balls are round: what hides the outline are intervals of its angle, in their union."""
    rise, width = _arc_above(ball, inside.planes)
    arcs = [(np.mod(rise + width, TURN), TURN - width)]
    if inside.ball is not None:
        start, end = _arc_within(ball, inside.ball)
        arcs.append((np.mod(end, TURN)[None], (start - end + TURN)[None]))
    for region in outside:
        start, end = _arc_within(ball, region.ball)
        arcs.append((start[None], ((end - start) * region.active)[None]))
    start, width = (np.concatenate(part) for part in zip(*arcs))
    order = np.argsort(start, axis=0)
    start, end = (np.take_along_axis(a, order, 0) for a in (start, start + width))
    over = np.maximum(end.max(axis=0) - TURN, 0.0)[None]  # what reaches past a whole turn hides the beginning
    f0 = np.concatenate([over, np.maximum(np.maximum.accumulate(end, axis=0), over)])
    f1 = np.concatenate([start, np.full(over.shape, TURN)])
    piece, at = np.nonzero(f1 - f0 > SHORTEST)
    f0, f1 = f0[piece, at], f1[piece, at]
    nu, nv, na = (dot(n, k).take(at) for k in (ball.u, ball.v, ball.axis))
    sin = ball.sin.take(at)
    wave = (np.cos(f1) - np.cos(f0)) * nv - (np.sin(f1) - np.sin(f0)) * nu
    value = sin * (ball.cos.take(at) * wave + sin * (f1 - f0) * na)
    return np.bincount(at, value, minlength=n.shape[1])


def _conic_pieces(n, ball, inside, outside):
    """Contour integral (m,) over the parts of ball's outline inside one region and outside others."""
    if all(b is not None and b.linear is None for b in (ball, inside.ball or ball, *(o.ball for o in outside))):
        return _round_pieces(n, ball, inside, outside)
    hiding = [o for o in outside if _both_round(ball, o.ball)]  # of these the arc that they hide is known
    others = [o for o in outside if not _both_round(ball, o.ball)]
    arcs = [_arc_within(ball, o.ball) for o in hiding]
    breaks = [np.stack(arc) for arc in arcs]
    for region in [inside, *others]:
        breaks += _conic_breaks(ball, region)
    breaks = np.concatenate([np.mod(b, TURN) for b in breaks])
    breaks.sort(axis=0)
    zero = np.zeros((1, breaks.shape[1]))
    f0, f1 = np.concatenate([zero, breaks]), np.concatenate([breaks, zero + TURN])
    # not the midpoint: in symmetric scenes that is where an outline touches a plane without crossing it
    middle = f0 + ASIDE * (f1 - f0)
    k0, k1, k2 = (k[:, None] for k in ball.conic)
    r = k0 + k1 * np.cos(middle) + k2 * np.sin(middle)
    keep = (f1 - f0 > SHORTEST) & _inside(inside, r)
    for region in others:
        keep &= ~_inside(region, r)
    for region, (start, end) in zip(hiding, arcs):
        within = ((middle > start) & (middle < end)) | (middle + TURN < end)
        keep &= ~(within & region.active)
    return np.where(keep, _arc_integral(n, ball, f0, f1), 0.0).sum(axis=0)


def source_integral(n, source, occluders):
    """Contour integral over 2 pi (m,) along the source's own boundary outside all occluders; n (3, m) unit normals."""
    lo = np.zeros(source.p.shape[1:])
    hidden = [_edges_in(o, source.p, source.q, source.edge_planes, INNER) for o in occluders]
    total = _edge_pieces(n, source.p, source.q, source.edge_planes, lo, lo + 1.0, hidden)
    if source.ball is not None:
        horizon = Region(source.p, source.q, source.edge_planes, source.planes, None, source.active)
        total += _conic_pieces(n, source.ball, horizon, occluders)
    return np.where(source.active, total, 0.0) / TURN


def occluder_integral(n, occluder, source, others, first):
    """Contour integral over 2 pi (m,) along one occluder's boundary inside the source and outside the others.

    first: for each of the others (m,), whether it comes before the occluder: of two coinciding edges on the same
    side the first one's counts, on opposite sides neither.
    """
    if occluder.ball is not None:
        total = _conic_pieces(n, occluder.ball, source, others)
    else:
        p, q, planes = occluder.p, occluder.q, occluder.edge_planes
        lo, hi = _edges_in(source, p, q, planes, BOTH)
        hidden = [_edges_in(o, p, q, planes, OUTER, f) for o, f in zip(others, first)]
        total = _edge_pieces(n, p, q, planes, lo, np.maximum(hi, lo), hidden)
    return np.where(occluder.active & source.active, total, 0.0) / TURN
