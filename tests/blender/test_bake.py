"""bpy.ops.pdm.bake on real scenes: what it writes, what it leaves alone, what it refuses."""

import json

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix


def bake(**settings):
    """Bakes and returns the report."""
    assert bpy.ops.pdm.bake(**settings) == {"FINISHED"}
    return json.loads(bpy.context.scene.pdm_radiosity.last_report)


def solution_of(addon, target_error=0.01):
    reading = addon("operators.reading.read_scene").read_scene(bpy.context)
    return reading, addon("pdm_core").solve(reading.scene, target_error)


def test_colours_are_the_solutions_radiance_at_the_vertices(addon):
    scenes.lit_ball()
    report = bake()
    reading, solution = solution_of(addon)
    for name in ("Floor", "Ball"):
        read = next(o for o in reading.objects if o.name == name)
        surfaces = set(np.asarray(read.polygon_surface).tolist())
        assert len(surfaces) == 1
        obj = bpy.data.objects[name]
        world = scenes.vertices(obj) @ np.array(obj.matrix_world)[:3, :3].T + np.array(obj.matrix_world)[:3, 3]
        expected = solution.radiance(surfaces.pop(), world)
        baked = scenes.colours(obj)
        assert obj.data.color_attributes["Radiosity"].domain == "POINT"
        np.testing.assert_allclose(baked[:, :3], expected, rtol=2e-7, atol=1e-12)
        assert (baked[:, 3] == 1).all()
    assert scenes.colours(bpy.data.objects["Floor"])[:, 0].max() > 0.01
    assert report["error"] <= 0.01


def test_how_much_is_white_in_a_view_and_the_exposure_that_shows_it():
    scenes.lit_ball()
    dim = bake(target_error=0.05)["above_one"]
    count = sum(len(scenes.colours(bpy.data.objects[name])) for name in ("Floor", "Ball", "Lamp"))
    assert dim == {"share": 4 / count, "exposure": 0.0}  # the lamp's own four
    bright = bake(target_error=0.05, exposure=6.0)["above_one"]
    assert bright["share"] > 0.3 and bright["exposure"] < 6
    assert bake(target_error=0.05, exposure=bright["exposure"])["above_one"]["share"] <= 0.05


def test_lamp_shows_its_emission():
    scenes.lit_ball()
    bake()
    # its front faces the floor and reflects nothing: radiance is the emission's
    np.testing.assert_allclose(scenes.colours(bpy.data.objects["Lamp"])[:, :3], [[5, 4, 3]] * 4, rtol=1e-6)


def test_radiance_is_emission_plus_reflectance_times_irradiance():
    scenes.lit_ball()
    bake()
    bake(quantity="IRRADIANCE", attribute="Arriving")
    materials = {"Floor": ((0.6, 0.5, 0.4), 0), "Ball": (0.7, 0), "Lamp": (0, (5, 4, 3))}
    for name, (reflectance, emission) in materials.items():
        obj = bpy.data.objects[name]
        radiance, arriving = scenes.colours(obj)[:, :3], scenes.colours(obj, "Arriving")[:, :3]
        np.testing.assert_allclose(radiance, np.add(emission, np.multiply(reflectance, arriving)), rtol=1e-5, atol=1e-6)


def test_furnace_is_uniform():
    """Every surface emits 1 - rho: L = 1 everywhere, whatever the geometry; here a room with a ball."""
    grey = material_emitting_one_minus((0.5, 0.3, 0.8))
    scenes.box("Room", 4.0, made_of=grey, inverted=True)
    scenes.sphere("Ball", made_of=material_emitting_one_minus((0.7, 0.2, 0.4)))
    bake()
    for name in ("Room", "Ball"):
        np.testing.assert_allclose(scenes.colours(bpy.data.objects[name])[:, :3], 1.0, atol=0.01)


def material_emitting_one_minus(reflectance):
    made = scenes.new_material("Furnace")
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*reflectance, 1)
    shader.inputs["Emission Color"].default_value = (*(1 - r for r in reflectance), 1)
    shader.inputs["Emission Strength"].default_value = 1.0
    return made


def test_field_does_not_depend_on_the_mesh():
    """A sphere of 8 x 4 segments and one of 128 x 64: the same values at the vertices both have."""
    fields = []
    for segments, rings in ((8, 4), (128, 64)):
        bpy.ops.wm.read_homefile(use_empty=True)
        scenes.lit_ball()
        bpy.data.objects.remove(bpy.data.objects["Ball"])
        place = Matrix.Translation((0, 0, 1.5))
        ball = scenes.sphere("Ball", segments, rings, 1.0, place, scenes.material("Ball", (0.7, 0.7, 0.7)))
        bake()
        fields.append((scenes.vertices(ball), scenes.colours(ball)[:, :3].astype(float)))
    (coarse, values), (fine, fine_values) = fields
    distance = np.linalg.norm(coarse[:, None] - fine[None], axis=2)
    assert distance.min(axis=1).max() < 5e-6  # Blender's own vertices are that far from the common directions
    np.testing.assert_allclose(values, fine_values[distance.argmin(axis=1)], rtol=0, atol=1e-6)
    assert values.max() > 0.1


def test_domain_is_automatic():
    scenes.lit_ball()
    scenes.box("Box", 0.5, Matrix.Translation((1, 1, 1)))
    bake()
    domains = {o.name: o.data.color_attributes["Radiosity"].domain for o in bpy.data.objects}
    assert domains == {"Floor": "POINT", "Ball": "POINT", "Lamp": "POINT", "Box": "CORNER"}


def test_point_domain_of_a_box_is_the_mean_of_the_meeting_faces():
    scenes.lit_ball()
    box = scenes.box("Box", 0.5, Matrix.Translation((1.5, 0, 1)))
    bake(attribute="Corners")
    bake(attribute="Points", domain="POINT")
    corner_vertex = np.empty(len(box.data.loops), np.int32)
    box.data.loops.foreach_get("vertex_index", corner_vertex)
    corners, points = scenes.colours(box, "Corners"), scenes.colours(box, "Points")
    mean = [corners[corner_vertex == v].mean(axis=0) for v in range(len(points))]
    np.testing.assert_allclose(points, mean, rtol=1e-6)
    assert np.ptp(corners[:, 0]) > 0.01


def test_exposure_and_bytes_and_what_they_clip():
    floor, _, lamp = scenes.lit_ball()
    bake()
    report = bake(attribute="Bright", exposure=1.0)
    np.testing.assert_allclose(scenes.colours(floor, "Bright")[:, :3], 2 * scenes.colours(floor)[:, :3], rtol=1e-6)
    assert not any("clipped" in w for w in report["warnings"])
    report = bake(attribute="Bytes", data_type="BYTE_COLOR")
    assert lamp.data.color_attributes["Bytes"].data_type == "BYTE_COLOR"
    np.testing.assert_allclose(scenes.colours(lamp, "Bytes"), 1.0)
    assert any("4 colours above 1 clipped" in w and "Lamp" in w for w in report["warnings"])
    # 8 bits of sRGB: a step is at most 1 / 255 of the encoded range, .9 % of full scale when decoded
    np.testing.assert_allclose(scenes.colours(floor, "Bytes"), np.minimum(scenes.colours(floor), 1), atol=0.0046)


def test_selected_objects_only_receive_and_all_light():
    floor, ball, lamp = scenes.lit_ball()
    bake(attribute="All")
    for obj in (floor, ball, lamp):
        obj.select_set(obj is floor)
    bake(objects="SELECTED")
    np.testing.assert_array_equal(scenes.colours(floor), scenes.colours(floor, "All"))
    assert "Radiosity" not in ball.data.color_attributes and "Radiosity" not in lamp.data.color_attributes


def test_only_the_attribute_of_that_name_is_replaced():
    floor = scenes.lit_ball()[0]
    colours = floor.data.color_attributes
    other = colours.new("Mine", "BYTE_COLOR", "CORNER")
    other.data.foreach_set("color", np.full(4 * len(other.data), 0.25, np.float32))
    mine = scenes.colours(floor, "Mine").copy()
    colours.new("Radiosity", "BYTE_COLOR", "CORNER")
    colours.active_color_name = colours.default_color_name = "Mine"
    bake()
    new = colours["Radiosity"]
    assert (new.data_type, new.domain) == ("FLOAT_COLOR", "POINT")
    assert sorted(c.name for c in colours) == ["Mine", "Radiosity"]
    np.testing.assert_array_equal(scenes.colours(floor, "Mine"), mine)
    assert colours.active_color_name == colours.default_color_name == "Radiosity"


def test_undo_restores_the_old_colours():
    scenes.lit_ball()
    bake()
    before = scenes.colours(bpy.data.objects["Floor"]).copy()
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.pdm.bake("EXEC_DEFAULT", True, exposure=2.0) == {"FINISHED"}
    np.testing.assert_allclose(scenes.colours(bpy.data.objects["Floor"])[:, :3], 4 * before[:, :3], rtol=1e-6)
    bpy.ops.ed.undo()
    np.testing.assert_array_equal(scenes.colours(bpy.data.objects["Floor"]), before)


def test_a_failed_write_leaves_every_mesh_as_it_was(addon, monkeypatch):
    scenes.lit_ball()
    bake()
    floor, ball, lamp = (bpy.data.objects[n] for n in ("Floor", "Ball", "Lamp"))
    ball.data.color_attributes.remove(ball.data.color_attributes["Radiosity"])
    before = scenes.colours(floor).copy()
    module = addon("operators.baking.colour_attribute")
    write, calls = module._write, []

    def failing(*arguments):
        calls.append(arguments)
        if len(calls) == 3:
            raise MemoryError("no room")
        return write(*arguments)

    monkeypatch.setattr(module, "_write", failing)
    with pytest.raises(RuntimeError, match="no room.*nothing was changed"):
        bpy.ops.pdm.bake(exposure=3.0, domain="CORNER")
    assert len(calls) > 3  # the third failed, and what came before was put back
    assert floor.data.color_attributes["Radiosity"].domain == "POINT"
    np.testing.assert_array_equal(scenes.colours(floor), before)
    assert "Radiosity" not in ball.data.color_attributes
    assert lamp.data.color_attributes.active_color_name == "Radiosity"


@pytest.mark.parametrize(
    "name, said",
    [
        ("", "empty"),
        ("   ", "empty"),
        ("x" * 64, "64 bytes"),
        ("é" * 32, "64 bytes"),
        (".hidden", "reserved"),
        ("position", "reserved"),
        ("sharp_edge", "reserved"),
    ],
)
def test_names_that_blender_cannot_hold(name, said):
    floor = scenes.lit_ball()[0]
    with pytest.raises(RuntimeError, match=said):
        bpy.ops.pdm.bake(attribute=name)
    assert len(floor.data.color_attributes) == 0


@pytest.mark.parametrize("name", ["x" * 63, "é" * 31 + "x", "Größe 1"])
def test_the_longest_names_that_it_can(name):
    floor = scenes.lit_ball()[0]
    bake(attribute=name)
    assert [c.name for c in floor.data.color_attributes] == [name]


def test_an_attribute_of_another_kind_is_not_replaced():
    floor = scenes.lit_ball()[0]
    floor.data.uv_layers.new(name="Radiosity")
    with pytest.raises(RuntimeError, match="'Floor'.*no colour"):
        bpy.ops.pdm.bake()
    floor.vertex_groups.new(name="Weights")
    with pytest.raises(RuntimeError, match="'Floor'.*vertex group"):
        bpy.ops.pdm.bake(attribute="Weights")
    assert len(floor.data.color_attributes) == 0 and len(floor.data.uv_layers) == 1


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT"])
def test_scripts_leave_the_mode_and_go_back_to_it(mode):
    """What was edited until then is in the bake."""
    floor, ball, _ = scenes.lit_ball()
    for obj in (floor, ball):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = floor
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(0, 0, -1))
    assert bpy.ops.pdm.scan() == {"FINISHED"}
    assert bpy.ops.pdm.bake(target_error=0.05) == {"FINISHED"}
    assert floor.mode == mode and ball.mode == ("EDIT" if mode == "EDIT" else "OBJECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(ball.data.color_attributes) == len(floor.data.color_attributes) == 1
    assert scenes.vertices(floor)[0, 2] == (-1 if mode == "EDIT" else 0)


@pytest.mark.parametrize("active", ["Floor", "Lamp", None])
def test_all_that_is_edited_is_left_and_edited_again_and_nothing_else(active):
    """Whatever is active, selected or hidden by then."""
    floor, ball, lamp = scenes.lit_ball()
    layer, hidden = bpy.context.view_layer, scenes.box("Hidden", 0.1)
    for obj in (floor, ball, hidden):
        obj.select_set(True)
    layer.objects.active = floor
    bpy.ops.object.mode_set(mode="EDIT")
    ball.select_set(False)
    lamp.select_set(True)
    hidden.hide_set(True)
    layer.objects.active = active and layer.objects[active]
    assert bpy.ops.pdm.bake(target_error=0.2) == {"FINISHED"}
    assert [obj.mode for obj in (floor, ball, hidden, lamp)] == ["EDIT", "EDIT", "EDIT", "OBJECT"]
    assert [obj.select_get() for obj in (floor, ball, lamp)] == [True, False, True] and hidden.hide_get()
    assert layer.objects.active == (active and layer.objects[active])


def test_linked_mesh_is_not_baked(tmp_path):
    scenes.lit_ball()
    library = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(library), copy=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, linked):
        linked.objects = ["Floor"]
    bpy.context.collection.objects.link(linked.objects[0])
    with pytest.raises(RuntimeError, match=r"Floor.*(library|linked)"):
        bpy.ops.pdm.bake()


def test_a_scene_with_nothing_to_bake_says_why():
    with pytest.raises(RuntimeError, match="Nothing to bake"):
        bpy.ops.pdm.bake()
    scenes.wire("Wire")
    with pytest.raises(RuntimeError, match="Wire"):
        bpy.ops.pdm.bake()


def test_a_refused_object_is_named_in_the_report():
    scenes.lit_ball()
    scenes.wire("Wire")
    report = bake()
    assert [entry["name"] for entry in report["refused"]] == ["Wire"]
    assert len(report["refused"][0]["reason"]) > 10
    assert "Radiosity" not in bpy.data.objects["Wire"].data.color_attributes


def test_report_counts_what_was_written():
    objects = scenes.lit_ball()
    report = bake()
    assert {entry["name"] for entry in report["objects"]} == {"Floor", "Ball", "Lamp"}
    assert all(entry["baked"] for entry in report["objects"])
    assert report["vertices"] == sum(len(obj.data.vertices) for obj in objects) == report["colours"]
    seconds = report["seconds"]
    assert set(seconds) == {"read", "solve", "evaluate", "check", "write", "total"}
    assert abs(sum(seconds.values()) - 2 * seconds["total"]) < 1e-9
    assert report["settings"]["target_error"] == pytest.approx(0.01)
    assert report["versions"]["blender"] == bpy.app.version_string
    assert report["history"][-1][1] == report["error"]


def test_coarse_meshes_are_named_by_their_error_between_the_vertices():
    """A plane of four vertices cannot show a shadow; a fine one can."""
    floor, ball, lamp = scenes.lit_ball()
    scenes.rebuild(floor, lambda b: bmesh.ops.create_grid(b, x_segments=1, y_segments=1, size=2))
    scenes.rebuild(ball, lambda b: bmesh.ops.create_uvsphere(b, u_segments=96, v_segments=48, radius=1))
    report = bake()
    part = {entry["name"]: entry["between"] for entry in report["objects"]}
    assert part["Floor"] > 0.1 > 0.02 > part["Ball"] and part["Lamp"] < 1e-9
    assert sum(p**2 for p in part.values()) == pytest.approx(report["between_vertices"] ** 2)
    named = [w for w in report["warnings"] if "between the vertices" in w]
    assert len(named) == 1 and "Floor" in named[0] and "Lamp" not in named[0] and "subdivide" in named[0]
    scenes.rebuild(floor, lambda b: bmesh.ops.create_grid(b, x_segments=64, y_segments=64, size=2))
    part = {entry["name"]: entry["between"] for entry in bake()["objects"]}
    assert part["Floor"] < 0.02


def test_a_target_that_is_missed_is_warned_of_once(addon, monkeypatch):
    monkeypatch.setattr(addon("pdm_core.deadline"), "GRACE", (0.0, 1e5))  # however busy the machine is
    scenes.lit_ball()
    report = bake(target_error=1e-5, time_limit=0.5)
    assert report["error"] > 1e-5
    assert sum("above the target" in warning for warning in report["warnings"]) == 1


def test_scan_lists_what_the_bake_will_take():
    scenes.lit_ball()
    scenes.wire("Wire")
    assert bpy.ops.pdm.scan() == {"FINISHED"}
    scan = bpy.context.scene.pdm_radiosity.scan()
    assert {o["name"] for o in scan["objects"]} == {"Floor", "Ball", "Lamp"}
    assert [r["name"] for r in scan["refused"]] == ["Wire"]


def test_closing_the_steps_early_changes_nothing(addon):
    """What Esc does in a window."""
    floor = scenes.lit_ball()[0]
    module = addon("operators.baking.bake")
    steps = module.bake_steps(bpy.context, module.BakeSettings())
    stages = {next(steps).text for _ in range(3)}
    steps.close()
    assert "Reading the scene" in stages
    assert len(floor.data.color_attributes) == 0
    assert bpy.context.scene.pdm_radiosity.last_report == ""


def test_reading_a_large_mesh_gives_signs_of_life(addon):
    """A recognition that takes seconds is done beside steps that yield; Esc then leaves the scene as it was."""
    ground = scenes.add("Ground", lambda b: bmesh.ops.create_grid(b, x_segments=500, y_segments=500, size=1))
    scenes.lit_ball()
    module = addon("operators.baking.bake")
    steps = module.bake_steps(bpy.context, module.BakeSettings())
    stages = []
    while not stages or stages[-1].text == "Reading the scene":
        stages.append(next(steps))
    steps.close()
    # one a tick of the thread; each object alone would give one
    assert len(stages) > 3 + len(bpy.context.scene.objects)
    assert len(ground.data.color_attributes) == 0


@pytest.mark.parametrize("stage", ["Solving", "Evaluating vertices"])
def test_an_object_removed_meanwhile_is_named(addon, stage):
    floor, ball = scenes.lit_ball()[:2]
    module = addon("operators.baking.bake")
    steps, removed = module.bake_steps(bpy.context, module.BakeSettings(target_error=0.1)), False
    name = ball.name
    with pytest.raises(addon("operators.baking.colour_attribute").BakeError, match=f"'{name}' was removed"):
        for step in steps:
            if step.text == stage and not removed:
                bpy.data.objects.remove(ball)
                removed = True
    assert removed and len(floor.data.color_attributes) == 0


def room_facing(outward):
    room = scenes.add("Room", lambda b: bmesh.ops.create_cube(b, size=4))
    if not outward:
        room.data.flip_normals()
    scenes.sphere("Lamp", radius=0.3, made_of=scenes.material("Lamp", emission=(5, 5, 5)))
    return room


def test_normals_that_face_away_from_all_light_are_said_before_the_work():
    room = room_facing(outward=True)
    room.select_set(True)
    with pytest.raises(RuntimeError, match="Room.*flip the normals"):
        bake(objects="SELECTED")
    assert len(room.data.color_attributes) == 0
    report = bake()  # the lamp is black as a receiver, but not in the dark
    assert any("Room" in warning and "flip the normals" in warning for warning in report["warnings"])


def test_normals_that_face_the_light_are_not_warned_of():
    room_facing(outward=False)
    assert not any("flip the normals" in warning for warning in bake()["warnings"])


def test_invoke_in_background_bakes_at_once():
    floor = scenes.lit_ball()[0]
    assert bpy.ops.pdm.bake("INVOKE_DEFAULT") == {"FINISHED"}
    assert "Radiosity" in floor.data.color_attributes


def test_baking_again_what_shows_the_bake_changes_nothing():
    """The README's material: the attribute into an Emission."""
    floor = scenes.lit_ball()[0]
    bake()
    before = scenes.colours(floor).copy()
    shown = scenes.material("Shown", emission=(1, 1, 1))
    nodes = shown.node_tree.nodes
    colour = nodes.new("ShaderNodeVertexColor")
    colour.layer_name = "Radiosity"
    emission = next(node for node in nodes if node.bl_idname == "ShaderNodeEmission")
    shown.node_tree.links.new(colour.outputs["Color"], emission.inputs["Color"])
    bpy.data.objects["Ball"].data.materials[0] = shown
    report = bake()
    assert any("not taken as light" in text for text in report["warnings"])
    assert scenes.colours(floor)[:, 0].max() <= before[:, 0].max() * 1.01
    bpy.data.objects["Floor"].data.materials[0] = shown
    bake(attribute="Another")
    lit = np.array([5.0, 4.0, 3.0])  # taken as grey, under that lamp
    colours = scenes.colours(floor, "Another")[:, :3]
    np.testing.assert_allclose(colours[:, 1:] / colours[:, :1], [lit[1:] / lit[0]] * len(colours), rtol=0.1)
    assert colours.max() < 0.8


def test_nothing_that_shines_is_said_before_the_work():
    scenes.grid("Floor", 4, 4.0)
    with pytest.raises(RuntimeError, match="Nothing shines.*material that emits"):
        bpy.ops.pdm.bake()
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    lamp.data.energy = 0
    bpy.context.collection.objects.link(lamp)
    with pytest.raises(RuntimeError, match="Nothing shines.*'Sun'"):
        bpy.ops.pdm.bake()
    assert not bpy.data.objects["Floor"].data.color_attributes


def test_a_failure_after_writing_puts_all_back(addon, monkeypatch):
    floor = scenes.lit_ball()[0]
    bake()
    before, last = scenes.colours(floor).copy(), bpy.context.scene.pdm_radiosity.last_report
    module = addon("operators.baking.bake")

    def broken(*_):
        raise OverflowError("no report")

    monkeypatch.setattr(module, "bake_report", broken)
    with pytest.raises(OverflowError):
        addon("pdm_core.signs_of_life").finish(module.bake_steps(bpy.context, module.BakeSettings(exposure=2.0)))
    assert (scenes.colours(floor) == before).all()
    assert bpy.context.scene.pdm_radiosity.last_report == last


def test_colours_that_are_not_finite_are_not_written(addon):
    floor = scenes.lit_ball()[0]
    attribute = addon("operators.baking.colour_attribute")
    colours = np.full((25, 4), np.nan, np.float32)
    with pytest.raises(attribute.BakeError, match="Floor.*not finite"):
        attribute.write_colours([attribute.Colours("Floor", "POINT", colours)], "Radiosity", "FLOAT_COLOR")
    assert not floor.data.color_attributes


def test_volumes_take_no_part_and_what_is_beyond_bounds_is_refused():
    scenes.lit_ball()
    fog = scenes.new_material("Fog")
    nodes = fog.node_tree.nodes
    nodes.clear()
    output, volume = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeVolumePrincipled")
    fog.node_tree.links.new(volume.outputs[0], output.inputs["Volume"])
    scenes.box("Cloud", 3.0, made_of=fog)
    far = scenes.grid("Far")
    far.location.x = 3.4e38
    odd = scenes.grid("Odd")
    odd.data.vertices[0].co.x = float("nan")
    refused = {entry["name"]: entry["reason"] for entry in bake()["refused"]}
    assert "volume" in refused["Cloud"] and "transform" in refused["Far"] and "vertices" in refused["Odd"]


def test_crates_side_by_side_are_all_baked_and_doubles_left_out():
    lamp = scenes.material("Lamp", emission=(5, 5, 5))
    scenes.grid("Lamp", 1, 1.0, Matrix.Translation((1, 0, 4)), lamp)
    for k in range(3):
        scenes.box(f"Crate {k}", 1.0, Matrix.Translation((k, 0, 0)))
    scenes.box("Crate 1 again", 1.0, Matrix.Translation((1, 0, 0)))
    report = bake()
    assert {o["name"] for o in report["objects"] if o["baked"]} == {"Lamp", "Crate 0", "Crate 1", "Crate 2"}
    (double,) = report["refused"]
    assert double["name"] == "Crate 1 again" and "'Crate 1'" in double["reason"]


def test_disabling_the_add_on_ends_a_bake_that_runs(addon):
    scenes.lit_ball()
    modal = addon("operators.modal_steps")
    ended = []

    class Steps:
        def close(self):
            ended.append(True)

    timer = bpy.context.window_manager.event_timer_add(9.0, window=bpy.context.window_manager.windows[0])
    modal.current.begin(Steps(), timer)
    assert not bpy.ops.pdm.bake.poll()
    modal.stop_bake(bpy.context)
    assert ended and bpy.ops.pdm.bake.poll()
    bake()
