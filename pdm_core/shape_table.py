"""Shapes as arrays, for gathering per pair."""

import numpy as np

from .closed_forms import dot, transform
from .regions import Balls
from .shapes.shape import bounds_of, tolerance_of
from .tolerances import KEPT, TOUCHING


class ShapeTable:
    """The scene's shapes as arrays, component first, for gathering per pair."""

    def __init__(self, shapes, tolerance=None):
        """tolerance m: of the shapes' coordinates, that of double precision unless told."""
        count = len(shapes)
        self.rounding = tolerance_of(shapes)
        self.tolerance = self.rounding if tolerance is None else tolerance
        self.is_ball = np.array([s.is_ball for s in shapes])
        origin, self.bound = bounds_of(shapes)  # the origin's, and radii of spheres about it
        self.origin = origin.T.copy()
        self.corners = np.zeros((3, 4, count))
        self.linear, self.inverse = np.zeros((3, 3, count)), np.zeros((3, 3, count))
        self.half = np.array([s.half for s in shapes])  # triangles, whose last corner is there twice
        self.radius = np.zeros(count)  # of round balls; 0 for ellipsoids
        # the tolerance in local coordinates: of heights over planes, of depths in ellipsoids along their least axes
        self.slack = self.tolerance / np.array([s.unit_height for s in shapes])
        for k, shape in enumerate(shapes):
            if not self.is_ball[k]:
                self.corners[:, :, k], self.inverse[:, :, k] = shape.corners.T, shape.inverse
                continue
            # the unit ball is the same under any rotation of its own space: keep the symmetric factor of the map
            u, axes, _ = np.linalg.svd(shape.linear)
            self.linear[:, :, k] = (u * axes) @ u.T
            self.inverse[:, :, k] = (u / axes) @ u.T
            self.radius[k] = axes[0] if shape.is_round else 0.0

    def by_kind(self, index):
        """Positions (k,) of balls, and of what is flat, among the shapes index (m,)."""
        ball = self.is_ball[index]
        return np.flatnonzero(ball), np.flatnonzero(~ball)

    def balls(self, x, index):
        """Balls of the shapes index (m,) relative to points x (3, m)."""
        offset, radius = self.origin.take(index, axis=1) - x, self.radius[index]
        if (radius > 0).all():
            return Balls(offset / radius, radius > 0)
        inverse = self.inverse.take(index, axis=2)
        return Balls(transform(inverse, offset), radius > 0, self.linear.take(index, axis=2), inverse)

    def within(self, x, n, ball):
        """(m,) Whether points x (3, m) with normals n (3, m) lie within balls (m,), or on them and look straight in."""
        inverse = self.inverse.take(ball, axis=2)
        local = transform(inverse, x - self.origin.take(ball, axis=1))
        inward = -transform(np.moveaxis(inverse, 0, 1), local)
        straight = dot(inward, n) >= (1 - TOUCHING) * np.sqrt(dot(inward, inward))
        depth = 1 - np.sqrt(dot(local, local))
        return depth > np.where(straight, -KEPT, 1.0) * self.slack[ball]

    def polygon(self, x, index):
        """Corners (3, 4, m) of the shapes index (m,) relative to points x (3, m)."""
        return self.corners.take(index, axis=2) - x[:, None]
