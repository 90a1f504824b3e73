"""What convex regions of directions hide of each other's edges and outlines: intervals, by roots of polynomials.

An edge, or an outline, is hidden along intervals whose ends are roots of linear, quadratic or quartic equations:
nothing is sampled. Coinciding boundaries (boxes, screens standing on floors) are told apart by nudging the edge in
question to its inner or outer side, by what the rounding of the coordinates can move it. Which region meets which is a
list of index pairs, an interval a triple (row, start, end): all of a batch are found at once.
"""

import numpy as np

from .closed_forms import cross, divide, dot
from .sinusoids import LEAVE_ENTER, TURN, crosses, crossings, levels, positive
from .tolerances import ROUNDING, TINY

ASIDE = 0.4323  # where a piece of an outline is tested against an elliptic cone
INNER, OUTER, BOTH = range(3)


def gaps(low, high, row, start, end):
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


def gaps_of_turn(count, row, start, end):
    """As gaps for arcs [start, end] of whole turns, at most a turn long each, in rows 0 .. count - 1."""
    turns = TURN * np.floor(start / TURN)  # np.mod takes ten times as long
    start, end = start - turns, end - turns
    over = np.nonzero(end > TURN)[0]
    row, start = np.concatenate([row, row[over]]), np.concatenate([start, np.zeros(len(over))])
    end = np.concatenate([end, end[over] - TURN])
    return gaps(np.zeros(count), np.full(count, TURN), row, start, end)


def joined(lists):
    """Lists of intervals (row, start, end) as one."""
    return [np.concatenate(part) for part in zip((np.zeros(0, int), np.zeros(0), np.zeros(0)), *lists)]


def planes_and_balls(region, one, balls, other):
    """Of regions one (k,) and balls other (k,): what the balls hide of the regions' edges, intervals of rows
    (edge * m + region), and the arcs of the balls' outlines outside the planes, of rows 0 .. k - 1.

    Both come from the outline's crossings with the edge's plane, the very same numbers: a grazing ball is then either
    on both or on neither, however rounding falls.
    """
    a = levels(balls.conic.take(other, axis=2), region.planes.take(one, axis=2))
    meets = crosses(a)
    outside = np.nonzero(((a[0] < -ROUNDING) & ~meets).any(axis=0))[0]
    plane, pair = np.nonzero(meets)
    a = a.reshape(3, -1).take(plane * len(one) + pair, axis=1)
    up, down = positive(a)
    arcs = (pair, down, up + TURN), (outside, np.zeros(len(outside)), np.full(len(outside), TURN))
    # the edges in the planes that are crossed
    edge, crossing = np.nonzero(region.on[:, None] == plane)
    plane, pair, m = plane[crossing], pair[crossing], region.p.shape[2]
    row = edge * m + one[pair]
    p, q = (r.reshape(3, -1).take(row, axis=1) for r in (region.p, region.q))
    normal = region.planes.reshape(3, -1).take(plane * m + one[pair], axis=1)
    start, end = _edges_in_cones(p, q, normal, balls.conic.take(other[pair], axis=2), a.take(crossing, axis=1))
    keep = np.nonzero(end > start)[0]
    return (row[keep], start[keep], end[keep]), joined(arcs)


def _edges_in_cones(p, q, normal, conic, a):
    """The part [start, end] (m,) of each edge whose directions are in the cone: one interval, the cone being convex.

    p, q, normal (3, m), a (3, m): levels of the conic over the edge's plane, which it crosses.
    """
    cos, sin = crossings(a)
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


def edges_in_planes(edges, planes, tilt, nudge, first=False):
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
    turn = tilt[:, None] + own
    shift = np.where(along**2 > 1 - TINY - turn**2, shift * turn, 0.0)
    a, b = (np.einsum("ikm,iem->kem", planes, r) + shift * np.sqrt(dot(r, r)) for r in (p, q))
    t = divide(a, a - b)
    start = np.where((a < 0) & (b >= 0), t, 0.0).max(axis=0)
    end = np.where((a >= 0) & (b < 0), t, 1.0).min(axis=0)
    return start, np.where(((a < 0) & (b < 0)).any(axis=0), -1.0, end)


def edges_in_polygons(region, one, polygons, other, nudge, first=False):
    """What polygons other (k,) hide of the edges of regions one (k,): intervals of rows (edge * m + region)."""
    planes, tilt = polygons.planes.take(other, axis=2), polygons.tilt.take(other, axis=1)
    start, end = edges_in_planes(region.edges(one), planes, tilt, nudge, first)
    edge, pair = np.nonzero(end > start)
    return edge * region.p.shape[2] + one[pair], start[edge, pair], end[edge, pair]


def arcs_in_cones(balls, one, others, other):
    """Arcs of the outlines of balls one (k,) inside the cones of others other (k,), of rows 0 .. k - 1."""
    round_ = balls.round[one] & others.round[other]
    lists = []
    pair = np.nonzero(round_)[0]
    if len(pair):
        i, j = one[pair], other[pair]
        # |r| = 1 on a circular cone, so that the other cone is the plane r . axis = cos
        a = np.einsum("cim,im->cm", balls.conic.take(i, axis=2), others.axis.take(j, axis=1))
        a[0] -= others.cos[j]
        start, end = positive(a)
        lists.append((pair, start, end))
    pair = np.nonzero(~round_)[0]
    if len(pair):
        row, start, end = _arcs_in_elliptic_cones(balls.conic.take(one[pair], axis=2), others, other[pair])
        lists.append((pair[row], start, end))
    return joined(lists)


def _arcs_in_elliptic_cones(conic, others, other):
    """As arcs_in_cones, for outlines conic (3, 3, k) of any kind: roots of a quartic, and a test between them."""
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
