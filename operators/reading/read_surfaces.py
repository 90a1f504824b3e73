"""Recognised meshes as the core's shapes in the world, and the sides of them that become surfaces."""

from dataclasses import dataclass

import numpy as np

from ...pdm_core import Mesh, Plane, Polygon, Sphere, Surface
from ...pdm_core.coincident import one_and_the_same
from ...pdm_core.shapes.shape import unit
from ...pdm_core.tolerances import TOUCHING
from .materials import BACK, FRONT, Appearance
from .mesh_arrays import in_world
from .mesh_outlines import PolygonShape
from .mesh_planes import PlaneShape
from .mesh_shapes import MeshShape
from .mesh_spheres import SphereShape

ROUND = 2e-6  # Blender's world matrices are float32: semi-axes that agree to this are those of a round sphere
CALLED = {Plane: "face", Polygon: "face", Sphere: "sphere", Mesh: "mesh"}


@dataclass(frozen=True, eq=False)
class Piece:
    """One shape of an object in the world. hidden: the side that the mesh's normals do not face."""

    name: str
    shape: Plane | Sphere | Polygon | Mesh
    look: Appearance
    is_outward: bool = True  # False for a sphere whose normals point inside
    body: tuple = ()  # the same of what bounds a closed body, its normals outward
    is_doubled: bool = False  # faces of the mesh lie on its hidden side
    material: str | None = None  # by which it looks so

    def surface(self, hidden=False):
        """The Surface of the side that the mesh's normals face, or of the hidden one."""
        side = "front" if self.is_outward != hidden else "back"
        note = ""
        if hidden:
            inside = " (inside)" if self.is_outward else " (outside)"
            note = inside if self.shape.is_ball else " (back)"
        look = BACK if hidden else FRONT
        return Surface(self.shape, self.look.reflectance[look], self.look.emission[look], side, self.name + note)


def pieces_of(name, matrix, shapes, looks, materials):
    """[Piece] of the MeshShapes `shapes` under `matrix` (4, 4), with Appearances and names of materials.

    A side keeps facing where the inverse transpose of the matrix takes its normal, mirrored or not, as in Cycles.
    """
    step = -1 if np.linalg.det(matrix[:3, :3]) < 0 else 1  # mirrored, the order of corners turns
    pieces, doubled = [], np.bincount(shapes.corner_shape[shapes.corner_back], minlength=len(shapes.shapes)) > 0
    for k, (look, body) in enumerate(zip(looks, shapes.bodies.tolist(), strict=True)):
        shape = _in_the_world(matrix, step, shapes.shapes[k])
        if isinstance(shape, Polygon) and shape.problem:
            shape = _in_the_world(matrix, step, shapes.as_mesh(k))
        label = name if len(looks) == 1 else f"{name} {CALLED[type(shape)]} {k + 1}"
        outward = getattr(shapes.shapes[k], "is_outward", True)
        pieces.append(
            Piece(label, shape, look, outward, (name, body) if body >= 0 else (), bool(doubled[k]), materials[k])
        )
    return pieces


def _plane(matrix, step, shape):
    linear, origin = matrix[:3, :3], matrix[:3, 3]
    u, v = (linear @ shape.u, linear @ shape.v)[::step]
    return Plane(linear @ shape.corner + origin, u, v)


def _polygon(matrix, step, shape):
    outline, *holes = (in_world(matrix, loop)[::step] for loop in (shape.outline, *shape.holes))
    return Polygon(outline, holes)


def _mesh(matrix, step, shape):
    normals = unit(shape.normals[:, ::step].reshape(-1, 3) @ turning_normals(matrix[:3, :3]).T)
    return Mesh(in_world(matrix, shape.vertices), shape.triangles[:, ::step], normals)


def turning_normals(linear):
    """(3, 3) What turns the normals of a mesh that a linear map takes to the world: its cofactors, which tell those of
    what it presses flat too."""
    turned = np.cross(np.roll(linear, -1, axis=0), np.roll(linear, -2, axis=0))
    return -turned if np.linalg.det(linear) < 0 else turned


def _sphere(matrix, step, shape):
    matrix = matrix @ shape.matrix
    axes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if axes[0] > 0 and axes[0] - axes[2] <= ROUND * axes[0]:
        return Sphere.at(matrix[:3, 3], axes.mean())
    # a mirrored sphere is the same sphere
    return Sphere(matrix * [1, 1, np.sign(np.linalg.det(matrix[:3, :3])) or 1, 1])


# shapes of the core from local ones under a matrix (4, 4), corners in steps of 1, or -1 where that mirrors
IN_THE_WORLD = {PlaneShape: _plane, PolygonShape: _polygon, MeshShape: _mesh, SphereShape: _sphere}


def _in_the_world(matrix, step, shape):
    return IN_THE_WORLD[type(shape)](matrix, step, shape)


def twins(pieces):
    """(n,) for each piece the index of the first one that lies exactly on it and faces as it does, or -1."""
    if not pieces:
        return np.zeros(0, int)
    radius = np.array([piece.shape.bounds[1] for piece in pieces])
    first = one_and_the_same([piece.shape for piece in pieces], TOUCHING * radius)
    return np.where(first < np.arange(len(pieces)), first, -1)
