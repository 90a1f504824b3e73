"""What the user sees; no logic."""

import bpy

from . import previews
from .panels import PDM_PT_bake, PDM_UL_objects

CLASSES = (PDM_UL_objects, PDM_PT_bake)


def register():
    previews.register()
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    previews.unregister()
