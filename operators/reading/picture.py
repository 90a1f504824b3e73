"""An image as a function of the plane: between its pixels and beyond its edges.

No bpy. Pixels are (h, w, 4) linear Rec.709 multiplied by alpha, row 0 the lowest, see image_pixels.
"""

from dataclasses import dataclass

import numpy as np

ROWS = 64  # of an image, encoded at once


class Picture:
    """pixels (h, w, 4) float32 linear, multiplied by alpha unless `is_packed`: a fourth channel of its own. encoding:
    numpy's type of the sRGB values, 255 for 1, that Cycles keeps of it and interpolates between before it decodes
    them; None where it keeps linear ones.
    """

    def __init__(self, pixels, encoding=None, is_packed=False):
        self.encoded = encoding is not None
        self.pixels = _encoded(pixels, encoding, is_packed) if self.encoded else pixels  # what is interpolated between

    def look_up(self, uv, use):
        """uv (n, 2) in images -> colour and alpha (n, 4)."""
        found = use.sample(self.pixels, uv)
        return use.finish(found / 255 if self.encoded else found, self.encoded)


def _encoded(pixels, encoding, is_packed):
    """Linear (h, w, 4) -> sRGB values, multiplied by alpha once they are, where that is no channel of its own."""
    encoded = np.empty(pixels.shape, encoding)
    whole = np.rint if encoding == np.uint8 else np.asarray
    for y in range(0, len(pixels), ROWS):  # as whole, an image's doubles fill the memory
        rows, alpha = pixels[y : y + ROWS, :, :3], pixels[y : y + ROWS, :, 3:]
        is_clear = not is_packed and (alpha < 1).any()
        if is_clear:
            rows = np.divide(rows, alpha, out=np.zeros_like(rows), where=alpha > 0)
        values = whole(srgb_of_linear(np.maximum(rows, 0.0)) * 255)
        encoded[y : y + ROWS, :, :3] = values * alpha + 1e-4 if is_clear else values
        encoded[y : y + ROWS, :, 3:] = whole(alpha * 255)
    return encoded


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

    def look_up(self, uv, use):
        cell = np.floor(uv)
        number = np.where((cell[:, 0] >= 0) & (cell[:, 0] < 10), 1001 + cell[:, 0] + 10 * cell[:, 1], 0).astype(int)
        out = np.zeros((len(uv), 4))
        within = Use("EXTEND", use.interpolation, use.straight)
        for k, picture in self.pictures.items():
            at = number == k
            if at.any():
                out[at] = picture.look_up((uv - cell)[at], within)
        return out


def linear_of_srgb(value):
    """IEC 61966-2-1"""
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0.0) + 0.055) / 1.055) ** 2.4)


def srgb_of_linear(value):
    """IEC 61966-2-1"""
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 0.0) ** (1 / 2.4) - 0.055)
