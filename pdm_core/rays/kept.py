"""Light of points by rays, kept as matrices over groups of nodes: see kept.KeptGroups."""

import numpy as np

from ..at_once import slices
from ..checked import SceneError
from ..kept import KeptGroups, group
from ..read_off import Unseen, check_same_shapes
from ..signs_of_life import mapped
from .bundles import NOTHING
from .direct import COARSE, READ, Shares
from .near import NearHits
from .placed import read_places
from .rows import bundle, directions
from .sources import relit

LEAST_LIGHT = 1e-3  # of the light: sources that give less may become brighter, but need no finer shadows than that


class KeptRays(KeptGroups):
    """Of a solution by rays."""

    def __init__(self, state, surface, points):
        nodes, lit, count = state.nodes, state.lit, len(state.lit.sources)
        places = nodes.places.exact.reshape(len(nodes), -1, 3).mean(axis=1)
        of = group(nodes.surface, places, nodes.weight)
        super().__init__(state.scene, surface, points, of, nodes.surface, nodes.weight, count, channels=3)
        self.given, self.reflects = state.scene, state.reflects
        self.sources, self.spots, self.straight_on = lit.sources, lit.spots, count - len(lit.spots)
        self.take_nodes(lit.factor, nodes.reflectance)
        self.shines = state.by_rays[self.group_surface][:, None]
        self.outside = _Sky(len(points), directions(state.read), state.scene)
        self.group_outside = _Sky(self.count, state.traced.directions, state.scene)

    def steps(self, state, normals, inward):
        """Generator of the fraction done, that works out what is kept."""
        self._between_groups(state.nodes, state.traced)
        yield 0.0
        receivers = read_places(state.facets, self.surface, self.points, normals, inward)
        total = 1 + len(self.sources)
        for k, source in enumerate(self.sources):
            one, told = Shares(state.facets, [source], state.counts), self._tolerance(state, k)
            steps = one.at(receivers, told, state.target, READ[state.target > COARSE])
            self.factor[:, k] = (yield from mapped(steps, lambda _, k=k: k / total))[0][:, 0]
        light, near = np.zeros((len(receivers), 3)), NearHits(state, receivers, state.read)
        self.glare = yield from mapped(state.glare(state.read), lambda _: 0.0)
        for j, direction in enumerate(directions(state.read)):
            self._along(state, receivers, j, direction, light, near)
            yield (len(self.sources) + j / state.read) / total
        light += yield from mapped(near.settle(), lambda _: 1.0)
        self.outside.settle()
        for array in (light, self.rows):
            array /= self.outside.total[:, None]
        if self.glare is not None:
            light += (yield from mapped(self.glare.at(receivers), lambda _: 1.0)).mean(axis=0)
        self.settle(light)

    def _tolerance(self, state, k):
        """Of the light of source k, as if there were no other: any may become the brightest."""
        lit, weight = (state.lit.factor[:, k] * state.lit.light[k]).max(axis=1), state.nodes.weight
        own = np.sqrt((weight * lit**2).sum() / max(weight.sum(), 1e-300))
        return state.target * max(own, LEAST_LIGHT * state.level)

    def _along(self, state, receivers, j, direction, light, near):
        """Adds what the points see along the j-th direction (3,)."""
        rays = bundle(state.facets, state.nodes, receivers, direction[None])
        hit, node, cosine = rays.who, rays.node, rays.cosine
        near.add(rays)
        if self.glare is not None:
            rays.basis[self.glare.told(rays, receivers)] = 0.0
        basis = rays.basis * np.abs(cosine[hit, None])
        light[hit] += np.einsum("hk,hkc->hc", basis, state.sent[node])
        for column, weight in zip(self.of[node].T, basis.T, strict=True):
            self.rows[hit, column] += weight
        self.outside.add(j, cosine, rays.missed)

    def _between_groups(self, nodes, traced):
        weight = self.part / np.maximum(np.abs(traced.cosine).sum(axis=1), 1e-30)
        for part in slices(len(traced.directions), 8):
            row, column = np.nonzero(traced.code[:, part] >= 0)
            code = traced.code[:, part][row, column]
            node, basis = nodes.columns(code >> 1, traced.at[:, part][row, column], (code & 1) == 0)
            basis = basis * (np.abs(traced.cosine[:, part][row, column]) * weight[row])[:, None]
            place = self.of[row][:, None] * self.count + self.of[node]
            found = np.bincount(place.ravel(), basis.ravel(), self.group_rows.size)
            self.group_rows += found.reshape(self.group_rows.shape)
        for j in range(len(traced.directions)):
            self.group_outside.add(j, traced.cosine[:, j], traced.code[:, j] == NOTHING, self.of, weight)
        self.group_outside.settle()

    def check(self, scene):
        check_light(self.given, self.reflects, scene)

    def colours(self, scene):
        return np.array([source.colour for source in relit(self.sources, scene)]).reshape(-1, 3)

    def light(self, scene, changed):
        straight, reflected = super().light(scene, changed)
        if not self.spots:
            return straight, reflected
        # what spots of narrow beams send has been reflected once
        once = np.einsum("nkc,kc->nc", self.factor[:, self.straight_on :], self.colours(scene)[self.straight_on :])
        return straight - once, reflected + once

    def shining(self, scene):
        return np.where(self.shines, scene.emission[self.group_surface], 0.0)

    def sky(self, scene):
        return self.outside.light(scene)

    def group_sky(self, scene):
        return self.group_outside.light(scene)

    @property
    def bytes(self):
        """What is kept takes of the memory."""
        return super().bytes + self.outside.bytes + self.group_outside.bytes


class _Sky:
    """What n receivers see of the sky along m directions and against them: of one that is the same all around the sum;
    of one that varies all parts, and its light under the sky last asked for."""

    def __init__(self, count, directions, scene):
        self.directions = directions
        self.total, self.missed = np.zeros(count), np.zeros(count)
        self.parts = np.zeros((2, count, len(directions)), np.float32) if scene.sky is not None else None
        self.last, self.shown = None, None

    def add(self, j, cosine, missed, of=None, weight=None):
        """Receivers' cosines (k,) to the j-th direction, and whether it goes out; of (k,), weight (k,): which of the
        counted ones each is a part of, and how much of it."""
        share = np.abs(cosine) if weight is None else np.abs(cosine) * weight
        out = np.where(missed, share, 0.0)
        parts = [share, out] + ([out * (cosine >= 0), out * (cosine < 0)] if self.parts is not None else [])
        if of is not None:
            parts = [np.bincount(of, part, len(self.total)) for part in parts]
        self.total += parts[0]
        self.missed += parts[1]
        if self.parts is not None:
            self.parts[:, :, j] = parts[2:]

    def settle(self):
        """Makes the sums of all directions 1."""
        self.total = np.maximum(self.total, 1e-30)
        self.missed /= self.total
        if self.parts is not None:
            self.parts /= self.total[:, None]

    def light(self, scene):
        """(n, 3)"""
        if scene.sky is None:
            return self.missed[:, None] * scene.background
        if self.parts is None:
            raise SceneError("The background was the same in all directions and now varies; solve again")
        if scene.sky is not self.last:
            ahead, behind = (scene.sky_at(d).astype(np.float32) for d in (self.directions, -self.directions))
            self.last, self.shown = scene.sky, self.parts[0] @ ahead + self.parts[1] @ behind
        return self.shown

    @property
    def bytes(self):
        return self.missed.nbytes + (0 if self.parts is None else self.parts.nbytes)


def check_light(old, reflected, scene):
    """Raises SceneError where a solution of the scene old, of which surfaces (n,) reflected, does not tell what the
    same shapes give under other light."""
    check_same_shapes(old, scene)
    shines, reflects = (scene.emission > 0).any(axis=1), (scene.reflectance > 0).any(axis=1)
    if (shines & ~(old.emission > 0).any(axis=1)).any() or (reflects & ~reflected).any():
        raise Unseen("relight: what was dark or black now sends light; solve again")
