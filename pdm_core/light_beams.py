"""What points receive from lamps that do not shine evenly: the part of a cone, the beams of an area with a spread."""

import numpy as np

from .at_once import AT_ONCE, parts, slices
from .numerics import gauss_legendre
from .shapes.shape import cones, frames, unit

COARSE, DIRECTIONS = 32, 1024  # across the cone in which a lamp is seen, to find where its light fades, and there
NODES, FEW, MANY = 6, 2, 12  # Gauss points between kinks, 1e-5 off at most; fewer on polygons of more than MANY edges
LEAST_HALF = 1e-3  # of a spread; light is then parallel to a part in a million, and tan a - a known to one in 10^9


def across_cone(turned, fading, axes, normals, half):
    """The share (n,) let through of what points with unit normals (n, 3) receive from round cones of even light about
    unit axes (n, 3) towards it, half angles (n,), where fading(...) of the cosine between the third axis and directions
    turned by a matrix (3, 3) tells how much of it is. By an even lattice of directions."""
    frame, share = frames(axes).swapaxes(1, 2), np.empty(len(axes))
    turned, normals = turned @ frame, normals[:, None] @ frame
    for part in slices(len(axes), AT_ONCE // (4 * COARSE)):
        few = fading(_third(turned[part] @ cones(half[part], COARSE, 1.0)))
        # nan where the pattern's edge is within the cone
        share[part] = np.where(np.ptp(few, axis=1) > 0, np.nan, few[:, 0])
    for part in parts(np.flatnonzero(np.isnan(share)), AT_ONCE // (4 * DIRECTIONS)):
        towards = cones(half[part], DIRECTIONS)
        cosine = np.maximum((normals[part] @ towards)[:, 0], 0.0)
        total = cosine.sum(axis=1)
        through = np.einsum("nk,nk->n", cosine, fading(_third(turned[part] @ towards)))
        share[part] = through / np.where(total > 0, total, 1.0)
    return share


def _third(directions):
    """(n, k) Cosines between directions (n, 3, k) and the third axis."""
    x, y, z = np.moveaxis(directions, 1, 0)
    return z / np.sqrt(x * x + y * y + z * z)


def beam_unoccluded(points, normals, corners, normal, half):
    """What points (n, 3) m before a polygon, unit normals (n, 3), receive from it -> (n,) irradiance / pi, where its
    radiance at the angle x from its normal (3,) is max(tan half - tan x, 0) / (tan half - half).

    corners (k, 3) m counter-clockwise seen from the front. Signed triangles between each edge and the point's foot on
    the plane: along the radius in closed form, about the foot by Gauss's rule between the kinks.
    """
    half = max(half, LEAST_HALF)
    x = unit(corners[1] - corners[0])
    y = np.cross(normal, x)
    height = (points - corners[0]) @ normal
    places = (corners[None] - points[:, None]) / height[:, None, None]
    places = np.stack([places @ x, places @ y], axis=-1)  # (n, k, 2) about the foot, in heights
    flat = np.column_stack([normals @ x, normals @ y])
    up = -(normals @ normal)
    nodes = gauss_legendre(FEW if len(corners) > MANY else NODES)
    total = np.zeros(len(points))
    for k in range(len(corners)):
        total += _triangle(places[:, k - 1], places[:, k], flat, up, np.tan(half), nodes)
    return np.maximum(total, 0.0) / (np.pi * (np.tan(half) - half))


def _triangle(p, q, flat, up, reach, rule):
    """Signed integral over the triangle between the foot and an edge p -> q (n, 2), up to the radius reach."""
    edge = q - p
    length = np.linalg.norm(edge, axis=1)
    along = edge / length[:, None]
    away = np.column_stack([along[:, 1], -along[:, 0]])  # from the foot to the edge where the triangle counts
    distance = np.einsum("ij,ij->i", p, away)
    side = np.where(distance < 0, -1.0, 1.0)
    distance, away = np.abs(distance), away * side[:, None]
    first, last = (np.arctan2(np.einsum("ij,ij->i", e, along), distance) for e in (p, q))
    ahead, aside = np.einsum("ij,ij->i", flat, away), np.einsum("ij,ij->i", flat, along)
    leaves = np.arccos(np.clip(distance / reach, 0.0, 1.0))  # the angle at which the edge leaves the circle
    kinks = [-leaves, leaves, *_horizon_meets(distance, reach, ahead, aside, up)]
    kinks = np.sort(np.clip(np.stack([first, *kinks, last]), first, last), axis=0)
    angle, weights = _along_edge(kinks, distance, reach, *rule)
    outline = distance[:, None] / np.maximum(np.cos(angle), 1e-300)
    slope = ahead[:, None] * np.cos(angle) + aside[:, None] * np.sin(angle)
    value = _radial(np.minimum(outline, reach), slope, up[:, None], reach)
    return side * (value * weights).sum(axis=(0, -1))


def _along_edge(kinks, distance, reach, nodes, weights):
    """Angles (pieces, n, k) between kinks (pieces + 1, n) and their weights. Where the edge bounds the radius steps are
    even in the distance's logarithm: near the foot it rises steeply."""
    start, end = kinks[:-1], kinks[1:]
    inside = distance < reach * np.cos((start + end) / 2)
    steep = np.pi / 2 - 1e-9
    low, high = (np.where(inside, np.arcsinh(np.tan(np.clip(a, -steep, steep))), a) for a in (start, end))
    place = low[..., None] + (high - low)[..., None] * nodes
    inside = inside[..., None]
    bend = np.where(inside, place, 0.0)
    angle = np.where(inside, np.arctan(np.sinh(bend)), place)
    return angle, (high - low)[..., None] * weights / np.cosh(bend)


def _horizon_meets(distance, reach, ahead, aside, up):
    """The angles at which the horizon meets the edge, and the circle; 0 where it does not."""
    edge = np.arctan2(-(up + distance * ahead), distance * aside)
    edge = np.where(edge > np.pi / 2, edge - np.pi, np.where(edge < -np.pi / 2, edge + np.pi, edge))
    size = np.hypot(ahead, aside)
    turn = np.arctan2(aside, ahead)
    wide = np.arccos(np.clip(-up / (reach * np.where(size > 0, size, 1.0)), -1.0, 1.0))
    both = [(angle + np.pi) % (2 * np.pi) - np.pi for angle in (turn - wide, turn + wide)]
    return edge, *both


def _radial(end, slope, up, reach):
    """Integral over u from 0 to end of max(up + u slope, 0) (reach - u) u / (1 + u^2)^2."""
    horizon = -up / np.where(slope == 0, 1.0, slope)
    low = np.where((up < 0) & (slope > 0), np.minimum(horizon, end), 0.0)
    high = np.where((up >= 0) & (slope < 0), np.minimum(horizon, end), end)
    seen = (up >= 0) | (slope > 0)

    def whole(u):
        square = u * u / (1 + u * u)
        odd = np.arctan(u) - u / (1 + u * u)
        return reach * up * square / 2 + (reach * slope - up) * odd / 2 + slope * (square - np.log1p(u * u)) / 2

    return np.where(seen, whole(high) - whole(low), 0.0)
