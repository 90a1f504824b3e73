"""What is read off a solution by links, and the same shapes under other light."""

import copy
import time
from collections import Counter

import numpy as np

from ..at_once import CACHED, slices
from ..checked import SceneError
from ..contacts import settled_again
from ..numerics import SOLVED
from ..plan import reached_by_light
from ..read_off import ReadOff, Unseen, check_same_shapes, oriented, runs_of
from ..signs_of_life import TICK, finish
from .kept import KeptLinks
from .light import SolvedLight
from .own import SAFETY

FIRST_CHUNK = 256  # points of the first evaluation; the later ones are sized by what it took
GROWTH = 2  # of an evaluation over the one before it, at most


class Solution(ReadOff):
    """Radiance everywhere on the scene's surfaces; see `solve`."""

    def __init__(self, scene, check, history):
        """scene: as it was handed over; history: [(seconds, estimated error), ...]"""
        self._check = check = check.snapshot()
        self._light, transport = check.light, check.light.transport
        self.scene, self.plan = scene, transport.plan
        self.counts = dict(transport.counts, iterations=check.light.iterations)
        self.error, self.error_parts = check.error, dict(check.parts)
        self.surface_errors = check.own.errors  # (n surfaces,) each one's own: relative L2, estimated
        self.surface_norms = check.light.shared.norm  # (n surfaces,) as norm, of each
        self.norm = check.light.norm  # ||L - Le||, radiance times metres
        self.nodes = len(transport.sent.keys)
        self.seconds, self.history, self.warnings = history[-1][0], list(history), []

    def incident_steps(self, surface, points, normals=None, inward=None, roughly=False):
        """Irradiance / pi (n, 3) at points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        out, done, chunk = np.empty((len(points), 3)), 0, FIRST_CHUNK
        while done < len(points):
            begun = time.perf_counter()
            part = slice(done, done + chunk)
            out[part] = self._light.incident(surface[part], points[part] - self._light.transport.origin)
            speed = chunk / max(time.perf_counter() - begun, 1e-6)
            most = min(GROWTH * chunk, CACHED)  # what is remembered takes no time, what comes next may not be
            done, chunk = done + chunk, int(np.clip(speed * TICK, FIRST_CHUNK, most))
            yield min(done / len(points), 1.0)
        return np.maximum(out, 0.0)

    def held_steps(self, surface, points):
        """Irradiance / pi (n, 3), see ReadOff: generator of the fraction done."""
        return np.maximum((yield from self._between_nodes(surface, points, self._light.total())), 0.0)

    def estimated_error_steps(self, surface, points):
        """(n,) at points (n, 3) m of surfaces (n,), see estimated_error: generator of the fraction done."""
        out = yield from self._between_nodes(surface, points, self._check.own.node_error[:, None])
        return SAFETY * np.maximum(out[:, 0], 0.0)

    def _between_nodes(self, surface, points, value):
        """Values (n nodes, c) of the sent nodes at points (n, 3) m of surfaces (n,) -> (n, c); yields."""
        transport = self._light.transport
        on, sent, out = np.empty(points.shape), transport.sent, np.empty((len(points), value.shape[1]))
        for k, mine in runs_of(surface):
            on[mine] = self.scene.surfaces[k].shape.project(points[mine]) - transport.origin
        for part in slices(len(points), CACHED):
            placed = sent.locate(surface[part], sent.on.local(surface[part], on[part]))
            out[part] = sent.interpolate(placed, value)
            yield part.start / len(points)
        return out

    def irradiance(self, points, normals):
        """points (n, 3) m, normals (n, 3) of any length but 0, anywhere in space -> irradiance / pi (n, 3)"""
        points, normals = oriented(points, normals)
        return self._light.in_space(points - self._light.transport.origin, normals)

    def relit(self, scene):
        """See relight; Unseen where that does not tell."""
        begun = time.perf_counter()
        self._need_rows("relight")
        check_same_shapes(self.scene, scene)
        check = self._check.under(_under_other_light(self._light, scene))
        finish(check.light.solve(SOLVED * max(self.error, 1e-6)))
        finish(check.light.divide(self.error))
        finish(check.again())
        return Solution(scene, check, [(time.perf_counter() - begun, check.error)])

    def kept_steps(self, surface, points, normals=None, inward=None):
        """Kept of points (n, 3) m of surfaces (n,): generator of the fraction done."""
        self._need_rows("kept")
        kept = KeptLinks(self.scene, self._light, surface, points)
        yield from kept.steps(self._light, CACHED // 4)
        return kept

    def _need_rows(self, what):
        if self._light.transport.rows is None:
            raise SceneError(f"{what}: this solution was delivered early, without what relighting needs; solve again")

    def let_go(self):
        """Make room for the rows of a better solution: this one cannot be relit any more."""
        self._light.transport.rows = None


def _under_other_light(old, scene):
    """The SolvedLight of old's shapes in another Scene of them, to be solved."""
    transport, scene = copy.copy(old.transport), settled_again(old.transport.scene, scene)
    lit = reached_by_light(scene, transport.factors.shafts) & ~transport.reached
    if lit.any():
        name = scene.surfaces[np.flatnonzero(lit)[0]].name
        raise Unseen(f"relight: light now comes to surface {name!r}, where there was none; solve again")
    sends = np.flatnonzero((scene.reflectance > 0).any(axis=1) & transport.reached)
    new = np.setdiff1d(sends, transport.reflectors)
    if len(new) or ((scene.background > 0).any() and not transport.background):
        raise Unseen("relight: a surface that was black or a background that was dark now sends light; solve again")
    transport.counts = Counter()
    exact = {s: part.exact for s, part in enumerate(old.received)}
    return SolvedLight(transport, scene, old.precision, exact)
