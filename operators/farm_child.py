"""Run by the bpy wheel, which has no --command: opens a file and calls `pdm` on it.

python farm_child.py FILE.blend PACKAGE OPTION ...
"""

import importlib
import sys

import bpy


def main(source, package, *words):
    bpy.ops.preferences.addon_enable(module=package)
    try:
        bpy.ops.wm.open_mainfile(filepath=source)
        return importlib.import_module(f"{package}.operators.command_line").main(list(words))
    finally:
        bpy.ops.preferences.addon_disable(module=package)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
