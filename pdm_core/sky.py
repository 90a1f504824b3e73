"""A map of the radiance from all directions, smooth enough to be gathered by few rays, and the suns taken out of it."""

from functools import cached_property

import numpy as np

from .lights import SunLight
from .shapes.shape import unit

SUN_RADIUS = np.radians(3.0)  # within which what is bright about a peak is one sun
SUN_RISE = 30.0  # times the mean radiance that it must have at least, and
SUN_SHARE = 0.02  # of the irradiance that all of the sky gives at most, for shadows of it to be seen
SUN_EDGE = 0.03  # of its peak radiance, down to which a pixel belongs to it
MOST_SUNS = 4
ORDERS = 12  # of spherical harmonics; the cosine lobe's part beyond is below .1 %


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

    def unoccluded(self, normals):
        """Unit normals (n, 3) -> (n, 3) irradiance / pi where nothing hides the sky, to .1 % of its mean."""
        return np.maximum(_harmonics(np.asarray(normals, float)) @ (_COSINE[:, None] * self._moments), 0.0)

    @cached_property
    def _moments(self):
        """(terms, 3) of the map over the spherical harmonics."""
        values = reduced(self.values, 256)
        weights = solid_angles(*values.shape[:2])[..., None] * values
        return _harmonics(directions_of(*values.shape[:2]).reshape(-1, 3)).T @ weights.reshape(-1, 3)


def _harmonics(directions):
    """Real spherical harmonics (n, terms) of even order, and order 1, up to ORDERS; by recurrence in the order."""
    x, y, z = directions.T
    ring = np.ones((len(directions), 2))  # cos, sin of m times the turn, times sin^m
    columns = {}
    legendre = {}
    for m in range(ORDERS + 1):
        for n in range(m, ORDERS + 1):
            if n == m:
                value = np.full(len(z), 1.0) if m == 0 else legendre[m - 1, m - 1] * -(2 * m - 1)
            elif n == m + 1:
                value = z * (2 * m + 1) * legendre[m, m]
            else:
                value = ((2 * n - 1) * z * legendre[m, n - 1] - (n + m - 1) * legendre[m, n - 2]) / (n - m)
            legendre[m, n] = value
        ring = np.column_stack([np.ones(len(z)), np.zeros(len(z))]) if m == 0 else _turned(ring, x, y)
        for n in range(m, ORDERS + 1):
            if n == 1 or n % 2 == 0:
                scale = np.sqrt((2 * n + 1) / (4 * np.pi) / np.prod(np.arange(n - m + 1, n + m + 1, dtype=float)))
                parts = [(1, 0)] if m == 0 else [(np.sqrt(2), 0), (np.sqrt(2), 1)]
                columns.setdefault(n, []).extend(scale * k * legendre[m, n] * ring[:, c] for k, c in parts)
    return np.stack([column for n in sorted(columns) for column in columns[n]], axis=1)


def _turned(ring, x, y):
    return np.column_stack([ring[:, 0] * x - ring[:, 1] * y, ring[:, 0] * y + ring[:, 1] * x])


def _cosine_lobe():
    """Of each column of _harmonics: what the cosine over the horizon, divided by pi, takes of it (Ramamoorthi 2001)."""
    factors = []
    for n in (n for n in range(ORDERS + 1) if n == 1 or n % 2 == 0):
        if n == 1:
            value = 2 / 3
        else:
            half = np.prod([k / (k + n // 2) for k in range(1, n // 2 + 1)])  # (n/2)!^2 / n!
            value = 2 * (-1) ** (n // 2 + 1) / ((n + 2) * (n - 1)) / (2.0**n * half)
        factors += [value] * (2 * n + 1)
    return np.array(factors)


_COSINE = _cosine_lobe()


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
