"""What the user sees; no logic."""

import bpy

from .panels import PDM_PT_bake, PDM_PT_objects, PDM_PT_report

CLASSES = (PDM_PT_bake, PDM_PT_objects, PDM_PT_report)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
