"""Passes: attributes beside the bake's whose light adds up to it, and how open the vertices are."""

import json

import bpy
import numpy as np
import pytest
import scenes

NAMES = ["Radiosity Direct", "Radiosity Indirect", "Radiosity Sky", "Radiosity AO"]


def of(name, attribute):
    return scenes.colours(bpy.data.objects[name], attribute)[:, :3]


@pytest.mark.parametrize("with_lamp", [False, True])  # by links, by rays
@pytest.mark.parametrize("quantity", ["RADIANCE", "IRRADIANCE"])
def test_direct_and_indirect_are_the_light(with_lamp, quantity):
    floor = scenes.lit_ball()[0]
    if with_lamp:
        lamp = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
        lamp.data.energy, lamp.location = 30.0, (0, -1, 3)
        bpy.context.collection.objects.link(lamp)
    options = {"target_error": 0.05, "quantity": quantity, "exposure": 1.0}
    assert bpy.ops.pdm.bake(passes={"INDIRECT", "DIRECT"}, **options) == {"FINISHED"}
    assert floor.data.color_attributes.active_color_name == "Radiosity"
    assert [a.name for a in floor.data.color_attributes if a.name in NAMES] == NAMES[:2]
    for name in ("Floor", "Ball"):
        whole, parts = of(name, "Radiosity"), [of(name, n) for n in NAMES[:2]]
        np.testing.assert_allclose(sum(parts), whole, rtol=1e-5, atol=1e-6)
        assert all(part.max() > 0 for part in parts) and parts[0].mean() > parts[1].mean()
    report = json.loads(bpy.context.scene.pdm_radiosity.last_report)
    assert report["settings"]["passes"] == ["DIRECT", "INDIRECT"]


def test_openness():
    scenes.lit_ball()
    assert bpy.ops.pdm.bake(target_error=0.05, passes={"SKY", "AO"}, ao_distance=0.8) == {"FINISHED"}
    sky, near = of("Floor", NAMES[2]), of("Floor", NAMES[3])
    assert (sky <= near + 1e-6).all() and near.max() == 1 and 0.3 < sky.min() < sky.max() < 1
    middle = np.argmin(np.linalg.norm(scenes.vertices(bpy.data.objects["Floor"]), axis=1))
    corner = [loop.vertex_index for loop in bpy.data.objects["Floor"].data.loops].index(middle)
    values = sky[corner] if len(sky) > 25 else sky[middle]
    # of a ball of radius 1 whose centre is 1.5 above; the lamp hides a little more
    assert abs(values[0] - (1 - 1 / 1.5**2)) < 0.05
    assert not any(n in NAMES[:2] for n in bpy.data.objects["Floor"].data.attributes.keys())


def test_a_pass_that_cannot_be_written_leaves_all_as_it_was():
    floor, ball, _ = scenes.lit_ball()
    ball.data.attributes.new(NAMES[3], "INT", "POINT")
    with pytest.raises(RuntimeError, match="no colour"):
        bpy.ops.pdm.bake(target_error=0.05, passes={"AO"})
    assert not floor.data.color_attributes


def test_passes_are_no_light_when_shown():
    """A material that shows a pass is read as a bake that is shown, not as a light."""
    floor = scenes.lit_ball()[0]
    assert bpy.ops.pdm.bake(target_error=0.05, passes={"DIRECT"}) == {"FINISHED"}
    before = of("Ball", "Radiosity").copy()
    tree = floor.data.materials[0].node_tree
    shown, shine = tree.nodes.new("ShaderNodeVertexColor"), tree.nodes.new("ShaderNodeEmission")
    shown.layer_name = NAMES[0]
    add = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(shown.outputs["Color"], shine.inputs["Color"])
    tree.links.new(shine.outputs[0], add.inputs[0])
    tree.links.new(tree.nodes["Diffuse BSDF"].outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    assert bpy.ops.pdm.bake(target_error=0.05) == {"FINISHED"}
    assert np.abs(of("Ball", "Radiosity") - before).max() < 0.05 * before.max()


@pytest.mark.parametrize("with_lamp", [False, True])
def test_every_stage_says_how_much_of_it_is_done(addon, with_lamp):
    scenes.lit_ball()
    if with_lamp:
        lamp = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
        lamp.data.energy, lamp.location = 30.0, (0, -1, 3)
        bpy.context.collection.objects.link(lamp)
    bake = addon("operators.baking.bake")
    settings = bake.BakeSettings(target_error=0.05, heat_map=True, passes=("DIRECT", "AO"))
    stages = []
    addon("pdm_core.signs_of_life").finish(bake.bake_steps(bpy.context, settings), stages.append)
    assert all(isinstance(stage.fraction, float | int) and 0 <= stage.fraction < 1 + 1e-9 for stage in stages)
