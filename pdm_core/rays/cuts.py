"""What flat shapes run through meshes: light on one side of a table's top is no light on the other, in the table.

A corner beyond what runs through a part of a mesh's face counts for nothing at places on this side of it.
"""

import numpy as np

from ..at_once import entries_of
from .near_flats import ON
from .standing import SIDES, Lists

MOST = 30  # flat shapes near a group of corners whose sides are told apart: two bits each


class Cuts:
    """Of Facets, and parts (T,) of their meshes' faces as Merged has them: lists of the flat shapes that run through
    each part, met of those that meet it; touched (T,): whether any runs through it."""

    def __init__(self, facets, merged):
        self.facets, self.reach = facets, ON * facets.tolerance
        self.points = merged.points
        self.number = np.bincount(facets.shape[: facets.count], minlength=len(facets.first))
        kept, found = np.zeros(len(facets.first), bool), [np.zeros((3, 0), int)]
        kept[list(merged.split)] = True
        boxes = [facets.scene.shapes[k].box for k in facets.flat]
        self.box = np.full((2, len(kept), 3), np.nan)
        self.box[:, facets.flat] = np.array(boxes).reshape(-1, 2, 3).swapaxes(0, 1) - facets.centre
        for flat, facet in facets.near_flats:
            some = kept[facets.shape[facet]]
            some[some] = self._meet(flat[some], facets.corners(facet[some]))[0]
            which, part = entries_of((merged.first_part, merged.parts**2), facet[some])
            flat = flat[some][which]
            meets, through = self._meet(flat, self.points[part] - facets.centre)
            found.append(np.stack([part, flat, through])[:, meets])
        found = np.concatenate(found, axis=1)
        part, flat, through = found[:, np.argsort(found[0], kind="stable")]
        self.met, through = Lists(part, flat, len(self.points)), through > 0
        self.lists = Lists(part[through], flat[through], len(self.points))
        self.touched = self.lists.number > 0

    def _meet(self, flat, corners):
        """(n,) Whether flat shapes (n,) meet triangles, corners (n, k, 3) m about the facets' centre; (n,) whether they
        run through them."""
        height, (low, high) = self._height(flat, corners), self.box[:, flat]
        near = (corners.min(axis=1) <= high + self.reach) & (corners.max(axis=1) >= low - self.reach)
        least, most = height.min(axis=1), height.max(axis=1)
        meets = near.all(axis=1) & (least <= self.reach) & (most >= -self.reach)
        return meets, meets & (least < -self.reach) & (most > self.reach)

    def _height(self, flat, points):
        """(n, k) m of points (n, k, 3) m over flat shapes (n,), where these are given, not parted into layers."""
        facets, first = self.facets, self.facets.first[flat]
        height = np.einsum("nki,ni->nk", points - facets.origin[first, None], facets.normal[first])
        return height + facets.moved[flat, None]

    def between(self, flat, places, middles):
        """(n, k) Whether flat shapes (n,) are between places and middles (n, k or 1, 3) m about the facets' centre."""
        one, other = self._height(flat, places), self._height(flat, middles)
        across = one * other < 0
        share = np.divide(one, one - other, out=np.zeros(across.shape), where=across)[..., None]
        rows, columns = np.nonzero(across)
        met = (places + share * (middles - places))[rows, columns]
        across[rows, columns] = self._within(flat[rows], met)
        return across

    def _within(self, flat, points):
        """(n,) Whether points (n, 3) m in the planes of flat shapes (n,) are within their outlines."""
        facets = self.facets
        which, facet = entries_of((facets.first, self.number), flat)
        u, v, normal = (array[facet] for array in (facets.u, facets.v, facets.normal))
        at = points[which] - facets.origin[facet]
        s, t = (np.einsum("ni,ni->n", np.cross(a, b), normal) for a, b in ((at, v), (u, at)))
        area = np.einsum("ni,ni->n", np.cross(u, v), normal)
        inside = (s >= 0) & (t >= 0) & np.where(facets.triangle[facet], s + t <= area, np.maximum(s, t) <= area)
        return np.bincount(which, inside, len(flat)) > 0

    def apart(self, part, at, middles):
        """(h, k) Whether anything is between places at (h, 2) on parts (h,) and middles (h, k, 3) m."""
        hit, flat = self.lists.of(part)
        out = np.zeros(middles.shape[:2], bool)
        rows, columns = np.nonzero(self.between(flat, self._places(part, at)[hit, None], middles[hit]))
        out[hit[rows], columns] = True
        return out

    def sides(self, part, at):
        """(h,) On which side, < SIDES, of what runs through parts (h,) places at (h, 2) are: 0 on that of their
        middles."""
        hit, flat = self.lists.of(part)
        middle = self._places(part, np.full(at.shape, 1 / 3))
        beyond = self.between(flat, self._places(part, at)[hit, None], middle[hit, None])[:, 0]
        bit = (np.arange(len(hit)) - np.searchsorted(hit, hit)) % (SIDES.bit_length() - 1)
        out = np.zeros(len(part), np.int64)
        np.bitwise_or.at(out, hit, beyond << bit)
        return out

    def thirds(self, begin, end):
        """(t, 3, 3) m about the facets' centre: middles of the thirds of parts from begin to end for which each corner
        stands, nearer to it where what runs through is between the two."""
        corners = self.points[begin:end] - self.facets.centre
        out = corners / 2 + corners.mean(axis=1, keepdims=True) / 2
        which, flat = self.lists.of(np.arange(begin, end))
        one, other = (self._height(flat, a[which]) for a in (corners, out))
        share = np.ones(out.shape[:2])
        np.minimum.at(share, which, np.where(one * other < 0, one / np.where(one == other, 1, one - other) / 2, 1.0))
        return corners + share[..., None] * (out - corners)

    def parted(self, begin, group):
        """Groups (t, 3) of the corners of parts from begin on -> groups (t, 3), those apart in which flat shapes that
        any of its parts meets have thirds on either side, or in their plane."""
        which, flat = self.met.of(np.arange(begin, begin + len(group)))
        pair = np.unique(group[which].astype(np.int64) * len(self.facets.first) + flat[:, None])
        flats = Lists(*np.divmod(pair, len(self.facets.first)), group.max(initial=0) + 1)
        out = group.ravel().astype(np.int64)
        some = np.flatnonzero(flats.number[out])
        hit, flat = flats.of(out[some])
        height = self._height(flat, self.thirds(begin, begin + len(group)).reshape(-1, 3)[some][hit, None])[:, 0]
        side = (height > self.reach) + 2 * (height < -self.reach)
        shift = 2 * ((np.arange(len(hit)) - np.searchsorted(hit, hit)) % MOST)
        sides = np.zeros(len(some), np.int64)
        np.bitwise_or.at(sides, hit, side << shift)
        apart = np.unique(np.stack([out[some], sides], axis=1), axis=0, return_inverse=True)[1]
        out[some] = len(flats.number) + apart.ravel()
        return np.unique(out, return_inverse=True)[1].reshape(-1, 3).astype(np.int32)

    def _places(self, part, at):
        """(h, 3) m about the facets' centre, of places at (h, 2) on parts (h,)."""
        p, q, r = self.points[part].swapaxes(0, 1)
        return p + at[:, :1] * (q - p) + at[:, 1:] * (r - p) - self.facets.centre
