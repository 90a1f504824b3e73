"""docs/pipelines.md tells of every key of a report and of every option of the command line."""

import re
from pathlib import Path

import bpy
import scenes

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "pipelines.md").read_text(encoding="utf-8")


def test_every_key_of_a_report_is_told():
    scenes.lit_ball()
    bpy.ops.pdm.bake(target_error=0.05)
    report = bpy.context.scene.pdm_radiosity.report()
    keys = {*report, *report["settings"], *report["seconds"], *report["versions"], *report["shining"]}
    for entry in report["objects"]:
        keys |= set(entry)
    assert {key for key in keys if f"`{key}`" not in TEXT} == set()


def test_every_option_of_a_bake_is_told_and_no_other(addon, capsys):
    assert addon("operators.command_line").main(["bake", "--help"]) == 0
    options = set(re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out)) - {"--help", "--command"}
    table = TEXT[TEXT.index("| option") : TEXT.index("One of `--output`")]
    assert set(re.findall(r"--[a-z][a-z-]*", table)) == options
