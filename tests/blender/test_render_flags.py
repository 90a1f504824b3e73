"""Flags of objects and collections that a render knows: what they do to light, as Cycles' own vertex bake has it."""

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix


def layer():
    return bpy.context.view_layer.layer_collection.children["Walls"]


HARMLESS = {  # a wall with them is there for the light as before
    "holdout": lambda wall: setattr(wall, "is_holdout", True),
    "shadow catcher": lambda wall: setattr(wall, "is_shadow_catcher", True),
    "no camera rays": lambda wall: setattr(wall, "visible_camera", False),
    "holdout of its collection": lambda wall: setattr(layer(), "holdout", True),
    "indirect only": lambda wall: setattr(layer(), "indirect_only", True),
    "hidden in the viewport": lambda wall: wall.hide_set(True),
}
GONE = {  # it is not
    "neither diffuse nor shadow rays": lambda wall: (
        setattr(wall, "visible_diffuse", False),
        setattr(wall, "visible_shadow", False),
    ),
    "excluded from the view layer": lambda wall: setattr(layer(), "exclude", True),
    "hidden from the render": lambda wall: setattr(wall, "hide_render", True),
}
TILT = (0.2, 0.4, 0)  # of the sun


def floor_and_wall():
    floor = scenes.grid("Floor", 2, 4.0, made_of=scenes.material("Floor"))
    wall = scenes.box("Wall", 1.0, Matrix.Translation((1, 0, 1.1)), scenes.material("Red", (0.9, 0.1, 0.1)))
    walls = bpy.data.collections.new("Walls")
    bpy.context.scene.collection.children.link(walls)
    for old in list(wall.users_collection):
        old.objects.unlink(wall)
    walls.objects.link(wall)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 3.0, 0.3, TILT
    bpy.context.scene.collection.objects.link(sun)
    bpy.context.view_layer.update()
    return floor, wall


def cycles(floor):
    """(n, 3) irradiance / pi of all light, baked by Cycles."""
    scene = bpy.context.scene
    scene.render.engine, scene.render.bake.target = "CYCLES", "VERTEX_COLORS"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_adaptive_sampling = "CPU", 64, False
    colours = floor.data.color_attributes
    colours.active_color = colours.new("Cycles", "FLOAT_COLOR", "POINT")
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == floor)
    bpy.context.view_layer.objects.active = floor
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    return scenes.colours(floor, "Cycles")[:, :3]


def bake(floor):
    bpy.context.view_layer.update()
    assert bpy.ops.pdm.bake(target_error=0.02, quantity="IRRADIANCE", domain="POINT") == {"FINISHED"}
    return scenes.colours(floor)[:, :3].copy()


def test_flags_that_do_nothing_to_light():
    """All of them together as without any, and as in Cycles."""
    floor, wall = floor_and_wall()
    plain = bake(floor)
    assert np.ptp(plain) > 0.1  # it shades the floor
    for switch in HARMLESS.values():
        switch(wall)
    np.testing.assert_array_equal(bake(floor), plain)
    theirs = cycles(floor)
    assert np.linalg.norm(plain - theirs) < 0.02 * np.linalg.norm(theirs)


@pytest.mark.parametrize("flag", GONE)
def test_flags_that_leave_an_object_out(flag):
    """The sun alone: 3 W/m2 times the cosine, over pi."""
    floor, wall = floor_and_wall()
    GONE[flag](wall)
    cosine = bpy.data.objects["Sun"].matrix_world[2][2]
    np.testing.assert_allclose(bake(floor), 3.0 * cosine / np.pi, rtol=2e-3)


def green():
    bpy.context.view_layer.material_override = scenes.material("All", (0.1, 0.8, 0.1))


def blue():
    bpy.context.view_layer.world_override = sky("Blue", (0.1, 0.2, 0.9, 1))


def no_sky():
    bpy.context.view_layer.use_sky = False


def sky(name, colour):
    world = bpy.data.worlds.new(name)
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = colour
    return world


@pytest.mark.parametrize("override", [green, blue, no_sky])
def test_what_the_view_layer_overrides(override):
    floor, wall = floor_and_wall()
    bpy.data.objects["Sun"].data.energy = 1.0
    bpy.context.scene.world = sky("White", (0.6, 0.6, 0.6, 1))
    plain = bake(floor)
    override()
    ours, theirs = bake(floor), cycles(floor)
    assert np.linalg.norm(ours - plain) > 0.02 * np.linalg.norm(plain)
    assert np.linalg.norm(ours - theirs) < 0.015 * np.linalg.norm(theirs)


@pytest.mark.parametrize("ray", ["diffuse", "shadow"])
def test_what_one_kind_of_ray_does_not_see_is_named(addon, ray):
    wall = floor_and_wall()[1]
    setattr(wall, f"visible_{ray}", False)
    bpy.context.view_layer.update()
    reading = addon("operators.reading.read_scene").read_scene(bpy.context)
    (warning,) = reading.warnings
    assert "'Wall'" in warning and f"Ray Visibility > {ray.title()} is off" in warning


def test_what_no_such_ray_sees_is_refused_aloud(addon):
    wall = floor_and_wall()[1]
    wall.visible_diffuse = wall.visible_shadow = False
    bpy.context.view_layer.update()
    reading = addon("operators.reading.read_scene").read_scene(bpy.context)
    ((name, reason),) = reading.refused
    assert name == "Wall" and "neither Diffuse nor Shadow" in reason
