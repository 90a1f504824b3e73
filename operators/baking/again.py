"""The last solution, kept while the settings of its bake stand in the Redo panel: another exposure, quantity, domain or
type is only evaluated again. So are the new vertices of meshes that were subdivided since."""

from contextlib import contextmanager

import bpy
import numpy as np

from ...pdm_core import Mesh
from ...pdm_core.rays.solution import same_light

OF_SOLVING = ("target_error", "time_limit", "make_single_user", "apply_modifiers")
TAKERS = "PDM_OT_bake", "PDM_OT_subdivide"  # the bake that follows a subdivision reads it off at the new vertices
CUT_OFF = 1e-4  # of its size: what a shape may be off by once its faces are cut, of float32 coordinates


class _Last:
    """solution: what was solved, or None; scene: the Scene as it was last read; settings: the BakeSettings of it;
    is_offered: whether the Redo panel has been that bake's; is_cut: whether meshes were subdivided since; is_given:
    whether the next bake follows at once, with nothing but that between."""

    solution, scene, settings, is_offered, is_cut, is_given = None, None, None, False, False, False

    def keep(self, settings, solution, scene):
        self.settings, self.solution, self.scene = settings, solution, scene
        self.is_offered = self.is_cut = False

    def drop(self):
        self.keep(None, None, None)

    @contextmanager
    def given(self):
        """What bakes within takes it."""
        self.is_given = True
        try:
            yield
        finally:
            self.is_given = False

    def recall(self, settings, scene):
        """The solution of this Scene, if it is at hand."""
        if self.solution is None or any(getattr(settings, n) != getattr(self.settings, n) for n in OF_SOLVING):
            return None
        if self.is_cut and not self._serves(settings, scene):
            return None
        return self.solution if _is_same(scene, self.scene, self.is_cut) else None

    def _serves(self, settings, scene):
        """Whether finer faces would not make it better: of what is solved on faces they may, where the target is not
        met."""
        return self.solution.error <= settings.target_error or not any(
            isinstance(s.shape, Mesh) for s in scene.surfaces
        )


last = _Last()


def _is_same(a, b, is_cut):
    """Whether two Scenes, read from one state of the file, are of the same light; is_cut: but for how their faces are
    divided, all that has changed meanwhile."""
    if len(a) != len(b) or len(a.lights) != len(b.lights):
        return False
    # of what varies, faces divided otherwise show other places
    even = np.array([not (is_cut and s.varies) for s in a.surfaces], bool)
    parts = [(scene.reflectance[even], scene.emission[even], scene.background) for scene in (a, b)]
    if not all(map(np.array_equal, *parts)):
        return False
    if not all(_is_like(one.shape, other.shape, is_cut) for one, other in zip(a.surfaces, b.surfaces)):
        return False
    lamps = zip(a.lights, b.lights)
    return all(same_light(one, other) and np.array_equal(one.colour, other.colour) for one, other in lamps)


def _is_like(a, b, is_cut):
    """Whether two shapes are of one size and in one place, however their faces are divided, or, where these are not
    cut, the very same, shaded alike."""
    if is_cut:
        return bool((np.abs(a.marks - b.marks) <= CUT_OFF * b.bounds[1]).all())
    shaded = not (a.is_mesh and b.is_mesh) or np.array_equal(a.corner_normals, b.corner_normals)
    return np.array_equal(a.marks, b.marks) and shaded


def changed(scene, depsgraph):
    """Frees it once another operator has taken the Redo panel, which these get only after their last change."""
    done = bpy.context.window_manager.operators
    if last.solution is not None and done:
        if done[-1].bl_idname in TAKERS:
            last.is_offered = True
        elif last.is_offered:
            last.drop()


def forget():
    last.drop()
