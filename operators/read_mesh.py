"""One mesh object, evaluated: its shapes, their materials, and how they lie on the base mesh that is baked."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from .mesh_arrays import Arrays, arrays_of
from .mesh_match import Baked, baked_of
from .mesh_shapes import MeshShapes, find_shapes
from .mesh_topology import FLOAT32, NotRecognised

FLATTEST = 1e-7  # of a matrix's largest scale: single precision knows no smaller one
BEYOND = 1e15  # m; single precision overflows at 3e38, and the areas of shapes at the root of that


@dataclass(eq=False)
class MeshObject:
    """A recognised object. matrix (4, 4) to the world, shape_matrix that of its shapes; shape_materials: a material's
    name or None of each shape; baked: how the base mesh lies on the shapes; reason: why it cannot hold a bake, or ''.
    """

    object: bpy.types.Object
    matrix: np.ndarray
    shape_matrix: np.ndarray
    shapes: MeshShapes
    shape_materials: list
    baked: Baked | None
    reason: str = ""
    warnings: list = field(default_factory=list)


@dataclass(eq=False)
class RawMesh:
    """A mesh object's own data as copies, which need no Blender any more. arrays, base: Arrays of the evaluated mesh
    and of the one that is baked; materials: names or None, of_polygon (p,) indices into them; changed: what may have
    changed the mesh; reason: why it cannot hold a bake whatever it is, or ''."""

    object: bpy.types.Object
    matrix: np.ndarray
    arrays: Arrays
    base: Arrays
    materials: list
    of_polygon: np.ndarray
    changed: str
    reason: str
    warnings: list


def gather_mesh(obj, depsgraph):
    """The RawMesh of a mesh object, and its materials, [Material or None]; or NotRecognised."""
    evaluated = obj.evaluated_get(depsgraph)
    matrix = np.array(evaluated.matrix_world, np.float64)
    if not (np.abs(matrix) < BEYOND).all():
        raise NotRecognised("has a transform that is not finite or beyond all bounds; clear or repair it")
    mesh = evaluated.data
    arrays = arrays_of(mesh)
    if not (np.abs(arrays.vertices) < BEYOND).all():
        raise NotRecognised("has vertices that are not finite or beyond all bounds; delete or repair them")
    if not len(arrays.counts) and not len(obj.data.polygons):
        raise NotRecognised("has no faces")
    materials, of_polygon = _materials(evaluated, mesh)
    names = [material and material.name_full for material in materials]
    base, changed = arrays_of(obj.data), _modifiers(obj)
    raw = RawMesh(obj, matrix, arrays, base, names, of_polygon, changed, _unbakeable(obj), _render_differences(obj))
    return raw, materials


def recognise(raw, known):
    """The MeshObject of a RawMesh, or NotRecognised; arrays alone. known: a dict kept over all calls."""
    arrays, matrix = raw.arrays, raw.matrix
    if _is_singular(matrix):  # scaled flat: what it is shows in the world only
        arrays, matrix = arrays.flattened(matrix), np.eye(4)
    shapes = _find(arrays, raw.of_polygon, known)
    materials = [raw.materials[k] for k in shapes.material]
    warnings = raw.warnings + shapes.warnings
    found = MeshObject(raw.object, raw.matrix, matrix, shapes, materials, None, raw.reason, warnings)
    if not found.reason:
        found.reason = _compare(raw)
    if not found.reason:
        found.baked = baked_of(raw.base, raw.arrays, shapes)
        found.reason = "" if found.baked else f"has faces changed by {raw.changed}; apply or remove it"
    return found


def _find(arrays, materials, known):
    """find_shapes, once for all objects with the same arrays: copies, instances, primitives."""
    parts = arrays.vertices, arrays.corners, arrays.counts, materials, arrays.normals
    key = tuple(None if part is None else part.tobytes() for part in parts)
    if key not in known:
        vertices, corners, counts, materials, normals = parts
        try:
            known[key] = find_shapes(vertices, corners, counts, materials, known, arrays.triangles, normals)
        except NotRecognised as error:
            known[key] = error
    if isinstance(known[key], NotRecognised):
        raise known[key]
    return known[key]


def _is_singular(matrix):
    scale = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return not scale[2] > FLATTEST * scale[0]


def _materials(evaluated, mesh):
    """(materials, of_polygon): a list of Material or None, each once, and the index (p,) into it."""
    slots = [slot.material for slot in evaluated.material_slots] or [None]
    names = [m and m.name_full for m in slots]
    first = np.array([names.index(name) for name in names])
    index = np.zeros(len(mesh.polygons), np.int32)
    if "material_index" in mesh.attributes:
        mesh.polygons.foreach_get("material_index", index)
    return slots, first[np.clip(index, 0, len(slots) - 1)]


def _unbakeable(obj):
    mesh = obj.data
    if obj.library or mesh.library or not mesh.is_editable:
        return "is linked from a library; make it local"
    users = mesh.users - mesh.use_fake_user
    if users > 1:
        return f"shares its mesh with other users ({users} in all); make it a single-user copy"
    return ""


def _compare(raw):
    """Why the base mesh's vertices are not the evaluated ones, or ''."""
    vertices, base = raw.arrays.vertices, raw.base.vertices
    slack = 4 * FLOAT32 * np.abs(vertices).max()
    if base.shape != vertices.shape or not (np.abs(base - vertices) <= slack).all():
        return f"has vertices moved, added or removed by {raw.changed}; apply or remove it"
    return ""


def _modifiers(obj):
    names = [f"modifier {modifier.name!r}" for modifier in obj.modifiers if modifier.show_viewport]
    if obj.data.shape_keys:
        names.append("its shape keys")
    if obj.parent_type in {"ARMATURE", "LATTICE"} and obj.parent:
        names.append(f"its parent {obj.parent.name!r}")
    return ", ".join(names) or "its modifiers"


def _render_differences(obj):
    """Where a render shows what the evaluation for the viewport, which is read, does not."""
    names = [m.name for m in obj.modifiers if m.show_viewport != m.show_render]
    texts = [f"modifier {name!r} differs between viewport and render: the viewport's is read" for name in names]
    if not (obj.visible_diffuse and obj.visible_shadow):
        texts.append("its ray visibility is switched off: it lights and shades all the same")
    return texts
