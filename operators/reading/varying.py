"""What varies over a mesh's faces as a function of points in the world."""

from functools import cached_property

import numpy as np

from ...pdm_core.shapes.shape import unit
from .mesh_arrays import FLATTEST, in_world
from .nearest_face import NearestFace
from .node_values import evaluate

CHUNK = 32768  # points at a time
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
        return NearestFace(in_world(self.matrix, self.places))

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

    @cached_property
    def is_flat(self):
        """Whether the matrix leaves no volume, so that places in the world do not tell those in the object."""
        scale = np.linalg.svd(self.matrix[:3, :3], compute_uv=False)
        return not scale[2] > FLATTEST * scale[0]

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
    """Points (n, 3) m in the world on Faces, and what textures read there."""

    def __init__(self, faces, points):
        self.faces = faces
        self.points = points

    def read(self, kind, name=""):
        """(n, k) of what is asked for: see MeshLayers; what the mesh has not is 0."""
        faces = self.faces
        if kind == "world":
            return self.points
        if kind == "object":
            return faces.layers.colour[None]
        if kind == "normal":
            return self._normals()
        if kind == "local":
            return self.local
        if kind == "generated" and (kind, name) not in faces.layers.layers:
            centre, half = faces.layers.space
            return (self.modelled - centre) / np.where(half != 0, 2 * half, 1.0) + 0.5
        values = self._layer((kind, name))
        return np.concatenate([values, np.zeros((len(values), 1))], axis=1) if kind == "uv" else values

    @cached_property
    def local(self):
        """(n, 3) m in the object's own coordinates; as Cycles, 0 along an axis that is pressed flat."""
        return (self.points - self.faces.matrix[:3, 3]) @ self.faces.inverse.T

    @cached_property
    def modelled(self):
        """(n, 3) m in the object's own coordinates, on its faces whatever presses them flat."""
        return self._between(self.faces.places.__getitem__) if self.faces.is_flat else self.local

    def _layer(self, key):
        faces = self.faces
        if key not in faces.layers.layers:
            return np.zeros((len(self.points), 5 if key[0] == "attribute" else 2))
        straight = None if faces.is_flat else faces.straight(key)
        if straight is not None:
            return self.local @ straight[:3] + straight[3]
        return self._between(lambda triangle: faces.layers.layers[key][faces.corners[triangle]])

    def _normals(self):
        """(n, 3) unit shading normals, local."""
        return unit(self._between(self.faces.normals.__getitem__))

    def _between(self, held):
        """(n, k) at the points, of what corners hold: held(triangles (n,)) -> (n, 3, k)."""
        triangle, weights = self.located
        return np.einsum("nc,nck->nk", weights, held(triangle))

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
        points = np.atleast_2d(np.asarray(points, float))
        values = np.empty((len(points), 3))
        for start in range(0, len(points), CHUNK):
            part = slice(start, start + CHUNK)
            values[part] = evaluate(self.value, Places(self.faces, points[part]))
        return values
