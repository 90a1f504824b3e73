"""The twelve cases of Blender scenes that once came out wrong, B1 to B12, with their right values; those whose tests
are elsewhere are listed."""

from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix

ELSEWHERE = {
    "B5": "test_bake.py::test_disabling_the_add_on_ends_a_bake_that_runs",
    "B6": "test_command_line.py::test_files_named_twice_are_refused_before_the_work",
    "B7": "test_command_line.py::test_a_picture_that_is_not_whole_is_a_failure",
    "B8": "test_command_line.py::test_ctrl_c_stops_with_130_and_writes_nothing",
    "B10": "test_bake.py::test_a_failure_after_writing_puts_all_back",
}


def bake(**settings):
    assert bpy.ops.pdm.bake(**{"target_error": 0.02, **settings}) == {"FINISHED"}
    return bpy.context.scene.pdm_radiosity.report()


def sky(strength=1.0):
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    shader = world.node_tree.nodes["Background"]
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Strength"].default_value = strength
    bpy.context.scene.world = world
    return world.node_tree


def picture():
    """A material that shows an image by its own light alone."""
    image = bpy.data.images.new("Picture", 8, 8)
    image.generated_color = (0.9, 0.9, 0.9, 1)
    made = scenes.material("Picture", emission=(1, 1, 1))
    nodes = made.node_tree.nodes
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    emission = next(node for node in nodes if node.bl_idname == "ShaderNodeEmission")
    made.node_tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    return made


def test_all_twelve_are_here_or_elsewhere():
    here = {name.split("_")[1].upper() for name in globals() if name.startswith("test_b")}
    assert here | set(ELSEWHERE) == {f"B{k}" for k in range(1, 13)}
    for place in ELSEWHERE.values():
        file, name = place.split("::")
        assert f"def {name}(" in (Path(__file__).parent / file).read_text(encoding="utf-8")


@pytest.mark.parametrize("named", [True, False])
def test_b1_a_shown_bake_is_no_light(named):
    """What reflected Blender's grey does so still where a material shows its bake."""
    floor = scenes.grid("Floor", 4, 4.0)
    scenes.sphere("Ball", matrix=Matrix.Translation((0, 0, 1.5)), made_of=scenes.material("Ball"))
    lamp = scenes.material("Lamp", emission=(5, 5, 5))
    scenes.grid("Lamp", 1, 1.0, Matrix.Translation((1, 0, 4)), lamp)
    bake()
    before = scenes.colours(floor)[:, :3].copy()
    shown = scenes.material("Shown", emission=(1, 1, 1))
    colour = shown.node_tree.nodes.new("ShaderNodeVertexColor")
    colour.layer_name = "Radiosity" if named else ""
    emission = next(node for node in shown.node_tree.nodes if node.bl_idname == "ShaderNodeEmission")
    shown.node_tree.links.new(colour.outputs["Color"], emission.inputs["Color"])
    floor.data.materials.append(shown)
    report = bake()
    assert scenes.colours(floor)[:, :3].mean() == pytest.approx(before.mean(), rel=0.05)
    assert any("shows the baked attribute" in text for text in report["warnings"])


def test_b2_a_file_saved_in_edit_mode(addon, tmp_path):
    floor = scenes.lit_ball()[0]
    bpy.context.view_layer.objects.active = floor
    bpy.ops.object.mode_set(mode="EDIT")
    file, out = (str(tmp_path / name) for name in ("scene.blend", "baked.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    assert bpy.context.object.mode == "EDIT"
    assert addon("operators.command_line").main(["bake", "--target-error", "0.05", "--output", out]) == 0
    bpy.ops.wm.open_mainfile(filepath=out)
    assert bpy.context.object.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert scenes.colours(bpy.data.objects["Floor"])[:, 0].max() > 0.01


def test_b3_cycles_ignores_backface_culling():
    """All reflect .5 and emit .5 under a sky of 1: whatever stands where, all shows 1, and culled sides do as well."""
    grey = scenes.material("Grey")
    nodes, links = grey.node_tree.nodes, grey.node_tree.links
    output, diffuse = nodes["Material Output"], next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    add, emission = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 0.5
    emission.inputs["Color"].default_value = (1, 1, 1, 1)
    for k, shader in enumerate((diffuse, emission)):
        links.new(shader.outputs[0], add.inputs[k])
    links.new(add.outputs[0], output.inputs["Surface"])
    grey.use_backface_culling = True
    floor = scenes.grid("Floor", 4, 4.0, made_of=grey)
    scenes.grid("Roof", 4, 4.0, Matrix.Translation((0, 0, 0.5)), grey)
    sky()
    bake()
    np.testing.assert_allclose(scenes.colours(floor)[:, :3], 1.0, rtol=0.02)


def test_b4_the_world_that_is_not_the_cameras():
    tree = sky(0.4)
    nodes, links = tree.nodes, tree.links
    camera, path, mix = (nodes.new(f"ShaderNode{kind}") for kind in ("Background", "LightPath", "MixShader"))
    camera.inputs["Color"].default_value = (1, 1, 1, 1)
    links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    links.new(nodes["Background"].outputs[0], mix.inputs[1])
    links.new(camera.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes["World Output"].inputs["Surface"])
    floor = scenes.grid("Floor", 1, 2.0, made_of=scenes.material("Grey"))
    bake()
    np.testing.assert_allclose(scenes.colours(floor)[:, :3], 0.5 * 0.4, rtol=1e-3)


def test_b9_darkness_is_said_before_the_work():
    room = scenes.box("Room", 4.0)
    with pytest.raises(RuntimeError, match="Nothing shines.*add a light"):
        bpy.ops.pdm.bake()
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy = 100
    bpy.context.collection.objects.link(lamp)
    with pytest.raises(RuntimeError, match="'Room' face away from.*flip the normals"):
        bpy.ops.pdm.bake()
    assert not room.data.color_attributes
    room.data.flip_normals()
    bake()
    assert (scenes.colours(room)[:, 0] > 0).all()


def test_b11_unlit_pictures_light_only_the_dark():
    floor = scenes.grid("Floor", 4, 4.0, made_of=scenes.material("Grey"))
    plane = scenes.grid("Picture", 1, 2.0, Matrix.Translation((0, 0, 1)), picture())
    bake()
    assert scenes.colours(floor)[:, 0].max() > 0.1
    sky()
    report = bake()
    lit = scenes.colours(floor)[:, :3].copy()
    assert any("taken for a picture, not a light" in text for text in report["warnings"])
    plane.data.materials[0] = scenes.material("Black", (0, 0, 0))
    bake()
    np.testing.assert_allclose(scenes.colours(floor)[:, :3], lit, rtol=1e-3, atol=1e-4)


def test_b12_a_volume_alone_takes_no_part():
    floor = scenes.grid("Floor", 4, 4.0, made_of=scenes.material("Grey"))
    sky()
    bake()
    before = scenes.colours(floor)[:, :3].copy()
    fog = scenes.new_material("Fog")
    fog.node_tree.nodes.clear()
    output, volume = (fog.node_tree.nodes.new(f"ShaderNode{k}") for k in ("OutputMaterial", "VolumePrincipled"))
    fog.node_tree.links.new(volume.outputs[0], output.inputs["Volume"])
    scenes.box("Cloud", 1.0, Matrix.Translation((0, 0, 0.6)), fog)
    report = bake()
    (refused,) = report["refused"]
    assert refused["name"] == "Cloud" and "volume" in refused["reason"]
    np.testing.assert_array_equal(scenes.colours(floor)[:, :3], before)
