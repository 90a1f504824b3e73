"""`bpy.ops.pdm.bake` and `bpy.ops.pdm.scan`, and how work runs: at once in scripts, in slices in a window."""

import json
import time
import traceback

from bpy.types import Operator

from ..pdm_core import SceneError
from ..pdm_core.signs_of_life import finish
from .bake import BakeSettings, Stage, bake_steps
from .colour_attribute import BakeError
from .edit_mode import object_mode
from .read_scene import read_scene
from .report import one_line, scan_result
from .settings import SETTING_NAMES, BakeProperties

TICK = 0.02  # s between timer events
SLICE = 0.05  # s of work at each
NAVIGATION = set("MOUSEMOVE MIDDLEMOUSE WHEELUPMOUSE WHEELDOWNMOUSE TRACKPADPAN TRACKPADZOOM MOUSEROTATE".split())


class Steps:
    """Mixed into operators whose work is a generator of Stages: at once in scripts, in slices with a progress bar in a
    window. make_steps(context) is the generator, done(context, result) reports what it returns."""

    @classmethod
    def poll(cls, context):
        if PDM_OT_bake.stage is not None:
            cls.poll_message_set("A bake is running")
        return PDM_OT_bake.stage is None and context.scene is not None

    def execute(self, context):
        try:
            with object_mode(context):
                result = finish(self.make_steps(context))
        except (BakeError, SceneError) as error:
            return self.fail(error)
        return self.done(context, result)

    def invoke(self, context, event):
        self.steps = self.make_steps(context)
        self.begun, PDM_OT_bake.history = time.perf_counter(), []
        PDM_OT_bake.stage = Stage("Reading the scene", 0.0, float("inf"))
        self.timer = context.window_manager.event_timer_add(TICK, window=context.window)
        PDM_OT_bake.running = self.steps, self.timer
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if PDM_OT_bake.running is None or PDM_OT_bake.running[0] is not self.steps:
            return {"CANCELLED"}  # the add-on was disabled meanwhile
        if event.type == "ESC":
            return self.stopped(context)
        if event.type != "TIMER":
            # looking around is allowed, editing the scene under the bake is not
            return {"PASS_THROUGH" if event.type in NAVIGATION else "RUNNING_MODAL"}
        try:
            self.advance(context)
        except StopIteration as end:
            self.cancel(context)
            return self.done(context, end.value)
        except (BakeError, SceneError) as error:
            self.cancel(context)
            return self.fail(error)
        except Exception as error:
            # raised further, Blender would go on calling a bake that is dead
            self.cancel(context)
            traceback.print_exc()
            return self.fail(f"The bake failed, please report the console's text: {type(error).__name__}: {error}")
        return {"RUNNING_MODAL"}

    def advance(self, context):
        """One slice of the work; StopIteration carries the result."""
        until = time.perf_counter() + SLICE
        while time.perf_counter() < until:
            PDM_OT_bake.stage = next(self.steps)
            error = PDM_OT_bake.stage.error
            if error < (PDM_OT_bake.history[-1][1] if PDM_OT_bake.history else float("inf")):
                PDM_OT_bake.history.append((time.perf_counter() - self.begun, error))
        redraw_sidebars(context)

    def stopped(self, context):
        """Esc was pressed."""
        self.cancel(context)
        self.report({"INFO"}, f"{self.bl_label} cancelled, nothing was changed")
        return {"CANCELLED"}

    def cancel(self, context):
        """Also called by Blender, when the window closes or another file is loaded."""
        stop_bake(context)
        redraw_sidebars(context)

    def fail(self, error):
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


class PDM_OT_bake(BakeProperties, Steps, Operator):
    """Solve the light between UV spheres, planes and boxes, and write it to a colour attribute"""

    bl_idname = "pdm.bake"
    bl_label = "Bake Radiosity"
    bl_options = {"REGISTER", "UNDO"}

    # of what runs, for the sidebar; on the class: one bake or convergence runs at a time
    stage = None  # its Stage
    running = None  # its (steps, timer)
    history = ()  # [(seconds, error)] so far

    def make_steps(self, context):
        return bake_steps(context, BakeSettings(**{name: getattr(self, name) for name in SETTING_NAMES}))

    def done(self, context, report):
        for warning in report["warnings"]:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, one_line(report))
        return {"FINISHED"}


def stop_bake(context):
    """Ends the bake that runs in a window, if any: nothing of it is kept. Also when the add-on is disabled."""
    if PDM_OT_bake.running is not None:
        steps, timer = PDM_OT_bake.running
        steps.close()
        context.window_manager.event_timer_remove(timer)
    PDM_OT_bake.stage = PDM_OT_bake.running = None


class PDM_OT_scan(Operator):
    """List which objects take part in the bake and which do not, with the reason"""

    bl_idname = "pdm.scan"
    bl_label = "Scan Scene"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            with object_mode(context):
                scan = scan_result(read_scene(context))
        except SceneError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.pdm_radiosity.last_scan = json.dumps(scan)
        self.report({"INFO"}, f"{len(scan['objects'])} objects recognised, {len(scan['refused'])} refused")
        return {"FINISHED"}


def redraw_sidebars(context):
    """Only the sidebar: a whole viewport takes longer to draw than a slice."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
