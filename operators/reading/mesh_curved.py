"""Which flat groups are meant as flat, and which are facets of something curved. numpy only, no bpy.

A chain of many groups, each bending a little from the next, is a curved side: of a tube, a rock, a terrain. What is
shaded smooth bends further and in fewer steps. Much larger parts of a chain are flat all the same: walls between
bevels, the top of a rounded table.
"""

from dataclasses import dataclass

import numpy as np

from .mesh_clean import MOST_CUT
from .mesh_flat import CREASE, FlatGroups, dot
from .mesh_topology import connected, length

ROUNDED = np.radians(44)  # shallower creases may be those of a rounded side; chamfers (45 degrees) and octagons are not
MOST_FACETS = 24  # that shallow creases may link and still be meant as flat: a column of 24 sides, bevels of a box
SMOOTH = np.radians(65)  # the same of creases that are shaded smooth: a hexagonal column is round, a cube is not
FEWEST_SMOOTH = 5  # smooth facets that are a rounded side
REMNANTS = 8  # small flat groups that a component may have whose most groups are curved
LARGE = 10  # times the median area of its chain: a group is flat all the same, if it is shaded flat,
HUGE = 100  # and so many times however it is shaded
SHADED_FLAT = 0.1  # rad; shading normals of something flat are off by no more
SAME_SHADING = 1e-2  # shading normals on both sides of an edge that differ by less are one


def curved(groups, unit, sine, source, shading):
    """(g,) Whether each of the FlatGroups is part of something curved.

    unit (f, 3) normals of the faces, sine (k,) of the angle at each of their joints; shading (C, 3) normals of the
    corners as given, which source (c,) counts, or None.
    """
    if groups.count < FEWEST_SMOOTH:
        return np.zeros(groups.count, bool)
    a, b = groups.faces.joints
    between = groups.of_corner[a] != groups.of_corner[b]
    a, b, sine = a[between], b[between], sine[between]
    face_a, face_b = groups.faces.polygons[a], groups.faces.polygons[b]
    bend = np.arctan2(sine, dot(unit[face_a], unit[face_b]) * _same_way(groups.faces, a, b))
    links = groups.of_corner[a], groups.of_corner[b]
    shaded = _Shaded(groups, unit, source, shading)
    out = _chained(shaded, links, bend <= ROUNDED, MOST_FACETS + 1)
    if shading is not None:
        smooth = (bend > CREASE) & (bend <= SMOOTH)
        smooth[smooth] = _is_smooth(groups.faces, a[smooth], b[smooth], source, shading)
        out |= _chained(shaded, links, smooth, FEWEST_SMOOTH)
    out |= _remnants(shaded, out)
    mesh = groups.faces.mesh[groups.first]
    # of very many flat groups in an object, those of less than one such part of its area are left to a mesh
    many = np.bincount(mesh, ~out) > MOST_CUT
    return out | (many[mesh] & (groups.area < np.bincount(mesh, groups.area)[mesh] / MOST_CUT))


@dataclass(frozen=True, eq=False)
class _Shaded:
    """FlatGroups, and what `curved` is told of their shading."""

    groups: FlatGroups
    unit: np.ndarray
    source: np.ndarray
    shading: np.ndarray | None

    def small(self, some, label):
        """Those of some groups (k,) that are no larger parts, of what has the same label (g,), than curved ones are."""
        area = self.groups.area[some]
        size = area / _median(area, label[some])
        large = size > LARGE
        if self.shading is not None and large.any():
            large[large] = (size[large] > HUGE) | self._is_flat(some[large])
        return some[~large]

    def _is_flat(self, some):
        """(k,) Whether groups are shaded flat."""
        faces, wanted = self.groups.faces, np.zeros(self.groups.count, bool)
        wanted[some] = True
        corner = np.flatnonzero(wanted[self.groups.of_corner])
        off = np.abs(self.shading[self.source[corner]] - self.unit[faces.polygons[corner]]).max(axis=1) > SHADED_FLAT
        wanted[self.groups.of_corner[corner[off]]] = False
        return wanted[some]


def folded(groups, unit, sine):
    """(g,) Whether each of the FlatGroups is of a mesh that lies folded in one plane somewhere, as one scaled to
    nothing: its parts lie on one another, and are no polygons of their own that touch. unit, sine: see curved."""
    faces, flat = groups.faces, sine <= CREASE
    a, b = (corners[flat] for corners in faces.joints)
    back = dot(unit[faces.polygons[a]], unit[faces.polygons[b]]) * _same_way(faces, a, b) < 0
    return np.isin(faces.mesh[groups.first], faces.mesh[faces.polygons[a[back]]])


def _same_way(faces, a, b):
    """(k,) 1 where corners a and b run along their edge in opposite ways, as neighbours do that look the same way."""
    return np.where((faces.corners[a] < faces.following[a]) != (faces.corners[b] < faces.following[b]), 1.0, -1.0)


def _chained(shaded, links, linked, fewest):
    """(g,) Whether groups are small parts of chains of at least so many."""
    count = shaded.groups.count
    chain = connected(count, links[0][linked], links[1][linked])
    return _marked(shaded, np.bincount(chain, minlength=count)[chain] >= fewest, chain)


def _remnants(shaded, out):
    """(g,) Small groups of components that are curved for the most part, where they are many."""
    groups = shaded.groups
    part = groups.faces.components[groups.first]
    count = int(part.max()) + 1
    curved_ones, rest = np.bincount(part, out, count), np.bincount(part, ~out, count)
    broken = (curved_ones > rest) & (rest > REMNANTS)
    return _marked(shaded, broken[part], part)


def _marked(shaded, wanted, label):
    """(g,) The small ones among the groups (g,) bool of whole labels."""
    out = np.zeros(shaded.groups.count, bool)
    if wanted.any():
        out[shaded.small(np.flatnonzero(wanted), label)] = True
    return out


def _median(values, label):
    """(n,) the median of the values with each one's label"""
    order = np.lexsort([values, label])
    starts = np.flatnonzero(np.append(True, label[order][1:] != label[order][:-1]))
    size = np.diff(np.append(starts, len(order)))
    out = np.empty(len(values))
    out[order] = np.repeat(values[order][starts + size // 2], size)
    return out


def _is_smooth(faces, a, b, source, shading):
    """(k,) Whether shading goes on smoothly across the edges of corners a and b."""
    turned = faces.corners[a] == faces.corners[b]
    ends = ((a, np.where(turned, b, faces.next[b])), (faces.next[a], np.where(turned, faces.next[b], b)))
    same = np.ones(len(a), bool)
    for one, other in ends:
        same &= length(shading[source[one]] - shading[source[other]]) < SAME_SHADING
    return same
