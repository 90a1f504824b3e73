"""Glare: what is so bright that one ray that meets it doubles the light, as a ceiling does close above a lamp.

Hardly any ray meets it through the slit beside the lamp, and who has that ray is far too bright. Beyond its reach it is
asked for by points, which rays that leave it choose: where it is seen from elsewhere. Within it rays are many enough.
"""

from dataclasses import dataclass

import numpy as np

from ..closed_forms import disc_kernel
from .bundles import along
from .grid import batches
from .merged import PLACES
from .near import REACH, places_of
from .perspective import seen_from
from .placed import Placed
from .rows import HALVES, directions, heaviest

NEXT_TO = np.stack(np.divmod(np.arange(9), 3), axis=1) - 1  # cells around one
TRIED, WAYS = 1 << 16, 64  # rays that leave it, from places all over it, about; directions of these
POINTS = 128  # of them, at most, that come as far: their places stand for it
TOLD = 256  # directions that tell which part of the light of each place comes as far


@dataclass
class Glare:
    """bright (nodes,) bool; reach (nodes,) m, beyond which points tell their light. Of the points place, normal (p, 3)
    m about the facets' centre, node (p,), own (p,): the shapes they are on, light (p, 3): radiance times m^2."""

    facets: object
    bright: np.ndarray
    reach: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    node: np.ndarray
    own: np.ndarray
    light: np.ndarray

    def told(self, rays, receivers):
        """(h,) Which hits of the Bundle of receivers points tell the light of."""
        node = heaviest(rays.node, rays.basis)
        some = np.flatnonzero(self.bright[node])
        return some[self._far(rays.facet[some], rays.at[some], receivers.points[rays.who[some]], node[some])]

    def take_out(self, rows, traced, receivers):
        """Makes rays of the Gathered rows of receivers meet nothing where points tell its light."""
        node, none = np.append(heaviest(rows.node, rows.weight), 0), len(rows.node)
        bright = np.append(self.bright[node[:-1]], False)
        for part in rows.parts:
            row, column = np.nonzero(bright.take(rows.spot[part]))
            row += part.start
            facet, at = traced.code[row, column] >> 1, traced.at[row, column]
            told = self._far(facet, at, receivers.points[row], node[rows.spot[row, column]])
            rows.spot[row[told], column[told]] = none

    def _far(self, facet, at, points, node):
        """(h,) Whether hits at (h, 2) on facets are out of reach of points (h, 3), of nodes (h,)."""
        return np.linalg.norm(places_of(self.facets, facet, at) - points, axis=1) > self.reach[node]

    def at(self, receivers):
        """Irradiance / pi (HALVES, n, 3), each of every second point, at receivers; yields."""
        out = np.zeros((HALVES, len(receivers), 3))
        for own in np.unique(self.own):
            of_shape = np.flatnonzero(self.own == own)
            for some in batches(len(of_shape), len(receivers), self.facets):
                some = of_shape[some]
                value = disc_kernel(self.place[some], self.normal[some], 0.0, receivers.points, receivers.normals).T
                apart = np.linalg.norm(self.place[some, None] - receivers.points, axis=2)
                point, who = np.nonzero(value * (apart > self.reach[self.node[some], None]))
                seen = seen_from(self.facets, self.place[some], receivers, point, who, own)
                point, who = point[seen], who[seen]
                got = HALVES * value[point, who]
                for half in range(HALVES):
                    mine = some[point] % HALVES == half
                    for c, light in enumerate(self.light[some][point].T):
                        out[half, :, c] += np.bincount(who[mine], (got * light)[mine], len(receivers))
                yield
        return out


def glare_of(state, count):
    """The Glare of a RayState for receivers with so many directions, None where there is none that is seen; yields."""
    nodes, sent, facets = state.nodes, state.sent.max(axis=1), state.facets
    weight = nodes.weight * (sent > 0)
    usual = 2 * sent.max(initial=0.0)
    for _ in range(2):  # in the mean, of what is no brighter than that
        usual = (weight * np.minimum(sent, usual)).sum() / max(weight.sum(), 1e-300)
    bright = 2 * sent > count * usual
    if not bright.any():
        return None
    reach, rng = REACH[0] * np.sqrt(nodes.weight), np.random.default_rng(len(nodes))
    start, node, light = _places(state, bright)
    order = rng.permutation(len(node))
    order = order[: len(order) // WAYS * WAYS].reshape(WAYS, -1)
    leaves = np.zeros(len(node))
    for some in batches(WAYS, order.shape[1], facets):
        ray = order[some].ravel()
        leaves[ray] = _leaving(facets, start.take(ray), reach[node[ray]], directions(WAYS)[some])
        yield
    taken = np.flatnonzero(leaves > rng.random(len(leaves)))
    if not len(taken):
        return None
    few = min(POINTS, len(taken))
    part = order.size / len(node) * few / len(taken)  # of those that would be
    taken = taken[np.arange(few) * len(taken) // few]  # from all over it
    start, node, light, leaves = start.take(taken), node[taken], light[taken] / part, leaves[taken]
    for some in batches(TOLD, len(taken), facets):
        again = np.tile(np.arange(len(taken)), len(some))
        found = _leaving(facets, start.take(again), reach[node[again]], directions(TOLD)[some])
        leaves += found.reshape(len(some), -1).sum(axis=0)
        yield
    light *= ((TOLD + 1) / leaves)[:, None]  # with the first ray all but right in the mean, and within bounds
    own = facets.own[facets.scene.shape_of[start.surface]]
    return Glare(facets, bright, reach, facets.before(start.points, start.faces), start.faces, node, own, light)


def _places(state, bright):
    """Receivers all over nodes bright (nodes,) bool; the node (n,), the light (n, 3), radiance times m^2, of each."""
    nodes, cells = state.nodes, len(state.nodes.lattice)
    lattice, which = nodes.lattice, np.flatnonzero(bright[:cells])
    middle = (lattice.corner + lattice.step / 2)[which] / lattice.size[lattice.chart[which]]
    beside_it = np.unique(lattice.around(which, middle, NEXT_TO))
    # what is parted from the middle of its own cell may be of one beside it
    which = np.union1d(which, beside_it[nodes.parted.touched[beside_it]])
    rest = cells + np.flatnonzero(bright[cells:])
    each = -(-TRIED // (len(which) + len(rest)))
    chart, corner, step = (a[which] for a in (lattice.chart, lattice.corner, lattice.step))
    low, high = (end / lattice.size[chart] for end in (corner, corner + step))
    share, at = nodes.charts.cells(chart, low, high, each)
    own, at = np.repeat(chart, each), at.reshape(-1, 2)
    node, basis = nodes.parted.columns(own, at)
    area = np.repeat(share * nodes.charts.area[chart] / each, each)
    light = area[:, None] * np.einsum("hk,hkc->hc", basis, state.sent[node])
    node = heaviest(node, basis)
    some = np.flatnonzero(bright[node])
    found = Placed(nodes.facets, own[some], nodes.charts.points(own[some], at[some]))
    of_meshes = nodes.places.take((rest[:, None] * PLACES + np.arange(each) % PLACES).ravel())
    rest = np.repeat(rest, each)
    light = np.concatenate([state.sent[rest] * nodes.weight[rest, None] / each, light[some]])
    return of_meshes.joined(found), np.append(rest, node[some]), light


def _leaving(facets, start, reach, ways):
    """(n,) The cosine of rays from receivers, so many in turn along each of ways (k, 3), that come further than reach
    (n,) m, 0 of others."""
    hits = along(facets, ways, start)
    met = np.flatnonzero(hits.facet >= 0)
    far = np.zeros(len(start))
    far[met] = np.linalg.norm(places_of(facets, hits.facet[met], hits.at[met]) - start.points[met], axis=1)
    return np.where(far > reach, np.abs(hits.cosine), 0.0)
