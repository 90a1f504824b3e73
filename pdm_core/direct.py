"""Direct light: what oriented points receive from whole surfaces and from the background, exactly."""

import numpy as np

from .scene import Sphere
from .view import visible_factors

LIFT = 1e-7  # of the scene's size: a point in a surface that it faces (contact) is taken this far off it
PAIRS = 1 << 16


class Factors:
    """Form factors from points to whole surfaces, behind all that hides them."""

    def __init__(self, scene, shafts, counts):
        self.scene, self.shafts, self.counts = scene, shafts, counts
        self.lift = LIFT * scene.size
        shapes = [s.shape for s in scene.surfaces]
        self.is_sphere = np.array([isinstance(s, Sphere) for s in shapes])
        self.is_inside = np.array([s.is_inside for s in scene.surfaces])
        self.origin = np.array([s.origin for s in shapes])
        self.inverse = np.array([s.inverse for s in shapes])
        self.corners = np.array([s.origin + np.zeros((4, 3)) if isinstance(s, Sphere) else s.corners for s in shapes])
        self.front = np.array(
            [np.zeros(3) if isinstance(x.shape, Sphere) else x.sign * x.shape.normal for x in scene.surfaces]
        )

    def facing(self, points, normals, surface, source):
        """Pairs (m,): points, lifted off planes that their spheres touch, and whether they are before the source."""
        height = np.einsum("ni,ni->n", points - self.origin[source], self.front[source])
        toward = np.einsum("ni,ni->n", normals, self.front[source]) < -1e-3
        toward &= (surface >= 0) & self.is_sphere[surface]  # of planes, none can tell contact from back to back
        touching = toward & (np.abs(height) < self.lift)
        if touching.any():
            points = points.copy()
            points[touching] += (self.lift - height[touching])[:, None] * self.front[source[touching]]
            height[touching] = self.lift
        return points, height > self.lift * 1e-3

    def pairs(self, points, normals, surface, source):
        """points, normals (m, 3) on surfaces (m,) (-1: free), source surfaces (m,) -> form factors (m,)"""
        out = np.zeros(len(points))
        flat = np.flatnonzero(~self.is_sphere[source])
        lifted, ahead = self.facing(points[flat], normals[flat], surface[flat], source[flat])
        above = np.einsum("nki,ni->nk", self.corners[source[flat]] - lifted[:, None], normals[flat]).max(axis=1) > 0
        keep = ahead & above
        flat, lifted = flat[keep], lifted[keep]
        out[flat] = self._visible(lifted, normals[flat], surface[flat], source[flat], self.corners[source[flat]])
        ball = np.flatnonzero(self.is_sphere[source] & ~self.is_inside[source] & (surface != source))
        out[ball] = self._visible(points[ball], normals[ball], surface[ball], source[ball])
        room = np.flatnonzero(self.is_inside[source])
        room = room[(surface[room] == source[room]) | self.inside(points[room], source[room])]
        for s in np.unique(source[room]):
            part = room[source[room] == s]
            out[part] = self._visible(points[part], normals[part], surface[part], source[part], sky=True)
        return out

    def inside(self, points, source):
        local = np.einsum("nij,nj->ni", self.inverse[source], points - self.origin[source])
        return np.einsum("ni,ni->n", local, local) < 1 + 1e-9

    def _visible(self, points, normals, surface, source, corners=None, sky=False):
        if not len(points):
            return np.zeros(0)
        occluders = self.shafts.for_pairs(points, surface, source)
        shape = self.shafts.shape[source]
        return visible_factors(self.shafts.table, points, normals, shape, corners, occluders, sky, self.counts)

    def escaping(self, points, normals, surface):
        """points, normals (m, 3) on surfaces (m,) -> (m,) the fraction of the hemisphere that sees the background."""
        own = np.where(surface >= 0, self.shafts.shape[surface], -1)
        occluders = np.tile(np.arange(len(self.scene.shapes)), (len(points), 1))
        occluders[occluders == own[:, None]] = -1  # a convex shape hides nothing from its own points
        open_air = np.flatnonzero(~((surface >= 0) & self.is_inside[surface]))
        out = np.zeros(len(points))
        x, n, nowhere = points[open_air], normals[open_air], np.full(len(open_air), -1)
        out[open_air] = visible_factors(self.shafts.table, x, n, nowhere, None, occluders[open_air], True, self.counts)
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
        for start in range(0, len(r), PAIRS):
            k = slice(start, start + PAIRS)
            value[k] = self.pairs(points[r[k]], normals[r[k]], surface[r[k]], s[k])
        ends = np.cumsum([len(part) * len(wanted) for part, wanted in zip(parts, sources)])
        for rows, part, some in zip(out, parts, np.split(value, ends[:-1])):
            rows[:, :-1] = some.reshape(len(part), -1)
            if background:
                rows[:, -1] = self.escaping(points[part], normals[part], surface[part])
        return out
