"""What receivers get from the nodes: the spots that their rays meet, in quarters of the rays for the error."""

from dataclasses import dataclass

import numpy as np

from ..at_once import AT_ONCE, slices
from ..shapes.shape import lattice
from .bundles import NOTHING, along
from .grid import batches
from .spots import Spots

HALVES = 2  # of points, alternately
EIGHTHS = 8  # of the directions, every eighth one
# which of these are halves, the evenest first: of quarters, every fourth one, two by two
PAIRS = ([0, 2, 4, 6], [1, 3, 5, 7]), ([0, 1, 4, 5], [2, 3, 6, 7]), ([0, 3, 4, 7], [1, 2, 5, 6])
# error of all rays, of what half of them differ from all: of light that few of them meet 1, as each meets it by chance;
# at least, as every second one is spread less evenly; of seven rooms by 64 to 1,376 directions, against 8,192, what was
# stated so is 1.07 times the true error in the median, .93 at the 5th percentile and 1.33 at the 95th
HALF = 0.7
WRITTEN = 16  # directions kept at once: rays of one receiver lie side by side, and fill a line of the cache
FINE_SKY = 1 << 15  # directions that find small bright parts of a sky


def directions(count):
    """Unit directions (count, 3) spread evenly over half of the sphere, each standing for its opposite too."""
    return lattice(2 * count)[:count]


class Traced:
    """Rays of n receivers along m directions: code (n, m) int32, twice the facet, one more where its back is met,
    NOTHING, or CONTACT where what lies against them; at (n, m, 2) float32 on it; cosine (n, m) float32 to the
    receiver's normal; directions (m, 3)."""

    def __init__(self, count, directions):
        self.directions = directions
        self.code = np.full((count, len(directions)), NOTHING, np.int32)
        self.at = np.zeros((count, len(directions), 2), np.float32)
        self.cosine = np.zeros((count, len(directions)), np.float32)  # negative along the opposite direction

    @staticmethod
    def bytes_for(count, directions):
        """Memory of so many rays and their spots, and of those that they replace, which the solution before keeps."""
        return 2 * count * directions * (16 + 4)

    def trace(self, facets, receivers, which):
        """Rays, the rows `which` (n,) of this, of receivers(rows, j) (k,) of them along the j-th directions (k,);
        yields a bundle at a time."""
        if not len(which):
            return
        n, found, begin = len(which), [], 0
        for some in batches(len(self.directions), n, facets):
            hits = along(facets, self.directions[some], receivers(np.tile(which, len(some)), np.repeat(some, n)))
            found.append((np.where(hits.facet >= 0, 2 * hits.facet + ~hits.front, hits.facet), hits.at, hits.cosine))
            end = some[-1] + 1
            if end - begin >= WRITTEN or end == len(self.directions):
                for own, parts in zip((self.code, self.at, self.cosine), zip(*found)):
                    parts = [part.reshape(-1, n, *own.shape[2:]) for part in parts]
                    own[which, begin:end] = np.swapaxes(np.concatenate(parts), 0, 1)
                found, begin = [], end
            yield

    def moved(self, old):
        """Of receivers of which some were known before, old (n,) >= 0 which, those with their rays."""
        new, known = Traced(len(old), self.directions), old >= 0
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


def bundle(facets, nodes, receivers, directions, who=None):
    """The Bundle of receivers along directions (k, 3): of all along each, or who (k n,), so many in turn."""
    if who is None:
        who = np.tile(np.arange(len(receivers)), len(directions))
    hits = along(facets, directions, receivers.take(who))
    ray = np.flatnonzero((hits.facet >= 0) & (len(nodes) > 0))  # nothing is sent where all is black
    facet, front, at = hits.facet[ray], hits.front[ray], hits.at[ray]
    node, basis = nodes.columns(facet, at, front)
    return Bundle(ray, who[ray], facet, at, front, node, basis, hits.cosine, hits.facet == NOTHING)


def heaviest(node, basis):
    """(h,) Of the nodes (h, 4) of each place the one that tells most of it, by their basis (h, 4)."""
    return node[np.arange(len(node)), basis.argmax(axis=1)]


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
    """What receivers get of the nodes, each ray's share of it by the spot that it meets, and what comes from the sky.

    sky (n, 3): irradiance / pi; times(value (n nodes, c)) -> (n, c)."""

    def __init__(self, traced, nodes, scene):
        n, m = traced.code.shape
        self.cosine = traced.cosine
        self.parts = slices(n, AT_ONCE // max(m, 1))
        self._find_spots(traced, Spots(nodes))
        self.total, self.skies = np.zeros((n, EIGHTHS)), np.zeros((EIGHTHS, n, 3))
        has_sky = scene.sky is not None or scene.background.any()
        for part in self.parts:
            for q in range(EIGHTHS):
                cosine = traced.cosine[part, q::EIGHTHS]
                weight = np.abs(cosine)
                # in double precision: all nodes share their directions, and with them how these are rounded; between
                # white walls a part in 10^8 comes back a million times
                self.total[part, q] = weight.sum(axis=1, dtype=float)
                if has_sky:
                    missed = np.where(traced.code[part, q::EIGHTHS] == NOTHING, weight, 0.0)
                    self.skies[q, part] = from_sky(missed, cosine, traced.directions[q::EIGHTHS], scene)
        self.skies /= np.maximum(self.total.T, 1e-300)[:, :, None]
        self.whole = np.maximum(self.total.sum(axis=1, keepdims=True), 1e-300)

    def _find_spots(self, traced, spots):
        """spot (n, m): of those that are met the one of each ray, the last for all that carries nothing; node, weight
        (k, 4): what interpolates on each."""
        self.spot, met = np.full(traced.code.shape, -1, np.int32), np.zeros(spots.count + 1, bool)
        for part in self.parts:
            code = traced.code[part]
            row, column = np.nonzero(code >= 0)
            hit = code[row, column]
            mine = spots.of(hit >> 1, traced.at[part][row, column], hit & 1)
            self.spot[part][row, column] = mine
            met[mine] = True
        met[-1] = False
        self.node, self.weight = spots.basis(np.flatnonzero(met))
        number = np.cumsum(met, dtype=np.int32) - 1
        number[-1] = len(self.node)
        for part in self.parts:
            self.spot[part] = number.take(self.spot[part])  # -1 is the last

    @property
    def sky(self):
        return (self.total.T[:, :, None] * self.skies).sum(axis=0) / self.whole

    def times(self, value):
        """value (n nodes, c) -> (n, c)"""
        return self._summed(value, 1)[0] / self.whole

    def _summed(self, value, count):
        """(count, n, c) Sums of value (n nodes, c) over every count-th of the rays, from the first ones on."""
        out = np.zeros((count, len(self.spot), value.shape[1]))
        light = np.zeros((value.shape[1], len(self.node) + 1))
        for c, of_nodes in enumerate(value.T):
            light[c, :-1] = np.einsum("sk,sk->s", self.weight, of_nodes.take(self.node))
        for part in self.parts:
            spot, weight = self.spot[part].astype(np.intp), np.abs(self.cosine[part]).astype(float)
            for c, of_spots in enumerate(light):
                told = of_spots.take(spot)
                for q in range(count):
                    out[q, part, c] = np.einsum("nm,nm->n", weight[:, q::count], told[:, q::count])
        return out

    def cells_met(self):
        """Yields, for some of the receivers at a time, which they are, the nodes whose cells they see, and the share of
        what each gets that comes from there, all (k,), each pair once."""
        own = np.append(heaviest(self.node, self.weight), -1)
        for part in self.parts:
            node, share = own.take(self.spot[part]), np.abs(self.cosine[part]) / self.whole[part]
            row, column = np.nonzero(node >= 0)
            pair, which = np.unique((row << 32) + node[row, column], return_inverse=True)
            row_of, node_of = pair >> 32, pair & 0xFFFFFFFF
            yield part.start + row_of, node_of, np.bincount(which, share[row, column], len(pair))

    def unsure(self, value, weight):
        """(3, n, c) How far off what all rays tell may be, the sky's light included, value (n nodes, c): what half of
        them tell less what all do, of the three ways to take two of four quarters the evenest first; times HALF, or
        more, as they fall by how much less halves are off so than eighths, in the root mean square by weights (n,) of
        the receivers: over two steps at once, as by one it is told by luck."""
        total = self.total.T[:, :, None]
        light = total * self.skies + self._summed(value, EIGHTHS)

        def apart(a, b):
            one, other = (light[k].sum(axis=0) / np.maximum(total[k].sum(axis=0), 1e-300) for k in (a, b))
            return (one - other) / 2

        halves = np.stack([apart(*pair) for pair in PAIRS])
        eighths = (apart([q], [q + EIGHTHS // 2]) for q in range(EIGHTHS // 2))
        half, eighth = (np.sqrt((weight @ np.mean([d**2 for d in of], axis=0)).sum()) for of in (halves[:1], eighths))
        falls = eighth / max(half, 1e-300)
        return halves * np.clip(max(falls - 1, 1e-300) ** -0.5, HALF, 1.0)


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
    for part in slices(len(normals), 16 * AT_ONCE // FINE_SKY):
        cosine = np.maximum(normals[part] @ fine.T, 0.0)
        out[part] = cosine @ bright / cosine.sum(axis=1, keepdims=True)
    return out


def sky_missed(scene, alone, traced):
    """(n, 3) how far the light of a sky that varies is off where the traced rays meet nothing, as their directions may
    all miss a small bright part of it: alone (n, 3) is what sky_alone tells."""
    cosine = np.abs(traced.cosine)
    share = cosine / cosine.sum(axis=1, keepdims=True)
    missed = np.where(traced.code == NOTHING, share, 0.0).sum(axis=1)
    return missed[:, None] * np.abs(alone - from_sky(share, traced.cosine, traced.directions, scene))
