"""`--command pdm bake`: exit codes, files, messages; the same main() that a script calls."""

import json
import os
import signal

import bpy
import numpy as np
import pytest
import scenes


@pytest.fixture
def main(addon):
    return addon("operators.command_line").main


@pytest.fixture
def saved(tmp_path):
    """A lit ball, saved and loaded as `blender -b scene.blend` does."""
    scenes.lit_ball()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return path


def test_bake_writes_file_and_report(main, saved, capfd):
    before = saved.read_bytes()
    output, report = saved.with_name("baked.blend"), saved.with_name("report.json")
    code = main(["bake", "--target-error", "0.02", "--output", str(output), "--report", str(report)])
    printed = capfd.readouterr()
    assert code == 0, printed.err
    assert "Baked 3 objects" in printed.out
    assert "pdm: Solving" in printed.err and "Baked" not in printed.err
    assert saved.read_bytes() == before
    written = json.loads(report.read_text())
    assert written["settings"]["target_error"] == 0.02 and written["error"] <= 0.02
    bpy.ops.wm.open_mainfile(filepath=str(output))
    assert scenes.colours(bpy.data.objects["Floor"])[:, 0].max() > 0.01
    assert json.loads(bpy.context.scene.pdm_radiosity.last_report) == written


def test_objects_and_options(main, saved):
    report = saved.with_name("r.json")
    words = "--objects Floor Ball --attribute Light --quantity irradiance --domain corner --data-type byte_color"
    assert main(["bake", *words.split(), "--exposure", "-2", "--time-limit", "100", "--report", str(report)]) == 0
    attribute = bpy.data.objects["Floor"].data.color_attributes["Light"]
    assert (attribute.domain, attribute.data_type) == ("CORNER", "BYTE_COLOR")
    assert "Light" in bpy.data.objects["Ball"].data.color_attributes
    assert "Light" not in bpy.data.objects["Lamp"].data.color_attributes
    assert json.loads(report.read_text())["settings"] == {
        "objects": ["Floor", "Ball"],
        "target_error": 0.01,
        "time_limit": 100.0,
        "attribute": "Light",
        "quantity": "IRRADIANCE",
        "domain": "CORNER",
        "data_type": "BYTE_COLOR",
        "exposure": -2.0,
        "blend": "REPLACE",
        "layer": "",
        "heat_map": False,
        "passes": [],
        "ao_distance": 1.0,
        "make_single_user": False,
        "apply_modifiers": False,
    }


def test_unknown_object_fails_and_writes_nothing(main, saved, capfd):
    report = saved.with_name("r.json")
    assert main(["bake", "--objects", "Flor", "--report", str(report)]) == 1
    assert "Flor" in capfd.readouterr().err
    assert not report.exists()
    assert len(bpy.data.objects["Floor"].data.color_attributes) == 0


@pytest.mark.parametrize("words", [["--help"], ["bake", "--help"]])
def test_help(main, words, capfd):
    assert main(words) == 0
    assert "usage: blender -b SCENE.blend --command pdm" in capfd.readouterr().out


@pytest.mark.parametrize(
    "words, said",
    [
        ([], "required"),
        (["fry"], "invalid choice"),
        (["bake"], "nothing would be written"),
        (["bake", "--target-error", "-1", "--report", "r.json"], "not between"),
        (["bake", "--target-error", "much", "--report", "r.json"], "much"),
        (["bake", "--target-error", "nan", "--report", "r.json"], "not between"),
        (["bake", "--domain", "FACE", "--report", "r.json"], "invalid choice"),
        (["bake", "--output", "baked.txt"], "must end in .blend"),
        (["bake", "--image", "out.jpg"], "must end in .png"),
        (["bake", "--report", "no such folder/r.json"], "does not exist"),
    ],
)
def test_wrong_usage_is_2(main, saved, words, said, capfd):
    assert main(words) == 2
    assert said in capfd.readouterr().err


def test_a_file_that_did_not_load_is_refused(main, tmp_path, capfd):
    """`blender -b missing.blend --command` runs on the default scene."""
    scenes.lit_ball()
    assert main(["bake", "--report", str(tmp_path / "r.json")]) == 1
    assert "no .blend file was loaded" in capfd.readouterr().err
    assert not (tmp_path / "r.json").exists()


def test_image_shows_the_colours_and_changes_nothing(main, saved, capfd):
    scene, image = bpy.context.scene, saved.with_name("out.png")
    scene.render.resolution_x, scene.render.resolution_y = 80, 60
    scene.view_settings.view_transform = "Standard"
    kinds = ("scenes", "objects", "meshes", "cameras", "materials", "worlds")
    before = {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}
    engine = scene.render.engine
    with bpy.context.temp_override(window=None):  # as under `blender -b --command`
        assert main(["bake", "--image", str(image)]) == 0, capfd.readouterr().err
    assert {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds} == before
    assert (scene.render.engine, scene.camera) == (engine, None)
    assert picture(image).shape == (60, 80, 3)
    assert picture(image).max() > 0.2 and picture(image).min() < 0.02


def test_image_pixel_is_the_baked_colour_from_the_scenes_camera(main, saved):
    """A camera that sees nothing but the lamp: every pixel is its emission, scaled by the exposure into the range."""
    scene, image = bpy.context.scene, saved.with_name("out.png")
    scene.render.resolution_x = scene.render.resolution_y = 16
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.location, camera.rotation_euler = (1, 0, 3.8), (np.pi, 0, 0)
    assert main(["bake", "--exposure", "-3", "--image", str(image)]) == 0
    linear = np.array([5, 4, 3]) / 8
    encoded = 1.055 * linear ** (1 / 2.4) - 0.055
    np.testing.assert_allclose(picture(image).reshape(-1, 3), [encoded] * 256, atol=1.01 / 255)


def picture(path):
    """(height, width, 3) the file's own numbers, 0 to 1."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], -1)[:, :, :3]
    bpy.data.images.remove(image)
    return values


@pytest.mark.parametrize("option", ["--report", "--image"])
def test_files_named_twice_are_refused_before_the_work(main, saved, option, capfd):
    before, png = saved.read_bytes(), saved.with_suffix(".png")
    if option == "--report":
        assert main(["bake", "--report", str(saved)]) == 2
    assert main(["bake", "--image", str(png), "--report", str(png)]) == 2
    assert "named twice or is the file itself" in capfd.readouterr().err
    assert saved.read_bytes() == before and not png.exists()


def test_a_folder_is_refused_before_the_work(main, saved, capfd):
    folder = saved.with_name("folder.blend")
    folder.mkdir()
    for option in ("--report", "--output"):
        assert main(["bake", option, str(folder)]) == 2
        assert "is a folder" in capfd.readouterr().err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
def test_what_is_no_file_is_written_to_and_stays(main, saved):
    """--report /dev/stdout put a file in the device's place where that is allowed, else failed; links lost theirs."""
    pipe, link, report = (saved.with_name(name) for name in ("pipe", "link.json", "report.json"))
    os.mkfifo(pipe)
    link.symlink_to(report)
    read = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert main(["bake", "--target-error", "0.5", "--report", str(pipe)]) == 0
        assert os.read(read, 1) == b"{" and pipe.is_fifo()
    finally:
        os.close(read)
    assert main(["bake", "--target-error", "0.5", "--report", str(link)]) == 0
    assert link.is_symlink() and json.loads(report.read_text())["objects"]


def test_a_picture_that_is_not_whole_is_a_failure(main, addon, saved, monkeypatch, capfd):
    """As on a full disk, of which Blender says nothing: an older picture stays."""
    image = saved.with_name("out.png")
    image.write_bytes(b"older")
    command_line = addon("operators.command_line")

    def cut_short(context, attribute, path):
        with open(path, "wb") as file:
            file.write(b"\x89PNG")

    monkeypatch.setattr(command_line, "render_image", cut_short)
    assert main(["bake", "--image", str(image)]) == 1
    assert "disk full" in capfd.readouterr().err
    assert image.read_bytes() == b"older" and [p.name for p in saved.parent.glob("*.part*")] == []


def test_ctrl_c_stops_with_130_and_writes_nothing(main, addon, saved, monkeypatch, capfd):
    report, command_line = saved.with_name("r.json"), addon("operators.command_line")

    def pressed(self, stage):
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(command_line._Progress, "__call__", pressed)
    assert main(["bake", "--report", str(report)]) == 130
    assert "stopped" in capfd.readouterr().err and not report.exists()
    assert not bpy.data.objects["Floor"].data.color_attributes


def test_what_is_done_never_falls(addon, monkeypatch, capsys):
    command_line, stage = addon("operators.command_line"), addon("operators.baking.bake").Stage
    monkeypatch.setattr(command_line, "PROGRESS_SECONDS", 0.0)
    progress = command_line._Progress()
    for text, fraction, error in (("Solving", 0.1, 0.3), ("Solving", 0.3, 0.1), ("Solving", 0.2, 0.2), ("Else", 0, 0)):
        progress(stage(text, fraction, error))
    told = [line.split(",")[0].split()[-2:] for line in capsys.readouterr().err.splitlines()]
    assert told == [["10", "%"], ["30", "%"], ["30", "%"], ["0", "%"]]
