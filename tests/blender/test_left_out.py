"""One table of what is left out: who, what, what comes of it, what to do."""

import bpy
import scenes
from mathutils import Matrix


def test_one_table_of_what_is_left_out():
    scenes.lit_ball()
    scenes.wire("Wire")
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Ball"].data)
    twin.matrix_world = Matrix.Translation((3, 0, 1))
    bpy.context.collection.objects.link(twin)
    glass = scenes.new_material("It's glass")
    glass.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.5
    scenes.box("Pane", 0.5, Matrix.Translation((-3, 0, 1)), glass)
    lamp = bpy.data.objects.new("Off", bpy.data.lights.new("Off", "POINT"))
    lamp.data.energy = -1
    bpy.context.collection.objects.link(lamp)
    bpy.ops.pdm.bake(target_error=0.1)
    report = bpy.context.scene.pdm_radiosity.report()
    rows = {(row["kind"], row["name"]): row for row in report["left_out"]}
    wire = rows["Object", "Wire"]
    assert wire["what"] == "has no faces" and wire["effect"] == "takes no part in the light"
    copy = rows["Object", "Twin"]
    assert "shares its mesh" in copy["what"] and "no colours" in copy["effect"] and "single-user" in copy["advice"]
    pane = rows["Material", "It's glass"]
    assert (pane["what"], pane["effect"]) == ("its Alpha is below 1", "it is taken as opaque")
    off = rows["Light", "Off"]
    assert "takes light away" in off["what"] and "use a strength above 0" in off["advice"]
