"""The light that the last report is of, for what gives meshes vertices: as the bake has left it, or solved again."""

import numpy as np

from ..pdm_core import solve_steps
from ..pdm_core.signs_of_life import mapped
from .baking.again import last
from .baking.bake import BakeSettings, Stage, find_targets
from .baking.colour_attribute import BakeError
from .baking.error_map import names_written
from .reading.read_scene import read_steps
from .subdivide_meshes import problem_of


def light_steps(context, report, names, enough):
    """Generator of Stages; returns (BakeSettings of the report, [ReadObject] of these names, Solution).

    enough(): True ends solving.
    """
    settings = BakeSettings(**report["settings"])
    yield Stage("Reading the scene", 0.0, np.inf)
    written = set(names_written(settings.attribute))
    steps = read_steps(context, "ALL", written, settings.make_single_user, settings.apply_modifiers)
    reading = yield from mapped(steps, lambda done: Stage("Reading the scene", done, np.inf))
    targets = [target for target in find_targets(reading) if target.name in names and not target.is_applied]
    for target in targets:
        if problem := problem_of(target.object):
            raise BakeError(f"Object {target.name!r} {problem}")
    scene = reading.scene
    # the last bake's, where that is of this very Scene; of textures only the means could be compared
    varies = scene.sky is not None or any(surface.varies for surface in scene.surfaces)
    solution = None if varies else last.recall(settings, scene)
    if solution is None:
        steps = solve_steps(scene, settings.target_error, settings.time_limit or None, enough)
        solution = yield from mapped(steps, lambda progress: Stage("Solving", progress.fraction, progress.error))
        last.keep(settings, solution, scene)
    return settings, targets, solution
