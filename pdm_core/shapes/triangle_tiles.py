"""What is made of triangles in parts no longer than is asked for."""

import numpy as np

from .shape import tile_counts

MOST, WIDER = 64, 1.2  # parts of what shines, each a lamp; times as long each as long as they would be more
SMALL = 0.1  # of a part: shorter triangles are of that in which their middle is


def tiles_of(corners, length):
    """[(k, 3, 3)] of triangles (t, 3, 3) m, cut into cubes of at most so many m, or so many that they are MOST."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    while True:
        number = tile_counts(high - low, length)
        size = np.maximum(high - low, 1e-300) / number
        part = np.unique(_cells(corners, low, size, number), axis=0)
        if len(part) <= MOST:
            break
        length *= WIDER
    long = (np.ptp(corners, axis=1) > SMALL * size).any(axis=1)
    small, corners = corners[~long], corners[long]
    for axis in range(3):
        for k in range(1, int(number[axis])):
            corners = _across(corners, axis, low[axis] + k * size[axis])
    corners = np.concatenate([small, corners])
    part = np.unique(_cells(corners, low, size, number), axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(part, kind="stable")
    return np.split(corners[order], np.flatnonzero(np.diff(part[order])) + 1)


def _cells(corners, low, size, number):
    """(t, 3) which cube each triangle's middle is in."""
    return np.clip((corners.mean(axis=1) - low) // size, 0, number - 1)


def _across(corners, axis, at):
    """Triangles (t, 3, 3) m in parts on one side each of the plane where a coordinate is `at`."""
    height = corners[:, :, axis] - at
    above = height > 0
    number = above.sum(axis=1)
    cut = np.flatnonzero((number == 1) | (number == 2))
    alone = np.where(number == 1, above.argmax(axis=1), above.argmin(axis=1))[cut]
    (a, b, c), (ha, hb, hc) = ([of[cut, (alone + k) % 3] for k in range(3)] for of in (corners, height))
    p, q = a + (ha / (ha - hb))[:, None] * (b - a), a + (ha / (ha - hc))[:, None] * (c - a)
    new = [np.stack(three, axis=1) for three in ((a, p, q), (p, b, c), (p, c, q))]
    new = np.concatenate([np.delete(corners, cut, axis=0), *new])
    return new[np.linalg.norm(np.cross(new[:, 1] - new[:, 0], new[:, 2] - new[:, 0]), axis=1) > 0]
