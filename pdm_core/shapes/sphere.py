"""Spheres and ellipsoids."""

from functools import cached_property

import numpy as np

from ..checked import number, vector, within
from ..coincident import REACHES
from ..shape_table import ShapeTable
from ..view import visible_factors
from .shape import FLATTEST, Shape, lattice, square_lattice, unit


class Sphere(Shape):
    """An affine image of the unit sphere (ellipsoids too), given by a 4x4 matrix. Its front is outside."""

    is_ball = wraps = True
    facet_count = 0
    first_cells = 2, 4
    least_cells = 4, 2

    def __init__(self, matrix):
        self.matrix = vector(matrix, (4, 4), "Sphere matrix")
        self.origin = self.matrix[:3, 3]
        self.linear = self.matrix[:3, :3]

    @classmethod
    def at(cls, center, radius):
        """The round sphere at center (3,) m with radius m."""
        radius = number(radius, "Sphere radius", "metres above 0", above=0)
        matrix = np.eye(4)
        matrix[:3, :3] *= radius
        matrix[:3, 3] = vector(center, (3,), "Sphere center")
        return cls(matrix)

    def __repr__(self):
        return f"Sphere({self.matrix.tolist()})"

    @cached_property
    def semi_axes(self):
        """(3,) m, longest first."""
        return np.linalg.svd(self.linear, compute_uv=False)

    @cached_property
    def is_round(self):
        return bool(self.semi_axes[0] - self.semi_axes[2] <= 1e-12 * self.semi_axes[0])

    @cached_property
    def area(self):
        """m^2; 4 pi R_G((ab)^2, (ac)^2, (bc)^2), Carlson 1995 / DLMF 19.33.1"""
        a, b, c = self.semi_axes / self.semi_axes[0]
        return float(4 * np.pi * self.semi_axes[0] ** 2 * _carlson_rg((a * b) ** 2, (a * c) ** 2, (b * c) ** 2))

    @cached_property
    def bounds(self):
        return self.origin, float(self.semi_axes[0])

    def spread(self, count):
        """Points (count, 3) m spread over the area, evenly over that of a round sphere."""
        return self.world(lattice(count))

    @property
    def box(self):
        reach = np.linalg.norm(self.linear, axis=1)
        return self.origin - reach, self.origin + reach

    @property
    def bend(self):
        """m; least radius."""
        return self.semi_axes[2]

    def gap(self, points):
        """points (n, 3) m outside -> (n,) m from it, at most"""
        local = self.local(points)
        return self.semi_axes[2] * np.maximum(np.sqrt(np.einsum("ni,ni->n", local, local)) - 1, 0.0)

    @property
    def normal(self):
        """(3,) None for all of it: 0."""
        return np.zeros(3)

    @property
    def corners(self):
        """(4, 3) m; there are none: its centre stands for them."""
        return np.tile(self.origin, (4, 1))

    @property
    def facets(self):
        """None: rays meet it as a ball."""
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, bool), np.zeros((0, 2, 3))

    @property
    def unit_height(self):
        """m; one unit of depth in local coordinates, at least."""
        return self.semi_axes[2]

    def moved(self, origin, corners):
        matrix = self.matrix.copy()
        matrix[:3, 3] -= origin
        return Sphere(matrix)

    def extent(self, directions):
        reach = np.linalg.norm(directions @ self.linear, axis=1)
        return -reach, reach

    def samples(self, count):
        return self.spread(2 * count)  # half of them look away from any point

    def area_shares(self, points):
        stretched = np.linalg.norm(self.local(points) @ self.inverse, axis=1)  # of the round ball's area
        return self.area * stretched / stretched.sum()

    def unhidden(self, points, normals, sign, tolerance):
        """Of its front alone; tolerance m: of its coordinates."""
        return visible_factors(ShapeTable([self], tolerance), points, normals, np.zeros(len(points), int))

    def against(self, points, normals, sign, near):
        return (self.local(points) ** 2).sum(axis=1) < 1 - 1e-9

    def inset(self, points, least):
        """As project: there is no border."""
        return self.project(points)

    def parametric(self, st):
        """Points (n, 3) m at parameters (n, 2), (theta / pi, phi / 2 pi) with theta from the pole, as in the paper, and
        area vectors (n, 3) m^2 of the front."""
        local = self.from_chart(st[:, ::-1])
        area = 2 * np.pi**2 * np.sin(np.pi * st[:, :1]) * local
        cofactor = abs(np.linalg.det(self.linear)) * self.inverse
        return self.world(local), area @ cofactor

    def parameters(self, local):
        turn, polar = self.to_chart(local).T
        return polar, turn

    @property
    def chart_lengths(self):
        return np.array([2 * np.pi, np.pi]) * self.semi_axes[0]

    @staticmethod
    def to_chart(local):
        """Directions (n, 3) -> (n, 2): turn about the axis, polar angle, both in [0, 1]."""
        turn = np.arctan2(local[:, 1], local[:, 0]) / (2 * np.pi) % 1.0
        polar = np.arctan2(np.hypot(local[:, 0], local[:, 1]), local[:, 2]) / np.pi
        return np.column_stack([turn, polar])

    @staticmethod
    def from_chart(at):
        """Turn and polar angle (n, 2) in [0, 1] -> unit directions (n, 3)."""
        turn, polar = 2 * np.pi * at[:, 0], np.pi * at[:, 1]
        ring = np.sin(polar)
        return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), np.cos(polar)])

    @classmethod
    def cells(cls, shapes, own, low, high, places):
        share, at = super().cells(shapes, own, low, high, places)
        first, last = np.cos(np.pi * low[:, 1]), np.cos(np.pi * high[:, 1])
        # by area: the cosine of the polar angle evenly
        across = first[:, None] + square_lattice(places)[:, 1] * (last - first)[:, None]
        at[:, :, 1] = np.arccos(np.clip(across, -1.0, 1.0)) / np.pi
        return (first - last) / 2 * (high - low)[:, 0], at

    def project(self, points):
        """points (n, 3) -> points (n, 3) on the shape along the ray from its centre (the exact shape's vertex)."""
        local = self.local(points)
        length = np.linalg.norm(local, axis=1, keepdims=True)
        local = np.where(length > 0, local / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
        return self.world(local)

    @property
    def marks(self):
        centre = self.bounds[0]
        reach = np.linalg.norm(REACHES @ self.linear, axis=1)
        return np.concatenate([centre, np.zeros(3), reach])

    @property
    def thickness(self):
        """m; twice the shortest semi-axis."""
        return 2 * float(self.semi_axes[2])

    def normals(self, points):
        """Unit outward normals (n, 3) at points (n, 3)."""
        return unit(self.local(points) @ self.inverse)

    @property
    def problem(self):
        if not within(self.matrix):
            return "its matrix is not finite or beyond all bounds; apply a valid transform"
        if not self.semi_axes[2] > FLATTEST * self.semi_axes[0]:
            return "it is scaled flat; give it a volume or replace it by a plane"
        return None


def _carlson_rg(x, y, z):
    """Carlson's symmetric integral R_G by duplication of R_F and R_D; relative error 1e-15."""
    z, y, x = sorted((x, y, z), reverse=True)  # z the largest: keeps R_D regular
    a, b, c, total, weight = x, y, z, 0.0, 1.0
    while max(abs(a - b), abs(b - c), abs(a - c)) > 1e-3 * (a + b + c):
        mean = np.sqrt(a * b) + np.sqrt(a * c) + np.sqrt(b * c)
        total += weight / (np.sqrt(c) * (c + mean))
        weight /= 4
        a, b, c = (a + mean) / 4, (b + mean) / 4, (c + mean) / 4
    m = (a + b + c) / 3
    p, q = 1 - a / m, 1 - b / m
    r = -(p + q)
    e2, e3 = p * q - r * r, p * q * r
    rf = (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44) / np.sqrt(m)
    m = (a + b + 3 * c) / 5
    p, q = 1 - a / m, 1 - b / m
    r = -(p + q) / 3
    e2, e3 = p * q - 6 * r * r, (3 * p * q - 8 * r * r) * r
    e4, e5 = 3 * (p * q - r * r) * r * r, p * q * r**3
    rd = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    rd = 3 * total + weight * rd / (m * np.sqrt(m))
    return (z * rf - (z - x) * (z - y) * rd / 3 + np.sqrt(x * y / z)) / 2
