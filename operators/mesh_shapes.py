"""What a mesh is: UV spheres and parallelograms, found from its arrays alone. numpy only, no bpy."""

from dataclasses import dataclass

import numpy as np

from .mesh_planes import FAILURES, find_planes
from .mesh_spheres import COARSEST, SphereShape, find_sphere
from .mesh_topology import MeshArrays, NotRecognised


@dataclass(frozen=True, eq=False)
class MeshShapes:
    """shapes: list of SphereShape and PlaneShape in local coordinates; polygon_shape (p,): index of each polygon's.
    bodies (n shapes,): a number for each, the same within a closed body that it bounds, -1 where it bounds none."""

    shapes: list
    polygon_shape: np.ndarray
    bodies: np.ndarray

    @property
    def kind(self):
        """'SPHERE', 'PLANE', 'PLANES' or 'SHAPES'."""
        spheres = sum(isinstance(shape, SphereShape) for shape in self.shapes)
        if len(self.shapes) == 1:
            return "SPHERE" if spheres else "PLANE"
        return "SHAPES" if spheres else "PLANES"

    @property
    def label(self):
        """For the user: UV sphere 32 x 16; plane; 6 planes; 2 UV spheres, 1 plane."""
        spheres = [shape for shape in self.shapes if isinstance(shape, SphereShape)]
        planes = len(self.shapes) - len(spheres)
        if len(self.shapes) == 1:
            return f"UV sphere {spheres[0].segments} x {spheres[0].rings}" if spheres else "plane"
        counted = [(len(spheres), "UV sphere"), (planes, "plane")]
        return ", ".join(f"{n} {what}{'s' * (n > 1)}" for n, what in counted if n)


def find_shapes(vertices, corners, counts, materials=None, grids=None):
    """MeshShapes of a mesh, every polygon part of a shape; NotRecognised with the reason otherwise.

    vertices (n, 3) m, corners (c,) vertex of each polygon corner, counts (p,) corners of each polygon, materials (p,)
    a number that differs between materials: it parts planes, and a sphere has one. grids: a dict that speeds up a row
    of calls, see find_sphere.
    """
    mesh = MeshArrays.make(vertices, corners, counts, materials)
    _check(mesh)
    grids = {} if grids is None else grids
    fault = None
    try:
        if sphere := _whole_sphere(mesh, grids):
            return MeshShapes([sphere], np.zeros(len(mesh.counts), np.int64), np.array([-1]))
    except NotRecognised as error:
        fault = error
    groups = find_planes(mesh)
    component = mesh.components()
    failed = np.unique(component[groups.failure[groups.label] > 0])
    if len(failed) and (component == component[0]).all():
        raise fault or _neither(groups.failure)
    return _mixed(mesh, groups, component, failed, grids)


def _check(mesh):
    if not len(mesh.counts):
        raise NotRecognised("has no faces")
    if not np.isfinite(mesh.vertices).all():
        raise NotRecognised("has vertices that are not finite; remove or repair them")
    if len(mesh.vertices) - np.count_nonzero(np.bincount(mesh.corners, minlength=len(mesh.vertices))):
        raise NotRecognised("has loose vertices; remove them (Mesh > Clean Up > Delete Loose)")
    if mesh.rounding > COARSEST * np.ptp(mesh.vertices, axis=0).max():
        raise NotRecognised("is too small for its distance from the object's origin; use Set Origin to Geometry")


def _whole_sphere(mesh, grids):
    sphere = find_sphere(mesh, grids)
    if sphere and (mesh.materials != mesh.materials[0]).any():
        raise NotRecognised("is a UV sphere with more than one material; give it one")
    return sphere


def _neither(failure):
    first = FAILURES[failure[np.flatnonzero(failure)[0]]]
    return NotRecognised(f"is neither an unedited UV sphere nor made of flat parallelograms: {first}")


def _mixed(mesh, groups, component, failed, grids):
    """Components that are no planes must be spheres; shapes are numbered in order of their first polygon."""
    number = groups.label.copy()
    spheres = {}
    for part in failed:
        polygons = component == part
        sphere = _whole_sphere(mesh.part(polygons), grids)
        if sphere is None:
            raise _neither(groups.failure[groups.label[polygons]])
        first = number[polygons].min()
        number[polygons], spheres[first] = first, sphere
    numbers, polygon_shape = np.unique(number, return_inverse=True)
    shapes = [spheres.get(k) or groups.plane(k) for k in numbers.tolist()]
    return MeshShapes(shapes, polygon_shape, _bodies(mesh.bodies, polygon_shape, len(shapes)))


def _bodies(body, polygon_shape, count):
    """Bodies of polygons (p,) -> those of the shapes (count,) that they make up: of all their polygons, or none."""
    low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, -1)
    np.minimum.at(low, polygon_shape, body)
    np.maximum.at(high, polygon_shape, body)
    return np.where(low == high, low, -1)
