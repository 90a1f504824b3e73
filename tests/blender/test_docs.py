"""docs/pipelines.md tells of every key of a report and of every option of the command line; a report is as
docs/report.schema.json says."""

import json
import re
from pathlib import Path

import bpy
import pytest
import scenes
from report_schema import problems

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "pipelines.md").read_text(encoding="utf-8")


SCHEMA = json.loads((Path(__file__).resolve().parents[2] / "docs" / "report.schema.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("settings", [
    {}, {"heat_map": True, "passes": {"DIRECT", "AO"}, "domain": "CORNER"}, {"quantity": "IRRADIANCE", "exposure": 2.0}
])  # fmt: skip
def test_a_report_is_as_its_schema_says(settings):
    scenes.lit_ball()
    scenes.wire("Wire")
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    bpy.context.collection.objects.link(lamp)
    bpy.ops.pdm.bake(**{"target_error": 0.05, **settings})
    report = json.loads(bpy.context.scene.pdm_radiosity.last_report)
    assert problems(report, SCHEMA, SCHEMA) == []
    assert report["refused"] and report["lights"] and any("finer" in entry for entry in report["objects"])


@pytest.mark.parametrize("change, words", [
    ({"schema": 2}, "report.schema: 2 is not 1"),
    ({"error": "small"}, "report.error: 'small' is no number or null"),
    ({"error": -1.0}, "report.error: -1.0 is below 0"),
    ({"surprise": 1}, "surprise is told nowhere"),
    ({"objects": [{"name": "Ball"}]}, "report.objects[0]: kind is missing"),
])  # fmt: skip
def test_another_report_is_not(change, words):
    scenes.lit_ball()
    bpy.ops.pdm.bake(target_error=0.05)
    report = {**json.loads(bpy.context.scene.pdm_radiosity.last_report), **change}
    assert words in " / ".join(problems(report, SCHEMA, SCHEMA))


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
