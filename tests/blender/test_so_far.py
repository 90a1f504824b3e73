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


def undone():
    bpy.ops.ed.undo()


def mesh_removed():
    bpy.data.meshes.remove(bpy.data.objects["Ball"].data)


def mesh_changed():
    scenes.rebuild(bpy.data.objects["Floor"], lambda b: scenes.bmesh.ops.create_grid(b, size=1))


@pytest.mark.parametrize("meanwhile", [undone, mesh_removed, mesh_changed])
@pytest.mark.parametrize("before", [False, True], ids=["no colours", "old colours"])
def test_cancelled_after_an_undo_or_an_edit_what_is_there_has_no_colours_of_it(baking, meanwhile, before):
    """Another window takes input while this one bakes."""
    floor, ball, _ = scenes.lit_ball()
    bpy.ops.ed.undo_push(message="Before")
    if before:
        for obj in (floor, ball):
            old = obj.data.color_attributes.new(NAME, "FLOAT_COLOR", "POINT")
            old.data.foreach_set("color", np.full(4 * len(old.data), 0.25, np.float32))
    floor.location.x += 0.1
    bpy.ops.ed.undo_push(message="Moved")
    steps, shown = baking(target_error=0.002)
    while not shown:
        next(steps)
    meanwhile()
    steps.close()
    for obj in (obj for obj in bpy.data.objects if meanwhile is not mesh_changed or obj.name != "Floor"):
        colours = obj.data.color_attributes.get(NAME)
        assert colours is None or (before and (scenes.colours(obj) == 0.25).all())


def test_a_file_saved_meanwhile_has_none_of_it(baking, tmp_path):
    floor, ball, _ = scenes.lit_ball()
    steps, shown = baking(target_error=0.002)
    while not shown:
        next(steps)
    assert NAME in floor.data.color_attributes
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    finish(steps)
    assert NAME in floor.data.color_attributes
    with bpy.data.libraries.load(path) as (_, taken):
        taken.objects = [floor.name, ball.name]
    assert not any(NAME in obj.data.color_attributes for obj in taken.objects)


def test_the_report_is_the_baked_scenes_whatever_is_shown_at_the_end(baking):
    floor, _, _ = scenes.lit_ball()
    scene, other = bpy.context.scene, bpy.data.scenes.new("Other")
    steps, _ = baking(target_error=0.05)
    next(steps)
    while next(steps).text != "Solving":
        pass
    bpy.context.window.scene = other
    finish(steps)
    assert NAME in floor.data.color_attributes and scene.pdm_radiosity.report() and not other.pdm_radiosity.report()


def test_objects_that_get_meshes_of_their_own_are_left_till_then(baking):
    floor, ball, _ = scenes.lit_ball()
    twin = bpy.data.objects.new("Twin", ball.data)
    twin.location = 2.2, 0, 1.2
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
