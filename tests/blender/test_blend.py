"""Blend: the light multiplied into, or added to, another colour layer, which stays as it is."""

import bpy
import numpy as np
import pytest
import scenes
from test_bake import bake

LIVE = 0.05  # a coarse target is as good


def paint(obj, name, domain, kind="FLOAT_COLOR"):
    """A layer of known colours (n, 4), other ones at each place."""
    layer = obj.data.color_attributes.new(name, kind, domain)
    values = np.random.default_rng(len(layer.data)).uniform(0.1, 0.9, (len(layer.data), 4)).astype(np.float32)
    layer.data.foreach_set("color", values.ravel())
    return scenes.colours(obj, name)


def corner_vertices(obj):
    return [loop.vertex_index for loop in obj.data.loops]


@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
@pytest.mark.parametrize("blend, way", [("MULTIPLY", np.multiply), ("ADD", np.add)])
def test_the_result_is_the_layer_and_the_light_however_often(blend, way, kind):
    floor, _, _ = scenes.lit_ball()
    base = paint(floor, "Paint", "POINT", kind)
    bake(target_error=LIVE, attribute="Light")
    light = scenes.colours(floor, "Light")
    for _ in range(2):
        bake(target_error=LIVE, blend=blend, layer="Paint")
        found = scenes.colours(floor)
        assert np.allclose(found[:, :3], way(base, light)[:, :3], rtol=1e-5)
        assert np.array_equal(found[:, 3], base[:, 3])
        assert np.array_equal(scenes.colours(floor, "Paint"), base)
    assert floor.data.color_attributes.active_color_name == "Radiosity"


@pytest.mark.parametrize("domain, other", [("POINT", "CORNER"), ("CORNER", "POINT")])
def test_a_layer_of_the_other_domain(domain, other):
    floor, _, _ = scenes.lit_ball()
    base, of_corner = paint(floor, "Paint", other), corner_vertices(floor)
    if other == "CORNER":
        expected = np.array([base[np.array(of_corner) == k].mean(axis=0) for k in range(len(floor.data.vertices))])
    else:
        expected = base[of_corner]
    bake(target_error=LIVE, domain=domain, attribute="Light")
    bake(target_error=LIVE, domain=domain, blend="MULTIPLY", layer="Paint")
    expected = expected[:, :3] * scenes.colours(floor, "Light")[:, :3]
    assert np.allclose(scenes.colours(floor)[:, :3], expected, rtol=1e-5)


def test_an_object_without_the_layer_gets_the_light_alone_and_is_named():
    floor, ball, _ = scenes.lit_ball()
    paint(floor, "Paint", "CORNER")
    bake(target_error=LIVE, attribute="Light")
    report = bake(target_error=LIVE, blend="MULTIPLY", layer="Paint")
    assert np.allclose(scenes.colours(ball), scenes.colours(ball, "Light"), rtol=1e-5)
    assert any("'Ball'" in text and "'Paint'" in text for text in report["warnings"])


@pytest.mark.parametrize("settings, word", [
    ({"layer": ""}, "Name the colour layer"),
    ({"layer": "Radiosity"}, "choose another Attribute"),
    ({"layer": "Radiosity Error", "heat_map": True}, "choose another Attribute"),
    ({"layer": "Nowhere"}, "No object that is baked has"),
])  # fmt: skip
def test_what_cannot_be_blended_is_said_and_nothing_changes(settings, word):
    floor, _, _ = scenes.lit_ball()
    paint(floor, "Paint", "POINT")
    with pytest.raises(RuntimeError, match=word):
        bake(target_error=LIVE, blend="MULTIPLY", **settings)
    assert [a.name for a in floor.data.color_attributes] == ["Paint"]


def test_undo_takes_it_back():
    floor, _, _ = scenes.lit_ball()
    base = paint(floor, "Paint", "POINT")
    bpy.ops.ed.undo_push(message="before")
    bake(target_error=LIVE, blend="ADD", layer="Paint")
    bpy.ops.ed.undo_push(message="baked")
    bpy.ops.ed.undo()
    floor = bpy.data.objects["Floor"]
    assert [a.name for a in floor.data.color_attributes] == ["Paint"]
    assert np.array_equal(scenes.colours(floor, "Paint"), base)
