"""A mesh with each face as N x N, in the same place: flat faces stay flat, UV spheres get vertices on the sphere.

bmesh interpolates what the mesh carries: UVs, attributes, vertex groups, materials. Neighbouring faces share their
new vertices, so there are no cracks.
"""

from contextlib import contextmanager

import bmesh
import numpy as np

from ..reading.mesh_arrays import arrays_of
from ..reading.mesh_spheres import on_sphere
from .round_places import spheres_of

NORMAL = "pdm normal"  # attribute that carries custom normals over
RING = "pdm ring"  # vertex layer: the ring of a sphere's vertex, counted from the north pole, between rings a fraction


def refine(mesh, times):
    """Replaces each face of `mesh` by times x times."""
    arrays = arrays_of(mesh)
    spheres = spheres_of(arrays)
    with normals_kept(mesh):
        work = bmesh.new()
        try:
            work.from_mesh(mesh)
            _refine_flat(work, np.setdiff1d(arrays.corners, [v for vertices, _ in spheres for v in vertices]), times)
            for vertices, grid in spheres:
                _refine_sphere(work, arrays.vertices[vertices].astype(float), vertices, grid, times)
            if carried := work.verts.layers.float.get(RING):
                work.verts.layers.float.remove(carried)
            work.to_mesh(mesh)
        finally:
            work.free()
    mesh.update()


def finer_size(mesh, times):
    """About how many vertices refine() leaves."""
    return len(mesh.vertices) + (times**2 - 1) * max(len(mesh.polygons), 1)


def triangulate(work, faces, quads="BEAUTY"):
    """bmesh's own, but where two faces lie on both sides of a vertex of two edges: each cut there, across its
    neighbours, they would leave the same triangle twice."""
    faces = set(faces)
    for vert in [vert for vert in work.verts if len(vert.link_edges) == 2]:
        for face in [face for face in vert.link_faces if face in faces and len(face.verts) > 3]:
            if all(loop.is_convex for loop in face.loops):
                loops = list(face.loops)
                first = next(k for k, loop in enumerate(loops) if loop.vert == vert)
                faces.add(bmesh.utils.face_split(face, vert, loops[first - len(loops) // 2].vert)[0])
    bmesh.ops.triangulate(work, faces=list(faces), quad_method=quads, ngon_method="BEAUTY")


# An operator of bmesh leaves no Python reference to an element valid, but every vertex keeps its index.


def _vertices(work, indices):
    work.verts.ensure_lookup_table()
    return [work.verts[k] for k in indices]


def _refine_flat(work, vertices, times):
    faces = {face for vert in _vertices(work, vertices) for face in vert.link_faces}
    crooked = [face for face in faces if len(face.verts) > 4 or not all(loop.is_convex for loop in face.loops)]
    if crooked:
        triangulate(work, crooked)
    edges = {edge for vert in _vertices(work, vertices) for edge in vert.link_edges}
    _cut(work, [edge for edge in edges if edge.link_faces], times)


def _cut(work, edges, times):
    """Cuts `edges` into `times` parts, and the faces between them; returns the new vertices."""
    made = bmesh.ops.subdivide_edges(work, edges=edges, cuts=times - 1, use_grid_fill=True)
    work.verts.index_update()
    return [v for v in made["geom_inner"] if isinstance(v, bmesh.types.BMVert)]


def _refine_sphere(work, points, vertices, grid, times):
    """First each ring's edges are cut, then the meridians; the new vertices go to where the finer UV sphere has them.

    points (n, 3) and `vertices` (n,): the sphere's vertices and their indices, in the order of `grid`.
    """
    solution = grid.least_squares @ points
    linear, origin = solution[:3], solution[3]
    ring = work.verts.layers.float.get(RING) or work.verts.layers.float.new(RING)
    for vert, k in zip(_vertices(work, vertices), grid.k.tolist(), strict=True):
        vert[ring] = k

    def place(new, rings, segments):
        unit = on_sphere(rings, segments, grid.rings, grid.segments)
        for vert, co in zip(new, (unit @ linear + origin).tolist(), strict=True):
            vert.co = co

    def where(new):
        """(n,) ring and (n,) segment, with fractions."""
        ideal = (np.array([vert.co for vert in new]) - origin) @ np.linalg.inv(linear)
        turns = np.arctan2(ideal[:, 1], ideal[:, 0]) / (2 * np.pi)
        return np.array([vert[ring] for vert in new]), turns * grid.segments

    def rises(edge):
        return abs(edge.verts[0][ring] - edge.verts[1][ring]) > 0.5

    _undiagonal(work, vertices, grid)
    new = _cut(work, [e for e in _edges(work, vertices) if not rises(e)], times)
    around = np.concatenate([vertices, [vert.index for vert in new]])
    rings, turns = where(new)
    cell, part = np.divmod(turns, 1.0)
    step = 2 * np.pi / grid.segments
    near, far = np.sin(part * step), np.sin((1 - part) * step)  # of a chord's point, by angle: its share of the chord
    place(new, np.rint(rings), cell + np.rint(times * near / (near + far)) / times)
    for pole in _vertices(work, vertices[[grid.north, grid.south]]):
        for face in list(pole.link_faces):
            _fan(face, pole)
    new = _cut(work, [e for e in _edges(work, around) if rises(e)], times)
    rings, turns = where(new)
    place(new, np.rint(times * rings) / times, np.rint(times * turns) / times)


def _edges(work, vertices):
    return {edge for vert in _vertices(work, vertices) for edge in vert.link_edges}


def _undiagonal(work, vertices, grid):
    """Takes the diagonals of triangulated cells out."""
    place = dict(zip(vertices.tolist(), zip(grid.k.tolist(), grid.j.tolist()), strict=True))
    poles = {int(vertices[grid.north]), int(vertices[grid.south])}
    ends = [(edge, edge.verts[0].index, edge.verts[1].index) for edge in _edges(work, vertices)]
    found = [
        edge for edge, a, b in ends if not poles & {a, b} and place[a][0] != place[b][0] and place[a][1] != place[b][1]
    ]
    if found:
        bmesh.ops.dissolve_edges(work, edges=found, use_verts=False)


def _fan(face, pole):
    """Triangles from the pole to each edge that does not touch it."""
    while len(face.verts) > 3:
        loop = next(each for each in face.loops if each.vert == pole)
        rest = bmesh.utils.face_split(face, pole, loop.link_loop_next.link_loop_next.vert)[0]
        face = max(face, rest, key=lambda part: len(part.verts))


@contextmanager
def normals_kept(mesh):
    """Custom normals as an attribute meanwhile, which is interpolated as such."""
    if not mesh.has_custom_normals:
        yield
        return
    normals = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    carried = mesh.attributes.new(NORMAL, "FLOAT_VECTOR", "CORNER")
    carried.data.foreach_set("vector", normals)
    yield
    carried = mesh.attributes[NORMAL]
    normals = np.empty(3 * len(mesh.loops), np.float32)
    carried.data.foreach_get("vector", normals)
    mesh.attributes.remove(carried)
    mesh.normals_split_custom_set(normals.reshape(-1, 3))
