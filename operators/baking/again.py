"""The last solution, kept while the settings of its bake stand in the Redo panel: another exposure, quantity, domain or
type is only evaluated again."""

import bpy
import numpy as np

from ...pdm_core.rays.solution import same_light

OF_SOLVING = ("target_error", "time_limit", "make_single_user", "apply_modifiers")
OF_LIGHT = ("areas", "reflectance", "emission", "background")


class _Last:
    """solution: what was solved, or None; settings: the BakeSettings it was solved for; is_offered: whether the Redo
    panel has been that bake's."""

    solution, settings, is_offered = None, None, False

    def keep(self, settings, solution):
        self.settings, self.solution, self.is_offered = settings, solution, False

    def drop(self):
        self.keep(None, None)

    def recall(self, settings, scene):
        """The solution of this Scene, if it is at hand."""
        if self.solution is None or any(getattr(settings, n) != getattr(self.settings, n) for n in OF_SOLVING):
            return None
        return self.solution if _is_same(scene, self.solution.scene) else None


last = _Last()


def _is_same(a, b):
    """Whether two Scenes, read from one state of the file, are of the same light."""
    if len(a) != len(b) or len(a.lights) != len(b.lights):
        return False
    if not all(np.array_equal(getattr(a, name), getattr(b, name)) for name in OF_LIGHT):
        return False
    if not all(_is_like(vars(one.shape), vars(other.shape)) for one, other in zip(a.surfaces, b.surfaces)):
        return False
    lamps = zip(a.lights, b.lights)
    return all(same_light(one, other) and np.array_equal(one.colour, other.colour) for one, other in lamps)


def _is_like(a, b):
    """Whether what two shapes were made of is the same; what they have found out since follows from it."""
    if isinstance(a, dict) and isinstance(b, dict):
        return all(_is_like(a[name], b[name]) for name in a.keys() & b.keys())
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(_is_like, a, b))
    return not isinstance(a, np.ndarray | float | int) or np.array_equal(a, b)


def changed(scene, depsgraph):
    """Frees it once another operator has taken the Redo panel, which a bake gets only after its last change."""
    done = bpy.context.window_manager.operators
    if last.solution is not None and done:
        if done[-1].bl_idname == "PDM_OT_bake":
            last.is_offered = True
        elif last.is_offered:
            last.drop()


def forget():
    last.drop()
