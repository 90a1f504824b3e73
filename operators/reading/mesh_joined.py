"""Several meshes as one, so that each step of recognition is one pass over all of them. numpy only, no bpy."""

from dataclasses import dataclass, replace

import numpy as np

from .mesh_topology import MeshArrays, rounding_of, spans


@dataclass(frozen=True, eq=False)
class Given:
    """A mesh as it is given to be recognised, see find_shapes."""

    vertices: np.ndarray
    corners: np.ndarray
    counts: np.ndarray
    materials: np.ndarray | None = None
    triangles: np.ndarray | None = None
    normals: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Joined:
    """mesh: MeshArrays of all; triangles (T, 3) corners, of polygons taken for convex where is_convex; normals (C, 3)
    or None; of each mesh where its corners and triangles begin, and how much its materials' numbers were raised:
    (m + 1,), (m + 1,), (m,)."""

    mesh: MeshArrays
    triangles: np.ndarray
    is_convex: bool
    normals: np.ndarray | None
    corner: np.ndarray
    triangle: np.ndarray
    material: np.ndarray

    def without(self, polygons):
        """Joined of all polygons but these (p,) bool, and which corners and triangles of all it has."""
        if not polygons.any():
            return self, slice(None), slice(None)
        of, kept = self.mesh, ~polygons
        corners = np.flatnonzero(kept[of.polygons])
        triangles = np.flatnonzero(kept[of.polygons[self.triangles[:, 0]]])
        place = np.empty(len(of.corners), np.int64)
        place[corners] = np.arange(len(corners))
        part = replace(
            self,
            mesh=of.kept(kept),
            triangles=place[self.triangles[triangles]],
            normals=None if self.normals is None else self.normals[corners],
        )
        return part, corners, triangles


def join(meshes):
    """Joined of [Given], all of which have triangles or none, and all have normals or none."""
    first = meshes[0]
    corner, vertex = _starts([len(m.corners) for m in meshes]), _starts([len(m.vertices) for m in meshes])
    materials = [np.zeros(len(m.counts), np.int64) if m.materials is None else m.materials for m in meshes]
    material = _starts([int(np.max(of)) + 1 for of in materials])[:-1]
    of = np.repeat(np.arange(len(meshes)), [len(m.counts) for m in meshes])
    largest = np.array([np.abs(m.vertices).max() for m in meshes], float)
    mesh = MeshArrays(
        np.concatenate([m.vertices for m in meshes]).astype(np.float64),
        _raised([m.corners for m in meshes], vertex),
        np.concatenate([m.counts for m in meshes]).astype(np.int64),
        np.concatenate(materials) + material[of],
        of,
        rounding_of(largest)[of],
    )
    convex = first.triangles is None
    inner = np.bincount(of, mesh.counts - 2).astype(np.int64) if convex else [len(m.triangles) for m in meshes]
    triangles = fans(mesh) if convex else _raised([m.triangles for m in meshes], corner)
    normals = None if first.normals is None else np.concatenate([m.normals for m in meshes])
    return Joined(mesh, triangles, convex, normals, corner, _starts(inner), material)


def fans(mesh):
    """(T, 3) corners: first corner, corner, next corner of each polygon."""
    inner = mesh.counts - 2
    second = spans(mesh.starts + 1, inner)
    return np.column_stack([np.repeat(mesh.starts, inner), second, second + 1])


def _starts(sizes):
    """(m + 1,) where each of m parts begins among all."""
    return np.concatenate([[0], np.cumsum(sizes)])


def _raised(parts, starts):
    """Arrays of indices as one, those of each raised to where it starts."""
    return np.concatenate([np.asarray(part, np.int64) + start for part, start in zip(parts, starts.tolist())])
