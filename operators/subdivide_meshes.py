"""What both ways of Subdivide for the Bake share: which meshes, whether they can be changed, all of them or none."""

import bmesh
import bpy
import numpy as np

from .baking.again import last
from .baking.colour_attribute import BakeError

MOST_TOLD = 3  # meshes
SURE = 0.5  # of the target, what meshes that stay as they are may have in all: of a box's error .08 few points told .05


def too_coarse(report):
    """Whether the colours between the vertices are off by more than the target."""
    return (report["between_vertices"] or 0.0) > report["settings"]["target_error"]


def coarse_entries(scene, report, among=None):
    """{name: its entry in a report} of the objects without which the rest would surely be within the target, if they
    can be changed; among: names of the only ones, or None."""
    if report is None:
        raise BakeError("Bake first: the report tells which meshes are too coarse")
    if not too_coarse(report):
        return {}
    entries = sorted((e for e in report["objects"] if e["baked"] and e["between"]), key=lambda entry: -entry["between"])
    # squares of what is left where so many are finer
    left = report["between_vertices"] ** 2 - np.cumsum([entry["between"] ** 2 for entry in entries])
    count = np.count_nonzero(left > (SURE * report["settings"]["target_error"]) ** 2) + 1
    chosen = {entry["name"]: entry for entry in entries[:count] if among is None or entry["name"] in among}
    return {name: entry for name, entry in chosen.items() if problem_of(scene.objects.get(name)) is None}


def stuck(scene, report, among=None):
    """Why meshes that alone are above the target stay as they are, or ''."""
    target = report["settings"]["target_error"]
    coarse = [e["name"] for e in report["objects"] if e["baked"] and (e["between"] or 0.0) > target]
    problems = {name: problem_of(scene.objects.get(name)) for name in coarse if among is None or name in among}
    return "; ".join([f"Object {name!r} {problem}" for name, problem in problems.items() if problem][:MOST_TOLD])


def problem_of(obj):
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


def all_or_none(chosen, change, copies=False):
    """Calls change(object, value) for each of {object: value} -> vertices added. Where one fails, those before it are
    as they were.

    copies: changes copies, which take the objects' places in the render.
    """
    for obj in chosen:
        if problem := problem_of(obj):
            raise BakeError(f"Object {obj.name!r} {problem}")
    done, made = [], []
    try:
        for obj, value in chosen.items():
            if copies:
                obj = _copied(obj)
                made.append(obj)
            done.append((obj.data, obj.data.copy()))
            change(obj, value)
        added = sum(len(mesh.vertices) - len(before.vertices) for mesh, before in done)
    except Exception:
        for mesh, before in done:
            copy_mesh(before, mesh)
        bpy.data.batch_remove([*made, *(obj.data for obj in made)])
        raise
    finally:
        bpy.data.batch_remove([before for _, before in done])
    last.is_cut = True
    for obj in chosen if copies else ():
        obj.hide_render = True
        obj.hide_set(True)
    return added


def _copied(obj):
    """A copy of an object with a mesh of its own, in the same collections."""
    copy = obj.copy()
    copy.data = obj.data.copy()
    for collection in obj.users_collection:
        collection.objects.link(copy)
    return copy


def copy_mesh(source, target, change=None):
    """All that is on the faces and vertices of a mesh to another, or the same, changed meanwhile: change(BMesh)."""
    work = bmesh.new()
    work.from_mesh(source)
    if change is not None:
        change(work)
    work.to_mesh(target)
    work.free()
