"""What a mesh is: UV spheres, parallelograms, polygons and the rest, found from its arrays alone. numpy only, no bpy."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .mesh_clean import clean, weld
from .mesh_curved import curved
from .mesh_flat import directions, flat_groups, in_order
from .mesh_outlines import PolygonShape, polygons_of
from .mesh_planes import PlaneShape, planes_of
from .mesh_spheres import COARSEST, SphereShape, find_sphere
from .mesh_topology import MeshArrays, NotRecognised, connected, spans

MISSES = 16  # components of one number of vertices and faces that are no spheres: the others are not tried
LEAST_SPHERE = 9  # flat groups that the coarsest one has, and a box has not


@dataclass(frozen=True, eq=False)
class MeshShape:
    """What is neither round nor flat, local: vertices (n, 3), triangles (t, 3), and the shading normals (t, 3, 3) of
    their corners; faces: how many faces they are."""

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
    _pieces: object = None  # MeshShape of any of them

    def as_mesh(self, shape):
        """The MeshShape that a flat shape's faces make up."""
        return self._pieces.mesh(shape)

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
    def label(self):
        """For the user: UV sphere 32 x 16; plane; 6 planes; 2 UV spheres, 1 plane, 12 polygons, mesh of 300 faces."""
        spheres, planes, polygons, meshes = self.counts
        if len(self.shapes) == 1 and not meshes:
            only = self.shapes[0]
            return f"UV sphere {only.segments} x {only.rings}" if spheres else "plane" if planes else "polygon"
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
    triangles = None if triangles is None or not len(triangles) else np.asarray(triangles, np.int64)
    normals = None if normals is None else np.asarray(normals, np.float64)
    _check(mesh)
    grids, warnings = {} if grids is None else grids, []
    if sphere := _sphere(_without_loose(weld(mesh)), grids, warnings):
        return _one(sphere, mesh, triangles)
    found = clean(mesh, triangles)
    if found is None:
        raise NotRecognised("has no face with an area; remove it or give it a size")
    faces = found.faces
    unit, noise = directions(faces)
    groups = flat_groups(faces, unit, noise)
    sphere_of, spheres = _spheres(groups, grids, warnings)
    round_ones = np.zeros(groups.count, bool)
    round_ones[groups.label[sphere_of >= 0]] = True
    pieces = _Pieces(faces, unit, found.source, normals, groups)
    rest = curved(groups, unit, found.source, normals) | groups.narrow | groups.tangled
    number, shapes = _numbered(pieces, sphere_of, spheres, rest & ~round_ones)
    pieces.number = number
    first = np.unique(number, return_index=True)[1]
    return MeshShapes(
        shapes,
        number[found.corner_face],
        number[found.triangle_face],
        found.corner_back ^ pieces.backward[found.corner_face],
        found.triangle_back ^ pieces.backward[found.triangle_face],
        faces.materials[first],
        _bodies(faces.bodies, number, len(shapes)),
        found.warnings + warnings,
        pieces,
    )


def _check(mesh):
    if not len(mesh.counts):
        raise NotRecognised("has no faces")
    if not np.isfinite(mesh.vertices).all():
        raise NotRecognised("has vertices that are not finite; remove or repair them")
    if mesh.rounding > COARSEST * np.ptp(mesh.vertices[mesh.corners], axis=0).max():
        raise NotRecognised("is too small for its distance from the object's origin; use Set Origin to Geometry")


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
    count = len(triangles) if triangles is not None else int((mesh.counts - 2).sum())
    corner, triangle = np.zeros(len(mesh.corners), np.int64), np.zeros(count, np.int64)
    backs = np.zeros(len(corner), bool), np.zeros(count, bool)
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
        part = faces.part(order[starts[k] : starts[k + 1]])
        like = len(part.vertices), len(part.counts)
        if missed.get(like, 0) >= MISSES:
            continue
        if sphere := _sphere(part, grids, warnings):
            of[component == k] = len(spheres)
            spheres.append(sphere)
        else:
            missed[like] = missed.get(like, 0) + 1
    return of, spheres


def _numbered(pieces, sphere_of, spheres, rest):
    """number (f,) of each face's shape, in order of their first faces, and the shapes. rest (g,): groups of meshes."""
    groups, faces = pieces.groups, pieces.faces
    flat = ~rest
    flat[groups.label[sphere_of >= 0]] = False
    outlines, planes = {}, None
    if flat.any():
        planes = _planes(groups, flat)
        outlines = polygons_of(groups, flat & ~planes[3])
        flat &= planes[3] | np.isin(np.arange(groups.count), list(outlines))
    # one mesh a material, and the closed ones by themselves
    kind = 2 * np.unique(faces.materials, return_inverse=True)[1] + (faces.bodies >= 0)
    number = np.where(flat[groups.label], groups.label, groups.count + kind)
    number = np.where(sphere_of >= 0, groups.count + kind.max() + 1 + sphere_of, number)
    number, firsts = in_order(number), None
    firsts = np.unique(number, return_index=True)[1]
    pieces.number, shapes = number, []
    for k, face in enumerate(firsts.tolist()):
        group = groups.label[face]
        if sphere_of[face] >= 0:
            shapes.append(spheres[sphere_of[face]])
        elif flat[group]:
            shapes.append(outlines.get(group) or PlaneShape(*(part[group] for part in planes[:3])))
        else:
            shapes.append(pieces.mesh(k))
    pieces.backward = groups.backward & flat[groups.label]
    return number, shapes


def _planes(groups, wanted):
    """planes_of the wanted groups (g,) bool alone, the others' rows 0."""
    some = np.flatnonzero(wanted[groups.label])
    part = type(groups)(groups.faces.part(some), in_order(groups.label[some]))
    at = groups.label[some[np.unique(part.label, return_index=True)[1]]]
    out = [np.zeros((groups.count, 3)) for _ in range(3)] + [np.zeros(groups.count, bool)]
    for whole, rows in zip(out, planes_of(part)):
        whole[at] = rows
    return out


@dataclass(eq=False)
class _Pieces:
    """Faces with the shapes they make up, to be taken as meshes. number (f,): each one's shape; backward (f,): whether
    it looks against its shape."""

    faces: MeshArrays
    unit: np.ndarray
    source: np.ndarray
    normals: np.ndarray | None
    groups: object
    number: np.ndarray | None = None
    backward: np.ndarray | None = None

    @cached_property
    def _by_shape(self):
        order = np.argsort(self.number, kind="stable")
        return order, np.searchsorted(self.number[order], np.arange(int(self.number.max()) + 2))

    def mesh(self, shape):
        """The MeshShape of one's faces."""
        order, starts = self._by_shape
        some = order[starts[shape] : starts[shape + 1]]
        faces = self.faces
        inner = faces.counts[some] - 2
        second = spans(faces.starts[some] + 1, inner)
        corner = np.column_stack([np.repeat(faces.starts[some], inner), second, second + 1])
        if self.normals is None:
            normals = np.repeat(self.unit[some], inner, axis=0)[:, None].repeat(3, axis=1)
        else:
            normals = self.normals[self.source[corner]]
        used, triangles = np.unique(faces.corners[corner], return_inverse=True)
        return MeshShape(faces.vertices[used], triangles.reshape(-1, 3), normals, len(some))


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
