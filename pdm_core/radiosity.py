"""The solution: direct light exact everywhere, indirect light on an adaptive field, to a stated error.

L = Le + rho (D + I). D comes from closed forms (direct), I = A rho (D + I) on the field's nodes with the rows A of
gather. Rounds tighten the tolerance, refine the field where the estimated error is, and solve again.
"""

import copy
import time
from collections import Counter, namedtuple

import numpy as np

from .direct import Factors
from .error_estimates import leaf_errors, sample_points, spread
from .field import DEEPEST, Field
from .gather import Detail, Gather
from .plan import plan
from .scene import Scene, SceneError
from .visibility import Shafts

Progress = namedtuple("Progress", "fraction error seconds")

COARSEST = 0.08  # relative error aimed at by the first round
STEP = 3.0  # each further round aims this much lower
LINK_SHARE = 0.1  # tolerance of one link, of the round's target
SOLVER_SHARE = 0.02  # relative residual of the linear system, of the round's target
REFINE_TO = 0.5  # a refinement leaves this part of the target in the leaves not split
MAX_ROUNDS = 6  # refinements towards one target
MAX_NODES = 9000  # a dense operator of 650 MB
MAX_KRYLOV = 60
SAMPLES = 96  # points where the residual is measured each round
FINER = 0.25  # tolerance of their links, of the round's
SAFETY = 1.5
EVALUATE = 1 << 14  # points evaluated at once


class Solution:
    """Radiance everywhere on the scene's surfaces; see `solve`."""

    def __init__(self, state):
        self._state = state = copy.copy(state)  # arrays are replaced as the state grows on, never written into
        state.field = copy.copy(state.field)
        self.scene, self.plan, self.counts = state.scene, state.plan, dict(state.counts)
        self.error, self.error_parts = state.error, dict(state.error_parts)
        self.seconds, self.history = state.elapsed(), list(state.history)
        self.warnings = list(state.warnings)

    def radiance(self, surface_index, points):
        """points (n, 3) m, projected onto the surface -> outgoing radiance (n, 3)"""
        surface = self.scene.surfaces[surface_index]
        return surface.emission + surface.reflectance * self.incident(surface_index, points)

    def incident(self, surface_index, points):
        """points (n, 3) m, projected onto the surface -> irradiance / pi (n, 3) on its own side"""
        s, points = self._state, np.asarray(points, float)
        own = self.scene.surfaces[surface_index]
        out = np.empty((len(points), 3))
        for start in range(0, len(points), EVALUATE):
            part = slice(start, start + EVALUATE)
            on = own.shape.project(points[part])
            smooth = s.field.interpolate(s.conformed, surface_index, on)
            x = s.field.inset(surface_index, on)
            out[part] = s.direct(x, own.normals(on), np.full(len(x), surface_index)) + smooth
        return np.maximum(out, 0.0)

    def irradiance(self, points, normals):
        """points (n, 3) m, unit normals (n, 3), anywhere in space -> irradiance / pi (n, 3)"""
        s = self._state
        points, normals = np.asarray(points, float), np.asarray(normals, float)
        return s.gathered(points, normals, np.full(len(points), -1), s.link_tolerance)

    def relight(self, scene):
        """The same shapes and sides with other reflectance, emission or background -> Solution, without visibility."""
        return _relit(self._state, scene)


class _State:
    """Everything a solution grows from."""

    def __init__(self, scene):
        self.scene, self.started = scene, time.perf_counter()
        self.plan, self.counts, self.warnings = plan(scene), Counter(), []
        self.factors = Factors(scene, Shafts(scene), self.counts)
        self.field = Field(scene)
        self.lights = np.flatnonzero((scene.emission > 0).any(axis=1))
        self.reflectors = np.flatnonzero((scene.reflectance > 0).any(axis=1))
        self.background = bool((scene.background > 0).any())
        self.light = np.concatenate([scene.emission[self.lights], scene.background[None]])
        self.added = np.zeros((len(scene), 3))  # emission of surfaces that became lights by relighting
        self.error, self.error_parts, self.history = float("inf"), {}, []
        self.fractions = np.zeros((0, len(self.lights) + 1))
        self.indirect = np.zeros((0, 3))
        self.norm, self.link_tolerance = 0.0, float("inf")

    def elapsed(self):
        return time.perf_counter() - self.started

    def direct(self, points, normals, surface):
        if not len(self.lights) and not self.background:
            return np.zeros((len(points), 3))
        return self.factors.matrix(points, normals, surface, self.lights, self.background) @ self.light

    def grow(self):
        """Direct light at new nodes, exact; indirect light there from the parents as a first guess."""
        f, old = self.field, len(self.fractions)
        own = f.node_surface[old:]
        new = self.factors.matrix(f.points[old:], f.normals[old:], own, self.lights, self.background)
        self.fractions = np.concatenate([self.fractions, new])
        self.indirect = np.concatenate([self.indirect, f.predict(self.indirect, old)])
        self.lit = self.fractions @ self.light

    def radiosity(self):
        """(n nodes, 3): what the nodes send on besides the lights' uniform emission."""
        own = self.field.node_surface
        return self.scene.reflectance[own] * (self.lit + self.indirect) + self.added[own]

    def measure(self):
        """Norm of L - Le over all surfaces: sqrt of the area integral of the squared channels."""
        f = self.field
        own = f.node_surface
        value = ((self.scene.reflectance[own] * (self.lit + self.indirect)) ** 2).sum(axis=1)
        leaves = f.leaves
        self.norm = float(np.sqrt((value[f.nodes[leaves]].mean(axis=1) * f.sizes()[leaves]).sum()))
        self.level = self.norm / np.sqrt(self.scene.areas.sum())

    def detail(self):
        """How the sources vary, for the choice of links."""
        f, value = self.field, self.radiosity()
        at = value[f.nodes]
        variation = np.ptp(at, axis=1).max(axis=1)
        surplus = np.abs(f.surplus(value)).max(axis=(1, 2))
        below = np.zeros(len(f.level))
        for level in range(f.level.max(), 0, -1):
            cells = np.flatnonzero(f.level == level)
            np.maximum.at(below, f.parent[cells], np.maximum(below[cells], surplus[cells]))
        surface = np.zeros(len(self.scene))
        np.maximum.at(surface, f.surface[f.parent < 0], variation[f.parent < 0])
        low, high = np.full((len(self.scene), 3), np.inf), np.full((len(self.scene), 3), -np.inf)
        np.minimum.at(low, f.node_surface, value)
        np.maximum.at(high, f.node_surface, value)
        return Detail(variation, below, (high - low).max(axis=1))

    def tolerance(self, surface, tolerance):
        """Link tolerance (m,) of receivers on surfaces (m,): dark ones need less."""
        rho = np.where(surface >= 0, self.scene.reflectance[surface].max(axis=1), 1.0)
        return tolerance / np.maximum(rho, 0.05)

    def scatter(self, value):
        """rho A value: what the nodes send on of what they receive, (n nodes, 3)"""
        return self.operator @ (self.scene.reflectance[self.field.node_surface] * value)

    def solve(self, tolerance):
        """I = A rho (D + I) + A added, from the guess at hand."""
        own = self.field.node_surface
        right = self.operator @ (self.scene.reflectance[own] * self.lit + self.added[own])
        self.indirect, steps, self.solver_error = gmres(self.scatter, right, self.indirect, tolerance, MAX_KRYLOV)
        self.counts["iterations"] += steps

    def estimate(self, target):
        """Relative error of L_h, in named parts, from the residual at random points and the field's surpluses."""
        f = self.field
        rho = self.scene.reflectance[f.node_surface]
        self.leaf_error = leaf_errors(f, rho * self.indirect, rho * rho * self.lit)
        if self.norm == 0 or not len(self.reflectors):
            self.error, self.error_parts = 0.0, {}
        else:
            surface, points, normals, weight = sample_points(f, self.leaf_error, SAMPLES)
            fine = self.gathered(points, normals, surface, self.link_tolerance * FINER) \
                - self.direct(points, normals, surface)
            yield
            here = np.empty_like(fine)
            for s in np.unique(surface):
                here[surface == s] = f.interpolate(self.conformed, s, points[surface == s])
            residual = self.scene.reflectance[surface] * (fine - here)
            rms, mean = spread(residual, weight)
            solver = self.solver_error
            self.error_parts = {
                "discretisation": rms / self.norm,
                "gather": self.gain() * mean / self.norm,
                "solver": self.gain() * solver,
            }
            self.error = SAFETY * float(np.sqrt(sum(v * v for v in self.error_parts.values())))
        self.history.append((self.elapsed(), self.error))

    def gain(self):
        """How much the rooms amplify an error spread evenly: 1 / (1 - share of the light that is indirect)."""
        rho = self.scene.reflectance[self.field.node_surface]
        indirect, all_light = (rho * self.indirect).sum(), (rho * (self.lit + self.indirect)).sum()
        return 1.0 / max(1.0 - indirect / max(all_light, 1e-300), 1e-6)

    def gathered(self, points, normals, surface, tolerance):
        """Irradiance / pi (m, 3) at points: direct and indirect."""
        out = self.direct(points, normals, surface)
        gather = Gather(self.field, self.factors, self.reflectors)
        value = self.radiosity()
        for part, rows in gather.blocks(points, normals, surface, self.detail(), self.tolerance(surface, tolerance)):
            out[part] += rows @ value
        return out


def gmres(apply, right, guess, tolerance, most):
    """Solve x - apply(x) = right for (n, c) at once, each column for itself (Saad and Schultz 1986).

    Returns x, the steps taken and the greatest relative residual reached.
    """
    residual = right - guess + apply(guess)
    size = np.maximum(np.linalg.norm(right, axis=0), 1e-300)
    beta = np.linalg.norm(residual, axis=0)
    basis, columns = [residual / np.where(beta > 0, beta, 1.0)], []
    left, weights = beta, np.zeros((0, len(beta)))
    while len(columns) < most and (left > tolerance * size).any():
        v = basis[-1] - apply(basis[-1])
        column = []
        for b in basis:
            column.append(np.einsum("nc,nc->c", b, v))
            v = v - column[-1] * b
        column.append(np.linalg.norm(v, axis=0))
        columns.append(column)
        basis.append(v / np.where(column[-1] > 1e-300, column[-1], 1.0))
        weights, left = _least_squares(columns, beta)
    x = guess + sum((w * b for w, b in zip(weights, basis)), np.zeros_like(guess))
    return x, len(columns), float((left / size).max())


def _least_squares(columns, beta):
    """Minimise |beta e1 - H w| for each channel -> w (k, c), residuals (c,)"""
    k = len(columns)
    w, left = np.zeros((k, len(beta))), np.zeros(len(beta))
    for c in range(len(beta)):
        h = np.zeros((k + 1, k))
        for j, column in enumerate(columns):
            h[: j + 2, j] = [value[c] for value in column]
        right = np.zeros(k + 1)
        right[0] = beta[c]
        w[:, c] = np.linalg.lstsq(h, right, rcond=None)[0]
        left[c] = np.linalg.norm(right - h @ w[:, c])
    return w, left


def solve_steps(scene, target_error=1e-2, time_limit=None):
    """Generator of Progress at least ten times a second; returns the Solution. Closing it cancels.

    target_error: of the radiance, relative L2 over all surfaces, of L - Le. time_limit: seconds, None for none.
    """
    _check(scene, target_error, time_limit)
    state, best = _State(scene), None
    state.grow()
    for target in _ladder(target_error):
        for _ in range(MAX_ROUNDS):
            for _ in _round(state, target):
                yield Progress(_fraction(state, target_error), state.error, state.elapsed())
                if best and _late(state, time_limit):
                    return _finish(best, state, target_error)
            best = Solution(state)
            if state.error <= target or _late(state, time_limit) or not _refine(state, target):
                break
        if state.error <= target_error or _late(state, time_limit):
            break
    return _finish(best, state, target_error)


def solve(scene, target_error=1e-2, time_limit=None, progress=None):
    """Solution of the scene; progress(fraction, error, seconds) is called at least ten times a second."""
    steps = solve_steps(scene, target_error, time_limit)
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        if progress is not None:
            progress(*step)


def _check(scene, target_error, time_limit):
    if not isinstance(scene, Scene):
        raise SceneError(f"solve needs a Scene, not {scene!r}")
    if not (np.isfinite(target_error) and target_error > 0):
        raise SceneError(f"target_error is {target_error!r}; use a number above 0 such as 0.01")
    if time_limit is not None and not time_limit > 0:
        raise SceneError(f"time_limit is {time_limit!r}; use seconds above 0, or None for no limit")


def _ladder(target_error):
    """Targets of the rounds: coarse ones first, so that there is always something to deliver."""
    steps = max(0, int(np.ceil(np.log(COARSEST / target_error) / np.log(STEP))))
    return [target_error * STEP**k for k in range(steps, -1, -1)]


def _late(state, time_limit):
    return time_limit is not None and state.elapsed() > time_limit


def _fraction(state, target_error):
    """How much is done, from the error: time grows about as its logarithm's exponential, so this is a rough guide."""
    if not np.isfinite(state.error) or state.error <= 0:
        return 0.0
    return float(np.clip(target_error / state.error, 0.0, 1.0))


def _finish(solution, state, target_error):
    solution.seconds = state.elapsed()
    if solution.error > target_error:
        solution.warnings.append(f"stopped at an estimated error of {solution.error:.2g} before {target_error:.2g}")
    return solution


def _round(state, target):
    """Rows at all nodes to this round's tolerance, the solve, the estimate; yields now and then."""
    f = state.field
    state.measure()
    state.link_tolerance = LINK_SHARE * target * state.level
    operator = np.zeros((len(f.keys), len(f.keys)))
    if len(state.reflectors) and state.norm > 0:
        gather = Gather(f, state.factors, state.reflectors)
        tolerance = state.tolerance(f.node_surface, state.link_tolerance)
        for part, rows in gather.blocks(f.points, f.normals, f.node_surface, state.detail(), tolerance):
            operator[part] = rows
            yield
        state.counts["links"] += gather.links
    state.operator = operator
    state.solve(SOLVER_SHARE * target)
    yield
    state.measure()
    state.conformed = f.conform(state.indirect)
    yield from state.estimate(target)


def _refine(state, target):
    """Split the leaves that hold most of the estimated error; False where nothing is left to split."""
    f = state.field
    leaves = f.leaves
    part = state.leaf_error[leaves] ** 2
    seen = state.error_parts.get("discretisation", 0.0) * state.norm  # the residual knows better than the surplus
    part *= max(1.0, seen**2 / max(part.sum(), 1e-300))
    order = np.argsort(-part)
    rest = part.sum() - np.cumsum(part[order])
    allowed = (REFINE_TO * target * state.norm) ** 2
    count = int(np.searchsorted(-rest, -allowed)) + 1
    chosen = leaves[order[:count]]
    chosen = chosen[(part[order[:count]] > 0) & (f.level[chosen] < DEEPEST)]
    if not len(chosen) or len(f.keys) + 16 * len(chosen) > MAX_NODES:
        state.warnings.append("the field is as fine as memory allows") if len(chosen) else None
        return False
    f.refine(chosen)
    state.grow()
    return True


def _relit(old, scene):
    """Solution of old's shapes under other light, from its stored rows and factors."""
    same = len(scene) == len(old.scene) and all(
        a.shape is b.shape and a.side == b.side for a, b in zip(scene.surfaces, old.scene.surfaces)
    )
    if not same:
        raise SceneError("relight needs the same shapes and sides in the same order; solve the new scene instead")
    new = np.setdiff1d(np.flatnonzero((scene.reflectance > 0).any(axis=1)), old.reflectors)
    if len(new) or ((scene.background > 0).any() and not old.background):
        raise SceneError("relight knows no light from surfaces that were black or a background that was dark; solve again")
    state = copy.copy(old)
    state.scene, state.started, state.counts, state.history = scene, time.perf_counter(), Counter(), []
    state.warnings = []
    state.light = np.concatenate([scene.emission[old.lights], scene.background[None]])
    state.added = scene.emission.copy()
    state.added[old.lights] = 0.0
    state.lit = state.fractions @ state.light
    state.solve(1e-2 * old.error)
    state.measure()
    state.conformed = state.field.conform(state.indirect)
    for _ in state.estimate(old.error):
        pass
    return Solution(state)
