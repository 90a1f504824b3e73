"""An image as a function of the plane: between its pixels, beyond its edges, and as means over more than one pixel.

No bpy. Pixels are (h, w, 4) linear Rec.709 multiplied by alpha, row 0 the lowest, see image_pixels.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

ROWS = 64  # of an image, encoded at once


class Picture:
    """pixels (h, w, 4) float32 linear, multiplied by alpha unless `is_packed`: a fourth channel of its own. encoded:
    whether Cycles keeps it as sRGB bytes, between which it interpolates before it decodes them.

    finest (h, w, 4): what is interpolated between where nothing is averaged, bytes where encoded.
    """

    def __init__(self, pixels, encoded=False, is_packed=False):
        self.encoded = encoded
        self.finest = _bytes(pixels, is_packed) if encoded else pixels
        self._half = _halved(pixels)

    @cached_property
    def levels(self):
        """[(h, w, 4)] linear: the finest, then means over 2 x 2, 4 x 4, ... pixels until one is left."""
        levels = [self.finest, self._half]
        while levels[-1].shape[0] * levels[-1].shape[1] > 1:
            levels.append(_halved(levels[-1]))
        return levels

    def look_up(self, uv, use, footprint=None):
        """uv (n, 2) in images -> colour and alpha (n, 4). footprint (n, 2): the width and height to average over."""
        if footprint is None:
            return self._level(0, uv, use)
        height, width = self.finest.shape[:2]
        texels = np.maximum((footprint * [width, height]).max(axis=1), 1e-9)
        level = np.clip(np.log2(texels), 0.0, len(self.levels) - 1)
        low = np.floor(level).astype(int)
        out = np.empty((len(uv), 4))
        for k in np.unique(low):
            at = low == k
            share = (level[at] - k)[:, None]
            fine = self._level(k, uv[at], use)
            out[at] = fine if not share.any() else (1 - share) * fine + share * self._level(k + 1, uv[at], use)
        return out

    def _level(self, k, uv, use):
        if k == 0:
            found = use.sample(self.finest, uv)
            return use.finish(found / 255 if self.encoded else found, self.encoded)
        return use.finish(use.sample(self.levels[min(k, len(self.levels) - 1)], uv), False)


def _bytes(pixels, is_packed):
    """Linear (h, w, 4) -> sRGB bytes, multiplied by alpha as bytes where that is no channel of its own."""
    encoded = np.empty(pixels.shape, np.uint8)
    for y in range(0, len(pixels), ROWS):  # as whole, an image's doubles fill the memory
        rows, alpha = pixels[y : y + ROWS, :, :3], pixels[y : y + ROWS, :, 3:]
        is_clear = not is_packed and (alpha < 1).any()
        if is_clear:
            rows = np.divide(rows, alpha, out=np.zeros_like(rows), where=alpha > 0)
        values = np.rint(srgb_of_linear(np.clip(rows, 0.0, 1.0)) * 255)
        encoded[y : y + ROWS, :, :3] = values * alpha + 1e-4 if is_clear else values
        encoded[y : y + ROWS, :, 3:] = np.rint(alpha * 255)
    return encoded


def _halved(pixels):
    """Means over 2 x 2 pixels; of an odd number of rows or columns by their shares, so that the whole mean is kept."""
    for axis in (0, 1):
        along = np.moveaxis(pixels, axis, 0)
        if len(along) > 1:
            along = (along[0::2] + along[1::2]) / 2 if len(along) % 2 == 0 else _shares(along)
            pixels = np.moveaxis(along, 0, axis)
    return np.ascontiguousarray(pixels, np.float32)


def _shares(rows):
    """An odd number n of rows as (n + 1) / 2 means over equal parts of them."""
    count = (len(rows) + 1) // 2
    ends = np.arange(count + 1) * len(rows) / count
    total = np.concatenate([np.zeros_like(rows[:1], float), np.cumsum(rows, axis=0, dtype=float)])
    row = np.minimum(ends.astype(int), len(rows) - 1)
    total = total[row] + (ends - row)[:, None, None] * rows[row]
    return np.diff(total, axis=0) * count / len(rows)


@dataclass(frozen=True)
class Use:
    """How a node looks at an image. extension REPEAT, EXTEND, CLIP or MIRROR; interpolation Closest, Linear or Cubic;
    straight: colours not multiplied by alpha, as where the node's Alpha is in use."""

    extension: str = "REPEAT"
    interpolation: str = "Linear"
    straight: bool = False

    def sample(self, pixels, uv):
        """(h, w, c) at uv (n, 2) -> (n, c)"""
        height, width = pixels.shape[:2]
        place = uv * [width, height]
        if self.interpolation == "Closest":
            return self._pixels(pixels, *np.floor(place).astype(np.int64).T).astype(float)
        place = place - 0.5
        corner = np.floor(place)
        x, y = corner.astype(np.int64).T
        across, up = (place - corner).T
        weights, first = (_linear, 0) if self.interpolation == "Linear" else (_cubic, -1)
        across, up = weights(across), weights(up)
        total = np.zeros((len(uv), pixels.shape[2]))
        for j, by_row in enumerate(up, first):
            for i, by_column in enumerate(across, first):
                total += (by_row * by_column)[:, None] * self._pixels(pixels, x + i, y + j)
        return total

    def _pixels(self, pixels, x, y):
        height, width = pixels.shape[:2]
        if self.extension == "REPEAT":
            return pixels[y % height, x % width]
        if self.extension == "MIRROR":
            x, y = (np.minimum(k % (2 * n), 2 * n - 1 - k % (2 * n)) for k, n in ((x, width), (y, height)))
            return pixels[y, x]
        found = pixels[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
        if self.extension == "CLIP":
            inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
            found = found * inside[:, None]
        return found

    def finish(self, rgba, encoded):
        """(n, 4) as the node gives them out."""
        if self.straight:
            alpha = rgba[:, 3:]
            rgba = np.concatenate([np.where(alpha != 0, rgba[:, :3] / np.where(alpha != 0, alpha, 1.0), 0.0), alpha], 1)
        if encoded:
            rgba[:, :3] = linear_of_srgb(rgba[:, :3])
        return rgba


def _linear(t):
    return 1 - t, t


def _cubic(t):
    """Weights of four neighbours, uniform B-spline"""
    return (1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6


class Tiles:
    """UDIM tiles, {number: Picture}: tile 1001 + i + 10 j covers the unit square at (i, j), the rest is black."""

    def __init__(self, pictures):
        self.pictures = pictures

    def look_up(self, uv, use, footprint=None):
        cell = np.floor(uv)
        number = np.where((cell[:, 0] >= 0) & (cell[:, 0] < 10), 1001 + cell[:, 0] + 10 * cell[:, 1], 0).astype(int)
        out = np.zeros((len(uv), 4))
        within = Use("EXTEND", use.interpolation, use.straight)
        for k, picture in self.pictures.items():
            at = number == k
            if at.any():
                extent = None if footprint is None else footprint[at]
                out[at] = picture.look_up((uv - cell)[at], within, extent)
        return out


def footprint(uv, samples):
    """(n, 2): how far apart neighbouring samples are in the image; None where there are none.

    uv (cells * samples^2, 2), cell by cell, row by row. The median in each cell, which a seam of the map leaves alone.
    """
    if not samples:
        return None
    grid = uv.reshape(-1, samples, samples, 2)
    steps = [np.abs(np.diff(grid, axis=axis)).reshape(len(grid), -1, 2) for axis in (1, 2)]
    widest = np.maximum(*(np.median(step, axis=1) for step in steps))
    return np.repeat(widest, samples**2, axis=0)


def linear_of_srgb(value):
    """IEC 61966-2-1"""
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0.0) + 0.055) / 1.055) ** 2.4)


def srgb_of_linear(value):
    """IEC 61966-2-1"""
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 0.0) ** (1 / 2.4) - 0.055)
