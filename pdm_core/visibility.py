"""Which shapes can stand between two surfaces: bounding volumes and separating planes, before any work per point."""

import numpy as np

from .scene import Sphere
from .view import TOUCHING, ShapeTable, segment_blocked

BESIDE = TOUCHING  # of the scene's size: what reaches no further over a plane counts as not crossing it
STEEPEST = 1 - 1e-12  # of one sphere within the other: the hull is the larger one
NEAR = 1 / 12  # of the scene's size: points so near each other share their candidates
ENTRIES = 1 << 21  # (pair, shape) entries tested at once


class Shafts:
    """Candidate occluders of pairs of surfaces, conservative: a shape left out can hide nothing of the pair."""

    def __init__(self, scene):
        self.scene = scene
        self.table = ShapeTable(scene.shapes)
        self.eps = BESIDE * scene.size
        self.is_plane = ~self.table.is_ball
        self.centre, self.radius = self.table.origin.T, self.table.bound
        self.normal = np.array([s.normal if not isinstance(s, Sphere) else np.zeros(3) for s in scene.shapes])
        self.low, self.high = self._heights()
        self.shape = scene.shape_of
        self.sign = np.array([s.sign for s in scene.surfaces])
        self.inside = np.array([s.is_inside for s in scene.surfaces])
        # a plane with the whole scene on one side, a wall, comes between nothing
        wall = (self.low >= -self.eps).all(axis=1) | (self.high <= self.eps).all(axis=1)
        self.obstacle = ~(self.is_plane & wall)

    def _heights(self):
        """(shapes, shapes) m: least and greatest height of shape k over the plane of shape p (0, 0 for spheres p)."""
        middle = np.einsum("pi,ki->pk", self.normal, self.centre)
        reach = np.zeros_like(middle)
        for k, shape in enumerate(self.scene.shapes):  # support of an affine ball, or of a parallelogram
            if isinstance(shape, Sphere):
                reach[:, k] = np.linalg.norm(self.normal @ shape.linear, axis=1)
            else:
                reach[:, k] = np.abs(self.normal @ np.column_stack([shape.u, shape.v])).sum(axis=1) / 2
        middle -= np.einsum("pi,pi->p", self.normal, self.centre)[:, None]
        return middle - reach, middle + reach

    def may_hide(self, a, b, around=None):
        """Surfaces a, b (p,); a may be -1, a point anywhere -> (p, shapes) bool.

        around: centres (p, 3) and radii (p,) m of spheres that hold the part of a in question, if not all of it.
        """
        sb = self.shape[b]
        keep = self._not_behind(b)
        keep[np.arange(len(b)), sb] = False
        if around is not None:
            keep &= self._near_axis(*around, sb)
        known = np.flatnonzero(a >= 0)
        if len(known):
            sa, sb = self.shape[a[known]], sb[known]
            part = keep[known] & self._not_behind(a[known]) & self.obstacle
            part[np.arange(len(known)), sa] = False
            # a plane hides something only if it has part of the pair on either side
            low = np.minimum(self.low[:, sa], self.low[:, sb]).T
            high = np.maximum(self.high[:, sa], self.high[:, sb]).T
            part &= ~self.is_plane | ((low < -self.eps) & (high > self.eps))
            keep[known] = part if around is not None else part & self._near_axis(self.centre[sa], self.radius[sa], sb)
        return keep

    def may_see(self, a):
        """Surface a (an index) -> (n surfaces,) False where neither sees the other: one is behind the other's plane."""
        everyone = np.arange(len(self.shape))
        ahead = self._not_behind(np.array([a]))[0, self.shape] & self._not_behind(everyone)[:, self.shape[a]]
        other = self.shape != self.shape[a]
        return ahead & (other | ((everyone == a) & self.inside[a]))

    def _not_behind(self, surface):
        """False where the shape lies wholly behind the surface, a plane."""
        shape, sign = self.shape[surface], self.sign[surface][:, None]
        ahead = np.maximum(sign * self.low[shape], sign * self.high[shape]) > self.eps
        return ahead | ~self.is_plane[shape][:, None]

    def _near_axis(self, centre, radius, sb):
        """False where the shape's bounding sphere misses the hull of spheres (p, 3), (p,) and those around sb (p,)."""
        axis, wider = self.centre[sb] - centre, (self.radius[sb] - radius)[:, None]
        length = np.maximum(np.sqrt(np.einsum("pi,pi->p", axis, axis)), 1e-300)[:, None]
        offset = self.centre[None] - centre[:, None]
        along = np.einsum("pki,pi->pk", offset, axis) / length
        across = np.sqrt(np.maximum(np.einsum("pki,pki->pk", offset, offset) - along**2, 0.0))
        # where |offset - t axis| - (radius + t wider) is least: past the foot by the slope of the hull
        slope = np.clip(wider / length, -STEEPEST, STEEPEST)
        past = slope * across / np.sqrt(1 - slope**2)
        t = np.clip((along + past) / length, 0.0, 1.0)
        return np.hypot(across, along - t * length) - radius[:, None] - t * wider < self.radius + self.eps

    def candidates(self, a, b, around=None):
        """Surfaces a, b (p,), around as in may_hide -> candidate occluders (p, width), shape indices padded with -1."""
        if not self.obstacle.any() and (a >= 0).all():
            return np.zeros((len(a), 0), int)
        lists = []
        step = max(1, ENTRIES // len(self.radius))
        for start in range(0, len(a), step):
            part = slice(start, start + step)
            keep = self.may_hide(a[part], b[part], around and [value[part] for value in around])
            width = keep.sum(axis=1).max(initial=0)
            order = np.argsort(~keep, axis=1, kind="stable")[:, :width]
            lists.append(np.where(np.take_along_axis(keep, order, 1), order, -1))
        width = max((part.shape[1] for part in lists), default=0)
        padded = [np.pad(part, ((0, 0), (0, width - part.shape[1])), constant_values=-1) for part in lists]
        return np.concatenate(padded) if padded else np.zeros((0, 0), int)

    def for_pairs(self, points, a, b):
        """As candidates, for many points (n, 3) m on surfaces a (n,): those of one surface that lie near each other
        share their candidates."""
        if not len(a) or (not self.obstacle.any() and (a >= 0).all()):
            return np.zeros((len(a), 0), int)
        cell = np.floor((points - points.min(axis=0)) / (NEAR * self.scene.size)).astype(np.int64)
        cell = np.minimum(cell, 999)
        group = (((a + 1) * 1000 + cell[:, 0]) * 1000 + cell[:, 1]) * 1000 + cell[:, 2]
        first, group = np.unique(group, return_index=True, return_inverse=True)[1:]
        group = group.reshape(-1)
        count = np.bincount(group)
        centre = np.stack([np.bincount(group, points[:, k]) / count for k in range(3)], axis=1)
        radius = np.zeros(len(count))
        np.maximum.at(radius, group, np.linalg.norm(points - centre[group], axis=1))
        pair, back = np.unique(group * len(self.shape) + b, return_inverse=True)
        group, b = pair // len(self.shape), pair % len(self.shape)
        return self.candidates(a[first[group]], b, [centre[group], radius[group]])[back.reshape(-1)]

    def between(self, points, centre, radius, occluders):
        """Shapes that can come between points (n, 3) and spheres (n, 3), (n,): pairs (n index, shape), sorted.

        occluders (n, k): candidates padded with -1. A shape is left out if its bounding sphere misses the cone.
        """
        link, slot = np.nonzero(occluders >= 0)
        shape = occluders[link, slot]
        axis, offset = centre[link] - points[link], self.centre[shape] - points[link]
        length = np.sqrt(np.einsum("ni,ni->n", axis, axis))
        along = np.einsum("ni,ni->n", axis, offset) / np.maximum(length, 1e-300)
        across2 = np.maximum(np.einsum("ni,ni->n", offset, offset) - along**2, 0.0)
        sine = np.minimum(radius[link] / np.maximum(length, 1e-300), 1.0)
        reach = self.radius[shape]
        keep = np.sqrt(across2) * np.sqrt(1 - sine**2) - along * sine <= reach * (1 + 1e-9)
        keep &= (along > -reach) & (along < length + radius[link] + reach)
        return link[keep], shape[keep]

    def hides(self, points, steps, shape):
        """Whether segments points (n, 3) + steps (n, a, b, 3) meet shape (n,) -> (n, a, b) bool"""
        x = np.ascontiguousarray(points.T)[:, None, None]
        d = np.ascontiguousarray(np.moveaxis(steps, (3, 0), (0, 3)))
        x = np.broadcast_to(x, d.shape)
        return np.moveaxis(segment_blocked(self.table, x, d, shape), 2, 0)

    def clear(self, points, steps, occluders):
        """Whether segments points (n, 3) + steps (n, a, b, 3) meet none of occluders (n, k) -> (n, a, b) bool"""
        x = np.broadcast_to(points.T[:, None, None], (3, *steps.shape[1:3], len(points)))
        d = np.ascontiguousarray(np.moveaxis(steps, (3, 0), (0, 3)))
        blocked = np.zeros(d.shape[1:], bool)
        for shape in occluders.T:
            valid = np.flatnonzero(shape >= 0)
            if len(valid):
                blocked[..., valid] |= segment_blocked(self.table, x[..., valid], d[..., valid], shape[valid])
        return np.moveaxis(~blocked, 2, 0)
