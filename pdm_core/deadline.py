"""How long a solution is worked on, and what is said where its target was not met: the same by links and by rays."""

import time

from .checked import SceneError
from .signs_of_life import in_thread, mapped

ROUNDS = 12  # of refinement at most, of links towards each of their targets
GRACE = 0.1, 0.15  # of the time limit, and s, for a first solution: then it is said that there is none


def worked_on(make, time_limit, enough):
    """Generator of (error, seconds, best so far); returns the approach that make() is, once its steps are done, and
    whether the time limit, or enough(), has ended them before. Closing it cancels."""
    begun = time.perf_counter()
    approach = yield from mapped(in_thread(make), lambda _: (float("inf"), time.perf_counter() - begun, None))
    for _ in approach.steps():
        yield approach.check.error, approach.elapsed(), approach.best
        has_solution = approach.best is not None
        if is_over(time_limit, approach.elapsed(), has_solution) or (has_solution and bool(enough())):
            return approach, True
    return approach, False


def is_over(limit, elapsed, has_solution):
    """Whether a time limit (s, None for none) is over and there is something to deliver; SceneError where there is
    still nothing long after."""
    late = 0.0 if limit is None else elapsed - limit
    if late > 0 and has_solution:
        return True
    if late > 0 and late > GRACE[0] * limit + GRACE[1]:
        raise SceneError(
            f"time_limit: nothing was reached within {limit:.3g} s; raise the time limit or the target error"
        )
    return False


def above_target(error, target, advice):
    """The warning that an estimated error is above the target."""
    return f"The estimated error is {100 * error:.2g} %, above the target of {100 * target:.2g} %; {advice}"
