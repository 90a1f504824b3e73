"""Convex regions of directions: what an oriented point sees of polygons, ellipsoids and the sky.

Seen from the point every convex shape is bounded by great-circle arcs (straight edges) and conic arcs (outlines of
ellipsoids). Arrays are component first and flat, (3, edges, regions); everything is relative to the point.
"""

from dataclasses import dataclass

import numpy as np

from .closed_forms import across, cross, divide, dot
from .contour import clip_edges
from .sinusoids import TURN, crosses, crossings, levels
from .tolerances import CLEAR

GRAZING_ANGLE = 1e-4  # sine of the angle above which no polygon is seen edge-on
EDGE_ON = 8  # turns by rounding: a polygon no wider than so many in the view hides nothing
STEEPEST = 1e-3  # tilt of a plane, as a sine, that rounding is taken to cause at most: of edges seen end-on
PASSED = 1 / CLEAR  # the same of edges that points pass by as close as they keep from what stands on their surface


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
    covers[narrow] = _width(corners[:, :, narrow], area[:, narrow], tolerance) > EDGE_ON
    return covers


def _width(corners, area, tolerance):
    """(m,) The least width of polygons (3, k, m), area vectors (3, m), in the view, of what rounding can turn their
    edges' planes by; inf of those that the point is close before: these fill half of it."""
    reach = np.sqrt(dot(corners, corners))
    following = np.r_[1 : corners.shape[1], 0]
    planes = cross(corners, corners[:, following])
    length = np.sqrt(dot(planes, planes))
    turn = np.minimum(_tilt(corners, corners[:, following], length, tolerance), STEEPEST)
    directions = corners / reach
    middle = _unit(directions + directions[:, following])  # an edge close by turns half around the point
    height = np.einsum("ikm,icm->kcm", divide(planes, length), np.concatenate([directions, middle], axis=1))
    # a corner that is there twice makes no edge
    width = np.where(length > 0, np.abs(height).max(axis=1), np.inf).min(axis=0) / turn.max(axis=0)
    # on which sides of the edges it is, or so near these that rounding may tell
    foot, slack = np.einsum("ikm,im->km", planes, area), turn * length * np.sqrt(dot(area, area))
    return np.where((foot >= -slack).all(axis=0) | (foot <= slack).all(axis=0), np.inf, width)


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
    return np.minimum(tolerance * divide(reach, length), PASSED)


def ball_source(balls, n):
    """Region of ellipsoids above the horizon of n (3, m): their outlines and the horizon's chord, in two edges."""
    a = levels(balls.conic, n[:, None])[:, 0]
    cos, sin = crossings(a)
    k0, k1, k2 = balls.conic[:, :, None]
    ends = np.where(crosses(a), k0 + k1 * cos + k2 * sin, 0.0)
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
