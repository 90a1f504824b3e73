"""Subdivide for the Bake, adaptively: gives meshes vertices where the light bends."""

import time

import numpy as np

from ..pdm_core.signs_of_life import mapped
from .baking.adaptive_mesh import Places, cut, triangulated
from .baking.bake import Stage
from .baking.bends import LEAST_SAMPLES, SAMPLES, Bent, bend_steps
from .baking.field_at import Field
from .baking.round_places import round_places
from .baking.shown import shown_steps
from .light_at_hand import light_steps
from .subdivide_meshes import all_or_none, coarse_entries

SPARE = 1.1  # times the error is taken for larger: few points are looked at


def adaptive_steps(context, report, budget, among=None, copies=False, enough=lambda: False):
    """Generator of Stages: refines the meshes that the last report calls too coarse -> (objects, vertices added, why
    the error stays above the target, or ''). Nothing changes before the very end.

    among: names of the only objects to change, or None; enough(): True ends solving, and then the halving. Each of them
    has the time limit of the report's bake.
    """
    entries = coarse_entries(context.scene, report, among)
    if not entries:
        return 0, 0, ""
    settings, targets, solution = yield from light_steps(context, report, entries, enough)
    if not targets or not solution.norm > 0:
        return 0, 0, ""
    stage = lambda done: Stage("Evaluating where the light bends", done, solution.error)  # noqa: E731
    rest = report["between_vertices"] ** 2 - sum(entries[target.name]["between"] ** 2 for target in targets)
    wanted = (settings.target_error / SPARE) ** 2
    shown = yield from mapped(shown_steps(Field(solution, settings.quantity)), stage)
    allowed = np.sqrt(max(wanted - max(rest, 0.0), wanted / 4)) * shown.norm
    meshes = _bent(targets)
    budget -= sum(entry["vertices"] for entry in report["objects"] if entry["baked"])
    budget += sum(mesh.parts.size for mesh in meshes)
    begun, limit = time.perf_counter(), settings.time_limit or np.inf
    is_over = lambda: time.perf_counter() - begun > limit or enough()  # noqa: E731
    _, short = yield from mapped(bend_steps(shown, meshes, allowed, budget, is_over), stage)
    chosen = {t.object: mesh for t, mesh in zip(targets, meshes, strict=True) if mesh.parts.cuts}
    added = all_or_none(chosen, lambda obj, mesh: cut(obj.data, mesh.places, mesh.parts.cuts), copies)
    return len(chosen), added, short


def _bent(targets):
    """[Bent] of the meshes of ReadObjects as they are now."""
    rng = np.random.default_rng(2)
    samples = max(SAMPLES // len(targets), LEAST_SAMPLES)
    return [
        Bent.make(
            t, triangulated(t.object.data), Places(t.base.vertices.astype(float), round_places(t.base)), samples, rng
        )
        for t in targets
    ]
