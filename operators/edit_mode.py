"""Work in Object Mode: what is being edited is read and written as it stands, and edited again afterwards."""

from contextlib import contextmanager

import bpy

LEFT = {"EDIT", "SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT", "TEXTURE_PAINT", "POSE"}


@contextmanager
def object_mode(context):
    """Leaves the modes of all objects of the view layer, active, selected, shown or not, and puts them back into theirs
    at the end, and no other."""
    modes = {}
    for obj in context.view_layer.objects:
        if obj.mode in LEFT:
            modes.setdefault((obj.type, obj.mode), []).append(obj)
    left = [(mode, [obj.name for obj in some]) for (_, mode), some in modes.items() if _set("OBJECT", some, context)]
    try:
        yield
    finally:
        layer = context.view_layer.objects
        for mode, names in left:
            _set(mode, [layer[name] for name in names if name in layer], context)


def _set(mode, objects, context):
    """Brings objects of one type into a mode, whatever is active, selected or hidden; False where Blender has none."""
    layer = context.view_layer
    active = layer.objects.active
    objects.sort(key=lambda obj: obj != active)  # first what is active: it stays so
    selected, hidden = {obj for obj in layer.objects if obj.select_get()}, [obj for obj in objects if obj.hide_get()]
    for obj in hidden:
        obj.hide_set(False)
    for obj in selected.union(objects):
        obj.select_set(obj in objects)
    layer.objects.active = objects[0] if objects else active
    able = bool(objects) and bpy.ops.object.mode_set.poll()
    if able:
        bpy.ops.object.mode_set(mode=mode)
    layer.objects.active = active
    for obj in selected.union(objects):
        obj.select_set(obj in selected)
    for obj in hidden:
        obj.hide_set(True)
    return able
