"""A mesh's faces cut into smaller ones where they are larger than the cells in which its light is kept.

Rays meet the faces as they are; the light is kept at the corners of the smaller ones.
"""

import numpy as np

from ..names import names_of
from ..shapes.shape import unit

MOST = 256  # parts of an edge, and of a mesh along its length
SLENDER = 8  # times as many parts as cells of a triangle's area at most: four times as long as it is wide
FINE = 30_000  # steps across a mesh in which places are told apart
NORMAL_STEPS = 64.0  # in which shading normals are told apart, of a length of 1


class Split:
    """parts (t,): of each edge of a mesh's triangles, a power of 2; first (t,): the first of each one's parts^2 smaller
    triangles; triangle (T,): which each of these is of; points, normals (T, 3, 3): their corners', normals of length 1;
    areas (T,) m^2.

    Of row i and column j among parts x parts, those with i + j < parts stand upright on the triangle's (s, t), corners
    (i, j), (i + 1, j), (i, j + 1); the others, counted from the other end, upside down.
    """

    def __init__(self, mesh, size):
        """size m: of the cells, about which the smaller edges are long."""
        corners = mesh.corners
        longest = np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1))
        size = max(size, 1e-300)
        # of a long thin one no more than a few times the cells that its area is
        wanted = np.minimum(longest / size, np.sqrt(SLENDER * mesh.areas) / size)
        level = np.floor(np.log2(np.clip(wanted, 1.0, MOST)))
        self.parts = 2 ** level.astype(np.int64)
        self.is_cut = self.parts > 1
        square = self.parts**2
        self.first = np.cumsum(square) - square
        self.triangle = np.repeat(np.arange(len(square)), square)
        self.areas = (mesh.areas / square)[self.triangle]
        if not self.is_cut.any():
            self.points, self.normals = corners, mesh.corner_normals
            return
        i, j = np.divmod(np.arange(len(self.triangle)) - self.first[self.triangle], parts := self.parts[self.triangle])
        down = i + j >= parts
        s = np.stack([i, i + 1, i], axis=1)
        t = np.stack([j, j, j + 1], axis=1)
        s, t = (np.where(down[:, None], parts[:, None] - k, k) / parts[:, None] for k in (s, t))
        weight = np.stack([1 - s - t, s, t], axis=2)
        self.points = np.einsum("tck,tki->tci", weight, corners[self.triangle])
        self.normals = np.einsum("tck,tki->tci", weight, mesh.corner_normals[self.triangle])
        own = np.linalg.norm(self.normals, axis=2, keepdims=True) < 1e-9  # where those of the corners cancel
        self.normals = unit(np.where(own, mesh.triangle_normals[self.triangle][:, None], self.normals))

    def __len__(self):
        return len(self.triangle)

    def names(self, radius):
        """(3 T,) numbers of the corners, the same of those at one place shaded alike; radius m, of the mesh."""
        points = self.points.reshape(-1, 3)
        place = np.rint((points - points.min(axis=0)) / (2 * radius / FINE))
        normal = np.rint(self.normals.reshape(-1, 3) * NORMAL_STEPS)
        return names_of(np.concatenate([place, normal], axis=1))


def find(parts, first, at):
    """Places at (h, 2) on triangles of so many parts (h,) along an edge -> which smaller triangles they are on, numbers
    (h,) from the first (h,) of each on, and places on them (h, 2)."""
    scaled = np.clip(at, 0.0, 1.0) * parts[:, None]
    cell = np.minimum(scaled.astype(np.int64), parts[:, None] - 1)
    inner = scaled - cell
    row, column = cell.T
    down = (inner.sum(axis=1) > 1) & (row + column < parts - 1)
    row, column = (np.where(down, parts - 1 - k, k) for k in (row, column))
    return first + row * parts + column, np.where(down[:, None], 1 - inner, inner)
