"""Parallelograms, and their halves: triangles."""

from functools import cached_property
from math import hypot

import numpy as np

from ..checked import MOST, vector
from ..closed_forms import cross
from ..coincident import REACHES
from ..contour import polygon_unoccluded
from ..tolerances import SINGLE, TOUCHING
from .shape import FLATTEST, INSET, ROUNDINGS, Flat, square_lattice, tiles, unit


class Plane(Flat):
    """The parallelogram corner + s*u + t*v, 0 <= s, t <= 1. Its front is along u x v; u, v need not be orthogonal.

    Local coordinates are (s, t, height along the unit normal in units of sqrt(area)).
    """

    facet_count = 1
    is_rectangle = True

    def __init__(self, corner, u, v):
        self.origin = vector(corner, (3,), "Plane corner")
        self.u = vector(u, (3,), "Plane u")
        self.v = vector(v, (3,), "Plane v")

    @classmethod
    def through(cls, corners):
        """The parallelogram with corners (4, 3) m, counter-clockwise seen from its front."""
        corners = vector(corners, (4, 3), "Plane corners")
        plane = cls(corners[0], corners[1] - corners[0], corners[3] - corners[0])
        plane.__dict__["corners"] = corners  # not the sums of rounded edges
        plane.__dict__["twist"] = corners[0] - corners[1] + corners[2] - corners[3]
        return plane

    def moved(self, origin, corners):
        moved = Plane.through(corners - origin)
        moved.__dict__["problem"] = None  # what is wrong with it has been said
        return moved

    @cached_property
    def twist(self):
        """(3,) m; what the third corner is off by rounding, so that points near every edge are on it."""
        return np.zeros(3)

    def __repr__(self):
        return f"Plane({self.origin.tolist()}, {self.u.tolist()}, {self.v.tolist()})"

    @cached_property
    def area(self):
        return hypot(*self._across.tolist())

    @cached_property
    def _across(self):
        """(3,) u x v"""
        return cross(self.u, self.v)

    @cached_property
    def normal(self):
        return unit(self._across)

    @cached_property
    def linear(self):
        """(3, 3) with columns u, v and the unit normal times sqrt(area)."""
        return np.column_stack([self.u, self.v, self.normal * np.sqrt(self.area)])

    @cached_property
    def corners(self):
        """(4, 3) counter-clockwise seen from the front."""
        c, u, v = self.origin, self.u, self.v
        return np.array([c, c + u, c + u + v, c + v])

    @property
    def outline(self):
        return self.corners

    @property
    def facets(self):
        chart = np.array([[[0.0, 1, 0], [0, 0, 1]]])
        return self.origin[None], self.u[None], self.v[None], np.zeros(1, bool), chart

    @cached_property
    def marks(self):
        centre = self.bounds[0]
        reach = np.abs((self.corners - centre) @ REACHES.T).max(axis=0)
        return np.concatenate([centre, np.sqrt(self.area) * self.normal, reach])

    @cached_property
    def bounds(self):
        centre = self.origin + (self.u + self.v) / 2
        return centre, float(np.linalg.norm(self.corners - centre, axis=1).max())

    def cut(self, length):
        if self.half:
            return [self]
        corners, (s, t) = tiles(self.chart_lengths, length)
        return [Plane(self.world([[*corner, 0]])[0], s * self.u, t * self.v) for corner in corners]

    def normals(self, points):
        """Unit normals (n, 3) of the front at points (n, 3): near each edge as that lies, whatever the others do."""
        if self.half or not self.twist.any():
            return super().normals(points)
        s, t = self.local(points)[:, :2, None].swapaxes(0, 1)
        return unit(np.cross(self.u + t * self.twist, self.v + s * self.twist))

    def project(self, points):
        """points (n, 3) -> nearest points (n, 3) on the shape, local coordinates clipped to the outline."""
        local = self.local(points)
        local[:, :2] = np.clip(local[:, :2], 0.0, 1.0)
        local[:, 2] = 0.0
        return self.world(local)

    def inset(self, points, least):
        return Planes([self]).inset(np.zeros(len(points), int), points, least)

    def factor(self, points, normals):
        return polygon_unoccluded(points, normals, np.broadcast_to(self.corners, (len(points), 4, 3)))

    def parametric(self, st):
        area = np.broadcast_to(np.cross(self.u, self.v), (len(st), 3))
        area = area * (1 - st[:, 1:]) if self.half else area
        return self.world(np.column_stack([st, 0 * st[:, 0]])), area

    def extent(self, directions):
        height = directions @ (self.corners - self.bounds[0]).T
        return height.min(axis=1), height.max(axis=1)

    @cached_property
    def unit_height(self):
        """m; one unit of height in local coordinates."""
        return np.sqrt(self.area)

    def spread(self, count):
        return self.world(np.column_stack([square_lattice(count), np.zeros(count)]))

    @cached_property
    def thickness(self):
        """m; the lesser distance of two opposite edges."""
        return self.area / max(hypot(*self.u.tolist()), hypot(*self.v.tolist()))

    @cached_property
    def problem(self):
        if not all(abs(x) <= MOST for x in (*self.origin.tolist(), *self.u.tolist(), *self.v.tolist())):
            return "its coordinates are not finite or beyond all bounds; apply a valid transform"
        longest = max(hypot(*self.u.tolist()), hypot(*self.v.tolist()))
        if not (longest > 0 and hypot(*cross(self.u / longest, self.v / longest).tolist()) > FLATTEST):
            return "it has no area; give it two edges of different directions or remove it"
        if max(map(abs, self.twist.tolist())) > ROUNDINGS * SINGLE * np.abs(self.corners).max() + TOUCHING * longest:
            return "its corners are no parallelogram's; give a Polygon or a Mesh"
        return None


class Facet(Plane):
    """The triangle with corners (3, 3) m, counter-clockwise seen from its front; thickness m: of what it is a part of.

    local is affine, with s + t <= 1 within; world takes the whole square, whose side t = 1 is the last corner.
    """

    half, is_rectangle = True, False
    problem = None  # what is wrong with the whole has been said, and a part may be narrow

    @classmethod
    def of(cls, corners, thickness):
        facet = cls.through(corners[[0, 1, 2, 2]])
        facet.__dict__["thickness"] = thickness
        return facet

    def moved(self, origin, corners):
        return Facet.of((corners - origin)[:3], self.thickness)

    @property
    def area(self):
        return float(np.linalg.norm(np.cross(self.u, self.v))) / 2


class Planes:
    """Many planes as arrays: points (n, 3) m belong to those of the indices which (n,)."""

    def __init__(self, planes):
        self.origin, self.twist, self.normal = (
            np.array([getattr(p, name) for p in planes]).reshape(-1, 3) for name in ("origin", "twist", "normal")
        )
        self.linear, self.inverse = (
            np.array([getattr(p, name) for p in planes]).reshape(-1, 3, 3) for name in ("linear", "inverse")
        )
        self.edges = np.linalg.norm(self.linear[:, :, :2], axis=1)  # (planes, 2) m

    def inset(self, which, points, least):
        """Nearest points (n, 3) m that keep at least so many m, and INSET, from the borders."""
        border = np.minimum(np.maximum(INSET, least / self.edges[which]), 0.25)
        at = np.einsum("nij,nj->ni", self.inverse[which, :2], points - self.origin[which])
        at = np.clip(at, border, 1 - border)
        affine = np.einsum("nij,nj->ni", self.linear[which, :, :2], at)
        return self.origin[which] + affine + at[:, :1] * at[:, 1:] * self.twist[which]
