"""Rounds towards a stated error: rows, the solve, where surpluses promise enough the check, and refinement."""

import time

import numpy as np

from ..checked import SceneError, some_of
from ..contacts import contacts_of
from ..deadline import ROUNDS, above_target, worked_on
from ..each_surface import OWN
from ..numerics import SOLVED
from ..plan import plan_by_links
from .check import Check
from .light import SolvedLight
from .refinement import Refinement
from .solution import Solution
from .transport import Transport

COARSEST = 0.16  # relative error aimed at by the first round
STEP = 4.0  # each further round aims at most this much lower
UNSEEN = 2  # rounds without a look, where there is nothing yet
SAMPLES = 128  # points where the residual is measured each round; half of them on the way to the target
FULL = "the field is as fine as the memory allows"
SMALLER = "leave small objects out of the scene (hide them from renders) or join flat ones into larger planes"


class Approach:
    """A solution by links on its way: `steps` refines until the target is met, `best` is what may be delivered."""

    def __init__(self, scene, target_error, why):
        self.scene, self.target, self.started = scene, target_error, time.perf_counter()
        self.transport = Transport(scene, plan_by_links(scene, target_error, why))
        self.light = SolvedLight(self.transport, self.transport.scene)
        self.check = Check(self.light)
        self.refinement = Refinement(self.check)
        self.best, self.history = None, []

    def elapsed(self):
        """s since the beginning"""
        return time.perf_counter() - self.started

    def steps(self):
        """Generator, often: ever lower targets, until the last is met or no better solution is to be had."""
        yield from self.transport.grow(self.transport.sent.halvings[:0])
        self.light.follow()
        for target, final in _ladder(self.target):
            if not (self.check.fresh and self.check.error <= target):
                yield from self.refinement.light_up(target, final)
            elif target > self.target:
                continue  # as good as that already
            else:  # but for some surface's own error
                yield from self.refinement.improve(target, True)
            yield from self._towards(target)
            if self.transport.full or self.check.met(self.target):
                return

    def _towards(self, target):
        """Rounds until this target is met, or nothing helps any more; yields."""
        check, last = self.check, target == self.target
        for turn in range(ROUNDS):
            if self.best and not self.transport.rows.blocks:
                self.best.let_go()
            # where the solver fails surpluses tell nothing: something is looked at before long, and may be delivered
            yield from self._round(target, turn == ROUNDS - 1 or (self.best is None and turn >= UNSEEN))
            if self.transport.full:
                return
            if check.fresh and check.error <= target and (not last or check.met(target)):
                return
            if (yield from self.refinement.improve(target, last)):
                continue
            if not check.fresh:  # nothing left to split although little was promised: measure what it is
                yield from self._measure(target)
            return

    def _round(self, target, last):
        """Rows at new nodes, the solve, and where the surpluses promise enough, the check; yields now and then."""
        yield from self.light.extend()
        if self.transport.full:
            return
        yield from self.light.solve(SOLVED * target)
        yield from self.light.divide(target)
        promised = self.check.promise()
        if last or promised <= target or self.transport.crowded:
            yield from self._measure(target)

    def _measure(self, target):
        """The error of the light at hand, the best unless an earlier one is better: out of memory, finer lights cost
        elsewhere; yields."""
        yield from self.check.measure(target, SAMPLES if target == self.target else SAMPLES // 2)
        self.history.append((self.elapsed(), self.check.error))
        if self.best is None or self._rank(self.check) <= self._rank(self.best._check):
            self.best = Solution(self.scene, self.check, self.history)
        yield

    def _rank(self, check):
        return max(check.error, self.target), check.misses()


def link_steps(scene, target_error, time_limit, why, enough=lambda: False):
    """Generator of (error, seconds, best so far); returns the Solution with its warnings. Closing it cancels."""
    approach, stopped = yield from worked_on(lambda: Approach(scene, target_error, why), time_limit, enough)
    solution = approach.best
    if solution is None:
        raise SceneError(f"{FULL} and nothing was reached; {SMALLER}")
    solution.seconds, solution.history = approach.elapsed(), list(approach.history)
    memory = approach.refinement.cramped or approach.transport.full
    missed = warnings_of(solution, memory, target_error, stopped)
    solution.warnings = [*contacts_of(approach.transport.scene).warnings, *missed]
    return solution


def warnings_of(solution, memory, target_error, stopped):
    """[sentence] of what was missed of the target; memory: whether its bound kept something from being refined;
    stopped: whether that ended before there was nothing left to try."""
    check, names = solution._check, [repr(surface.name) for surface in solution.scene.surfaces]
    if solution.error > target_error and check.parts.get("closure", 0.0) > target_error:
        worst = np.argsort(-check.amplified.unclosed)[:2]
        advice = (
            f"light comes from nothing or is lost where {' and '.join(names[k] for k in worst)} run through others: "
            f"neither time nor memory helps; part or join them, or aim at {125 * solution.error:.2g} %"
        )
        return [above_target(solution.error, target_error, advice)]
    if solution.error > target_error:
        more = "raise the time limit or the" if stopped else "finer cells hardly help; raise the"
        advice = f"{'raise the' if memory else more} target error"
        return [FULL] * memory + [above_target(solution.error, target_error, advice)]
    dark = np.flatnonzero(check.own.too_large(target_error))
    if not len(dark):
        return []
    named = some_of([f"{names[k]} {100 * solution.surface_errors[k]:.2g} %" for k in dark])
    return [
        f"Of their own light, dark surfaces are off by more than {OWN:g} times the target ({named}); "
        f"{'raise the time limit or ' * stopped}lower the target error"
    ]


def _ladder(target_error):
    """Targets of the rounds, coarse ones first so that there is always something to deliver, and of their links: two
    rounds share them, so that the rows of the first serve the second."""
    steps = max(1, int(np.ceil(np.log(COARSEST / target_error) / np.log(STEP) - 0.01)))
    return [(target_error * STEP**k, target_error * STEP ** (k - k % 2)) for k in range(steps, -1, -1)]
