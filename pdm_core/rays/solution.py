"""What is read off a solution by rays, and the loop that makes it."""

import copy
from itertools import count

import numpy as np

from ..at_once import AT_ONCE, slices
from ..checked import LEAST, SceneError, some_of
from ..deadline import ROUNDS, above_target, worked_on
from ..plan import plan_by_rays
from ..read_off import ReadOff, Unseen, oriented
from ..signs_of_life import finish, mapped
from .bundles import Receivers
from .check import Check
from .engine import RayState
from .idle import idle_of
from .kept import KeptRays, check_light
from .placed import read_places
from .refinement import excess_of, fewer_directions, improve
from .rims import closed
from .where import nodes_near

LEAST_GAIN, POOR = 0.05, 2  # of the error in a round; rounds in a row that gain less: more would not help
POWER = 0.6  # of seconds: small scenes of boxes and balls were foretold within a factor of 2 by it


class RaySolution(ReadOff):
    """Radiance everywhere on the scene's surfaces, as pdm_core.Solution; by rays."""

    def __init__(self, check, plan, history=()):
        state = copy.copy(check.state)  # arrays are replaced as it grows on, never written into
        state.lit = copy.copy(state.lit)
        self._check, self._state = copy.copy(check), state
        self._check.state = state
        self.scene, self.plan, self.counts = state.scene, plan, dict(state.counts)
        self.error, self.error_parts, self.surface_errors = check.error, dict(check.parts), check.surface_errors
        self.norm, self.surface_norms, self.nodes = state.norm, state.surface_norms, len(state.nodes)
        self.seconds, self.history, self.warnings = state.elapsed(), list(history), []

    def incident_steps(self, surface, points, normals=None, inward=None, roughly=False):
        """Irradiance / pi (n, 3) at points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        out, n = np.empty((len(points), 3)), max(len(points), 1)
        # as many as facets, which are projected anew for each part
        for part in slices(len(points), max(AT_ONCE, self._state.facets.count)):
            own = [None if a is None else a[part] for a in (normals, inward)]
            receivers = read_places(self._state.facets, surface[part], points[part], *own)
            share = len(receivers) / n
            out[part] = yield from mapped(
                self._read(receivers, roughly), lambda done, begun=part.start / n, share=share: begun + share * done
            )
        return np.maximum(out, 0.0)

    def _read(self, receivers, roughly):
        """Irradiance / pi (n, 3) at receivers: generator of the fraction done."""
        bundles, usual = count(1), 2 * self._state.read

        def fraction(_):
            done = next(bundles)
            return done / (done + usual)

        return (yield from mapped(self._state.incident(receivers, roughly), fraction))

    def held_steps(self, surface, points):
        """Irradiance / pi (n, 3), see ReadOff: generator of the fraction done."""
        node = yield from nodes_near(self._state.nodes, surface, points)
        return np.append(self._state.received, np.zeros((1, 3)), axis=0)[node]  # of no node, -1: none

    def estimated_error_steps(self, surface, points):
        """(n,) at points (n, 3) m of surfaces (n,), see estimated_error: generator of the fraction done."""
        nodes, surfaces = self._state.nodes, len(self.scene)
        node = yield from nodes_near(nodes, surface, points)
        error = self._check.node_error + 1e-300
        total, square = (
            np.bincount(nodes.surface, nodes.weight * e, surfaces) for e in (np.ones(len(error)), error**2)
        )
        own = self.surface_errors * self.surface_norms / np.sqrt(self.scene.areas)
        share = np.where(node >= 0, error[node] if len(error) else 1.0, 1.0)
        rms = np.sqrt(square / np.maximum(total, 1e-300))[surface]
        return own[surface] * np.where(node >= 0, share / np.maximum(rms, 1e-300), 1.0)

    def seconds_to(self, target):
        """See ReadOff. What it takes goes by the error and, once more, by that of cells: rays become more at once as
        they are needed, cells smaller in many rounds."""
        usual = super().seconds_to(target)
        if target < LEAST or self.error <= target or not self.history:
            return usual
        cells = max(excess_of(self.error_parts, target)["sent"], 1.0)
        return self.history[-1][0] * float(self.error / target * cells) ** POWER

    def irradiance(self, points, normals):
        """points (n, 3) m, normals (n, 3) of any length but 0, anywhere in space -> irradiance / pi (n, 3)"""
        points, normals = oriented(points, normals)
        n = len(points)
        start = np.full(n, self._state.facets.tolerance)
        free = Receivers(points - self._state.facets.centre, normals, np.full(n, -1), start, np.zeros(n, bool))
        return np.maximum(finish(self._state.incident(free)), 0.0)

    def relit(self, scene):
        """See relight; Unseen where that does not tell."""
        return _relit(self._check, self.plan, scene)

    def kept_steps(self, surface, points, normals=None, inward=None):
        """Kept of points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        kept = KeptRays(self._state, surface, points)
        yield from kept.steps(self._state, normals, inward)
        return kept


class RayApproach:
    """A solution by rays on its way: `steps` refines until the target is met, `best` is what may be delivered."""

    def __init__(self, scene, target_error, reason):
        self.state, self.target = RayState(scene, target_error), target_error
        self.check, self.plan = Check(self.state), plan_by_rays(scene, target_error, reason)
        self.best, self.history = None, []

    def elapsed(self):
        """s since the beginning"""
        return self.state.elapsed()

    def steps(self):
        """Generator with a sign of life a bundle."""
        state, check, poor = self.state, self.check, 0
        yield from state.extend(np.full(len(state.nodes), -1))
        for turn in range(ROUNDS):
            yield from state.solve()
            yield from check.measure()
            self.history.append((state.elapsed(), check.error))
            before = self.history[-2][1] if turn else np.inf
            # finer cells may show what nobody knew: no sign that more would not help
            poor = poor + 1 if abs(before - check.error) < LEAST_GAIN * before else 0
            if self.best is None or check.error <= self.best.error:
                self.best = RaySolution(check, self.plan)
                yield  # while no thread is at work
            if check.error <= self.target:
                yield from self._read_by_fewer()
                return
            if turn == ROUNDS - 1 or poor == POOR:
                return
            if not (yield from improve(check)):
                return

    def _read_by_fewer(self):
        """The best with as many directions where colours are read as the target asks for; yields."""
        fewer = fewer_directions(self.check)
        if fewer is None:
            return
        state = copy.copy(self.state)
        state.read = fewer
        check = copy.copy(self.check)
        check.state = state
        yield from check.measure()
        if check.error <= self.target:
            self.check, self.best = check, RaySolution(check, self.plan)
            self.history.append((self.elapsed(), check.error))


def ray_steps(scene, target_error, time_limit, why, enough=lambda: False):
    """Generator of (error, seconds, best so far); returns the RaySolution with its warnings. Closing it cancels."""
    approach, stopped = yield from worked_on(lambda: RayApproach(scene, target_error, why), time_limit, enough)
    solution = approach.best
    solution.seconds, solution.history = approach.elapsed(), list(approach.history)
    if idle := idle_of(solution._state):  # not of nodes that are being added
        named = some_of(list(map(repr, idle)))
        one, many = ("lights", "it looks and what hides it"), ("light", "they look and what hides them")
        verb, looked = one if len(idle) == 1 else many
        solution.warnings.append(
            f"{named} {verb} no surface that reflects, or only places too small to be sent on; check where {looked}"
        )
    solution.warnings += closed(solution._state.facets)
    if solution.error > target_error:
        advice = "raise the time limit or the" if stopped else "finer rays hardly help; raise the"
        solution.warnings.append(above_target(solution.error, target_error, f"{advice} target error"))
    return solution


def same_light(a, b):
    """Whether two lights differ in name and colour alone, and in what they are linked to."""
    described = (vars(a).keys() & vars(b).keys()) - {"name", "colour", "receivers", "blockers"}
    return type(a) is type(b) and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in described)


def _same_links(one, other):
    """Whether the lights of two Scenes are linked to the same surfaces."""
    lamps = list(zip(one.lights, other.lights))
    pairs = [(a.receivers, b.receivers) for a, b in lamps] + [(a.blockers, b.blockers) for a, b in lamps]
    return all((one.of_shapes(a) == other.of_shapes(b)).all() for a, b in pairs if not a is b is None)


def _relit(check, plan, scene):
    old = check.state
    check_light(old.scene, old.reflects, scene)
    same = all(same_light(a, b) for a, b in zip(scene.lights, old.scene.lights))
    if not (same and _same_links(scene, old.scene)):
        raise SceneError("relight changes the colours of lights alone; where one is moved or resized, solve again")
    if scene.background.any() and not old.scene.background.any():
        raise Unseen("relight: the background was dark and now sends light; solve again")
    state = copy.copy(old)
    state.take_light(scene)
    finish(state.solve())
    check = check.under(state)
    finish(check.measure())
    return RaySolution(check, plan, [(state.elapsed(), check.error)])
