"""Live light: after a bake new light is in the colours at once, as a bake of it would have them; geometry ends it."""

import bpy
import numpy as np
import pytest
import scenes
from calls import calls
from scenes import Matrix

TARGET = 0.05


@pytest.fixture
def watch(addon):
    return addon("operators.live_watch")


@pytest.fixture
def lit():
    """A room's floor and wall, a ball, a rock and a lamp of Blender's: Live is on and they are baked."""
    floor = scenes.grid("Floor", 16, 4.0, made_of=scenes.material("Floor", (0.6, 0.5, 0.4)))
    turn = Matrix.Translation((-2, 0, 2)) @ Matrix.Rotation(np.pi / 2, 4, "Y")
    wall = scenes.grid("Wall", 8, 4.0, turn, scenes.material("Wall", (0.7, 0.2, 0.2)))
    ball = scenes.sphere("Ball", matrix=Matrix.Translation((0.5, 1, 1)), made_of=scenes.material("Ball"))
    data = bpy.data.lights.new("Lamp", "AREA")
    data.energy, data.size = 200.0, 1.0
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.location = 1, 0, 3.5
    bpy.context.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    bpy.context.scene.pdm_radiosity.live = True
    assert bpy.ops.pdm.bake(target_error=TARGET) == {"FINISHED"}
    return floor, wall, ball, lamp


def paint(name, colour):
    bpy.data.materials[name].node_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (*colour, 1)


def all_colours():
    names = [o.name for o in bpy.data.objects if o.type == "MESH"]
    return np.concatenate([scenes.colours(bpy.data.objects[name])[:, :3] for name in names])


def follow(watch):
    """What the timer of a window does."""
    bpy.context.view_layer.update()
    watch.follow(bpy.context)
    assert not watch.live.held.problem, watch.live.held.problem


def repaint():
    paint("Wall", (0.1, 0.7, 0.1))


def dim():
    bpy.data.lights["Lamp"].energy = 50.0
    bpy.data.lights["Lamp"].color = (1.0, 0.5, 0.2)


@pytest.mark.parametrize("change", [repaint, dim])
def test_new_light_is_that_of_a_new_bake(lit, watch, change):
    before = all_colours()
    change()
    follow(watch)
    seen = all_colours()
    assert watch.live.held is not None and np.abs(seen - before).max() > 0.01 * before.max()
    assert bpy.ops.pdm.bake(target_error=TARGET) == {"FINISHED"}
    fresh = all_colours()
    assert np.linalg.norm(seen - fresh) < TARGET / 2 * np.linalg.norm(fresh)


def test_off_and_on_again(lit, watch):
    before = all_colours()
    bpy.data.lights["Lamp"].energy = 0.0
    follow(watch)
    assert not all_colours().any()
    bpy.data.lights["Lamp"].energy = 200.0
    follow(watch)
    assert np.linalg.norm(all_colours() - before) < 1e-3 * np.linalg.norm(before)


def test_what_is_no_light_changes_nothing(lit, watch):
    before = all_colours()
    lit[0].select_set(True)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(camera)
    bpy.context.view_layer.update()
    camera.location.x = 1
    follow(watch)
    assert (all_colours() == before).all()


@pytest.mark.parametrize("what", ["move", "edit", "lamp", "assign", "add", "remove", "hide"])
def test_geometry_ends_it(lit, watch, what):
    floor, wall, ball, lamp = lit
    assert "MB kept" in watch.status(bpy.context.scene.pdm_radiosity)[1]
    if what == "move":
        ball.location.x += 0.1
    elif what == "edit":
        floor.data.vertices[0].co.z = 0.1
        floor.data.update()
    elif what == "lamp":
        lamp.location.x += 0.1
    elif what == "add":
        scenes.box("Box", 0.2)
    elif what == "remove":
        bpy.data.objects.remove(ball)
    elif what == "hide":
        ball.hide_render = True
    else:
        ball.data.materials[0] = bpy.data.materials["Wall"]
    bpy.context.view_layer.update()
    assert watch.live.held is None and "bake again" in watch.status(bpy.context.scene.pdm_radiosity)[1]


def test_what_cannot_be_told_is_said_and_the_colours_stay(lit, watch):
    before = all_colours()
    for size in (2.0, 1.0):  # another shadow, and back
        bpy.data.lights["Lamp"].size = size
        bpy.context.view_layer.update()
        watch.follow(bpy.context)
        problem = watch.status(bpy.context.scene.pdm_radiosity)[1]
        assert ("another shape" in problem) == (size == 2.0)
        assert np.abs(all_colours() - before).max() < 1e-3 * before.max()
    node = bpy.data.materials["Wall"].node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Picture", 4, 4)
    links = bpy.data.materials["Wall"].node_tree.links
    links.new(node.outputs["Color"], bpy.data.materials["Wall"].node_tree.nodes["Diffuse BSDF"].inputs["Color"])
    bpy.context.view_layer.update()
    watch.follow(bpy.context)
    assert "varies" in watch.live.held.problem and np.abs(all_colours() - before).max() < 1e-3 * before.max()


def test_memory_is_freed_by_the_button(lit, watch):
    assert watch.live.held.kept.bytes > 0
    assert bpy.ops.pdm.free_live() == {"FINISHED"}
    assert watch.live.held is None and not bpy.context.scene.pdm_radiosity.live
    repaint()
    bpy.context.view_layer.update()
    before = all_colours()
    assert bpy.ops.pdm.bake(target_error=TARGET) == {"FINISHED"}
    assert watch.live.held is None and np.abs(all_colours() - before).max() > 0


HEAVY = {  # what a bake takes long with
    "operators.reading.read_scene.read_steps",
    "operators.reading.mesh_arrays.arrays_of",
    "operators.baking.bake_points.bake_points",
    "pdm_core.radiosity.solve_steps",
}


def test_a_change_reads_one_material_and_solves_nothing(lit, watch):
    with calls() as of_bake:
        assert bpy.ops.pdm.bake(target_error=TARGET) == {"FINISHED"}
    repaint()
    bpy.context.view_layer.update()
    with calls() as of_change:
        watch.follow(bpy.context)
    assert set(of_bake) >= HEAVY and HEAVY.isdisjoint(of_change), sorted(of_bake)
    assert of_change["operators.reading.materials.read_material"] == 1
    assert of_change["operators.live._write"] == 1 and of_change.total() < of_bake.total() / 20


def test_switched_on_it_bakes_by_itself(lit, watch):
    own = bpy.context.scene.pdm_radiosity
    own.live, own.preset = False, "DRAFT"
    assert watch.live.held is None
    bpy.ops.pdm.live()
    assert own.live and watch.live.held is not None
    repaint()
    follow(watch)
    kept = watch.live.held
    bpy.ops.pdm.live()
    assert not own.live and watch.live.held is None
    lit[2].location.x += 0.1
    bpy.ops.pdm.live()
    assert watch.live.held not in (None, kept)
