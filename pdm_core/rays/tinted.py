"""Colours of what receivers get of sources that vary, such as screens, where nothing hides them."""

import numpy as np

from ..at_once import AT_ONCE, parts
from ..closed_forms import disc_kernel

TINTED, MORE = 64, 4  # times as many points tell of colours as of shadows, and next where they are too rough
MOST = 1 << 16  # of them: what is nearer to a screen 2 m wide than 8 mm sees its dots blurred
# of them that are looked at apart, and what all are off by of what these are: of halves both are off by chance alike
SETS, OF_SETS = 4, 0.7


def colours_of(source, receivers, points, unsure, centre):
    """Generator with a sign of life a part; returns colours (n, 3) of what receivers, about the centre (3,) m, get of
    all of a source, of the mean of that, and how far parts of the points are off (n,); points: of its shadows; unsure
    (n,): how many times too far off what is wrong by all of it would be.

    Each point is a disc of its area: what is nearer than the points to each other gets the colour of what is about it.
    """
    out, off = np.ones((len(receivers), 3)), np.zeros(len(receivers))
    some, count = np.arange(len(out) if source.is_tinted else 0), TINTED * points
    while len(some):
        discs = _discs(source, count, centre)
        for part in parts(some, 16 * AT_ONCE // len(discs[0])):
            out[part], off[part] = _told(*discs, receivers.take(part))
            yield
        more = count < MOST and len(discs[0]) >= count  # of a spot there are no more than it has
        some, count = some[more & (off[some] * unsure[some] > 1)], MORE * count
    return out, off


def _discs(source, count, centre):
    """place (k, 3) m about the centre, normal (k, 3), weight and area (k,) of about so many points, and tint (k, SETS,
    4) of them in their sets, 0 in others, the last 1."""
    place, normal, weight = source.samples(count)
    tint = source.tint(place)
    area = weight if source.is_surface else source.area[: len(place)]
    tint = np.column_stack([tint / np.maximum(weight @ tint / weight.sum(), 1e-300), np.ones(len(place))])
    own = np.arange(len(place))[:, None] % SETS == np.arange(SETS)
    return place - centre, normal, weight, area, own[:, :, None] * tint[:, None]


def _told(place, normal, weight, area, tint, receivers):
    """Colours (n, 3) at receivers, and how far all points may be off (n,)."""
    value = weight * disc_kernel(place, normal, area, receivers.points, receivers.normals)
    sums = (value @ tint.reshape(len(place), -1)).reshape(-1, SETS, 4)
    out, each = _mean(sums.sum(axis=1)), _mean(sums)
    square = ((each - out[:, None]) ** 2).max(axis=2).mean(axis=1)
    return out, OF_SETS * np.sqrt(square)


def _mean(sums):
    """Means (..., 3) of sums (..., 4), the last of weights; 1 where these are 0."""
    total = sums[..., 3:]
    return np.where(total > 0, sums[..., :3] / np.maximum(total, 1e-300), 1.0)
