"""What Blender tells the add-on: that something has changed, that another file is open, that this one is to be saved.
Whatever keeps something of the scene has changed(scene, depsgraph) and forget(), and is listed here."""

import bpy
from bpy.app.handlers import persistent

from . import live_watch, look
from .baking import again, so_far
from .reading import undisturbed

KEEPERS = again, look, live_watch, undisturbed


@persistent
def _changed(scene, depsgraph):
    for keeper in KEEPERS:
        keeper.changed(scene, depsgraph)


@persistent
def _loaded(*_):
    for keeper in KEEPERS:
        keeper.forget()


@persistent
def _saving(*_):
    so_far.saving()


def register():
    bpy.app.handlers.depsgraph_update_post.append(_changed)
    bpy.app.handlers.load_post.append(_loaded)
    bpy.app.handlers.save_pre.append(_saving)


def unregister():
    bpy.app.handlers.depsgraph_update_post.remove(_changed)
    bpy.app.handlers.load_post.remove(_loaded)
    bpy.app.handlers.save_pre.remove(_saving)
    _loaded()
