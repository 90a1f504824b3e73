"""The faces of a mesh as they are given, and the triangles that they are cut into, with shading normals."""

from functools import cached_property

import numpy as np

from ..checked import SceneError, array, as_array, within
from ..closed_forms import cross, dot
from ..ears import triangulated
from ..names import names_of
from .shape import FLATTEST, unit


class Faces:
    """Of the arguments of Mesh: vertices (n, 3) m, count of faces."""

    def __init__(self, vertices, faces, smooth):
        self.vertices = array(vertices, "Mesh vertices")
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3:
            raise SceneError(f"Mesh vertices must have shape (n, 3), not {self.vertices.shape}")
        self._start, self._corner = _corners_of(faces, len(self.vertices))
        self.count = len(self._start) - 1
        self._smooth, self._given_normals = self._shading(smooth)

    def _shading(self, smooth):
        """Whether faces (f,) are smooth, and normals of each corner (sum of corners, 3) where they are given."""
        smooth = as_array(smooth, "Mesh smooth")
        if smooth.dtype == bool:
            if smooth.shape in ((), (self.count,)):
                return np.broadcast_to(smooth, self.count), None
        else:
            smooth = array(smooth, "Mesh smooth")
            if smooth.shape in (self.vertices.shape, (len(self._corner), 3)):
                normals = smooth if smooth.shape != self.vertices.shape else smooth[self._corner]
                return np.ones(self.count, bool), normals
        raise SceneError(
            f"Mesh smooth is of shape {smooth.shape}; give True, False, one of them for each of {self.count} "
            f"faces, or a normal for each of {len(self.vertices)} vertices or {len(self._corner)} corners"
        )

    @cached_property
    def _cut(self):
        """(t, 3) corners, as indices into the corners of all faces in turn, of the triangles with an area."""
        corners = _triangles_of(self.vertices, self._start, self._corner)
        p, q, r = (self.vertices[self._corner[corners[:, k]]].T for k in range(3))
        sides = [dot(side, side) for side in (q - p, r - q, p - r)]
        across = cross(q - p, r - p)
        keep = np.sqrt(dot(across, across)) > FLATTEST * np.maximum.reduce(sides)
        first = np.unique(self._ways[0], return_index=True)[1]
        if len(first) < self.count:
            keep &= np.isin(np.searchsorted(self._start, corners[:, 0], side="right") - 1, first)
        return corners[keep]

    @cached_property
    def _ways(self):
        """(f,) Names of the faces, and of what looks the other way: the same where corners lie at the same places.
        Vertices at one place are one here: doubled faces need not share them, nor begin with the same one."""
        name = names_of(self.vertices)[self._corner]
        after = np.arange(1, len(name) + 1)
        after[self._start[1:] - 1] = self._start[:-1]
        mixed = name ^ (name >> np.uint64(31))
        pairs = name * mixed[after], name[after] * mixed
        return [np.add.reduceat(pair, self._start[:-1]) for pair in pairs]

    @cached_property
    def backed(self):
        """(t,) Whether another face lies on the back of each triangle's: nothing is seen of it."""
        return np.isin(*self._ways)[self.of]

    @cached_property
    def triangles(self):
        """(t, 3) Their vertices."""
        return self._corner[self._cut]

    @cached_property
    def of(self):
        """(t,) The faces of the triangles."""
        return np.searchsorted(self._start, self._cut[:, 0], side="right") - 1

    def corner_normals(self, own):
        """(t, 3, 3) unit shading normals: those given, else of smooth faces the mean over the smooth faces around each
        vertex by their angles there, and of flat ones their own (t, 3)."""
        own = np.repeat(own[:, None], 3, axis=1)
        if self._given_normals is not None:
            normals = unit(self._given_normals[self._cut])
        else:
            smooth = self._smooth[self.of]
            around = np.zeros((len(self.vertices), 3))
            angle = _angles(self.vertices[self.triangles[smooth]])
            for k in range(3):
                weighted = angle[:, k, None] * own[smooth, k]
                for axis in range(3):
                    around[:, axis] += np.bincount(
                        self.triangles[smooth, k], weighted[:, axis], minlength=len(self.vertices)
                    )
            # where the faces around a vertex look every way it has no normal
            around[np.linalg.norm(around, axis=1) < FLATTEST] = 0.0
            normals = np.where(smooth[:, None, None], unit(around)[self.triangles], own)
        return np.where(normals.any(axis=2, keepdims=True), normals, own)

    @property
    def problem(self):
        """What is wrong with them, as a sentence, or None."""
        if not within(self.vertices[self._corner]):
            return "its coordinates are not finite or beyond all bounds; apply a valid transform"
        if self._given_normals is not None and not within(self._given_normals):
            return "its normals are not finite; clear them or give others"
        if not len(self.triangles):
            return "it has no area; give it faces or remove it"
        return None


def _corners_of(faces, count):
    """faces -> where each begins (f + 1,) in the list of all their corners, vertices (sum of corners,)."""
    try:
        if isinstance(faces, np.ndarray) and faces.ndim == 2:
            sizes, corner = np.full(len(faces), faces.shape[1]), array(faces, "Mesh faces").ravel()
        else:
            sizes = np.array([len(face) for face in faces], int)
            corner = array([k for face in faces for k in face], "Mesh faces")
    except TypeError:
        raise SceneError(f"Mesh faces are {faces!r}; give (f, 3) or a list of corner lists") from None
    if not len(sizes) or sizes.min() < 3 or corner.shape != (sizes.sum(),):
        raise SceneError("Mesh faces must be at least one, of at least 3 corners each")
    if not ((corner == np.floor(corner)) & (corner >= 0) & (corner < count)).all():
        raise SceneError(f"Mesh faces have corners that are no vertex; use indices from 0 to {count - 1}")
    return np.concatenate([[0], np.cumsum(sizes)]), corner.astype(int)


def _triangles_of(vertices, start, corner):
    """(t, 3) indices into the corners, by face: fans of convex faces, ears of others."""
    sizes = np.diff(start)
    if (sizes == 3).all():
        return np.arange(len(corner)).reshape(-1, 3)
    parts, face = [], []
    for size in np.unique(sizes):
        faces = np.flatnonzero(sizes == size)
        index = start[faces, None] + np.arange(size)
        points = vertices[corner[index]]
        fan = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], axis=1)
        cut = np.broadcast_to(fan, (len(faces), *fan.shape)).copy()
        if size > 3:
            convex = _fans(points, fan)
            if size == 4:
                other = np.array([[0, 1, 3], [1, 2, 3]])
                bent = np.flatnonzero(~convex)
                cut[bent[_fans(points[bent], other)]] = other
            else:
                for k in np.flatnonzero(~convex):
                    ears = _ears(points[k])
                    cut[k] = 0
                    cut[k, : len(ears)] = ears
        parts.append((start[faces, None, None] + cut).reshape(-1, 3))
        face.append(np.repeat(faces, size - 2))
    return np.concatenate(parts)[np.argsort(np.concatenate(face), kind="stable")]


def _fans(points, triangles):
    """Whether triangles (k, 3) of the corners of faces (f, c, 3) all look the way of their face -> (f,)"""
    p = points - points.mean(axis=1, keepdims=True)
    normal = np.cross(p, np.roll(p, -1, axis=1)).sum(axis=1)
    a, b, c = np.moveaxis(p[:, triangles], 2, 0)
    area = np.einsum("fki,fi->fk", np.cross(b - a, c - a), normal)
    return (area > FLATTEST * (normal**2).sum(axis=1)[:, None]).all(axis=1)


def _ears(points):
    """(t, 3) triangles of one face of any outline, corners (k, 3) m."""
    p = points - points.mean(axis=0)
    normal = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
    e = p[np.argmax((p * p).sum(axis=1))]
    e = unit(e - e @ normal * normal / max(normal @ normal, 1e-300))
    frame = np.stack([e, np.cross(unit(normal), e)])
    if not (normal.any() and e.any() and np.isfinite(p).all()):
        return np.zeros((0, 3), int)
    return triangulated([p @ frame.T])


def _angles(points):
    """(t, 3) angles at the corners of triangles (t, 3, 3)."""
    to, back = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    return np.arctan2(np.linalg.norm(np.cross(to, back), axis=2), (to * back).sum(axis=2))
