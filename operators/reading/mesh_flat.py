"""Flat groups of a mesh's faces: what hangs together in one plane, with one simple border. numpy only, no bpy."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .mesh_topology import MeshArrays, connected, cross, length

SLACK = 1e-5  # of a face's or a group's width: how far a vertex may be off its plane, besides rounding
CREASE = 1e-3  # rad; a sharper edge parts two groups
MOST_NOISE = 0.1  # rad; rounding may turn the normal of a narrow face
THINNEST = 100  # roundings; a narrower group has no usable width


@dataclass(frozen=True, eq=False)
class FlatGroups:
    """label (f,): the group of each face, numbered from 0 in order of their first faces."""

    faces: MeshArrays
    label: np.ndarray

    @cached_property
    def count(self):
        return int(self.label.max()) + 1

    @cached_property
    def first(self):
        """(g,) the first face of each group."""
        return np.flatnonzero(np.diff(np.maximum.accumulate(self.label), prepend=-1))

    @cached_property
    def rounding(self):
        """(g,) m; see MeshArrays."""
        return self.faces.rounding[self.first]

    @cached_property
    def of_corner(self):
        """(c,) the group of each corner."""
        return self.label[self.faces.polygons]

    @cached_property
    def backward(self):
        """(f,) Whether each face looks against the most of its group, by area."""
        size = length(self.faces.normals)
        order = np.lexsort([-size, self.label])
        largest = order[np.searchsorted(self.label[order], np.arange(self.count))]
        along = dot(self.faces.normals, self.faces.normals[largest][self.label])
        along /= size[largest][self.label]
        fewer = np.bincount(self.label, along, self.count) < 0
        return (along < 0) != fewer[self.label]

    @cached_property
    def normal(self):
        """(g, 3) m^2; the length is the area."""
        sign = np.where(self.backward, -1.0, 1.0)[:, None]
        return total(sign * self.faces.normals, self.label, self.count)

    @cached_property
    def area(self):
        """(g,) m^2"""
        return np.bincount(self.label, length(self.faces.normals), self.count)

    @cached_property
    def centre(self):
        """(g, 3) m; the mean of the corners."""
        at = self.faces.vertices[self.faces.corners]
        return total(at, self.of_corner, self.count) / np.bincount(self.of_corner, minlength=self.count)[:, None]

    @cached_property
    def _offset(self):
        return self.faces.vertices[self.faces.corners] - self.centre[self.of_corner]

    @cached_property
    def width(self):
        """(g,) m; the area over the extent."""
        reach = np.zeros(self.count)
        np.maximum.at(reach, self.of_corner, length(self._offset))
        return self.area / np.maximum(2 * reach, np.finfo(float).tiny)

    @cached_property
    def bent(self):
        """(g,) Whether a vertex is off the plane."""
        unit = self.normal / np.maximum(self.area, np.finfo(float).tiny)[:, None]
        off = np.abs(dot(self._offset, unit[self.of_corner]))
        far = np.zeros(self.count)
        np.maximum.at(far, self.of_corner, off)
        return ~(far <= SLACK * self.width + self.rounding)

    @cached_property
    def narrow(self):
        """(g,) Whether the rounding leaves no usable width."""
        return ~(self.width > THINNEST * self.rounding)

    @cached_property
    def _border(self):
        """partner (c,): the corner on the other side of each one's edge within the group, -1 at the border; folded
        (g,): whether faces overlap at an edge."""
        a, b = self.faces.joints[:, self.of_corner[self.faces.joints[0]] == self.of_corner[self.faces.joints[1]]]
        partner = np.full(len(self.of_corner), -1)
        partner[a], partner[b] = b, a
        forward = (self.faces.corners < self.faces.following) != self.backward[self.faces.polygons]
        folded = np.zeros(self.count, bool)
        folded[self.of_corner[np.bincount(np.concatenate([a, b]), minlength=len(partner)) > 1]] = True
        folded[self.of_corner[a[forward[a] == forward[b]]]] = True
        return partner, folded

    @property
    def rim(self):
        """(c,) Whether each corner's edge is the group's border."""
        return self._border[0] < 0

    @cached_property
    def ends(self):
        """(2, c) vertices at which each corner's edge starts and ends, around the group's normal."""
        swap = self.backward[self.faces.polygons]
        here, there = self.faces.corners, self.faces.following
        return np.stack([np.where(swap, there, here), np.where(swap, here, there)])

    @cached_property
    def pinched(self):
        """(g,) Whether the border meets itself at a vertex."""
        rim = np.flatnonzero(self.rim)
        key = np.sort(self.of_corner[rim] * len(self.faces.vertices) + self.ends[0, rim])
        pinched = np.zeros(self.count, bool)
        pinched[key[1:][key[1:] == key[:-1]] // len(self.faces.vertices)] = True
        return pinched

    @cached_property
    def tangled(self):
        """(g,) Whether faces overlap, or the border meets itself and the faces do not all look one way."""
        mixed = np.zeros(self.count, bool)
        mixed[self.label[self.backward]] = True
        return self._border[1] | (self.pinched & mixed)

    def around(self, corner):
        """The border's next corners after these (k,), of groups whose faces look one way: around the faces between."""
        corner, (partner, _) = self.faces.next[corner], self._border
        inner = np.flatnonzero(partner[corner] >= 0)
        while len(inner):
            corner[inner] = self.faces.next[partner[corner[inner]]]
            inner = inner[partner[corner[inner]] >= 0]
        return corner

    def part(self, groups):
        """The FlatGroups of some groups (g,) bool, and the number (k,) of each of them here."""
        some = np.flatnonzero(groups[self.label])
        label = in_order(self.label[some])
        part = FlatGroups(self.faces.part(some), label)
        return part, self.label[some[part.first]]

    def without(self, groups):
        """The FlatGroups where each face of these groups (g,) bool is one of its own."""
        alone = groups[self.label]
        label = np.where(alone, self.count + np.arange(len(self.label)), self.label)
        return FlatGroups(self.faces, in_order(label))


def flat_groups(faces, sine, noise, bent):
    """FlatGroups of MeshArrays of flat faces: of one material, no crease between them, in one plane, and with a simple
    border; where a larger group is none each of its faces is one, as is each bent face.

    sine (k,) of the angle at each joint, noise (f,) rad by which rounding may turn normals, bent (f,) bool.
    """
    a, b = faces.polygons[faces.joints]
    flat = sine <= CREASE + noise[a] + noise[b]
    flat &= (faces.materials[a] == faces.materials[b]) & ~bent[a] & ~bent[b]
    groups = FlatGroups(faces, in_order(connected(len(faces.counts), a[flat], b[flat])))
    several = np.bincount(groups.label) > 1
    if several.any():
        part, number = groups.part(several)
        wrong = np.zeros(groups.count, bool)
        wrong[number] = part.bent | part.tangled
        groups = groups.without(wrong) if wrong.any() else groups
    return groups


def directions(faces):
    """Unit normals (f, 3), and the noise (f,) rad by which rounding may have turned them."""
    noise = np.minimum(faces.rounding / faces.heights, MOST_NOISE / 2)
    return faces.normals / np.linalg.norm(faces.normals, axis=1, keepdims=True), noise


def creases(faces, unit):
    """(k,) sine of the angle between the planes of the faces at each joint, whose unit normals are (f, 3)."""
    a, b = faces.polygons[faces.joints]
    return length(cross(unit[a], unit[b]))


def in_order(label):
    """label (f,) as numbers from 0 in order of first appearance."""
    _, first, label = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[label]


def total(rows, label, n):
    """(n, 3) sums of rows (k, 3) with one label."""
    return np.column_stack([np.bincount(label, rows[:, k], n) for k in range(rows.shape[1])])


def dot(a, b):
    return np.einsum("ij,ij->i", a, b)
