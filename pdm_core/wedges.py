"""Points of flat shapes at the feet of others: which way they are in the open.

What stands on a flat shape parts the directions about a point of its foot into wedges, and so do the shape's own
edges. Where a point is come near from another direction its light has another limit. It is that of the middle of a
wedge: of one that is not covered and that what bounds it shows a surface to, of several such the widest.
"""

import numpy as np

from .at_once import lowest
from .shapes.shape import PARALLEL, unit
from .tolerances import CLEAR

TURN = 2 * np.pi


def _local(planes, k, points):
    """Positions (n, 2) of points (n, 3) m along the edges of planes k (n,)."""
    return np.einsum("nij,nj->ni", planes.inverse[k, :2], points - planes.corners[k, 0])


def within(planes, k, points, by):
    """(n,) Whether points (n, 3) m are over planes k (n,), off their borders by more than so many m."""
    at, by = _local(planes, k, points), np.broadcast_to(by, len(k))[:, None] / planes.edges[k]
    inside = (np.abs(at - 0.5) < 0.5 - by).all(axis=1)
    return inside & (~planes.half[k] | (at.sum(axis=1) < 1 - by.sum(axis=1)))


def to_border(planes, k, points, border):
    """Points (n, 3) m of planes k (n,): those about as near to a border as border (n, 2) of the edges moved to it ->
    (n, 3), and on which end of each edge they are (n, 2): -1, 1, or 0 for neither."""
    at = _local(planes, k, points)
    end = 1 * (at > 1 - 2 * border) - (at < 2 * border)
    off = np.where(end, (1 + end) / 2 - at, 0.0)
    sides = planes.corners[k][:, [1, 3]] - planes.corners[k, :1]
    return points + np.einsum("nk,nki->ni", off, sides), end


class Rays:
    """Directions in which flat shapes go on from points of others: point (r,), direction (r, 3) unit vectors in the
    planes of these, across (r, 3) unit normals of what goes on, shows (r, 2): on its left and on its right 0 for no
    surface, 1 for one, 2 for that of the lit side."""

    def __init__(self, point, direction, across, shows):
        self.point, self.direction, self.across, self.shows = point, direction, across, shows

    @classmethod
    def of(cls, *several):
        parts = zip(*((rays.point, rays.direction, rays.across, rays.shows) for rays in several))
        return cls(*map(np.concatenate, parts))

    def take(self, index):
        return Rays(self.point[index], self.direction[index], self.across[index], self.shows[index])


def feet(planes, shows, points, normals, standing, reach, near):
    """Rays of planes through points (n, 3) m of flat shapes with normals (n, 3), pairs standing: point and plane (e,).

    shows (planes, 2): see Rays, of each one's front and back; reach (n,) m: how far they go on at least, near m at most
    beyond their ends.
    """
    (point, k), out = standing, []
    along = unit(np.cross(normals[point], planes.normal[k]))
    for direction in (along, -along):
        on = np.flatnonzero(within(planes, k, points[point] + reach[point, None] * direction, -near))
        on = on[along[on].any(axis=1)]
        d, across, shown = direction[on], planes.normal[k[on]], shows[k[on]]
        left = np.einsum("ni,ni->n", np.cross(normals[point[on]], d), across) > 0
        out.append(Rays(point[on], d, across, np.where(left[:, None], shown, shown[:, ::-1])))
    return Rays.of(*out)


def edges(planes, k, end, normals, some):
    """Rays along the borders of planes k (n,), normals (n, 3), from some (m,) of points on ends (n, 2) of their edges,
    see to_border."""
    out, sides = [], unit(planes.corners[k][:, [1, 3]] - planes.corners[k, :1])
    for axis in (0, 1):
        for sign in (1, -1):
            at = some[(end[some, 1 - axis] != 0) & (end[some, axis] != sign)]
            direction = sign * sides[at, axis]
            out.append(Rays(at, direction, np.cross(normals[at], direction), np.full((len(at), 2), 2)))
    return Rays.of(*out)


class Wedges:
    """Of Rays about points with normals (n, 3), angles counted from directions first (n, 3) in their planes.

    point (w,), middle (w, 3) unit directions, width (w,) angles, shown (w,): what both rays show it at least, lean
    (w,): the sine at which the middle leaves the shapes on the rays, no less than 1 / CLEAR.
    """

    def __init__(self, rays, normals, first):
        x, n = first[rays.point], normals[rays.point]
        y = np.cross(n, x)
        angle = np.arctan2(*(np.einsum("ni,ni->n", axis, rays.direction) for axis in (y, x)))
        angle = np.mod(angle + PARALLEL, TURN)
        order = np.lexsort((angle, rays.point))
        apart = np.diff(rays.point[order], prepend=-1) > 0
        apart |= np.diff(angle[order], prepend=-1) > PARALLEL
        # of several in one direction the nearer one's side is seen: where any shows nothing, as crates that meet, none
        shows = np.minimum.reduceat(rays.shows[order], np.flatnonzero(apart))
        order = order[apart]
        rays, angle, x, y = rays.take(order), angle[order] - PARALLEL, x[order], y[order]
        rays.shows = shows
        begins = np.flatnonzero(np.diff(rays.point, prepend=-1))
        last = np.append(begins[1:], len(angle)) - 1
        after = np.arange(1, len(angle) + 1)
        after[last] = begins
        self.point, self.width = rays.point, angle[after] - angle
        self.width[last] += TURN
        turned = (angle + self.width / 2)[:, None]
        self.middle = np.cos(turned) * x + np.sin(turned) * y
        self.shown = np.minimum(rays.shows[:, 0], rays.shows[after, 1])
        leave = [np.abs(np.einsum("ni,ni->n", self.middle, across)) for across in (rays.across, rays.across[after])]
        self.lean = np.maximum(np.minimum(*leave), 1 / CLEAR)

    def best(self, fit):
        """(p,) Of each point the wedge that is fittest, fit (w,), then widest, then before lit sides."""
        return lowest(self.point, -self.shown, -np.rint(self.width / PARALLEL), -fit)
