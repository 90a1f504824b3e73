"""The pixels of Blender's images as linear light, whatever the file holds; images without pixels are said."""

import bpy
import numpy as np

from .picture import linear_of_srgb

NEEDED = "is not read; save it as a single PNG, HDR or EXR and use that"
UNREAD = {
    "MOVIE": "is a movie",
    "SEQUENCE": "is an image sequence",
    "VIEWER": "is a render",
    "TILED": "is a set of tiles",
}

# linear colours of other primaries as Rec.709, Bradford where the white differs: BT.709, RP 431, BT.2020, ACES
XYZ = [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
P3 = [[1.2249402, -0.2249402, 0.0], [-0.0420570, 1.0420570, 0.0], [-0.0196376, -0.0786361, 1.0982737]]
REC2020 = [[1.6604910, -0.5876411, -0.0728499], [-0.124550, 1.1328999, -0.0083494], [-0.0181508, -0.1005789, 1.1187297]]
ACESCG = [[1.7050510, -0.6217921, -0.0832589], [-0.1302564, 1.1408047, -0.0105483], [-0.0240034, -0.1289690, 1.1529724]]
ACES = [[2.5216862, -1.1341310, -0.3875552], [-0.2764799, 1.3727191, -0.0962392], [-0.0153781, -0.1529753, 1.1683534]]


class ImageError(ValueError):
    """An image that has no pixels to read; the message names it and goes on with what to do."""


def read_pixels(image):
    """A bpy image -> (h, w, 4) float32, row 0 the lowest: linear Rec.709 and alpha, by which colours are multiplied.

    They are what an Image Texture node of the full image shows where its Alpha is not used. ImageError where the image
    is missing, empty, several images, or in a colour space that is not known here.
    """
    if image.source in UNREAD:
        raise ImageError(f"image {image.name!r} {UNREAD[image.source]} and {NEEDED}")
    count = len(image.pixels)  # loads the file
    width, height = image.size
    if not count or width * height == 0:
        where = "is empty" if image.source == "GENERATED" or image.packed_file else f"{image.filepath!r} is missing"
        raise ImageError(f"image {image.name!r} {where}; find the file (File > External Data) or choose another")
    pixels = np.empty(count, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = _four_channels(pixels.reshape(height, width, -1))
    if not image.is_float:  # Blender has made floats linear as it loaded them
        _decode(pixels, image)
    if image.alpha_mode == "NONE":
        pixels[..., 3] = 1.0
    elif not has_own_alpha(image) and not _is_multiplied(image):
        pixels[..., :3] *= pixels[..., 3:]
    return pixels


def _is_multiplied(image):
    """Whether colours are multiplied by alpha in Blender's own pixels as far as Cycles does: floats are, once, and
    Cycles of Blender 5 does it again with what it is handed."""
    is_again = bpy.app.version >= (5, 0) and is_held(image) and image.alpha_mode == "STRAIGHT"
    return image.is_float and not is_again


def is_held(image):
    """Whether Blender hands the pixels to Cycles, floats as linear ones, which reads other images from their files."""
    return image.source == "GENERATED" or image.packed_file is not None


def has_own_alpha(image):
    """Whether its fourth channel tells nothing about the other three: packed, left out, or data."""
    return image.alpha_mode in ("CHANNEL_PACKED", "NONE") or image.colorspace_settings.name == "Non-Color"


def _four_channels(pixels):
    """(h, w, c) -> (h, w, 4): grey three times, alpha 1 where there is none."""
    channels = pixels.shape[2]
    if channels == 4:
        return pixels
    full = np.ones((*pixels.shape[:2], 4), np.float32)
    full[..., :3] = pixels if channels == 3 else pixels[..., :1]
    if channels == 2:
        full[..., 3] = pixels[..., 1]
    return full


def _decode(pixels, image):
    """Bytes as their colour space means them, in place."""
    name = image.colorspace_settings.name
    if name not in _SPACES:
        raise ImageError(f"image {image.name!r} has colour space {name!r}, which is not read; use sRGB or a float file")
    curve, primaries = _SPACES[name]
    if curve is not None:
        table = curve(np.arange(256) / 255).astype(np.float32)
        pixels[..., :3] = table[np.rint(pixels[..., :3] * 255).astype(np.uint8)]
    if primaries is not None:
        pixels[..., :3] = pixels[..., :3] @ np.array(primaries, np.float32).T


def _gamma(exponent):
    return lambda value: value**exponent


_SPACES = {  # of bytes, as Blender 4.2 to 5.2 call them: (curve, primaries)
    "sRGB": (linear_of_srgb, None),
    "Non-Color": (None, None),
    "scene_linear": (None, None),
    "Linear Rec.709": (None, None),
    "Rec.1886": (_gamma(2.4), None),
    "Gamma 1.8 Encoded Rec.709": (_gamma(1.8), None),
    "Gamma 2.2 Encoded Rec.709": (_gamma(2.2), None),
    "Gamma 2.4 Encoded Rec.709": (_gamma(2.4), None),
    "Display P3": (linear_of_srgb, P3),
    "sRGB Encoded P3-D65": (linear_of_srgb, P3),
    "sRGB Encoded AP1": (linear_of_srgb, ACESCG),
    "Rec.2020": (_gamma(2.4), REC2020),
    "Linear Rec.2020": (None, REC2020),
    "Linear DCI-P3 D65": (None, P3),
    "Linear CIE-XYZ D65": (None, XYZ),
    "ACEScg": (None, ACESCG),
    "ACES2065-1": (None, ACES),
}
