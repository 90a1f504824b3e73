"""A world rendered into a map of all directions by a second Blender in the background: our file is never touched."""

import os
import tempfile
from pathlib import Path

import bpy
import numpy as np

from ...pdm_core import SunLight
from .node_state import state_of
from .second_blender import last_words, run_steps

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
        log = os.path.join(folder, "log.txt")
        yield from run_steps(SCRIPT, [folder, world.name], log, MOST_SECONDS)
        if not os.path.exists(made):
            raise RenderError(last_words(log, "a second Blender did not start"))
        with np.load(made) as data:
            return data["radiance"].astype(float), data["irradiance"], data["towards"], float(data["angle"])
