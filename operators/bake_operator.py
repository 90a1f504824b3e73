"""`bpy.ops.pdm.bake`, `bpy.ops.pdm.scan`, and the buttons that end a bake."""

from bpy.props import BoolProperty
from bpy.types import Operator

from ..pdm_core import SceneError
from .baking.again import last
from .baking.bake import BakeSettings, bake_steps, look_at_scene
from .baking.report import one_line
from .edit_mode import object_mode
from .modal_steps import CANCEL, KEEP, Idle, Steps, current
from .settings import BakeProperties, settings_of
from .show_colours import is_shown, put_back, show
from .told import told
from .words import many, say

DOUBLE_CLICK = 0.5  # s


class PDM_OT_bake(BakeProperties, Steps, Operator):
    """Solve the light between all objects that a render shows, and write it to a colour attribute"""

    bl_idname = "pdm.bake"
    bl_label = "Bake Radiosity"
    bl_options = {"REGISTER", "UNDO"}

    can_keep = True

    @property
    def target(self):
        return self.target_error

    def make_steps(self, context):
        settings = BakeSettings(**settings_of(self))
        is_redo = self.options.is_repeat  # the Redo panel has put the scene back to what it was
        if not (is_redo or last.is_given):
            last.drop()
        keeps = last if self.in_window or is_redo else None
        self.was_shown = is_shown(context.screen)
        shows = self.in_window and context.scene.pdm_radiosity.show_after_bake
        return bake_steps(
            context, settings, lambda: self.in_window and current.wish == KEEP, keeps,
            (lambda: show(context.screen)) if shows else None,
        )  # fmt: skip

    def cancel(self, context):
        """Also before the end: the views go back to what they were while the best so far was shown."""
        super().cancel(context)
        if not self.was_shown and context.screen is not None:
            put_back(context.screen)

    def done(self, context, report):
        for warning in report["warnings"]:
            self.report({"WARNING"}, told(warning))
        self.report({"INFO"}, one_line(report))
        if self.in_window and context.scene.pdm_radiosity.show_after_bake:
            show(context.screen)
        return {"FINISHED"}


class PDM_OT_stop(Operator):
    """End what runs: nothing is changed"""

    bl_idname = "pdm.stop"
    bl_label = "Cancel"

    keep: BoolProperty(options={"SKIP_SAVE"})

    @classmethod
    def description(cls, context, properties):
        return "Stop solving and bake what there is, with its error" if properties.keep else cls.__doc__

    @classmethod
    def poll(cls, context):
        return current.stage is not None

    def execute(self, context):
        if current.elapsed() < DOUBLE_CLICK:  # on Bake, in whose place Cancel appears
            return {"CANCELLED"}
        current.wish = KEEP if self.keep else CANCEL
        return {"FINISHED"}


class PDM_OT_scan(Idle, Operator):
    """List which objects take part in the bake and which do not, with the reason"""

    bl_idname = "pdm.scan"
    bl_label = "Scan Scene"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            with object_mode(context):
                scan = look_at_scene(context)
        except SceneError as error:
            return self.refuse(error)
        context.scene.pdm_radiosity.keep_scan(scan)
        objects = many(len(scan["objects"]), "object", "objects")
        self.report({"INFO"}, say("{} recognised, {} refused", objects, len(scan["refused"])))
        return {"FINISHED"}
