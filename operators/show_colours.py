"""`bpy.ops.pdm.show_colours`: the 3D views of a screen show baked colours, and are put back as they were."""

import json

from bpy.types import Operator

KEPT = "pdm_shading_before"  # custom property of a Screen: JSON of each area's shading, by the area's index
SHOWN = {"type": "SOLID", "light": "FLAT", "color_type": "VERTEX"}
PLAIN = {"show_xray": False, "show_shadows": False, "show_cavity": False, "use_dof": False}  # nothing over the colours
USUAL = {"type": "SOLID", "light": "STUDIO", "color_type": "MATERIAL"}  # of a view of which nothing is kept


def is_shown(screen):
    """Whether a 3D view of `screen` shows colours because we switched it."""
    return screen is not None and KEPT in screen and any(_shows(shading) for _, shading in _views(screen))


def show(screen):
    """Switches every 3D view to flat attribute colours; one that has been switched keeps what it was before."""
    kept = json.loads(screen.get(KEPT, "{}"))
    for index, shading in _views(screen):
        if _shows(shading):
            continue
        kept[str(index)] = {name: getattr(shading, name) for name in (*SHOWN, *PLAIN)}
        _set(shading, {**SHOWN, **PLAIN})
    screen[KEPT] = json.dumps(kept)


def put_back(screen):
    """The shading from before show(); views that the user has switched since stay as they are."""
    kept = json.loads(screen.get(KEPT, "{}"))
    screen.pop(KEPT, None)
    for index, shading in _views(screen):
        if _shows(shading):
            _set(shading, kept.get(str(index), USUAL))


def _views(screen):
    """[(index of the area, shading)] of the 3D views."""
    return [(k, area.spaces.active.shading) for k, area in enumerate(screen.areas) if area.type == "VIEW_3D"]


def _shows(shading):
    return all(getattr(shading, name) == value for name, value in SHOWN.items())


def _set(shading, values):
    """`type` last: it decides what the others of the same name belong to."""
    shading.type = "SOLID"
    for name in [name for name in values if name != "type"] + ["type"]:
        setattr(shading, name, values[name])


class PDM_OT_show_colours(Operator):
    """Show the colours as they are in every 3D view of this screen, without shading. Again: back to what it was"""

    bl_idname = "pdm.show_colours"
    bl_label = "Show Baked Colours"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return context.screen is not None

    def execute(self, context):
        (put_back if is_shown(context.screen) else show)(context.screen)
        return {"FINISHED"}
