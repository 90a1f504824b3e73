"""What a mesh is: UV spheres, parallelograms, polygons and the rest, from its arrays alone. numpy only, no bpy."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .mesh_clean import clean, fans, weld
from .mesh_curved import curved
from .mesh_flat import directions, flat_groups, in_order
from .mesh_outlines import PolygonShape, polygons_of
from .mesh_planes import PlaneShape, planes_of
from .mesh_spheres import COARSEST, SphereShape, find_sphere
from .mesh_topology import MeshArrays, NotRecognised, connected

MISSES = 16  # components of one number of vertices and faces that are no spheres: the others are not tried
LEAST_SPHERE = 9  # flat groups that the coarsest one has, and a box has not


@dataclass(frozen=True, eq=False)
class MeshShape:
    """What is neither round nor flat, local: vertices (n, 3), triangles (t, 3), and the shading normals (t, 3, 3) of
    their corners; faces: how many polygons they are."""

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    faces: int


@dataclass(frozen=True, eq=False)
class MeshShapes:
    """shapes: list of SphereShape, PlaneShape, PolygonShape and MeshShape in local coordinates.

    corner_shape (c,), triangle_shape (t,): index of the shape of each corner and triangle as given, whose backs
    corner_back and triangle_back tell; material (n shapes,); bodies (n shapes,): a number for each, the same within
    closed bodies that it bounds, -1 where it bounds none. warnings: sentences that go on after the object's name.
    """

    shapes: list
    corner_shape: np.ndarray
    triangle_shape: np.ndarray
    corner_back: np.ndarray
    triangle_back: np.ndarray
    material: np.ndarray
    bodies: np.ndarray
    warnings: list = field(default_factory=list)
    _source: object = None  # in which they were found

    def as_mesh(self, shape):
        """The MeshShape that a flat shape's faces make up."""
        return self._source.mesh(shape)

    @cached_property
    def counts(self):
        """Of spheres, planes, polygons, meshes."""
        kinds = (SphereShape, PlaneShape, PolygonShape, MeshShape)
        return tuple(sum(isinstance(shape, kind) for shape in self.shapes) for kind in kinds)

    @property
    def kind(self):
        """'SPHERE', 'PLANE', 'PLANES', 'POLYGONS', 'MESH' where any part is one, or 'SHAPES'."""
        spheres, planes, polygons, meshes = self.counts
        if meshes:
            return "MESH"
        if spheres:
            return "SPHERE" if len(self.shapes) == 1 else "SHAPES"
        if polygons:
            return "POLYGONS"
        return "PLANE" if planes == 1 else "PLANES"

    @property
    def exactness(self):
        return "approximate" if self.counts[3] else "exact"

    @property
    def label(self):
        """For the user: UV sphere 32 x 16; plane; 6 planes; 2 UV spheres, 1 plane, 12 polygons, mesh of 300 faces."""
        spheres, planes, polygons, meshes = self.counts
        if len(self.shapes) == 1 and not meshes:
            only = self.shapes[0]
            if spheres:
                return f"UV sphere {only.segments} x {only.rings}" + ("" if only.is_even else ", finer in places")
            return "plane" if planes else "polygon"
        counted = [(spheres, "UV sphere"), (planes, "plane"), (polygons, "polygon")]
        parts = [f"{n:,} {what}{'s' * (n > 1)}" for n, what in counted if n]
        if meshes:
            faces = sum(shape.faces for shape in self.shapes if isinstance(shape, MeshShape))
            parts.append(f"mesh of {faces:,} face{'s' * (faces > 1)}")
        return ", ".join(parts)


def find_shapes(vertices, corners, counts, materials=None, grids=None, triangles=None, normals=None):
    """MeshShapes of a mesh, every polygon part of a shape; NotRecognised where there is nothing to be one.

    vertices (n, 3) m, corners (c,) vertex of each polygon corner, counts (p,) corners of each polygon, materials (p,)
    a number that differs between materials: it parts shapes. grids: a dict that speeds up a row of calls, see
    find_sphere. triangles (t, 3) corners of the polygons' triangles, normals (c, 3) with which corners are shaded:
    fans and flat ones where there are none.
    """
    mesh = MeshArrays.make(vertices, corners, counts, materials)
    _check(mesh)
    triangles = None if triangles is None else np.asarray(triangles, np.int64)
    grids, warnings, welded = {} if grids is None else grids, [], weld(mesh)
    if sphere := _sphere(_without_loose(welded), grids, warnings):
        return _one(sphere, mesh, fans(mesh) if triangles is None else triangles)
    found = clean(welded, triangles)
    if found is None:
        raise NotRecognised("has no face with an area; remove it or give it a size")
    faces = found.faces
    unit, noise = directions(faces)
    groups = flat_groups(faces, unit, noise, found.bent)
    of_sphere, spheres = _spheres(groups, grids, warnings)
    rest = found.bent | curved(groups, unit, found.source, normals)[groups.label]
    pieces = _pieces(groups, of_sphere, rest)
    source = _Source(found, welded, unit, normals, pieces.number)
    shapes = [pieces.shape(k, spheres) or source.mesh(k) for k in range(pieces.count)]
    return MeshShapes(
        shapes,
        pieces.number[found.corner_face],
        pieces.number[found.triangle_face],
        found.corner_back ^ pieces.backward[found.corner_face],
        found.triangle_back ^ pieces.backward[found.triangle_face],
        faces.materials[pieces.first],
        _bodies(faces.bodies, pieces.number, pieces.count),
        found.warnings + warnings,
        source,
    )


def _check(mesh):
    if not len(mesh.counts):
        raise NotRecognised("has no faces")
    if not np.isfinite(mesh.vertices).all():
        raise NotRecognised("has vertices that are not finite; remove or repair them")
    if mesh.rounding > COARSEST * _extent(mesh):
        raise NotRecognised("is too small for its distance from the object's origin; use Set Origin to Geometry")


def _extent(mesh):
    """m; the largest along the axes, of what has faces."""
    is_used = np.zeros(len(mesh.vertices), bool)
    is_used[mesh.corners] = True
    return max(np.ptp(column[is_used]) for column in mesh.vertices.T)


def _without_loose(mesh):
    loose = np.bincount(mesh.corners, minlength=len(mesh.vertices)) == 0
    return mesh.part(np.ones(len(mesh.counts), bool)) if loose.any() else mesh


def _sphere(mesh, grids, warnings):
    """The SphereShape that a MeshArrays is, or None."""
    try:
        sphere = find_sphere(mesh, grids)
    except NotRecognised:
        return None  # one with a fault is a mesh like any other
    if sphere and (mesh.materials != mesh.materials[0]).any():
        text = "has a UV sphere of more than one material, which is taken as it is meshed; with one it would be exact"
        warnings += [text] if text not in warnings else []
        return None
    return sphere


def _one(sphere, mesh, triangles):
    """The MeshShapes of a mesh that is a sphere as a whole."""
    corner, triangle = np.zeros(len(mesh.corners), np.int64), np.zeros(len(triangles), np.int64)
    backs = corner.astype(bool), triangle.astype(bool)
    return MeshShapes([sphere], corner, triangle, *backs, mesh.materials[:1], np.array([-1]))


def _spheres(groups, grids, warnings):
    """sphere (f,): which of the list each face is part of, -1 for none; [SphereShape]: components of their own."""
    faces = groups.faces
    of, spheres = np.full(len(faces.counts), -1), []
    component = in_order(faces.components)
    count = int(component.max()) + 1
    if count == 1:
        return of, spheres  # tried as a whole
    flat = np.bincount(component[np.unique(groups.label, return_index=True)[1]], minlength=count)
    open_edges = np.bincount(component[faces.polygons], np.bincount(faces.edge)[faces.edge] != 2, count)
    widest = np.zeros(count, np.int64)
    np.maximum.at(widest, component, faces.counts)
    order = np.argsort(component, kind="stable")
    starts = np.searchsorted(component[order], np.arange(count + 1))
    missed = {}
    for k in np.flatnonzero((flat >= LEAST_SPHERE) & (open_edges == 0) & (widest <= 4)).tolist():
        own = order[starts[k] : starts[k + 1]]
        part = faces.part(own)
        like = len(part.vertices), len(part.counts)
        if missed.get(like, 0) >= MISSES:
            continue
        if sphere := _sphere(part, grids, warnings):
            of[own] = len(spheres)
            spheres.append(sphere)
        else:
            missed[like] = missed.get(like, 0) + 1
    return of, spheres


@dataclass(eq=False)
class _Pieces:
    """number (f,): the shape of each face, in order of their first faces; backward (f,): whether it looks against its
    shape; label (f,): groups, flat (g,): those that are shapes; planes: corner, u, v (g, 3) of them; outlines {group:
    PolygonShape} of those that are no parallelograms; of_sphere (f,): see _spheres."""

    number: np.ndarray
    backward: np.ndarray
    label: np.ndarray
    of_sphere: np.ndarray
    flat: np.ndarray
    planes: list
    outlines: dict

    @cached_property
    def first(self):
        """(n shapes,) the first face of each."""
        return np.unique(self.number, return_index=True)[1]

    @property
    def count(self):
        return len(self.first)

    def shape(self, k, spheres):
        """The shape with this number, None for a mesh."""
        face = self.first[k]
        group = self.label[face]
        if self.of_sphere[face] >= 0:
            return spheres[self.of_sphere[face]]
        if not self.flat[group]:
            return None
        return self.outlines.get(group) or PlaneShape(*(part[group] for part in self.planes))


def _pieces(groups, of_sphere, rest):
    """The _Pieces of FlatGroups. rest (f,): faces of meshes."""
    faces = groups.faces
    flat = np.ones(groups.count, bool)
    flat[groups.label[rest | (of_sphere >= 0)]] = False
    planes, outlines, backward = [np.zeros((groups.count, 3)) for _ in range(3)], {}, np.zeros(len(faces.counts), bool)
    if flat.any():
        part, number = groups.part(flat)
        sound = ~(part.narrow | part.tangled)
        *found, filled = planes_of(part)
        for whole, rows in zip(planes, found):
            whole[number] = rows
        filled &= sound
        outlines = {int(number[k]): outline for k, outline in polygons_of(part, sound & ~filled).items()}
        backward[flat[groups.label]] = part.backward
        flat[number] = filled | np.isin(number, list(outlines))
        backward &= flat[groups.label]
    # one mesh a material, and the closed ones by themselves
    kind = 2 * np.unique(faces.materials, return_inverse=True)[1] + (faces.bodies >= 0)
    number = np.where(flat[groups.label], groups.label, groups.count + kind)
    number = np.where(of_sphere >= 0, groups.count + kind.max() + 1 + of_sphere, number)
    return _Pieces(in_order(number), backward, groups.label, of_sphere, flat, planes, outlines)


@dataclass(eq=False)
class _Source:
    """What shapes were found in: a CleanMesh, the MeshArrays it was made of, unit normals (f, 3) of its faces, shading
    normals (C, 3) or None, and the shape of each face (f,)."""

    found: object
    welded: MeshArrays
    unit: np.ndarray
    normals: np.ndarray | None
    number: np.ndarray

    @cached_property
    def _by_shape(self):
        """The triangles sorted by shape, and where each shape begins."""
        number = self.number[self.found.triangle_face]
        vertex = self.welded.corners[self.found.triangles]
        some = np.flatnonzero(self.found.live & _all_differ(vertex))
        order = some[np.argsort(number[some], kind="stable")]
        return order, np.searchsorted(number[order], np.arange(int(self.number.max()) + 2))

    def mesh(self, shape):
        """The MeshShape of the faces of one."""
        order, starts = self._by_shape
        triangle = order[starts[shape] : starts[shape + 1]]
        corner = self.found.triangles[triangle]
        vertex = self.welded.corners[corner]
        is_used = np.zeros(len(self.welded.vertices), bool)
        is_used[vertex] = True
        face = self.found.triangle_face[triangle]
        normals = self.unit[face][:, None].repeat(3, axis=1) if self.normals is None else self.normals[corner]
        faces = int(np.count_nonzero(np.bincount(self.welded.polygons[corner[:, 0]])))
        return MeshShape(self.welded.vertices[is_used], (np.cumsum(is_used) - 1)[vertex], normals, faces)


def _all_differ(vertex):
    """(t,) Whether the three vertices (t, 3) of triangles are three."""
    a, b, c = vertex.T
    return (a != b) & (b != c) & (c != a)


def _bodies(body, number, count):
    """Bodies of faces (f,) -> those of the shapes (count,) that they make up: of all their faces, or none. What bounds
    several makes them one."""
    low = np.full(count, np.iinfo(np.int64).max)
    np.minimum.at(low, number, body)
    bounds = (low >= 0)[number]
    of, body = number[bounds], body[bounds]
    if not len(of):
        return np.full(count, -1)
    together = connected(int(body.max()) + 1, body, low[of])
    return np.where(low >= 0, together[np.maximum(low, 0)], -1)
