"""Vertices that nobody sees, below what stands on their surface or within it: black, they would darken all of the faces
that reach out from there. They get the mean colour of those corners of the same faces that are seen."""

from dataclasses import replace

import numpy as np

from ...pdm_core.rays.covered import unseen
from ...pdm_core.signs_of_life import in_thread, mapped
from .bake_points import joined


def stand_in_steps(solution, targets, points, values, looks, here):
    """Generator of the fraction done; returns the BakePoints `points` of the targets with what they are lent, and
    [(n,) bool] whether the places of each Look are seen.

    values [(k, 3)] at the points and here [(n, 3)] at the places of the looks: what is not black is seen.
    """
    light = np.concatenate([*values, *here])
    hidden, dark = np.zeros(len(light), bool), np.flatnonzero(~light.any(axis=1))
    if len(dark):
        places = (np.concatenate(part)[dark] for part in zip(joined(points), *(look.places() for look in looks)))
        hidden[dark] = yield from mapped(in_thread(unseen, solution, *places), lambda _: 0.0)
    parts = np.split(hidden, np.cumsum([len(value) for value in (*values, *here)])[:-1])
    lent = [
        replace(p, lent=_lent(p, target.base.counts, own))
        for target, p, own in zip(targets, points, parts[: len(points)], strict=True)
    ]
    return lent, [~own for own in parts[len(points) :]]


def _lent(points, counts, hidden):
    """(2, e) pairs of BakePoints that are hidden, (k,) bool, and those seen in the same faces, of so many corners
    (p,) each, on the same surface; None where there are none."""
    corners = np.flatnonzero(hidden[points.scatter])
    face = np.repeat(np.arange(len(counts)), counts)[corners]
    many = counts[face]
    first = np.cumsum(counts)[face] - many
    beside = np.repeat(first - np.cumsum(many) + many, many) + np.arange(many.sum())
    to, of = points.scatter[np.repeat(corners, many)], points.scatter[beside]
    surfaces = points.surfaces
    lends = ~hidden[of] & (surfaces[of] == surfaces[to])
    return np.stack([to, of])[:, lends] if lends.any() else None
