"""Which boxes come near each other, and which parallelograms in one plane overlap."""

import numpy as np

from .at_once import later


def near(low, high, tolerance):
    """Index pairs (k,), (k,) of boxes low..high (n, 3) m that come within the tolerance of each other: a sweep along
    the axis in which the boxes are smallest."""
    if len(low) < 2:
        return np.zeros(0, int), np.zeros(0, int)
    spread = np.ptp(low, axis=0)
    axis = int(np.argmin(np.divide((high - low).sum(axis=0), spread, out=np.full(3, np.inf), where=spread > 0)))
    order = np.argsort(low[:, axis], kind="stable")
    low, high = low[order], high[order] + tolerance
    count = np.searchsorted(low[:, axis], high[:, axis], side="right") - np.arange(len(low)) - 1
    found = [np.zeros((2, 0), int)]
    for i, j in later(count):
        meet = ((low[j] <= high[i]) & (low[i] <= high[j])).all(axis=1)
        found.append(np.stack([i[meet], j[meet]]))
    i, j = order[np.concatenate(found, axis=1)]
    return np.minimum(i, j), np.maximum(i, j)


def overlap(corners, normal, i, j, tolerance):
    """(k,) Whether planes i, j (k,), in one plane each pair, overlap by more than the tolerance, corners (n, 4, 3) m,
    normal (n, 3): no edge parts them."""
    deep = np.ones(len(i), bool)
    for of in (i, j):
        for start, end in ((0, 1), (0, 3), (1, 2)):  # the last one matters for triangles
            axis = np.cross(corners[of, end] - corners[of, start], normal[of])
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            a, b = (np.einsum("kci,ki->kc", corners[k], axis) for k in (i, j))
            depth = np.minimum(a.max(axis=1) - b.min(axis=1), b.max(axis=1) - a.min(axis=1))
            deep &= depth > 2 * tolerance
    return deep
