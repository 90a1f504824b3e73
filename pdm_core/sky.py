"""A map of the radiance from all directions, smooth enough to be gathered by few rays, and the suns taken out of it."""

import numpy as np

from .lights import SunLight
from .shapes.shape import unit

SUN_RADIUS = np.radians(3.0)  # within which what is bright about a peak is one sun
SUN_RISE = 30.0  # times the mean radiance that it must have at least, and
SUN_SHARE = 0.02  # of the irradiance that all of the sky gives at most, for shadows of it to be seen
SUN_EDGE = 0.03  # of its peak radiance, down to which a pixel belongs to it
MOST_SUNS = 4


def directions_of(height, width):
    """Unit directions (height, width, 3) of an equirectangular map's pixels: row 0 looks down, the middle to +x."""
    up, turn = np.pi * ((np.arange(height) + 0.5) / height - 0.5), np.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    up, turn = np.meshgrid(up, turn, indexing="ij")
    return np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1)


def solid_angles(height, width):
    """(height, 1) of each row's pixels"""
    edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    return (np.diff(edges) * 2 * np.pi / width)[:, None]


def places_on_map(directions):
    """Unit directions (..., 3) -> u, v (...) in [0, 1] on an equirectangular map, as Cycles places them."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return 0.5 - np.arctan2(y, x) / (2 * np.pi), np.arctan2(z, np.hypot(x, y)) / np.pi + 0.5


def bilinear(values, u, v, wrap=True):
    """values (h, w, c) at u, v (...) in [0, 1], pixels' middles at half steps -> (..., c); wrap: around in u."""
    height, width = values.shape[:2]
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    x = x if wrap else np.clip(x, 0, width - 1)
    i, j = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), max(height - 2, 0))
    s, t = (x - i)[..., None], (y - j)[..., None]
    i, right = i % width, (i + 1) % width if wrap else np.minimum(i + 1, width - 1)
    above = np.minimum(j + 1, height - 1)
    low = values[j, i] * (1 - s) + values[j, right] * s
    return low * (1 - t) + (values[above, i] * (1 - s) + values[above, right] * s) * t


def reduced(values, width):
    """values (h, w, c) averaged over whole blocks of pixels, of as few as make it at most so wide."""
    while values.shape[1] > width:
        height, wide = (max(n - n % 2, 1) for n in values.shape[:2])
        blocks = values[:height, :wide].reshape(max(height // 2, 1), -1, wide // 2, 2, values.shape[2])
        values = blocks.mean(axis=(1, 3))
    return values


class SkyMap:
    """Radiance (h, w, 3) on an equirectangular map, row 0 looking down, as a function of directions."""

    def __init__(self, values):
        self.values = np.maximum(np.asarray(values, float), 0.0)

    def __call__(self, directions):
        """Unit directions (n, 3) -> radiance (n, 3)"""
        return bilinear(self.values, *places_on_map(np.asarray(directions, float)))


def without_suns(values, name=""):
    """Radiance (h, w, 3) without the small and very bright spots, and these as [SunLight]."""
    values, suns = np.array(values, float), []
    height, width = values.shape[:2]
    sizes = np.broadcast_to(solid_angles(height, width), (height, width))
    directions = None
    while len(suns) < MOST_SUNS:
        light = values.sum(axis=2)
        total = (light * sizes).sum()
        peak = np.unravel_index(light.argmax(), light.shape)
        if not light[peak] > SUN_RISE * total / (4 * np.pi):
            break
        directions = directions_of(height, width) if directions is None else directions
        near = directions @ directions[peak] > np.cos(SUN_RADIUS)
        disc = near & (light > max(SUN_EDGE * light[peak], SUN_RISE / 3 * total / (4 * np.pi)))
        rest = near & ~disc
        around = np.median(values[rest], axis=0) if rest.any() else np.zeros(3)
        extra = np.maximum(values[disc] - around, 0.0) * sizes[disc][:, None]
        if extra.sum() < SUN_SHARE * total:
            break
        suns.append(_sun(directions[disc], extra, sizes[peak], name))
        values[disc] = around
    return values, suns


def _sun(directions, irradiance, pixel, name):
    """SunLight of pixels: unit directions (n, 3), irradiance (n, 3); its size from how far they spread."""
    weights = irradiance.sum(axis=1)
    centre = unit(weights @ directions)
    spread = weights @ (1 - (directions @ centre) ** 2) / weights.sum() - pixel / 6  # less a pixel's own
    half = np.sqrt(max(2 * spread, 0.0))  # of an even disc
    return SunLight(-centre, irradiance.sum(axis=0), 2 * np.arcsin(min(half, 1.0)), name=name)
