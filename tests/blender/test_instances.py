"""What makes copies of a mesh, or has one only when evaluated: all of it lights, each as itself."""

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix


@pytest.fixture
def read(addon):
    module = addon("operators.reading.read_scene")
    return lambda objects="ALL", **own_meshes: module.read_scene(bpy.context, objects, **own_meshes)


def labels(reading):
    return {o.name: o.label for o in reading.objects}


def collection_of(*objects):
    inner = bpy.data.collections.new("Inner")
    for obj in objects:
        for old in list(obj.users_collection):
            old.objects.unlink(obj)
        inner.objects.link(obj)
    return inner


def instancer(name, collection, matrix):
    empty = bpy.data.objects.new(name, None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    empty.matrix_world = matrix
    bpy.context.collection.objects.link(empty)
    return empty


def test_collection_instances_light_at_their_places(read):
    inner = collection_of(scenes.grid("Inside"), scenes.sphere("Ball", matrix=Matrix.Translation((0, 0, 2))))
    instancer("A", inner, Matrix.Translation((5, 0, 0)))
    instancer("B", inner, Matrix.Translation((0, 5, 0)) @ Matrix.Diagonal((2, 2, 2, 1)))
    scenes.grid("Floor")
    reading = read()
    assert reading.refused == []
    assert labels(reading) == {
        "Floor": "plane",
        "Inside (instance 1)": "plane",
        "Ball (instance 1)": "UV sphere 16 x 8",
        "Inside (instance 2)": "plane",
        "Ball (instance 2)": "UV sphere 16 x 8",
    }
    assert [o.name for o in reading.objects if o.bakeable] == ["Floor"]
    assert all("Make Instances Real" in o.reason for o in reading.objects if not o.bakeable)
    centres = {s.name: s.shape.bounds for s in reading.scene.surfaces}
    np.testing.assert_allclose(centres["Ball (instance 1)"][0], [5, 0, 2], atol=1e-6)
    np.testing.assert_allclose(centres["Ball (instance 2)"][0], [0, 5, 4], atol=1e-6)
    assert centres["Ball (instance 2)"][1] == pytest.approx(2)


def test_instances_of_a_hidden_instancer_or_object_take_no_part(read):
    inner = collection_of(scenes.grid("Inside"), scenes.box("Hidden"))
    bpy.data.objects["Hidden"].hide_render = True
    hidden = instancer("A", inner, Matrix.Translation((5, 0, 0)))
    instancer("B", inner, Matrix.Translation((0, 5, 0)))
    hidden.hide_render = True
    assert labels(read()) == {"Inside (instance 1)": "plane"}


def test_instances_on_faces_and_not_their_source(read):
    grid = scenes.grid("Grid", 3)
    child = scenes.sphere("Child", radius=0.1)
    child.parent = grid
    grid.instance_type = "FACES"
    bpy.context.view_layer.update()
    reading = read()
    assert [o.name for o in reading.objects] == ["Grid"] + [f"Child (instance {k})" for k in range(1, 10)]
    assert reading.warnings == [] and reading.refused == []


def test_geometry_nodes_instances(read):
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = group.nodes, group.links
    given, out = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    on_points, cube, join = (
        nodes.new(f"GeometryNode{kind}") for kind in ("InstanceOnPoints", "MeshCube", "JoinGeometry")
    )
    cube.inputs["Size"].default_value = (0.1, 0.1, 0.1)
    links.new(given.outputs[0], on_points.inputs["Points"])
    links.new(cube.outputs["Mesh"], on_points.inputs["Instance"])
    links.new(on_points.outputs[0], join.inputs[0])
    links.new(given.outputs[0], join.inputs[0])
    links.new(join.outputs[0], out.inputs[0])
    plane = scenes.grid("Plane", 2, 4.0)
    plane.modifiers.new("Scatter", "NODES").node_group = group
    reading = read()
    found = labels(reading)
    assert len(found) == 1 + 9 and list(found.values()).count("6 planes") == 9 and found["Plane"] == "plane"
    assert reading.objects[0].bakeable and not any(o.bakeable for o in reading.objects[1:])


def test_particles_of_objects_are_instances_and_hair_is_named(read):
    ball = scenes.sphere("Ball", radius=0.1, matrix=Matrix.Translation((0, 0, 9)))
    for name, kind in (("Field", "OBJECT"), ("Meadow", "PATH")):
        floor = scenes.grid(name, 3, 4.0, Matrix.Translation((0, 0, 0 if kind == "OBJECT" else -3)))
        bpy.context.view_layer.objects.active = floor
        bpy.ops.object.particle_system_add()
        made = floor.particle_systems[0].settings
        made.type, made.count, made.render_type = "HAIR", 20, kind
        made.instance_object = ball if kind == "OBJECT" else None
    bpy.context.view_layer.update()
    reading = read()
    assert sum("Ball (instance" in o.name for o in reading.objects) == 20
    assert [text for text in reading.warnings if "'Meadow'" in text and "particles" in text]
    assert not [text for text in reading.warnings if "'Field'" in text]


def test_curves_text_surfaces_and_metaballs_light_by_their_meshes(read):
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.curve.primitive_bezier_circle_add(location=(0, 0, 9))  # a path: a render shows nothing
    bpy.ops.object.text_add(location=(3, 0, 0))
    bpy.ops.object.metaball_add(location=(6, 0, 0))
    bpy.ops.object.metaball_add(location=(6.5, 0, 0))
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(9, 0, 0))
    reading = read()
    assert reading.refused == []
    assert {o.name for o in reading.objects} == {"BézierCircle", "Text", "Mball", "SurfSphere"}
    assert all(not o.bakeable and "convert it to a mesh" in o.reason for o in reading.objects)
    centre = {o.name: reading.scene.surfaces[o.surfaces[0]].shape.bounds[0] for o in reading.objects}
    assert centre["SurfSphere"][0] == pytest.approx(9, abs=0.2) and centre["Mball"][0] == pytest.approx(6.25, abs=0.5)


def scattered():
    """Boxes on a plane's vertices by geometry nodes."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeMeshCube", "NodeGroupOutput")
    given, points, cube, out = (group.nodes.new(kind) for kind in kinds)
    for start, end in ((given, points.inputs["Points"]), (cube, points.inputs["Instance"]), (points, out.inputs[0])):
        group.links.new(start.outputs[0], end)
    scenes.grid("Thing", 1, 8.0).modifiers.new("Scatter", "NODES").node_group = group


def in_a_collection():
    instancer("Instancer", collection_of(scenes.box("Thing")), Matrix.Translation((5, 0, 0)))


def on_faces():
    grid, child = scenes.grid("Grid", 2, 8.0), scenes.box("Thing")
    child.parent, grid.instance_type = grid, "FACES"


@pytest.mark.parametrize("make, count", [(scattered, 4), (in_a_collection, 1), (on_faces, 4)])
def test_the_button_makes_instances_real(read, make, count):
    make()
    bpy.context.view_layer.update()
    assert bpy.ops.pdm.scan() == {"FINISHED"}
    before = read()
    assert sum(o.name.startswith("Thing (instance") for o in before.objects) == count
    row = next(row for row in bpy.context.scene.pdm_radiosity.listed if row.name == "Thing (instance 1)")
    assert row.mend == "REAL"
    assert bpy.ops.pdm.mend(object=row.name, way="REAL") == {"FINISHED"}
    bpy.context.view_layer.update()
    after = read(make_single_user=True)
    assert all(o.bakeable for o in after.objects)
    boxes = [o for o in after.objects if o.label == "6 planes"]
    own = int(make is on_faces)  # what was shown on the faces is there itself now
    assert len(boxes) == count + own
    bounds = np.array([after.scene.surfaces[k].shape.bounds[0] for o in boxes for k in o.surfaces])
    old = [before.scene.surfaces[k].shape.bounds[0] for o in before.objects if "instance" in o.name for k in o.surfaces]
    assert all(np.linalg.norm(bounds - at, axis=1).min() < 1e-5 for at in old)


# --- shared meshes ------------------------------------------------------------------------------------------------


def shared():
    first = scenes.grid("First")
    for k, name in enumerate(("Second", "Third"), 1):
        other = bpy.data.objects.new(name, first.data)
        other.location.x = 2 * k
        bpy.context.collection.objects.link(other)
    first.data.use_fake_user = True
    bpy.context.view_layer.update()
    return first


def test_the_first_of_those_that_share_a_mesh_is_baked(read):
    first = shared()
    reading = read()
    assert len(reading.scene) == 6 and reading.refused == []
    assert [o.name for o in reading.objects if o.bakeable] == ["First"]
    assert all("'First'" in o.reason and "single-user" in o.reason for o in reading.objects if not o.bakeable)
    (warning,) = reading.warnings
    assert "'First'" in warning and "3 in all" in warning
    assert [o.name for o in read(["Third", "Second"]).objects if o.bakeable] == ["Second"]
    first.data = first.data.copy()
    assert [o.name for o in read().objects if o.bakeable] == ["First", "Second"]


def test_each_of_them_may_be_baked_on_a_mesh_of_its_own(read):
    first = shared()
    assert all(o.bakeable and o.is_single_user for o in read(make_single_user=True).objects)
    lamp = scenes.material("Lamp", emission=(1, 1, 1))
    scenes.sphere("Light", radius=0.3, matrix=Matrix.Translation((0, 0, 3)), made_of=lamp)
    mesh, before = first.data, len(bpy.data.meshes)
    assert bpy.ops.pdm.bake(make_single_user=True) == {"FINISHED"}
    objects = [bpy.data.objects[name] for name in ("First", "Second", "Third")]
    assert len({obj.data.name for obj in objects}) == 3 and len(bpy.data.meshes) == before + 2
    assert mesh in [obj.data for obj in objects]
    assert len({scenes.colours(obj)[:, 0].mean() for obj in objects}) >= 2  # two of them lie alike under the light


# --- modifiers ----------------------------------------------------------------------------------------------------


def test_applied_modifiers_are_baked_as_they_leave_the_mesh(read):
    floor = scenes.grid("Floor", 2, 4.0)
    floor.modifiers.new("Finer", "SUBSURF").subdivision_type = "SIMPLE"
    scenes.grid("Light", 1, 1.0, Matrix.Translation((0, 0, 3)), scenes.material("Lamp", emission=(1, 1, 1)))
    assert not read().objects[0].bakeable
    found = read(apply_modifiers=True).objects[0]
    assert found.bakeable and found.is_applied and len(found.polygon_surface) == 16
    assert len(floor.modifiers) == 1 and len(floor.data.polygons) == 4  # reading changes nothing
    assert bpy.ops.pdm.bake(apply_modifiers=True) == {"FINISHED"}
    assert len(floor.modifiers) == 0 and len(floor.data.polygons) == 16
    assert len(scenes.colours(floor)) == 25


def test_what_modifiers_do_not_change_keeps_them(read):
    floor = scenes.grid("Floor", 2, 4.0)
    floor.modifiers.new("Triangulate", "TRIANGULATE")
    assert not read(apply_modifiers=True).objects[0].is_applied
