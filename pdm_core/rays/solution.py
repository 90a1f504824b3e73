"""What is read off a solution by rays, and the loop that makes it."""

import copy
import time

import numpy as np

from ..checked import SceneError, vectors
from ..plan import plan_by_rays
from ..read_off import ReadOff
from ..scene import unit
from ..signs_of_life import finish, in_thread, mapped
from .beside import Beside
from .bundles import Receivers
from .engine import RayState
from .kept import KeptRays, check_light
from .placed import Placed
from .where import nodes_near

ROUNDS = 12  # refinements at most
LEAST_GAIN, POOR = 0.05, 2  # of the error in a round; rounds in a row that gain less: more would not help
NAMED = 3  # lights in a warning
GRACE = 0.1, 0.15  # of the time limit, and s, for a first solution: then it is said that there is none
READ_AT_ONCE = 1 << 16  # points: their rays go together


class RaySolution(ReadOff):
    """Radiance everywhere on the scene's surfaces, as pdm_core.Solution; by rays."""

    def __init__(self, state, plan):
        self._state = copy.copy(state)  # arrays are replaced as the state grows on, never written into
        self.scene, self.plan, self.counts = state.scene, plan, dict(state.counts)
        self.error, self.error_parts = state.error, dict(state.parts)
        self.surface_errors, self.surface_norms = state.surface_errors, state.surface_norms
        self.norm, self.nodes = state.norm, len(state.nodes)
        self.seconds, self.history, self.warnings = state.elapsed(), list(state.history), []

    def error_over(self, surfaces):
        """Estimated relative L2 error of L - Le over these surfaces (indices) alone."""
        norm = self.surface_norms[surfaces]
        return float(np.linalg.norm(self.surface_errors[surfaces] * norm) / max(np.linalg.norm(norm), 1e-300))

    def incident_steps(self, surface, points, normals=None, inward=None, roughly=False):
        """Irradiance / pi (n, 3) at points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        out, n = np.empty((len(points), 3)), max(len(points), 1)
        beside = Beside(self._state.facets)
        for start in range(0, len(points), READ_AT_ONCE):
            part = slice(start, start + READ_AT_ONCE)
            own = [None if a is None else a[part] for a in (normals, inward)]
            receivers = Placed(self._state.facets, surface[part], beside.moved(surface[part], points[part]), *own)
            beside.lifted(receivers, surface[part])
            steps, done, size = self._state.incident(receivers, roughly), 0, len(receivers)
            while True:
                try:
                    next(steps)
                except StopIteration as end:
                    out[part] = end.value[0]
                    break
                done += 1
                yield (start + size * done / (done + 2 * self._state.read)) / n
        return np.maximum(out, 0.0)

    def estimated_error_steps(self, surface, points):
        """(n,) at points (n, 3) m of surfaces (n,), see estimated_error: generator of the fraction done."""
        nodes, count = self._state.nodes, len(self.scene)
        node = yield from nodes_near(nodes, surface, points)
        error = self._state.node_error + 1e-300
        total, square = (np.bincount(nodes.surface, nodes.weight * e, count) for e in (np.ones(len(error)), error**2))
        own = self.surface_errors * self.surface_norms / np.sqrt(self.scene.areas)
        share = np.where(node >= 0, error[node] if len(error) else 1.0, 1.0)
        rms = np.sqrt(square / np.maximum(total, 1e-300))[surface]
        return own[surface] * np.where(node >= 0, share / np.maximum(rms, 1e-300), 1.0)

    def irradiance(self, points, normals):
        """points (n, 3) m, normals (n, 3) of any length but 0, anywhere in space -> irradiance / pi (n, 3)"""
        points, normals = vectors(points, "points"), vectors(normals, "normals")
        if len(points) != len(normals):
            raise SceneError(f"irradiance: {len(points)} points but {len(normals)} normals; give one each")
        normals = unit(normals / np.maximum(np.abs(normals).max(axis=1, keepdims=True), 1e-300))
        if not normals.any(axis=1).all():
            raise SceneError("irradiance: a normal is zero; give it a direction")
        n = len(points)
        start = np.full(n, self._state.facets.tolerance)
        free = Receivers(points - self._state.facets.centre, normals, np.full(n, -1), start, np.zeros(n, bool))
        return np.maximum(finish(self._state.incident(free))[0], 0.0)

    def relight(self, scene):
        """The same shapes and sides with other reflectance, emission, lights' colours or background -> RaySolution,
        without visibility."""
        return _relit(self._state, self.plan, scene)

    def kept_steps(self, surface, points, normals=None, inward=None):
        """Kept of points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        kept = KeptRays(self._state, surface, points)
        yield from kept.steps(self._state, normals, inward)
        return kept

    def let_go(self):
        """Its rays are what a better solution grows from: nothing to free."""


class RayApproach:
    """A solution by rays on its way: `steps` refines until the target is met, `best` is what may be delivered."""

    def __init__(self, scene, target_error, reason=""):
        self.state, self.target = RayState(scene, target_error), target_error
        self.plan, self.best = plan_by_rays(scene, target_error, reason), None

    def steps(self):
        """Generator with a sign of life a bundle."""
        state = self.state
        yield from state.extend(np.full(len(state.nodes), -1))
        poor = 0
        for turn in range(ROUNDS):
            yield from state.solve()
            if not state.norm > 0:
                state.nothing()
            else:
                yield from state.check()
            gained = 1.0 if self.best is None else 1 - state.error / max(self.best.error, 1e-300)
            poor = poor + 1 if gained < LEAST_GAIN else 0
            if self.best is None or state.error <= self.best.error:
                self.best = RaySolution(state, self.plan)
            if state.error <= self.target or turn == ROUNDS - 1 or poor == POOR:
                return
            if not (yield from state.improve()):
                return


def ray_steps(scene, target_error, time_limit, why, enough=lambda: False):
    """Generator of (error, seconds); returns the RaySolution, warnings for the caller to add. Closing it cancels."""
    begun = time.perf_counter()
    set_up = in_thread(RayApproach, scene, target_error, why)
    approach = yield from mapped(set_up, lambda _: (float("inf"), time.perf_counter() - begun))
    state, stopped = approach.state, False
    for _ in approach.steps():
        yield state.error, state.elapsed()
        late = time_limit is not None and state.elapsed() - time_limit
        stopped = approach.best is not None and bool(enough() or (late and late > 0))
        if stopped:
            break
        if late and late > GRACE[0] * time_limit + GRACE[1]:
            raise SceneError(
                f"time_limit: nothing was reached within {time_limit:.3g} s; raise the time limit or the target error"
            )
    solution = approach.best
    solution.seconds, solution.history = state.elapsed(), list(state.history)
    if idle := state.idle:
        named = ", ".join(map(repr, idle[:NAMED])) + (f" and {len(idle) - NAMED} more" if len(idle) > NAMED else "")
        solution.warnings.append(
            f"{named} light no surface that reflects, or only places smaller than its cells, which are not sent on; "
            "check where they look and what hides them"
        )
    if solution.error > target_error:
        solution.warnings.append(
            f"The estimated error is {100 * solution.error:.2g} %, above the target of {100 * target_error:.2g} %; "
            + (
                "raise the time limit or the target error"
                if stopped
                else "finer rays hardly help; raise the target error"
            )
        )
    return solution


def same_light(a, b):
    """Whether two lights differ in name and colour alone."""
    described = (vars(a).keys() & vars(b).keys()) - {"name", "colour"}
    return type(a) is type(b) and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in described)


def _relit(old, plan, scene):
    check_light(old.scene, old.reflects, scene)
    if not all(same_light(a, b) for a, b in zip(scene.lights, old.scene.lights)):
        raise SceneError("relight changes the colours of lights alone; where one is moved or resized, solve again")
    if scene.background.any() and not old.scene.background.any():
        raise SceneError("relight: the background was dark and now sends light; solve again")
    state = copy.copy(old)
    state.take_light(scene)
    finish(state.solve())
    if state.norm > 0:
        finish(state.check())
    else:
        state.nothing()
    return RaySolution(state, plan)
