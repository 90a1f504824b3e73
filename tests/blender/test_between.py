"""The look between the vertices: what it says of finer meshes is what finer meshes show, however it is read."""

import bpy
import pytest
import scenes
from test_bake import bake


def soft_shadow():
    """A floor of 9 vertices under a ball and an area light: by rays."""
    floor = scenes.grid("Floor", 2, 4.0, made_of=scenes.material("Floor", (0.6, 0.5, 0.4)))
    scenes.sphere("Ball", radius=0.6, matrix=scenes.Matrix.Translation((0, 0, 1.2)))
    lamp = bpy.data.objects.new("Area", bpy.data.lights.new("Area", "AREA"))
    lamp.data.size, lamp.data.energy, lamp.location = 1.5, 100.0, (0.4, 0.0, 4.0)
    bpy.context.collection.objects.link(lamp)
    return floor


def of_floor(report):
    return next(entry for entry in report["objects"] if entry["name"] == "Floor")


@pytest.mark.parametrize("times", [2, 4])
def test_what_it_foretells_is_measured_on_the_finer_mesh(times):
    floor = soft_shadow()
    foretold = dict(of_floor(bake(target_error=0.01))["finer"])
    assert {2, 4, 8} <= foretold.keys() and foretold[8] < foretold[2] < of_floor(bake(target_error=0.01))["between"]
    scenes.rebuild(
        floor,
        lambda b: scenes.bmesh.ops.create_grid(b, x_segments=2 * times, y_segments=2 * times, size=2.0),
    )
    bpy.context.view_layer.update()
    assert of_floor(bake(target_error=0.01))["between"] == pytest.approx(foretold[times], rel=0.25)


def test_in_two_stages_it_says_the_same_as_at_once(addon, monkeypatch):
    soft_shadow()
    at_once = of_floor(bake(target_error=0.02))["finer"]
    monkeypatch.setattr(addon("operators.baking.between_vertices"), "FEW_AT_ONCE", 0)
    in_two = of_floor(bake(target_error=0.02))["finer"]
    assert [n for n, _ in in_two] == [n for n, _ in at_once]
    assert [error for _, error in in_two] == pytest.approx([error for _, error in at_once], rel=0.02)


def test_of_many_coarse_meshes_the_worst_are_looked_at_finer(addon, monkeypatch):
    """Else a hall of 82 crates took three times as long to look at as to bake."""
    soft_shadow()
    monkeypatch.setattr(addon("operators.baking.between_vertices"), "WORST", 1)
    floor, ball = sorted(bake(target_error=0.005)["objects"], key=lambda entry: -entry["between"])
    assert ball["between"] > 0.005 and floor["name"] == "Floor" and "finer" in floor and "finer" not in ball
