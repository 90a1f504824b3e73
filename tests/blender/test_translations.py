"""Portuguese: every string of the interface has an entry, and Blender shows it."""

import ast
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [*(ROOT / "ui").glob("*.py"), *(ROOT / "operators").glob("*.py")]
SOURCES += [ROOT / "operators" / "baking" / name for name in ("bake.py", "report.py")]
# functions, and how many first words are said
SAID_BY = {"stage": 1, "say": 1, "many": 3, "poll_message_set": 1, "Stage": 1}
NEVER_SHOWN = {
    "last_report",
    "last_scan",
    "last_convergence",
    "custom_target",
    "listed",
    "listed_index",
    "rna_type",
    "filter_glob",
    "keep",
}


def literals(path):
    """Strings that a module's code shows: what is said, what stands as text=, labels of the parts of the panel."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    named = {
        target.id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            asked = node.args[: SAID_BY.get(name, 0)] + [k.value for k in node.keywords if k.arg == "text"]
            for value in asked:
                text = named.get(value.id) if isinstance(value, ast.Name) else getattr(value, "value", None)
                if isinstance(text, str) and text:
                    yield text


def of_properties(rna):
    for prop in rna.properties:
        if prop.identifier in NEVER_SHOWN or not prop.is_runtime:
            continue
        yield from (prop.name, prop.description)
        for item in getattr(prop, "enum_items_static", None) or ():
            yield from (item.name, item.description)


@pytest.fixture
def shown(addon):
    """Every string of the interface."""
    operators, ui = addon("operators"), addon("ui")
    found = set(of_properties(addon("operators.settings").PDM_PG_scene.bl_rna))
    for cls in (*operators.CLASSES, *ui.CLASSES):
        if issubclass(cls, bpy.types.Operator):
            rna = getattr(bpy.ops.pdm, cls.bl_idname.split(".")[1]).get_rna_type()
            found |= {rna.name, rna.description, *of_properties(rna)}
    found |= {addon("ui.panels").PDM_PT_bake.bl_label, *(label for _, label, _ in addon("ui.panels").PARTS)}
    found |= set(addon("operators.listed").LABELS.values()) | {addon("operators.live_watch").MOVED, "Bake to begin"}
    for path in SOURCES:
        found |= set(literals(path))
    return {text for text in found if text}


def test_every_string_has_an_entry_with_the_same_values(shown, addon):
    words = addon("operators.portuguese").WORDS
    assert len(shown) > 130
    assert {text for text in shown if text not in words} == set()
    assert [text for text, word in words.items() if text.count("{}") != word.count("{}") or not word] == []
    assert {text for text in words if text not in shown} <= {
        "object", "objects", "light", "lights", "Read", "Solve", "Evaluate", "Check", "Write", "Total", "Objects baked",
        "Vertices", "Error", "Between vertices", "Seconds", "For tighter targets", "Warnings", "Notes", "Left out",
        "Plan", "Own errors", "Time", "Said", "Estimating errors",
        "object refused", "objects refused", "thing left out or approximated", "things left out or approximated",
        "warning", "warnings",
        "Stop solving and bake what there is, with its error",
    }  # fmt: skip


def test_blender_shows_it_only_to_who_reads_portuguese(addon):
    view, say = bpy.context.preferences.view, addon("operators.words").say
    before = view.language
    assert say("{} refused", 3) == "3 refused"
    try:
        for language in {"pt_PT", "pt_BR"} & set(bpy.app.translations.locales):  # a wheel comes without languages
            view.language = language
            view.use_translate_interface = view.use_translate_tooltips = True
            assert say("{} refused", 3) == "3 de fora"
            assert bpy.app.translations.pgettext_iface("Bake Radiosity", "Operator") == "Calcular radiosidade"
            view.language = "en_US"
            assert say("{} refused", 3) == "3 refused"
    finally:
        view.language = before


def test_a_tooltip_is_one_text():
    for name in dir(bpy.ops.pdm):
        description = getattr(bpy.ops.pdm, name).get_rna_type().description
        assert description and "\n" not in description and "  " not in description
