"""`bpy.ops.pdm.subdivide`: gives meshes the vertices that the bake's colours need, as the last report says."""

import json

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty
from bpy.types import Operator

from .adaptive import adaptive_steps
from .baking.adaptive_mesh import halve_all
from .baking.again import last
from .baking.bake import Stage
from .baking.bends import FULL
from .baking.colour_attribute import BakeError
from .baking.finer_mesh import finer_size, refine
from .baking.round_places import round_places
from .modal_steps import KEEP, Steps, current
from .reading.mesh_arrays import arrays_of
from .settings import settings_of
from .subdivide_meshes import all_or_none, stuck
from .told import told
from .uniform import MOST_TIMES, parts_steps
from .words import many, say

BUDGET = 200_000  # vertices
WAYS = [
    ("ADAPTIVE", "Adaptive", "Where the light bends, at edges of shadows most: the fewest vertices, in triangles"),
    ("UNIFORM", "Uniform", "Evenly, each face as a grid of quads: many more vertices, for meshes to work on further"),
]


def uniform_steps(context, report, budget=BUDGET, among=None, copies=False, enough=lambda: False):
    """Generator of Stages: makes faces N x N where the last report calls a mesh too coarse -> (objects, vertices added,
    FULL or '').

    among: names of the only objects to change, or None; enough(): True ends it with what is known.
    """
    times, full = yield from parts_steps(context, report, budget, enough)
    chosen = {context.scene.objects[name]: n for name, n in times.items() if among is None or name in among}
    return len(chosen), subdivide(chosen, copies), "" if full else FULL


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
    steps = uniform_steps if way == "UNIFORM" else adaptive_steps
    count, added, short = yield from steps(context, report, budget, among, copies, enough)
    return count, added, short or stuck(context.scene, report, among)


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

    def execute(self, context):
        try:
            return super().execute(context)
        finally:
            if not self.options.is_repeat:  # what a script bakes next is another's
                last.drop()

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
            with last.given():
                bpy.ops.pdm.bake("INVOKE_DEFAULT", **settings_of(settings))
        return {"FINISHED"}
