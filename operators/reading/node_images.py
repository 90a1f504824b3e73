"""The Image Texture node: which image it shows, from where, and how it looks at it."""

import os

import bpy
import numpy as np

from .image_pixels import ImageError, has_own_alpha, is_held, read_pixels
from .node_math import moved_in_node
from .node_places import read_off
from .node_places import uv as uv_map
from .node_values import Value, derive
from .node_walk import Recipe, Unknown
from .picture import Picture, Tiles, Use


def _image_texture(output, walk):
    node = output.node
    if node.image is None:
        return Unknown(" without an image")
    try:
        picture = _picture(node.image, walk.images)
    except ImageError as error:
        return Unknown(f", whose {error}")
    is_straight = node.outputs["Alpha"].is_linked and not has_own_alpha(node.image)
    use = Use(node.extension, node.interpolation if node.interpolation in ("Closest", "Linear") else "Cubic",
              is_straight)  # fmt: skip
    columns = slice(3, 4) if output.socket.identifier == "Alpha" else slice(3)
    vector = output.input("Vector")
    is_linked, projection, blend = walk.is_linked(vector), node.projection, node.projection_blend

    def shown(given):
        vector = moved_in_node(node, given if is_linked else uv_map())
        if projection == "BOX":
            seen = _seen_from_three_sides(picture, use, vector, blend)
        else:
            seen = _seen(picture, use, derive(_PROJECTIONS[projection], vector))
        return derive(lambda rgba: rgba[:, columns], seen)

    return Recipe([vector], shown)


def _seen(picture, use, place):
    seen = derive(lambda uv: picture.look_up(uv, use), place)
    if not place.varies:
        return seen
    return Value(None, seen.function, seen.inputs, seen.needs | {("image", "")}, seen.notes)


def _seen_from_three_sides(picture, use, vector, blend):
    """Box projection: along the axis that the face looks along most, mixed where two or three are alike."""
    normal = read_off("normal")
    views = ((0, 1, 2, -1), (1, 0, 2, 1), (2, 1, 0, 1))
    seen = [_seen(picture, use, derive(_side(*view), vector, normal)) for view in views]

    def mix(normal, *sides):
        weights = _shares_of_axes(normal, blend)
        return sum(weights[:, k : k + 1] * side for k, side in enumerate(sides))

    return derive(mix, normal, *seen)


def _side(axis, across, up, sign):
    """The place in the image of what is seen along an axis; turned round where the normal has this sign there."""

    def place(vector, normal):
        u = vector[:, across]
        return np.column_stack([np.where(sign * normal[:, axis] > 0, 1 - u, u), vector[:, up]])

    return place


def _shares_of_axes(normal, blend):
    """Normals (n, 3) -> weights (n, 3) of the axes, as Cycles blends them."""
    size = np.abs(normal) / np.abs(normal).sum(axis=1, keepdims=True)
    limit = (1 + blend) / 2
    weights = np.zeros(size.shape)
    todo = np.ones(len(size), bool)
    for a, b, c in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):  # one axis alone
        only = todo & (size[:, a] > limit * (size[:, a] + np.maximum(size[:, b], size[:, c])))
        weights[only, a] = 1.0
        todo &= ~only
    if blend == 0:
        weights[todo, 0] = 1.0
        return weights
    for a, b, c in ((0, 1, 2), (1, 2, 0), (0, 2, 1)):  # two of them
        two = todo & (size[:, c] < (1 - limit) * (size[:, a] + size[:, b]))
        share = size[two, a] / (size[two, a] + size[two, b])
        weights[two, a] = np.clip((share - (1 - blend) / 2) / blend, 0.0, 1.0)
        weights[two, b] = 1 - weights[two, a]
        todo &= ~two
    weights[todo] = ((2 - limit) * size[todo] + limit - 1) / (2 * limit - 1)
    return weights


def _flat(vector):
    return vector[:, :2]


def _ball(vector):
    """Longitude and latitude, as Blender maps a ball."""
    x, y, z = (2 * vector - 1).T
    u = np.where((x == 0) & (y == 0), 0.0, (1 - np.arctan2(x, y) / np.pi) / 2)
    length = np.sqrt(x * x + y * y + z * z)
    return np.column_stack([u, 1 - np.arctan2(np.hypot(x, y), z) / np.pi]) * (length > 0)[:, None]


def _tube(vector):
    """Longitude and height."""
    x, y, z = (2 * vector - 1).T
    u = (1 - np.arctan2(x, y) / np.pi) / 2
    return np.column_stack([u, (z + 1) / 2]) * (np.hypot(x, y) > 0)[:, None]


_PROJECTIONS = {"FLAT": _flat, "SPHERE": _ball, "TUBE": _tube}


def _picture(image, known):
    """The Picture or Tiles of an image, each read once."""
    if image.name_full not in known:
        try:
            known[image.name_full] = _tiles(image) if image.source == "TILED" else _single(image)
        except ImageError as error:
            known[image.name_full] = error
    found = known[image.name_full]
    if isinstance(found, ImageError):
        raise found
    return found


def _single(image):
    encoding = None
    if image.colorspace_settings.name == "sRGB" and not (image.is_float and is_held(image)):
        encoding = np.float32 if image.is_float else np.uint8
    return Picture(read_pixels(image), encoding, has_own_alpha(image))


def _tiles(image):
    """Each tile's file as an image of its own, for a moment."""
    path, pictures = bpy.path.abspath(image.filepath), {}
    for tile in image.tiles:
        column, row = (tile.number - 1001) % 10, (tile.number - 1001) // 10
        name = path.replace("<UDIM>", str(tile.number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")
        if not os.path.isfile(name):
            raise ImageError(f"image {image.name!r} has no file {name!r} of a tile; save its tiles as files")
        single = bpy.data.images.load(name)
        try:
            single.colorspace_settings.name = image.colorspace_settings.name
            single.alpha_mode = image.alpha_mode
            pictures[tile.number] = _single(single)
        finally:
            bpy.data.images.remove(single)
    return Tiles(pictures)


READERS = {"ShaderNodeTexImage": _image_texture}
