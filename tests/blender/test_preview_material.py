"""Preview Material: what it shows, that the bake reads past it, and that nothing is left of it once removed."""

import bpy
import numpy as np
import pytest
import scenes
from test_bake import bake


def tree_of(material):
    """Everything that a material's nodes say, without places."""
    nodes = {
        node.name: (
            node.bl_idname,
            [tuple(np.ravel(s.default_value)) for s in node.inputs if hasattr(s, "default_value")],
        )
        for node in material.node_tree.nodes
    }
    links = {
        (a.from_node.name, a.from_socket.identifier, a.to_node.name, a.to_socket.identifier)
        for a in material.node_tree.links
    }
    return nodes, links


def test_rebake_reads_what_was_there_and_removal_leaves_nothing():
    scenes.lit_ball()
    first = bake()
    before = {material.name: tree_of(material) for material in bpy.data.materials}
    colours = {name: scenes.colours(bpy.data.objects[name]) for name in ("Floor", "Ball", "Lamp")}
    assert bpy.ops.pdm.preview_material() == {"FINISHED"}
    assert bpy.ops.pdm.preview_material() == {"FINISHED"}  # again: in place of the first
    second = bake()
    assert second["warnings"] == first["warnings"]
    for name, values in colours.items():
        np.testing.assert_array_equal(scenes.colours(bpy.data.objects[name]), values)
    bpy.ops.pdm.preview_material(remove=True)
    assert {material.name: tree_of(material) for material in bpy.data.materials} == before


def test_objects_without_material_get_one_and_lose_it():
    floor, ball, _ = scenes.lit_ball()
    floor.data.materials.clear()
    ball.data.materials.clear()
    ball.data.materials.append(None)
    colours = [bake(), scenes.colours(floor)][1]
    bpy.ops.pdm.preview_material()
    assert floor.material_slots[0].material == ball.material_slots[0].material is not None
    bake()
    np.testing.assert_allclose(scenes.colours(floor), colours, rtol=1e-6)  # .8 in single precision
    bpy.ops.pdm.preview_material(remove=True)
    assert not len(floor.material_slots) and "Baked Light" not in bpy.data.materials


def test_materials_without_nodes_come_back_without(addon):
    """From 5.0 on all have them, whatever they are told: then they keep them."""
    floor, _, _ = scenes.lit_ball()
    plain = bpy.data.materials.new("Plain")
    plain.use_nodes, plain.diffuse_color = False, (0.3, 0.2, 0.1, 1)
    had = plain.use_nodes
    floor.data.materials[0] = plain
    bake()
    colours = scenes.colours(floor)
    bpy.ops.pdm.preview_material()
    bake()
    np.testing.assert_allclose(scenes.colours(floor), colours, rtol=1e-6)
    bpy.ops.pdm.preview_material(remove=True)
    assert plain.use_nodes == had == (bpy.app.version >= (5, 0))


def rendered(tmp_path, name):
    """Mean of the middle of a picture by Cycles from straight above, linear."""
    scene = bpy.context.scene
    if scene.camera is None:
        data = bpy.data.cameras.new("Camera")
        data.type, data.ortho_scale = "ORTHO", 0.2
        scene.camera = bpy.data.objects.new("Camera", data)
        scene.camera.location = (-1.5, -1.5, 1.0)
        scene.collection.objects.link(scene.camera)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 4, False, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / f"{name}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return np.array(image.pixels[:]).reshape(-1, 4)[:, :3].mean(axis=0)


@pytest.mark.parametrize("quantity", ["RADIANCE", "IRRADIANCE"])
def test_cycles_shows_the_baked_light(tmp_path, quantity):
    """The floor through its preview is the radiance there, whichever quantity was baked."""
    floor, _, _ = scenes.lit_ball()
    scenes.rebuild(floor, lambda b: scenes.bmesh.ops.create_grid(b, x_segments=40, y_segments=40, size=2.0))
    bake()
    at = np.linalg.norm(scenes.vertices(floor)[:, :2] + 1.5, axis=1).argmin()
    expected = scenes.colours(floor)[at, :3]
    bake(quantity=quantity)
    bpy.ops.pdm.preview_material()
    np.testing.assert_allclose(rendered(tmp_path, quantity), expected, rtol=0.02)


def test_irradiance_keeps_texture_and_glow():
    """The surface's own colour multiplies the light, be it linked or a value; what it emits is added."""
    floor, _, _ = scenes.lit_ball()
    floor.data.materials[0] = material = scenes.new_material("Glow")
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    texture = tree.nodes.new("ShaderNodeTexImage")
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    bake(quantity="IRRADIANCE")
    bpy.ops.pdm.preview_material()
    times = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeMix")
    fed = {link.from_node.bl_idname for link in tree.links if link.to_node == times}
    assert times.blend_type == "MULTIPLY" and fed == {"ShaderNodeAttribute", "ShaderNodeTexImage"}
    assert any(node.bl_idname == "ShaderNodeAddShader" for node in tree.nodes)


def test_undo_takes_the_preview_away():
    scenes.lit_ball()
    bake()
    bpy.ops.ed.undo_push(message="before")
    nodes = len(bpy.data.materials["Floor"].node_tree.nodes)
    bpy.ops.pdm.preview_material()
    bpy.ops.ed.undo_push(message="preview")
    bpy.ops.ed.undo()
    assert len(bpy.data.materials["Floor"].node_tree.nodes) == nodes


def test_asks_for_a_bake_first():
    assert not bpy.ops.pdm.preview_material.poll()
