"""Which sides of recognised shapes become surfaces: all that light may come to."""

import numpy as np

from ...pdm_core import AreaLight, PointLight
from ...pdm_core.boxes import near
from ...pdm_core.shapes.shape import bounds_of
from ...pdm_core.tolerances import TOUCHING


def surfaces_of(pieces, lights=()):
    """[Surface] of all pieces, and [[facing, hidden]] the indices of each piece's surfaces. lights: lamps, which may be
    inside of bodies.

    What is flat or open has both sides, a sphere that which its normals face. The hidden sides of closed bodies, and of
    closed balls, are left out where no light comes: they are out of every light's reach but of one that is inside.
    """
    surfaces, indices = [], []
    for piece, seen in zip(pieces, _hidden_is_seen(pieces, lights), strict=True):
        sides = [piece.surface()] + ([piece.surface(hidden=True)] if seen else [])
        indices.append(list(range(len(surfaces), len(surfaces) + len(sides))))
        surfaces += sides
    return surfaces, indices


def _hidden_is_seen(pieces, lights):
    """(n,) Whether light may come to the hidden side of each, from outside itself."""
    if not pieces:
        return np.zeros(0, bool)
    balls = np.array([piece.shape.is_ball for piece in pieces])
    outward = np.array([piece.is_outward for piece in pieces])
    shines = np.array([piece.look.shines for piece in pieces])
    centre, radius = bounds_of([piece.shape for piece in pieces])
    low, high = (np.array(part) for part in zip(*(piece.shape.box for piece in pieces)))
    seen = ~balls
    body = _bodies(pieces, balls & outward)
    count = int(body.max(initial=-1)) + 1
    if count:
        of = body >= 0
        inner_low, inner_high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        np.minimum.at(inner_low, body[of], low[of])
        np.maximum.at(inner_high, body[of], high[of])
        touch = TOUCHING * np.ptp([inner_low, inner_high], axis=0).max(axis=1, keepdims=True)
        lit = np.bincount(body[of], shines[of], count) > 0
        enters = np.zeros(count, bool)
        # without light of its own what is inside has it from what shines there
        for owners, others in ((lit, np.ones(len(pieces), bool)), (~lit, shines)):
            inner, other = _overlapping(inner_low + touch, inner_high - touch, low, high, owners, others)
            apart = body[other] != inner
            inner, other = inner[apart], other[apart]
            ball = np.full(count, -1)
            ball[body[balls & outward]] = np.flatnonzero(balls & outward)
            in_ball = np.flatnonzero(ball[inner] >= 0)
            reach = np.ones(len(inner), bool)
            reach[in_ball] = _reaches_into(pieces, centre, radius, ball[inner[in_ball]], other[in_ball])
            enters[inner[reach]] = True
        enters |= _holds_a_lamp(inner_low, inner_high, lights)
        seen[of] = enters[body[of]]
    for k in np.flatnonzero(balls & ~outward).tolist():
        distance = np.linalg.norm(centre - centre[k], axis=1)
        beyond = distance + radius > pieces[k].shape.semi_axes[2] * (1 + TOUCHING)
        beyond[k] = False
        seen[k] = beyond.any()
    return seen | np.array([piece.is_doubled for piece in pieces])


def _holds_a_lamp(low, high, lights):
    """(n,) Whether a lamp reaches into each of the boxes low, high (n, 3) m."""
    held = np.zeros(len(low), bool)
    for light in lights:
        if isinstance(light, PointLight):
            at, reach = light.position, light.radius
        elif isinstance(light, AreaLight):
            at, reach = light.centre, (np.abs(light.u) + np.abs(light.v)) / 2
        else:  # a sun is nowhere inside
            continue
        held |= ((at + reach > low) & (at - reach < high)).all(axis=1)
    return held


def _bodies(pieces, balls):
    """(n,) a number for each piece, the same within a closed body, each of these balls its own; -1 for none."""
    numbers = {}
    keys = [k if balls[k] else piece.body for k, piece in enumerate(pieces)]
    return np.array([numbers.setdefault(key, len(numbers)) if key != () else -1 for key in keys])


def _overlapping(low, high, other_low, other_high, owners, others):
    """Pairs (k,), (k,) of boxes among owners and others (bool masks) that overlap."""
    owner, other, count = np.flatnonzero(owners), np.flatnonzero(others), np.count_nonzero(owners)
    lows, highs = np.concatenate([low[owner], other_low[other]]), np.concatenate([high[owner], other_high[other]])
    # less what touches, flat ones end before they begin
    i, j = near(np.minimum(lows, highs), np.maximum(lows, highs), 0.0)
    mixed = (i < count) & (j >= count)
    return owner[i[mixed]], other[j[mixed] - count]


def _reaches_into(pieces, centre, radius, ball, other):
    """(k,) False for pieces `other` (k,) that are wholly outside balls (k,), as far as bounds tell."""
    nothing = np.zeros(3)
    normal = np.array([getattr(pieces[k].shape, "normal", nothing) for k in other]).reshape(-1, 3)
    # what is flat is out of reach too where it passes the ball by: `reach` is half the ball's width across it
    linear = np.array([pieces[k].shape.linear for k in ball]).reshape(-1, 3, 3)
    reach = np.linalg.norm(np.einsum("ki,kij->kj", normal, linear), axis=1)
    offset = centre[other] - centre[ball]
    passes = normal.any(axis=1) & (np.abs(np.einsum("ki,ki->k", normal, offset)) >= reach * (1 - TOUCHING))
    return (np.linalg.norm(offset, axis=1) < (radius[other] + radius[ball]) * (1 - TOUCHING)) & ~passes
