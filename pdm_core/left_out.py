"""What leaving out saves: solutions with one thing done that the plan leaves out, to be timed; for reports alone."""

import time

import numpy as np

from .links.approach import Approach

ITEMS = {  # of plan.counts: what is done all the same, and what is left out where it is so
    "colour channels that are multiples of others": (
        lambda approach: setattr(approach.light, "channels", (np.arange(3), np.eye(3))),
        lambda counts: counts["channels"] < 3,
    ),
    "surfaces that no light reaches": (
        lambda approach: setattr(approach.transport, "reached", np.ones(len(approach.scene), bool)),
        lambda counts: counts["dark"] > 0,
    ),
}


def left_out(plan):
    """[what] of ITEMS that the Plan leaves out."""
    return [what for what, (_, is_so) in ITEMS.items() if is_so(plan.counts)]


def approach_with(scene, target_error, what):
    """The Approach that does `what` of ITEMS all the same, or, None, nothing of it."""
    approach = Approach(scene, target_error, "")
    if what:
        ITEMS[what][0](approach)
    return approach


def seconds_steps(scene, target_error, what=None):
    """Generator of signs of life; returns the seconds of a solution that does `what` of ITEMS all the same, or, None,
    nothing of it, and its estimated error."""
    start = time.perf_counter()
    approach = approach_with(scene, target_error, what)
    yield from approach.steps()
    return time.perf_counter() - start, approach.check.error
