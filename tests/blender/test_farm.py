"""`pdm bake --files`: many files on one machine; killed and run again nothing is lost and nothing done twice."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import pytest
import scenes

START = """
import sys, importlib, bpy
bpy.ops.preferences.addon_enable(module=sys.argv[1])
code = importlib.import_module(sys.argv[1] + ".operators.command_line").main(sys.argv[2:])
bpy.ops.preferences.addon_disable(module=sys.argv[1])
sys.exit(code)
"""


@pytest.fixture
def files(tmp_path):
    """Five small scenes and one in which nothing shines."""
    bpy.context.preferences.filepaths.save_version = 0
    scenes.lit_ball()
    paths = []
    for k in range(5):
        bpy.data.objects["Ball"].location.z = 1.2 + 0.1 * k
        paths.append(tmp_path / f"scene {k}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=str(paths[-1]), copy=True)
    bpy.data.objects["Lamp"].data.materials.clear()
    paths.append(tmp_path / "dark.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(paths[-1]), copy=True)
    return paths


@pytest.fixture
def farm(addon, tmp_path):
    """Starts `pdm bake --files` in a Blender of its own; (process, output folder)."""

    def start(files, *more):
        folder = tmp_path / "out"
        words = ["bake", "--files", *map(str, files), "--folder", str(folder), "--target-error", "0.05", *more]
        package = addon().__name__
        return subprocess.Popen(
            [sys.executable, "-c", START, package, *words], stderr=subprocess.PIPE, text=True
        ), folder

    return start


def finish(process):
    _, said = process.communicate()
    return process.returncode, said


def states(folder):
    summary = json.loads((folder / "summary.json").read_text())
    return {Path(row["file"]).stem: row["state"] for row in summary["files"]}, summary


def test_all_files_are_baked_once_and_failures_are_said(farm, files):
    code, said = finish(farm(files, "--processes", "2")[0])
    folder = files[0].parent / "out"
    found, summary = states(folder)
    assert code == 1 and found == {**{f"scene {k}": "done" for k in range(5)}, "dark": "failed"}, said
    assert (summary["done"], summary["failed"]) == (5, 1)
    assert "Nothing shines" in next(row["message"] for row in summary["files"] if row["state"] == "failed")
    for k in range(5):
        report = json.loads((folder / f"scene {k}.json").read_text())
        assert report["error"] <= 0.05 and report["settings"]["target_error"] == 0.05
    assert {p.suffix for p in folder.iterdir()} == {".blend", ".json", ".log"} and not list(folder.glob("*.part*"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "scene 3.blend"))
    assert "Radiosity" in bpy.data.objects["Floor"].data.color_attributes

    before = {path: path.stat().st_mtime_ns for path in folder.glob("scene*")}
    files[2].write_bytes(files[3].read_bytes())  # one has changed
    code, said = finish(farm(files[:5])[0])
    assert code == 0 and states(folder)[0] == {f"scene {k}": "done" if k == 2 else "skipped" for k in range(5)}, said
    changed = {path.stem for path, at in before.items() if path.stat().st_mtime_ns != at}
    assert changed == {"scene 2"}


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_killed_midway_the_next_run_does_the_rest(farm, files):
    process, folder = farm(files[:5], "--processes", "1")
    while not list(folder.glob("scene ?.json")) and process.poll() is None:
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGTERM)
    code, said = finish(process)
    assert code == 130, said
    first = {path.stem: path.stat().st_mtime_ns for path in folder.glob("scene ?.json")}
    assert 1 <= len(first) < 5 and not list(folder.glob("*.part*"))
    assert list(states(folder)[0].values()).count("stopped") == 5 - len(first)
    for part in ("scene 4.part.blend", "scene 4.part.json"):  # as a machine that lost power leaves them
        (folder / part).write_text("half")
    code, said = finish(farm(files[:5])[0])
    assert code == 0, said
    assert states(folder)[0] == {f"scene {k}": "skipped" if f"scene {k}" in first else "done" for k in range(5)}
    assert all((folder / f"{name}.json").stat().st_mtime_ns == at for name, at in first.items())
    assert not list(folder.glob("*.part*"))


@pytest.mark.parametrize(
    "words, said",
    [
        (["--files", "a.blend"], "--folder"),
        (["--files", "a.blend", "--folder", "o", "--report", "r.json"], "must not"),
        (["--files", "a.blend", "b/A.blend", "--folder", "o"], "one name"),
        (["--folder", "o", "--report", "r.json"], "goes with --files"),
        (["--files", "a.txt", "--folder", "o"], "must end in"),
    ],
)
def test_usage(addon, words, said, capfd):
    assert addon("operators.command_line").main(["bake", *words]) == 2
    assert said in capfd.readouterr().err


def test_a_missing_file_and_one_that_would_be_replaced(addon, tmp_path, capfd):
    scenes.lit_ball()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"), copy=True)
    words = ["bake", "--files", str(tmp_path / "a.blend"), str(tmp_path / "b.blend"), "--folder", str(tmp_path)]
    assert addon("operators.command_line").main(words) == 1
    found, summary = states(tmp_path)
    assert found == {"a": "failed", "b": "failed"}
    assert [row["message"].split(";")[0] for row in summary["files"]] == [
        "its result would replace it", "there is no such file"
    ]  # fmt: skip
