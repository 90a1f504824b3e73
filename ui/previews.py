"""Pictures in panels: Blender keeps them in a preview collection, made when the add-on is enabled."""

import bpy.utils.previews

SCALE = 8.0  # of a picture, in icons'

_kept, _keys = [], {}


def register():
    _kept.append(bpy.utils.previews.new())


def unregister():
    while _kept:
        bpy.utils.previews.remove(_kept.pop())
    _keys.clear()


def picture(layout, name, key, draw):
    """Shows draw(), (rows, columns, 4) floats, as the picture `name`; drawn anew where key, a text, is another."""
    collection = _kept[0]
    if name not in collection:
        collection.new(name)
    entry = collection[name]
    if getattr(entry, "image_size", (0, 0))[0] == 0 or _keys.get(name) != key:
        pixels = draw()
        entry.image_size = entry.icon_size = pixels.shape[1], pixels.shape[0]
        for target in ("image_pixels_float", "icon_pixels_float"):
            setattr(entry, target, pixels.ravel())
        _keys[name] = key
    layout.template_icon(icon_value=entry.icon_id, scale=SCALE)
