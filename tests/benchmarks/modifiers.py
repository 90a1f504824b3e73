"""Each modifier that Blender lists under Generate and Deform, and each kind of instance: its light and its bake.

    PYTHON_WITH_BPY tests/benchmarks/modifiers.py [OUTPUT.json [PART_OF_A_NAME]]

light: the largest difference of the colours of a floor below it from those where the mesh that it leaves stands there
as a plain object, relative to their mean. bake: as it is; with Apply Modifiers or Make Single User on; by the button
that is offered for it. OUTPUT.json keeps one table for each version of Blender that has written to it, rows
made anew instead of those of before.
"""

import json
import sys
from pathlib import Path

import bpy
import numpy as np
from lights import extension
from mathutils import Matrix
from output import ROOT, machine, save

sys.path.insert(0, str(ROOT / "tests" / "blender"))
import modified  # noqa: E402
import scenes  # noqa: E402

TARGET = 0.2  # the same shapes are solved alike
FINER = 0.05  # for instances, which are taken in another order


def sky():
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    bpy.context.scene.world = world


def floor():
    return scenes.grid("Floor", 8, 4.0, Matrix.Translation((0, 0, -1.2)), scenes.material("Floor"))


def baked(target=TARGET, **settings):
    """(colours (n, 3) of the floor, the report)"""
    bpy.ops.pdm.bake(target_error=target, domain="POINT", **settings)
    return scenes.colours(bpy.data.objects["Floor"])[:, :3], bpy.context.scene.pdm_radiosity.report()


def of(report, name):
    found = [entry for entry in report["objects"] if entry["name"] == name]
    return found[0] if found else None


def difference(one, other):
    return float(np.abs(one - other).max() / other.mean())


def modifier_row(group, kind):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    obj = modified.modified(kind)
    floor(), sky()
    colours, report = baked()
    entry = of(report, kind)
    state = "as it is" if entry["baked"] else ""
    copy = modified.evaluated_copy(obj)
    reference, _ = baked()
    bpy.data.objects.remove(copy)
    obj.hide_render = False
    if not state:
        _, after = baked(apply_modifiers=True)
        state = "Apply Modifiers" if of(after, kind)["baked"] and not obj.modifiers else "NOT"
    return {
        "what": kind,
        "group": group,
        "label": entry["label"],
        "light": difference(colours, reference),
        "bake": state,
    }


def alt_d():
    first = scenes.box("Thing", 1.0, Matrix.Translation((-0.8, 0, 0)), scenes.material("Grey"))
    other = bpy.data.objects.new("Other", first.data)
    other.matrix_world = Matrix.Translation((0.8, 0, 0))
    bpy.context.collection.objects.link(other)
    return "Other"


def collection_instance():
    inner = bpy.data.collections.new("Inner")
    thing = scenes.box("Thing", 1.0, made_of=scenes.material("Grey"))
    bpy.context.collection.objects.unlink(thing)
    inner.objects.link(thing)
    empty = bpy.data.objects.new("Instancer", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", inner
    bpy.context.collection.objects.link(empty)
    return "Thing (instance 1)"


def nodes_instances():
    obj = scenes.grid("Thing", 1, 2.0, made_of=scenes.material("Grey"))
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeMeshCube", "NodeGroupOutput")
    first, points, cube, last = (group.nodes.new(kind) for kind in kinds)
    cube.inputs["Size"].default_value = (0.4, 0.4, 0.4)
    for start, end in ((first, points.inputs["Points"]), (cube, points.inputs["Instance"]), (points, last.inputs[0])):
        group.links.new(start.outputs[0], end)
    obj.modifiers.new("Scatter", "NODES").node_group = group
    return "Thing (instance 1)"


def particles():
    ball = scenes.sphere("Thing", radius=0.2, matrix=Matrix.Translation((0, 0, 30)), made_of=scenes.material("Grey"))
    plate = scenes.grid("Plate", 3, 2.0, Matrix.Translation((0, 0, -0.5)))
    bpy.context.view_layer.objects.active = plate
    bpy.ops.object.particle_system_add()
    made = plate.particle_systems[0].settings
    made.type, made.count, made.render_type, made.instance_object = "HAIR", 8, "OBJECT", ball
    return "Thing (instance 1)"


def faces():
    plate, child = scenes.grid("Plate", 2, 2.0), scenes.box("Thing", 0.2, made_of=scenes.material("Grey"))
    child.parent, plate.instance_type = plate, "FACES"
    return "Thing (instance 1)"


def curve():
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.2
    bpy.context.object.name = "Thing"
    return "Thing"


def text():
    bpy.ops.object.text_add()
    bpy.context.object.name = "Thing"
    return "Thing"


def surface():
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.context.object.name = "Thing"
    return "Thing"


def metaballs():
    bpy.ops.object.metaball_add()
    bpy.context.object.name = "Thing"
    return "Thing"


def _library():
    path = str(Path(bpy.app.tempdir) / "library.blend")
    thing = scenes.box("Thing", 1.0, made_of=scenes.material("Grey"))
    bpy.data.libraries.write(path, {thing})
    bpy.data.objects.remove(thing)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Thing"]
    bpy.context.collection.objects.link(wanted.objects[0])
    return wanted.objects[0]


def library():
    return _library().name


def override():
    return _library().override_create(remap_local_usages=True).name


KINDS = {
    "Alt+D": alt_d, "collection instance": collection_instance, "geometry nodes instances": nodes_instances,
    "particles of objects": particles, "instances on faces": faces, "curve": curve, "text": text, "surface": surface,
    "metaball": metaballs, "linked library": library, "library override": override,
}  # fmt: skip


def mended(name):
    """The button offered for an object, once pressed; NOT where what was there is not baked then."""
    bpy.ops.pdm.scan()
    item = next(item for item in bpy.context.scene.pdm_radiosity.listed if item.name == name)
    if not item.mend:
        return "NOT"
    way = item.mend
    bpy.ops.pdm.mend(object=name, way=way)
    bpy.context.view_layer.update()
    _, report = baked(make_single_user=True)
    base = name.split(" (instance")[0]
    done = [entry for entry in report["objects"] if entry["name"].split(".")[0] == base]
    return f"button: {way}" if done and all(entry["baked"] for entry in done) else "NOT"


def instance_row(what, make):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    name = make()
    floor(), sky()
    bpy.context.view_layer.update()
    colours, report = baked(FINER)
    entry = of(report, name)
    label, state = entry["label"], "as it is" if entry["baked"] else ""
    reference, _ = baked_plain()
    if not state and "shares its mesh" in entry["reason"]:
        _, after = baked(make_single_user=True)
        state = "Make Single User" if of(after, name)["baked"] else "NOT"
    return {"what": what, "group": "Instances", "label": label, "light": difference(colours, reference),
            "bake": state or mended(name)}  # fmt: skip


def baked_plain():
    """The same in a scene of plain meshes alone, copied by bmesh from all that the depsgraph shows but what a render
    does not: the children of an instancer on faces, which it shows at the instances alone."""
    graph, made = bpy.context.evaluated_depsgraph_get(), []
    for each in graph.object_instances:
        obj = each.object
        if not each.is_instance and obj.parent is not None and obj.parent.instance_type == "FACES":
            continue
        if obj.type == "MESH" and obj.name != "Floor" and not obj.original.hide_render and each.show_self:
            mesh, work = bpy.data.meshes.new("Plain"), scenes.bmesh.new()
            work.from_mesh(obj.data)
            work.to_mesh(mesh)
            work.free()
            if len(mesh.polygons):
                slots = [slot.material for slot in obj.material_slots]
                mesh.materials.append(slots[0].original if slots and slots[0] else None)
                made.append((mesh, each.matrix_world.copy()))
    old = [obj for obj in bpy.context.scene.objects if obj.name != "Floor" and not obj.hide_render]
    for obj in old:
        obj.hide_render = True
    copies = []
    for mesh, matrix in made:
        copy = bpy.data.objects.new("Plain", mesh)
        copy.matrix_world = matrix
        bpy.context.scene.collection.objects.link(copy)
        copies.append(copy)
    bpy.context.view_layer.update()
    found = baked(FINER)
    for copy in copies:
        bpy.data.objects.remove(copy)
    for obj in old:
        obj.hide_render = False
    bpy.context.view_layer.update()
    return found


def tell(row):
    print("{what:26} {label:40} {light:9.2%}  {bake}".format(**row), flush=True)


def main(output=None, part=""):
    extension()
    sys.modules["pdm_extension"].register()
    rows, version = [], ".".join(map(str, bpy.app.version[:2]))
    cases = [(kind, lambda g=group, k=kind: modifier_row(g, k)) for group, kind in modified.listed()]
    cases += [(what, lambda w=what, m=make: instance_row(w, m)) for what, make in KINDS.items()]
    try:
        for what, row in cases:
            if part in what:
                rows.append(row())
                tell(rows[-1])
    finally:
        sys.modules["pdm_extension"].unregister()
    if output:
        tables = json.loads(Path(output).read_text())["tables"] if Path(output).exists() else {}
        rows = list({row["what"]: row for row in [*tables.get(version, []), *rows]}.values())
        save(output, {"machine": machine(), "targets": [TARGET, FINER], "tables": {**tables, version: rows}})


if __name__ == "__main__":
    main(*sys.argv[1:])
