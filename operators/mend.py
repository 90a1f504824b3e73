"""`bpy.ops.pdm.mend`: does to an object what the reason for its refusal asks for."""

import bmesh
import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Operator

from .listed import LABELS, instanced, select_alone
from .modal_steps import Idle
from .reading.render_visible import mesh_shown
from .subdivide_meshes import copy_mesh
from .words import say


class PDM_OT_mend(Idle, Operator):
    """Do to this object what the bake needs"""

    bl_idname = "pdm.mend"
    bl_label = "Mend"
    bl_options = {"REGISTER", "UNDO"}

    object: StringProperty(name="Object")
    way: EnumProperty(name="Way", items=[(way, label, "") for way, label in LABELS.items()])

    def execute(self, context):
        obj = context.view_layer.objects.get(self.object)
        if self.way == "REAL" and obj is None:
            obj = _instancer(context, self.object)
        if obj is None:
            return self.refuse(f"Object {self.object!r} is not in this view layer; scan the scene again")
        if obj.mode != "OBJECT":
            return self.refuse(f"Object {obj.name!r} is in {obj.mode.title()} Mode; switch to Object Mode first")
        try:
            _MEND[self.way](context, obj)
        except RuntimeError as error:
            return self.refuse(f"Object {self.object!r}: {str(error).strip()}")
        self.report({"INFO"}, f"{self.object}: {say(LABELS[self.way])}")
        return {"FINISHED"}


def _single_user(context, obj):
    obj.data = obj.data.copy()


def _apply(context, obj):
    """What the viewport shows becomes the mesh."""
    if obj.data.users > 1:
        _single_user(context, obj)
    made = mesh_shown(obj, context.evaluated_depsgraph_get())
    old, name = obj.data, obj.data.name
    obj.modifiers.clear()
    obj.data = made
    if not old.users:
        bpy.data.meshes.remove(old)
    made.name = name


def _edit(change):
    def mend(context, obj):
        copy_mesh(obj.data, obj.data, change)
        obj.data.update()

    return mend


def _convert(context, obj):
    select_alone(context.view_layer.objects, obj)  # Blender's operators work on what is selected
    bpy.ops.object.convert(target="MESH")


def _real(context, obj):
    if any(modifier.type == "NODES" for modifier in obj.modifiers):
        _real_nodes(context, obj)
        return
    select_alone(context.view_layer.objects, obj)
    bpy.ops.object.duplicates_make_real()


def _real_nodes(context, obj):
    """Objects of the meshes that geometry nodes place; Blender's own operator would copy `obj` with its nodes."""
    graph, meshes, placed = context.evaluated_depsgraph_get(), {}, []
    for instance in graph.object_instances:
        if not instance.is_instance or instance.parent is None or instance.parent.original != obj:
            continue
        shown = instance.object
        if shown.type == "MESH":
            key = shown.data.as_pointer()
            if key not in meshes:
                meshes[key] = _copy_of(shown)
            placed.append((shown.name, meshes[key], instance.matrix_world.copy()))
    for name, mesh, matrix in placed:
        made = bpy.data.objects.new(name, mesh)
        made.matrix_world = matrix
        obj.users_collection[0].objects.link(made)
    _apply(context, obj)  # what is left of it, without its nodes


def _copy_of(shown):
    """A Mesh of the data that an instance shows, which no object has: what makes meshes of objects cannot copy it."""
    mesh = bpy.data.meshes.new(shown.name)
    copy_mesh(shown.data, mesh)
    for slot in shown.material_slots:
        mesh.materials.append(slot.material and slot.material.original)
    return mesh


def _instancer(context, name):
    """The object that makes 'Thing (instance 3)', or None: the first that makes instances of Thing."""
    for instance in context.evaluated_depsgraph_get().object_instances:
        if instance.is_instance and instance.object.name == instanced(name) and instance.parent is not None:
            return context.view_layer.objects.get(instance.parent.name)
    return None


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
