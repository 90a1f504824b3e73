"""The sidebar's list of objects: what each is, how far off its colours are between the vertices, why it is refused."""

from bpy.props import BoolProperty, FloatProperty, StringProperty
from bpy.types import PropertyGroup

# Nothing here may lead to the module bpy: 4.2 keeps the class that these are properties of, and crashes at exit where
# that keeps bpy.

WAYS = {  # what the reason says: (what is done, the button)
    "single-user copy": ("SINGLE_USER", "Make Single User"),
    "apply or remove it": ("APPLY", "Apply Modifiers"),
    "normals face away": ("FLIP", "Flip Normals"),
    "convert it to a mesh": ("CONVERT", "Convert to Mesh"),
    "make it real": ("REAL", "Make Instances Real"),
    "make it local": ("LOCAL", "Make Local"),
}
LABELS = dict(WAYS.values())


def mend_for(reason):
    """The way that helps against a reason, or ''."""
    if "its parent" in reason:  # it would go on deforming what was applied
        return ""
    return next((way for words, (way, _) in WAYS.items() if words in reason), "")


def instanced(name):
    """The name of the object that 'Thing (instance 3)' is an instance of, or '' where that is no instance's name."""
    return name.rpartition(" (instance ")[0] if name.endswith(")") else ""


AWAY = "is lit only from the side that its normals face away from: the baked side stays black"


class PDM_PG_listed(PropertyGroup):
    """One object. `name` is the object's; between: relative error, negative where it was not baked."""

    kind: StringProperty(description="SPHERE, PLANE, PLANES, SHAPES and so on; empty where it is refused")
    label: StringProperty(description="What it was recognised as")
    reason: StringProperty(description="Why it is refused or not baked, going on after its name")
    mend: StringProperty(description="What bpy.ops.pdm.mend can do about the reason")
    between: FloatProperty(default=-1.0)
    is_coarse: BoolProperty(description="Whether its colours between the vertices are further off than the target")


def fill(listed, scan, report):
    """Lists the objects of a scan, the refused first, with what the last report (or None) says of each."""
    rows = [{"name": r["name"], "reason": r["reason"]} for r in scan["refused"]]
    last = {o["name"]: o for o in report["objects"] if o["baked"]} if report else {}
    away, target = (set(report.get("facing_away", ())), report["settings"]["target_error"]) if report else (set(), 1)
    for found in scan["objects"]:
        name, row = found["name"], {key: found[key] for key in ("name", "kind", "label", "reason")}
        if name in away and not row["reason"]:
            row["reason"] = AWAY
        if name in last:
            row["between"] = last[name]["between"] or 0.0
            row["is_coarse"] = row["between"] > target
        rows.append(row)
    if [_row(item) for item in listed] == [_row_of(row) for row in rows]:
        return
    listed.clear()
    for row in rows:
        item = listed.add()
        for key, value in row.items():
            setattr(item, key, value)
        item.mend = mend_for(item.reason)


def _row(item):
    return item.name, item.kind, item.label, item.reason, round(item.between, 6), item.is_coarse


def _row_of(row):
    return (
        row["name"], row.get("kind", ""), row.get("label", ""), row.get("reason", ""),
        round(row.get("between", -1.0), 6), row.get("is_coarse", False),
    )  # fmt: skip


def select_listed(settings, context):
    """Selects the object of the row clicked, alone."""
    if not 0 <= settings.listed_index < len(settings.listed):
        return
    objects = context.view_layer.objects
    obj = objects.get(settings.listed[settings.listed_index].name)
    if obj is not None and all(other.mode == "OBJECT" for other in objects.selected):
        select_alone(objects, obj)


def select_alone(objects, obj):
    """Selects an object of a view layer's and no other, and makes it the active one."""
    for other in objects.selected:
        other.select_set(False)
    obj.select_set(True)
    objects.active = obj
