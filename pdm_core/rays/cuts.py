"""What runs through meshes: light on one side of a table's top is no light on the other, in the table.

A corner beyond what runs through a part of a mesh's face counts for nothing at places on this side of it.
"""

import numpy as np

from ..at_once import entries_of
from ..connected import connected
from ..names import names_of
from .near_flats import ON
from .standing import SIDES, Lists

INSIDE = 1 / 3  # where the middle of a triangle is


class Cuts:
    """Of Facets, and parts (T,) of their meshes' faces as Merged has them: lists of other shapes' facets that run
    through each part, met of those that meet it; touched (T,): whether any runs through it; third (T, 3, 3) m about the
    facets' centre: see _thirds."""

    def __init__(self, facets, merged):
        self.facets, self.reach = facets, ON * facets.tolerance
        self.points = merged.points - facets.centre
        kept, found = np.zeros(len(facets.first), bool), [np.zeros((3, 0), int)]
        kept[list(merged.split)] = True
        for own, facet in facets.near_facets:
            some = kept[facets.shape[own]]
            some[some] = self._meet(facet[some], facets.corners(own[some])[:, [0, 1, 3]])[0]
            which, part = entries_of((merged.first_part, merged.parts**2), own[some])
            facet = facet[some][which]
            meets, through = self._meet(facet, self.points[part])
            found.append(np.stack([part, facet, through])[:, meets])
        found = np.concatenate(found, axis=1)
        part, facet, through = found[:, np.lexsort(found[1::-1])]
        self.met, through = Lists(part, facet, len(self.points)), through > 0
        self.lists = Lists(part[through], facet[through], len(self.points))
        self.touched = self.lists.number > 0
        self.third = self._thirds()

    def _meet(self, facet, corners):
        """(n,) Whether facets (n,) meet triangles, corners (n, 3, 3) m about the facets' centre; (n,) whether they run
        through them, as far as their planes tell."""
        given, height = self.facets.corners(facet), self._height(facet, corners)
        meets = (corners.min(axis=1) <= given.max(axis=1) + self.reach).all(axis=1)
        meets &= (corners.max(axis=1) >= given.min(axis=1) - self.reach).all(axis=1)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        back = np.einsum("nki,ni->nk", given - corners[:, :1], normal)
        for h in (height, back):
            meets &= (h.min(axis=1) <= self.reach) & (h.max(axis=1) >= -self.reach)
        return meets, meets & (height.min(axis=1) < -self.reach) & (height.max(axis=1) > self.reach)

    def _height(self, facet, points):
        """(n, k) m of points (n, k, 3) m over facets (n,)."""
        facets = self.facets
        return np.einsum("nki,ni->nk", points - facets.origin[facet, None], facets.normal[facet])

    def between(self, facet, places, others):
        """(n, k) Whether facets (n,) are between places and others (n, k or 1, 3) m about the facets' centre."""
        one, other = self._height(facet, places), self._height(facet, others)
        across = one * other < 0
        share = np.divide(one, one - other, out=np.zeros(across.shape), where=across)[..., None]
        rows, columns = np.nonzero(across)
        met = (places + share * (others - places))[rows, columns]
        across[rows, columns] = self.facets.within(facet[rows], met)
        return across

    def apart(self, part, at):
        """(h, 3) Whether anything is between places at (h, 2) on parts (h,) and what each of their corners stands
        for."""
        hit, facet = self.lists.of(part)
        out = np.zeros((len(part), 3), bool)
        rows, columns = np.nonzero(self.between(facet, self._places(part, at)[hit, None], self.third[part[hit]]))
        out[hit[rows], columns] = True
        return out

    def sides(self, part, at):
        """(h,) On which side, < SIDES, of what runs through parts (h,) places at (h, 2) are: 0 on that of their
        middles; of two shapes each has its own."""
        hit, facet = self.lists.of(part)
        middle = self._places(part, np.full(at.shape, INSIDE))
        beyond = self.between(facet, self._places(part, at)[hit, None], middle[hit, None])[:, 0]
        shape = self.facets.shape[facet]
        number = np.cumsum((np.diff(hit, prepend=-1) != 0) | (np.diff(shape, prepend=-1) != 0))
        bit = (number - number[np.searchsorted(hit, hit)]) % (SIDES.bit_length() - 1)
        out = np.zeros(len(part), np.int64)
        np.bitwise_or.at(out, hit, beyond << bit)
        return out

    def _thirds(self):
        """(T, 3, 3) m: middles of the thirds of parts for which each corner stands, nearer to it where what runs
        through is between it and the part's middle: half way to that."""
        corners, middle = self.points, self.points.mean(axis=1, keepdims=True)
        which, facet = self.lists.of(np.flatnonzero(self.touched))
        which = np.flatnonzero(self.touched)[which]
        across = self.between(facet, corners[which], middle[which])
        one, other = (self._height(facet, a[which]) for a in (corners, middle))
        share = np.ones(corners.shape[:2])
        np.minimum.at(share, which, np.where(across, one / np.where(across, one - other, 1), 1.0))
        return corners + share[..., None] * (middle - corners) / 2

    def parted(self, begin, group):
        """Groups (t, 3) of the corners of parts from begin on -> groups (t, 3), those that anything meets as many as
        hang together by edges that nothing parts."""
        part = np.arange(begin, begin + len(group))
        hot = np.zeros(group.max(initial=0) + 1, bool)
        hot[group[self.met.number[part] > 0]] = True
        if not hot.any():
            return group
        one, other = self._beside(begin, group, hot)
        keep = ~self._parts(begin, one, other)
        label = connected(group.size, one[keep], other[keep])
        out = group.ravel().astype(np.int64)
        some = hot[out]
        out[some] = len(hot) + label[some]
        return np.unique(out, return_inverse=True)[1].reshape(-1, 3).astype(np.int32)

    def _beside(self, begin, group, hot):
        """Pairs (k,), (k,) of corners, counted through the parts from begin on, of one group each of those that are
        hot (n groups,): of one part, or at one end of an edge of two."""
        rows = np.flatnonzero(hot[group].any(axis=1))
        corner, after = 3 * rows[:, None] + [0, 1, 2], 3 * rows[:, None] + [1, 2, 0]
        flat, found = group.ravel(), [(corner.ravel(), after.ravel())]
        points = self.points[begin : begin + len(group)].reshape(-1, 3)
        place = names_of(np.rint(points[corner.ravel()] / self.reach)).reshape(-1, 3)
        for way in (1, -1):
            ends = np.stack([place, np.roll(place, -way, axis=1)], axis=2).reshape(-1, 2) % (1 << 52)
            found.append((corner.ravel(), names_of(np.column_stack([ends, flat[corner.ravel()]]).astype(float))))
        at, name = (np.concatenate(a) for a in zip(*found[1:]))
        order = np.argsort(name, kind="stable")
        same = np.flatnonzero(name[order[1:]] == name[order[:-1]])
        one, other = np.append(found[0][0], at[order[same]]), np.append(found[0][1], at[order[same + 1]])
        keep = (flat[one] == flat[other]) & hot[flat[one]]
        return one[keep], other[keep]

    def _parts(self, begin, one, other):
        """(k,) Whether what meets the parts of corners one and other (k,) is between what these stand for, or one of
        these lies on it and the other does not."""
        out, third = np.zeros(len(one), bool), self.third[begin:].reshape(-1, 3)
        for of in (one, other):
            pair, facet = self.met.of(begin + of // 3)
            a, b = third[one[pair]][:, None], third[other[pair]][:, None]
            cut = self.between(facet, a, b)[:, 0]
            on = [np.abs(self._height(facet, end)[:, 0]) <= self.reach for end in (a, b)]
            cut |= (on[0] != on[1]) & self.facets.within(facet, np.where(on[0][:, None], a[:, 0], b[:, 0]))
            out[pair[cut]] = True
        return out

    def _places(self, part, at):
        """(h, 3) m about the facets' centre, of places at (h, 2) on parts (h,)."""
        p, q, r = self.points[part].swapaxes(0, 1)
        return p + at[:, :1] * (q - p) + at[:, 1:] * (r - p)
