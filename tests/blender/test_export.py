"""Export Baked: each format is read in again and shows what was baked."""

import json
import struct

import bpy
import numpy as np
import pytest
import scenes
from test_bake import bake

READ = {
    "GLTF": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    "FBX": lambda path: bpy.ops.import_scene.fbx(filepath=path, colors_type="SRGB"),
    "OBJ": lambda path: bpy.ops.wm.obj_import(filepath=path),
}
ENDING = {"GLTF": "glb", "FBX": "fbx", "OBJ": "obj"}
STEP = 1 / 255  # of a byte, in sRGB


def srgb(linear):
    linear = np.clip(linear, 0, None)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def at_vertices(obj, name, domain):
    """{rounded world place: mean colour (3,)} of the object's vertices."""
    colours = scenes.colours(obj, name)[:, :3].astype(float)
    of = range(len(colours)) if domain == "POINT" else [loop.vertex_index for loop in obj.data.loops]
    found = {}
    for vertex, colour in zip(of, colours):
        place = obj.matrix_world @ obj.data.vertices[vertex].co
        found.setdefault(tuple(round(x, 3) + 0.0 for x in place), []).append(colour)
    return found


def written(tmp_path, kind, **settings):
    path = tmp_path / f"room.{ENDING[kind]}"
    assert bpy.ops.pdm.export(filepath=str(path.with_suffix("")), format=kind, **settings) == {"FINISHED"}
    return path


def state():
    """What an export must leave as it is."""
    objects = bpy.data.objects
    return (
        {o.name: ([s.material and s.material.name for s in o.material_slots], o.select_get()) for o in objects},
        {o.name: [(a.name, scenes.colours(o, a.name).tobytes()) for a in o.data.color_attributes] for o in objects},
        {o.name: (o.data.color_attributes.active_color_name, o.data.color_attributes.default_color_name)
         for o in objects},
        sorted(m.name for m in bpy.data.materials), bpy.context.view_layer.objects.active,
    )  # fmt: skip


@pytest.mark.parametrize("kind", READ)
def test_read_in_again_it_is_what_was_baked(tmp_path, kind):
    floor, ball, lamp = scenes.lit_ball()
    ball.data.color_attributes.new("Other", "BYTE_COLOR", "POINT")
    bake(target_error=0.05, exposure=-1.0)
    for obj in (floor, ball):
        obj.data.color_attributes.active_color_name = obj.data.color_attributes[0].name
    expected = {obj.name: at_vertices(obj, "Radiosity", obj.data.color_attributes["Radiosity"].domain)
                for obj in (floor, ball)}  # fmt: skip
    before = state()
    path = written(tmp_path, kind)
    assert state() == before
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
    READ[kind](str(path))
    for name, places in expected.items():
        obj = next(o for o in bpy.data.objects if o.type == "MESH" and o.name.startswith(name))
        layer = obj.data.color_attributes[0]
        found = at_vertices(obj, layer.name, layer.domain)
        assert found.keys() == places.keys()
        for place, colours in places.items():
            limit = 1e9 if kind == "OBJ" else 1
            mean, got = np.mean(np.minimum(colours, limit), axis=0), np.mean(found[place], axis=0)
            assert np.abs(srgb(got) - srgb(mean)).max() < STEP


def bent(floor):
    modifier = floor.modifiers.new("Bend", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.deform_axis, modifier.angle = "BEND", "Z", 0.9


def posed(floor):
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("Bone").tail = 0, 0, 1
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["Bone"].rotation_mode = "XYZ"
    rig.pose.bones["Bone"].rotation_euler.x = 0.4
    floor.vertex_groups.new(name="Bone").add(range(len(floor.data.vertices)), 1.0, "REPLACE")
    floor.modifiers.new("Pose", "ARMATURE").object = rig


@pytest.mark.parametrize("kind", READ)
@pytest.mark.parametrize("move", [bent, posed])
def test_what_modifiers_move_is_written_where_it_was_baked(tmp_path, kind, move):
    floor, _, _ = scenes.lit_ball()
    floor.shape_key_add(name="Basis")
    floor.shape_key_add(name="Key")
    floor.active_shape_key_index = 1
    move(floor)
    bake(target_error=0.05, exposure=-1.0)
    shown = floor.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    expected = {tuple(round(x, 3) + 0.0 for x in vertex.co) for vertex in shown.vertices}

    def kept():
        modifiers, groups = [(m.name, m.show_viewport) for m in floor.modifiers], [g.name for g in floor.vertex_groups]
        return floor.data, floor.active_shape_key_index, modifiers, groups

    before, meshes = kept(), len(bpy.data.meshes)
    path = written(tmp_path, kind)
    assert kept() == before and len(bpy.data.meshes) == meshes
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
    READ[kind](str(path))
    obj = next(o for o in bpy.data.objects if o.type == "MESH" and o.name.startswith("Floor"))
    bpy.context.view_layer.update()
    found = np.array([obj.matrix_world @ vertex.co for vertex in obj.data.vertices])
    apart = np.linalg.norm(found[:, None] - np.array(list(expected))[None], axis=2)
    assert apart.min(axis=0).max() < 2e-3 and apart.min(axis=1).max() < 2e-3


def test_live_goes_on_after_an_export(tmp_path, addon):
    scenes.lit_ball()
    bpy.context.scene.pdm_radiosity.live = True
    bake(target_error=0.05)
    live = addon("operators.live").live
    assert live.held is not None
    written(tmp_path, "GLTF")
    bpy.context.view_layer.update()
    assert live.held is not None and not live.held.stale


@pytest.mark.parametrize("quantity, is_unlit", [("RADIANCE", True), ("IRRADIANCE", False)])
def test_gltf_is_linear_color_0_on_unlit_materials_or_times_their_colour(tmp_path, quantity, is_unlit):
    floor, _, _ = scenes.lit_ball()
    bake(target_error=0.05, quantity=quantity, exposure=-2.0)
    expected = scenes.colours(floor)[:, :3]
    path = written(tmp_path, "GLTF")
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    gltf, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    for material in gltf["materials"]:
        assert ("KHR_materials_unlit" in material.get("extensions", {})) == is_unlit
    mesh = next(mesh for mesh in gltf["meshes"] if mesh["name"] == "Floor")
    accessor = gltf["accessors"][mesh["primitives"][0]["attributes"]["COLOR_0"]]
    kind, whole = {5123: (np.uint16, 65535), 5126: (np.float32, 1)}[accessor["componentType"]]  # 4.2 writes floats too
    assert accessor.get("normalized", False) == (whole > 1)
    wide = {"VEC3": 3, "VEC4": 4}[accessor["type"]]
    start = gltf["bufferViews"][accessor["bufferView"]]["byteOffset"]
    found = np.frombuffer(binary, kind, wide * accessor["count"], start).reshape(-1, wide)[:, :3] / whole
    apart = np.abs(found[:, None] - expected[None]).max(axis=2)  # exporters choose the order of the corners
    assert apart.min(axis=0).max() < 2e-5 and apart.min(axis=1).max() < 2e-5
    if is_unlit:
        factor = gltf["materials"][0]["pbrMetallicRoughness"].get("baseColorFactor", [1, 1, 1, 1])
        assert factor == [1, 1, 1, 1]


def test_colours_above_one_are_clipped_and_told_and_the_scene_keeps_them(tmp_path):
    floor, ball, lamp = scenes.lit_ball()
    bake(target_error=0.05)
    before = scenes.colours(lamp).copy()
    assert before.max() > 1
    path = written(tmp_path, "GLTF")
    assert np.array_equal(scenes.colours(lamp), before)
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
    READ["GLTF"](str(path))
    found = scenes.colours(bpy.data.objects["Lamp"], bpy.data.objects["Lamp"].data.color_attributes[0].name)
    assert found[:, :3].min() > 0.99


def test_what_cannot_be_written_is_said(tmp_path):
    floor, _, _ = scenes.lit_ball()
    assert not bpy.ops.pdm.export.poll()
    bake(target_error=0.05)
    floor.hide_set(True)
    with pytest.raises(RuntimeError, match="'Floor' is hidden"):
        written(tmp_path, "OBJ")
    floor.hide_set(False)
    for obj in bpy.data.objects:
        obj.data.color_attributes.remove(obj.data.color_attributes["Radiosity"])
    with pytest.raises(RuntimeError, match="bake again"):
        written(tmp_path, "OBJ")
