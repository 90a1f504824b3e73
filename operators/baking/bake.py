"""The bake: read the scene, solve it, evaluate the field at the vertices, write all colours or none."""

import time
from collections import namedtuple
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...pdm_core import SceneError, solve_steps
from ...pdm_core.plan import lit
from ...pdm_core.signs_of_life import finish, in_thread, mapped
from ..live import hold
from ..reading.read_scene import Reading, read_steps, some
from ..reading.render_visible import render_visible
from .bake_points import bake_points, corners_of, each_of, joined
from .between_vertices import between_steps, looks_between
from .colour_attribute import BakeError, check_name, check_target, colours_of, write_colours
from .error_map import error_name, heat_map_steps, names_written
from .field_at import Field
from .foreseen import check_colours, foreseen
from .layer import blended, check_layer
from .own_meshes import OwnMeshes
from .passes import OF_LIGHT, in_order, pass_steps
from .report import bake_report, scan_result
from .shown import shown_steps
from .so_far import SoFar
from .stand_ins import stand_in_steps
from .still_there import still_there

# error: the current estimated relative error; said: sentences to be told at once
Stage = namedtuple("Stage", "text fraction error said", defaults=((),))

LEAST_SECONDS = 1e-3  # of solving, where reading used the time limit up


@dataclass(frozen=True)
class BakeSettings:
    """The properties of `bpy.ops.pdm.bake`; `objects` may also be a tuple of object names."""

    objects: str | tuple = "ALL"
    target_error: float = 1e-2
    time_limit: float = 0.0  # s of reading and solving, 0 none
    attribute: str = "Radiosity"
    quantity: str = "RADIANCE"
    domain: str = "AUTO"
    data_type: str = "FLOAT_COLOR"
    exposure: float = 0.0  # stops
    blend: str = "REPLACE"  # or MULTIPLY into, ADD to the colours of `layer`
    layer: str = ""  # name of another colour attribute
    heat_map: bool = False  # also the estimated error, as colours
    passes: tuple = ()  # names of passes.SUFFIX, in any order: also these, as attributes of their own
    ao_distance: float = 1.0  # m, of the pass AO
    make_single_user: bool = False  # objects that share a mesh get their own
    apply_modifiers: bool = False  # what modifiers change is baked as they leave it

    def __post_init__(self):
        object.__setattr__(self, "passes", in_order(self.passes))

    @property
    def written(self):
        """Names of the attributes that the bake writes."""
        return names_written(self.attribute, self.heat_map, self.passes)


@dataclass(eq=False)
class _Read:
    """What is baked: the Reading; targets [ReadObject] and points [BakePoints] of each; told: warnings besides the
    Reading's; away: names of targets that light comes to only from behind."""

    reading: Reading
    targets: list
    points: list
    told: list
    away: list


@dataclass(frozen=True)
class _Place:
    """The scene and view layer that are baked, whatever the window shows at the end."""

    scene: bpy.types.Scene
    scene_name: str
    layer_name: str

    @classmethod
    def of(cls, context):
        return cls(context.scene, context.scene.name, context.view_layer.name)

    def override(self, context):
        scene = still_there(self.scene, self.scene_name, bpy.data.scenes)
        layer = scene and scene.view_layers.get(self.layer_name)
        if layer is None:
            raise BakeError(f"Scene {self.scene_name!r} was removed or renamed during the bake; bake again")
        return context.temp_override(scene=scene, view_layer=layer)


@dataclass(eq=False)
class _Found:
    """Of a Field: values [(k, 3)] at each target's points, and what is asked for beside them. kept: Kept or None;
    passes {attribute: [Colours]}; between: Between; errors: ErrorMap or None."""

    field: Field
    values: list
    kept: object
    passes: dict
    between: object = None
    errors: object = None


def bake_steps(context, settings, enough=lambda: False, last=None, show=None):
    """Generator: yields Stage(text, fraction, error) often, returns the report (dict, see report.py).

    Nothing in the file changes before the very end: closing the generator cancels. enough(): True ends solving with
    the best so far; last: again.last where a solution is to be kept, and taken if there is one; show(): called where
    the best so far has been written, until the end or the closing of the generator takes that back. Raises BakeError,
    SceneError.
    """
    seconds, place = {}, _Place.of(context)
    for name in settings.written:
        check_name(name)
    yield Stage("Reading the scene", 0.0, np.inf)
    with _timed(seconds, "read"):
        read = yield from _read(context, settings)
    is_live = context.scene.pdm_radiosity.live
    so_far = SoFar(settings, list(zip(read.targets, read.points, strict=True)), show) if show else None
    try:
        with _timed(seconds, "solve"):
            scene = read.reading.scene
            solution = last and last.recall(settings, scene)
            solution = solution or (yield from _solve(scene, settings, seconds["read"], enough, so_far))
        found = yield from _find(settings, read, solution, seconds, is_live)
    finally:
        if so_far:
            so_far.take_back()
    with place.override(context):
        report = _write(context, settings, read, found, seconds)
    if last:
        last.keep(settings, solution, read.reading.scene)
    return report


def _read(context, settings):
    """The _Read; yields. BakeError where there is nothing to bake, or nothing to see it by."""
    baked = {*names_written(settings.attribute), *baked_before(context.scene)}
    steps = read_steps(context, settings.objects, baked, settings.make_single_user, settings.apply_modifiers)
    reading = yield from mapped(steps, lambda done: Stage("Reading the scene", done, np.inf))
    targets = find_targets(reading)
    for target in targets:
        for name in settings.written:
            check_target(target.object, name)
    told = check_layer(settings, settings.written, targets)
    check_light(context, reading)
    if settings.quantity == "RADIANCE":
        check_colours(reading, targets)
    away = yield from _check_sides(reading, targets)
    said = yield from mapped(in_thread(foreseen, reading), lambda _: Stage("Reading the scene", 1.0, np.inf))
    reading.warnings += said
    yield Stage("Reading the scene", 1.0, np.inf, tuple(said))
    points = []
    for target in targets:
        steps = in_thread(bake_points, *corners_of(target), settings.domain)
        points.append((yield from mapped(steps, lambda _: Stage("Reading the scene", 1.0, np.inf))))
    return _Read(reading, targets, points, told, away)


def _find(settings, read, solution, seconds, is_live):
    """The _Found; yields. is_live: whether the light is kept, to be changed later."""
    targets, points = read.targets, read.points

    def stage(text):
        return lambda done: Stage(text, done, solution.error)

    with _timed(seconds, "evaluate"):
        field, kept = Field(solution, settings.quantity), None
        if is_live or any(name in OF_LIGHT for name in settings.passes):
            kept = yield from _keep(solution, points, read.told)
        looks = looks_between(targets, points)
        values, here = yield from _evaluate(field, points, looks, kept)
        steps = stand_in_steps(solution, targets, points, values, looks, here)
        read.points, seen = yield from mapped(steps, stage("Evaluating vertices"))
        points = read.points
        steps = pass_steps(settings, solution.scene, kept, targets, points)
        found = _Found(field, values, kept, (yield from mapped(steps, stage("Evaluating passes"))))
    with _timed(seconds, "check"):
        shown = yield from mapped(shown_steps(field), stage("Checking between vertices"))
        steps = between_steps(shown, targets, points, values, looks, here, seen, settings.target_error)
        found.between = yield from mapped(steps, stage("Checking between vertices"))
        if settings.heat_map:
            found.errors = yield from mapped(heat_map_steps(solution, targets, points), stage("Checking the error"))
    return found


def _write(context, settings, read, found, seconds):
    """Writes all colours, keeps and returns the report; nothing is changed where anything fails."""
    with ExitStack() as undo:  # of what was written
        with _timed(seconds, "write"):
            values = [value * 2.0**settings.exposure for value in found.values]
            items = colours_of(read.targets, read.points, values)
            own_meshes = OwnMeshes(context, read.targets)
            undo.callback(own_meshes.undo)
            items = [blended(settings, item) for item in items]
            if found.errors:
                undo.callback(write_colours(found.errors.items, error_name(settings.attribute), "FLOAT_COLOR"))
            for name, colours in found.passes.items():
                undo.callback(write_colours(colours, name, settings.data_type))
            undo.callback(write_colours(items, settings.attribute, settings.data_type))
        report = _report(context, settings, read, found, items, seconds)
        context.scene.pdm_radiosity.keep(report)
        undo.pop_all()
    own_meshes.commit()
    is_live = context.scene.pdm_radiosity.live
    solved = found.field.solution.scene  # of whose shapes the light is kept
    hold(context, settings, read.reading, solved, read.targets, read.points, found.kept if is_live else None)
    return report


def _report(context, settings, read, found, items, seconds):
    between, errors = found.between, found.errors
    report = bake_report(context, settings, read.reading, found.field.solution, between, items, read.points, seconds)
    report["heat_map"] = errors and {"attribute": error_name(settings.attribute), "top": errors.top}
    for k, finer in between.finer.items():
        entry = next(entry for entry in report["objects"] if entry["name"] == read.targets[k].name)
        entry["finer"] = [list(row) for row in finer]
    report |= {"shining": lights_in(read.reading), "facing_away": read.away}
    report["warnings"] += read.told
    return report


def baked_before(scene):
    """Names of the colour attributes that the last bake of the scene wrote."""
    last = scene.pdm_radiosity.report()
    return set(names_written(last["settings"]["attribute"])) if last else set()


def look_at_steps(context):
    """Generator of the fraction done; returns what the sidebar lists before a bake: scan_result with `lights`."""
    reading = yield from read_steps(context, baked=baked_before(context.scene))
    return {**scan_result(reading), "shining": lights_in(reading), "foreseen": (yield from _foreseen(context, reading))}


def _foreseen(context, reading):
    """[sentence] of what a bake would be stopped for, or said before it; yields."""
    targets = [each for each in reading.objects if each.bakeable]
    try:
        if targets and context.scene.pdm_radiosity.quantity == "RADIANCE":
            check_colours(reading, targets)
        return (yield from mapped(in_thread(foreseen, reading), lambda _: 1.0))
    except BakeError as error:
        return [str(error)]


def look_at_scene(context):
    return finish(look_at_steps(context))


def lights_in(reading):
    """{count: objects and lights that shine, sky: whether light comes from outside} of a Reading."""
    scene = reading.scene
    if scene is None:
        return {"count": 0, "sky": False}
    shining = (scene.emission > 0).any(axis=1)
    count = sum(bool(shining[o.surfaces].any()) for o in reading.objects) + len(scene.lights)
    return {"count": count, "sky": bool((scene.background > 0).any())}


def check_light(context, reading):
    """Raises BakeError where nothing shines, before the work."""
    scene = reading.scene
    if (scene.emission > 0).any() or (scene.background > 0).any() or scene.lights:
        return
    lamps = [obj.name for obj in render_visible(context.view_layer) if obj.type == "LIGHT"]
    dark = f"{some('light', lamps)} send{'s' * (len(lamps) == 1)} none (see the warnings); " if lamps else ""
    raise BakeError(
        f"Nothing shines: {dark}add a light, give an object a material that emits, or the world a colour above black"
    )


def _check_sides(reading, targets):
    """Warns of objects whose normals face away from all light that comes to them, returns their names; yields.
    BakeError where all do."""
    steps = in_thread(lit, reading.scene)
    reached = yield from mapped(steps, lambda _: Stage("Reading the scene", 1.0, np.inf))
    away = [
        target.name
        for target in targets
        if reached[target.surfaces].any() and not reached[np.unique(target.corner_surface)].any()
    ]
    if not away:
        return away
    text = (
        f"Light comes only to the sides that the normals of {some('object', away)} face away from, and the baked sides "
        "stay black; flip the normals (Edit Mode, Mesh > Normals > Flip)"
    )
    if len(away) == len(targets):
        raise BakeError(text)
    reading.warnings.append(text)
    return away


@contextmanager
def _timed(seconds, stage):
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def find_targets(reading):
    """The objects that receive colours; BakeError where there are none."""
    targets = [o for o in reading.objects if o.bakeable]
    if reading.scene is None or not targets:
        reasons = [f"{name!r} {reason}" for name, reason in reading.refused]
        reasons += [f"{o.name!r} {o.reason}" for o in reading.objects if not o.bakeable]
        found = "; ".join(reasons[:3]) or "a render shows no mesh object"
        raise BakeError(f"Nothing to bake: add a mesh object, or select one ({found})")
    return targets


def _solve(scene, settings, spent, enough, so_far):
    """spent: seconds of the time limit that reading took; so_far: SoFar or None."""
    limit = max(settings.time_limit - spent, LEAST_SECONDS) if settings.time_limit else None
    steps = solve_steps(scene, settings.target_error, limit, enough)
    steps = so_far.steps(steps) if so_far else steps
    return (yield from mapped(steps, lambda progress: Stage("Solving", progress.fraction, progress.error)))


def _keep(solution, points, told):
    """The Kept of all points, None where there is no room for it, which is told; yields."""
    steps = solution.kept_steps(*joined(points))
    try:
        return (yield from mapped(steps, lambda done: Stage("Evaluating vertices", done, solution.error)))
    except SceneError as error:
        told.append(f"Live and passes of the light are left out: {error}")
    return None


def _evaluate(field, points, looks, kept):
    """The field where colours are read off, [(k, 3)] a bake object, and between its vertices, [(n, 3)]: all at once, or
    as it is kept; yields."""
    error, scene = field.solution.error, field.solution.scene
    places = [p.places() for p in points] if kept is None else []
    steps = field.at_places(places + [look.places() for look in looks])
    values = yield from mapped(steps, lambda done: Stage("Evaluating vertices", done, error))
    here = values[len(places) :]
    if kept is None:
        return values[: len(points)], here
    light = kept.radiance(scene) if field.quantity == "RADIANCE" else kept.incident(scene)
    return each_of(light, points), here
