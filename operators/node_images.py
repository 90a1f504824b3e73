"""The Image Texture node: which image it shows, from where, and how it looks at it."""

import os

import bpy
import numpy as np

from .image_pixels import ImageError, read_pixels
from .node_places import uv as uv_map
from .node_values import Value, at_places, derive, part
from .node_walk import Recipe, Unknown
from .picture import Picture, Tiles, Use, footprint

# how many samples a side each cell has whose mean is asked for, 0 where it is none; see varying.Places
SAMPLES = at_places(lambda places: np.array([[places.samples]]))


def _image_texture(output, walk):
    node = output.node
    if node.image is None:
        return Unknown(" without an image")
    if node.projection == "BOX":
        return Unknown(" in box projection, which is not read")
    try:
        picture = _picture(node.image, walk.images)
    except ImageError as error:
        return Unknown(f"; {error}")
    is_straight = node.outputs["Alpha"].is_linked and node.image.alpha_mode not in ("CHANNEL_PACKED", "NONE")
    use = Use(node.extension, node.interpolation if node.interpolation in ("Closest", "Linear") else "Cubic",
              is_straight and node.image.colorspace_settings.name != "Non-Color")  # fmt: skip
    columns = slice(3, 4) if output.socket.identifier == "Alpha" else slice(3)
    vector = output.input("Vector")
    is_linked, project = walk.is_linked(vector), _PROJECTIONS[node.projection]

    def shown(given):
        place = derive(project, given if is_linked else uv_map())
        if not place.varies:
            return derive(lambda uv: picture.look_up(uv, use)[:, columns], place)
        seen = _seen(picture, use, place)
        return part(seen, 3) if columns.start == 3 else derive(lambda rgba: rgba[:, :3], seen)

    return Recipe([vector], shown)


def _seen(picture, use, place):
    def look_up(uv, samples):
        return picture.look_up(uv, use, footprint(uv, int(samples[0, 0])))

    seen = derive(look_up, place, SAMPLES)
    return Value(None, seen.function, seen.inputs, seen.needs | {("image", "")}, seen.notes)


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
    encoded = not image.is_float and image.colorspace_settings.name == "sRGB"
    return Picture(read_pixels(image), encoded, image.alpha_mode == "CHANNEL_PACKED")


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
