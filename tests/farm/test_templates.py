"""What docs/farm hands to farms: the Open Job Description template, run by the standard's own command line, and the
Flamenco job type, run in a JavaScript engine against what Flamenco's Manager gives it.

tests/run.py sets PDM_ZIP, BLENDER_USER_RESOURCES, and PDM_PYTHON, a Python with Blender's wheel.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from py_mini_racer import MiniRacer

FARM = Path(__file__).resolve().parents[2] / "docs" / "farm"
TEMPLATE, JOB_TYPE = FARM / "pdm-bake.openjd.yaml", FARM / "pdm-bake.flamenco.js"
NAMES = "one", "and two"
MODULE = "bl_ext.user_default.pdm_radiosity"
PREPARE = f"""
import os, sys, bpy
bpy.ops.extensions.package_install_files(
    filepath=os.environ["PDM_ZIP"], repo="user_default", enable_on_install=True)
bpy.ops.wm.read_homefile(use_empty=True)
sys.path.insert(0, {str(FARM.parents[1] / "tests" / "blender")!r})
import scenes
scenes.lit_ball()
for path in sys.argv[1:]:
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
bpy.ops.preferences.addon_disable(module={MODULE!r})
"""
# a Blender that is a wheel has no --command
START = f"""
import importlib, sys, bpy
assert sys.argv[1:4] == ["-b", "--command", "pdm"], sys.argv
bpy.ops.preferences.addon_enable(module={MODULE!r})
code = importlib.import_module({MODULE + ".operators.command_line"!r}).main(sys.argv[4:])
bpy.ops.preferences.addon_disable(module={MODULE!r})
sys.exit(code)
"""
# https://flamenco.blender.org/usage/job-types/
MANAGER = """
const author = {
    Task: (name, type) => ({
        name, type, commands: [], after: [],
        addCommand(command) { this.commands.push(command); },
        addDependency(task) { this.after.push(task.name); },
    }),
    Command: (name, parameters) => ({ name, parameters }),
};
function compiled(settings) {
    const job = { settings, tasks: [], addTask(task) { this.tasks.push(task); } };
    compileJob(job);
    return JSON.stringify(job.tasks);
}
"""


@pytest.fixture(scope="module")
def blender(tmp_path_factory):
    """The path of a program that takes a Blender's words."""
    folder = tmp_path_factory.mktemp("blender")
    (folder / "start.py").write_text(START)
    program = folder / "blender"
    program.write_text(f'#!/bin/sh\nexec "{os.environ["PDM_PYTHON"]}" "{folder / "start.py"}" "$@"\n')
    program.chmod(0o755)
    return str(program)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    paths = [str(folder / f"{name}.blend") for name in NAMES]
    subprocess.run([os.environ["PDM_PYTHON"], "-c", PREPARE, *paths], check=True)
    return paths


@pytest.fixture(scope="module")
def baked(blender, files, tmp_path_factory):
    """What the template says as it runs, and the folder that it bakes into."""
    folder = tmp_path_factory.mktemp("baked")
    (folder / "files.txt").write_text("".join(f"{path}\n" for path in files))
    values = {"List": folder / "files.txt", "Count": len(files), "Folder": folder / "out", "TargetError": 0.05}
    words = [f"--job-param={name}={value}" for name, value in {**values, "Blender": blender}.items()]
    run = openjd("run", TEMPLATE, *words)
    assert run.returncode == 0, run.stdout + run.stderr
    return folder / "out"


def openjd(*words):
    program = shutil.which("openjd", path=str(Path(sys.executable).parent))
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True)


def tasks(**settings):
    """What the job type makes of a job's settings."""
    engine = MiniRacer()
    engine.eval(MANAGER + JOB_TYPE.read_text())
    given = json.loads(engine.eval("JSON.stringify(JOB_TYPE)"))["settings"]
    whole = {setting["key"]: setting.get("default") for setting in given} | settings
    return json.loads(engine.eval(f"compiled({json.dumps(whole)})"))


def test_the_template_is_as_the_standard_has_it():
    check = openjd("check", TEMPLATE)
    assert check.returncode == 0, check.stdout + check.stderr


def test_the_template_bakes_each_file_once(baked):
    """Its last task finds all of them done."""
    assert {path.name for path in baked.glob("*.blend")} == {f"{name}.blend" for name in NAMES}
    for name in NAMES:
        assert json.loads((baked / f"{name}.json").read_text())["error"] <= 0.05
    summary = json.loads((baked / "summary.json").read_text())
    assert (summary["skipped"], summary["done"], summary["failed"]) == (len(NAMES), 0, 0)


def test_the_job_type_has_the_settings_that_a_manager_takes():
    engine = MiniRacer()
    engine.eval(MANAGER + JOB_TYPE.read_text())
    made = json.loads(engine.eval("JSON.stringify(JOB_TYPE)"))
    assert made["label"] and {s["type"] for s in made["settings"]} <= {"string", "int32", "float", "bool"}
    known = "key type subtype required propargs description default eval visible editable choices autoeval".split()
    assert all(set(setting) <= set(known) for setting in made["settings"])


def test_the_job_type_makes_a_task_of_each_file_and_one_of_all(blender, files, baked):
    made = tasks(files="; ".join(files), folder=str(baked), target_error=0.05)
    assert [task["name"] for task in made] == [f"{name}.blend" for name in NAMES] + ["summary"]
    assert made[-1]["after"] == [f"{name}.blend" for name in NAMES] and not made[0]["after"]
    (command,) = made[0]["commands"]
    assert command["name"] == "exec" and command["parameters"]["exe"] == "{blender}" and made[0]["type"] == "blender"
    assert command["parameters"]["args"][4:6] == ["--files", files[0]] and "--subdivide" not in str(made)
    assert "--subdivide" in str(tasks(files=files[0], folder=str(baked), subdivide=True))
    before = {path: path.stat().st_mtime_ns for path in baked.glob("*.blend")}
    for task in made:  # all of it is done
        subprocess.run([blender, *task["commands"][0]["parameters"]["args"]], check=True)
    assert before == {path: path.stat().st_mtime_ns for path in baked.glob("*.blend")}
    assert json.loads((baked / "summary.json").read_text())["skipped"] == len(NAMES)


def test_the_job_type_wants_a_file():
    with pytest.raises(Exception, match="at least one"):
        tasks(files=" ; ", folder="/out")
