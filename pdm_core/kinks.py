"""Curves on a plane where factors from it have kinks, and rules that are broken there."""

import numpy as np

from .coincident import apart
from .numerics import gauss_legendre

CURVES = 64  # most kinks of one surface that the rule is broken at
SAME = 1e-9  # difference of curves, and of breaks between them, that counts as none


def kinks(scene, row, targets, hidden):
    """Coefficients (c, 6) of s^2, s t, t^2, s, t, 1 of the curves where factors from a plane at (s, t) have kinks.

    None where not all of them are known: on spheres, behind planes, of balls that are hidden; or there are too many.
    """
    plane, found = scene.surfaces[row].shape, []
    if not plane.is_rectangle or not (hidden >= 0).any():
        return None
    for target, occluders in zip(targets, hidden):
        shape = scene.surfaces[target].shape
        for k in occluders[occluders >= 0]:
            if not shape.is_flat or scene.shapes[k].is_flat:
                return None
            found += _touching(plane, shape.corners, scene.shapes[k])
    curves = np.array(found)
    size = np.abs(curves).max(axis=1)
    curves = curves[size > 0] / size[size > 0, None]
    curves *= np.sign(curves[np.arange(len(curves)), np.abs(curves).argmax(axis=1)])[:, None]
    curves = curves[np.unique(np.round(curves / SAME), axis=0, return_index=True)[1]]
    return curves if len(curves) <= CURVES else None


def _touching(plane, corners, ball):
    """Curves on which the ball, seen from the plane, touches the lines through the corners' edges, and the corners.

    In the ball's own space: the plane through x and an edge p + k d is at distance 1, with N = d x (x - p) and
    (N . p)^2 = N^2; the line through x and the corner p is, (x x p)^2 = (p - x)^2.
    """
    x = (np.stack([plane.origin - ball.origin, plane.u, plane.v])) @ ball.inverse.T  # coefficients of 1, s, t
    p = (corners - ball.origin) @ ball.inverse.T
    curves = []
    for here, following in zip(p, np.roll(p, -1, axis=0)):
        away = x - np.array([here, 0 * here, 0 * here])
        normal = np.cross(following - here, away)
        curves.append(_square(normal @ here[:, None]) - _square(normal))
        curves.append(_square(np.cross(x, here)) - _square(away))
    return curves


def _square(form):
    """The squared length of a form (3, k), coefficients of 1, s, t -> those of s^2, s t, t^2, s, t, 1."""
    one, s, t = form
    return np.array([s @ s, 2 * s @ t, t @ t, 2 * one @ s, 2 * one @ t, one @ one])


def _roots(a, b, c):
    """Real roots (2, ...) of a x^2 + b x + c; nan where there are none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = b * b - 4 * a * c
        inner = np.where(np.abs(inner) < 1e-13 * (b * b + np.abs(4 * a * c)), 0.0, inner)
        q = -(b + np.where(b < 0, -1.0, 1.0) * np.sqrt(np.where(inner >= 0, inner, np.nan))) / 2
        flat = np.abs(a) < 1e-13
        return np.stack([np.where(flat, np.nan, q / a), np.where(flat, -c / b, c / q)])


def broken_rule(curves, points):
    """Gauss rule on the unit square between the curves: nodes (n, 2), weights (n,) that sum to 1.

    Lines of constant t are broken where they cross a curve; t where a curve has an extreme or meets a border.
    Towards the breaks s - s0 goes as u^2, which makes powers of 3/2 smooth.
    """
    a, b, c, d, e, f = curves.T
    u, w = gauss_legendre(points)
    u, w = u * u * (3 - 2 * u), w * 6 * u * (1 - u)
    t = [
        _roots(c, e, f),
        _roots(c, b + e, a + d + f),
        _roots(b * b - 4 * a * c, 2 * b * d - 4 * a * e, d * d - 4 * a * f),
    ]
    t = np.concatenate([np.ravel(t), [0.0, 1.0]])
    t = apart(np.clip(t[np.isfinite(t)], 0.0, 1.0), SAME)
    width = np.diff(t)[:, None]
    t, weight = (t[:-1, None] + width * u).ravel(), (width * w).ravel()
    s = _roots(a[:, None] + 0 * t, b[:, None] * t + d[:, None], (c[:, None] * t + e[:, None]) * t + f[:, None])
    s = np.clip(np.nan_to_num(s.reshape(-1, len(t)), posinf=0.0, neginf=0.0), 0.0, 1.0)
    s = np.sort(np.concatenate([s, np.zeros((1, len(t))), np.ones((1, len(t)))]), axis=0)
    part, line = np.nonzero(np.diff(s, axis=0) > 0)
    low, width = s[part, line][:, None], np.diff(s, axis=0)[part, line][:, None]
    nodes = np.stack([(low + width * u).ravel(), np.repeat(t[line], points)], axis=1)
    return nodes, (weight[line][:, None] * width * w).ravel()
