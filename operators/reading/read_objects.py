"""All that a render shows as RawMeshes: mesh objects, what evaluates to a mesh, and instances."""

from dataclasses import dataclass, field

import numpy as np

from .mesh_arrays import arrays_of
from .mesh_layers import gather_layers
from .mesh_topology import NotRecognised
from .read_mesh import BEYOND, RawMesh, materials_of, modifiers_of, render_differences

HAIR = {"PATH", "HALO", "LINE"}  # what particles are shown as besides objects
UNREAD = {"CURVES", "POINTCLOUD", "VOLUME", "GPENCIL", "GREASEPENCIL"}
GHOST = "is visible to neither Diffuse nor Shadow rays and takes no part in this light; switch them on to bake it"
MOST_INSTANCES = 10_000  # each is a shape of its own


@dataclass(eq=False)
class Gathered:
    """raw: [RawMesh]; looks: {name of a material or None: Appearance}; refused: [(name, reason)]; warnings:
    [sentence]."""

    raw: list = field(default_factory=list)
    looks: dict = field(default_factory=dict)
    refused: list = field(default_factory=list)
    warnings: list = field(default_factory=list)


def gather_steps(visible, wanted, depsgraph, look, single_user=False, apply=False):
    """Generator; returns Gathered of the objects that a render shows and of their instances, while the depsgraph lives.

    look: Material or None -> Appearance. single_user: objects that share a mesh get one of their own when they are
    baked, wanted (set) ones; apply: what modifiers change is baked as they leave it.
    """
    out, copies, override = Gathered(), {}, depsgraph.view_layer_eval.material_override
    first_user = {}
    for obj in visible:
        if obj.type == "MESH" and obj in wanted:
            first_user.setdefault(obj.data, obj)
    for obj in visible:
        yield
        if obj.type in UNREAD:
            out.refused.append((obj.name, f"is of type {obj.type.title()}; convert it to a mesh"))
        if obj.type != "MESH" or _is_ghost(obj):
            if obj.type == "MESH":
                out.refused.append((obj.name, GHOST))
            continue  # the meshes of curves and the like come among the instances
        evaluated = obj.evaluated_get(depsgraph)
        try:
            raw, materials = _copied(obj.name, obj, evaluated, evaluated.matrix_world, copies, override)
        except NotRecognised as error:
            out.refused.append((obj.name, str(error)))
            continue
        _prepare(raw, obj, first_user, single_user, apply)
        _keep(out, raw, evaluated, materials, look, copies)
    _instances(out, set(visible), depsgraph, look, copies)
    for obj in visible:
        if obj.type == "MESH" and any(s.settings.render_type in HAIR for s in obj.particle_systems):
            out.warnings.append(f"Object {obj.name!r}: its particles are no meshes: they are left out; convert them")
    return out


def _keep(out, raw, evaluated, materials, look, copies):
    out.raw.append(raw)
    for name, material in zip(raw.materials, materials, strict=True):
        if name not in out.looks:
            out.looks[name] = look(material)
    needs = frozenset().union(*(out.looks[name].needs for name in raw.materials))
    raw.layers = gather_layers(evaluated, raw.arrays, needs, copies)


def _copied(name, obj, evaluated, matrix, copies, override):
    """The RawMesh of an evaluated object's mesh at this matrix, not bakeable yet, and its materials. copies: {pointer:
    Arrays}."""
    mesh, matrix = evaluated.data, np.array(matrix, np.float64)
    if not (np.abs(matrix) < BEYOND).all():
        raise NotRecognised("has a transform that is not finite or beyond all bounds; clear or repair it")
    key = mesh.as_pointer()
    if key not in copies:
        copies[key] = arrays_of(mesh)
    arrays = copies[key]
    if not (np.abs(arrays.vertices) < BEYOND).all():
        raise NotRecognised("has vertices that are not finite or beyond all bounds; delete or repair them")
    if not len(arrays.counts):
        raise NotRecognised("has no faces")
    materials, of_polygon = materials_of(evaluated, mesh, override)
    names = [material and material.name_full for material in materials]
    return RawMesh(name, obj, matrix, arrays, names, of_polygon), materials


def _prepare(raw, obj, first_user, single_user, apply):
    """Makes a mesh object's RawMesh bakeable, or gives the reason why it is not."""
    mesh = obj.data
    raw.changed, raw.warnings = modifiers_of(obj), render_differences(obj)
    raw.apply = apply and bool(obj.modifiers or mesh.shape_keys)
    if obj.library or mesh.library or not mesh.is_editable:
        raw.reason = "is linked from a library; make it local"
        return
    raw.base = arrays_of(mesh) if _may_differ(obj) else raw.arrays
    users = mesh.users - mesh.use_fake_user
    first = first_user.get(mesh, obj)
    if users > 1 and single_user:
        raw.single_user = True
    elif users > 1 and first != obj:
        raw.reason = f"shares its mesh with {first.name!r}, whose bake it shows; make it a single-user copy"
    elif users > 1:
        raw.warnings.append(f"shares its mesh with other users ({users} in all): all of them show its bake")


def _is_ghost(obj):
    """Whether neither what is reflected nor what lamps send meets an object: Cycles' Ray Visibility."""
    return not (obj.visible_diffuse or obj.visible_shadow)


def _may_differ(obj):
    """Whether the evaluated mesh may be another than the one that is baked."""
    deforms = obj.parent is not None and obj.parent_type in {"ARMATURE", "LATTICE"}
    return bool(obj.modifiers or obj.data.shape_keys or deforms)


def _instances(out, visible, depsgraph, look, copies):
    """RawMeshes of all instances that visible objects make, and of what evaluates to a mesh: an instance of itself."""
    counts, total, override = {}, 0, depsgraph.view_layer_eval.material_override
    for instance in depsgraph.object_instances:
        obj = instance.object
        if not instance.is_instance or obj.type not in UNREAD | {"MESH"} or obj.original.hide_render:
            continue
        if instance.parent is None or instance.parent.original not in visible or _is_ghost(obj.original):
            continue
        total += 1
        if total > MOST_INSTANCES:
            continue
        kind = obj.original.type
        itself = kind != "MESH" and instance.parent.original == obj.original and obj.name not in counts
        counts[obj.name] = number = counts.get(obj.name, 0) + (0 if itself else 1)
        name = obj.name if itself else f"{obj.name} (instance {number})"
        if obj.type in UNREAD:
            out.refused.append((name, f"is of type {obj.type.title()}; convert it to a mesh"))
            continue
        try:
            raw, materials = _copied(name, obj.original, obj, instance.matrix_world, copies, override)
        except NotRecognised as error:
            out.refused.append((name, str(error)))
            continue
        raw.reason = "is an instance; make it real to bake it (Object > Apply > Make Instances Real)"
        if itself:
            raw.reason = f"is of type {kind.title()}; convert it to a mesh to bake it"
        _keep(out, raw, obj, materials, look, copies)
    if total > MOST_INSTANCES:
        out.warnings.append(f"{total - MOST_INSTANCES:,} instances after {MOST_INSTANCES:,} others are left out")
