"""Blender's scene as a pdm_core.Scene: every render-visible mesh object becomes surfaces or is refused aloud."""

from dataclasses import dataclass, field
from itertools import pairwise

import bpy
import numpy as np

from ...pdm_core import Scene, SceneError
from ...pdm_core.at_once import AT_ONCE
from ...pdm_core.checked import some_of
from ...pdm_core.shapes.shape import unit
from ...pdm_core.signs_of_life import finish, in_thread, mapped
from ...pdm_core.tolerances import SINGLE
from .accept_pieces import accept_pieces
from .hidden_sides import surfaces_of
from .light_linking import link
from .looks_on_meshes import looks_on, settle_pictures
from .materials import BACK, FRONT, read_material
from .mesh_arrays import Arrays, in_world
from .mesh_shapes import MeshShape
from .mesh_topology import NotRecognised
from .read_lights import read_lights
from .read_mesh import recognise_all
from .read_objects import gather_steps
from .read_surfaces import pieces_of, turning_normals
from .read_world import world_steps
from .render_visible import evaluated, render_visible, world_of
from .undisturbed import undisturbed

LARGE = 20_000  # corners, from which on a mesh's sides are told apart in one, too


@dataclass(eq=False)
class ReadObject:
    """A recognised object, which takes part in the light.

    kind and label: MeshShapes'; exactness 'exact' or 'approximate', where a part is no sphere, plane or polygon;
    surfaces: its indices into Scene.surfaces; matrix (4, 4) float64 to the world; bakeable, or the reason why not.
    corner_surface (c,), triangle_surface (t,): the surface that each corner and triangle of the base mesh faces along
    its normal, where it is bakeable; corner_normals (c, 3) with which corners are shaded and middles (c, 3) m in the
    face that each belongs to, in the world, where it is approximate. base: Arrays of the mesh that is baked;
    is_applied, is_single_user: whether that is what its modifiers made, or a copy for itself.
    """

    object: bpy.types.Object
    name: str
    kind: str
    label: str
    surfaces: list
    matrix: np.ndarray
    bakeable: bool
    reason: str
    exactness: str = "exact"
    base: Arrays | None = None
    is_applied: bool = False
    is_single_user: bool = False
    corner_surface: np.ndarray | None = None
    triangle_surface: np.ndarray | None = None
    corner_normals: np.ndarray | None = None
    middles: np.ndarray | None = None

    @property
    def polygon_surface(self):
        """(p,) the surface of the first corner of each polygon of the base mesh."""
        return self.corner_surface[np.cumsum(self.base.counts) - self.base.counts]


@dataclass(eq=False)
class Reading:
    """scene: a pdm_core.Scene, None where nothing is recognised; objects: [ReadObject]; refused: [(name, reason)],
    left out of the light; warnings: [sentence]; hidden: how many mesh objects a render does not show; lights: [(name,
    Blender's type)] of all that shine; materials: [(name or None, FRONT or BACK)] of the scene's surfaces."""

    scene: Scene | None
    objects: list = field(default_factory=list)
    refused: list = field(default_factory=list)
    warnings: list = field(default_factory=list)
    hidden: int = 0
    lights: list = field(default_factory=list)
    materials: list = field(default_factory=list)


def read_scene(context, objects="ALL", baked=(), **own_meshes):
    """The Reading at once, see read_steps."""
    return finish(read_steps(context, objects, baked, **own_meshes))


def read_steps(context, objects="ALL", baked=(), make_single_user=False, apply_modifiers=False):
    """Generator of the fraction done; returns the Reading of the context's scene and view layer.

    objects, 'ALL', 'SELECTED' or names, limits what is bakeable and never what lights: every recognised object that a
    render shows takes part in the light. baked: names of colour attributes that hold bakes, which are no light.
    make_single_user, apply_modifiers: what such an object needs is bakeable, and gets a mesh of its own.
    SceneError where a name is missing or a visible object is in Edit Mode.
    """
    baked = frozenset(baked)
    is_hidden = any(not obj.visible_get() for obj in render_visible(context.view_layer))
    steps = undisturbed(  # what is hidden is shown meanwhile: no other hand may come between
        lambda: _gather_steps(context, objects, baked, make_single_user, apply_modifiers), at_once=is_hidden
    )
    reading, gathered, lamps, wanted = yield from mapped(steps, lambda _: 0.0)
    background, suns = yield from _background(world_of(context.scene, context.view_layer), reading)
    is_lit = callable(background) or np.any(background) or bool(lamps.lights or suns)
    settle_pictures(gathered.looks, is_lit)
    found = yield from _recognise(gathered.raw, reading)
    steps = in_thread(lambda: accept_pieces(_pieces(found, gathered.looks, baked, reading), SINGLE))
    accepted = yield from mapped(steps, lambda _: 1.0)
    reading.refused += accepted.refused
    reading.warnings += [f"Object {mesh.name!r}: {text}" for mesh, _ in accepted.taken for text in mesh.warnings]
    reading.warnings += accepted.warnings
    link(lamps, accepted)
    reading.scene, sides = yield from mapped(
        in_thread(_scene_of, accepted.pieces, background, [*lamps.lights, *suns]), lambda _: 1.0
    )
    reading.materials = [
        (piece.material, look) for piece, own in zip(accepted.pieces, sides) for look in (FRONT, BACK)[: len(own)]
    ]
    for (mesh, _), place in zip(accepted.taken, accepted.place, strict=True):
        own, is_wanted = [sides[k] for k in place], mesh.raw.object in wanted
        if len(mesh.raw.arrays.corners) < LARGE:
            read = _read_object(mesh, own, is_wanted)
        else:
            read = yield from mapped(in_thread(_read_object, mesh, own, is_wanted), lambda _: 1.0)
        reading.objects.append(read)
        yield 1.0
    return reading


def _gather_steps(context, objects, baked, make_single_user, apply_modifiers):
    """Generator; returns the Reading so far, Gathered, ReadLights and the set of objects to bake."""
    view_layer, images = context.view_layer, {}
    visible = render_visible(view_layer)
    meshes = [obj for obj in visible if obj.type == "MESH"]
    wanted = _wanted(view_layer, meshes, objects)
    editing = [repr(obj.name) for obj in meshes if obj.data.is_editmode]
    if editing:
        raise SceneError(f"Object {', '.join(editing)} is in Edit Mode; switch to Object Mode first")
    with evaluated(context, visible) as depsgraph:
        gathered = yield from gather_steps(
            visible,
            wanted,
            depsgraph,
            lambda material: read_material(material, baked, images),
            make_single_user,
            apply_modifiers,
        )
        hidden = sum(obj.type == "MESH" for obj in view_layer.objects) - len(meshes)
        reading = Reading(None, [], gathered.refused, gathered.warnings, hidden)
        lamps = _lamps(visible, depsgraph, reading)
        _film(context.scene, reading)
    return reading, gathered, lamps, wanted


def _scene_of(pieces, background, lights):
    """The Scene of [Piece], None where there is none, and the indices of each one's surfaces."""
    surfaces, indices = surfaces_of(pieces, lights)
    return Scene(surfaces, background, rounding=SINGLE, lights=lights) if surfaces else None, indices


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


def _recognise(raw, reading):
    """Generator of the fraction done; returns [MeshObject] of the recognised; the others go to reading.refused."""
    found, known, grids, done = [], {}, {}, 0
    total = max(sum(len(mesh.arrays.corners) for mesh in raw), 1)
    for some in _batches(raw):
        objects = yield from mapped(in_thread(recognise_all, some, known, grids), lambda _, at=done: at / total)
        for mesh, read in zip(some, objects, strict=True):
            if isinstance(read, NotRecognised):
                reading.refused.append((mesh.name, str(read)))
            else:
                found.append(read)
        done += sum(len(mesh.arrays.corners) for mesh in some)
    return found


def _batches(raw):
    """[[RawMesh]] of some AT_ONCE corners each, in order: a thread gives signs of life meanwhile."""
    number = np.cumsum([len(mesh.arrays.corners) for mesh in raw]) // AT_ONCE
    begin = np.flatnonzero(np.diff(number, prepend=-1)).tolist()
    return [raw[first:last] for first, last in pairwise([*begin, len(raw)])]


def _pieces(found, looks, baked, reading):
    """[(MeshObject, [Piece])]; objects whose shapes the core refuses go to reading.refused."""
    users, taken = {}, []
    for mesh in found:
        for name in mesh.shape_materials:
            users.setdefault(name, {})[mesh.name] = None
        own = looks_on(mesh, looks, baked)
        if all(look.absent for look in own):
            reading.refused.append((mesh.name, f"{own[0].absent} and takes no part in this light"))
            continue
        pieces = pieces_of(mesh.name, mesh.shape_matrix, mesh.shapes, own, mesh.shape_materials)
        problems = [problem for piece in pieces if (problem := piece.shape.problem)]
        if problems:
            reading.refused.append((mesh.name, problems[0]))
        else:
            taken.append((mesh, pieces))
    for key, names in users.items():
        texts = looks[key].warnings
        reading.warnings += [f"Material {key!r} ({some('object', list(names))}): {text}" for text in texts]
    return taken


def _read_object(mesh, indices, is_wanted):
    reason = mesh.reason or ("" if is_wanted else "is not among the objects to bake")
    read = ReadObject(
        object=mesh.raw.object,
        name=mesh.name,
        kind=mesh.shapes.kind,
        label=mesh.shapes.label,
        surfaces=[index for sides in indices for index in sides],
        matrix=mesh.raw.matrix,
        bakeable=not reason,
        reason=reason,
        exactness=mesh.shapes.exactness,
        base=mesh.base,
        is_applied=mesh.is_applied,
        is_single_user=mesh.raw.single_user,
    )
    if mesh.baked:
        side = np.array([(sides[0], sides[-1]) for sides in indices]).ravel()
        baked = mesh.baked
        read.corner_surface = side.take(2 * baked.corner_shape + baked.corner_back)
        read.triangle_surface = side.take(2 * baked.triangle_shape + baked.triangle_back)
        if baked.normals is not None:
            is_mesh = np.array([isinstance(shape, MeshShape) for shape in mesh.shapes.shapes])
            read.corner_normals = unit(baked.normals @ turning_normals(mesh.raw.matrix[:3, :3]).T)
            if not is_mesh.all():
                read.corner_normals[~is_mesh[baked.corner_shape]] = 0.0  # what is exact has its own
            read.middles = in_world(mesh.raw.matrix, baked.middles)
    return read


def _lamps(visible, depsgraph, reading):
    """The ReadLights of the scene's lamps."""
    found = read_lights(visible, depsgraph)
    reading.warnings += [f"{some('Light', names)} {text}" for text, names in found.told.items()]
    reading.lights += [(light.name, kind) for light, kind in zip(found.lights, found.kinds, strict=True)]
    return found


def _film(scene, reading):
    """Says what Cycles' film does to renders and to its own bakes: it is no light."""
    cycles = getattr(scene, "cycles", None)  # an add-on
    exposure = cycles.film_exposure if cycles and scene.render.engine == "CYCLES" else 1.0
    if abs(exposure - 1) > SINGLE:
        text = f"its Film > Exposure of {exposure:.3g} is not baked: renders with Cycles show these colours times it"
        advice = f"set the bake's Exposure to {np.log2(exposure):.2f} to bake it too" if exposure > 0 else "raise it"
        reading.warnings.append(f"Scene {scene.name!r}: {text}; {advice}")


def _background(world, reading):
    """Generator of the fraction done; returns the background of a Scene, and the suns of its world [SunLight]."""
    found = yield from mapped(world_steps(world), lambda _: 0.0)
    reading.warnings += [f"World {world.name!r}: {text}" for text in found.warnings]
    reading.lights += [(sun.name, "SUN") for sun in found.suns]
    return found.background, found.suns


def some(what, names):
    """object 'A'; objects 'A', 'B', 'C' and 2 more"""
    return f"{what}{'s' * (len(names) > 1)} {some_of(list(map(repr, names)))}"
