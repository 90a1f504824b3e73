"""Where planes cross the outlines of ellipsoids: roots of a0 + a1 cos f + a2 sin f, one for each plane and outline."""

import numpy as np

from .closed_forms import divide
from .tolerances import TINY

TURN = 2 * np.pi
LEAVE_ENTER = np.array([1.0, -1.0])  # which way an outline crosses a plane


def levels(conic, planes):
    """Coefficients (3, k, m) of planes . r(f) = a0 + a1 cos f + a2 sin f, planes (3, k, m)"""
    return np.stack([np.einsum("im,ikm->km", k, planes) for k in conic])


def crosses(a):
    """Whether a0 + a1 cos f + a2 sin f, a (3, ...), changes its sign (...)"""
    rho2 = a[1] * a[1] + a[2] * a[2]
    # a sliver too thin for its ends to be told apart is none: it would hold less than TINY ** 1.5
    return rho2 - a[0] * a[0] > TINY * rho2


def crossings(a):
    """(cos f, sin f) (2, ...) on leaving the positive side of a0 + a1 cos f + a2 sin f, a (3, ...), and on entering."""
    a0, a1, a2 = a
    rho2 = a1 * a1 + a2 * a2
    root = np.sqrt(np.maximum(rho2 - a0 * a0, 0.0)) * LEAVE_ENTER.reshape(2, *(1,) * a0.ndim)
    return divide(-a0 * a1 - a2 * root, rho2), divide(-a0 * a2 + a1 * root, rho2)


def positive(a):
    """The arc [start, end] (m,), (m,) where a0 + a1 cos f + a2 sin f is positive, a (3, m)"""
    a0, a1, a2 = a
    half = np.arctan2(np.sqrt(np.maximum(a1 * a1 + a2 * a2 - a0 * a0, 0.0)), -a0)
    middle = np.arctan2(a2, a1)
    return middle - half, middle + half
