"""Rooms and boxes as they are made, turned, and far from the origin."""

import itertools

import numpy as np
import pytest

from pdm_core import Plane, Surface

PLACES = {"as made": (0.0, (0, 0, 0)), "turned": (0.3, (0, 0, 0)), "turned and far": (0.7, (1000, 2000, 3))}


def each_somewhere(names, values):
    """Parametrises a test by values, each at one of PLACES in turn, the hardest first, which is its fixture `place`.
    For what takes long: all kinds and all places are tried, not each kind at each place."""
    where = itertools.cycle(reversed(PLACES))
    rows = [(*value, next(where)) if isinstance(value, tuple) else (value, next(where)) for value in values]
    return pytest.mark.parametrize(f"{names}, place", rows, indirect=["place"])


class Place:
    """Builds shapes turned about (1, 2, 3) by an angle and moved."""

    def __init__(self, angle=0.0, offset=(0, 0, 0)):
        axis = np.array([1, 2, 3]) / np.sqrt(14)
        k = np.cross(np.eye(3), -axis)
        self.turn = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
        self.offset = np.array(offset, float)

    def __call__(self, points):
        return np.asarray(points, float) @ self.turn.T + self.offset

    def plane(self, corner, u, v):
        return Plane(self(corner), self.turn @ u, self.turn @ v)

    def box(self, low, high, inward=False, sides=("front",), **light):
        low, high, out = np.array(low, float), np.array(high, float), []
        for axis, end in itertools.product(range(3), (0, 1)):
            corner, u, v = low.copy(), np.zeros(3), np.zeros(3)
            corner[axis] = (low, high)[end][axis]
            u[(axis + 1) % 3], v[(axis + 2) % 3] = ((high - low)[(axis + k) % 3] for k in (1, 2))
            if (end == 1) == inward:
                corner, u = corner + u, -u
            shape = self.plane(corner, u, v)
            out += [Surface(shape, side=side, **light) for side in sides]
        return out

    def sheet(self, corner, u, v, **light):
        shape = self.plane(corner, u, v)
        return [Surface(shape, **light), Surface(shape, side="back", **light)]
