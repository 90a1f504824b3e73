"""Subdivide for the Bake, adaptively: solves the light again and gives meshes vertices where it bends."""

import time

import numpy as np

from ..pdm_core import solve_steps
from ..pdm_core.signs_of_life import mapped
from .baking.adaptive_mesh import Places, cut, triangulated
from .baking.bake import BakeSettings, Stage, find_targets
from .baking.bends import LEAST_SAMPLES, SAMPLES, Bent, bend_steps
from .baking.colour_attribute import BakeError
from .baking.error_map import names_written
from .baking.field_at import Field
from .baking.round_places import round_places
from .reading.read_scene import read_steps
from .subdivide_meshes import all_or_none, coarse_entries, problem_of

SPARE = 1.1  # times the error is taken for larger: few points are looked at


def adaptive_steps(context, report, budget, among=None, copies=False, enough=lambda: False):
    """Generator of Stages: refines the meshes that the last report calls too coarse -> (objects, vertices added, why
    the error stays above the target, or ''). Nothing changes before the very end.

    among: names of the only objects to change, or None; enough(): True ends solving, and then the halving. Each of them
    has the time limit of the report's bake.
    """
    settings = BakeSettings(**report["settings"])
    entries = coarse_entries(context.scene, report, among)
    if not entries:
        return 0, 0, ""
    yield Stage("Reading the scene", 0.0, np.inf)
    written = set(names_written(settings.attribute))
    steps = read_steps(context, "ALL", written, settings.make_single_user, settings.apply_modifiers)
    reading = yield from mapped(steps, lambda done: Stage("Reading the scene", done, np.inf))
    targets = [target for target in find_targets(reading) if target.name in entries and not target.is_applied]
    steps = solve_steps(reading.scene, settings.target_error, settings.time_limit or None, enough)
    solution = yield from mapped(steps, lambda progress: Stage("Solving", progress.fraction, progress.error))
    if not targets or not solution.norm > 0:
        return 0, 0, ""
    rest = report["between_vertices"] ** 2 - sum(entries[target.name]["between"] ** 2 for target in targets)
    wanted = (settings.target_error / SPARE) ** 2
    allowed = np.sqrt(max(wanted - max(rest, 0.0), wanted / 4)) * solution.norm
    meshes = _bent(targets)
    budget -= sum(entry["vertices"] for entry in report["objects"] if entry["baked"])
    budget += sum(mesh.parts.size for mesh in meshes)
    begun, limit = time.perf_counter(), settings.time_limit or np.inf
    is_over = lambda: time.perf_counter() - begun > limit or enough()  # noqa: E731
    steps = bend_steps(Field(solution, settings.quantity), meshes, allowed, budget, is_over)
    _, short = yield from mapped(steps, lambda done: Stage("Evaluating where the light bends", done, solution.error))
    chosen = {t.object: mesh for t, mesh in zip(targets, meshes, strict=True) if mesh.parts.cuts}
    added = all_or_none(chosen, lambda obj, mesh: cut(obj.data, mesh.places, mesh.parts.cuts), copies)
    return len(chosen), added, short


def _bent(targets):
    """[Bent] of the meshes of ReadObjects as they are now."""
    for target in targets:
        if problem := problem_of(target.object):
            raise BakeError(f"Object {target.name!r} {problem}")
    rng = np.random.default_rng(2)
    samples = max(SAMPLES // len(targets), LEAST_SAMPLES)
    return [
        Bent.make(
            t, triangulated(t.object.data), Places(t.base.vertices.astype(float), round_places(t.base)), samples, rng
        )
        for t in targets
    ]
