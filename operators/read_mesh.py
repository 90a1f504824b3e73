"""One mesh object, evaluated: its shapes, their materials, and how they lie on the base mesh that is baked."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from .mesh_shapes import MeshShapes, find_shapes
from .mesh_topology import FLOAT32, NotRecognised

BEYOND = 1e15  # m; single precision overflows at 3e38, and the areas of shapes at the root of that


@dataclass(eq=False)
class MeshObject:
    """A recognised object. matrix (4, 4) to the world; shape_materials: a material's name or None of each shape;
    polygon_shape (p,): the shape of each polygon of the base mesh; reason: why it cannot hold a bake, or ''."""

    object: bpy.types.Object
    matrix: np.ndarray
    shapes: MeshShapes
    shape_materials: list
    polygon_shape: np.ndarray
    reason: str = ""
    warnings: list = field(default_factory=list)
    layers: object = None  # MeshLayers where its materials vary


@dataclass(eq=False)
class RawMesh:
    """A mesh object's own data as copies, which need no Blender any more. arrays, base: vertices, corners, counts of
    the evaluated mesh and of the one that is baked; materials: names or None, of_polygon (p,) indices into them;
    changed: what may have changed the mesh; reason: why it cannot hold a bake whatever it is, or ''."""

    object: bpy.types.Object
    matrix: np.ndarray
    arrays: tuple
    base: tuple
    materials: list
    of_polygon: np.ndarray
    changed: str
    reason: str
    warnings: list
    layers: object = None  # MeshLayers where its materials vary


def gather_mesh(obj, depsgraph):
    """The RawMesh of a mesh object, and its materials, [Material or None]; or NotRecognised."""
    evaluated = obj.evaluated_get(depsgraph)
    matrix = np.array(evaluated.matrix_world, np.float64)
    if not (np.abs(matrix) < BEYOND).all():
        raise NotRecognised("has a transform that is not finite or beyond all bounds; clear or repair it")
    mesh = evaluated.data
    arrays = _arrays(mesh)
    if not (np.abs(arrays[0]) < BEYOND).all():
        raise NotRecognised("has vertices that are not finite or beyond all bounds; delete or repair them")
    if not len(arrays[2]) and not len(obj.data.polygons):
        raise NotRecognised("has no faces")
    materials, of_polygon = _materials(evaluated, mesh)
    names = [material and material.name_full for material in materials]
    base, changed = _arrays(obj.data), _modifiers(obj)
    raw = RawMesh(obj, matrix, arrays, base, names, of_polygon, changed, _unbakeable(obj), _render_differences(obj))
    return raw, materials


def recognise(raw, grids):
    """The MeshObject of a RawMesh, or NotRecognised; arrays alone. grids: a dict kept over all calls: find_sphere."""
    shapes = find_shapes(*raw.arrays, raw.of_polygon, grids)
    shape_materials = [None] * len(shapes.shapes)
    for shape, first in zip(*np.unique(shapes.polygon_shape, return_index=True)):
        shape_materials[shape] = raw.materials[raw.of_polygon[first]]
    found = MeshObject(raw.object, raw.matrix, shapes, shape_materials, shapes.polygon_shape, warnings=raw.warnings)
    found.reason, found.layers = raw.reason or _compare(raw, found), raw.layers
    return found


def _arrays(mesh):
    """vertices (n, 3) float32, corners (c,), counts (p,) of a Mesh."""
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    corners = np.empty(len(mesh.loops), np.int32)
    if len(corners):
        mesh.attributes[".corner_vert"].data.foreach_get("value", corners)  # 30 times faster than mesh.loops
    counts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", counts)
    return vertices.reshape(-1, 3), corners, counts


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


def _compare(raw, found):
    """Fits found.polygon_shape to the base mesh's polygons; returns why that cannot be done, or ''."""
    (vertices, corners, counts), base = raw.arrays, raw.base
    slack = 4 * FLOAT32 * np.abs(vertices).max()
    if base[0].shape != vertices.shape or not (np.abs(base[0] - vertices) <= slack).all():
        return f"has vertices moved, added or removed by {raw.changed}; apply or remove it"
    if np.array_equal(base[1], corners) and np.array_equal(base[2], counts):
        return ""
    number = _shape_of_polygons(base, corners, counts, found.shapes)
    if number is None:
        return f"has faces changed by {raw.changed}; apply or remove it"
    found.polygon_shape = number
    return ""


def _shape_of_polygons(base, corners, counts, shapes):
    """(p,) for the base mesh's polygons, where the same vertices make the same shapes facing the same way, or None."""
    try:
        found = find_shapes(*base)
    except NotRecognised:
        return None
    theirs = [set(_members(corners, counts, shapes, k)) for k in range(len(shapes.shapes))]
    number = np.full(len(found.shapes), -1)
    for k, shape in enumerate(found.shapes):
        members = set(_members(base[1], base[2], found, k))
        same = [i for i, other in enumerate(theirs) if other == members and _same_side(shape, shapes.shapes[i])]
        if len(same) != 1:
            return None
        number[k] = same[0]
    return number[found.polygon_shape]


def _members(corners, counts, shapes, k):
    return corners[np.repeat(shapes.polygon_shape == k, counts)].tolist()


def _same_side(a, b):
    if type(a) is not type(b):
        return False
    if hasattr(a, "is_outward"):
        return a.is_outward == b.is_outward
    return np.cross(a.u, a.v) @ np.cross(b.u, b.v) > 0


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
