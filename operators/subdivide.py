"""`bpy.ops.pdm.subdivide`: gives meshes the vertices that the bake's colours need, as the last report says."""

import json

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty
from bpy.types import Operator

from .adaptive import adaptive_steps
from .baking.adaptive_mesh import halve_all
from .baking.bake import Stage
from .baking.bends import FULL
from .baking.colour_attribute import BakeError
from .baking.finer_mesh import finer_size, refine
from .baking.round_places import round_places
from .modal_steps import KEEP, Steps, current
from .reading.mesh_arrays import arrays_of
from .settings import SETTING_NAMES
from .subdivide_meshes import all_or_none, problem_of, too_coarse
from .told import told
from .words import many, say

MOST_TIMES = 256  # parts of an edge at once
STEPS = 40  # numbers of parts that are thought of, up to that
SPARE = 1.25  # times the error is taken for larger: few points are looked at
BUDGET = 200_000  # vertices
WAYS = [
    ("ADAPTIVE", "Adaptive", "Where the light bends, at edges of shadows most: the fewest vertices, in triangles"),
    ("UNIFORM", "Uniform", "Evenly, each face as a grid of quads: many more vertices, for meshes to work on further"),
]


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
    found = np.unique(np.rint(np.geomspace(1, MOST_TIMES, STEPS)).astype(int))
    inside = np.exp(np.interp(np.log(found), np.log(parts), np.log(errors)))
    return found, np.where(found > parts[-1], errors[-1] * (parts[-1] / found) ** 2, inside) ** 2


def times_by_report(scene, report, budget):
    """({object name: N}, within the budget) for the objects of the last bake, N whole and above 1."""
    entries = [entry for entry in report["objects"] if entry["baked"] and entry["between"]]
    entries = [entry for entry in entries if problem_of(scene.objects.get(entry["name"])) is None]
    if not entries or not too_coarse(report):
        return {}, True
    meshes = [scene.objects[entry["name"]].data for entry in entries]
    faces = np.array([len(mesh.polygons) for mesh in meshes], float)
    curves = [[(1, entry["between"]), *map(tuple, entry.get("finer", ()))] for entry in entries]
    times, full = needed(curves, faces, report["settings"]["target_error"] / SPARE), True
    while (total := sum(map(finer_size, meshes, times))) > budget and times.max() > 1:
        full = False
        times = np.maximum(np.minimum(np.floor(times * np.sqrt(budget / total)), times - (times > 1)), 1)
    return {entry["name"]: int(n) for entry, n in zip(entries, times, strict=True) if n > 1}, full


def subdivide_by_report(context, report, budget=BUDGET, among=None, copies=False):
    """Makes faces N x N where the last report calls a mesh too coarse -> (objects, vertices added, FULL or '').

    among: names of the only objects to change, or None.
    """
    times, full = times_by_report(context.scene, report, budget)
    chosen = {name: n for name, n in times.items() if among is None or name in among}
    return (
        len(chosen),
        subdivide({context.scene.objects[name]: n for name, n in chosen.items()}, copies),
        "" if full else FULL,
    )


def subdivide(times, copies=False):
    """{object: N} -> vertices added. All or none."""
    return all_or_none(times, lambda obj, n: _finer(obj.data, n), copies)


def _finer(mesh, times):
    arrays = arrays_of(mesh)
    if any(not sphere.is_even for sphere in round_places(arrays)):  # has no rings any more, but its triangles
        halve_all(mesh, arrays, times)
    else:
        refine(mesh, times)


def subdivide_steps(context, way, budget=BUDGET, among=None, copies=False, enough=lambda: False):
    """Generator of Stages: gives meshes the vertices that the last report asks for, `way` ADAPTIVE or UNIFORM ->
    (objects, vertices added, why that is not enough, or '').

    among: names of the only objects to change, or None.
    """
    report = context.scene.pdm_radiosity.report()
    if report is None:
        raise BakeError("Bake first: the report tells which meshes are too coarse")
    if way == "UNIFORM":
        return subdivide_by_report(context, report, budget, among, copies)
    return (yield from adaptive_steps(context, report, budget, among, copies, enough))


def tell_short(scene, short):
    """The sentence that it was not enough, which the scene's report has from now on."""
    report, text = scene.pdm_radiosity.report(), f"The error between vertices stays above the target: {short}"
    report["warnings"].append(text)
    scene.pdm_radiosity.last_report = json.dumps(report)
    return text


class PDM_OT_subdivide(Steps, Operator):
    """Give the meshes that are too coarse for the baked light the vertices they need. Shapes, UVs, materials and
    attributes stay as they are"""

    bl_idname = "pdm.subdivide"
    bl_label = "Subdivide for the Bake"
    bl_options = {"REGISTER", "UNDO"}

    method: EnumProperty(name="Method", description="Where the new vertices go", items=WAYS, default=WAYS[0][0])
    times: IntProperty(
        name="Parts", description="Each face becomes this many by this many; 0: what the last report asks for",
        default=0, min=0, max=MOST_TIMES, soft_max=32,
    )  # fmt: skip
    budget: IntProperty(
        name="Most Vertices",
        description="Of all these meshes together; the error stays larger where it is not enough",
        default=BUDGET, min=1, soft_max=10_000_000,
    )  # fmt: skip
    objects: EnumProperty(
        name="Objects",
        items=[
            ("ALL", "All", "Every object of the last bake that is too coarse"),
            ("SELECTED", "Selected", "Those among the selected; with a number of parts, every selected mesh"),
        ],
        default="ALL",
    )
    copies: BoolProperty(
        name="On Copies", default=False,
        description="Leave the objects as they are, hidden, and put subdivided copies in their places",
    )  # fmt: skip
    rebake: BoolProperty(
        name="Bake Again", description="In a window: start the bake with the sidebar's settings afterwards",
        default=False, options={"SKIP_SAVE"},
    )  # fmt: skip

    can_keep = True

    def make_steps(self, context):
        selected = [obj for obj in context.selected_objects if obj.type == "MESH"]
        if self.times:
            return self.parts_steps(context, selected)
        report = context.scene.pdm_radiosity.report()
        self.target = report["settings"]["target_error"] if report else 0.0
        among = {obj.name for obj in selected} if self.objects == "SELECTED" else None
        enough = lambda: self.in_window and current.wish == KEEP  # noqa: E731
        return subdivide_steps(context, self.method, self.budget, among, self.copies, enough)

    def parts_steps(self, context, selected):
        if self.objects != "SELECTED":
            report = context.scene.pdm_radiosity.report() or {"objects": []}
            selected = [context.scene.objects.get(entry["name"]) for entry in report["objects"] if entry["baked"]]
        times = {obj: self.times for obj in selected if obj is not None and self.times > 1}
        total = sum(finer_size(obj.data, self.times) for obj in times)
        if total > self.budget:
            raise BakeError(f"That would be {total:,} vertices, and {self.budget:,} are allowed; use fewer parts")
        yield Stage("Subdividing", 0.0, np.inf)
        return len(times), subdivide(times, self.copies), ""

    def done(self, context, result):
        count, added, short = result
        if short:
            self.report({"WARNING"}, told(tell_short(context.scene, short)))
        if not count:
            none = say("No mesh was subdivided") if short else say("No mesh is too coarse for the last target")
            self.report({"INFO"}, none)
            return {"CANCELLED"}
        self.report({"INFO"}, say("{} subdivided, {} vertices more", many(count, "mesh", "meshes"), f"{added:,}"))
        if self.in_window and self.rebake:
            settings = context.scene.pdm_radiosity
            bpy.ops.pdm.bake("INVOKE_DEFAULT", **{name: getattr(settings, name) for name in SETTING_NAMES})
        return {"FINISHED"}
