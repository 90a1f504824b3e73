"""How long a tighter target would take, from how a solution converged."""

import numpy as np

from .checked import LEAST

# seconds go as the error to minus this, as the random rooms of tests/benchmarks/foretold.py do
USUAL = 0.9
POWERS = 0.5, 1.5  # what the power that the history itself shows may be; it counts as much
MORE = 1.45  # of what that gives: the last steps cost more, and so does an error that hangs on each surface


def seconds_to(history, target):
    """history [(seconds, error)] of a Solution -> seconds that a solution to the target may take; None where nothing
    is known. What was reached before is read off."""
    seconds, error = falling(history)
    if not len(error) or target < LEAST:
        return None
    if error[-1] <= target:
        return float(seconds[np.argmax(error <= target)])
    power = USUAL
    if len(error) > 1:
        seen = np.log(seconds[-1] / seconds[0]) / np.log(error[0] / error[-1])
        power = (np.clip(seen, *POWERS) + USUAL) / 2
    return float(MORE * seconds[-1] * (error[-1] / target) ** power)


def falling(history):
    """Seconds and errors (k,) of the entries that are better than all before."""
    rows = np.array([row for row in history if np.isfinite(row[1]) and row[1] > 0 and row[0] > 0]).reshape(-1, 2)
    best = np.minimum.accumulate(rows[:, 1]) if len(rows) else np.zeros(0)
    better = np.flatnonzero(np.append(np.inf, best[:-1]) > best) if len(best) else np.zeros(0, int)
    return rows[better, 0], rows[better, 1]
