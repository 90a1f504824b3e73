"""`bpy.ops.pdm.export`: the baked objects as glTF, FBX or OBJ, so that other programs show the colours as they are."""

import os
from contextlib import contextmanager

import bpy
import numpy as np
from bpy.props import EnumProperty, StringProperty
from bpy.types import Operator

from .baking.colour_attribute import values_in
from .live import own_changes
from .modal_steps import AfterBake
from .reading.preview_nodes import new_material
from .reading.render_visible import mesh_shown
from .told import told
from .words import many, say

ENDINGS = {"GLTF": ".glb", "FBX": ".fbx", "OBJ": ".obj"}
ADD_ONS = {"GLTF": "glTF 2.0", "FBX": "FBX", "OBJ": "OBJ"}


class PDM_OT_export(AfterBake, Operator):
    """Write the baked objects with their colours for other programs. The scene stays as it is"""

    bl_idname = "pdm.export"
    bl_label = "Export Baked"
    bl_options = {"REGISTER"}

    filepath: StringProperty(name="File", description="Its ending is that of the format", subtype="FILE_PATH")
    format: EnumProperty(
        name="Format",
        description="What the file is for",
        items=[
            (
                "GLTF",
                "glTF",
                "COLOR_0, linear: radiance on unlit materials, irradiance times the materials' own colour",
            ),
            ("FBX", "FBX", "Vertex colours in sRGB, 8 bits where it is read"),
            ("OBJ", "OBJ", "A colour a vertex behind its place, in sRGB: no hard edges, any brightness"),
        ],
        default="GLTF",
    )
    filter_glob: StringProperty(default="*.glb;*.fbx;*.obj", options={"HIDDEN"})

    def invoke(self, context, event):
        if not self.filepath:
            self.filepath = os.path.splitext(bpy.data.filepath)[0] or "baked"
        self.check(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def check(self, context):
        """The ending of the format."""
        name, ending = os.path.splitext(self.filepath)
        wanted = (name if ending.lower() in {*ENDINGS.values(), ".blend"} else self.filepath) + ENDINGS[self.format]
        changed, self.filepath = wanted != self.filepath, wanted
        return changed

    def execute(self, context):
        report = context.scene.pdm_radiosity.report()
        attribute = report["settings"]["attribute"]
        objects = [context.view_layer.objects.get(o["name"]) for o in report["objects"] if o["baked"]]
        objects = [obj for obj in objects if obj is not None and attribute in obj.data.color_attributes]
        if not objects:
            return self.refuse(f"No object has the colours {attribute!r} of the last bake; bake again")
        if problem := _problem(context, objects):
            return self.refuse(problem)
        self.check(context)
        is_unlit = self.format == "GLTF" and report["settings"]["quantity"] == "RADIANCE"
        try:
            with (
                own_changes(context),
                _alone(context, objects),
                _as_shown(context, objects),
                _chosen(objects, attribute),
                _clipped(objects, attribute, self.format) as cut,
            ):
                with _unlit(objects, attribute, is_unlit):
                    _write(self.format, bpy.path.abspath(self.filepath))
        except (RuntimeError, AttributeError) as error:
            name = ADD_ONS[self.format]
            return self.refuse(f"{name} was not written: {str(error).strip()}; is the add-on {name} enabled?")
        if cut:
            colours = many(cut, "colour", "colours")
            text = say("{} above 1 clipped, which {} cannot hold: lower the exposure", colours, self.format)
            self.report({"WARNING"}, told(text))
        self.report({"INFO"}, say("{} written to {}", many(len(objects), "object", "objects"), self.filepath))
        return {"FINISHED"}


def _problem(context, objects):
    """Why the objects cannot be written, or ''."""
    if context.mode != "OBJECT":
        return f"Blender is in {context.mode.title().replace('_', ' ')} Mode; switch to Object Mode first"
    hidden = [obj.name for obj in objects if not obj.visible_get()]
    return f"Object {hidden[0]!r} is hidden in the view; show it, or delete it and bake again" if hidden else ""


def _write(kind, path):
    """Blender's own exporters, for what is selected."""
    if kind == "GLTF":
        bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", use_selection=True, export_vertex_color="ACTIVE")
    elif kind == "FBX":
        bpy.ops.export_scene.fbx(filepath=path, use_selection=True, colors_type="SRGB", prioritize_active_color=True)
    else:
        bpy.ops.wm.obj_export(filepath=path, export_selected_objects=True, export_colors=True)


@contextmanager
def _alone(context, objects):
    """The objects selected and no others."""
    layer = context.view_layer.objects
    selected, active = list(layer.selected), layer.active
    try:
        for obj in selected:
            obj.select_set(False)
        for obj in objects:
            obj.select_set(True)
        layer.active = objects[0]
        yield
    finally:
        for obj in objects:
            obj.select_set(False)
        for obj in selected:
            obj.select_set(True)
        layer.active = active


@contextmanager
def _as_shown(context, objects):
    """Meshes where their modifiers have moved them, as they were baked: glTF would have them as they are without, and
    FBX in the rest pose."""
    graph, before = context.evaluated_depsgraph_get(), []
    moved = [obj for obj in objects if any(modifier.show_viewport for modifier in obj.modifiers)]
    meshes = [mesh_shown(obj, graph) for obj in moved]
    try:
        for obj, mesh in zip(moved, meshes, strict=True):
            shown = [modifier for modifier in obj.modifiers if modifier.show_viewport]
            before.append((obj, obj.data, obj.active_shape_key_index, shown))
            obj.data = mesh
            for modifier in shown:
                modifier.show_viewport = False
        yield
    finally:
        for obj, mesh, key, shown in before:
            obj.data, obj.active_shape_key_index = mesh, key
            for modifier in shown:
                modifier.show_viewport = True
        bpy.data.batch_remove(meshes)


@contextmanager
def _chosen(objects, attribute):
    """The baked colours active in the viewport and for renders: of several an exporter takes those."""
    before = [(obj.data.color_attributes, obj.data.color_attributes.active_color_name,
               obj.data.color_attributes.default_color_name) for obj in objects]  # fmt: skip
    try:
        for colours, _, _ in before:
            colours.active_color_name = colours.default_color_name = attribute
        yield
    finally:
        for colours, active, render in before:
            colours.active_color_name, colours.default_color_name = active, render


@contextmanager
def _clipped(objects, attribute, kind):
    """Colours of 0 to 1 where the format holds no others; gives how many were above. glTF would wrap them around."""
    before = []
    try:
        for mesh in {obj.data for obj in objects} if kind != "OBJ" else ():
            layer = mesh.color_attributes[attribute]
            values = values_in(layer)
            before.append((layer, values))
            layer.data.foreach_set("color", np.clip(values, 0.0, 1.0).ravel())
        yield sum(int((values[:, :3] > 1).any(axis=1).sum()) for _, values in before)
    finally:
        for layer, values in before:
            layer.data.foreach_set("color", values.ravel())


@contextmanager
def _unlit(objects, attribute, wanted):
    """One material that shows the colours alone, and that glTF's exporter takes for an unlit one, on all faces."""
    if not wanted:
        yield
        return
    material, before = _shadeless(attribute), []
    try:
        for obj in objects:
            if not len(obj.material_slots):
                before.append((obj, None))
                obj.data.materials.append(None)
            for slot in obj.material_slots:
                before.append((slot, slot.material))
                slot.material = material
        yield
    finally:
        for holder, old in reversed(before):
            if isinstance(holder, bpy.types.Object):
                holder.data.materials.clear()
            else:
                holder.material = old
        bpy.data.materials.remove(material)


def _shadeless(attribute):
    material = new_material(attribute)
    tree = material.node_tree
    tree.nodes.clear()
    colour, shader, output = (
        tree.nodes.new(kind) for kind in ("ShaderNodeVertexColor", "ShaderNodeBackground", "ShaderNodeOutputMaterial")
    )
    colour.layer_name = attribute
    tree.links.new(colour.outputs["Color"], shader.inputs["Color"])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material
