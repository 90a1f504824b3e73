"""While a bake in a window goes on, the meshes show the best so far; what is left at its end is as if they had not."""

import bpy
import numpy as np
import pytest
import scenes

NAME = "Radiosity"


@pytest.fixture
def baking(addon, monkeypatch):
    """baking(settings) -> (steps of a bake whose solving is always taken for long, what was shown meanwhile)."""
    monkeypatch.setattr(addon("operators.baking.so_far"), "LEAST", (0.0, 0.0))
    bake = addon("operators.baking.bake")

    def start(**settings):
        shown, floor = [], bpy.data.objects["Floor"]
        steps = bake.bake_steps(
            bpy.context, bake.BakeSettings(**settings), show=lambda: shown.append(scenes.colours(floor).copy())
        )
        return steps, shown

    return start


def finish(steps):
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def test_what_is_shown_is_near_and_the_end_is_as_ever(baking):
    floor, ball, _ = scenes.lit_ball()
    steps, shown = baking(target_error=0.002, exposure=1.0)
    report = finish(steps)
    assert report["error"] <= 0.002 and shown
    found = [scenes.colours(obj).copy() for obj in (floor, ball)]
    assert np.linalg.norm(shown[0] - found[0]) < 0.2 * np.linalg.norm(found[0])
    bpy.ops.pdm.bake(target_error=0.002, exposure=1.0)
    for obj, colours in zip((floor, ball), found):
        assert np.array_equal(scenes.colours(obj), colours)


@pytest.mark.parametrize("before", [False, True], ids=["no colours", "old colours"])
def test_cancelled_everything_is_as_it_was(baking, before):
    floor, ball, lamp = scenes.lit_ball()
    other = floor.data.color_attributes.new("Other", "BYTE_COLOR", "CORNER")
    if before:
        old = floor.data.color_attributes.new(NAME, "BYTE_COLOR", "POINT")
        old.data.foreach_set("color", np.full(4 * len(old.data), 0.25, np.float32))
    floor.data.color_attributes.active_color_name = other.name

    def state():
        layers = [
            [(a.name, a.data_type, a.domain, scenes.colours(obj, a.name).tobytes()) for a in obj.data.color_attributes]
            for obj in (floor, ball, lamp)
        ]
        colours = floor.data.color_attributes
        return [sorted(own) for own in layers], colours.active_color_name, colours.default_color_name

    was = state()
    steps, shown = baking(target_error=0.002)
    while not shown:
        next(steps)
    assert state() != was
    steps.close()
    assert state() == was


def test_objects_that_get_meshes_of_their_own_are_left_till_then(baking):
    floor, ball, _ = scenes.lit_ball()
    twin = bpy.data.objects.new("Twin", ball.data)
    twin.location = 1.2, 0, 0.5
    bpy.context.collection.objects.link(twin)
    bpy.context.view_layer.update()
    steps, shown = baking(target_error=0.01, make_single_user=True)
    finish(steps)
    assert shown and twin.data != ball.data and not np.array_equal(scenes.colours(twin), scenes.colours(ball))


def test_a_bake_that_ends_soon_shows_only_its_end(addon):
    scenes.lit_ball()
    bake, shown = addon("operators.baking.bake"), []
    steps = bake.bake_steps(bpy.context, bake.BakeSettings(target_error=0.3), show=lambda: shown.append(True))
    finish(steps)
    assert not shown
