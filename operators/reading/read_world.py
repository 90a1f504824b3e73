"""Blender's worlds as a background: one radiance, or a map of all directions and the suns in it.

Constant backgrounds and images, mixed or added, are read here; any other nodes are rendered once by a second Blender.
"""

from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Euler

from ...pdm_core.signs_of_life import in_thread
from ...pdm_core.sky import SkyMap, bilinear, directions_of, places_on_map, reduced, without_suns
from .image_pixels import ImageError, read_pixels
from .world_nodes import NotPlain, terms_of
from .world_render import RenderError, rendered_world

FINE, WIDE = 2048, 512  # pixels around of the map in which suns are looked for, and of the one that is kept


@dataclass(eq=False)
class ReadWorld:
    """background: radiance (3,), or a SkyMap; suns: [SunLight]; warnings: sentences that go on after its name."""

    background: object = field(default_factory=lambda: np.zeros(3))
    suns: list = field(default_factory=list)
    warnings: list = field(default_factory=list)


def world_steps(world):
    """Generator that yields None while it waits; returns the ReadWorld of a World, of None a black one."""
    found = ReadWorld()
    if world is None:
        return found
    if not world.cycles_visibility.diffuse:
        found.warnings.append("is not visible to diffuse rays: it lights nothing; switch Ray Visibility > Diffuse on")
        return found
    if not (world.node_tree and (bpy.app.version >= (5, 0) or world.use_nodes)):
        found.background = np.array(world.color, float)
        return found
    try:
        constant, images = terms_of(world.node_tree, found.warnings)
    except NotPlain as reason:
        yield from _rendered(world, found, reason)
        return found
    maps = _pixels_of(images, found.warnings)
    if maps:
        values, found.suns = yield from in_thread(_sky_of, constant, maps, f"Sun of world {world.name}")
        found.background = SkyMap(reduced(values, WIDE))
    else:
        found.background = np.maximum(constant, 0.0)
    if (constant < 0).any() or any((image.weight < 0).any() for image, _ in maps):
        found.warnings.append("it has colours below 0: they are taken as 0")
    return found


def _rendered(world, found, reason):
    """Reads the world from a rendering of all directions; yields None."""
    try:
        values, suns = yield from rendered_world(world)
    except RenderError as error:
        found.warnings.append(f"{reason} could not be rendered ({error}): the world is taken as black")
        return
    around = f"a map of all directions, {values.shape[1]} pixels around"
    found.warnings.append(f"{reason} was rendered once into {around}: what is finer is lost")
    values, others = without_suns(values, f"Sun of world {world.name}")
    found.background, found.suns = SkyMap(reduced(values, WIDE)), [*suns, *others]


def _pixels_of(images, warnings):
    """[(Image, its pixels (h, w, 3))] of those that can be read."""
    maps = []
    for image in images:
        try:
            maps.append((image, reduced(read_pixels(image.image)[..., :3], FINE)))
        except ImageError as error:
            warnings.append(f"its {error}: it is taken as black")
    return maps


def _sky_of(constant, maps, name):
    """Radiance (h, w, 3) in all directions, of a constant (3,) and images with their pixels, and the suns in it."""
    width = max(pixels.shape[1] for _, pixels in maps)
    shape = (max(width // 2, 2), max(width, 4))
    values = np.broadcast_to(constant, (*shape, 3)).astype(float)
    for image, pixels in maps:
        values += image.weight * _on_map(image, pixels, shape)
    return without_suns(np.maximum(values, 0.0), name)


def _on_map(image, pixels, shape):
    """An image (h, w, 3) as it looks in all directions: (height, width, 3) of the map."""
    if image.is_plain and pixels.shape[:2] == shape:
        return pixels
    directions = _mapped(directions_of(*shape), image.mapping)
    if image.projection == "MIRROR_BALL":
        # Debevec 1998: the ball's normal lies halfway between the view, +y, and the direction
        half = directions - [0.0, 1.0, 0.0]
        size = 2 * np.sqrt(np.maximum(-half[..., 1] / 2, 0.0))
        half = half / np.where(size > 0, size, 1.0)[..., None]
        return bilinear(pixels, (half[..., 0] + 1) / 2, (half[..., 2] + 1) / 2, wrap=False)
    return bilinear(pixels, *places_on_map(directions))


def _mapped(directions, mapping):
    """Directions (..., 3) through a Mapping node's (type, location, rotation, scale), or None; of length 1."""
    if mapping is None:
        return directions
    kind, location, rotation, scale = mapping
    turn = np.array(Euler(rotation, "XYZ").to_matrix(), float)
    if kind == "TEXTURE":
        out = ((directions - location) @ turn) / np.where(scale == 0, np.inf, scale)
    elif kind == "NORMAL":
        out = (directions / np.where(scale == 0, np.inf, scale)) @ turn.T
    else:
        out = (directions * scale) @ turn.T + (location if kind == "POINT" else 0.0)
    length = np.linalg.norm(out, axis=-1, keepdims=True)
    return out / np.where(length > 0, length, 1.0)
