"""Exact occlusion: what an oriented point receives from a source behind any number of convex occluders.

Seen from the point every convex source S and every occluder O is a convex region of directions. The visible region S
minus the union of the O has as boundary the pieces of S's boundary outside all O, and the pieces of each O's boundary
inside S and outside all other O; the form factor is the contour integral n . sum of integral r x dr / (2 pi) over them.
"""

import numpy as np

from .at_once import CACHED, parts
from .closed_forms import cross, divide, dot
from .numerics import gauss_legendre
from .region_crossings import (
    BOTH,
    INNER,
    OUTER,
    arcs_in_cones,
    edges_in_planes,
    edges_in_polygons,
    gaps,
    gaps_of_turn,
    joined,
    planes_and_balls,
)
from .sinusoids import TURN
from .tolerances import FAINT

CONIC_POINTS, CONIC_PARTS = 16, 4  # Gauss rule for arcs of elliptic cones, per part of a piece


def _along_edges(n, region, start, end, hidden):
    """Contour integral (m,) over the parts [start, end] (e, m) of the regions' edges outside the hidden intervals."""
    p, d = region.p, region.q - region.p
    c = cross(p, region.q)
    length, dd = np.sqrt(dot(c, c)).ravel(), dot(d, d)
    height = dot(n[:, None], region.planes)[region.on].ravel()
    row, a, b = gaps(start.ravel(), np.where(dd > 0, end, -1.0).ravel(), *hidden)
    p, d = (r.reshape(3, -1).take(row, axis=1) for r in (p, d))
    # between the ends themselves: of edges that end close by what is left of squares of their lengths is rounding
    angle = np.arctan2((b - a) * length[row], dot(p + a * d, p + b * d))
    return np.bincount(row % n.shape[1], angle * height[row], minlength=n.shape[1])


def _along_outlines(n, balls, hidden):
    """Contour integral (m,) over the balls' outlines outside the hidden arcs; n (3, m)."""
    row, f0, f1 = gaps_of_turn(n.shape[1], *hidden)
    nu, nv, na = (balls.sin * dot(n, k) for k in (balls.u, balls.v, balls.axis))
    wave = (np.cos(f1) - np.cos(f0)) * nv[row] - (np.sin(f1) - np.sin(f0)) * nu[row]
    value = balls.cos[row] * wave + (balls.sin * na)[row] * (f1 - f0)
    odd = np.nonzero(~balls.round[row])[0]
    if len(odd):
        value[odd] = _conic_integral(n[:, row[odd]], balls.conic[:, :, row[odd]], f0[odd], f1[odd])
    return np.bincount(row, value, minlength=n.shape[1])


def _conic_integral(n, conic, f0, f1):
    """n . integral of r x dr / |r|^2 (m,) over outlines conic (3, 3, m) from angle f0 to f1 (m,)"""
    nodes, weights = gauss_legendre(CONIC_POINTS)
    k0, k1, k2 = conic
    # n . (r x r') is a trigonometric polynomial: n . (k0 x k1), (k0 x k2), (k1 x k2)
    n01, n02, n12 = dot(n, cross(k0, k1)), dot(n, cross(k0, k2)), dot(n, cross(k1, k2))
    step, total = (f1 - f0) / CONIC_PARTS, np.zeros_like(f0)
    for part in range(CONIC_PARTS):
        f = f0 + step * (part + nodes[:, None])
        cos, sin = np.cos(f), np.sin(f)
        r = k0[:, None] + k1[:, None] * cos + k2[:, None] * sin
        total += step * (weights @ ((n12 - n01 * sin + n02 * cos) / dot(r, r)))
    return total


def _noise(region, tolerance):
    """(m,) What moving the corners of polygons by tolerance may change of the integrals along their edges."""
    p, q = region.p, region.q
    c = cross(p, q)
    length, reach = np.sqrt(dot(c, c)), np.minimum(dot(p, p), dot(q, q))
    turn = divide(np.sqrt(np.maximum(dot(p, p), dot(q, q))), length) * np.arctan2(length, dot(p, q))
    return tolerance * (turn + divide(1.0, np.sqrt(reach))).sum(axis=0)


def visible_integral(n, source, occluders, rounding):
    """Contour integral over 2 pi (m,) along the boundary of what is visible of the sources; n (3, m) unit normals.

    rounding m: of differences of coordinates; what it may have made of nothing is 0.
    """
    m, o = n.shape[1], occluders
    every, polygon, ball = np.arange(m), np.arange(len(o.polygon_of)), np.arange(len(o.ball_of))
    # what is hidden of each boundary: of sources by occluders, of occluders by each other and what is not the source
    edges, outside = planes_and_balls(source, o.ball_of, o.balls, ball)
    source_edges = [edges, edges_in_polygons(source, o.polygon_of, o.polygons, polygon, INNER)]
    outlines, source_outlines, polygon_edges = [outside], [], []
    planes, tilt = source.planes.take(o.polygon_of, axis=2), source.tilt.take(o.polygon_of, axis=1)
    low, high = edges_in_planes(o.polygons.edges(polygon), planes, tilt, BOTH)
    if source.balls is not None:
        source_outlines.append(planes_and_balls(source, every, source.balls, every)[1])
        row, *arc = arcs_in_cones(source.balls, o.ball_of, o.balls, ball)
        source_outlines.append((o.ball_of[row], *arc))
        outlines.append(gaps_of_turn(len(ball), *arcs_in_cones(o.balls, ball, source.balls, o.ball_of)))
        edges, outside = planes_and_balls(o.polygons, polygon, source.balls, o.polygon_of)
        polygon_edges.append(gaps(0 * low.ravel(), 1 + 0 * low.ravel(), *edges))
        row, *arc = gaps_of_turn(len(polygon), *outside)
        source_outlines.append((o.polygon_of[row], *arc))
    for i, j in zip(*(parts(a, CACHED) for a in o.polygon_ball)):
        edges, outside = planes_and_balls(o.polygons, i, o.balls, j)
        polygon_edges.append(edges)
        row, *arc = gaps_of_turn(len(i), *outside)
        outlines.append((j[row], *arc))
    for i, j in zip(*(parts(a, CACHED) for a in o.ball_ball)):
        row, *arc = arcs_in_cones(o.balls, i, o.balls, j)
        outlines.append((i[row], *arc))
    for i, j, first in zip(*(parts(a, CACHED) for a in (*o.polygon_polygon, o.first))):
        polygon_edges.append(edges_in_polygons(o.polygons, i, o.polygons, j, OUTER, first))
    whole = np.zeros(source.p.shape[1:]), np.ones(source.p.shape[1:])
    total = _along_edges(n, source, *whole, joined(source_edges))
    if source.balls is not None:
        total = total + _along_outlines(n, source.balls, joined(source_outlines))
    of_polygons = _along_edges(n.take(o.polygon_of, axis=1), o.polygons, low, high, joined(polygon_edges))
    of_balls = _along_outlines(n.take(o.ball_of, axis=1), o.balls, joined(outlines))
    hidden = np.bincount(o.polygon_of, of_polygons, minlength=m) + np.bincount(o.ball_of, of_balls, minlength=m)
    left = (total - hidden) / TURN
    dark = np.nonzero(left < FAINT)[0]
    if len(dark):
        noise = _noise(o.polygons, rounding)
        noise = np.bincount(o.polygon_of, noise, minlength=m)[dark]
        left[dark[left[dark] < noise]] = 0.0
    return left
