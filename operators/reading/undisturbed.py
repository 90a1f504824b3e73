"""Blender's data read in slices, as if at once: what changes the scene between two of them begins the reading anew."""

import bpy

from ...pdm_core.signs_of_life import finish

TRIES = 3  # in slices; where an animation plays or a brush is at work, at once after that


class _Changes:
    """How many changes of any scene Blender has told of."""

    count = 0


def changed(scene, depsgraph):
    _Changes.count += 1


def forget():
    _Changes.count += 1


def undisturbed(make, at_once=False):
    """Generator of the steps of make(), a generator too; returns what that returns, of a scene that did not change
    meanwhile. at_once: without a step."""
    for _ in range(0 if at_once else TRIES):
        begun, steps = _state(), make()
        try:
            while _state() == begun:
                yield next(steps)
        except StopIteration as end:
            return end.value
        finally:
            steps.close()
    return finish(make())


def _state():
    return _Changes.count, bpy.context.scene.frame_current
