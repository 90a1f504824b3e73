"""One object for each modifier that Blender lists under Generate and Deform, and for each kind of instance."""

import bmesh
import bpy
import numpy as np
import scenes
from mathutils import Matrix

GROUPS = {"Generate": "ARRAY", "Deform": "ARMATURE"}  # by one that is in it
NOT_OF_MESHES = {"MESH_TO_VOLUME", "VOLUME_DISPLACE", "LINEART"}  # but of volumes, and of grease pencil


def listed():
    """[(group, modifier type)] as this Blender lists them, those of meshes."""
    groups, group = [], []
    for item in bpy.types.Modifier.bl_rna.properties["type"].enum_items_static_ui:
        if item.identifier:
            group.append(item.identifier)
        else:
            groups.append(group)
            group = []
    groups.append(group)
    return [
        (name, kind)
        for name, member in GROUPS.items()
        for kind in next(group for group in groups if member in group)
        if kind not in NOT_OF_MESHES and not kind.startswith("GREASE_PENCIL")
    ]


def _helper(obj, at):
    """One that a render does not show."""
    obj.matrix_world = at @ obj.matrix_world
    obj.hide_render = True
    return obj


def _link(name, data):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _run(operator, obj, **words):
    bpy.context.view_layer.update()
    with bpy.context.temp_override(object=obj, active_object=obj, selected_objects=[obj]):
        assert operator(**words) == {"FINISHED"}


def _group(obj, name, vertices):
    obj.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    return name


def _boolean(obj, modifier, at):
    modifier.object = _helper(scenes.box("Cutter", 0.8, Matrix.Translation((0.4, 0.4, 0.4))), at)


def _nodes(obj, modifier, at):
    group = bpy.data.node_groups.new("Finer", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeSubdivideMesh", "NodeGroupOutput")
    first, finer, last = (group.nodes.new(kind) for kind in kinds)
    group.links.new(first.outputs[0], finer.inputs[0])
    group.links.new(finer.outputs[0], last.inputs[0])
    modifier.node_group = group


def _mask(obj, modifier, at):
    modifier.vertex_group = _group(obj, "Kept", list(range(len(obj.data.vertices) // 2)))


def _build(obj, modifier, at):
    modifier.frame_start, modifier.frame_duration = 0, 4  # frame 1: a quarter of the faces


def _volume(obj, modifier, at):
    ball = _helper(scenes.sphere("Filled", radius=0.5), at)
    volume = _link("Volume", bpy.data.volumes.new("Volume"))
    volume.hide_render = True
    made = volume.modifiers.new("Volume", "MESH_TO_VOLUME")
    made.object, made.voxel_amount = ball, 16
    modifier.object = volume


def _line(obj, x):
    def line(b):
        ends = [b.verts.new((x, 0, z)) for z in (-0.5, 0, 0.5)]
        for pair in zip(ends[:-1], ends[1:], strict=True):
            b.edges.new(pair)

    scenes.rebuild(obj, line)


def _screw(obj, modifier, at):
    _line(obj, 0.5)


def _skin(obj, modifier, at):
    _line(obj, 0.0)
    obj.modifiers.remove(modifier)
    obj.modifiers.new("Skin", "SKIN")


def _armature(obj, modifier, at):
    rig = _link("Rig", bpy.data.armatures.new("Rig"))
    rig.matrix_world = at
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones.new("Bone")
    bone.head, bone.tail = (0, 0, -0.5), (0, 0, 0.5)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["Bone"].location = (0.1, 0.2, 0)
    _group(obj, "Bone", list(range(len(obj.data.vertices) // 2)))
    modifier.object = rig


def _curve(obj, modifier, at):
    bpy.ops.curve.primitive_bezier_curve_add()
    modifier.object = _helper(bpy.context.object, at)


def _lattice(obj, modifier, at):
    lattice = _helper(_link("Lattice", bpy.data.lattices.new("Lattice")), at)
    lattice.data.points[0].co_deform.x -= 0.4
    modifier.object = lattice


def _hook(obj, modifier, at):
    empty = _link("Hook", None)
    empty.matrix_world = at @ Matrix.Translation((0.2, 0, 0))
    modifier.object, modifier.matrix_inverse = empty, at.inverted()
    modifier.vertex_group = _group(obj, "Hooked", list(range(10)))


def _laplacian(obj, modifier, at):
    modifier.vertex_group = _group(obj, "Anchors", list(range(0, len(obj.data.vertices), 3)))
    _run(bpy.ops.object.laplaciandeform_bind, obj, modifier=modifier.name)
    obj.data.vertices[0].co.z += 0.3


def _cage(obj, modifier, at):
    cage = _helper(scenes.box("Cage", 3.0), at)
    modifier.object, modifier.precision = cage, 3
    _run(bpy.ops.object.meshdeform_bind, obj, modifier=modifier.name)
    cage.data.vertices[0].co *= 1.5


def _surface(obj, modifier, at):
    target = _helper(scenes.grid("Under", 4, 3.0, Matrix.Translation((0, 0, -1))), at)
    modifier.target = target
    _run(bpy.ops.object.surfacedeform_bind, obj, modifier=modifier.name)
    for vertex in target.data.vertices:
        vertex.co.z += 0.3 * vertex.co.x


def _shrink(obj, modifier, at):
    modifier.target = _helper(scenes.sphere("Target", radius=0.4), at)


def _warp(obj, modifier, at):
    start, end = (_link(name, None) for name in ("From", "To"))
    start.matrix_world, end.matrix_world = at, at @ Matrix.Translation((0.2, 0.1, 0.1))
    modifier.object_from, modifier.object_to = start, end


def _multires(obj, modifier, at):
    _run(bpy.ops.object.multires_subdivide, obj, modifier=modifier.name)


SET_UP = {
    "BOOLEAN": _boolean, "NODES": _nodes, "MASK": _mask, "BUILD": _build, "VOLUME_TO_MESH": _volume,
    "SKIN": _skin, "SCREW": _screw,
    "ARMATURE": _armature, "CURVE": _curve, "LATTICE": _lattice, "HOOK": _hook, "LAPLACIANDEFORM": _laplacian,
    "MESH_DEFORM": _cage, "SURFACE_DEFORM": _surface, "SHRINKWRAP": _shrink, "WARP": _warp, "MULTIRES": _multires,
}  # fmt: skip
SETTINGS = {
    "ARRAY": {"count": 3, "use_constant_offset": True, "constant_offset_displace": (0.2, 0, 0)},
    "BEVEL": {"width": 0.02},
    "DECIMATE": {"ratio": 0.5},
    "REMESH": {"voxel_size": 0.2},
    "SCREW": {"steps": 8, "render_steps": 8},
    "SOLIDIFY": {"thickness": 0.1},
    "WELD": {"merge_threshold": 0.3},
    "WIREFRAME": {"thickness": 0.05},
    "CAST": {"factor": 0.5},
    "DISPLACE": {"strength": 0.2},
    "SIMPLE_DEFORM": {"deform_method": "BEND", "angle": 0.7},
    "SMOOTH": {"factor": 0.5, "iterations": 3},
    "CORRECTIVE_SMOOTH": {"factor": 0.5, "iterations": 3, "use_only_smooth": True},
    "LAPLACIANSMOOTH": {"lambda_factor": 0.5, "iterations": 2},
    "WAVE": {"height": 0.2, "time_offset": -50},
    "MIRROR": {"use_axis": (False, False, True)},
}


def modified(kind, at=None):
    """An object with a modifier that changes it: a box of fine faces; half of one where it is mirrored, its sides apart
    where they are welded."""
    at = at or Matrix()
    obj = scenes.box(kind, 1.0, at, scenes.material("Grey"))
    lower = kind in {"MIRROR", "EDGE_SPLIT"}

    def build(b):
        bmesh.ops.create_cube(b, size=1.0, matrix=Matrix.Translation((0, 0, 0.5 if lower else 0)))
        bmesh.ops.subdivide_edges(b, edges=b.edges, cuts=3, use_grid_fill=True)
        if kind == "WELD":
            bmesh.ops.split_edges(b, edges=b.edges)

    scenes.rebuild(obj, build)
    obj.data.materials.append(scenes.material("Grey"))
    modifier = obj.modifiers.new(kind.title(), kind)
    for name, value in SETTINGS.get(kind, {}).items():
        setattr(modifier, name, value)
    bpy.context.view_layer.update()
    if kind in SET_UP:
        SET_UP[kind](obj, modifier, at)
    bpy.context.view_layer.update()
    return obj


def evaluated_copy(obj):
    """A plain object of the mesh that modifiers leave, in place of the object, which a render shows no more."""
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph)
    copy = _link(f"{obj.name} applied", mesh)
    copy.matrix_world = obj.matrix_world
    obj.hide_render = True
    bpy.context.view_layer.update()
    return copy


def shapes_of(reading, names):
    """(n, 5) sorted: area, centre and kind of the surfaces of the objects with these names."""
    rows = []
    for found in reading.objects:
        if found.name in names or found.name.split(" (instance")[0] in names:
            for k in found.surfaces:
                shape = reading.scene.surfaces[k].shape
                at = shape.vertices.mean(axis=0) if hasattr(shape, "vertices") else shape.bounds[0]
                rows.append([shape.area, *at, float(len(type(shape).__name__))])
    rows = np.round(np.array(rows), 5)
    return rows[np.lexsort(rows.T[::-1])]
