"""The sidebar's panels: settings and Bake, the objects, the last report."""

from bpy.types import Panel

from ..operators.bake_operator import PDM_OT_bake
from ..operators.report import counted, one_line, percent
from ..operators.settings import SETTING_NAMES
from .wrapped import wrapped

MOST_LISTED = 30  # objects and warnings; the JSON report has them all


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "PDM"


class PDM_PT_bake(_Sidebar, Panel):
    bl_label = "PDM Radiosity"

    def draw(self, context):
        layout, settings, stage = self.layout, context.scene.pdm_radiosity, PDM_OT_bake.stage
        layout.use_property_split = True
        layout.use_property_decorate = False
        if stage is not None:
            layout.progress(factor=stage.fraction, text=stage.text)
            layout.label(text=f"Estimated error {percent(stage.error)}")
            layout.label(text="cancels", icon="EVENT_ESC")
            return
        column = layout.column()
        for name in SETTING_NAMES:
            column.prop(settings, name)
        row = layout.row()
        row.scale_y = 1.5
        operator = row.operator(PDM_OT_bake.bl_idname, icon="RENDER_STILL")
        for name in SETTING_NAMES:
            setattr(operator, name, getattr(settings, name))


class PDM_PT_objects(_Sidebar, Panel):
    bl_label = "Objects"
    bl_parent_id = "PDM_PT_bake"

    def draw(self, context):
        layout, scan = self.layout, context.scene.pdm_radiosity.scan()
        layout.operator("pdm.scan", icon="VIEWZOOM")
        if scan is None:
            wrapped(layout, context, "Shows which objects take part, and why others do not.")
            return
        _list(layout, context, [f"{o['name']}: {_what(o)}" for o in scan["objects"]], "recognised", "CHECKMARK")
        _list(layout, context, [f"{r['name']} {r['reason']}" for r in scan["refused"]], "refused", "CANCEL")
        if scan["hidden"]:
            wrapped(
                layout, context, f"{counted(scan['hidden'], 'mesh object')} hidden from the render: left out", "HIDE_ON"
            )
        _list(layout, context, scan["warnings"], "warnings", "ERROR")


class PDM_PT_report(_Sidebar, Panel):
    bl_label = "Last Report"
    bl_parent_id = "PDM_PT_bake"

    @classmethod
    def poll(cls, context):
        return bool(context.scene.pdm_radiosity.last_report)

    def draw(self, context):
        layout, report = self.layout, context.scene.pdm_radiosity.report()
        wrapped(layout, context, one_line(report), "INFO")
        _list(layout, context, report["warnings"], "warnings", "ERROR")
        baked = sorted((o for o in report["objects"] if o["baked"]), key=lambda o: -(o.get("error") or 0.0))
        _list(layout, context, [f"{o['name']}: {percent(o.get('error'))}" for o in baked], "own errors", "DOT")
        _list(layout, context, report["plan"], "plan", "DOT")


def _what(entry):
    return f"{entry['label']}; not baked, it {entry['reason']}" if entry["reason"] else entry["label"]


def _list(layout, context, texts, title, icon):
    if not texts:
        return
    box = layout.box().column(align=True)
    box.label(text=f"{title.capitalize()} ({len(texts)})")
    for text in texts[:MOST_LISTED]:
        wrapped(box, context, text, icon)
    if len(texts) > MOST_LISTED:
        box.label(text=f"and {len(texts) - MOST_LISTED:,} more")
