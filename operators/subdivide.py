"""`bpy.ops.pdm.subdivide`: gives meshes the vertices that the bake's colours need, as the last report says."""

import bmesh
import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty
from bpy.types import Operator

from .baking.colour_attribute import BakeError
from .baking.finer_mesh import finer_size, refine
from .baking.report import counted
from .modal_steps import Idle
from .settings import SETTING_NAMES

MOST_TIMES = 256  # parts of an edge at once
STEPS = 40  # numbers of parts that are thought of, up to that
SPARE = 1.25  # times the error is taken for larger: few points are looked at
BUDGET = 200_000  # vertices


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


def too_coarse(report):
    """Whether the colours between the vertices are off by more than the target."""
    return (report["between_vertices"] or 0.0) > report["settings"]["target_error"]


def times_by_report(scene, report, budget):
    """({object name: N}, within the budget) for the objects of the last bake, N whole and above 1."""
    entries = [entry for entry in report["objects"] if entry["baked"] and entry["between"]]
    entries = [entry for entry in entries if _problem(scene.objects.get(entry["name"])) is None]
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


def _problem(obj):
    """Why the mesh of `obj` cannot be subdivided, going on after its name, or None."""
    if obj is None or obj.type != "MESH":
        return "is gone; bake again"
    if obj.mode != "OBJECT":
        return f"is in {obj.mode.title()} Mode; switch to Object Mode first"
    if not obj.data.is_editable:
        return "is linked from a library; make it local"
    if obj.data.users - obj.data.use_fake_user > 1:
        return "shares its mesh with other users; make it a single-user copy"
    if obj.data.shape_keys:
        return "has shape keys; apply or remove them"
    if bound := [m.name for m in obj.modifiers if getattr(m, "is_bound", False) or getattr(m, "is_bind", False)]:
        return f"has vertices bound to modifier {bound[0]!r}; apply it"
    if not len(obj.data.polygons):
        return "has no faces"
    return None


def subdivide_by_report(context, budget=BUDGET, among=None):
    """Subdivides what the last report calls too coarse -> (objects, vertices added, within the budget).

    among: names of the only objects to change, or None. Where one fails, those before it are as they were.
    """
    report = context.scene.pdm_radiosity.report()
    if report is None:
        raise BakeError("Bake first: the report tells which meshes are too coarse")
    times, full = times_by_report(context.scene, report, budget)
    chosen = {name: n for name, n in times.items() if among is None or name in among}
    return len(chosen), subdivide({context.scene.objects[name]: n for name, n in chosen.items()}), full


def subdivide(times):
    """{object: N} -> vertices added. All or none."""
    done = []
    try:
        for obj, n in times.items():
            if problem := _problem(obj):
                raise BakeError(f"Object {obj.name!r} {problem}")
            done.append((obj.data, obj.data.copy()))
            refine(obj.data, n)
        return sum(len(mesh.vertices) - len(before.vertices) for mesh, before in done)
    except Exception:
        for mesh, before in done:
            _become(mesh, before)
        raise
    finally:
        bpy.data.batch_remove([before for _, before in done])


def _become(mesh, other):
    """All that is on the faces and vertices of another mesh."""
    work = bmesh.new()
    work.from_mesh(other)
    work.to_mesh(mesh)
    work.free()


class PDM_OT_subdivide(Idle, Operator):
    """Give the meshes that are too coarse for the baked light the vertices they need. Shapes, UVs, materials and
    attributes stay as they are"""

    bl_idname = "pdm.subdivide"
    bl_label = "Subdivide for the Bake"
    bl_options = {"REGISTER", "UNDO"}

    times: IntProperty(
        name="Parts", description="Each face becomes this many by this many; 0: as many as the last report asks for",
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
    rebake: BoolProperty(
        name="Bake Again", description="In a window: start the bake with the sidebar's settings afterwards",
        default=False, options={"SKIP_SAVE"},
    )  # fmt: skip

    def execute(self, context):
        try:
            count, added, full = self.work(context)
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not count:
            self.report({"INFO"}, "No mesh is too coarse for the target of the last bake")
            return {"CANCELLED"}
        if not full:
            self.report({"WARNING"}, f"{self.budget:,} vertices are too few for the target: the error stays above it")
        self.report({"INFO"}, f"{counted(count, 'mesh', 'meshes')} subdivided, {added:,} vertices more")
        return {"FINISHED"}

    def invoke(self, context, event):
        done = self.execute(context)
        if self.rebake and done == {"FINISHED"}:
            settings = context.scene.pdm_radiosity
            bpy.ops.pdm.bake("INVOKE_DEFAULT", **{name: getattr(settings, name) for name in SETTING_NAMES})
        return done

    def work(self, context):
        selected = [obj for obj in context.selected_objects if obj.type == "MESH"]
        if not self.times:
            among = {obj.name for obj in selected} if self.objects == "SELECTED" else None
            return subdivide_by_report(context, self.budget, among)
        if self.objects != "SELECTED":
            report = context.scene.pdm_radiosity.report() or {"objects": []}
            selected = [context.scene.objects.get(entry["name"]) for entry in report["objects"] if entry["baked"]]
        times = {obj: self.times for obj in selected if obj is not None and self.times > 1}
        total = sum(finer_size(obj.data, self.times) for obj in times)
        if total > self.budget:
            raise BakeError(f"That would be {total:,} vertices, and {self.budget:,} are allowed; use fewer parts")
        return len(times), subdivide(times), True
