"""Light of points by rays, kept as matrices: what each gets of every source, of groups of nodes and from the sky.

What reflected light changes between two groups is found by these alone; where it falls within a group stays as the
solution had it, so that under the light that was solved for nothing is lost.
"""

import numpy as np

from ..checked import SceneError
from ..kept import Kept, check_room, same
from ..numerics import gmres
from ..scene import Scene
from ..signs_of_life import finish
from .direct import COARSE, READ, Shares
from .placed import Placed
from .rows import MISS, Traced, directions
from .sources import Emitter

GROUPS = 1500  # of nodes, at most: their matrix stays in the cache
TRIED = 1.2  # factor of the size of groups, until there are no more
FAINT = 1e-3  # of the light: sources that give less may become brighter, yet their shadows need not be finer than that
SOLVED = 0.005  # relative residual of the linear system, of the target
STEPS = 60  # of the solver at most
AT_ONCE = 8  # directions of nodes
LEAST, MOST = 0.5, 2.0  # of what groups tell: the light itself


class KeptRays(Kept):
    """Of a solution by rays."""

    def __init__(self, state, surface, points):
        super().__init__(state.scene, surface, points)
        self.given, self.target, self.reflects = state.scene, state.target, state.reflects
        self.emitters = np.array([s.index for s in state.sources if isinstance(s, Emitter)], int)
        self.groups = _Groups(state)
        self.factor = np.zeros((len(points), len(state.sources), 3), np.float32)
        check_room(self.factor.nbytes + 4 * len(points) * self.groups.count)
        self.rows = np.zeros((len(points), self.groups.count), np.float32)
        self.sky = _Sky(len(points), state.read, state.scene)

    def steps(self, state, normals, inward):
        """Generator of the fraction done, that works out what is kept."""
        receivers, total = Placed(state.facets, self.surface, self.points, normals, inward), 1 + len(state.sources)
        for k, source in enumerate(state.sources):
            tolerance = np.full(len(receivers), self._tolerance(state, k))
            steps = Shares(state.facets, [source], state.counts).at(receivers, tolerance, READ[self.target > COARSE])
            self.factor[:, k] = (yield from _told(steps, k / total))[0][:, 0]
        light = np.zeros((len(receivers), 3))
        for j in range(state.read):
            yield from self._along(state, receivers, j, light)
            yield (len(state.sources) + j / state.read) / total
        for array in (light, self.rows):
            array /= self.sky.total[:, None]
        self.sky.settle()
        self.share = np.ones_like(light)
        told = self._reflected(self.scene)
        clear = told > 1e-6 * max(np.abs(told).max(initial=0.0), 1e-300)
        self.share[clear] = np.clip(light[clear] / told[clear], LEAST, MOST)

    def _tolerance(self, state, k):
        """Of the light of source k, as if there were no other: any may become the brightest."""
        lit, weight = (state.factor[:, k] * state.light[k]).max(axis=1), state.nodes.weight
        own = np.sqrt((weight * lit**2).sum() / max(weight.sum(), 1e-300))
        return self.target * max(own, FAINT * state.level)

    def _along(self, state, receivers, j, light):
        """Adds what the points see along the j-th direction; yields."""
        traced = Traced(len(receivers), directions(state.read)[j : j + 1])
        yield from traced.trace(state.facets, lambda _: receivers, np.arange(len(receivers)))
        code, cosine = traced.code[:, 0], traced.cosine[:, 0]
        hit = np.flatnonzero(code >= 0)
        node, basis = state.nodes.columns(code[hit] >> 1, traced.at[hit, 0], (code[hit] & 1) == 0)
        basis = basis * np.abs(cosine[hit, None])
        light[hit] += np.einsum("hk,hkc->hc", basis, state.sent[node])
        for column, weight in zip(self.groups.of[node].T, basis.T, strict=True):
            self.rows[hit, column] += weight
        self.sky.add(j, cosine, code == MISS)

    def light(self, scene, changed):
        check_light(self.given, self.reflects, scene)
        self.groups.take_materials(self.scene, scene, changed)
        direct = np.einsum("nkc,kc->nc", self.factor, self._colours(scene))
        return direct + self.sky.light(scene), self.share * self._reflected(scene)

    def _colours(self, scene):
        lamps = np.array([lamp.colour for lamp in scene.lights]).reshape(-1, 3)
        return np.concatenate([scene.emission[self.emitters], lamps]).astype(np.float32)

    def _reflected(self, scene):
        """(n, 3) What the groups send to the points."""
        return self.rows @ self.groups.sent(scene, self._colours(scene), SOLVED * self.target).astype(np.float32)

    @property
    def bytes(self):
        """What is kept takes of the memory."""
        return self.factor.nbytes + self.rows.nbytes + self.share.nbytes + self.sky.bytes + self.groups.bytes


class _Groups:
    """Nodes of a solution in groups, neighbours on one surface: of (nodes,), surface (count,), rows (count, count)."""

    def __init__(self, state):
        nodes = state.nodes
        self.of = _grouped(nodes)
        self.count = int(self.of.max(initial=-1)) + 1
        weight = nodes.weight / np.maximum(np.bincount(self.of, nodes.weight, self.count), 1e-300)[self.of]
        self.surface = np.zeros(self.count, int)
        self.surface[self.of] = nodes.surface
        shape = state.factor.shape[1:]
        self.factor = self._mean(weight, state.factor.reshape(len(nodes), -1)).reshape(self.count, *shape)
        self.reflectance = self._mean(weight, nodes.reflectance)
        self.shines = state.by_rays[self.surface][:, None]
        self.indirect = np.zeros((self.count, 3))
        self.rows = np.zeros((self.count, self.count), np.float32)
        traced = state.traced
        self.sky = _Sky(self.count, len(traced.directions), state.scene)
        total = np.maximum(np.abs(traced.cosine).sum(axis=1), 1e-30)
        for start in range(0, len(traced.directions), AT_ONCE):
            self._add(nodes, traced, slice(start, start + AT_ONCE), weight / total)
        for j in range(len(traced.directions)):
            self.sky.add(j, traced.cosine[:, j], traced.code[:, j] == MISS, self.of, weight / total)
        self.sky.settle()

    def _mean(self, weight, values):
        return np.stack([np.bincount(self.of, weight * v, self.count) for v in values.T], axis=1)

    def _add(self, nodes, traced, part, weight):
        row, column = np.nonzero(traced.code[:, part] >= 0)
        code = traced.code[:, part][row, column]
        node, basis = nodes.columns(code >> 1, traced.at[:, part][row, column], (code & 1) == 0)
        basis = basis * (np.abs(traced.cosine[:, part][row, column]) * weight[row])[:, None]
        place = self.of[row][:, None] * self.count + self.of[node]
        self.rows += np.bincount(place.ravel(), basis.ravel(), self.rows.size).reshape(self.rows.shape)

    def take_materials(self, old, new, changed):
        """Reflectance where it has changed."""
        for k in changed:
            a, b = old.surfaces[k], new.surfaces[k]
            other = [what for what in ("reflectance", "emission") if not same(a, b, what)]
            shines = "emission" in other and (callable(a.emission) or callable(b.emission))
            if shines or ("reflectance" in other and callable(b.reflectance)):
                raise SceneError(f"Surface {b.name!r} varies from place to place; solve again to see it changed")
            if "reflectance" in other:
                self.reflectance[self.surface == k] = b.reflectance

    def sent(self, scene, colours, tolerance):
        """(count, 3) radiance that the groups send on."""
        outer = np.einsum("nkc,kc->nc", self.factor, colours) + self.sky.light(scene)
        shining = np.where(self.shines, scene.emission[self.surface], 0.0)

        def times(value):
            return (self.rows @ value.astype(np.float32)).astype(float)

        right = times(self.reflectance * outer + shining)
        guess = np.where(right.any(axis=0), self.indirect, 0.0)
        steps = gmres(lambda v: times(self.reflectance * v), right, guess, tolerance, STEPS)
        self.indirect = finish(steps)[0]
        return self.reflectance * (outer + self.indirect) + shining

    @property
    def bytes(self):
        return self.rows.nbytes + self.factor.nbytes + self.of.nbytes + self.sky.bytes


class _Sky:
    """What n receivers see of the sky along m directions and against them: of one that is the same all around the sum;
    of one that varies all parts, and its light under the sky last asked for."""

    def __init__(self, count, directions_count, scene):
        self.directions = directions(directions_count)
        self.total, self.missed = np.zeros(count), np.zeros(count)
        self.parts = np.zeros((2, count, directions_count), np.float32) if scene.sky is not None else None
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


def _grouped(nodes):
    """(n nodes,) Numbers of groups of neighbours on one surface, GROUPS at most, unless there are more surfaces."""
    points = nodes.places.exact.reshape(len(nodes), -1, 3).mean(axis=1)
    low = points.min(axis=0, initial=np.inf)
    size = np.sqrt(nodes.weight.sum() / GROUPS)
    fewest = len(np.unique(nodes.surface))
    while True:
        cell = np.minimum(np.floor((points - low) / max(size, 1e-300)), 1 << 15).astype(np.int64)
        key = (nodes.surface << 48) + (cell[:, 0] << 32) + (cell[:, 1] << 16) + cell[:, 2]
        found, group = np.unique(key, return_inverse=True)
        if len(found) <= max(GROUPS, fewest):
            return group.reshape(-1)
        size *= TRIED


def _told(steps, fraction):
    """Runs steps, with a sign of life each, and returns what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield fraction


def check_light(old, reflected, scene):
    """Raises SceneError where a solution of the scene old, of which surfaces (n,) reflected, does not tell what the
    same shapes give under other light."""
    if not isinstance(scene, Scene):
        raise SceneError(f"relight needs a Scene, not {scene!r}")
    alike = len(scene) == len(old) and all(
        a.shape is b.shape and a.side == b.side for a, b in zip(scene.surfaces, old.surfaces)
    )
    if not alike or len(scene.lights) != len(old.lights):
        raise SceneError(
            "relight needs the same shapes, sides and lights in the same order; solve the new scene instead"
        )
    shines, reflects = (scene.emission > 0).any(axis=1), (scene.reflectance > 0).any(axis=1)
    if (shines & ~(old.emission > 0).any(axis=1)).any() or (reflects & ~reflected).any():
        raise SceneError("relight: what was dark or black now sends light; solve again")
