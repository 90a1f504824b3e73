"""Enabling, disabling, uninstalling and installing again leave nothing behind. Runs last, see conftest.py."""

import importlib
import sys
from pathlib import Path

import bpy
from conftest import MODULE, install

PACKAGE = "pdm_radiosity"


def traces():
    """Everything of ours that Blender can list: classes, properties, operators, handlers."""
    found = {f"type {name}" for name in dir(bpy.types) if name.startswith("PDM_")}
    found |= {f"class {cls.__name__}" for cls in registered(bpy.types.bpy_struct) if cls.__module__.startswith(MODULE)}
    for owner in (bpy.types.Scene, bpy.types.Object, bpy.types.WindowManager):
        found |= {f"property {owner.__name__}.{name}" for name in dir(owner) if name.startswith("pdm")}
    found |= {f"operator {name}" for name in dir(bpy.ops.pdm)}
    for name in dir(bpy.app.handlers):
        functions = getattr(bpy.app.handlers, name)
        if isinstance(functions, list):
            found |= {f"handler {name}" for f in functions if getattr(f, "__module__", "").startswith(MODULE)}
    return found


def registered(base):
    found = set()
    for cls in base.__subclasses__():
        if cls.__dict__.get("is_registered", getattr(cls, "is_registered", False)):
            found.add(cls)
        found |= registered(cls)
    return found


def commands():
    """Blender cannot list its commands; ours are kept where they are registered."""
    return importlib.import_module(f"{MODULE}.operators.command_line")._commands


def test_enabled_everything_is_there():
    found = traces()
    assert {"operator bake", "operator scan", "property Scene.pdm_radiosity", "type PDM_PT_bake"} <= found
    assert "class PDM_OT_bake" in found
    assert len(commands()) == 1


def test_disabling_leaves_nothing_and_enabling_again_works(capfd):
    before = traces()
    for _ in range(2):
        bpy.ops.preferences.addon_disable(module=MODULE)
        assert traces() == set()
        assert commands() == []
        bpy.ops.preferences.addon_enable(module=MODULE)
        assert traces() == before
        assert len(commands()) == 1
    assert "duplicate" not in capfd.readouterr().out  # Blender's word for a command that was left registered


def test_disabling_during_a_session_with_settings_keeps_the_file_usable():
    bpy.context.scene.pdm_radiosity.target_error = 0.05
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.context.scene, "pdm_radiosity")
    bpy.ops.preferences.addon_enable(module=MODULE)
    assert abs(bpy.context.scene.pdm_radiosity.target_error - 0.05) < 1e-8


def test_uninstalling_removes_files_and_modules_and_installing_again_works():
    before = traces()
    repos = bpy.context.preferences.extensions.repos
    index = [repo.module for repo in repos].index("user_default")
    folder = Path(repos[index].directory) / PACKAGE
    assert (folder / "blender_manifest.toml").is_file()
    bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id=PACKAGE)
    assert traces() == set()
    assert not folder.exists()
    assert MODULE not in bpy.context.preferences.addons
    install()
    assert traces() == before
    assert sys.modules[MODULE].__file__.startswith(str(folder))
