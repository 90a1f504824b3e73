"""The solution to a stated error: by links between cells, or by bundles of rays, as the scene asks for."""

from collections import namedtuple
from functools import partial

import numpy as np

from .checked import function, number, of_kind, target_of
from .choice import choose
from .links.approach import link_steps
from .links.solution import Solution
from .rays.solution import ray_steps
from .scene import Scene
from .signs_of_life import finish, mapped

__all__ = ["Progress", "Solution", "solve", "solve_steps"]


class Progress(namedtuple("Progress", "fraction error seconds")):
    """Of a solve. best: the Solution so far, or None; no part of the tuple."""

    best = None

    @classmethod
    def of(cls, target_error, error, seconds, best):
        known = np.isfinite(error) and error > 0  # a rough guide, as the cost of what is left is not known
        step = cls(float(np.clip(target_error / error, 0.0, 1.0)) if known else 0.0, error, seconds)
        step.best = best
        return step


def solve_steps(scene, target_error=1e-2, time_limit=None, enough=lambda: False):
    """Generator of Progress at least ten times a second; returns the Solution. Closing it cancels.

    target_error: of the radiance, relative L2 over all surfaces, of L - Le. time_limit: seconds, None for none.
    enough(): asked at every step; True ends with the best so far, once there is one. At the step that first tells of a
    better one nothing else is at work: it may be read before the next.
    """
    of_kind(scene, Scene, "solve")
    function(enough, "enough", "that tells whether to end")
    target_error = target_of(target_error)
    if time_limit is not None:
        time_limit = number(time_limit, "time_limit", "seconds above 0, or None for no limit", above=0)
    choice = choose(scene, target_error)
    steps = (ray_steps if choice.by_rays else link_steps)(scene, target_error, time_limit, choice.why, enough)
    solution = yield from mapped(steps, lambda now: Progress.of(target_error, *now))
    solution.anew = partial(solve, target_error=target_error, time_limit=time_limit)
    return solution


def solve(scene, target_error=1e-2, time_limit=None, progress=None):
    """Solution of the scene; progress(fraction, error, seconds) is called at least ten times a second."""
    if progress is not None:
        function(progress, "progress", "of (fraction, error, seconds), or None")
    steps = solve_steps(scene, target_error, time_limit)
    return finish(steps, progress and (lambda step: progress(*step)))
