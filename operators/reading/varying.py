"""What varies over a mesh's faces as a function of points in the world: evaluated there, or averaged around them."""

from functools import cached_property

import numpy as np

from ...pdm_core.shapes.shape import unit
from .nearest_face import NearestFace
from .node_values import evaluate

CHUNK = 32768  # points at a time
SAMPLES = 4  # a side of each cell whose mean is asked for
AFFINE = 2e-6  # of the range of values: a map that is straight to this is taken so, and needs no faces


class Faces:
    """Some faces of a mesh under a matrix (4, 4) to the world: those triangles `chosen` (t,) of MeshLayers."""

    def __init__(self, layers, matrix, chosen):
        self.layers = layers
        self.matrix = np.asarray(matrix, float)
        self.corners = layers.arrays.triangles[chosen]
        self._straight = {}

    @cached_property
    def inverse(self):
        return np.linalg.pinv(self.matrix[:3, :3])

    @cached_property
    def places(self):
        """(t, 3, 3) m, local: the triangles' corners."""
        return self.layers.arrays.vertices[self.layers.arrays.corners[self.corners]].astype(float)

    @cached_property
    def world(self):
        """NearestFace of the triangles in the world, where points are near what they look near to."""
        return NearestFace(self.places @ self.matrix[:3, :3].T + self.matrix[:3, 3])

    @cached_property
    def normal(self):
        """(3,) the unit normal in the world of faces that all lie in one plane, or None."""
        normals = self.world.normals
        flat = np.abs(np.cross(normals, normals[0])).max() < AFFINE
        return normals[0] if flat else None

    @cached_property
    def normals(self):
        """(t, 3, 3) local, with which the triangles' corners are shaded; their own where those of a face are alike."""
        a, b, c = self.places.swapaxes(0, 1)
        own = np.repeat(unit(np.cross(b - a, c - a))[:, None], 3, axis=1)
        if self.layers.arrays.normals is None:
            return own
        shaded = self.layers.arrays.normals[self.corners].astype(float)
        is_flat = (np.ptp(shaded, axis=1) < AFFINE).all(axis=1)
        return np.where(is_flat[:, None, None], own, shaded)

    def local(self, points):
        """points (n, 3) m in the world -> (n, 3) in the object's own coordinates."""
        return (points - self.matrix[:3, 3]) @ self.inverse.T

    def straight(self, key):
        """(4, k): the layer as one straight map of (local coordinates, 1) over all these faces, or None."""
        if key not in self._straight:
            values = self.layers.layers[key][self.corners].reshape(3 * len(self.corners), -1).astype(float)
            centre = self.places.mean(axis=(0, 1))
            at = np.concatenate([self.places.reshape(-1, 3) - centre, np.ones((len(values), 1))], axis=1)
            found = np.linalg.lstsq(at, values, rcond=1e-9)[0]
            off = np.abs(at @ found - values).max()
            found[3] -= centre @ found[:3]
            self._straight[key] = found if off <= AFFINE * max(np.ptp(values), np.abs(values).max()) else None
        return self._straight[key]


class Places:
    """Points (n, 3) m in the world on Faces, and what textures read there. samples: where the points are those of
    cells, cell by cell and row by row, how many a side, else 0."""

    def __init__(self, faces, points, samples=0):
        self.faces = faces
        self.points = points
        self.samples = samples

    def read(self, kind, name=""):
        """(n, k) of what is asked for: see MeshLayers; what the mesh has not is 0."""
        faces = self.faces
        if kind == "world":
            return self.points
        if kind == "object":
            return faces.layers.colour[None]
        if kind == "normal":
            return self._normals()
        local = faces.local(self.points)
        if kind == "local":
            return local
        if kind == "generated":
            centre, half = faces.layers.space
            return (local - centre) / np.where(half != 0, 2 * half, 1.0) + 0.5
        values = self._layer((kind, name), local)
        return values if kind == "attribute" else np.concatenate([values, np.zeros((len(values), 1))], axis=1)

    def _layer(self, key, local):
        faces = self.faces
        if key not in faces.layers.layers:
            return np.zeros((len(local), 4 if key[0] == "attribute" else 2))
        straight = faces.straight(key)
        if straight is not None:
            return local @ straight[:3] + straight[3]
        triangle, weights = self.located
        return np.einsum("nc,nck->nk", weights, faces.layers.layers[key][faces.corners[triangle]])

    def _normals(self):
        """(n, 3) unit shading normals, local."""
        triangle, weights = self.located
        normals = self.faces.normals[triangle]
        return unit(np.einsum("nc,nck->nk", weights, normals))

    @cached_property
    def located(self):
        """(triangle (n,), weights (n, 3)) of the points."""
        return self.faces.world.locate(self.points)


class Varying:
    """A Value on Faces. Called with points (n, 3) m in the world it gives the Value there, (n, 3)."""

    def __init__(self, value, faces):
        self.value = value
        self.faces = faces

    def __call__(self, points):
        return self._in_chunks(np.atleast_2d(np.asarray(points, float)), 0)

    def mean_at(self, points, size):
        """(n, 3): means over squares of `size` (n,) m a side around points (n, 3), along the faces there."""
        points = np.atleast_2d(np.asarray(points, float))
        size = np.broadcast_to(np.asarray(size, float), len(points))
        one, other = _tangents(self._normals(points))
        step = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
        along = (size[:, None] * step)[..., None]  # (n, samples, 1)
        one, other = along * one[:, None], along * other[:, None]
        cells = points[:, None, None] + one[:, :, None] + other[:, None]
        values = self._in_chunks(cells.reshape(-1, 3), SAMPLES)
        return values.reshape(len(points), SAMPLES**2, 3).mean(axis=1)

    def _in_chunks(self, points, samples):
        values = np.empty((len(points), 3))
        for start in range(0, len(points), CHUNK):  # a multiple of the samples of a cell
            part = slice(start, start + CHUNK)
            values[part] = evaluate(self.value, Places(self.faces, points[part], samples))
        return values

    def _normals(self, points):
        if self.faces.normal is not None:
            return np.broadcast_to(self.faces.normal, points.shape)
        return self.faces.world.normals[self.faces.world.locate(points)[0]]


def _tangents(normals):
    """Two unit vectors (n, 3) each across unit normals (n, 3)."""
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    one = np.cross(normals, axis)
    one /= np.maximum(np.linalg.norm(one, axis=1, keepdims=True), 1e-300)
    return one, np.cross(normals, one)
