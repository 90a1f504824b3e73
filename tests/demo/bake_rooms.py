"""`make demo`: bakes the rooms and the studio through the installed zip into build/demo/ and prints what came out."""

import importlib
import json
import os
import sys
from functools import partial
from pathlib import Path

import bpy
import rooms
import studio

MODULE = "bl_ext.user_default.pdm_radiosity"
FOLDER = Path(__file__).resolve().parents[2] / "build" / "demo"
SCENES = {name: partial(rooms.build, name) for name in rooms.ROOMS} | {"studio": studio.build}
TARGETS = {"studio": 0.02}  # where not the default


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    bpy.context.preferences.filepaths.save_version = 0  # no backups beside the results
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["PDM_ZIP"], repo="user_default", enable_on_install=True
    )
    try:
        reports = {name: bake(name) for name in sys.argv[1:] or SCENES}
    finally:
        bpy.ops.preferences.addon_disable(module=MODULE)
    print_table(reports)
    return 0 if all(reports.values()) else 1


def bake(name):
    """The report of the scene, or None where the bake failed; writes NAME.blend, .png and .json."""
    blend, image, report = (FOLDER / f"{name}.{ending}" for ending in ("blend", "png", "json"))
    SCENES[name]()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    command_line = importlib.import_module(f"{MODULE}.operators.command_line")
    words = ["bake", "--output", str(blend), "--image", str(image), "--report", str(report)]
    words += [f"--target-error={TARGETS[name]}"] if name in TARGETS else []
    return json.loads(report.read_text()) if command_line.main(words) == command_line.DONE else None


def print_table(reports):
    print(
        f"\n{'scene':10}{'objects':>9}{'vertices':>10}{'est. error':>12}{'solve s':>9}{'evaluate s':>12}{'total s':>9}"
    )
    for name, report in reports.items():
        if report is None:
            print(f"{name:10} failed")
            continue
        seconds = report["seconds"]
        print(
            f"{name:10}{len(report['objects']):9}{report['vertices']:10,}{report['error']:11.2%} "
            f"{seconds['solve']:9.2f}{seconds['evaluate']:12.2f}{seconds['total']:9.2f}"
        )
    print(f"Files: {FOLDER.relative_to(FOLDER.parents[1])}/NAME.blend, .png, .json")


if __name__ == "__main__":
    sys.exit(main())
