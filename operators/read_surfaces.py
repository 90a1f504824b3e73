"""Recognised meshes as the core's shapes in the world, and the sides of them that become surfaces."""

from dataclasses import dataclass

import numpy as np

from ..pdm_core import Plane, Sphere, Surface
from .materials import BACK, FRONT, Appearance
from .mesh_spheres import SphereShape

ROUND = 2e-6  # Blender's world matrices are float32: semi-axes that agree to this are those of a round sphere
TOUCH = 1e-6  # of the size: shapes that overlap less only touch
SAME = 1e-5  # of the size: shapes that differ less lie on one another


@dataclass(frozen=True, eq=False)
class Piece:
    """One shape of an object in the world. hidden: the side that the mesh's normals do not face."""

    name: str
    shape: Plane | Sphere
    look: Appearance
    is_outward: bool = True  # False for a sphere whose normals point inside

    def surface(self, hidden=False):
        """The Surface of the side that the mesh's normals face, or of the hidden one."""
        side = "front" if self.is_outward != hidden else "back"
        note = ""
        if hidden:
            inside = " (inside)" if self.is_outward else " (outside)"
            note = inside if isinstance(self.shape, Sphere) else " (back)"
        look = BACK if hidden else FRONT
        return Surface(self.shape, self.look.reflectance[look], self.look.emission[look], side, self.name + note)


def pieces_of(name, matrix, shapes, looks):
    """[Piece] of the local `shapes` under `matrix` (4, 4), with an Appearance of each.

    A side keeps facing where the inverse transpose of the matrix takes its normal, mirrored or not, as in Cycles.
    """
    pieces = []
    for k, (shape, look) in enumerate(zip(shapes, looks, strict=True), 1):
        is_sphere = isinstance(shape, SphereShape)
        label = name if len(shapes) == 1 else f"{name} {'sphere' if is_sphere else 'face'} {k}"
        if is_sphere:
            pieces.append(Piece(label, _sphere(matrix @ shape.matrix), look, shape.is_outward))
        else:
            u, v = matrix[:3, :3] @ shape.u, matrix[:3, :3] @ shape.v
            u, v = (v, u) if np.linalg.det(matrix[:3, :3]) < 0 else (u, v)
            pieces.append(Piece(label, Plane(matrix[:3, :3] @ shape.corner + matrix[:3, 3], u, v), look))
    return pieces


def _sphere(matrix):
    axes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if axes[0] > 0 and axes[0] - axes[2] <= ROUND * axes[0]:
        return Sphere.at(matrix[:3, 3], axes.mean())
    # a mirrored sphere is the same sphere
    return Sphere(matrix * [1, 1, np.sign(np.linalg.det(matrix[:3, :3])) or 1, 1])


def twins(pieces):
    """(n,) for each piece the index of the first one that lies exactly on it and faces as it does, or -1."""
    twin = np.arange(len(pieces))
    if len(pieces) < 2:
        return twin - 1
    centre, radius = _bounds(pieces)
    normal = np.array([piece.shape.normal if isinstance(piece.shape, Plane) else np.zeros(3) for piece in pieces])
    spread = np.array([_spread(piece.shape) for piece in pieces])
    order = np.argsort(centre @ [0.31, 0.59, 0.74], kind="stable")  # a direction that no grid of objects is square to
    for step in range(1, len(pieces)):
        a, b = order[:-step], order[step:]
        near = np.linalg.norm(centre[a] - centre[b], axis=1) <= SAME * radius[a]
        if not near.any():
            break
        same = near & (np.abs(spread[a] - spread[b]).max(axis=(1, 2)) <= SAME * radius[a] ** 2)
        same &= np.einsum("ij,ij->i", normal[a], normal[b]) >= 0  # back to back is how boxes stand side by side
        np.minimum.at(twin, np.maximum(a, b)[same], np.minimum(a, b)[same])
    return np.where(twin < np.arange(len(pieces)), twin, -1)


def _bounds(pieces):
    centre, radius = zip(*(piece.shape.bounds for piece in pieces))
    return np.array(centre), np.array(radius)


def _spread(shape):
    """(3, 3) second moments about the centre, the same for all u, v or matrices that make one shape."""
    if isinstance(shape, Plane):
        return np.outer(shape.u, shape.u) + np.outer(shape.v, shape.v)
    return shape.linear @ shape.linear.T


def surfaces_of(pieces):
    """[Surface] of all pieces, and [[facing, hidden]] the indices of each piece's surfaces.

    A plane has both sides. A sphere has the side that its normals face, and the other only where some shape may see
    it: a closed ball's inside is out of every light's reach but its own.
    """
    surfaces, indices = [], []
    for piece, seen in zip(pieces, _hidden_is_seen(pieces), strict=True):
        sides = [piece.surface()] + ([piece.surface(hidden=True)] if seen else [])
        indices.append(list(range(len(surfaces), len(surfaces) + len(sides))))
        surfaces += sides
    return surfaces, indices


def _hidden_is_seen(pieces):
    """(n,) True for planes, and for spheres where another shape's bounds reach to the hidden side."""
    if not pieces:
        return np.zeros(0, bool)
    centre, radius = _bounds(pieces)
    is_plane = np.array([isinstance(piece.shape, Plane) for piece in pieces])
    normal = np.array([piece.shape.normal if isinstance(piece.shape, Plane) else np.zeros(3) for piece in pieces])
    seen = is_plane.copy()
    for i in np.flatnonzero(~is_plane):
        shape = pieces[i].shape
        distance = np.linalg.norm(centre - centre[i], axis=1)
        if pieces[i].is_outward:
            # a plane is out of reach too where it passes the ball by: `reach` is half the ball's width across it
            reach = np.linalg.norm(normal @ shape.linear, axis=1)
            apart = np.abs(np.einsum("ij,ij->i", normal, centre - centre[i]))
            inside = (distance < (radius + radius[i]) * (1 - TOUCH)) & (~is_plane | (apart < reach * (1 - TOUCH)))
            inside[i] = False
            seen[i] = inside.any()
        else:
            outside = distance + radius > shape.semi_axes[2] * (1 + TOUCH)
            outside[i] = False
            seen[i] = outside.any()
    return seen
