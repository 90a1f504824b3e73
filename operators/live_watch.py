"""Watches the scene while Live is on: new light is written at once, new geometry ends it."""

import time
import traceback

import bpy
from bpy.types import Operator

from ..pdm_core import SceneError
from .baking.colour_attribute import BakeError
from .live import UNSEEN, live, relight, shown_by
from .modal_steps import Idle, current, redraw_sidebars
from .settings import settings_of
from .words import say

BEGIN = "Bake to begin"
MOVED = "What shapes the light has changed; bake again to go on"


def note(depsgraph):
    """Marks what has changed: light is stale, geometry drops what is held."""
    held = live.held
    if held is None or live.is_own or current.stage is not None or depsgraph.scene.name != held.scene:
        return
    for update in depsgraph.updates:
        of_all = isinstance(update.id, bpy.types.Collection | bpy.types.Scene)
        if _is_shape(update) or (of_all and held.shown != shown_by(depsgraph.view_layer)):
            live.drop(MOVED)
            return
        if isinstance(update.id, bpy.types.Material):
            held.stale.add(update.id.original.name_full)
        elif isinstance(update.id, bpy.types.Light):
            held.stale.add("LIGHT")
        elif isinstance(update.id, bpy.types.World):
            held.stale.add("WORLD")


def _is_shape(update):
    """Whether an update is one of geometry. Of a light any change of its data counts as one of its object's."""
    changed = update.is_updated_geometry or update.is_updated_transform
    if isinstance(update.id, bpy.types.Object) and update.id.type == "LIGHT":
        return update.is_updated_transform
    if isinstance(update.id, bpy.types.Object):
        return changed and update.id.type not in UNSEEN
    # of a mesh all else is told of its object
    return isinstance(update.id, bpy.types.Mesh) and update.is_updated_geometry


def follow(context):
    """Writes what is stale, or says why it cannot."""
    held, start = live.held, time.perf_counter()
    try:
        relight(context)
        held.problem, held.seconds = "", time.perf_counter() - start
    except (BakeError, SceneError) as error:
        held.problem = str(error)
    except Exception as error:  # raised further, it would only come again with the next change
        traceback.print_exc()
        live.drop(f"Live failed, please report the console's text: {error}")


def changed(scene, depsgraph):
    note(depsgraph)
    is_due = live.held is not None and live.held.stale and not bpy.app.background  # where timers never come
    if is_due and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0.0)


def forget():
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    live.drop()


def _tick():
    windows = bpy.context.window_manager.windows
    window = next((w for w in windows if live.held is not None and w.scene.name == live.held.scene), None)
    if window is not None and current.stage is None:
        with bpy.context.temp_override(window=window):
            follow(bpy.context)
            redraw_sidebars(bpy.context)
    return None


class PDM_OT_live(Idle, Operator):
    """New colours, emission, lights and world strengths are in the colours at once, until something moves. Bakes
    first, to find out about the geometry"""

    bl_idname = "pdm.live"
    bl_label = "Live"

    def execute(self, context):
        return self.switch(context, "EXEC_DEFAULT")

    def invoke(self, context, event):
        return self.switch(context, "INVOKE_DEFAULT")

    def switch(self, context, way):
        """On: what is not held yet is baked."""
        settings = context.scene.pdm_radiosity
        settings.live = not settings.live
        if settings.live and (live.held is None or live.held.scene != context.scene.name):
            bpy.ops.pdm.bake(way, **settings_of(settings))
        return {"FINISHED"}


class PDM_OT_free_live(Operator):
    """Free the memory that Live takes. The colours stay as they are"""

    bl_idname = "pdm.free_live"
    bl_label = "Free"

    @classmethod
    def poll(cls, context):
        return live.held is not None

    def execute(self, context):
        live.drop()
        context.scene.pdm_radiosity.live = False
        return {"FINISHED"}


def status(settings):
    """(icon, text): how Live is, on one line; (None, '') where it is off."""
    if not settings.live:
        return None, ""
    if live.held is None:
        return "INFO", say(live.dropped or BEGIN)
    if live.held.problem:
        return "ERROR", live.held.problem
    text = say("{} MB kept", f"{live.held.kept.bytes / 1e6:,.0f}")
    if live.held.seconds:
        text += say(", {} ms a change", f"{1000 * live.held.seconds:.0f}")
    return "CHECKMARK", text
