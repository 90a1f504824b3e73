"""The sidebar's panels: settings and Bake, the objects, the last report."""

from bpy.types import Panel

from ..operators.bake_operator import PDM_OT_bake
from ..operators.convergence_operator import PDM_OT_convergence, PDM_OT_convergence_page
from ..operators.graph_image import graph
from ..operators.preview_material import any_preview
from ..operators.report import counted, one_line, percent
from ..operators.settings import SETTING_NAMES
from ..operators.show_colours import is_shown
from .previews import picture
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
            history = [tuple(row) for row in PDM_OT_bake.history]
            if history:
                picture(layout, "running", str(history), lambda: graph([history], settings.target_error))
                layout.label(text="error against seconds, dotted: target")
            return
        column = layout.column()
        for name in SETTING_NAMES:
            column.prop(settings, name)
        row = layout.row()
        row.scale_y = 1.5
        operator = row.operator(PDM_OT_bake.bl_idname, icon="RENDER_STILL")
        for name in SETTING_NAMES:
            setattr(operator, name, getattr(settings, name))
        row = layout.row(align=True)
        row.operator("pdm.show_colours", icon="HIDE_OFF", depress=is_shown(context.screen))
        row.prop(settings, "show_after_bake", text="", icon="AUTO")
        row = layout.row(align=True)
        row.operator("pdm.preview_material", icon="MATERIAL").remove = False
        if any_preview():
            row.operator("pdm.preview_material", text="Remove Preview", icon="X").remove = True


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
        history = [row for row in report["history"] if row[1]]
        if history:
            level = report["settings"]["target_error"]
            picture(layout, "last", f"{history} {level}", lambda: graph([history], level))
        told = [f"{float(t):.2%}: about {s:.1f} s" for t, s in (report.get("foretold") or {}).items() if s]
        _list(layout, context, told, "foretold for tighter targets", "TIME")
        if errors := report.get("heat_map"):
            text = f"{errors['attribute']}: violet none, green half, yellow {percent(errors['top'])} of the mean light"
            wrapped(layout, context, text, "COLOR")
        _list(layout, context, report["warnings"], "warnings", "ERROR")
        baked = sorted((o for o in report["objects"] if o["baked"]), key=lambda o: -(o.get("error") or 0.0))
        _list(layout, context, [f"{o['name']}: {percent(o.get('error'))}" for o in baked], "own errors", "DOT")
        _list(layout, context, report["plan"], "plan", "DOT")


class PDM_PT_convergence(_Sidebar, Panel):
    bl_label = "Error Against Time"
    bl_parent_id = "PDM_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, last = self.layout, context.scene.pdm_radiosity.convergence()
        wrapped(layout, context, "Solves this scene to ever tighter targets, up to a minute. Nothing is changed.")
        row = layout.row(align=True)
        operator = row.operator(PDM_OT_convergence.bl_idname, icon="GRAPH")
        row.operator(PDM_OT_convergence.bl_idname, text="With Cycles").cycles = True
        operator.cycles = False
        if last is None:
            return
        curves = last["curves"]
        picture(layout, "convergence", str(curves), lambda: graph(curves, last["floor"]))
        box = layout.box().column(align=True)
        for method in dict.fromkeys(row[0] for row in last["rows"]):
            box.label(text=method.capitalize(), icon="DOT")
            for _, setting, seconds, error in (row for row in last["rows"] if row[0] == method):
                line = box.split(factor=0.55)
                line.label(text=setting)
                line.label(text=seconds)
                line.label(text=error)
        layout.operator(PDM_OT_convergence_page.bl_idname, icon="URL")
        _list(layout, context, last["said"], "said", "INFO")


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
