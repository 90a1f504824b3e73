"""Which triangle of a mesh a point lies on, and where on it. numpy only, no bpy.

Points that lie on the faces, or near them, are found in a grid by what is straight below them, some five times as fast
as the nearest triangle to a point anywhere, which the others are left to.
"""

from functools import cached_property

import numpy as np

from ...pdm_core.at_once import in_turn
from ...pdm_core.nearest import NearestTriangle

CHUNK = 16384  # points at a time
FEW = 12  # triangles that are all tried
CELLS = 2**20  # of the grid at most
MARGIN = 0.3  # of a cell's size: how far from a point its triangle is looked for at once
SLACK = 1e-6  # of a triangle's size, by which a point is inside still


class NearestFace:
    """triangles (t, 3, 3) m."""

    def __init__(self, triangles):
        self.triangles = np.asarray(triangles, float)
        edges = self.triangles[:, 1:] - self.triangles[:, :1]
        normal = np.cross(edges[:, 0], edges[:, 1])
        length = np.linalg.norm(normal, axis=1)
        self.normals = normal / np.maximum(length, 1e-300)[:, None]
        self._planes = _planes(self.triangles[:, 0], edges, normal, length)
        self.low, high = self.triangles.min(axis=(0, 1)), self.triangles.max(axis=(0, 1))
        self.extent = high - self.low
        self.cell = max(0.5 * np.sqrt(length.sum() / len(length)), (self.extent.max() or 1.0) * 1e-3)
        sizes = np.ptp(self.triangles, axis=1)
        most = CELLS + 32 * len(sizes)  # entries: large triangles are in many cells
        while np.prod(self.extent / self.cell + 1) > CELLS or np.prod(sizes / self.cell + 2, axis=1).sum() > most:
            self.cell *= 1.25
        self.counts = (np.floor(self.extent / self.cell) + 1).astype(np.int64)

    def locate(self, points):
        """points (n, 3) m -> (triangle (n,), weights (n, 3) of its corners, of sum 1)."""
        triangle, weights = np.empty(len(points), np.int64), np.empty((len(points), 3))
        for start in range(0, len(points), CHUNK):
            chunk = slice(start, start + CHUNK)
            triangle[chunk], weights[chunk] = self._locate(np.asarray(points[chunk], float))
        return triangle, weights

    def _locate(self, points):
        if len(self.triangles) <= FEW:
            point, candidate = (a.ravel() for a in np.indices((len(points), len(self.triangles))))
        else:
            point, candidate = self._candidates(points)
        triangle, weights, height = self._below(points, point, candidate)
        left = np.flatnonzero(~(height <= MARGIN * self.cell))
        if len(left):
            triangle[left], weights[left] = self._anywhere.find(points[left])
        return triangle, weights

    def _candidates(self, points):
        """(point (k,), triangle (k,)) of those near each point's cell, points in order."""
        starts, entries = self._grid
        index = np.clip(np.floor((points - self.low) / self.cell), 0, self.counts - 1).astype(np.int64)
        cell = (index[:, 0] * self.counts[1] + index[:, 1]) * self.counts[2] + index[:, 2]
        first, number = starts[cell], starts[cell + 1] - starts[cell]
        point, place = in_turn(number)
        return point, entries[first[point] + place]

    @cached_property
    def _grid(self):
        """(starts (cells + 1,), triangles in order of cells): those within MARGIN of a cell."""
        reach = MARGIN * self.cell
        low = np.floor((self.triangles.min(axis=1) - reach - self.low) / self.cell)
        high = np.floor((self.triangles.max(axis=1) + reach - self.low) / self.cell)
        low, high = (np.clip(a, 0, self.counts - 1).astype(np.int64) for a in (low, high))
        size = high - low + 1
        number = size.prod(axis=1)
        triangle, k = in_turn(number)
        index = np.empty((len(k), 3), np.int64)
        k, index[:, 2] = np.divmod(k, size[triangle, 2])
        index[:, 0], index[:, 1] = np.divmod(k, size[triangle, 1])
        index += low[triangle]
        centre = self.low + (index + 0.5) * self.cell
        normal = self.normals[triangle]
        height = np.abs(np.einsum("ij,ij->i", normal, centre - self.triangles[triangle, 0]))
        near = height <= np.abs(normal).sum(axis=1) * self.cell / 2 + reach * (1 + 1e-9)
        cell = (index[:, 0] * self.counts[1] + index[:, 1]) * self.counts[2] + index[:, 2]
        cell, triangle = cell[near], triangle[near]
        order = np.argsort(cell, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=self.counts.prod()))])
        return starts, triangle[order]

    @cached_property
    def _anywhere(self):
        return NearestTriangle(self.triangles)

    def _below(self, points, point, candidate):
        """Of each point the triangle straight below it that is nearest: (triangle, weights, height or nan)."""
        weights = self._weights(points, point, candidate)
        inside = (weights[:, :2] >= -SLACK).all(axis=1) & (weights[:, 0] + weights[:, 1] <= 1 + SLACK)
        weights, point, candidate = weights[inside], point[inside], candidate[inside]
        height = np.abs(weights[:, 2])
        return _least(height, point, candidate, weights[:, :2], len(points))

    def _weights(self, points, point, candidate):
        """(k, 3): weights of the second and third corner, and the height."""
        planes = self._planes[candidate]
        return np.einsum("kij,kj->ki", planes[:, :, :3], points[point]) + planes[:, :, 3]


def _planes(first, edges, normal, length):
    """(t, 3, 4): rows that take (x, y, z, 1) to the weights of the second and third corner and to the height."""
    unit = normal / np.maximum(length, 1e-300)[:, None]
    one, other = np.cross(edges[:, 1], unit), np.cross(unit, edges[:, 0])
    scale = np.where(length > 0, 1 / np.maximum(length, 1e-300), 0.0)[:, None]
    rows = np.stack([one * scale, other * scale, unit], axis=1)
    planes = np.concatenate([rows, -np.einsum("tij,tj->ti", rows, first)[:, :, None]], axis=2)
    planes[length == 0, :2, 3] = -1.0  # without an area nothing is above it
    return planes


def _least(height, point, candidate, weights, count):
    """The candidate of least height of each of `count` points, which come in order: (triangle, weights, height)."""
    triangle, at = np.zeros(count, np.int64), np.zeros((count, 3))
    least = np.full(count, np.nan)
    if len(point):
        starts = np.flatnonzero(np.diff(point, prepend=-1))
        lowest = np.minimum.reduceat(height, starts)
        size = np.diff(np.append(starts, len(point)))
        hit = np.flatnonzero(height == np.repeat(lowest, size))
        hit = hit[np.unique(point[hit], return_index=True)[1]]
        triangle[point[hit]], least[point[hit]] = candidate[hit], height[hit]
        at[point[hit], 1:] = weights[hit]
        at[point[hit], 0] = 1 - weights[hit].sum(axis=1)
    return triangle, at, least
