"""Which shapes can stand between two surfaces, and what points receive from whole surfaces past them.

Bounding volumes and separating planes decide before any work per point; the rest is exact (view).
"""

import numpy as np

from .at_once import AT_ONCE, slices
from .closed_forms import dot
from .contacts import contacts_of
from .sampled import Met, segment_blocked
from .shape_table import ShapeTable
from .sift import over_edges
from .tolerances import TINY, TOUCHING
from .view import padded, visible_factors

NEAR = 1 / 12  # of the scene's size: points so near each other share their candidates


def shafts_of(scene):
    """The Shafts of a scene that was settled, found once."""
    if "_shafts" not in scene.__dict__:
        object.__setattr__(scene, "_shafts", Shafts(scene))
    return scene._shafts


class Shafts:
    """Candidate occluders of pairs of surfaces, conservative: a shape left out can hide nothing of the pair."""

    def __init__(self, scene):
        self.scene = scene
        self.table = ShapeTable(scene.shapes, scene.tolerance)
        self.eps = scene.tolerance
        self.centre, self.radius = self.table.origin.T, self.table.bound
        self.normal = np.array([s.normal for s in scene.shapes])
        self.low, self.high = self._heights()
        self.shape = scene.shape_of
        self.inside = scene.inside
        # a plane with the whole scene on one side, a wall, comes between nothing
        wall = (self.low >= -self.eps).all(axis=1) | (self.high <= self.eps).all(axis=1)
        self.obstacle = ~wall
        sign = scene.sign[:, None]
        # (surfaces, shapes) False where the shape lies wholly behind the surface, a plane
        self.not_behind = np.maximum(sign * self.low[self.shape], sign * self.high[self.shape]) > self.eps
        self.shell = np.zeros((len(scene), len(scene.shapes)), bool)
        self.shell[contacts_of(scene).shells] = True  # its own sphere hides what reaches out of it from a surface
        self.against = np.zeros((len(scene), len(scene.shapes)), bool)
        self.against[contacts_of(scene).covers] = True  # where they have been parted, nothing is seen in between

    def _heights(self):
        """(shapes, shapes) m: least and greatest height of shape k over the plane of shape p; without end of balls p,
        which have none."""
        low = np.einsum("pi,ki->pk", self.normal, self.centre)
        low -= np.einsum("pi,pi->p", self.normal, self.centre)[:, None]
        high = low.copy()
        for k, shape in enumerate(self.scene.shapes):
            below, above = shape.extent(self.normal)
            low[:, k] += below
            high[:, k] += above
        round_ = self.table.by_kind(np.arange(len(low)))[0]
        low[round_], high[round_] = -np.inf, np.inf
        return low, high

    def may_hide(self, a, b, around=None):
        """Surfaces a, b (p,); a may be -1, a point anywhere -> (p, shapes) bool.

        around: centres (p, 3) and radii (p,) m of spheres that hold the part of a in question, if not all of it.
        """
        sb = self.shape[b]
        keep = self.not_behind.take(b, axis=0)
        keep[np.arange(len(b)), sb] = False
        if around is not None:
            keep &= self._near_axis(*around, sb)
        known = np.flatnonzero(a >= 0)
        if len(known):
            sa, sb = self.shape[a[known]], sb[known]
            part = keep[known] & self.not_behind.take(a[known], axis=0) & self.obstacle
            part[np.arange(len(known)), sa] = False
            # a plane hides something only if it has part of the pair on either side
            low = np.minimum(self.low[:, sa], self.low[:, sb]).T
            high = np.maximum(self.high[:, sa], self.high[:, sb]).T
            part &= (low < -self.eps) & (high > self.eps)
            keep[known] = part if around is not None else part & self._near_axis(self.centre[sa], self.radius[sa], sb)
            keep[known, sa] = self.shell[a[known], sb]
        return keep

    def may_see(self, a):
        """Surface a (an index) -> (n surfaces,) False where neither sees the other: one is behind the other's plane."""
        everyone = np.arange(len(self.shape))
        ahead = self.not_behind[a, self.shape] & self.not_behind[:, self.shape[a]]
        other = self.shape != self.shape[a]
        return ahead & (other | ((everyone == a) & self.inside[a]))

    def _near_axis(self, centre, radius, sb):
        """False where the shape's bounding sphere misses the hull of spheres (p, 3), (p,) and those around sb (p,)."""
        axis, wider = self.centre[sb] - centre, (self.radius[sb] - radius)[:, None]
        length = np.maximum(np.sqrt(np.einsum("pi,pi->p", axis, axis)), TINY * self.eps)[:, None]
        # as products of matrices; what they lose to rounding is below a hundredth of eps
        middle, axis = self.centre.mean(axis=0), axis / length
        shapes, centre = self.centre - middle, centre - middle
        along = axis @ shapes.T - np.einsum("pi,pi->p", axis, centre)[:, None]
        distance2 = np.einsum("pi,pi->p", centre, centre)[:, None] + np.einsum("ki,ki->k", shapes, shapes)
        distance2 -= 2 * centre @ shapes.T
        across = np.sqrt(np.maximum(distance2 - along**2, 0.0))
        # where |offset - t axis| - (radius + t wider) is least: past the foot by the slope of the hull
        slope = np.clip(wider / length, TINY - 1, 1 - TINY)
        past = slope * across / np.sqrt(1 - slope**2)
        t = np.clip((along + past) / length, 0.0, 1.0)
        # within the other sphere that is all of the hull: what lies on the axis has no way past its foot
        t = np.where(np.abs(wider) >= length, wider > 0, t)
        return across**2 + (along - t * length) ** 2 < (self.radius + (self.eps + radius)[:, None] + t * wider) ** 2

    def candidates(self, a, b, around=None):
        """Surfaces a, b (p,), around as in may_hide -> candidate occluders (p, width), shape indices padded with -1."""
        if not self.obstacle.any() and (a >= 0).all():
            return np.zeros((len(a), 0), int)
        lists = [np.zeros((0, 0), int)]
        for part in slices(len(a), AT_ONCE // len(self.radius)):
            keep = self.may_hide(a[part], b[part], around and [value[part] for value in around])
            lists.append(padded(len(keep), *np.nonzero(keep)))
        return _stacked(lists)

    def for_pairs(self, points, a, b):
        """As candidates, for many points (n, 3) m on surfaces a (n,), none of them covered: those of one surface that
        lie near each other share their candidates."""
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
        np.maximum.at(radius, group, np.linalg.norm(points - centre.take(group, axis=0), axis=1))
        pair, back = np.unique(group * len(self.shape) + b, return_inverse=True)
        group, b = pair // len(self.shape), pair % len(self.shape)
        hidden = self.candidates(a[first[group]], b, [centre[group], radius[group]]).take(back.reshape(-1), axis=0)
        return self.not_against(a, hidden)

    def not_against(self, a, occluders):
        """Of candidates (n, k) for points on surfaces a (n,) those that do not lie against these: they hide nothing but
        what they cover, and stand out only as they have been parted."""
        against = self.against[a[:, None], occluders] & (a >= 0)[:, None]
        return np.where(against, -1, occluders)

    def in_view(self, points, normals, corners, occluders):
        """Of candidates (n, k) those that points (n, 3) with normals (n, 3) may see before polygons (n, 4, 3)."""
        lists = [np.zeros((0, 0), int)]
        for part in slices(len(points), AT_ONCE // max(occluders.shape[1], 1)):
            x, n = np.ascontiguousarray(points[part].T), np.ascontiguousarray(normals[part].T)
            around = np.ascontiguousarray(np.transpose(corners[part], (2, 1, 0))) - x[:, None]
            pair, slot = np.nonzero(occluders[part] >= 0)
            shape = occluders[part][pair, slot]
            keep = over_edges(self.table, x, around, pair, shape) > -1 - TOUCHING
            offset = self.table.origin.take(shape, axis=1) - x.take(pair, axis=1)
            keep &= dot(n.take(pair, axis=1), offset) > -self.radius[shape]
            lists.append(padded(len(x[0]), pair[keep], shape[keep]))
        return _stacked(lists)

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


class Factors:
    """Form factors from points to whole surfaces, behind all that hides them."""

    def __init__(self, scene, shafts, counts):
        self.scene, self.shafts, self.counts = scene, shafts, counts
        self.met = Met(shafts.table)
        shapes = [s.shape for s in scene.surfaces]
        # planes, balls from outside, balls from within
        self.kind = shafts.table.is_ball[shafts.shape] + 1 * shafts.inside
        self.origin = np.array([s.origin for s in shapes])
        self.inverse = np.array([s.inverse for s in shapes])
        self.corners = np.array([s.corners for s in shapes])
        self.front = np.array([s.sign * s.shape.normal for s in scene.surfaces])

    def by_kind(self, source):
        """Indices (k,) into sources (m,), surfaces: planes, balls seen from outside, balls seen from within."""
        return [np.flatnonzero(self.kind[source] == kind) for kind in range(3)]

    def facing(self, points, surface, source):
        """(m,) Whether points (m, 3) on surfaces (m,) (-1: free) are before the planes of sources (m,), and do not lie
        against them."""
        front = self.front.take(source, axis=0)
        ahead = np.einsum("ni,ni->n", points - self.origin.take(source, axis=0), front) > self.scene.tolerance
        return ahead & ((surface < 0) | ~self.shafts.against[surface, self.shafts.shape[source]])

    def pairs(self, points, normals, surface, source, occluders=None):
        """points, normals (m, 3) on surfaces (m,) (-1: free), source surfaces (m,) -> form factors (m,)

        occluders (m, k): candidates padded with -1, if known.
        """

        def visible(k, corners=None, sky=False):
            x, n, known = points.take(k, axis=0), normals.take(k, axis=0), None if occluders is None else occluders[k]
            return self.visible(x, n, surface[k], source[k], corners, sky, known)

        out = np.zeros(len(points))
        flat, ball, room = self.by_kind(source)
        x, n, corners = points.take(flat, axis=0), normals.take(flat, axis=0), self.corners.take(source[flat], axis=0)
        above = np.einsum("nki,ni->nk", corners - x[:, None], n).max(axis=1) > 0
        keep = np.flatnonzero(self.facing(x, surface[flat], source[flat]) & above)
        out[flat[keep]] = visible(flat[keep], corners.take(keep, axis=0))
        ball = ball[self.elsewhere(surface[ball], source[ball])]
        ball = ball[~self.inside(points[ball], source[ball])]
        out[ball] = visible(ball)
        elsewhere = self.elsewhere(surface[room], source[room])
        room = room[(surface[room] == source[room]) | (elsewhere & self.inside(points[room], source[room]))]
        for s in np.unique(source[room]):
            part = room[source[room] == s]
            out[part] = visible(part, sky=True)
        return out

    def elsewhere(self, surface, source):
        """(m,) Whether surfaces (m,) are not of the same shape as the sources (m,)."""
        return (surface < 0) | (self.shafts.shape[surface] != self.shafts.shape[source])

    def inside(self, points, source):
        """(m,) Whether points (m, 3) lie within the balls of sources (m,), not on them."""
        local = np.einsum("nij,nj->ni", self.inverse.take(source, axis=0), points - self.origin.take(source, axis=0))
        depth = 1 - np.sqrt(np.einsum("ni,ni->n", local, local))
        return depth > self.shafts.table.slack[self.shafts.shape[source]]

    def visible(self, points, normals, surface, source, corners=None, sky=False, occluders=None):
        """Factors (m,) of sources that the points are before, or in; occluders (m, k): candidates, if known."""
        if not len(points):
            return np.zeros(0)
        if occluders is None:
            occluders = self.shafts.for_pairs(points, surface, source)
        shape = self.shafts.shape[source]
        told = self.counts, self.met
        return visible_factors(self.shafts.table, points, normals, shape, corners, occluders, sky, *told)

    def escaping(self, points, normals, surface):
        """points, normals (m, 3) on surfaces (m,) -> (m,) the fraction of the hemisphere that sees the background."""
        own = np.where(surface >= 0, self.shafts.shape[surface], -1)
        occluders = np.tile(np.arange(len(self.scene.shapes)), (len(points), 1))
        occluders[occluders == own[:, None]] = -1  # a convex shape hides nothing from its own points
        bare = np.flatnonzero(~contacts_of(self.scene).covered(points, surface))
        occluders[bare] = self.shafts.not_against(surface[bare], occluders[bare])
        open_air = np.flatnonzero(~((surface >= 0) & self.shafts.inside[surface]))
        out = np.zeros(len(points))
        x, n, nowhere = points[open_air], normals[open_air], np.full(len(open_air), -1)
        told, occluders = (self.counts, self.met), occluders[open_air]
        out[open_air] = visible_factors(self.shafts.table, x, n, nowhere, None, occluders, True, *told)
        return out

    def matrix(self, points, normals, surface, sources, background):
        """Factors (m, len(sources) + 1); the last column is the background's, 0 unless wanted."""
        return self.lists(points, normals, surface, [np.arange(len(points))], [sources], background)[0]

    def lists(self, points, normals, surface, parts, sources, background):
        """For each of the parts, indices of points, its own sources -> a list of matrices; small parts cost little."""
        out = [np.zeros((len(part), len(wanted) + 1)) for part, wanted in zip(parts, sources)]
        r = np.concatenate([np.repeat(part, len(wanted)) for part, wanted in zip(parts, sources)])
        s = np.concatenate([np.tile(wanted, len(part)) for part, wanted in zip(parts, sources)]).astype(int)
        value = np.empty(len(r))
        for k in slices(len(r), AT_ONCE):
            value[k] = self.pairs(points.take(r[k], axis=0), normals.take(r[k], axis=0), surface[r[k]], s[k])
        ends = np.cumsum([len(part) * len(wanted) for part, wanted in zip(parts, sources)])
        for rows, part, some in zip(out, parts, np.split(value, ends[:-1])):
            rows[:, :-1] = some.reshape(rows[:, :-1].shape)
            if background:
                rows[:, -1] = self.escaping(points[part], normals[part], surface[part])
        return out


def _stacked(lists):
    """Arrays of several widths, padded with -1, as one."""
    width = max(part.shape[1] for part in lists)
    return np.concatenate([np.pad(p, ((0, 0), (0, width - p.shape[1])), constant_values=-1) for p in lists])
