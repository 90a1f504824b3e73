"""`bpy.ops.pdm.preview_material`: renders of EEVEE and Cycles show the baked colours, or again the materials alone."""

import bpy
from bpy.props import BoolProperty
from bpy.types import Operator

from .modal_steps import AfterBake
from .reading.preview_nodes import MADE, MARK, add_preview, has_preview, make_material, remove_preview
from .told import told
from .words import many, say

NAME = "Baked Light"  # of the material that objects without one get


class PDM_OT_preview_material(AfterBake, Operator):
    """Show the baked colours in EEVEE and Cycles: adds nodes to the materials of the baked objects, which are taken out
    again by Remove Preview. The bake does not take them for light"""

    bl_idname = "pdm.preview_material"
    bl_label = "Preview Material"
    bl_options = {"REGISTER", "UNDO"}

    remove: BoolProperty(
        name="Remove", description="Take the preview out of all materials instead", default=False, options={"SKIP_SAVE"}
    )

    def execute(self, context):
        if self.remove:
            remove_all()
            return {"FINISHED"}
        report = context.scene.pdm_radiosity.report()
        settings = report["settings"]
        baked = [context.scene.objects.get(entry["name"]) for entry in report["objects"] if entry["baked"]]
        baked = [obj for obj in baked if obj is not None and settings["attribute"] in obj.data.attributes]
        materials, linked = _materials(baked)
        for material in materials:
            add_preview(material, settings["attribute"], settings["quantity"] == "IRRADIANCE")
        if linked:
            self.report({"WARNING"}, told(f"Linked from a library and left as they are: {', '.join(linked)}"))
        if without := _users_without(materials, settings["attribute"]):
            self.report({"WARNING"}, told(f"Not baked but of the same materials, and black now: {', '.join(without)}"))
        written = many(len(materials), "material", "materials")
        self.report({"INFO"}, say("{} now with {}", written, repr(settings["attribute"])))
        return {"FINISHED"}


def any_preview():
    return any(has_preview(material) for material in bpy.data.materials)


def remove_all():
    for material in list(bpy.data.materials):
        if material.library is not None:
            continue
        if material.get(MARK) == MADE:
            _take_away(material)
        else:
            remove_preview(material)


def _materials(objects):
    """Every material of `objects` that can be changed, once, and the names of those that cannot. Where there is none,
    one is made."""
    found, linked = {}, []
    for obj in objects:
        if not len(obj.material_slots):
            obj.data.materials.append(None)
        for slot in obj.material_slots:
            if slot.material is None:
                made = (m for m in bpy.data.materials if m.get(MARK) == MADE)  # one for all
                slot.material = next(made, None) or make_material(NAME)
            material = slot.material
            if material.library is not None:
                linked.append(material.name)
            else:
                found[material.name_full] = material
    return list(found.values()), sorted(set(linked))


def _take_away(material):
    """The material made for objects without any, from its slots, and the slots that it came with."""
    for obj in bpy.data.objects:
        own = [slot for slot in obj.material_slots if slot.material == material]
        for slot in own:
            slot.material = None
        if own and len(obj.material_slots) == 1 and own[0].link == "DATA":
            obj.data.materials.clear()
    bpy.data.materials.remove(material)


def _users_without(materials, attribute):
    """Names of mesh objects that show one of `materials` and have no such attribute."""
    own = {material.name_full for material in materials}
    return [
        obj.name
        for obj in bpy.data.objects
        if obj.type == "MESH"
        and attribute not in obj.data.attributes
        and any(slot.material and slot.material.name_full in own for slot in obj.material_slots)
    ][:4]
