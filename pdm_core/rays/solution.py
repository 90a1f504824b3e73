"""What is read off a solution by rays, and the loop that makes it."""

import copy
import time

import numpy as np

from ..checked import SceneError, index, vectors
from ..plan import plan_by_rays
from ..read_off import ReadOff
from ..scene import Scene, unit
from ..signs_of_life import finish, in_thread, mapped
from .beside import Beside
from .bundles import Receivers
from .engine import RayState
from .placed import Placed

ROUNDS = 12  # refinements at most
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

    def incident_steps(self, surface, points, normals=None, inward=None):
        """Irradiance / pi (n, 3) at points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        out, n = np.empty((len(points), 3)), max(len(points), 1)
        beside = Beside(self._state.facets)
        for start in range(0, len(points), READ_AT_ONCE):
            part = slice(start, start + READ_AT_ONCE)
            own = [None if a is None else a[part] for a in (normals, inward)]
            receivers = Placed(self._state.facets, surface[part], beside.moved(surface[part], points[part]), *own)
            beside.lifted(receivers, surface[part])
            steps, done, size = self._state.incident(receivers), 0, len(receivers)
            while True:
                try:
                    next(steps)
                except StopIteration as end:
                    out[part] = end.value[0]
                    break
                done += 1
                yield (start + size * done / (done + 2 * self._state.read)) / n
        return np.maximum(out, 0.0)

    def estimated_error(self, surface_index, points):
        """points (n, 3) m, projected onto the surface -> (n,) estimated error of the radiance there, in its unit: where it
        is likely to be large, not a bound at each point."""
        index(surface_index, len(self.scene), "surface_index")
        area = self.scene.areas[surface_index]
        own = self.surface_errors[surface_index] * self.surface_norms[surface_index] / np.sqrt(area)
        nodes, state = self._state.nodes, self._state
        if not nodes.number[surface_index]:
            return np.full(len(points), own)
        part = slice(nodes.first[surface_index], nodes.first[surface_index] + nodes.number[surface_index])
        error = state.node_error[part] + 1e-300
        error = own * error / max(np.sqrt((nodes.weight[part] * error**2).sum() / nodes.weight[part].sum()), 1e-300)
        places = nodes.places.exact.reshape(-1, nodes.places.exact.shape[0] // max(len(nodes), 1), 3)[part, 0]
        return error[nearest(vectors(points, "points"), places)]

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

    def let_go(self):
        """Its rays are what a better solution grows from: nothing to free."""


def nearest(points, places):
    """(n,) Which of places (k, 3) is nearest each of points (n, 3)."""
    out = np.empty(len(points), int)
    step = max(1, (1 << 20) // max(len(places), 1))
    for start in range(0, len(points), step):
        d = points[start : start + step, None] - places
        out[start : start + step] = np.einsum("nki,nki->nk", d, d).argmin(axis=1)
    return out


class RayApproach:
    """A solution by rays on its way: `steps` refines until the target is met, `best` is what may be delivered."""

    def __init__(self, scene, target_error, reason=""):
        self.state, self.target = RayState(scene, target_error), target_error
        self.plan, self.best = plan_by_rays(scene, target_error, reason), None

    def steps(self):
        """Generator with a sign of life a bundle."""
        state = self.state
        yield from state.extend(np.full(len(state.nodes), -1))
        for turn in range(ROUNDS):
            yield from state.solve()
            if not state.norm > 0:
                state.nothing()
            else:
                yield from state.check()
            if self.best is None or state.error <= self.best.error:
                self.best = RaySolution(state, self.plan)
            if state.error <= self.target or turn == ROUNDS - 1:
                return
            if not (yield from state.improve()):
                return


def ray_steps(scene, target_error, time_limit, why, enough=lambda: False):
    """Generator of (error, seconds); returns the RaySolution, warnings for the caller to add. Closing it cancels."""
    begun = time.perf_counter()
    set_up = in_thread(RayApproach, scene, target_error, why)
    approach = yield from mapped(set_up, lambda _: (float("inf"), time.perf_counter() - begun))
    state = approach.state
    for _ in approach.steps():
        yield state.error, state.elapsed()
        if approach.best is not None and enough():
            break
        late = time_limit is not None and state.elapsed() - time_limit
        if late and late > 0 and approach.best is not None:
            break
        if late and late > GRACE[0] * time_limit + GRACE[1]:
            raise SceneError(
                f"time_limit: nothing was reached within {time_limit:.3g} s; raise the time limit or the target error"
            )
    solution = approach.best
    solution.seconds, solution.history = state.elapsed(), list(state.history)
    if solution.error > target_error:
        solution.warnings.append(
            f"The estimated error is {100 * solution.error:.2g} %, above the target of {100 * target_error:.2g} %; "
            "raise the time limit or the target error"
        )
    return solution


def _relit(old, plan, scene):
    if not isinstance(scene, Scene):
        raise SceneError(f"relight needs a Scene, not {scene!r}")
    same = len(scene) == len(old.scene) and all(
        a.shape is b.shape and a.side == b.side for a, b in zip(scene.surfaces, old.scene.surfaces)
    )
    if not same or len(scene.lights) != len(old.scene.lights):
        raise SceneError(
            "relight needs the same shapes, sides and lights in the same order; solve the new scene instead"
        )
    shines = (scene.emission > 0).any(axis=1)
    shone = (old.scene.emission > 0).any(axis=1)
    lights = scene.background.any() and not old.scene.background.any()
    reflects = (scene.reflectance > 0).any(axis=1)
    if lights or (shines & ~shone).any() or (reflects & ~old.reflects).any():
        raise SceneError("relight: what was dark or black now sends light; solve again")
    state = copy.copy(old)
    state.take_light(scene)
    finish(state.solve())
    finish(state.check())
    return RaySolution(state, plan)
