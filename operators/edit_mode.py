"""Work in Object Mode: what is being edited is read and written as it stands, and edited again afterwards."""

from contextlib import contextmanager

import bpy

LEFT = {"EDIT", "SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT", "TEXTURE_PAINT", "POSE"}


@contextmanager
def object_mode(context):
    """Leaves the mode of the active object, and of all that are edited with it, and goes back to it at the end."""
    obj = context.view_layer.objects.active
    mode = obj.mode if obj is not None else "OBJECT"
    if mode not in LEFT or not bpy.ops.object.mode_set.poll():
        yield
        return
    bpy.ops.object.mode_set(mode="OBJECT")
    name = obj.name
    try:
        yield
    finally:
        if context.view_layer.objects.active == bpy.data.objects.get((name, None)):
            bpy.ops.object.mode_set(mode=mode)
