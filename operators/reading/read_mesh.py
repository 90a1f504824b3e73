"""One mesh object, evaluated: its shapes, their materials, and how they lie on the base mesh that is baked."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ...pdm_core import Polygon
from .light_linking import is_linked
from .mesh_arrays import FLATTEST, Arrays
from .mesh_joined import Given
from .mesh_match import Baked, baked_of
from .mesh_outlines import PolygonShape
from .mesh_shapes import MeshShapes, find_all
from .mesh_topology import FLOAT32, NotRecognised

BEYOND = 1e15  # m; single precision overflows at 3e38, and the areas of shapes at the root of that


@dataclass(eq=False)
class RawMesh:
    """A mesh in the scene as copies, which need no Blender any more. name: the object's, or what tells an instance.

    arrays: Arrays of the evaluated mesh; materials: names or None, of_polygon (p,) indices into them; base: Arrays of
    the mesh that is baked, None where none is, for the reason; changed: what may have changed the mesh; apply: whether
    what it became is baked then; single_user: whether it gets a mesh of its own when it is baked.
    """

    name: str
    object: bpy.types.Object
    matrix: np.ndarray
    arrays: Arrays
    materials: list
    of_polygon: np.ndarray
    base: Arrays | None = None
    changed: str = ""
    reason: str = ""
    apply: bool = False
    single_user: bool = False
    warnings: list = field(default_factory=list)
    layers: object = None  # MeshLayers where its materials vary


@dataclass(eq=False)
class MeshObject:
    """A recognised RawMesh. shape_matrix (4, 4): of its shapes to the world; shape_materials: a material's name or None
    of each; base, baked: the mesh that is baked, as it is shown, and how it lies on the shapes; reason: why it cannot
    hold a bake, or ''."""

    raw: RawMesh
    shape_matrix: np.ndarray
    shapes: MeshShapes
    shape_materials: list
    base: Arrays | None = None
    baked: Baked | None = None
    is_applied: bool = False
    reason: str = ""
    warnings: list = field(default_factory=list)

    @property
    def name(self):
        return self.raw.name


def recognise_all(some, known, grids):
    """[MeshObject or NotRecognised] of RawMeshes, all at once; arrays alone. known: a dict kept over all calls, of what
    the same arrays are: copies, instances, primitives; grids: see find_sphere, likewise."""
    shown = _shown(some)
    keys = [_key(arrays, raw.of_polygon) for raw, (arrays, _) in zip(some, shown, strict=True)]
    new = {key: k for k, key in reversed(list(enumerate(keys))) if key not in known}
    for has_normals in (True, False):
        mine = [key for key, k in new.items() if (shown[k][0].normals is not None) == has_normals]
        found = find_all([_given(shown[new[key]][0], some[new[key]].of_polygon) for key in mine], grids)
        known |= {key: _sound(shapes) for key, shapes in zip(mine, found, strict=True)}
    return [_object(raw, matrix, known[key]) for raw, (_, matrix), key in zip(some, shown, keys, strict=True)]


def _shown(some):
    """[(Arrays, matrix)] of RawMeshes; what is scaled flat shows in the world only what it is."""
    scale = np.linalg.svd(np.array([raw.matrix[:3, :3] for raw in some]), compute_uv=False)
    flat = ~(scale[:, 2] > FLATTEST * scale[:, 0])
    return [
        (raw.arrays.flattened(raw.matrix), np.eye(4)) if is_flat else (raw.arrays, raw.matrix)
        for raw, is_flat in zip(some, flat.tolist(), strict=True)
    ]


def _key(arrays, materials):
    parts = arrays.vertices, arrays.corners, arrays.counts, materials, arrays.normals
    return tuple(None if part is None else part.tobytes() for part in parts)


def _given(arrays, materials):
    return Given(arrays.vertices, arrays.corners, arrays.counts, materials, arrays.triangles, arrays.normals)


def _sound(shapes):
    """The MeshShapes, outlines that cross themselves as meshes."""
    for k, shape in enumerate(getattr(shapes, "shapes", ())):
        if isinstance(shape, PolygonShape) and Polygon(shape.outline, shape.holes).problem:
            shapes.shapes[k] = shapes.as_mesh(k)
    return shapes


def _object(raw, matrix, shapes):
    """The MeshObject of a RawMesh that has these MeshShapes; or NotRecognised."""
    if isinstance(shapes, NotRecognised):
        return shapes
    found = MeshObject(raw, matrix, shapes, [raw.materials[k] for k in shapes.material.tolist()], raw.base)
    found.reason, found.warnings = raw.reason, raw.warnings + shapes.warnings
    if raw.reason:
        return found
    found.base, found.reason = _corresponding(raw)
    if not found.reason:
        found.baked = baked_of(found.base, raw.arrays, shapes)
        found.reason = "" if found.baked else f"has faces changed by {raw.changed}; apply or remove it"
    if found.reason and raw.apply:
        found.reason, found.is_applied, found.base = "", True, raw.arrays
        found.baked = baked_of(raw.arrays, raw.arrays, shapes)
    return found


def materials_of(evaluated, mesh, override=None):
    """(materials, of_polygon): a list of Material or None, each once, and the index (p,) into it. override: the one
    Material that a view layer shows all in."""
    slots = [override or slot.material for slot in evaluated.material_slots] or [override]
    names = [m and m.name_full for m in slots]
    first = np.array([names.index(name) for name in names])
    index = np.zeros(len(mesh.polygons), np.int32)
    if "material_index" in mesh.attributes:
        mesh.polygons.foreach_get("material_index", index)
    return slots, first[np.clip(index, 0, len(slots) - 1)]


def _corresponding(raw):
    """(Arrays, ''): the mesh that is baked, with its vertices where a render shows them: a pose, a wave, a lattice move
    them and leave the corners that colours are stored at. (base, reason) where they are none of the evaluated mesh."""
    made, base = raw.arrays, raw.base
    if base is made:
        return base, ""
    if len(base.vertices) == len(made.vertices):
        slack = 4 * FLOAT32 * np.abs(made.vertices).max()
        if (np.abs(base.vertices - made.vertices) <= slack).all():
            return base, ""
        if np.array_equal(base.corners, made.corners) and np.array_equal(base.counts, made.counts):
            return made, ""
    return base, f"has vertices moved, added or removed by {raw.changed}; apply or remove it"


def modifiers_of(obj):
    names = [f"modifier {modifier.name!r}" for modifier in obj.modifiers if modifier.show_viewport]
    if obj.data.shape_keys:
        names.append("its shape keys")
    if obj.parent_type in {"ARMATURE", "LATTICE"} and obj.parent:
        names.append(f"its parent {obj.parent.name!r}")
    return ", ".join(names) or "its modifiers"


def render_differences(obj):
    """Where a render shows what the evaluation for the viewport, which is read, does not."""
    names = [m.name for m in obj.modifiers if m.show_viewport != m.show_render]
    texts = [f"modifier {name!r} differs between viewport and render: the viewport's is read" for name in names]
    if not obj.visible_diffuse:
        texts.append("its Ray Visibility > Diffuse is off: it reflects, shines and hides the sky all the same")
    if not obj.visible_shadow:
        texts.append("its Ray Visibility > Shadow is off: it shades what lamps light all the same")
    if is_linked(obj):
        texts.append("its light linking is of what it emits: that lights all, and all blocks it; use a lamp instead")
    return texts
