"""What meshes are: UV spheres, parallelograms, polygons and the rest, from their arrays alone. numpy only, no bpy.

Many meshes go through each step together: it takes some hundred calls of numpy, however small they are.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .mesh_balls import spheres_in
from .mesh_clean import CleanMesh, clean, weld
from .mesh_curved import curved, folded
from .mesh_flat import creases, directions, flat_groups, in_order
from .mesh_joined import Given, Joined, join
from .mesh_outlines import PolygonShape, polygons_of
from .mesh_planes import PlaneShape, planes_of
from .mesh_spheres import COARSEST, SphereShape
from .mesh_topology import NotRecognised, connected, rounding_of

TWO_MATERIALS = "has a UV sphere of several materials: it is taken as it is meshed; with one it would be exact"


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
    as_mesh: Callable  # index of a flat shape -> the MeshShape that its faces make up
    warnings: list = field(default_factory=list)

    @cached_property
    def counts(self):
        """Of spheres, planes, polygons, meshes."""
        number = Counter(map(type, self.shapes))
        return tuple(number[kind] for kind in (SphereShape, PlaneShape, PolygonShape, MeshShape))

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
    a number from 0 that differs between materials: it parts shapes. grids: a dict that speeds up a row of calls, see
    find_sphere. triangles (t, 3) corners of the polygons' triangles, normals (c, 3) with which corners are shaded:
    fans, of polygons taken for convex, and flat ones where there are none.
    """
    (found,) = find_all([Given(np.asarray(vertices), corners, counts, materials, triangles, normals)], grids)
    if isinstance(found, NotRecognised):
        raise found
    return found


def find_all(meshes, grids=None):
    """Of each Given its MeshShapes, or NotRecognised. All have triangles or none has, all have normals or none."""
    found = [_fault(mesh) for mesh in meshes]
    sound = [k for k, fault in enumerate(found) if fault is None]
    if sound:
        whole = join([meshes[k] for k in sound])
        whole = replace(whole, mesh=weld(whole.mesh))
        of_ball, balls, mixed = spheres_in(whole.mesh, {} if grids is None else grids)
        shapes = _Found(whole, of_ball, balls)
        if (of_ball < 0).any():
            shapes.add(*whole.without(of_ball >= 0))
        for mesh in mixed:
            shapes.warn(mesh, TWO_MATERIALS)
        for place, k in enumerate(sound):
            found[k] = shapes.of_mesh(place)
    return found


def _fault(mesh):
    """NotRecognised where a Given is no mesh to be recognised, else None."""
    if not len(mesh.counts):
        return NotRecognised("has no faces")
    if not np.isfinite(mesh.vertices).all():
        return NotRecognised("has vertices that are not finite; remove or repair them")
    rounding = rounding_of(np.abs(mesh.vertices).max())
    for corners in (mesh.corners[:4], mesh.corners):  # in most meshes a face tells
        if rounding <= COARSEST * np.ptp(mesh.vertices[corners], axis=0).max():
            return None
    return NotRecognised("is too small for its distance from the object's origin; use Set Origin to Geometry")


class _Found:
    """The shapes of Joined meshes. first, materials, bodies (k,): of each shape its first polygon, see MeshShapes;
    corner (C,), triangle (T,): their shapes, whose backs corner_back and triangle_back tell; balls come first."""

    def __init__(self, whole, of_ball, balls):
        self.whole, self.shapes, self.balls = whole, balls, len(balls)
        polygons = np.flatnonzero(of_ball >= 0)
        self.first = polygons[np.unique(of_ball[polygons], return_index=True)[1]]
        self.bodies = np.full(len(balls), -1)
        self.corner = of_ball[whole.mesh.polygons]
        self.triangle = of_ball[whole.mesh.polygons[whole.triangles[:, 0]]]
        self.corner_back, self.triangle_back = (np.zeros(len(part), bool) for part in (self.corner, self.triangle))
        self.warnings, self.source = {}, None

    def add(self, rest, corners, triangles):
        """Finds what is no ball: the Joined `rest`, which has these corners and triangles of all."""
        found = clean(rest)
        if found is None:
            return
        faces = found.faces
        unit, noise = directions(faces)
        sine = creases(faces, unit)
        groups = flat_groups(faces, sine, noise, found.bent)
        meshed = folded(groups, unit, sine) | curved(groups, unit, sine, found.source, rest.normals)
        pieces = _pieces(groups, found.bent | meshed[groups.label])
        self.source = _Source(found, rest, unit, pieces.number)
        self.shapes = self.shapes + [pieces.shape(k) or self.source.mesh(k) for k in range(pieces.count)]
        polygon = self.whole.mesh.polygons[corners][found.source[faces.starts]]
        self.first = np.append(self.first, polygon[pieces.first])
        self.bodies = np.append(self.bodies, _bodies(faces.bodies, pieces.number, pieces.count))
        self.corner[corners] = self.balls + pieces.number[found.corner_face]
        self.triangle[triangles] = self.balls + pieces.number[found.triangle_face]
        self.corner_back[corners] = found.corner_back ^ pieces.backward[found.corner_face]
        self.triangle_back[triangles] = found.triangle_back ^ pieces.backward[found.triangle_face]
        self.warnings = found.warnings

    def warn(self, mesh, text):
        said = self.warnings.setdefault(mesh, [])
        said += [text] if text not in said else []

    @cached_property
    def _order(self):
        """order (k,): the shapes by their first polygons; rank (k,): place of each in it; begin (m + 1,): where those
        of each mesh begin in it."""
        order = np.argsort(self.first, kind="stable")
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        meshes = np.arange(len(self.whole.corner))
        return order, rank, np.searchsorted(self.whole.mesh.mesh[self.first[order]], meshes)

    def of_mesh(self, k):
        """The MeshShapes of the mesh k, NotRecognised where it has none."""
        order, rank, (begin, end) = *self._order[:2], self._order[2][k : k + 2].tolist()
        if begin == end:
            return NotRecognised("has no face with an area; remove it or give it a size")
        corner, triangle = (slice(*part[k : k + 2].tolist()) for part in (self.whole.corner, self.whole.triangle))
        mine, whole = order[begin:end], self.whole

        def of(shape):  # what has no area and nothing beside it goes with the first
            place = rank[shape] - begin
            return np.where((place >= 0) & (place < end - begin), place, 0)

        return MeshShapes(
            [self.shapes[j] for j in mine.tolist()],
            of(self.corner[corner]),
            of(self.triangle[triangle]),
            self.corner_back[corner],
            self.triangle_back[triangle],
            whole.mesh.materials[self.first[mine]] - whole.material[k],
            self.bodies[mine],
            lambda shape: self.source.mesh(mine[shape] - self.balls),
            self.warnings.get(k, []),
        )


@dataclass(eq=False)
class _Pieces:
    """number (f,): the shape of each face, in order of their first faces; backward (f,): whether it looks against its
    shape; label (f,): groups, flat (g,): those that are shapes; planes: corner, u, v (g, 3) of them; outlines {group:
    PolygonShape} of those that are no parallelograms."""

    number: np.ndarray
    backward: np.ndarray
    label: np.ndarray
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

    def shape(self, k):
        """The shape with this number, None for a mesh."""
        group = self.label[self.first[k]]
        if not self.flat[group]:
            return None
        return self.outlines.get(group) or PlaneShape(*(part[group] for part in self.planes))


def _pieces(groups, rest):
    """The _Pieces of FlatGroups. rest (f,): faces of meshes."""
    faces = groups.faces
    flat = np.ones(groups.count, bool)
    flat[groups.label[rest]] = False
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
    return _Pieces(in_order(number), backward, groups.label, flat, planes, outlines)


@dataclass(eq=False)
class _Source:
    """What shapes were found in: a CleanMesh, the Joined it was made of, unit normals (f, 3) of its faces, and the
    shape of each face (f,)."""

    found: CleanMesh
    given: Joined
    unit: np.ndarray
    number: np.ndarray

    @cached_property
    def _by_shape(self):
        """The triangles sorted by shape, and where each shape begins."""
        number = self.number[self.found.triangle_face]
        some = np.flatnonzero(self.found.live & _all_differ(self.given.mesh.corners[self.found.triangles]))
        order = some[np.argsort(number[some], kind="stable")]
        return order, np.searchsorted(number[order], np.arange(int(self.number.max()) + 2))

    def mesh(self, shape):
        """The MeshShape of the faces of one."""
        (order, starts), of, shading = self._by_shape, self.given.mesh, self.given.normals
        triangle = order[starts[shape] : starts[shape + 1]]
        corner = self.found.triangles[triangle]
        vertex = of.corners[corner]
        low = vertex.min()
        is_used = np.zeros(vertex.max() + 1 - low, bool)
        is_used[vertex - low] = True
        own = self.unit[self.found.triangle_face[triangle]]
        normals = shading[corner] if shading is not None else own[:, None].repeat(3, axis=1)
        faces = int(np.count_nonzero(np.diff(of.polygons[corner[:, 0]], prepend=-1)))
        vertices = of.vertices[low + np.flatnonzero(is_used)]
        return MeshShape(vertices, (np.cumsum(is_used) - 1)[vertex - low], normals, faces)


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
