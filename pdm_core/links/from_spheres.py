"""Light of spheres at points: directions spread over their outlines, and over the hemisphere within them."""

import numpy as np

from ..at_once import AT_ONCE, CACHED, parts
from ..numerics import gauss_legendre
from ..shapes.shape import frames, unit

_SIZES = ((1, 1), (1, 4), (2, 8), (4, 16), (8, 24))  # rings x directions sampled over a sphere's outline


class FromSpheres:
    """Of balls seen from outside, and of rooms: balls seen from within."""

    def __init__(self, field, factors, balls, rooms):
        self.field, self.factors, self.balls, self.rooms = field, factors, balls, rooms

    def from_balls(self, x, n, own, detail, tol):
        """Yields entries of Gather, see FromPlanes.entries."""
        r, s = (a.ravel() for a in np.meshgrid(np.arange(len(x)), self.balls, indexing="ij"))
        factor = np.empty(len(r))
        for k in parts(np.arange(len(r)), CACHED):
            factor[k] = self.factors.pairs(x.take(r[k], axis=0), n.take(r[k], axis=0), own[r[k]], s[k])
            yield None
        lit = factor > 0
        r, s, factor = r[lit], s[lit], factor[lit]
        error = factor * detail.surface[s] / np.maximum(tol[r], 1e-300)
        size = np.clip(np.ceil(np.log(np.maximum(error, 1e-3)) / np.log(4)), 0, len(_SIZES) - 1).astype(int)
        for k, (rings, turns) in enumerate(_SIZES):
            for part in parts(np.flatnonzero(size == k), AT_ONCE // (rings * turns)):
                i = r[part]
                yield self._sample_cone(x.take(i, axis=0), n.take(i, axis=0), s[part], factor[part], i, rings, turns)

    def _sample_cone(self, x, n, s, factor, r, rings, turns):
        """Directions spread over the outline of ball s, in the space where it is round: (entries of one size)."""
        f = self.field
        local = f.on.local(s, x)
        distance = np.maximum(np.linalg.norm(local, axis=1), 1.0)
        axis, circle = _around(-local, turns)
        u, wu = gauss_legendre(rings)
        sin2 = u[None] / distance[:, None] ** 2
        cosine = np.sqrt(1 - sin2)[:, :, None, None]
        d = np.sqrt(sin2)[:, :, None, None] * circle[:, None] + cosine * axis[:, None, None]
        world = np.einsum("nij,nabj->nabi", f.on.linear[s], d)
        along = np.einsum("nabi,nabi->nab", world, world)
        # solid angle: in the round space d(sin^2)/(2 cos) dphi, and |det| / |L d|^3 to the world
        kernel = np.maximum(np.einsum("nabi,ni->nab", world, n), 0.0) / along**2
        kernel *= wu[None, :, None] / np.sqrt(1 - sin2)[:, :, None]
        total = kernel.sum(axis=(1, 2))
        kernel[total == 0] = 1.0
        weight = kernel * (factor / kernel.sum(axis=(1, 2)))[:, None, None]
        b = np.einsum("nabj,nj->nab", d, local)
        root = np.sqrt(np.maximum(b * b - (np.einsum("ni,ni->n", local, local) - 1)[:, None, None], 0.0))
        hit = local[:, None, None] + (-b - root)[..., None] * d
        return self._spread(np.repeat(s, rings * turns), hit.reshape(-1, 3), weight, r)

    def _spread(self, s, hit, weight, r):
        cell, share = self.field.locate(s, hit)
        weight = weight.reshape(len(r), -1, 1) * share.reshape(len(r), -1, 9)
        return r, self.field.nodes.take(cell, axis=0).reshape(len(r), -1), weight.reshape(len(r), -1)

    def from_rooms(self, x, n, own, detail, tol):
        """Inner sides of spheres: directions over the hemisphere, those that something hides weighted out."""
        for s in self.rooms:
            surface = np.full(len(x), s)
            factor = self.factors.pairs(x, n, own, surface)
            lit = np.flatnonzero(factor > 0)
            occluders = self.factors.shafts.for_pairs(x[lit], own[lit], surface[lit])
            error = factor[lit].max(initial=0) * detail.surface[s] / max(tol.min(initial=1), 1e-300)
            rings, turns = ((2, 8), (4, 16), (8, 32))[int(np.searchsorted((10, 100), error))]
            for part in parts(np.arange(len(lit)), AT_ONCE // (rings * turns)):
                k = lit[part]
                yield self._sample_dome(x[k], n[k], s, factor[k], k, occluders[part], rings, turns)

    def _sample_dome(self, x, n, s, factor, r, occluders, rings, turns):
        axis, circle = _around(n, turns)
        u, wu = gauss_legendre(rings)
        d = np.sqrt(u)[:, None, None] * circle[:, None] + np.sqrt(1 - u)[:, None, None] * axis[:, None, None]
        local = (x - self.field.on.origin[s]) @ self.field.on.inverse[s].T
        step = d @ self.field.on.inverse[s].T
        a = np.einsum("nabi,nabi->nab", step, step)
        b = np.einsum("nabi,ni->nab", step, local)
        c = (np.einsum("ni,ni->n", local, local) - 1)[:, None, None]
        length = (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a
        weight = wu[None, :, None] * self.factors.shafts.clear(x, d * length[..., None], occluders)
        total = weight.sum(axis=(1, 2))
        weight = np.where((total > 0)[:, None, None], weight, 1.0)
        weight = weight * (factor / weight.sum(axis=(1, 2)))[:, None, None]
        hit = (local[:, None, None] + length[..., None] * step).reshape(-1, 3)
        return self._spread(np.full(len(hit), s), hit, weight, r)


def _around(direction, turns):
    """direction (n, 3) -> unit axis (n, 3), and so many unit vectors across it, evenly around, (n, turns, 3)."""
    e1, e2, axis = np.moveaxis(frames(unit(direction)), 1, 0)
    turn = (np.arange(turns) + 0.5) * (2 * np.pi / turns)
    return axis, np.cos(turn)[:, None] * e1[:, None] + np.sin(turn)[:, None] * e2[:, None]
