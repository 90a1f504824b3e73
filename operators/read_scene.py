"""Blender's scene as a pdm_core.Scene: every render-visible mesh object becomes surfaces or is refused aloud."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..pdm_core import Scene, SceneError
from ..pdm_core.signs_of_life import finish, in_thread, mapped
from .colour_attribute import BakeError
from .looks_on_meshes import looks_on, settle_pictures
from .materials import read_material, read_world
from .mesh_layers import gather_layers
from .mesh_topology import NotRecognised
from .read_mesh import gather_mesh, recognise
from .read_surfaces import pieces_of, surfaces_of, twins
from .render_visible import evaluated, render_visible

UNREAD = {"CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD", "VOLUME", "GPENCIL", "GREASEPENCIL"}
LARGE = 20_000  # corners, from which on a mesh is recognised in a thread of its own, to give signs of life meanwhile
SINGLE = 2**-24  # relative rounding of Blender's coordinates and matrices


@dataclass(eq=False)
class ReadObject:
    """A recognised object, which takes part in the light.

    kind 'SPHERE', 'PLANE', 'PLANES' or 'SHAPES'; label for the user; surfaces: its indices into Scene.surfaces;
    matrix (4, 4) float64 to the world; polygon_surface (p,): the surface that each polygon of the base mesh faces
    along its normal; bakeable, or the reason why it is not.
    """

    object: bpy.types.Object
    name: str
    kind: str
    label: str
    surfaces: list
    matrix: np.ndarray
    polygon_surface: np.ndarray
    bakeable: bool
    reason: str

    @property
    def mesh(self):
        """The mesh that is baked; BakeError where the object was removed after it was read."""
        try:
            return self.object.data
        except ReferenceError:
            raise BakeError(f"Object {self.name!r} was removed during the bake; bake again") from None


@dataclass(eq=False)
class Reading:
    """scene: a pdm_core.Scene, None where nothing is recognised; objects: [ReadObject]; refused: [(name, reason)],
    left out of the light; warnings: [sentence]; hidden: how many mesh objects a render does not show."""

    scene: Scene | None
    objects: list = field(default_factory=list)
    refused: list = field(default_factory=list)
    warnings: list = field(default_factory=list)
    hidden: int = 0


def read_scene(context, objects="ALL", baked=()):
    """The Reading at once, see read_steps."""
    return finish(read_steps(context, objects, baked))


def read_steps(context, objects="ALL", baked=()):
    """Generator of the fraction done; returns the Reading of the context's scene and view layer.

    objects, 'ALL', 'SELECTED' or names, limits what is bakeable and never what lights: every recognised object that a
    render shows takes part in the light. baked: names of colour attributes that hold bakes, which are no light.
    SceneError where a name is missing or a visible object is in Edit Mode.
    """
    view_layer = context.view_layer
    visible = render_visible(view_layer)
    meshes = [obj for obj in visible if obj.type == "MESH"]
    wanted = _wanted(view_layer, meshes, objects)
    editing = [repr(obj.name) for obj in meshes if obj.data.is_editmode]
    if editing:
        raise SceneError(f"Object {', '.join(editing)} is in Edit Mode; switch to Object Mode first")
    reading = Reading(None, hidden=sum(obj.type == "MESH" for obj in view_layer.objects) - len(meshes))
    reading.refused += [
        (obj.name, f"is of type {obj.type.title()}; convert it to a mesh") for obj in visible if obj.type in UNREAD
    ]
    with evaluated(context, visible) as depsgraph:  # what is hidden is shown meanwhile: no other hand may come between
        raw, looks = _gather(meshes, depsgraph, reading, frozenset(baked))
        _note_unread(visible, depsgraph, reading)
        background = _background(context.scene, depsgraph, reading)
        settle_pictures(looks, background.any() or any(obj.type == "LIGHT" for obj in visible))
    found = yield from _recognise(raw, reading)
    taken = _accept(found, looks, reading)
    everything = [piece for _, pieces in taken for piece in pieces]
    reading.scene, indices = yield from mapped(in_thread(_scene_of, everything, background), lambda _: 1.0)
    for mesh, pieces in taken:
        own, indices = indices[: len(pieces)], indices[len(pieces) :]
        reading.objects.append(_read_object(mesh, own, mesh.object in wanted))
    return reading


def _scene_of(pieces, background):
    """The Scene of [Piece], None where there is none, and the indices of each one's surfaces."""
    surfaces, indices = surfaces_of(pieces)
    return Scene(surfaces, background, rounding=SINGLE) if surfaces else None, indices


def _wanted(view_layer, meshes, objects):
    """The set of objects to bake."""
    if objects == "ALL":
        return set(meshes)
    if objects == "SELECTED":
        return set(view_layer.objects.selected)
    names = [objects] if isinstance(objects, str) else list(objects)
    shown = {obj.name: obj for obj in meshes}
    for name in names:
        if name not in shown:
            there = name in view_layer.objects
            why = "is not a mesh that a render shows" if there else f"is not in view layer {view_layer.name!r}"
            raise SceneError(f"Object {name!r} {why}; name a visible mesh object")
    return {shown[name] for name in names}


def _gather(meshes, depsgraph, reading, baked):
    """[RawMesh] of those that are sound, the others go to reading.refused; {name or None: Appearance} of materials."""
    raw, looks, images = [], {}, {}
    for obj in meshes:
        try:
            mesh, materials = gather_mesh(obj, depsgraph)
        except NotRecognised as error:
            reading.refused.append((obj.name, str(error)))
            continue
        raw.append(mesh)
        for name, material in zip(mesh.materials, materials, strict=True):
            if name not in looks:
                looks[name] = read_material(material, baked, images)
        needs = frozenset().union(*(looks[name].needs for name in mesh.materials))
        mesh.layers = gather_layers(obj, depsgraph, needs, baked)
    return raw, looks


def _recognise(raw, reading):
    """Generator of the fraction done; returns [MeshObject] of the recognised; the others go to reading.refused."""
    found, grids, done = [], {}, 0
    total = sum(len(mesh.arrays[1]) for mesh in raw)
    for mesh in raw:
        size = len(mesh.arrays[1])
        try:
            if size < LARGE:
                found.append(recognise(mesh, grids))
            else:
                found.append((yield from mapped(in_thread(recognise, mesh, grids), lambda _, at=done: at / total)))
        except NotRecognised as error:
            reading.refused.append((mesh.object.name, str(error)))
        done += size
        yield done / max(total, 1)
    return found


def _accept(found, looks, reading):
    """[(MeshObject, [Piece])]; objects whose shapes the core refuses, or which lie on others, go to refused."""
    users, taken = {}, []
    for mesh in found:
        for name in mesh.shape_materials:
            users.setdefault(name, {})[mesh.object.name] = None
        own = looks_on(mesh, looks)
        pieces = pieces_of(mesh.object.name, mesh.matrix, mesh.shapes, own)
        problems = [problem for piece in pieces if (problem := piece.shape.problem())]
        if all(look.absent for look in own):
            reading.refused.append((mesh.object.name, f"{own[0].absent} and takes no part in this light"))
        elif problems:
            reading.refused.append((mesh.object.name, problems[0]))
        else:
            taken.append((mesh, pieces))
    taken = _without_twins(taken, reading)
    for key, names in users.items():
        reading.warnings += [
            f"Material {key!r} ({some('object', list(names))}): {text}" for text in looks[key].warnings
        ]
    for mesh, _ in taken:
        reading.warnings += [f"Object {mesh.object.name!r}: {text}" for text in mesh.warnings]
    return taken


def _without_twins(taken, reading):
    """Two shapes on one another would each hide the other: the later object is left out, if the earlier is not."""
    owner = [k for k, (_, pieces) in enumerate(taken) for _ in pieces]
    twin = twins([piece for _, pieces in taken for piece in pieces])
    doubled = {}
    for late in np.flatnonzero(twin >= 0):
        early = owner[twin[late]]
        if owner[late] not in doubled and (early not in doubled or early == owner[late]):
            doubled[owner[late]] = early
    for late, early in doubled.items():
        name = taken[early][0].object.name
        where = "itself; merge its doubled faces" if late == early else f"object {name!r}; move or delete one of them"
        reading.refused.append((taken[late][0].object.name, f"lies exactly on {where}"))
    return [entry for k, entry in enumerate(taken) if k not in doubled]


def _read_object(mesh, indices, is_wanted):
    facing = np.array([sides[0] for sides in indices])
    reason = mesh.reason or ("" if is_wanted else "is not among the objects to bake")
    return ReadObject(
        object=mesh.object,
        name=mesh.object.name,
        kind=mesh.shapes.kind,
        label=mesh.shapes.label,
        surfaces=[index for sides in indices for index in sides],
        matrix=mesh.matrix,
        polygon_surface=facing[mesh.polygon_shape],
        bakeable=not reason,
        reason=reason,
    )


def _note_unread(visible, depsgraph, reading):
    """What a render shows and we do not read: instances, particles, lights."""
    made = {}
    for instance in depsgraph.object_instances:
        if instance.is_instance and instance.object.type in UNREAD | {"MESH"}:
            name = instance.parent.name
            made[name] = made.get(name, 0) + 1
    refused = {name for name, _ in reading.refused}
    meshes = {obj.name for obj in visible if obj.type == "MESH"}
    for name, count in made.items():
        text = f"makes {count} instance{'s' * (count > 1)}; make them real (Object > Apply > Make Instances Real)"
        if name in meshes:
            reading.warnings.append(f"Object {name!r} {text}")
        elif name not in refused:
            reading.refused.append((name, text))
    lights = [obj.name for obj in visible if obj.type == "LIGHT"]
    if lights:
        reading.warnings.append(f"{some('Light', lights)} left out: use emissive materials instead")
    for obj in visible:
        if obj.type == "MESH" and len(obj.particle_systems):
            reading.warnings.append(f"Object {obj.name!r}: its particles are left out")


def _background(scene, depsgraph, reading):
    world = scene.world and scene.world.evaluated_get(depsgraph)
    background, warnings = read_world(world)
    reading.warnings += [f"World {world.name!r}: {text}" for text in warnings]
    return background


def some(what, names, most=3):
    """object 'A'; objects 'A', 'B', 'C' and 2 more"""
    listed = ", ".join(repr(name) for name in names[:most])
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{what}{'s' * (len(names) > 1)} {listed}{more}"
