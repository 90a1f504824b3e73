"""What receivers get from the nodes: hits of their rays as sparse rows, in halves of the rays for the error."""

from dataclasses import dataclass

import numpy as np

from ..shapes.shape import lattice
from .bundles import CONTACT, NOTHING, along
from .grid import batches

HALVES = 2  # of the directions, alternately
MISS, DARK = -1, -2  # instead of a facet's code
FINE_SKY, AT_ONCE = 1 << 15, 32  # directions that find small bright parts of a sky; points at once


def directions(count):
    """Unit directions (count, 3) spread evenly over half of the sphere, each standing for its opposite too."""
    return lattice(2 * count)[:count]


class Traced:
    """Rays of n receivers along m directions: code (n, m) int32, twice the facet, one more where its back is met, MISS
    where nothing, DARK where what lies against them; at (n, m, 2) float32 on it; cosine (n, m) float32 to the
    receiver's normal; directions (m, 3)."""

    def __init__(self, count, directions):
        self.directions = directions
        self.code = np.full((count, len(directions)), MISS, np.int32)
        self.at = np.zeros((count, len(directions), 2), np.float32)
        self.cosine = np.zeros((count, len(directions)), np.float32)  # negative along the opposite direction

    @staticmethod
    def bytes_for(count, directions):
        """Memory of so many rays, and of the rows made of them."""
        return count * directions * (16 + 80)

    def trace(self, facets, receivers, which):
        """Rays, the rows `which` (n,) of this, of receivers(rows, j) (k,) of them along the j-th directions (k,);
        yields a bundle at a time."""
        for some in batches(len(self.directions), len(which), facets):
            rows, j = np.tile(which, len(some)), np.repeat(some, len(which))
            hits = along(facets, self.directions[some], receivers(rows, j))
            code = np.where(hits.facet >= 0, 2 * hits.facet + ~hits.front, MISS)
            self.code[rows, j] = np.where(hits.facet == CONTACT, DARK, code)
            self.at[rows, j], self.cosine[rows, j] = hits.at, hits.cosine
            yield

    def moved(self, count, old):
        """Of `count` receivers, those known before, old (count,) >= 0, with their rays."""
        new, known = Traced(count, self.directions), old >= 0
        for name in ("code", "at", "cosine"):
            getattr(new, name)[known] = getattr(self, name)[old[known]]
        return new


@dataclass
class Bundle:
    """Rays of n receivers along k directions, or against them, one direction after the other: ray (h,), which of the
    k n meet what sends light, who (h,), whose they are, their facet, at (h, 2) and front (h,), its nodes and weights,
    node, basis (h, 4); cosine (k n,), negative against the direction; missed (k n,) bool: which meet nothing."""

    ray: np.ndarray
    who: np.ndarray
    facet: np.ndarray
    at: np.ndarray
    front: np.ndarray
    node: np.ndarray
    basis: np.ndarray
    cosine: np.ndarray
    missed: np.ndarray


def bundle(facets, nodes, receivers, directions):
    """The Bundle of receivers along directions (k, 3)."""
    n, k = len(receivers), len(directions)
    who = np.tile(np.arange(n), k)
    hits = along(facets, directions, receivers.take(who))
    ray = np.flatnonzero((hits.facet >= 0) & (len(nodes) > 0))  # nothing is sent where all is black
    facet, front, at = hits.facet[ray], hits.front[ray], hits.at[ray]
    node, basis = nodes.columns(facet, at, front)
    return Bundle(ray, who[ray], facet, at, front, node, basis, hits.cosine, hits.facet == NOTHING)


def light_of(rays, sent, scene, directions):
    """(k n, 3) What comes along the rays of a Bundle in directions (k, 3): what nodes send (nodes, 3), or the sky."""
    out = np.zeros((len(rays.cosine), 3))
    out[rays.ray] = np.einsum("hk,hkc->hc", rays.basis, sent.take(rays.node, axis=0))
    missed = np.flatnonzero(rays.missed)
    if len(missed) and (scene.sky is not None or scene.background.any()):
        sky = scene.sky_at(np.concatenate([directions, -directions]))
        of_each = len(rays.cosine) // len(directions)
        out[missed] = sky[missed // of_each + len(directions) * (rays.cosine[missed] < 0)]
    return out


class Gathered:
    """Sparse rows over the nodes, and what comes from the sky: of all rays, and of each half of them.

    sky (n, 3): irradiance / pi; times(value (n nodes, c)) -> (n, c)."""

    def __init__(self, traced, nodes, scene):
        n, m = traced.code.shape
        half = np.arange(m) % HALVES
        cosine = np.abs(traced.cosine)
        # in double precision: all nodes share their directions, and with them how these are rounded; between white
        # walls a part in 10^8 comes back a million times
        total = np.stack([cosine[:, half == h].sum(axis=1, dtype=float) for h in range(HALVES)], axis=1)
        self.share = total / np.maximum(total.sum(axis=1, keepdims=True), 1e-300)
        weight = cosine / np.maximum(total, 1e-300)[:, half]
        self.skies = [np.zeros((n, 3)) for _ in range(HALVES)]
        self.halves = []
        for h in range(HALVES):
            mine = half == h
            code, w = traced.code[:, mine], weight[:, mine]
            if scene.sky is not None or (scene.background > 0).any():
                missed = np.where(code == MISS, w, 0.0)
                self.skies[h] = from_sky(missed, traced.cosine[:, mine], traced.directions[mine], scene)
            row, column = np.nonzero(code >= 0)
            hit = code[row, column]
            node, basis = nodes.columns(hit >> 1, traced.at[:, mine][row, column], (hit & 1) == 0)
            basis = basis * cosine[:, mine][row, column, None]
            row = np.repeat(row, 4)
            node, basis = node.ravel(), basis.ravel()
            keep = np.flatnonzero(basis > 0)
            row, node, basis = row[keep], node[keep], basis[keep]
            self.halves.append(_Sparse(row, node, basis, 1 / np.maximum(total[:, h], 1e-300)))

    @property
    def sky(self):
        return self.share[:, :1] * self.skies[0] + self.share[:, 1:] * self.skies[1]

    def times(self, value):
        """value (n nodes, c) -> (n, c)"""
        a, b = (half.times(value) for half in self.halves)
        return self.share[:, :1] * a + self.share[:, 1:] * b

    def back(self, value):
        """The transpose of times: value (n, c) -> (n nodes, c)"""
        return sum(half.back(share[:, None] * value, len(value)) for half, share in zip(self.halves, self.share.T))

    def unsure(self, value):
        """(n, c) What half the rays tell less what all do, the sky's light included, value (n nodes, c)."""
        a, b = (sky + half.times(value) for sky, half in zip(self.skies, self.halves))
        return (a - b) / 2


def from_sky(missed, cosine, directions, scene):
    """Light (n, 3) from outside along directions (m, 3), or against them where the cosine (n, m) is negative, weighted
    by missed (n, m)."""
    if scene.sky is None:
        return missed.sum(axis=1)[:, None] * scene.background
    along, against = scene.sky_at(directions), scene.sky_at(-directions)
    return np.where(cosine >= 0, missed, 0.0) @ along + np.where(cosine < 0, missed, 0.0) @ against


def sky_alone(scene, normals):
    """(n, 3) light of a sky that varies where nothing hides it, at normals (n, 3), by many directions."""
    fine = lattice(FINE_SKY)
    bright, out = scene.sky_at(fine), np.empty((len(normals), 3))
    for start in range(0, len(normals), AT_ONCE):
        part = slice(start, start + AT_ONCE)
        cosine = np.maximum(normals[part] @ fine.T, 0.0)
        out[part] = cosine @ bright / cosine.sum(axis=1, keepdims=True)
    return out


def sky_missed(scene, alone, traced):
    """(n, 3) how far the light of a sky that varies is off where the traced rays meet nothing, as their directions may
    all miss a small bright part of it: alone (n, 3) is what sky_alone tells."""
    cosine = np.abs(traced.cosine)
    share = cosine / cosine.sum(axis=1, keepdims=True)
    missed = np.where(traced.code == MISS, share, 0.0).sum(axis=1)
    return missed[:, None] * np.abs(alone - from_sky(share, traced.cosine, traced.directions, scene))


class _Sparse:
    """A matrix as sorted entries, its rows times scale (n rows,)."""

    def __init__(self, row, column, weight, scale):
        self.column, self.weight, self.count, self.scale = column, weight, len(scale), scale[:, None]
        self.rows, self.start = np.unique(row, return_index=True)

    def times(self, value):
        out = np.zeros((self.count, value.shape[1]))
        if len(self.rows):
            for c in range(value.shape[1]):
                each = np.ascontiguousarray(value[:, c]).take(self.column)
                out[self.rows, c] = np.add.reduceat(each * self.weight, self.start)
        return out * self.scale

    def back(self, value, count):
        """The transpose of times: value (n rows, c) -> (count, c)"""
        out, each = np.zeros((count, value.shape[1])), np.diff(self.start, append=len(self.column))
        for c, of_row in enumerate((value * self.scale)[self.rows].astype(np.float32).T):
            out[:, c] = np.bincount(self.column, np.repeat(of_row, each) * self.weight, count)
        return out
