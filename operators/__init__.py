"""Everything that reads or writes Blender's data."""

import bpy

from . import command_line, handlers, portuguese
from .bake_operator import PDM_OT_bake, PDM_OT_scan, PDM_OT_stop
from .convergence_operator import PDM_OT_convergence, PDM_OT_convergence_page
from .example_room import PDM_OT_example_room
from .export import PDM_OT_export
from .listed import PDM_PG_listed
from .live_watch import PDM_OT_free_live, PDM_OT_live
from .mend import PDM_OT_mend
from .modal_steps import stop_bake
from .preview_material import PDM_OT_preview_material
from .settings import PDM_PG_scene
from .show_colours import PDM_OT_show_colours
from .subdivide import PDM_OT_subdivide

CLASSES = (
    PDM_PG_listed,
    PDM_PG_scene,
    PDM_OT_bake,
    PDM_OT_stop,
    PDM_OT_scan,
    PDM_OT_mend,
    PDM_OT_example_room,
    PDM_OT_show_colours,
    PDM_OT_preview_material,
    PDM_OT_subdivide,
    PDM_OT_export,
    PDM_OT_convergence,
    PDM_OT_convergence_page,
    PDM_OT_live,
    PDM_OT_free_live,
)


def register():
    for cls in CLASSES:
        if cls.__doc__ and issubclass(cls, bpy.types.Operator):
            cls.bl_description = " ".join(cls.__doc__.split())  # the tooltip, without the source's line ends
        bpy.utils.register_class(cls)
    bpy.types.Scene.pdm_radiosity = bpy.props.PointerProperty(type=PDM_PG_scene)
    portuguese.register()
    command_line.register()
    handlers.register()


def unregister():
    stop_bake(bpy.context)
    handlers.unregister()
    command_line.unregister()
    portuguese.unregister()
    del bpy.types.Scene.pdm_radiosity
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
