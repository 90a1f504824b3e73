"""A world rendered into a map of all directions by a second Blender in the background: our file is never touched."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

from ...pdm_core import SunLight
from ...pdm_core.signs_of_life import TICK
from .node_state import state_of

MOST_SECONDS = 120.0  # it takes 2 to 4
_last = {}  # {state of a world: what was rendered of it}, one at most: it takes seconds
SCRIPT = Path(__file__).with_name("world_script.py")


class RenderError(Exception):
    """The second Blender gave no map; the message goes on after what was to be rendered."""


def rendered_world(world):
    """Generator that yields None while it waits; returns radiance (h, w, 3), row 0 looking down, of all but the discs
    of its sky textures' suns, and these as [SunLight]. RenderError where it fails. The last one is remembered."""
    state = (world.name, state_of(world.node_tree))
    if state not in _last:
        made = yield from _rendered(world)
        _last.clear()
        _last[state] = made
    radiance, irradiance, towards, angle = _last[state]
    if not (irradiance > 0).any():
        return radiance, []
    return radiance, [SunLight(-towards, irradiance, angle, name=f"Sun of world {world.name}")]


def _rendered(world):
    """Generator that yields None while it waits; returns what world_script.py writes."""
    with tempfile.TemporaryDirectory() as folder:
        path, made = os.path.join(folder, "world.blend"), os.path.join(folder, "map.npz")
        bpy.data.libraries.write(path, {world}, path_remap="ABSOLUTE", fake_user=True)
        with open(os.path.join(folder, "log.txt"), "w", encoding="utf-8") as log:
            words = _command([folder, world.name])
            process = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT)
        try:
            end = time.perf_counter() + MOST_SECONDS
            while process.poll() is None and time.perf_counter() < end:
                time.sleep(TICK)
                yield
        finally:
            if process.poll() is None:
                process.kill()
            process.wait()
        if not os.path.exists(made):
            last = Path(folder, "log.txt").read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise RenderError(last[-1] if last else "a second Blender did not start")
        with np.load(made) as data:
            return data["radiance"].astype(float), data["irradiance"], data["towards"], float(data["angle"])


def _command(words):
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "-b", "--factory-startup", "--python", str(SCRIPT), "--", *words]
    return [sys.executable, str(SCRIPT), "--", *words]
