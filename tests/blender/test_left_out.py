"""One table of what is left out: who, what, what comes of it, what to do."""

import bmesh
import bpy
import numpy as np
import pytest
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
    bpy.context.scene.render.engine, bpy.context.scene.cycles.film_exposure = "CYCLES", 2.0
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
    film = rows["Scene", "Scene"]
    assert "Film > Exposure of 2 " in film["what"] and "times it" in film["effect"] and "1.00" in film["advice"]


def lamp(name, kind, place, turn=(0, 0, 0), **settings):
    made = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    made.location, made.rotation_euler, made.data.energy = place, turn, 100
    for key, value in settings.items():
        setattr(made.data, key, value)
    bpy.context.collection.objects.link(made)
    return made


def test_every_row_says_what_comes_of_it():
    """All that is told by name, whatever it is: what it is, and its effect on the result."""
    scenes.lit_ball()
    scenes.wire("Wire")
    lamp("Negative", "POINT", (0, 0, 3), energy=-1)
    lamp("None", "POINT", (0, 0, 3), energy=0)
    lamp("Hidden", "POINT", (0, 0, 3)).visible_diffuse = False
    lamp("Up", "AREA", (0, 0, 6), (np.pi, 0, 0))
    lamp("Bounced", "POINT", (0, 0, 3)).data.cycles.max_bounces = 3
    lamp("Flat", "AREA", (0, 0, 3)).scale = 0, 1, 1
    scenes.box("Case", 0.1, Matrix.Translation((0, -3, 1)))
    lamp("Within", "POINT", (0, -3, 1))
    kinds = ["Holdout", "BsdfGlass", "BsdfTransparent", "BsdfToon"]
    for k, kind in enumerate(kinds):
        made = scenes.new_material(kind)
        nodes = made.node_tree.nodes
        shader = nodes.new(f"ShaderNode{kind}")
        made.node_tree.links.new(shader.outputs[0], nodes["Material Output"].inputs["Surface"])
        scenes.box(kind, 0.3, Matrix.Translation((3 + k, 0, 1)), made)
    for k, name in enumerate(("TexImage", "TexNoise", "NewGeometry")):
        made = scenes.new_material(name)
        node = made.node_tree.nodes.new(f"ShaderNode{name}")
        out = node.outputs[-1 if name == "NewGeometry" else 0]
        made.node_tree.links.new(out, made.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
        scenes.box(name, 0.3, Matrix.Translation((3 + k, 2, 1)), made)
    metal = scenes.new_material("Metal")
    metal.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    ball = scenes.sphere("Two", matrix=Matrix.Translation((-3, 0, 1)), made_of=metal)
    ball.data.materials.append(bpy.data.materials["Ball"])
    ball.data.polygons[0].material_index = 1
    bpy.ops.pdm.bake(target_error=0.3)
    report = bpy.context.scene.pdm_radiosity.report()
    rows = {(row["kind"], row["name"]): row for row in report["left_out"]}
    assert {("Light", name) for name in ("Negative", "None", "Hidden", "Up", "Bounced", "Flat", "Within")} <= set(rows)
    told = {name for _, name in rows}
    assert {"Wire", "Holdout", "BsdfGlass", "BsdfToon", "TexImage", "TexNoise", "NewGeometry", "Metal", "Two"} <= told
    for row in report["left_out"]:
        assert row["what"] and row["effect"], row
        assert ": " not in row["effect"] and ";" not in row["what"] + row["effect"], row


@pytest.fixture
def steps(addon):
    """Function of settings: the stages of a bake until solving begins, and what was said by then."""
    bake = addon("operators.baking.bake")

    def until_solving(**settings):
        said = []
        for stage in bake.bake_steps(bpy.context, bake.BakeSettings(target_error=0.1, **settings)):
            said += stage.said
            if stage.text == "Solving":
                break
        return said

    return until_solving, bake


def test_lamps_that_miss_are_told_before_the_solve(steps):
    until_solving, bake = steps
    scenes.box("Room", 4.0, inverted=True)
    lamp("Wall", "AREA", (0, 0, 1.95), (np.pi, 0, 0))
    lamp("Room's", "POINT", (0, 1, 0))
    scenes.sphere("Bulb", radius=0.05)
    lamp("Shut in", "POINT", (0, 0, 0))
    said = until_solving()
    assert len(said) == 2 and "'Wall'" in said[0] + said[1] and "'Bulb'" in said[0] + said[1]
    assert bake.look_at_scene(bpy.context)["foreseen"] == said


def test_a_scene_that_stays_black_is_not_solved(steps):
    until_solving, bake = steps
    black = scenes.material("Black", (0, 0, 0))
    scenes.grid("Floor", 2, 4.0, made_of=black)
    light = lamp("Lamp", "AREA", (0, 0, 2))
    with pytest.raises(bake.BakeError, match="All is black: object 'Floor' reflects nothing"):
        until_solving()
    assert until_solving(quantity="IRRADIANCE") == []
    black.node_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    assert until_solving() == []
    light.rotation_euler = np.pi, 0, 0
    bpy.context.view_layer.update()
    with pytest.raises(bake.BakeError, match="Nothing is lit: Light 'Lamp' is turned away from all objects"):
        until_solving()
    (foreseen,) = bake.look_at_scene(bpy.context)["foreseen"]
    assert foreseen.startswith("Nothing is lit")


def test_a_sun_from_below_is_told(steps):
    """Over a floor that hides all: nothing is known beforehand, but the bake says that all it has made is black."""
    scenes.grid("Floor", 2, 4.0, made_of=scenes.material("Grey"))
    scenes.add("Rock", lambda b: bmesh.ops.create_monkey(b), Matrix.Translation((0, 0, 1.5)))
    lamp("Sun", "SUN", (0, 0, 2), (np.pi, 0, 0), angle=0.0)
    bpy.ops.pdm.bake(target_error=0.3)
    assert any(text.startswith("All is black") for text in bpy.context.scene.pdm_radiosity.report()["warnings"])
