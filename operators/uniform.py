"""Subdivide for the Bake, evenly: as many parts of each face as the light asks for, found by looking at it."""

import numpy as np

from ..pdm_core.signs_of_life import mapped
from .baking.bake import Stage
from .baking.bends import LEAST_SAMPLES
from .baking.between_vertices import Look, distinct
from .baking.field_at import Field
from .baking.finer_mesh import finer_size
from .baking.shown import shown_steps
from .light_at_hand import light_steps
from .subdivide_meshes import problem_of, too_coarse

MOST_TIMES = 256  # parts of an edge at once
SPARE = 1.07  # times the error is taken for larger: what so many places looked at leave of chance
SAMPLES = 16_000  # of them; by 4,000 the errors of one N were from .94 to 1.06 % of Cornell's light
LOOKS = 10  # rounds of looking at numbers of parts of each mesh, at most; four or five mostly
BELOW = 1, 2, 3  # of what is enough by all that was looked at: as many parts less are looked at too


def parts_steps(context, report, budget, enough):
    """Generator of Stages; returns ({object name: N above 1}, whether the budget sufficed) for what was baked."""
    entries = [entry for entry in report["objects"] if entry["baked"] and entry["between"]]
    entries = {e["name"]: e for e in entries if problem_of(context.scene.objects.get(e["name"])) is None}
    if not entries or not too_coarse(report):
        return {}, True
    settings, targets, solution = yield from light_steps(context, report, entries, enough)
    if not targets or not solution.norm > 0:
        return {}, True
    meshes = [target.object.data for target in targets]
    curves = [[(1, entries[t.name]["between"]), *map(tuple, entries[t.name].get("finer", ()))] for t in targets]
    faces = np.array([len(mesh.polygons) for mesh in meshes], float)
    wanted = settings.target_error / SPARE
    steps = look_steps(Field(solution, settings.quantity), targets, curves, faces, wanted, enough)
    stage = lambda done: Stage("Evaluating where the light bends", done, solution.error)  # noqa: E731
    times, full = (yield from mapped(steps, stage)), True
    while (total := sum(map(finer_size, meshes, times))) > budget and times.max() > 1:
        full = False
        times = np.maximum(np.minimum(np.floor(times * np.sqrt(budget / total)), times - (times > 1)), 1)
    return {target.name: int(n) for target, n in zip(targets, times, strict=True) if n > 1}, full


def look_steps(field, targets, curves, faces, wanted, is_over):
    """Generator of the fraction done; returns (n,) N of each target, for an error `wanted`, as in needed().

    curves: what the report knows, from a few points; it says where to look first, and what is seen then counts.
    """
    rng = np.random.default_rng(3)
    looks = [Look(target, "CORNER", max(SAMPLES // len(targets), LEAST_SAMPLES), rng) for target in targets]
    light = yield from mapped(field.at_places([look.places() for look in looks], roughly=True), lambda _: 0.0)
    shown = yield from mapped(shown_steps(field), lambda _: 0.0)
    seen, below = [{1: curve[0][1]} for curve in curves], BELOW
    for turn in range(LOOKS):
        known = [sorted(own.items()) if len(own) > 1 else curve for own, curve in zip(seen, curves, strict=True)]
        times = needed(known, faces, wanted)
        new = [(k, int(n)) for k, n in enumerate(times) if n not in seen[k]]
        if not new:  # an edge of a shadow may lie better in a few parts less
            new = [
                (k, int(n) - less)
                for k, n in enumerate(times)
                for less in below
                if n - less not in seen[k] and n > less
            ]
            below = ()
        if not new or is_over():
            break
        steps = distinct(field, [looks[k].finer_places(n) for k, n in new])
        found = yield from mapped(steps, lambda done, turn=turn: (turn + done) / LOOKS)
        for (k, n), values in zip(new, found, strict=True):
            between = looks[k].between_finer(n, values.reshape(-1, 3, 3))
            seen[k][n] = looks[k].norm(between, light[k], shown) / shown.norm
    return times


def needed(curves, faces, target):
    """curves [[(N, error of an object's colours between vertices with N x N for each face)]] from N = 1 on, faces (n,)
    of the meshes -> (n,) whole N, so that the root of the errors' squares is `target`, with few vertices.

    Step by step, the next is that which lowers the squares by most for each face it makes.
    """
    ladders = [_ladder(curve) for curve in curves]
    at = [0] * len(ladders)
    while sum(squares[k] for (_, squares), k in zip(ladders, at)) > target**2:
        steps = [_step(*ladder, k, count) for ladder, k, count in zip(ladders, at, faces)]
        gain, k = max((gain, k) for k, (gain, _) in enumerate(steps))
        if gain <= 0:
            break
        at[k] = steps[k][1]
    for k, (_, squares) in enumerate(ladders):  # the last steps may have gone further than was needed
        rest = sum(own[n] for (_, own), n in zip(ladders, at)) - squares[at[k]]
        at[k] = min(at[k], int(np.searchsorted(-squares, rest - target**2)))
    return np.array([parts[k] for (parts, _), k in zip(ladders, at)], int)


def _step(parts, squares, at, faces):
    """(gain, where to): the step on one ladder that lowers the square of the error by most for each face."""
    if at + 1 == len(parts):
        return 0.0, at
    gain = (squares[at] - squares[at + 1 :]) / (faces * (parts[at + 1 :] ** 2 - parts[at] ** 2))
    return float(gain.max()), at + 1 + int(gain.argmax())


def _ladder(curve):
    """N (k,) and the squares (k,) of the error there, from what was looked at: straight in logarithms between, beyond
    as 1 / N^2; an error is never taken for larger than that of a smaller N."""
    parts, errors = np.array(curve, float).T
    errors = np.maximum(np.minimum.accumulate(errors), np.finfo(float).tiny)
    found = np.arange(1, MOST_TIMES + 1)
    inside = np.exp(np.interp(np.log(found), np.log(parts), np.log(errors)))
    return found, np.where(found > parts[-1], errors[-1] * (parts[-1] / found) ** 2, inside) ** 2
