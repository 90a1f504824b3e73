"""The light multiplied into, or added to, another colour layer of the meshes, which itself stays as it is: the next
bake starts from it again."""

import bpy
import numpy as np

from ..reading.read_scene import some
from .colour_attribute import BakeError, Colours, values_in

WAYS = {"MULTIPLY": np.multiply, "ADD": np.add}
DONE = {"MULTIPLY": "multiplied into", "ADD": "added to"}


def check_layer(settings, written, targets):
    """Raises BakeError where the layer that the settings name cannot be blended with; written: names that the bake
    writes. Returns a warning in a list where some of the targets lack it."""
    name = settings.layer
    if settings.blend not in WAYS:
        return []
    if not name.strip():
        raise BakeError(f"Name the colour layer that the light is to be {DONE[settings.blend]}")
    if name in written:
        raise BakeError(
            f"The bake writes {name!r} itself: choose another Attribute for the result, and {name!r} stays as it is"
        )
    lacking = [target.name for target in targets if name not in target.object.data.color_attributes]
    if len(lacking) == len(targets):
        raise BakeError(f"No object that is baked has a colour layer {name!r}; check its name, or bake without Blend")
    return [f"{some('object', lacking)} got the light alone, without a colour layer {name!r}"] if lacking else []


def blended(settings, item):
    """Colours of the light -> Colours with the layer of its object, if there is one."""
    if settings.blend not in WAYS:
        return item
    mesh = bpy.data.objects[item.object_name, None].data
    layer = mesh.color_attributes.get(settings.layer)
    if layer is None:
        return item
    base = _on_domain(mesh, values_in(layer), layer.domain, item.domain)
    colours = base.copy()
    colours[:, :3] = WAYS[settings.blend](base[:, :3], item.colours[:, :3])
    return Colours(item.object_name, item.domain, colours)


def _on_domain(mesh, colours, domain, wanted):
    """Colours (n, 4) of points or corners as those of the other, points as the means of their corners."""
    if domain == wanted:
        return colours
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    if wanted == "CORNER":
        return colours[vertex]
    count = np.maximum(np.bincount(vertex, minlength=len(mesh.vertices)), 1)
    sums = [np.bincount(vertex, colours[:, k], len(mesh.vertices)) for k in range(4)]
    return (np.stack(sums, axis=1) / count[:, None]).astype(np.float32)
