"""Colours of what receivers get of sources that vary, such as screens, where nothing hides them."""

import numpy as np

from ..at_once import AT_ONCE, parts
from ..closed_forms import disc_kernel

TINTED = 64  # times as many points tell of colours as of shadows
HALVED = 0.5  # what all points are off by, of what half of them are


def colours_of(source, receivers, points, centre):
    """Generator with a sign of life a part; returns colours (n, 3) of what receivers, about the centre (3,) m, get of
    all of a source, of the mean of that, and how far half the points are off (n,); points: of its shadows.

    Each point is a disc of its area: what is nearer than the points to each other gets the colour of what is about it.
    """
    out, off = np.ones((len(receivers), 3)), np.zeros(len(receivers))
    if not source.is_tinted:
        return out, off
    place, normal, weight = source.samples(TINTED * points)
    tint = source.tint(place)
    area = weight if source.is_surface else source.area[: len(place)]
    tint = tint / np.maximum(weight @ tint / weight.sum(), 1e-300)
    place = place - centre
    for part in parts(np.arange(len(out)), 16 * AT_ONCE // len(place)):
        value = weight * disc_kernel(place, normal, area, receivers.points[part], receivers.normals[part])
        out[part], half = _mean(value, tint), _mean(value[:, ::2], tint[::2])
        off[part] = np.abs(half - out[part]).max(axis=1) * HALVED
        yield
    return out, off


def _mean(weights, values):
    """Means (n, 3) of values (k, 3) by weights (n, k); 1 where these are 0."""
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 0, weights @ values / np.maximum(total, 1e-300), 1.0)
