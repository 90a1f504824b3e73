"""`bpy.ops.pdm.mend`: does to an object what the reason for its refusal asks for."""

import bmesh
import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Operator

from .listed import LABELS
from .modal_steps import Idle


class PDM_OT_mend(Idle, Operator):
    """Do to this object what the bake needs"""

    bl_idname = "pdm.mend"
    bl_label = "Mend"
    bl_options = {"REGISTER", "UNDO"}

    object: StringProperty(name="Object")
    way: EnumProperty(name="Way", items=[(way, label, "") for way, label in LABELS.items()])

    def execute(self, context):
        obj = context.view_layer.objects.get(self.object)
        if obj is None:
            self.report({"ERROR"}, f"Object {self.object!r} is not in this view layer; scan the scene again")
            return {"CANCELLED"}
        if obj.mode != "OBJECT":
            self.report({"ERROR"}, f"Object {obj.name!r} is in {obj.mode.title()} Mode; switch to Object Mode first")
            return {"CANCELLED"}
        try:
            _MEND[self.way](context, obj)
        except RuntimeError as error:
            self.report({"ERROR"}, f"Object {self.object!r}: {str(error).strip()}")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{self.object}: {LABELS[self.way]}")
        return {"FINISHED"}


def _select(context, obj):
    """Blender's operators work on what is selected."""
    for other in context.view_layer.objects.selected:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


def _single_user(context, obj):
    obj.data = obj.data.copy()


def _apply(context, obj):
    """What the viewport shows becomes the mesh."""
    if obj.data.users > 1:
        _single_user(context, obj)
    evaluated = obj.evaluated_get(context.evaluated_depsgraph_get())
    graph = context.evaluated_depsgraph_get()
    made = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=graph)
    old, name = obj.data, obj.data.name
    obj.modifiers.clear()
    obj.data = made
    if not old.users:
        bpy.data.meshes.remove(old)
    made.name = name


def _edit(change):
    def mend(context, obj):
        work = bmesh.new()
        work.from_mesh(obj.data)
        change(work)
        work.to_mesh(obj.data)
        work.free()
        obj.data.update()

    return mend


def _convert(context, obj):
    _select(context, obj)
    bpy.ops.object.convert(target="MESH")


def _real(context, obj):
    _select(context, obj)
    bpy.ops.object.duplicates_make_real()


def _local(context, obj):
    obj.make_local()
    if obj.data:
        obj.data.make_local()


_MEND = {
    "SINGLE_USER": _single_user,
    "APPLY": _apply,
    "FLIP": _edit(lambda work: bmesh.ops.reverse_faces(work, faces=work.faces)),
    "CONVERT": _convert,
    "REAL": _real,
    "LOCAL": _local,
}
