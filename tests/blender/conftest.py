"""Installs the zip named by PDM_ZIP into a fresh configuration, as a user would, and disables it at the end.

tests/run.py sets PDM_ZIP and BLENDER_USER_RESOURCES before Blender starts.
"""

import importlib
import os
import sys

import bpy
import pytest

MODULE = "bl_ext.user_default.pdm_radiosity"


def install():
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["PDM_ZIP"], repo="user_default", enable_on_install=True
    )


def pytest_sessionstart(session):
    if not (os.environ.get("PDM_ZIP") and os.environ.get("BLENDER_USER_RESOURCES")):
        pytest.exit("tests/blender needs PDM_ZIP and BLENDER_USER_RESOURCES: run `make test`", 2)
    install()


def pytest_sessionfinish(session, exitstatus):
    # what is still registered at exit crashes 4.2 and 4.5
    bpy.ops.preferences.addon_disable(module=MODULE)
    session.config.ended_with = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """Ends at once, when all is told: the wheels' own way out crashes now and then, as they free what Python still
    holds."""
    sys.stdout.flush()
    sys.stderr.flush()
    if hasattr(config, "ended_with"):
        os._exit(config.ended_with)


def pytest_collection_modifyitems(items):
    # uninstalling replaces the modules that the other tests have imported
    items.sort(key=lambda item: item.path.name == "test_install.py")


@pytest.fixture
def addon():
    """import_module of a path inside the installed extension: addon("operators.baking.bake")."""
    return lambda name="": importlib.import_module(f"{MODULE}.{name}" if name else MODULE)


@pytest.fixture
def read(addon):
    """read(objects="ALL"): the Reading of the scene."""
    module = addon("operators.reading.read_scene")
    return lambda objects="ALL": module.read_scene(bpy.context, objects)


@pytest.fixture(autouse=True)
def empty_scene():
    """Every test starts from an empty file."""
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
    bpy.context.preferences.edit.use_global_undo = True


@pytest.fixture(autouse=True)
def all_is_translated(addon):
    """Whatever a test made the reports and lists say has its entries in Portuguese."""
    yield
    settings = [scene.pdm_radiosity for scene in bpy.data.scenes if hasattr(scene, "pdm_radiosity")]
    for said in filter(None, (told for each in settings for told in (each.report(), each.scan()))):
        texts = [*said["warnings"], *said.get("plan", ()), *said.get("foreseen", ())]
        texts += [each["reason"] for each in said["refused"] + said["objects"]]
        texts += [each["label"] for each in said["objects"]]
        for row in said.get("left_out", ()):
            texts += [row["what"], row["effect"], row["advice"]]
        unknown = addon("operators.told").unknown
        assert {text: missing for text in texts if text and (missing := unknown(text))} == {}
