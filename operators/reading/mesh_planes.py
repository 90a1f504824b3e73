"""Parallelograms among flat groups of faces, however subdivided or triangulated. No bpy."""

from dataclasses import dataclass

import numpy as np

from .mesh_flat import SLACK, THINNEST, dot, total
from .mesh_topology import cross


@dataclass(frozen=True, eq=False)
class PlaneShape:
    """The parallelogram corner + s u + t v, (3,) each, local; u x v is along the polygons' normals."""

    corner: np.ndarray
    u: np.ndarray
    v: np.ndarray


def planes_of(groups):
    """FlatGroups -> corner, u, v (g, 3), and (g,) whether the group fills that parallelogram once; all at once."""
    with np.errstate(invalid="ignore", divide="ignore"):  # what is narrow fails
        corner, u, v = _parallelograms(groups)
        return corner, u, v, _filled(groups, corner, u, v)


def _parallelograms(groups):
    """corner, u, v (g, 3) of the parallelogram through the four extreme vertices about each group's area centroid."""
    faces, of_corner, n = groups.faces, groups.of_corner, groups.count
    vectors, centroids = faces.fans
    weight = dot(vectors, groups.normal[of_corner]) * np.where(groups.backward, -1.0, 1.0)[faces.polygons]
    origin = faces.vertices[faces.corners[faces.starts[groups.first]]]
    moment = total((centroids - origin[of_corner]) * weight[:, None], of_corner, n)
    centre = origin + moment / np.bincount(of_corner, weight, n)[:, None]
    order = np.argsort(of_corner, kind="stable")
    group, vertex = of_corner[order], faces.vertices[faces.corners[order]]
    starts = np.searchsorted(group, np.arange(n))
    offset = vertex - centre[group]

    def extreme(values):
        values = np.where(np.isnan(values), 0.0, values)
        hit = np.flatnonzero(values == np.maximum.reduceat(values, starts)[group])
        return vertex[hit[np.searchsorted(group[hit], np.arange(n))]]

    # the vertex farthest from the centre ends the longer diagonal; b and d are the farthest to either side of it
    a = extreme(dot(offset, offset))
    c = extreme(dot(offset, (centre - a)[group]))
    left = dot(offset, cross(groups.normal, c - a)[group])
    b, d = extreme(-left), extreme(left)
    u, v = ((b - a) + (c - d)) / 2, ((d - a) + (c - b)) / 2
    return (a + b + c + d) / 4 - (u + v) / 2, u, v


def _filled(groups, corner, u, v):
    """(g,) Whether the group covers its parallelogram once.

    With one winding, a border on the four sides and the parallelogram's area nothing else is left.
    """
    faces, group = groups.faces, groups.of_corner
    across = cross(u, v)
    area = np.linalg.norm(across, axis=1)
    sides = np.linalg.norm(np.stack([v, u], axis=1), axis=2)
    width = area[:, None] / sides  # (g, 2) across s, across t
    slack = SLACK * width.min(axis=1) + groups.rounding
    offset, size = faces.vertices[faces.corners] - corner[group], area[group]
    direction = across[group] / size[:, None]
    s = dot(cross(offset, v[group]), direction) / size
    t = dot(cross(u[group], offset), direction) / size
    depth = (np.column_stack([s, 1 - s, t, 1 - t]) * np.repeat(width, 2, axis=1)[group]).min(axis=1)  # m, inside
    wrong = groups.tangled | groups.bent
    wrong[group[~(depth >= -slack[group])]] = True
    for at in (depth, depth[faces.next]):
        wrong[group[groups.rim & ~(at <= slack[group])]] = True
    wrong |= ~(np.abs(groups.area - area) <= 2 * slack * sides.sum(axis=1))
    wrong[group[~(np.abs(dot(offset, direction)) <= slack[group])]] = True
    wrong |= ~(width.min(axis=1) > THINNEST * groups.rounding)
    return ~wrong
