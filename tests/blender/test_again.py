"""What the Redo panel changes is evaluated again from the solution at hand, where that still holds."""

import bpy
import numpy as np
import pytest
import scenes


@pytest.fixture
def bakes(addon, monkeypatch):
    """bakes(name=value, ...) as the Redo panel does -> how often it solved."""
    bake, again = addon("operators.baking.bake"), addon("operators.baking.again")
    solve, solved = bake.solve_steps, []
    monkeypatch.setattr(bake, "solve_steps", lambda *words: solved.append(True) or solve(*words))
    again.last.drop()

    def run(**settings):
        solved.clear()
        before = again.last.solution
        steps = bake.bake_steps(bpy.context, bake.BakeSettings(**{"target_error": 0.05, **settings}), last=again.last)
        addon("pdm_core.signs_of_life").finish(steps)
        assert bool(solved) == (again.last.solution is not before)
        return len(solved)

    yield run
    again.last.drop()


CHEAP = ({"exposure": 1.5}, {"quantity": "IRRADIANCE"}, {"domain": "CORNER"}, {"data_type": "BYTE_COLOR"},
         {"heat_map": True}, {"passes": {"DIRECT", "AO"}}, {"attribute": "Other"})  # fmt: skip


@pytest.mark.parametrize("changed", CHEAP, ids=str)
def test_it_is_the_bake_that_a_new_one_would_be(bakes, addon, changed):
    floor, ball, lamp = scenes.lit_ball()
    assert bakes() == 1
    assert bakes(**changed) == 0
    name = changed.get("attribute", "Radiosity")
    found = [scenes.colours(obj, name).copy() for obj in (floor, ball, lamp)]
    bpy.ops.pdm.bake(target_error=0.05, **changed)
    for obj, colours in zip((floor, ball, lamp), found):
        assert np.array_equal(scenes.colours(obj, name), colours)


@pytest.mark.parametrize("changed", ({"target_error": 0.02}, {"time_limit": 60.0}, {"apply_modifiers": True}), ids=str)
def test_what_changes_the_light_is_solved(bakes, changed):
    scenes.lit_ball()
    assert bakes() == 1 and bakes(**changed) == 1


def move(obj):
    obj.location.x += 0.1


def paint(obj):
    node = next(n for n in obj.material_slots[0].material.node_tree.nodes if n.type == "BSDF_DIFFUSE")
    node.inputs["Color"].default_value = 0.1, 0.2, 0.3, 1.0


def light_up(obj):
    lamp = bpy.data.objects.new("Point", bpy.data.lights.new("Point", "POINT"))
    lamp.data.energy, lamp.location = 100.0, (0, 0, 3.5)
    bpy.context.collection.objects.link(lamp)


@pytest.mark.parametrize("change", (move, paint, light_up))
def test_a_scene_that_is_another_is_solved(bakes, change):
    floor, ball, lamp = scenes.lit_ball()
    assert bakes()
    change(ball)
    bpy.context.view_layer.update()
    assert bakes()


def dented(obj):
    """No ball any more but a mesh."""
    obj.data.vertices[3].co *= 0.8


@pytest.mark.parametrize("shape", (lambda obj: None, dented), ids=("ball", "mesh"))
@pytest.mark.parametrize("way", ("ADAPTIVE", "UNIFORM"))
def test_new_vertices_read_the_solution_at_hand(bakes, addon, way, shape):
    floor, ball, lamp = scenes.lit_ball()
    shape(ball)
    assert bakes() == 1
    subdivide, finish = addon("operators.subdivide"), addon("pdm_core.signs_of_life").finish
    count, added, _ = finish(subdivide.subdivide_steps(bpy.context, way))
    assert count and added
    assert bakes() == 0
    found = [scenes.colours(obj).copy() for obj in (floor, ball, lamp)]
    bpy.ops.pdm.bake(target_error=0.005)
    for obj, colours in zip((floor, ball, lamp), found):
        true = scenes.colours(obj)
        assert np.linalg.norm(colours - true) < 0.05 * np.linalg.norm(true)


@pytest.mark.parametrize("change", (move, paint, light_up))
def test_a_subdivided_scene_that_is_another_is_solved(bakes, addon, change):
    _, ball, _ = scenes.lit_ball()
    assert bakes()
    addon("pdm_core.signs_of_life").finish(addon("operators.subdivide").subdivide_steps(bpy.context, "ADAPTIVE"))
    change(ball)
    bpy.context.view_layer.update()
    assert bakes()


def test_what_was_evaluated_again_is_live(bakes, addon):
    """Its light is kept of the shapes that were solved, which the file was read for once more."""
    _, ball, _ = scenes.lit_ball()
    bpy.context.scene.pdm_radiosity.live = True
    assert bakes() == 1 and bakes(exposure=1.0) == 0
    watch = addon("operators.live_watch")
    paint(ball)
    bpy.context.view_layer.update()
    watch.live.held.stale.add(ball.material_slots[0].material.name)
    watch.follow(bpy.context)
    assert not watch.live.held.problem
