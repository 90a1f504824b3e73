"""Started by Blender in a window: installs the zip, opens the sidebar, and runs the steps of script.py."""

import importlib
import sys
import traceback

import bpy

sys.path.insert(0, __file__.rpartition("/")[0])
from hands import FOLDER, area  # noqa: E402


def run():
    bpy.ops.extensions.package_install_files(
        filepath=str(FOLDER / "extension.zip"), repo="user_default", enable_on_install=True
    )
    if not any(name.startswith("bl_ext.") for name in bpy.context.preferences.addons.keys()):
        raise RuntimeError("the extension was installed but is not enabled")
    yield 0.5
    area().spaces.active.show_region_ui = True
    yield 0.7
    yield from importlib.import_module("script").steps()
    yield 1.0


def end(status):
    (FOLDER / "status.new").write_text(status)
    (FOLDER / "status.new").rename(FOLDER / "status")


ticking = run()


def tick():
    try:
        return next(ticking)
    except StopIteration:
        end("ok")
    except BaseException as error:
        traceback.print_exc()
        end(f"{type(error).__name__}: {error}")
    return None


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=1.5)
