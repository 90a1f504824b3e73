"""Error against run time of the current scene: a ladder of targets, and beside it the published method and Cycles."""

import os
import platform
import time
from dataclasses import asdict, dataclass

import bpy
import numpy as np

from ...pdm_core import SceneError, solve_steps
from ...pdm_core.choice import choose
from ...pdm_core.compare import difference, points_over
from ...pdm_core.left_out import left_out, seconds_steps
from ...pdm_core.patch_radiosity import MOST_PATCHES, beyond, patch_radiosity_steps
from ...pdm_core.read_off import materials_at, runs_of
from ...pdm_core.signs_of_life import mapped
from ..baking.bake import Stage, baked_before, check_light, find_targets
from ..baking.bake_points import bake_points, corners_of, joined
from ..baking.colour_attribute import BakeError
from ..baking.report import FORETOLD, plain, version
from ..reading.read_scene import read_steps
from .convergence_page import CYCLES, EXACT, PUBLISHED
from .cycles_beside import cycles_steps
from .peak_memory import added_megabytes, count_anew

LADDER = (0.16, 0.08, 0.04, 0.02, 0.01, 0.005, 0.0025, 0.00125)
PATCHES = ((1, 3), (2, 3), (3, 5), (6, 5), (12, 5))  # divisions and points of the published method
OWN_SHARE = 0.6  # of the time limit that the ladder may use where others are to be compared with
LAST_SHARE = 0.75  # of what is left that a run may be foretold to take
SAVED_AT = 0.02  # target at which what is left out is done all the same, once, and timed
MOST_VERTICES = 20_000  # of a scene that are compared, at random
NEARLY = 1.01  # a property in single precision is the same target
WORST = 10  # vertices listed
MOST_DOTS = 4000  # of the picture of where the error sits
VIEW_FROM = np.array([0.5, -0.75, 0.6])  # the direction of its view from the scene


@dataclass(frozen=True)
class ConvergenceSettings:
    """The properties of `bpy.ops.pdm.convergence`."""

    objects: str | tuple = "ALL"
    time_limit: float = 60.0  # s, sizes the ladder
    tightest: float = 0.0025  # the last target, where time allows it
    published: bool = True
    cycles: bool = False


@dataclass
class Places:
    """Where runs are compared: surface (n,), points, normals and inward (n, 3), see bake_points.joined. First come k
    baked vertices, then points spread over the whole scene; names (k,) of the vertices' objects, vertex (k,) index of
    each among its object's."""

    surface: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    inward: np.ndarray
    names: np.ndarray
    vertex: np.ndarray

    @property
    def vertices(self):
        """surface (k,) and points (k, 3) of the baked vertices."""
        return self.surface[: len(self.names)], self.points[: len(self.names)]

    def split(self, values):
        """values (n, ...) at the baked vertices, and everywhere"""
        return values[: len(self.names)], values[len(self.names) :]


class _Keep:
    """The runs so far and the time that is left."""

    def __init__(self, settings):
        self.settings, self.start, self.runs, self.said = settings, time.perf_counter(), [], []
        self.published = settings.published  # and possible

    def elapsed(self):
        return time.perf_counter() - self.start

    def left(self, share=1.0):
        return share * self.settings.time_limit - self.elapsed()


def convergence_steps(context, settings, stop=lambda: False):
    """Generator of Stages; returns the result, see `result_steps`, of JSON's own types. The scene is left alone.

    stop(): asked between stages; True ends the ladder with what is done. Raises BakeError, SceneError.
    """
    keep = _Keep(settings)
    steps = read_steps(context, settings.objects, baked_before(context.scene))
    reading = yield from mapped(steps, lambda done: Stage("Reading the scene", done, np.inf))
    targets = find_targets(reading)
    check_light(context, reading)
    places = _places(reading, targets)
    if keep.published and (what := beyond(reading.scene)):
        keep.published = False
        keep.said.append(f"the published method is left out: {what}")
    reference, plan = None, None
    for solution, values in (yield from _ladder(reading.scene, places, keep, stop)):
        reference, plan = (solution, values), solution.plan
    if reference is None:
        raise BakeError("Nothing was reached; raise the time limit")
    saved = yield from _saved(reading.scene, plan, keep, stop)
    if keep.published and not stop():
        yield from _published(reading.scene, places, keep, stop)
    if settings.cycles and not stop():
        yield from _cycles(context, reading, targets, places, keep)
    return {**(yield from result_steps(context, reading, places, keep, reference, plan)), "saved": saved}


def _places(reading, targets):
    """The Places of the vertices to be baked, and random ones of the scene."""
    found = [bake_points(*corners_of(target), "CORNER") for target in targets]
    counts = [len(p.points) for p in found]
    pick = np.sort(np.random.default_rng(0).permutation(sum(counts))[:MOST_VERTICES])
    names = np.repeat([target.name for target in targets], counts)[pick]
    vertex = np.concatenate([np.arange(count) for count in counts])[pick]
    surface, points = points_over(reading.scene)
    everywhere = surface, points, *[np.full(points.shape, np.nan)] * 2
    here = [np.concatenate([part[pick], more]) for part, more in zip(joined(found), everywhere, strict=True)]
    return Places(*here, names, vertex)


def _ladder(scene, places, keep, stop):
    """Ever tighter solutions, kept with their values as runs; returns [(Solution, values)] of the last; yields."""
    share = OWN_SHARE if keep.published or keep.settings.cycles else 1.0
    last = []
    for target in [t for t in LADDER if t > NEARLY * keep.settings.tightest] + [keep.settings.tightest]:
        needed = last[0][0].seconds_to(target) if last else None
        if stop() or (needed is not None and needed > LAST_SHARE * keep.left(share)):
            why = "stopped" if stop() else "the time limit"
            keep.said.append(f"targets from {100 * target:g} % on are left out: {why}")
            break
        held = count_anew()
        cpu, wall = time.process_time(), time.perf_counter()
        steps = solve_steps(scene, target, max(keep.left(share), 1e-3))
        try:
            solution = yield from mapped(
                steps, lambda p, t=target: Stage(f"Solving to {100 * t:g} %", p.fraction, p.error)
            )
        except SceneError as error:
            if not last:
                raise
            keep.said.append(str(error))
            break
        evaluated = yield from _values(solution, places)
        seconds, cpu = time.perf_counter() - wall, time.process_time() - cpu
        keep.runs.append({
            "method": EXACT, "setting": f"target {100 * target:g} %", "stated": solution.error, "seconds": seconds,
            "cpu_seconds": cpu, "peak_megabytes": added_megabytes(held), "nodes": solution.nodes,
            **_work(solution.counts), "history": solution.history, "values": evaluated,
        })  # fmt: skip
        last = [(solution, evaluated)]
    return last


def _work(counts):
    """What a solution took, by links or by rays: dict of a run."""
    if "rays" in counts:
        return {"rays": counts["rays"], "shadow_rays": counts.get("shadow rays", 0)}
    return {
        "links": counts.get("links", 0), "visibility_done": counts.get("exact", 0) + counts.get("sampled", 0),
        "visibility_left_out": counts.get("free", 0),
    }  # fmt: skip


def _saved(scene, plan, keep, stop):
    """[{what, seconds, without}]: what the scene does not need, done all the same at a middling target; yields. Of rays
    there is no such item."""
    saved, items = [], left_out(plan)
    if not items or choose(scene, SAVED_AT).by_rays or stop():
        return saved
    taken = {run["setting"]: run["seconds"] for run in keep.runs}
    if len(items) * 2 * taken.get(f"target {100 * SAVED_AT:g} %", np.inf) > LAST_SHARE * keep.left():
        return saved
    tell = "Timing what is left out"
    without = yield from mapped(seconds_steps(scene, SAVED_AT), lambda _: Stage(tell, 0.0, np.inf))
    for what in items:
        steps = seconds_steps(scene, SAVED_AT, what)
        seconds, _ = yield from mapped(steps, lambda _: Stage(tell, 0.0, np.inf))
        saved.append({"what": what, "seconds": seconds, "without": without[0], "target": SAVED_AT})
    return saved


def _values(solution, places):
    """Radiance at the baked vertices and everywhere; yields."""
    steps = solution.radiance_steps(places.surface, places.points, places.normals, places.inward)
    values = yield from mapped(steps, lambda done: Stage("Evaluating vertices", done, np.inf))
    return places.split(values)


def _published(scene, places, keep, stop):
    """Runs of the published method, until the time is used up; yields."""
    before = 0.0
    share = OWN_SHARE + (1 - OWN_SHARE) / (2 if keep.settings.cycles else 1)
    for divisions, points in PATCHES:
        if 2 * divisions**2 * len(scene) > MOST_PATCHES or stop() or 16 * before > keep.left(share):
            if divisions == PATCHES[0][0] and not stop():
                keep.said.append(f"the published method is left out: {len(scene):,} surfaces are too many for it")
            break
        held = count_anew()
        cpu, wall = time.process_time(), time.perf_counter()
        what = f"{divisions} x {divisions} patches, {points} points"
        steps = patch_radiosity_steps(scene, divisions, points)
        solution = yield from mapped(steps, lambda done, w=what: Stage(f"Published method, {w}", done, np.inf))
        values = yield from _values(solution, places)
        before = time.perf_counter() - wall
        keep.runs.append({
            "method": PUBLISHED, "setting": what, "stated": None, "seconds": before,
            "cpu_seconds": time.process_time() - cpu, "peak_megabytes": added_megabytes(held),
            "nodes": len(solution.patches), "links": len(solution.patches) ** 2,
            "visibility_done": solution.counts["sampled"], "visibility_left_out": 0, "values": values,
        })  # fmt: skip


def _cycles(context, reading, targets, places, keep):
    """Runs of Cycles' vertex bake in a second Blender; what goes wrong there is said, not raised; yields."""
    steps = cycles_steps(context, reading, targets, max(keep.left(), 10.0))
    try:
        runs = yield from mapped(steps, lambda text: Stage(text, 0.0, np.inf))
    except BakeError as error:
        keep.said.append(f"Cycles: {error}")
        return
    for run in runs:
        values, sizes = run.pop("values"), run.pop("sizes")
        value = np.concatenate([values[name] for name in dict.fromkeys(places.names.tolist())])
        pick = _positions(places, sizes)
        keep.runs.append({"method": CYCLES, **run, "stated": None, "values": [value[pick], None]})


def _positions(places, sizes):
    """Where the compared vertices are in arrays of all, object after object."""
    start, at = {}, 0
    for name in dict.fromkeys(places.names.tolist()):
        start[name], at = at, at + sizes[name]
    return np.array([start[name] for name in places.names.tolist()]) + places.vertex


def result_steps(context, reading, places, keep, reference, plan):
    """Generator of Stages; returns a dict of JSON's own types.

    about {extension, blender, numpy, python, machine, cores, file, scene, date}; settings; seconds; plan, said and
    warnings [text]; refused [{name, reason}]; vertices: how many were compared
    floor: the reference's own stated error, below which differences mean nothing
    runs [{method, setting, reference: whether it is that, stated, measured {vertices, surfaces {l2, p95, worst}},
        noise, seconds, cpu_seconds, peak_megabytes, nodes, and by links: links, visibility_done, visibility_left_out,
        by rays: rays, shadow_rays}]; peak_megabytes: above what the process held before, None where the
        system cannot tell
    saved [{what, seconds, without, target}]: what the scene does not need, done all the same
    foretold {target: seconds}; objects [{name, label, error}]; worst, map: see _where
    """
    solution, (at_vertices, everywhere) = reference
    own = places.split(materials_at(reading.scene, places.surface, places.points)[1])
    steps = solution.estimated_error_steps(places.surface, places.points)
    unsure = yield from mapped(steps, lambda done: Stage("Estimating errors", done, np.inf))
    runs = []
    for run in keep.runs:
        values = run.pop("values")
        is_reference = run["method"] == EXACT and values[0] is at_vertices
        measured = {
            name: asdict(difference(value, true, light))
            for name, value, true, light in zip(("vertices", "surfaces"), values, (at_vertices, everywhere), own)
            if value is not None
        }
        runs.append({**run, "measured": None if is_reference else measured, "reference": is_reference})
    return plain({
        "about": about(context), "settings": asdict(keep.settings), "seconds": keep.elapsed(),
        "plan": list(plan.lines), "said": keep.said, "warnings": reading.warnings + solution.warnings,
        "refused": [{"name": name, "reason": reason} for name, reason in reading.refused],
        "vertices": len(places.names), "floor": solution.error, "runs": runs,
        "foretold": {f"{t:g}": solution.seconds_to(t) for t in FORETOLD},
        "objects": [
            {"name": o.name, "label": o.label, "error": solution.error_over(o.surfaces)} for o in reading.objects
        ],
        **_where(solution, places, unsure, at_vertices, own[0]),
    })  # fmt: skip


def _where(solution, places, error, light, own):
    """worst: the vertices of the largest estimated errors, of each object the worst alone, worst first; map: [across,
    up, error] of places whose sides face VIEW_FROM, as seen from there, farthest first, in sizes of the picture: not of
    vertices alone, of which a floor may have four."""
    points = places.points
    size = max(float(np.sqrt(((light - own) ** 2).sum(axis=1).mean())), 1e-300)
    order = np.argsort(-places.split(error)[0])
    first = order[np.sort(np.unique(places.names[order], return_index=True)[1])][:WORST]
    worst = [
        {
            "object": places.names[k],
            "at": points[k].round(4).tolist(),
            "error": error[k] / size,
            "radiance": light[k].tolist(),
        }
        for k in first
    ]
    return {"worst": worst, "map": _picture(solution.scene, places.surface, points, error / size)}


def _picture(scene, surface, points, error):
    view = VIEW_FROM / np.linalg.norm(VIEW_FROM)
    across = np.cross([0.0, 0.0, 1.0], view)
    across /= np.linalg.norm(across)
    frame = np.stack([across, np.cross(view, across), view])
    runs = runs_of(surface)
    order = np.concatenate([mine[scene.surfaces[k].normals(points[mine]) @ view > 0] for k, mine in runs])
    order = np.sort(np.random.default_rng(0).permutation(order)[:MOST_DOTS])
    place = points[order] @ frame.T
    order, place = order[np.argsort(place[:, 2])], place[np.argsort(place[:, 2])]
    if not len(place):
        return []
    low, span = place.min(axis=0)[:2], max(np.ptp(place, axis=0)[:2].max(), 1e-300)
    return np.column_stack([(place[:, :2] - low) / span, error[order]]).round(5).tolist()


def about(context):
    """Versions and the machine."""
    return {
        "extension": version(), "blender": bpy.app.version_string, "numpy": np.__version__,
        "python": platform.python_version(), "machine": platform.processor() or platform.machine(),
        "system": platform.system(), "cores": os.cpu_count(), "file": os.path.basename(bpy.data.filepath),
        "scene": context.scene.name, "date": time.strftime("%Y-%m-%d %H:%M"),
    }  # fmt: skip
