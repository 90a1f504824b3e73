"""Recognised meshes as the core's shapes in the world, and the sides of them that become surfaces."""

from dataclasses import dataclass

import numpy as np

from ..pdm_core import Plane, Sphere, Surface
from ..pdm_core.coincident import one_and_the_same
from .materials import BACK, FRONT, Appearance
from .mesh_spheres import SphereShape

ROUND = 2e-6  # Blender's world matrices are float32: semi-axes that agree to this are those of a round sphere
TOUCH = 1e-6  # of the size: shapes that overlap less only touch
SAME = 1e-6  # of the size: shapes that differ by no more than a few of it lie on one another


@dataclass(frozen=True, eq=False)
class Piece:
    """One shape of an object in the world. hidden: the side that the mesh's normals do not face."""

    name: str
    shape: Plane | Sphere
    look: Appearance
    is_outward: bool = True  # False for a sphere whose normals point inside
    body: tuple = ()  # the same of planes that bound a closed body, their normals outward

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
    """[Piece] of the MeshShapes `shapes` under `matrix` (4, 4), with an Appearance of each shape.

    A side keeps facing where the inverse transpose of the matrix takes its normal, mirrored or not, as in Cycles.
    """
    pieces = []
    for k, (shape, look, body) in enumerate(zip(shapes.shapes, looks, shapes.bodies.tolist(), strict=True), 1):
        is_sphere = isinstance(shape, SphereShape)
        label = name if len(looks) == 1 else f"{name} {'sphere' if is_sphere else 'face'} {k}"
        if is_sphere:
            pieces.append(Piece(label, _sphere(matrix @ shape.matrix), look, shape.is_outward))
        else:
            u, v = matrix[:3, :3] @ shape.u, matrix[:3, :3] @ shape.v
            u, v = (v, u) if np.linalg.det(matrix[:3, :3]) < 0 else (u, v)
            plane = Plane(matrix[:3, :3] @ shape.corner + matrix[:3, 3], u, v)
            pieces.append(Piece(label, plane, look, body=(name, body) if body >= 0 else ()))
    return pieces


def _sphere(matrix):
    axes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if axes[0] > 0 and axes[0] - axes[2] <= ROUND * axes[0]:
        return Sphere.at(matrix[:3, 3], axes.mean())
    # a mirrored sphere is the same sphere
    return Sphere(matrix * [1, 1, np.sign(np.linalg.det(matrix[:3, :3])) or 1, 1])


def twins(pieces):
    """(n,) for each piece the index of the first one that lies exactly on it and faces as it does, or -1."""
    if not pieces:
        return np.zeros(0, int)
    first = one_and_the_same([piece.shape for piece in pieces], SAME * _bounds(pieces)[1])
    return np.where(first < np.arange(len(pieces)), first, -1)


def _bounds(pieces):
    centre, radius = zip(*(piece.shape.bounds for piece in pieces))
    return np.array(centre), np.array(radius)


def surfaces_of(pieces):
    """[Surface] of all pieces, and [[facing, hidden]] the indices of each piece's surfaces.

    A plane has both sides, a sphere that which its normals face. The hidden sides of closed bodies, and of closed
    balls, are left out where no light comes: they are out of every light's reach but of one that is inside.
    """
    surfaces, indices = [], []
    for piece, seen in zip(pieces, _hidden_is_seen(pieces), strict=True):
        sides = [piece.surface()] + ([piece.surface(hidden=True)] if seen else [])
        indices.append(list(range(len(surfaces), len(surfaces) + len(sides))))
        surfaces += sides
    return surfaces, indices


def _hidden_is_seen(pieces):
    """(n,) Whether light may come to the hidden side of each, from outside itself."""
    if not pieces:
        return np.zeros(0, bool)
    low, high = _boxes(pieces)
    shines = np.array([piece.look.shines for piece in pieces])
    seen = np.array([isinstance(piece.shape, Plane) for piece in pieces])
    for inner in _closed(pieces):
        touch = TOUCH * (high[inner] - low[inner]).max()
        inside = (low < high[inner].max(axis=0) - touch).all(axis=1)
        inside &= (high > low[inner].min(axis=0) + touch).all(axis=1)
        inside[inner] = False
        if not shines[inner].any():  # then what receives light inside has it from what is inside
            inside &= shines
        if len(inner) == 1 and inside.any():
            inside &= _reaches_into(pieces, inner[0])
        seen[inner] = inside.any()
    for k, piece in enumerate(pieces):
        if not piece.is_outward:
            outside = _beyond(pieces, piece.shape)
            outside[k] = False
            seen[k] = outside.any()
    return seen


def _closed(pieces):
    """[indices] of the pieces of each closed body, and of each ball with its normals outward."""
    bodies = {}
    for k, piece in enumerate(pieces):
        if piece.body:
            bodies.setdefault(piece.body, []).append(k)
    balls = [k for k, piece in enumerate(pieces) if isinstance(piece.shape, Sphere) and piece.is_outward]
    return [np.array(body) for body in bodies.values()] + [np.array([k]) for k in balls]


def _boxes(pieces):
    """low, high (n, 3) m: the pieces' extents along the axes."""
    extents = []
    for piece in pieces:
        if isinstance(piece.shape, Plane):
            extents.append((piece.shape.corners.min(axis=0), piece.shape.corners.max(axis=0)))
        else:
            reach = np.linalg.norm(piece.shape.linear, axis=1)
            extents.append((piece.shape.origin - reach, piece.shape.origin + reach))
    low, high = zip(*extents)
    return np.array(low), np.array(high)


def _reaches_into(pieces, k):
    """(n,) False for pieces that are wholly outside ball k, as far as bounds tell."""
    centre, radius = _bounds(pieces)
    normal = np.array([piece.shape.normal if isinstance(piece.shape, Plane) else np.zeros(3) for piece in pieces])
    # a plane is out of reach too where it passes the ball by: `reach` is half the ball's width across it
    reach = np.linalg.norm(normal @ pieces[k].shape.linear, axis=1)
    apart = np.abs(np.einsum("ij,ij->i", normal, centre - centre[k]))
    distance = np.linalg.norm(centre - centre[k], axis=1)
    passes = normal.any(axis=1) & (apart >= reach * (1 - TOUCH))
    return (distance < (radius + radius[k]) * (1 - TOUCH)) & ~passes


def _beyond(pieces, dome):
    """(n,) Whether pieces reach out of a dome, as far as bounds tell."""
    centre, radius = _bounds(pieces)
    distance = np.linalg.norm(centre - dome.bounds[0], axis=1)
    return distance + radius > dome.semi_axes[2] * (1 + TOUCH)
