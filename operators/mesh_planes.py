"""Recognises flat groups of polygons that fill a parallelogram, however subdivided or triangulated. No bpy."""

from dataclasses import dataclass

import numpy as np

from .mesh_topology import connected

SLACK = 1e-5  # of a parallelogram's smaller width: how far a vertex may be off its plane or side, besides rounding
CREASE = 1e-3  # rad; a sharper edge parts two groups. Groups that bend less at an edge fail as a whole: not flat
MOST_NOISE = 0.1  # rad; rounding may turn the normal of a narrow face
THINNEST = 100  # roundings; a narrower group has no usable width
ROUNDED = np.radians(44)  # shallower creases may be those of a rounded side; chamfers (45 degrees) and octagons are not
MOST_FACETS = 8  # that shallow creases may link: more are a rounded side and not meant as planes

FAILURES = (
    "",
    "it has faces without area; remove them (Mesh > Clean Up > Degenerate Dissolve)",
    "it has neighbouring faces that point opposite ways; recalculate them (Mesh > Normals > Recalculate Outside)",
    "it has faces too narrow for their distance from the object's origin",
    "it has a bent face or group of faces",
    "it has a flat group of faces that does not fill a parallelogram once",
    "it has a rounded side made of flat faces",
)
NO_AREA, OPPOSITE, NARROW, BENT, OUTLINE, FACETS = range(1, len(FAILURES))


@dataclass(frozen=True, eq=False)
class PlaneShape:
    """The parallelogram corner + s u + t v, (3,) each, local; u x v is along the polygons' normals."""

    corner: np.ndarray
    u: np.ndarray
    v: np.ndarray


@dataclass(frozen=True, eq=False)
class FlatGroups:
    """label (p,): the group of each polygon; corner, u, v (g, 3); failure (g,) index into FAILURES, 0 for a plane."""

    label: np.ndarray
    corner: np.ndarray
    u: np.ndarray
    v: np.ndarray
    failure: np.ndarray

    def plane(self, group):
        return PlaneShape(self.corner[group], self.u[group], self.v[group])


def find_planes(mesh):
    """MeshArrays -> FlatGroups; all groups at once."""
    normals = np.add.reduceat(_fans(mesh)[0], mesh.starts)  # (p, 3) unnormalised: the length is the area
    height = np.linalg.norm(normals, axis=1) / np.maximum(_longest_edges(mesh), np.finfo(float).tiny)
    with np.errstate(invalid="ignore", divide="ignore"):  # faces without area make their group fail below
        label, facets = _flat_groups(mesh, normals, height)
        normal = _sum(normals, label, label.max() + 1)
        corner, u, v = _parallelograms(mesh, label, normal)
        failure = _failures(mesh, label, normal, corner, u, v)
    failure[facets] = np.where(failure[facets] > 0, failure[facets], FACETS)
    failure[label[np.einsum("ij,ij->i", normals, normal[label]) <= 0]] = OPPOSITE
    failure[label[height <= mesh.rounding]] = NO_AREA
    return FlatGroups(label, corner, u, v, failure)


def _sum(rows, label, n):
    return np.column_stack([np.bincount(label, rows[:, k], n) for k in range(rows.shape[1])])


def _dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def _fans(mesh):
    """Area vectors and centroids (c, 3) of the triangles first corner, corner, next corner; zero at both ends."""
    first = np.repeat(mesh.vertices[mesh.corners[mesh.starts]], mesh.counts, axis=0)
    a, b = mesh.vertices[mesh.corners] - first, mesh.vertices[mesh.following] - first
    return np.cross(a, b) / 2, first + (a + b) / 3


def _longest_edges(mesh):
    lengths = np.linalg.norm(mesh.vertices[mesh.following] - mesh.vertices[mesh.corners], axis=1)
    return np.maximum.reduceat(lengths, mesh.starts)


def _flat_groups(mesh, normals, height):
    """label (p,) of polygons linked by edges without a crease, of one material, in order of appearance;
    and the groups (k,) that are facets of a rounded side."""
    noise = np.minimum(mesh.rounding / height, MOST_NOISE / 2)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    order = np.argsort(mesh.edges, kind="stable")
    key, polygon = mesh.edges[order], mesh.polygons[order]
    pairs, step = [np.zeros((2, 0), int)], 1
    while step < len(key) and (same := key[step:] == key[:-step]).any():  # a second round where three faces meet
        pairs.append(np.stack([polygon[step:][same], polygon[:-step][same]]))
        step += 1
    a, b = np.concatenate(pairs, axis=1)
    bend = np.linalg.norm(np.cross(unit[a], unit[b]), axis=1)
    flat = (bend <= CREASE + noise[a] + noise[b]) & (mesh.materials[a] == mesh.materials[b])
    label = np.unique(connected(len(mesh.counts), a[flat], b[flat]), return_inverse=True)[1]
    # a chain of many planes with shallow creases is a rounded side, of a tube perhaps
    shallow = (bend <= np.sin(ROUNDED)) & (_dot(unit[a], unit[b]) > 0)
    chain = connected(label.max() + 1, label[a[shallow]], label[b[shallow]])
    return label, np.flatnonzero(np.bincount(chain, minlength=len(chain))[chain] > MOST_FACETS)


def _parallelograms(mesh, label, normal):
    """corner, u, v (g, 3) of the parallelogram through the four extreme vertices about each group's area centroid."""
    vectors, centroids = _fans(mesh)
    of_corner, n = label[mesh.polygons], len(normal)
    weight = _dot(vectors, normal[of_corner])
    origin = mesh.vertices.mean(axis=0)
    moment = _sum((centroids - origin) * weight[:, None], of_corner, n)
    centre = origin + moment / np.bincount(of_corner, weight, n)[:, None]
    order = np.argsort(of_corner, kind="stable")
    group, vertex = of_corner[order], mesh.vertices[mesh.corners[order]]
    starts = np.searchsorted(group, np.arange(n))
    offset = vertex - centre[group]

    def extreme(values):
        values = np.where(np.isnan(values), 0.0, values)
        hit = np.flatnonzero(values == np.maximum.reduceat(values, starts)[group])
        return vertex[hit[np.searchsorted(group[hit], np.arange(n))]]

    # the vertex farthest from the centre ends the longer diagonal; b and d are the farthest to either side of it
    a = extreme(_dot(offset, offset))
    c = extreme(_dot(offset, (centre - a)[group]))
    left = _dot(offset, np.cross(normal, c - a)[group])
    b, d = extreme(-left), extreme(left)
    u, v = ((b - a) + (c - d)) / 2, ((d - a) + (c - b)) / 2
    return (a + b + c + d) / 4 - (u + v) / 2, u, v


def _failures(mesh, label, normal, corner, u, v):
    """(g,) 0 where the group covers its parallelogram once.

    With one winding, an outline on the four sides and the parallelogram's area nothing else is left.
    """
    cross = np.cross(u, v)
    area = np.linalg.norm(cross, axis=1)
    sides = np.linalg.norm(np.stack([v, u], axis=1), axis=2)
    width = area[:, None] / sides  # (g, 2) across s, across t
    slack = SLACK * width.min(axis=1) + mesh.rounding
    of_corner, n = label[mesh.polygons], len(mesh.vertices)
    members = np.unique(of_corner * n + mesh.corners)
    group, vertex = np.divmod(members, n)
    offset, size = mesh.vertices[vertex] - corner[group], area[group]
    direction = cross[group] / size[:, None]
    s = _dot(np.cross(offset, v[group]), direction) / size
    t = _dot(np.cross(u[group], offset), direction) / size
    depth = (np.column_stack([s, 1 - s, t, 1 - t]) * np.repeat(width, 2, axis=1)[group]).min(axis=1)  # m, inside
    failure = np.zeros(len(normal), np.int64)
    failure[group[~(depth >= -slack[group])]] = OUTLINE
    edge = np.unique(mesh.edges, return_inverse=True)[1]
    once = np.unique(of_corner * len(edge) + edge, return_index=True, return_counts=True)
    rim = once[1][once[2] == 1]  # corners whose edge no other polygon of the group has
    for end in (mesh.corners, mesh.following):
        at = np.searchsorted(members, of_corner[rim] * n + end[rim])
        failure[group[at][~(depth[at] <= slack[group[at]])]] = OUTLINE
    covered = np.linalg.norm(normal, axis=1)
    failure[~(np.abs(covered - area) <= 2 * slack * sides.sum(axis=1))] = OUTLINE
    failure[group[~(np.abs(_dot(offset, direction)) <= slack[group])]] = BENT
    failure[~(width.min(axis=1) > THINNEST * mesh.rounding)] = NARROW
    return failure
