"""What the sidebar lists and mends, its presets, the example room; what happens between slices of a bake."""

import itertools
import json
import math
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import scenes
from test_bake import bake


@pytest.fixture
def settings():
    return lambda: bpy.context.scene.pdm_radiosity


def listed(settings):
    return {item.name: item for item in settings().listed}


def test_presets_are_target_errors(settings):
    own = settings()
    assert own.preset == "GOOD" and own.target_error == pytest.approx(0.01)
    own.preset = "DRAFT"
    assert own.target_error == pytest.approx(0.05)
    own.target_error = 0.0025
    assert own.preset == "FINE"
    own.target_error = 0.02
    assert own.preset == "CUSTOM"
    own.preset = "GOOD"
    own.preset = "CUSTOM"
    assert own.preset == "CUSTOM" and own.target_error == pytest.approx(0.01)


def test_a_row_says_what_it_is_and_a_click_selects_it(settings):
    floor, ball, lamp = scenes.lit_ball()
    wire = scenes.wire("Wire")
    bpy.ops.pdm.scan()
    rows = listed(settings)
    assert list(rows) == ["Wire", "Floor", "Ball", "Lamp"]  # refused ones first
    assert rows["Wire"].reason and not rows["Wire"].kind and rows["Ball"].kind == "SPHERE"
    assert all(row.between < 0 for row in rows.values())
    bake()
    rows = listed(settings)
    assert rows["Floor"].is_coarse and rows["Floor"].between > 0.01 and not rows["Lamp"].is_coarse
    for obj in (floor, lamp, wire):
        obj.select_set(True)
    settings().listed_index = list(rows).index("Ball")
    assert bpy.context.selected_objects == [ball] and bpy.context.view_layer.objects.active == ball


def test_the_line_on_top(addon, settings):
    look = addon("operators.look")
    look.watch.__init__()
    scenes.lit_ball()
    scenes.wire("Wire")
    bpy.ops.pdm.scan()
    assert look.summary(settings())[1] == "3 objects, 1 light, 1 refused"
    assert not look.is_dark(settings()) and not look.is_empty(settings())
    bpy.data.objects["Lamp"].data.materials.clear()
    bpy.ops.pdm.scan()
    assert look.is_dark(settings()) and "0 lights" in look.summary(settings())[1]
    bpy.context.scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        bpy.context.scene.world.use_nodes = True
    bpy.ops.pdm.scan()
    assert "sky" in look.summary(settings())[1] and not look.is_dark(settings())


def test_changes_are_noticed_and_read_in_slices(addon, settings):
    look = addon("operators.look")
    floor = scenes.lit_ball()[0]
    scenes.grid("Hidden").hide_viewport = True
    bpy.context.view_layer.update()

    def read():
        while not look._read(bpy.context):
            pass

    read()
    bpy.context.view_layer.update()
    assert not look.watch.is_stale and len(settings().listed) == 4  # reading is no change itself
    floor.location.z = -1
    bpy.context.view_layer.update()
    assert look.watch.is_stale
    read()
    bpy.ops.object.select_all(action="SELECT")
    bpy.context.view_layer.update()
    assert not look.watch.is_stale


def test_what_was_not_read_yet_is_not_called_nothing(addon, settings):
    look = addon("operators.look")

    def read():
        while not look._read(bpy.context):
            pass

    read()
    assert look.is_surely_empty(settings())
    scenes.lit_ball()
    bpy.context.view_layer.update()
    assert not look.is_surely_empty(settings()) and look.summary(settings())[1] == "Looking at the scene ..."
    read()
    assert "3 objects" in look.summary(settings())[1]


def test_only_a_reading_that_came_to_its_end_tells_what_is_slow(addon, monkeypatch):
    """One that a change interrupts is begun again, whatever it took: else what was there before stood on for good."""
    look = addon("operators.look")
    floor = scenes.lit_ball()[0]
    look.watch.__init__()
    monkeypatch.setattr(look, "SLOWEST", -1.0)
    monkeypatch.setattr(look, "SLICE", 1e-4)
    assert not look._read(bpy.context)
    floor.location.z = -1
    bpy.context.view_layer.update()
    assert look.watch.is_stale and not look.watch.is_slow
    while not look._read(bpy.context):
        pass
    assert look.watch.is_slow and not look.watch.is_stale


MENDED = {
    "SINGLE_USER": "shares its mesh",
    "APPLY": "vertices moved",
    "CONVERT": "convert it",
    "FLIP": "normals face away",
}


@pytest.mark.parametrize("way", MENDED)
def test_what_is_refused_is_mended_by_its_button(settings, way):
    floor, ball, lamp = scenes.lit_ball()
    name = "Ball"
    if way == "SINGLE_USER":
        twin = bpy.data.objects.new("Twin", ball.data)
        twin.location = 0, 0, 10
        bpy.context.collection.objects.link(twin)
        name = "Twin"
    elif way == "APPLY":
        name = "Crate"
        crate = scenes.box(name, 0.5)
        crate.location = 1.5, 1.5, 1
        crate.modifiers.new("Row", "ARRAY").use_relative_offset = True
        crate.modifiers[0].relative_offset_displace = (-2, 0, 0)
    elif way == "CONVERT":
        name = "Curve"
        curve = bpy.data.curves.new(name, "CURVE")
        curve.dimensions, curve.fill_mode = "2D", "BOTH"
        line = curve.splines.new("POLY")
        line.points.add(3)
        line.use_cyclic_u = True
        for point, co in zip(line.points, ((0, 0), (1, 0), (1, 1), (0, 1))):
            point.co = (*co, 0, 1)
        obj = bpy.data.objects.new(name, curve)
        obj.location = -1.5, -1.5, 0.5
        bpy.context.collection.objects.link(obj)
    else:
        name = "Floor"
        scenes.rebuild(floor, lambda b: (scenes.bmesh.ops.create_grid(b, x_segments=4, y_segments=4, size=2),
                                         scenes.bmesh.ops.reverse_faces(b, faces=b.faces)))  # fmt: skip
    bake()
    row = listed(settings)[name]
    assert MENDED[way] in row.reason and row.mend == way
    others = {other.name: other.data.name for other in bpy.data.objects if other.name != name}
    assert bpy.ops.pdm.mend(object=name, way=way) == {"FINISHED"}
    assert {other: bpy.data.objects[other].data.name for other in others} == others
    bpy.context.view_layer.update()
    bake()
    assert not listed(settings)[name].reason and listed(settings)[name].between >= 0


def test_the_example_room_bakes_at_once(settings):
    scenes.lit_ball()
    before = {obj.name for obj in bpy.context.scene.objects}
    first = bpy.context.scene
    assert bpy.ops.pdm.example_room() == {"FINISHED"}
    room = bpy.data.scenes["Radiosity Example"]
    assert {obj.name for obj in first.objects} == before and len(room.objects) == 10
    with bpy.context.temp_override(scene=room, view_layer=room.view_layers[0]):
        bpy.ops.pdm.bake(target_error=0.05)
    report = json.loads(room.pdm_radiosity.last_report)
    assert not report["refused"] and sum(o["baked"] for o in report["objects"]) == 9
    assert report["warnings"] == [] or all("between" in text for text in report["warnings"])
    assert scenes.colours(room.objects["Room Floor"])[:, :3].mean() > 0.1


def test_keep_the_best_so_far(addon):
    """Asked to, a solve ends with what it has; what it states is what it reached."""
    scenes.lit_ball()
    module = addon("operators.baking.bake")
    settings, asked = module.BakeSettings(target_error=1e-5), []

    def enough():
        return bool(asked)

    steps, worst = module.bake_steps(bpy.context, settings, enough), math.inf
    while True:
        try:
            stage = next(steps)
        except StopIteration as end:
            report = end.value
            break
        if math.isfinite(stage.error) and stage.error < 0.05:
            asked.append(stage.error)
    assert 1e-5 < report["error"] <= 0.05 and report["error"] < worst
    assert "Radiosity" in bpy.data.objects["Floor"].data.color_attributes


def test_the_line_on_top_after_a_bake(addon, settings):
    scenes.lit_ball()
    bake()
    assert addon("operators.look").summary(settings())[1] == "3 objects, 1 light"


@pytest.mark.parametrize(
    "seconds, said, about", [
        (0.4, "0 s", "0 s"), (59.4, "59 s", "59 s"), (59.7, "1 min", "1 min"), (125, "2 min 5 s", "2 min"),
        (2172, "36 min 12 s", "36 min"), (6223, "1 h 43 min", "1 h 40 min"), (7200, "2 h", "2 h"),
    ],
)  # fmt: skip
def test_durations(addon, seconds, said, about):
    report = addon("operators.baking.report")
    assert report.duration(seconds) == said and report.roughly(seconds) == about


def test_the_bar_never_runs_back(addon):
    modal = addon("operators.modal_steps")
    stage = addon("operators.baking.bake").Stage
    current = modal._Current()
    current.begin(object(), None, 0.01, True)
    seen, clock = [], iter(np.linspace(0, 5, 40))
    current.elapsed = lambda: now
    for error in np.geomspace(1, 0.01, 40):
        now = next(clock) + 0.01
        current.at(stage("Solving", 0.0, error))
        seen.append(current.done())
    for share in (0.0, 0.5, 1.0):
        current.at(stage("Evaluating vertices", share, 0.01))
        seen.append(current.done())
    assert (np.diff(seen) >= 0).all() and seen[0] < 0.1 and seen[-1] == 1 and current.can_be_kept()


def test_time_left_is_not_told_where_it_is_over(addon):
    """As long as it took to halve the error, and no longer: it said about 0 s for minutes."""
    modal = addon("operators.modal_steps")
    current = modal._Current()
    current.begin(object(), None, 0.01, True)
    clock = [1.0]
    current.elapsed = lambda: clock[0]
    for clock[0], error in ((1.0, 0.04), (2.0, 0.02)):
        current.at(addon("operators.baking.bake").Stage("Solving", 0.0, error))
    assert 1 < current.left() < 6
    clock[0] = 20.0
    assert current.left() is None and current.done() <= 0.9


def test_while_something_runs_nothing_else_may(addon):
    scenes.lit_ball()
    bake()
    modal = addon("operators.modal_steps")
    modal.current.begin(None, None)
    try:
        names = ("bake", "scan", "mend", "subdivide", "preview_material", "example_room", "convergence")
        assert not any(getattr(bpy.ops.pdm, name).poll() for name in names) and bpy.ops.pdm.stop.poll()
        assert bpy.ops.pdm.stop(keep=True) == {"CANCELLED"} and not modal.current.wish  # Bake was clicked twice
        modal.current.begun -= 1
        bpy.ops.pdm.stop(keep=True)
        assert modal.current.wish == "KEEP"
    finally:
        modal.current.stage = None
    assert bpy.ops.pdm.bake.poll() and not bpy.ops.pdm.stop.poll()


@pytest.mark.parametrize("drawing", [0.02, 0.06, 0.3])
def test_input_waits_neither_for_slices_nor_for_much_drawing(addon, monkeypatch, drawing):
    """Of steps of 10 ms, and one of 40 now and then, where Blender takes 2 ms from slice to slice, and twice its time
    to draw once it was asked."""
    modal, clock = addon("operators.modal_steps"), [0.0]
    drawn, asked, turns = [], [], itertools.count()

    def work():
        while True:
            clock[0] += 0.01 if next(turns) % 7 else 0.04
            yield modal.Stage("Solving", 0.5, 0.1)

    monkeypatch.setattr(modal.time, "perf_counter", lambda: clock[0])
    monkeypatch.setattr(modal, "redraw_sidebars", lambda context: asked.extend([drawing] * 2))
    monkeypatch.setattr(modal, "status", str)
    window = SimpleNamespace(workspace=SimpleNamespace(status_text_set=lambda text: None))
    operator = SimpleNamespace(steps=work(), stopped_at=0.0, drawn_at=0.0, usual=modal.TICK, lost=0.0, since=0)
    asked[:], waits = [drawing] * 2, []  # a button was pressed
    modal.current.begin(operator.steps, None)
    try:
        while clock[0] < 20:
            before = clock[0]
            modal.Steps.advance(operator, window)
            clock[0] += 0.002
            if asked:
                drawn.append(asked.pop())
                clock[0] += drawn[-1]
            waits.append(clock[0] - before)
    finally:
        modal.current.__init__()
    assert len(drawn) > 6 and sum(drawn) < 0.12 * clock[0]
    assert max(waits) < max(0.1, drawing + 0.05)


def test_what_a_bake_failed_at_is_told_though_the_change_was_made_while_it_ran(addon):
    """It stays until the next change."""
    look, current = addon("operators.look"), addon("operators.modal_steps").current
    scenes.lit_ball()
    look.panel_shown(bpy.context)
    bpy.data.objects.remove(bpy.data.objects["Ball"])
    current.problem = " ".join(["Object 'Ball'", "was removed"])
    for _ in range(2):
        look.panel_shown(bpy.context)
        assert current.problem == "Object 'Ball' was removed"
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    look.panel_shown(bpy.context)
    assert not current.problem
    look.forget()
