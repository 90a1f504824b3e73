"""The sidebar: what a bake will do, Bake, what it did; the rest folded away."""

from bpy.types import Panel, UIList

from ..operators.bake_operator import PDM_OT_bake, PDM_OT_scan, PDM_OT_stop
from ..operators.baking.left_out import other
from ..operators.baking.report import duration, percent, roughly
from ..operators.convergence_operator import PDM_OT_convergence, PDM_OT_convergence_page
from ..operators.example_room import NAME as EXAMPLE
from ..operators.example_room import PDM_OT_example_room
from ..operators.export import PDM_OT_export
from ..operators.listed import LABELS, instanced
from ..operators.live_watch import PDM_OT_free_live, PDM_OT_live, status
from ..operators.look import foreseen, is_dark, is_empty, is_surely_empty, panel_shown, summary
from ..operators.mend import PDM_OT_mend
from ..operators.modal_steps import CATEGORY, current
from ..operators.preview_material import PDM_OT_preview_material, any_preview
from ..operators.reporting.graph_image import graph
from ..operators.settings import SETTING_NAMES
from ..operators.show_colours import PDM_OT_show_colours, is_shown
from ..operators.subdivide import PDM_OT_subdivide
from ..operators.subdivide_meshes import stuck, too_coarse
from ..operators.told import told
from ..operators.words import many, say
from .previews import picture
from .wrapped import wrapped

MOST_FORESEEN = 3  # sentences; the report has them all
MUCH = 0.1  # of the colours, white in the views
MOST_LISTED = 30  # warnings; the JSON report has them all
KINDS = {"Object": "OBJECT_DATA", "Material": "MATERIAL", "World": "WORLD", "Light": "LIGHT", "Scene": "SCENE_DATA"}
ICONS = {"SPHERE": "MESH_UVSPHERE", "PLANE": "MESH_PLANE", "PLANES": "MESH_CUBE"}
DARK = "Nothing shines yet: add a light, give an object a material with Emission, or the world a colour"
SOLVES = "Solves this scene to ever tighter targets, up to a minute. Nothing is changed."
CURVE = "Error against seconds; dotted: the target"
EMPTY = "Nothing to bake yet: add a mesh object, or the example room"


class PDM_PT_bake(Panel):
    bl_label = "PDM Radiosity"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = CATEGORY

    def draw(self, context):
        """All parts in one panel: panels of their own slide to their places only some time after another has grown."""
        layout, settings = self.layout, context.scene.pdm_radiosity
        if current.stage is not None:
            _running(layout, context)
        else:
            _ready(layout, context, settings)
        for name, label, part in PARTS:
            if part in OF_REPORT and not settings.last_report:
                continue
            header, body = layout.panel(f"PDM_PT_{name}", default_closed=True)
            header.label(text=label)
            if body:
                part(body, context)


def _ready(layout, context, settings):
    """What a bake will do, its target, and what the last one did."""
    panel_shown(context)
    if is_surely_empty(settings):
        wrapped(layout, context, say(EMPTY), "INFO")
    else:
        icon, text = summary(settings)
        wrapped(layout, context, text, icon)
    if is_dark(settings):
        wrapped(layout, context, say(DARK), "LIGHT")
    elif current.problem:
        wrapped(layout, context, current.problem, "ERROR")
    for text in foreseen(settings)[:MOST_FORESEEN]:
        wrapped(layout, context, text, "ERROR")
    layout.row().prop(settings, "preset", text="")
    if settings.preset == "CUSTOM":
        layout.prop(settings, "target_error", text=percent(settings.target_error), translate=False)
    row = layout.row()
    row.scale_y = 1.6
    operator = row.operator(PDM_OT_bake.bl_idname, icon="RENDER_STILL")
    for name in SETTING_NAMES:
        setattr(operator, name, getattr(settings, name))
    if not is_empty(settings):
        _live(layout, context)
    if settings.last_report:
        _result(layout, context, settings.report())
    elif not context.scene.name.startswith(EXAMPLE):
        layout.operator(PDM_OT_example_room.bl_idname, icon="ADD")


def _running(layout, context):
    stage, column = current.stage, layout.column()
    column.progress(factor=current.done(), text=told(stage.text))
    left = current.left()
    text = duration(current.elapsed())
    wrapped(column, context, text if left is None else say("{}, about {} left", text, roughly(left)), "TIME")
    if current.target:
        text = say("Error {}, target {}", percent(stage.error), percent(current.target))
        column.label(text=text, icon="DRIVER_DISTANCE")
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
        wrapped(layout, context, say(CURVE))


def _result(layout, context, report):
    """What the last bake reached, and how to see it."""
    column = layout.column(align=True)
    reached, seconds = percent(report["error"]), f"{report['seconds']['total']:.1f} s"
    is_reached = report["error"] is not None and report["error"] <= report["settings"]["target_error"]
    if is_reached:
        wrapped(column, context, say("Error {} in {}", reached, seconds), "CHECKMARK")
    else:
        wrapped(column, context, say("Error {}: above the target", reached), "ERROR")
    if too_coarse(report):
        wrapped(column, context, say("{} off between vertices", percent(report["between_vertices"])), "ERROR")
        operator = layout.operator(PDM_OT_subdivide.bl_idname, text="Subdivide and Bake Again", icon="MOD_SUBSURF")
        operator.times, operator.rebake = 0, True
        if reasons := stuck(context.scene, report):
            wrapped(layout, context, reasons, "INFO")
    above = report.get("above_one", {"share": 0.0})  # older reports have none
    if above["share"] > MUCH:
        text = say("{} is above 1, white here: try Exposure {} (F9)", percent(above["share"]),
                   f"{above['exposure']:.1f}")  # fmt: skip
        wrapped(column, context, text, "LIGHT_SUN")
    layout.operator(PDM_OT_show_colours.bl_idname, icon="SHADING_SOLID", depress=is_shown(context.screen))
    row = layout.row(align=True)
    row.operator(PDM_OT_preview_material.bl_idname, icon="MATERIAL").remove = False
    if any_preview():
        row.operator(PDM_OT_preview_material.bl_idname, text="", icon="X").remove = True
    layout.operator(PDM_OT_export.bl_idname, icon="EXPORT")


def _live(layout, context):
    """The switch of the live light, what it takes, and what is the matter with it."""
    settings = context.scene.pdm_radiosity
    row = layout.row(align=True)
    row.operator(PDM_OT_live.bl_idname, icon="LIGHT", depress=settings.live)
    if PDM_OT_free_live.poll(context):
        row.operator(PDM_OT_free_live.bl_idname, text="", icon="X")
    icon, text = status(settings)
    if text:
        wrapped(layout, context, text, icon)


def _advanced(layout, context):
    settings = context.scene.pdm_radiosity
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.enabled = current.stage is None
    idle = {"layer": settings.blend == "REPLACE", "ao_distance": "AO" not in settings.passes}
    for name in SETTING_NAMES:
        if not idle.get(name):
            layout.prop(settings, name)
    layout.prop(settings, "show_after_bake")


class PDM_UL_objects(UIList):
    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0, flt_flag=0):
        row = layout.row()
        row.active = not _is_gone(context, item.name)
        icon = ICONS.get(item.kind, "MESH_DATA") if item.kind else "CANCEL"
        row.label(text=item.name, icon=icon, translate=False)
        value = row.row()
        value.alignment = "RIGHT"
        if item.between >= 0:
            value.alert = item.is_coarse
            value.label(text=percent(item.between))
        elif item.reason and item.kind:
            value.label(icon="INFO")


def _objects(layout, context):
    settings = context.scene.pdm_radiosity
    layout.enabled = current.stage is None
    layout.template_list("PDM_UL_objects", "", settings, "listed", settings, "listed_index", rows=5)
    scan = settings.scan()
    if 0 <= settings.listed_index < len(settings.listed):
        _chosen(layout, context, settings.listed[settings.listed_index])
    if scan and scan["hidden"]:
        hidden = many(scan["hidden"], "mesh object", "mesh objects")
        wrapped(layout, context, say("{} hidden from the render: left out", hidden), "HIDE_ON")
    _list(layout, context, scan["warnings"] if scan else [], "Notes", "ERROR")
    layout.operator(PDM_OT_scan.bl_idname, icon="FILE_REFRESH")


def _is_gone(context, name):
    return not instanced(name) and context.view_layer.objects.get(name) is None


def _chosen(layout, context, item):
    """What the row clicked is, and what mends it."""
    box = layout.box().column()
    if _is_gone(context, item.name):
        wrapped(box, context, say("{} was removed or renamed", repr(item.name)), "ERROR")
        return
    wrapped(box, context, f"{item.name!r}: {item.label}" if item.label else repr(item.name))
    if item.reason:
        wrapped(box, context, item.reason, "ERROR")
    if item.mend:
        operator = box.operator(PDM_OT_mend.bl_idname, text=LABELS[item.mend], icon="TOOL_SETTINGS")
        operator.object, operator.way = item.name, item.mend
    if item.is_coarse:
        wrapped(box, context, say("Colours between its vertices are {} off", percent(item.between)), "ERROR")
        operator = box.operator(PDM_OT_subdivide.bl_idname, icon="MOD_SUBSURF")
        operator.times, operator.objects, operator.rebake = 0, "SELECTED", False


def _report(layout, context):
    report = context.scene.pdm_radiosity.report()
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
        line.label(text=say(name))
        line.label(text=value, translate=False)
    history = [row for row in report["history"] if row[1]]
    if history:
        level = report["settings"]["target_error"]
        picture(layout, "last", f"{history} {level}", lambda: graph([history], level))
        wrapped(layout, context, say(CURVE))
    foretold = {float(target): s for target, s in (report.get("foretold") or {}).items() if s}
    tighter = {target: s for target, s in foretold.items() if target < (report["error"] or 0.0)}
    texts = [say("{}: about {}", percent(target), roughly(s)) for target, s in tighter.items()]
    _list(layout, context, texts, "For tighter targets", "TIME")
    if errors := report.get("heat_map"):
        top = percent(errors["top"])
        text = say("{}: violet none, green half, yellow {} of the mean light", errors["attribute"], top)
        wrapped(layout, context, text, "COLOR")
    _list(layout, context, other(report["warnings"]), "Warnings", "ERROR")
    _left_out(layout, context, report["left_out"])


def _left_out(layout, context, rows):
    """The report's table: of whom, what, what comes of it, what to do."""
    if not rows:
        return
    layout.label(text=f"{say('Left out or approximated')} ({len(rows)})")
    for row in rows[:MOST_LISTED]:
        box = layout.box().column(align=True)
        name = row["name"] if row["name"][:1] in "'\"" else repr(row["name"])  # of several, as they are listed
        wrapped(box, context, f"{name} {row['what']}", KINDS[row["kind"]])
        if row["effect"]:
            wrapped(box, context, row["effect"], "BLANK1")
        if row["advice"]:
            wrapped(box, context, row["advice"], "TOOL_SETTINGS")
    if len(rows) > MOST_LISTED:
        layout.label(text=say("and {} more", f"{len(rows) - MOST_LISTED:,}"))


def _details(layout, context):
    report = context.scene.pdm_radiosity.report()
    _list(layout, context, report["plan"], "Plan", "DOT")
    baked = sorted((o for o in report["objects"] if o["baked"]), key=lambda o: -(o.get("error") or 0.0))
    _list(layout, context, [f"{o['name']!r}: {percent(o.get('error'))}" for o in baked], "Own errors", "DOT")
    seconds = [f"{say(name.capitalize())}: {value:.2f} s" for name, value in report["seconds"].items()]
    _list(layout, context, seconds, "Time", "TIME")


def _convergence(layout, context):
    last = context.scene.pdm_radiosity.convergence()
    wrapped(layout, context, say(SOLVES))
    column = layout.column(align=True)  # beside one another their names would be clipped
    operator = column.operator(PDM_OT_convergence.bl_idname, icon="GRAPH")
    column.operator(PDM_OT_convergence.bl_idname, text="With Cycles").cycles = True
    operator.cycles = False
    if last is None:
        return
    curves = last["curves"]
    picture(layout, "convergence", str(curves), lambda: graph(curves, last["floor"]))
    box = layout.box().column(align=True)
    for method in dict.fromkeys(row[0] for row in last["rows"]):
        box.label(text=told(method).capitalize(), icon="DOT")
        for _, setting, seconds, error in (row for row in last["rows"] if row[0] == method):
            line = box.split(factor=0.55)
            line.label(text=told(setting))
            line.label(text=seconds)
            line.label(text=error)
    layout.operator(PDM_OT_convergence_page.bl_idname, icon="URL")
    _list(layout, context, last["said"], "Said", "INFO")


def _list(layout, context, texts, title, icon):
    if not texts:
        return
    box = layout.box().column(align=True)
    box.label(text=f"{say(title)} ({len(texts)})")
    for text in texts[:MOST_LISTED]:
        wrapped(box, context, text, icon)
    if len(texts) > MOST_LISTED:
        box.label(text=say("and {} more", f"{len(texts) - MOST_LISTED:,}"))


PARTS = (
    ("advanced", "Advanced", _advanced),
    ("objects", "Objects", _objects),
    ("report", "Report", _report),
    ("details", "Details", _details),
    ("convergence", "Error Against Time", _convergence),
)
OF_REPORT = (_report, _details)
