"""Where new vertices on UV spheres are put: on the sphere, half way along its rings and meridians. No bpy."""

from dataclasses import dataclass

import numpy as np

from ..reading.mesh_shapes import find_shapes
from ..reading.mesh_spheres import SphereShape, find_sphere, on_sphere
from ..reading.mesh_topology import MeshArrays, NotRecognised


@dataclass(eq=False)
class RoundPlaces:
    """ring, turn (n,): of a mesh's vertices on this sphere, counted from the north pole and in segments, nan of others;
    a pole has no turn. linear (3, 3) and origin (3,): the unit sphere to local coordinates, rows of it times linear."""

    rings: int
    segments: int
    ring: np.ndarray
    turn: np.ndarray
    linear: np.ndarray
    origin: np.ndarray
    is_even: bool

    @classmethod
    def make(cls, vertices, own, grid):
        """vertices (n, 3) of the mesh, of which those at `own` (k,) are the sphere of a Grid."""
        ring, turn = np.full((2, len(vertices)), np.nan)
        ring[own], turn[own] = grid.k, grid.j
        turn[own[[grid.north, grid.south]]] = np.nan
        solution = grid.least_squares @ vertices[own]
        return cls(grid.rings, grid.segments, ring, turn, solution[:3], solution[3], grid.is_even)

    def has(self, vertices):
        """(k,) bool, of vertices (k,)."""
        return np.isfinite(self.ring[vertices])

    def between(self, a, b):
        """Ring and turn (k,) half way between vertices a and b (k,)."""
        one, other = self.turn[a], self.turn[b]
        one, other = np.where(np.isnan(one), other, one), np.where(np.isnan(other), one, other)
        half = self.segments / 2
        return (self.ring[a] + self.ring[b]) / 2, one + ((other - one + half) % self.segments - half) / 2

    def place(self, ring, turn):
        """(k, 3) m, local."""
        return on_sphere(ring, turn, self.rings, self.segments) @ self.linear + self.origin

    def extend(self, a, b):
        """New vertices, each between vertices a and b (k,)."""
        own = self.has(a) & self.has(b)
        ring, turn = np.full((2, len(a)), np.nan)
        ring[own], turn[own] = self.between(a[own], b[own])
        self.ring, self.turn = np.concatenate([self.ring, ring]), np.concatenate([self.turn, turn])


def round_places(arrays):
    """[RoundPlaces] of the UV spheres in the Arrays of a mesh."""
    vertices = arrays.vertices.astype(float)
    return [RoundPlaces.make(vertices, own, grid) for own, grid in spheres_of(arrays)]


def spheres_of(arrays):
    """[(vertices (n,), their Grid)] of the UV spheres in Arrays; what is none is refined as flat faces."""
    vertices, corners, counts = arrays.vertices, arrays.corners, arrays.counts
    try:
        shapes = find_shapes(vertices, corners, counts)
    except NotRecognised:
        return []
    mesh, found = MeshArrays.make(vertices, corners, counts), []
    for number, shape in enumerate(shapes.shapes):
        if isinstance(shape, SphereShape):
            own, grids = shapes.corner_shape[np.cumsum(counts) - counts] == number, {}
            find_sphere(mesh.alone(own), grids)
            (grid,) = grids.values()
            found.append((np.unique(corners[np.repeat(own, counts)]), grid))
    return found
