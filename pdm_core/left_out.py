"""What leaving out saves: solutions with one thing done that the plan leaves out, to be timed; for reports alone."""

import time

import numpy as np

from .radiosity import _approach, _Best, _State


class _AllChannels(_State):
    """Every colour channel is solved, though some are multiples of others."""

    def channels(self):
        return np.arange(3), np.eye(3)


class _Dark(_State):
    """Surfaces that no light reaches are looked at as the others are."""

    def __init__(self, scene, target_error):
        super().__init__(scene, target_error)
        self.reached = np.ones(len(scene), bool)


class _NoSum(_State):
    """Every hidden factor is worked out, though their sum is known where walls enclose a point."""

    def __init__(self, scene, target_error):
        super().__init__(scene, target_error)
        self.factors.shafts.sum_tells = lambda senders: False


ITEMS = {  # of plan.counts: what is left out where it is so
    "colour channels that are multiples of others": (_AllChannels, lambda counts: counts["channels"] < 3),
    "surfaces that no light reaches": (_Dark, lambda counts: counts["dark"] > 0),
    "the factor that the sum of all tells": (_NoSum, lambda counts: counts["sum tells"]),
}


def left_out(plan):
    """[what] of ITEMS that the Plan leaves out."""
    return [what for what, (_, is_so) in ITEMS.items() if is_so(plan.counts)]


def seconds_steps(scene, target_error, what=None):
    """Generator of signs of life; returns the seconds of a solution that does `what` of ITEMS all the same, or, None,
    nothing of it, and its estimated error."""
    start = time.perf_counter()
    state = (ITEMS[what][0] if what else _State)(scene, target_error)
    for _ in _approach(state, _Best(None, target_error), target_error):
        yield
    return time.perf_counter() - start, state.error
