"""The sidebar: what a bake will do, Bake, what it did; the rest folded away."""

from bpy.types import Panel, UIList

from ..operators.bake_operator import PDM_OT_bake, PDM_OT_scan, PDM_OT_stop
from ..operators.baking.report import counted, duration, percent
from ..operators.convergence_operator import PDM_OT_convergence, PDM_OT_convergence_page
from ..operators.example_room import NAME as EXAMPLE
from ..operators.example_room import PDM_OT_example_room
from ..operators.listed import LABELS
from ..operators.live_watch import PDM_OT_free_live, status
from ..operators.look import is_dark, is_empty, panel_shown, summary
from ..operators.mend import PDM_OT_mend
from ..operators.modal_steps import CATEGORY, current
from ..operators.preview_material import PDM_OT_preview_material, any_preview
from ..operators.reporting.graph_image import graph
from ..operators.settings import SETTING_NAMES
from ..operators.show_colours import PDM_OT_show_colours, is_shown
from ..operators.subdivide import PDM_OT_subdivide, too_coarse
from .previews import picture
from .wrapped import wrapped

MOST_LISTED = 30  # warnings; the JSON report has them all
ICONS = {"SPHERE": "MESH_UVSPHERE", "PLANE": "MESH_PLANE", "PLANES": "MESH_CUBE"}
DARK = "Nothing shines yet: add a light, give an object a material with Emission, or the world a colour"
CURVE = "Error against seconds; dotted: the target"
EMPTY = "Nothing to bake yet: add a mesh object, or the example room"


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = CATEGORY


class _Part(_Sidebar):
    bl_parent_id = "PDM_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}


class PDM_PT_bake(_Sidebar, Panel):
    bl_label = "PDM Radiosity"

    def draw(self, context):
        layout, settings = self.layout, context.scene.pdm_radiosity
        if current.stage is not None:
            _running(layout, context)
            return
        panel_shown(context)
        if is_empty(settings):
            wrapped(layout, context, EMPTY, "INFO")
        else:
            icon, text = summary(settings)
            wrapped(layout, context, text, icon)
        if is_dark(settings):
            wrapped(layout, context, DARK, "LIGHT")
        layout.row().prop(settings, "preset", text="")
        if settings.preset == "CUSTOM":
            layout.prop(settings, "target_error", text=percent(settings.target_error))
        row = layout.row()
        row.scale_y = 1.6
        operator = row.operator(PDM_OT_bake.bl_idname, icon="RENDER_STILL")
        for name in SETTING_NAMES:
            setattr(operator, name, getattr(settings, name))
        if settings.last_report:
            _result(layout, context, settings.report())
        elif not context.scene.name.startswith(EXAMPLE):
            layout.operator(PDM_OT_example_room.bl_idname, icon="ADD")


def _running(layout, context):
    stage, column = current.stage, layout.column()
    column.progress(factor=current.done(), text=stage.text)
    left = current.left()
    row = column.row()
    row.label(text=duration(current.elapsed()), icon="TIME")
    if left is not None:
        row.label(text=f"about {duration(left)} left")
    if current.target:
        column.label(text=f"Error {percent(stage.error)}, target {percent(current.target)}", icon="DRIVER_DISTANCE")
    row = layout.row(align=True)
    row.scale_y = 1.3
    row.operator(PDM_OT_stop.bl_idname, icon="EVENT_ESC").keep = False
    if current.can_keep:
        keep = layout.row()
        keep.enabled = current.can_be_kept()
        keep.operator(PDM_OT_stop.bl_idname, text="Keep the Best So Far", icon="CHECKMARK").keep = True
    history = [tuple(row) for row in current.history]
    if len(history) > 1:
        picture(layout, "running", str(history), lambda: graph([history], current.target or None))
        wrapped(layout, context, CURVE)


def _result(layout, context, report):
    """What the last bake reached, and how to see it."""
    column = layout.column(align=True)
    text = f"Error {percent(report['error'])} in {report['seconds']['total']:.1f} s"
    is_reached = report["error"] is not None and report["error"] <= report["settings"]["target_error"]
    column.label(text=text, icon="CHECKMARK" if is_reached else "ERROR")
    if too_coarse(report):
        wrapped(column, context, f"{percent(report['between_vertices'])} off between vertices", "ERROR")
        operator = layout.operator(PDM_OT_subdivide.bl_idname, text="Subdivide and Bake Again", icon="MOD_SUBSURF")
        operator.times, operator.rebake = 0, True
    layout.operator(PDM_OT_show_colours.bl_idname, icon="SHADING_SOLID", depress=is_shown(context.screen))
    _live(layout, context)
    row = layout.row(align=True)
    row.operator(PDM_OT_preview_material.bl_idname, icon="MATERIAL").remove = False
    if any_preview():
        row.operator(PDM_OT_preview_material.bl_idname, text="", icon="X").remove = True


def _live(layout, context):
    """The switch of the live light, what it takes, and what is the matter with it."""
    settings = context.scene.pdm_radiosity
    row = layout.row(align=True)
    row.prop(settings, "live", toggle=True, icon="LIGHT")
    if PDM_OT_free_live.poll(context):
        row.operator(PDM_OT_free_live.bl_idname, text="", icon="X")
    icon, text = status(settings)
    if text:
        wrapped(layout, context, text, icon)


class PDM_PT_advanced(_Part, Panel):
    bl_label = "Advanced"

    def draw(self, context):
        layout, settings = self.layout, context.scene.pdm_radiosity
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.enabled = current.stage is None
        for name in SETTING_NAMES:
            if name != "layer" or settings.blend != "REPLACE":
                layout.prop(settings, name)
        layout.prop(settings, "show_after_bake")


class PDM_UL_objects(UIList):
    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0, flt_flag=0):
        row = layout.row()
        row.active = not _is_gone(context, item.name)
        row.label(text=item.name, icon=ICONS.get(item.kind, "MESH_DATA") if item.kind else "CANCEL")
        value = row.row()
        value.alignment = "RIGHT"
        if item.between >= 0:
            value.alert = item.is_coarse
            value.label(text=percent(item.between))
        elif item.reason and item.kind:
            value.label(icon="INFO")


class PDM_PT_objects(_Part, Panel):
    bl_label = "Objects"

    def draw(self, context):
        layout, settings = self.layout, context.scene.pdm_radiosity
        layout.enabled = current.stage is None
        layout.template_list("PDM_UL_objects", "", settings, "listed", settings, "listed_index", rows=5)
        scan = settings.scan()
        if 0 <= settings.listed_index < len(settings.listed):
            _chosen(layout, context, settings.listed[settings.listed_index])
        if scan and scan["hidden"]:
            wrapped(
                layout, context, f"{counted(scan['hidden'], 'mesh object')} hidden from the render: left out", "HIDE_ON"
            )
        _list(layout, context, scan["warnings"] if scan else [], "notes", "ERROR")
        layout.operator(PDM_OT_scan.bl_idname, icon="FILE_REFRESH")


def _is_gone(context, name):
    return context.view_layer.objects.get(name) is None


def _chosen(layout, context, item):
    """What the row clicked is, and what mends it."""
    box = layout.box().column()
    if _is_gone(context, item.name):
        wrapped(box, context, f"{item.name} was removed or renamed", "ERROR")
        return
    wrapped(box, context, f"{item.name}: {item.label}" if item.label else item.name)
    if item.reason:
        wrapped(box, context, item.reason[:1].upper() + item.reason[1:], "ERROR")
    if item.mend:
        operator = box.operator(PDM_OT_mend.bl_idname, text=LABELS[item.mend], icon="TOOL_SETTINGS")
        operator.object, operator.way = item.name, item.mend
    if item.is_coarse:
        wrapped(box, context, f"Colours between its vertices are {percent(item.between)} off", "ERROR")
        operator = box.operator(PDM_OT_subdivide.bl_idname, icon="MOD_SUBSURF")
        operator.times, operator.objects, operator.rebake = 0, "SELECTED", False


class PDM_PT_report(_Part, Panel):
    bl_label = "Report"

    @classmethod
    def poll(cls, context):
        return bool(context.scene.pdm_radiosity.last_report)

    def draw(self, context):
        layout, report = self.layout, context.scene.pdm_radiosity.report()
        baked = [o for o in report["objects"] if o["baked"]]
        column = layout.column(align=True)
        for name, value in (
            ("Objects baked", f"{len(baked):,}"),
            ("Vertices", f"{report['vertices']:,}"),
            ("Error", percent(report["error"])),
            ("Between vertices", percent(report["between_vertices"])),
            ("Seconds", f"{report['seconds']['total']:.2f}"),
        ):
            line = column.split(factor=0.6)
            line.label(text=name)
            line.label(text=value)
        history = [row for row in report["history"] if row[1]]
        if history:
            level = report["settings"]["target_error"]
            picture(layout, "last", f"{history} {level}", lambda: graph([history], level))
            wrapped(layout, context, CURVE)
        told = [f"{float(t):.2%}: about {s:.1f} s" for t, s in (report.get("foretold") or {}).items() if s]
        _list(layout, context, told, "for tighter targets", "TIME")
        if errors := report.get("heat_map"):
            text = f"{errors['attribute']}: violet none, green half, yellow {percent(errors['top'])} of the mean light"
            wrapped(layout, context, text, "COLOR")
        _list(layout, context, report["warnings"], "warnings", "ERROR")
        left_out = [f"{entry['name']} {entry['reason']}" for entry in report["refused"]]
        _list(layout, context, left_out, "left out", "CANCEL")


class PDM_PT_details(_Part, Panel):
    bl_label = "Details"

    @classmethod
    def poll(cls, context):
        return bool(context.scene.pdm_radiosity.last_report)

    def draw(self, context):
        layout, report = self.layout, context.scene.pdm_radiosity.report()
        _list(layout, context, report["plan"], "plan", "DOT")
        baked = sorted((o for o in report["objects"] if o["baked"]), key=lambda o: -(o.get("error") or 0.0))
        _list(layout, context, [f"{o['name']}: {percent(o.get('error'))}" for o in baked], "own errors", "DOT")
        seconds = [f"{name}: {value:.2f} s" for name, value in report["seconds"].items()]
        _list(layout, context, seconds, "time", "TIME")


class PDM_PT_convergence(_Part, Panel):
    bl_label = "Error Against Time"

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


def _list(layout, context, texts, title, icon):
    if not texts:
        return
    box = layout.box().column(align=True)
    box.label(text=f"{title.capitalize()} ({len(texts)})")
    for text in texts[:MOST_LISTED]:
        wrapped(box, context, text, icon)
    if len(texts) > MOST_LISTED:
        box.label(text=f"and {len(texts) - MOST_LISTED:,} more")
