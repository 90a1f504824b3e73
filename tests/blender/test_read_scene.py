"""Objects of a Blender scene as surfaces: what is read, with its known shape and side, and what is refused."""

import math

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from mathutils import Euler, Matrix


@pytest.fixture
def error(addon):
    return addon("pdm_core").SceneError


def only(reading):
    """The one ReadObject and its surfaces."""
    assert reading.refused == []
    (found,) = reading.objects
    return found, [reading.scene.surfaces[i] for i in found.surfaces]


def refusal(reading, name):
    (reason,) = [text for refused, text in reading.refused if refused == name]
    assert name not in [o.name for o in reading.objects]
    return reason


def world_vertices(obj):
    matrix = np.array(obj.matrix_world, float)
    return scenes.vertices(obj) @ matrix[:3, :3].T + matrix[:3, 3]


def facing(reading, found):
    """Unit world normals of the mesh's polygons by the inverse transpose, and those of their surfaces there."""
    obj = found.object
    matrix = np.array(obj.matrix_world, float)
    centres = np.array([p.center for p in obj.data.polygons], float) @ matrix[:3, :3].T + matrix[:3, 3]
    normals = np.array([p.normal for p in obj.data.polygons], float) @ np.linalg.inv(matrix[:3, :3])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    theirs = np.empty_like(normals)
    for k in np.unique(found.polygon_surface):
        at = found.polygon_surface == k
        theirs[at] = reading.scene.surfaces[k].normals(centres[at])
    return normals, theirs


MATRICES = {
    "identity": Matrix(),
    "moved": Matrix.Translation((10, -20, 30)),
    "turned": Euler((0.3, 1.1, -2.0)).to_matrix().to_4x4(),
    "uneven": Matrix.Diagonal((2, 0.5, 0.1, 1)),
    "mirrored": Matrix.Diagonal((-1, 1, 1, 1)),
    "mirrored through": Matrix.Diagonal((-1, -2, -3, 1)),
    "sheared": Matrix(((1, 0.7, 0, 3), (0, 1, 0.2, 0), (0, 0, 0.5, 1), (0, 0, 0, 1))),
    "tiny": Matrix.Translation((1, 2, 3)) @ Matrix.Diagonal((1e-3, 1e-3, 1e-3, 1)),
    "huge": Matrix.Diagonal((1e3, 1e3, 2e3, 1)),
}


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
@pytest.mark.parametrize("applied", [False, True])
def test_sphere_under_any_matrix(read, matrix, applied):
    obj = scenes.sphere("Ball", 24, 12)
    if applied:
        obj.data.transform(matrix)
        if matrix.determinant() < 0:
            obj.data.flip_normals()  # its winding is kept, so it would face inward
    else:
        parent = bpy.data.objects.new("Parent", None)  # a shear comes from a parent
        bpy.context.collection.objects.link(parent)
        obj.parent, obj.matrix_parent_inverse = parent, matrix
    bpy.context.view_layer.update()
    reading = read()
    found, (surface,) = only(reading)
    assert (found.name, found.kind, found.label) == ("Ball", "SPHERE", "UV sphere 24 x 12")
    assert (surface.name, surface.side) == ("Ball", "front")
    expected, l_found = np.array(matrix, float), surface.shape.linear
    size = np.linalg.norm(expected[:3, :3], 2)
    assert np.abs(surface.shape.origin - expected[:3, 3]).max() < 3e-6 * (size + np.abs(expected[:3, 3]).max())
    rounding = 2e-7 * np.abs(scenes.vertices(obj)).max() * (1 if applied else size)  # of the stored coordinates
    assert (
        np.abs(l_found @ l_found.T - expected[:3, :3] @ expected[:3, :3].T).max() < (5e-6 * size + rounding) * 2 * size
    )
    vertices = world_vertices(obj)
    assert np.linalg.norm(surface.shape.project(vertices) - vertices, axis=1).max() < 1e-5 * size + 1e-6
    np.testing.assert_array_equal(found.matrix, np.array(obj.matrix_world, float))
    mine, theirs = facing(reading, found)
    assert (np.einsum("ij,ij->i", mine, theirs) > 0.5).all()
    assert surface.shape.is_round == (np.ptp(np.linalg.svd(expected[:3, :3])[1]) < 1e-6 * size)


@pytest.mark.parametrize("segments, rings", [(3, 3), (4, 3), (4, 4), (5, 9), (8, 4), (32, 16), (64, 33), (128, 64)])
@pytest.mark.parametrize("triangulate", [None, "BEAUTY", "FIXED", "ALTERNATE", "SHORT_EDGE"])
def test_sphere_primitive_of_any_count(read, segments, rings, triangulate):
    """By Blender's operator, whose vertex order differs between versions: one sphere, but for float32 roundings."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=rings, radius=0.7, location=(1, 2, 3))
    if triangulate:
        mesh = bpy.context.object.data
        b = bmesh.new()
        b.from_mesh(mesh)
        bmesh.ops.triangulate(b, faces=b.faces, quad_method=triangulate)
        b.to_mesh(mesh)
        b.free()
    found, (surface,) = only(read())
    assert found.label == f"UV sphere {segments} x {rings}"
    np.testing.assert_allclose(surface.shape.origin, [1, 2, 3], rtol=0, atol=3e-7)
    np.testing.assert_allclose(surface.shape.linear, 0.7 * np.eye(3), rtol=0, atol=3e-7)


def test_tessellation_does_not_change_the_scene(read):
    matrices = []
    for segments, rings in [(8, 4), (32, 16), (128, 64)]:
        obj = scenes.sphere("Ball", segments, rings, matrix=MATRICES["turned"])
        matrices.append(only(read())[1][0].shape.matrix)
        bpy.data.objects.remove(obj)
    np.testing.assert_array_equal(matrices[0], matrices[1])
    np.testing.assert_array_equal(matrices[0], matrices[2])


def test_inward_sphere_is_baked_inside(read):
    obj = scenes.sphere("Dome")
    obj.data.flip_normals()
    reading = read()
    found, (surface,) = only(reading)
    assert surface.is_inside
    mine, theirs = facing(reading, found)
    assert (np.einsum("ij,ij->i", mine, theirs) > 0.5).all()


def test_hidden_side_of_a_sphere_is_read_where_something_may_see_it(read):
    """Touching the floor or passing it by is not seeing the inside, nor is being inside where no light is."""
    scenes.grid("Floor", 1, 20.0)
    ball = scenes.sphere("Ball", matrix=Matrix.Translation((0, 0, 1)))
    scenes.sphere("Next", matrix=Matrix.Translation((2, 0, 1)))
    names = [s.name for s in read().scene.surfaces]
    assert names == ["Floor", "Floor (back)", "Ball", "Next"]
    inner = scenes.sphere("Inner", radius=0.2, matrix=Matrix.Translation((0, 0, 1)))
    assert "Ball (inside)" not in [s.name for s in read().scene.surfaces]
    inner.data.materials.append(scenes.material("Lamp", emission=(1, 1, 1)))
    assert "Ball (inside)" in [s.name for s in read().scene.surfaces]
    ball.data.flip_normals()
    ball.scale = (0.9, 0.9, 0.9)
    names = [s.name for s in read().scene.surfaces]
    assert "Ball" in names and "Ball (outside)" in names  # the neighbour sees it


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
def test_plane_under_any_matrix(read, matrix):
    obj = scenes.grid("Floor", 3, 2.0)
    obj.matrix_world = matrix
    bpy.context.view_layer.update()
    reading = read()
    found, (front, back) = only(reading)
    assert (found.kind, found.label) == ("PLANE", "plane")
    assert [(s.name, s.side) for s in (front, back)] == [("Floor", "front"), ("Floor (back)", "back")]
    assert front.shape is back.shape
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0.0)]) @ np.array(obj.matrix_world, float)[:3, :3].T
    corners += np.array(obj.matrix_world.translation, float)
    far = np.linalg.norm(front.shape.corners[:, None] - corners[None], axis=2).min(axis=0)
    assert far.max() < 1e-6 * np.abs(corners).max()
    assert (found.polygon_surface == found.surfaces[0]).all() and len(found.polygon_surface) == 9
    mine, theirs = facing(reading, found)
    np.testing.assert_allclose(mine, theirs, atol=1e-4)


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
def test_box_and_room(read, inverted, matrix):
    obj = scenes.box("Room", 2.0, inverted=inverted)
    obj.matrix_world = matrix
    bpy.context.view_layer.update()
    reading = read()
    found, surfaces = only(reading)
    sides = 2 if inverted else 1  # no light comes into a closed box
    assert (found.kind, found.label, len(surfaces)) == ("PLANES", "6 planes", 6 * sides)
    assert {s.name for s in surfaces} == {f"Room face {k}{b}" for k in range(1, 7) for b in ("", " (back)")[:sides]}
    assert sorted(found.polygon_surface) == found.surfaces[::sides]
    mine, theirs = facing(reading, found)
    np.testing.assert_allclose(mine, theirs, atol=1e-4)
    centre = np.array(obj.matrix_world.translation)
    outward = [s.sign * s.shape.normal @ (s.shape.bounds[0] - centre) > 0 for s in surfaces[::sides]]
    assert outward == [not inverted] * 6


def test_the_inside_of_a_box_is_read_where_light_is_in_it(read):
    box = scenes.box("Box", 2.0)
    lamp = scenes.grid("Lamp", 1, 0.5, made_of=scenes.material("Light", emission=(1, 1, 1)))
    names = [s.name for s in read().scene.surfaces]
    assert len(names) == 14 and "Box face 1 (back)" in names
    lamp.location.z = 1.0  # on its lid
    bpy.context.view_layer.update()
    assert len(read().scene.surfaces) == 8
    scenes.rebuild(box, lambda b: bmesh.ops.create_grid(b, x_segments=1, y_segments=1, size=1.0))
    assert len(read().scene.surfaces) == 4


def test_joined_pieces_know_their_surfaces(read):
    def build(b):
        bmesh.ops.create_uvsphere(b, u_segments=8, v_segments=6, radius=1.0)
        bmesh.ops.create_cube(b, size=1.0, matrix=Matrix.Translation((5, 0, 0)))
        bmesh.ops.create_grid(b, x_segments=2, y_segments=2, size=1.0, matrix=Matrix.Translation((0, 5, 0)))

    scenes.add("Parts", build)
    reading = read()
    found, surfaces = only(reading)
    assert (found.kind, found.label) == ("SHAPES", "1 UV sphere, 7 planes")
    assert len(surfaces) == 1 + 6 + 2
    mine, theirs = facing(reading, found)
    assert (np.einsum("ij,ij->i", mine, theirs) > 0.5).all()


def primitive(name, **settings):
    getattr(bpy.ops.mesh, f"primitive_{name}_add")(**settings)
    return bpy.context.object


def subsurfed(levels, applied):
    obj = primitive("cube")
    obj.modifiers.new("Subdivision", "SUBSURF").levels = levels
    if applied:
        bpy.ops.object.modifier_apply(modifier="Subdivision")
    return obj


def smooth(obj):
    obj.data.shade_smooth()
    return obj


OTHERS = {
    "cylinder": (lambda: primitive("cylinder"), "2 polygons, mesh of 32 faces"),
    "open cylinder": (lambda: primitive("cylinder", end_fill_type="NOTHING"), "mesh of 32 faces"),
    "prism": (lambda: primitive("cylinder", vertices=6), "6 planes, 2 polygons"),
    "cone": (lambda: primitive("cone"), "1 polygon, mesh of 32 faces"),
    "pyramid": (lambda: primitive("cone", vertices=4), "1 plane, 4 polygons"),
    "torus": (lambda: primitive("torus"), "mesh of 576 faces"),
    "monkey": (lambda: smooth(primitive("monkey")), "mesh of 500 faces"),
    "circle": (lambda: primitive("circle", fill_type="NGON"), "polygon"),
    "fan": (lambda: primitive("circle", fill_type="TRIFAN"), "polygon"),
    "ico 1": (lambda: primitive("ico_sphere", subdivisions=1), "20 polygons"),
    **{
        f"ico {n}": (lambda n=n: primitive("ico_sphere", subdivisions=n), f"mesh of {20 * 4 ** (n - 1):,} faces")
        for n in (2, 3, 4)
    },
    **{
        f"subsurf {n} {a}": (lambda n=n, a=a: subsurfed(n, a), f"mesh of {6 * 4**n:,} faces")
        for n in (2, 3)
        for a in (False, True)
    },
}


@pytest.mark.parametrize("make, label", OTHERS.values(), ids=OTHERS.keys())
def test_other_primitives_are_polygons_and_meshes(read, make, label):
    obj = make()
    reading = read()
    found, surfaces = only(reading)
    assert found.label.startswith(label)
    assert found.exactness == ("approximate" if "mesh" in label else "exact")
    assert found.kind == ("MESH" if "mesh" in label else "POLYGONS")
    area = sum(surface.shape.area for surface in surfaces if surface.side == "front")
    made = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert area == pytest.approx(sum(p.area for p in made.polygons), rel=2e-2 if "mesh" in label else 1e-6)


@pytest.mark.parametrize("edit", ["moved vertex", "moved pole", "deleted face", "flipped face", "scaled ring"])
def test_edited_spheres_are_meshes(read, edit):
    obj = scenes.sphere("Ball", 16, 8)
    b = bmesh.new()
    b.from_mesh(obj.data)
    b.verts.ensure_lookup_table()
    b.faces.ensure_lookup_table()
    if edit == "moved vertex":
        b.verts[30].co.x += 0.01
    if edit == "moved pole":
        max(b.verts, key=lambda v: v.co.z).co.z += 0.01
    if edit == "deleted face":
        bmesh.ops.delete(b, geom=[b.faces[40]], context="FACES_ONLY")
    if edit == "flipped face":
        b.faces[40].normal_flip()
    if edit == "scaled ring":
        for v in b.verts:
            if abs(v.co.z) < 1e-3:
                v.co *= 1.02
    b.to_mesh(obj.data)
    b.free()
    found, surfaces = only(read())
    assert found.kind == "MESH" and found.bakeable
    is_closed = edit not in ("deleted face", "flipped face")
    assert len(surfaces) == (1 if is_closed else 2)


def test_bad_meshes_are_refused_with_the_reason(read):
    scenes.sphere("Zero").scale = (0, 0, 0)
    scenes.grid("Line").scale = (1, 0, 1)
    scenes.add("Empty", lambda b: None)
    scenes.add("Wire", lambda b: b.edges.new([b.verts.new((0, 0, 0)), b.verts.new((1, 0, 0))]))
    scenes.grid("Nan").data.vertices[0].co.x = math.nan
    bpy.context.view_layer.update()
    reading = read()
    words = {"Zero": "area", "Line": "area", "Empty": "no faces", "Wire": "no faces", "Nan": "not finite"}
    assert {name for name, _ in reading.refused} == set(words)
    for name, word in words.items():
        assert word in refusal(reading, name), name


def test_loose_vertices_and_flat_scales_are_read(read):
    scenes.add("Loose", lambda b: (bmesh.ops.create_cube(b, size=1), b.verts.new((3, 3, 3))))
    scenes.sphere("Flat", 16, 8).scale = (1, 1, 0)
    bpy.context.view_layer.update()
    reading = read()
    loose, flat = reading.objects
    assert loose.label == "6 planes" and loose.bakeable and flat.bakeable
    assert all(np.ptp(reading.scene.surfaces[k].shape.bounds[0][2:]) == 0 for k in flat.surfaces)


def test_objects_on_one_another_are_refused(read):
    scenes.grid("Floor")
    scenes.grid("Copy", 2, matrix=Matrix.Rotation(math.pi / 2, 4, "Z"))
    scenes.sphere("Ball", 8, 4)
    scenes.sphere("Finer", 32, 16)
    scenes.sphere("Larger", radius=1.01)
    reading = read()
    assert "'Floor'" in refusal(reading, "Copy") and "'Ball'" in refusal(reading, "Finer")
    assert [o.name for o in reading.objects] == ["Floor", "Ball", "Larger"]


# --- which objects take part --------------------------------------------------------------------------------------


def test_what_is_selected_limits_what_is_baked_not_what_lights(read, error):
    for k in range(3):
        scenes.grid(f"Plane {k}", matrix=Matrix.Translation((0, 0, k)))
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects["Plane 1"].select_set(True)
    for objects, baked in [("ALL", [0, 1, 2]), ("SELECTED", [1]), (("Plane 2", "Plane 0"), [0, 2])]:
        reading = read(objects)
        assert len(reading.scene) == 6 and len(reading.objects) == 3
        assert [o.name for o in reading.objects if o.bakeable] == [f"Plane {k}" for k in baked]
        assert all(o.bakeable != bool(o.reason) for o in reading.objects)
    with pytest.raises(error, match="'Nowhere'"):
        read(["Plane 0", "Nowhere"])


def test_hidden_from_render_takes_no_part(read, error):
    scenes.grid("Seen")
    scenes.grid("Camera icon", matrix=Matrix.Translation((0, 0, 1))).hide_render = True
    for name, change in [
        ("Collection", lambda c, layer: setattr(c, "hide_render", True)),
        ("Excluded", lambda c, layer: setattr(layer, "exclude", True)),
    ]:
        in_collection(scenes.grid(name, matrix=Matrix.Translation((0, 0, 2))), change)
    reading = read()
    assert [o.name for o in reading.objects] == ["Seen"] and reading.refused == []
    assert reading.hidden == 2  # an excluded collection is no part of the view layer
    with pytest.raises(error, match="'Camera icon'"):
        read(["Camera icon"])


def in_collection(obj, change):
    made = bpy.data.collections.new(f"Of {obj.name}")
    bpy.context.scene.collection.children.link(made)
    for old in list(obj.users_collection):
        old.objects.unlink(obj)
    made.objects.link(obj)
    change(made, bpy.context.view_layer.layer_collection.children[made.name])


HIDDEN = {
    "eye": lambda obj: obj.hide_set(True),
    "monitor": lambda obj: setattr(obj, "hide_viewport", True),
    "collection's eye": lambda obj: in_collection(obj, lambda c, layer: setattr(layer, "hide_viewport", True)),
    "collection's monitor": lambda obj: in_collection(obj, lambda c, layer: setattr(c, "hide_viewport", True)),
}


@pytest.mark.parametrize("hide", HIDDEN.values(), ids=HIDDEN.keys())
def test_hidden_in_the_viewport_takes_part_as_rendered(read, hide):
    """Parent, constraint and modifier are evaluated, and it stays hidden."""
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.location = (0, 0, 3)
    obj = scenes.grid("Plane")
    obj.parent = parent
    obj.modifiers.new("Triangulate", "TRIANGULATE")
    limit = obj.constraints.new("LIMIT_LOCATION")
    limit.use_min_x, limit.min_x = True, 5
    hide(obj)
    parent.location = (0, 0, 4)
    found, (front, _) = only(read())
    np.testing.assert_allclose(front.shape.bounds[0], [5, 0, 4], atol=1e-6)
    assert found.bakeable
    assert not obj.visible_get()
    layers = bpy.context.view_layer.layer_collection.children
    flags = [obj.hide_get(), obj.hide_viewport]
    flags += [flag for layer in layers for flag in (layer.hide_viewport, layer.collection.hide_viewport)]
    assert flags.count(True) == 1


def test_edit_mode_must_be_left(read, error):
    obj = scenes.grid("Floor")
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(error, match="'Floor'.*Object Mode"):
        read()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(read().objects) == 1


def test_library_data_lights_but_is_not_baked(read, tmp_path):
    scenes.grid("Floor")
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, linked):
        linked.objects = ["Floor"]
    bpy.context.collection.objects.link(linked.objects[0])
    (found,) = read().objects
    assert not found.bakeable and "library" in found.reason and len(found.surfaces) == 2


def test_what_is_no_surface_is_no_object(read):
    bpy.ops.object.empty_add()
    bpy.ops.object.camera_add()
    bpy.ops.object.light_add(type="SUN")
    reading = read()
    assert reading.refused == [] and reading.objects == []
    assert reading.warnings == [] and reading.lights == [("Sun", "SUN")] and reading.scene is None


# --- modifiers ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make, count", [(lambda: scenes.sphere("Thing", 16, 8), 1), (lambda: scenes.box("Thing"), 6)])
def test_modifiers_that_keep_vertices_are_baked(read, make, count):
    obj = make()
    plain = read().objects[0]
    obj.modifiers.new("Triangulate", "TRIANGULATE")
    obj.modifiers.new("Weighted", "WEIGHTED_NORMAL")
    reading = read()
    found, _ = only(reading)
    assert found.bakeable and len(found.polygon_surface) == len(obj.data.polygons)
    mine, theirs = facing(reading, found)
    assert (np.einsum("ij,ij->i", mine, theirs) > 0.5).all()
    assert found.kind == plain.kind and len(np.unique(found.polygon_surface)) == count


def test_what_modifiers_and_keys_only_move_is_baked_where_it_is(read):
    sphere = scenes.sphere("Ball", 16, 8)
    cast = sphere.modifiers.new("Cast away", "CAST")
    cast.factor, cast.use_radius_as_size, cast.size = 1.0, False, 1.25
    shape = scenes.sphere("Key", 16, 8, matrix=Matrix.Translation((9, 0, 0)))
    shape.shape_key_add(name="Basis")
    key = shape.shape_key_add(name="Bigger")
    for point, vertex in zip(key.data, shape.data.vertices, strict=True):
        point.co = 2 * vertex.co
    key.value = 1.0
    reading = read()
    radii = {s.name: s.shape.semi_axes[0] for s in reading.scene.surfaces}
    assert radii["Ball"] == pytest.approx(1.25, rel=1e-3) and radii["Key"] == pytest.approx(2, rel=1e-6)
    for found, radius in zip(reading.objects, (1.25, 2.0), strict=True):
        assert found.bakeable and not found.is_applied
        np.testing.assert_allclose(np.linalg.norm(found.base.vertices, axis=1), radius, rtol=1e-3)


def test_modifiers_that_change_faces_light_but_are_not_baked(read):
    plane = scenes.grid("Floor", matrix=Matrix.Translation((0, 0, -3)))
    plane.modifiers.new("Finer", "SUBSURF").subdivision_type = "SIMPLE"
    (found,) = read().objects
    assert "'Finer'" in found.reason and not found.bakeable


def test_modifiers_that_make_another_shape_light_but_are_not_baked(read):
    scenes.sphere("Ball").modifiers.new("Subdivision", "SUBSURF")
    scenes.grid("Floor", matrix=Matrix.Translation((0, 0, -3))).modifiers.new("Solid", "SOLIDIFY")
    ball, floor = read().objects
    assert ball.kind == "MESH" and "'Subdivision'" in ball.reason and not ball.bakeable
    assert floor.label == "6 planes" and "'Solid'" in floor.reason and not floor.bakeable


def test_modifiers_that_differ_in_the_render_are_warned_of(read):
    scenes.sphere("Ball").modifiers.new("Render only", "SUBSURF").show_viewport = False
    reading = read()
    (warning,) = reading.warnings
    assert "'Ball'" in warning and "'Render only'" in warning and reading.objects[0].bakeable


# --- materials on shapes --------------------------------------------------------------------------------------------


def test_both_sides_of_a_plane_and_planes_of_a_box_have_their_materials(read):
    red, lamp = scenes.material("Red", (0.6, 0.1, 0.1)), scenes.material("Lamp", emission=(1, 2, 3))
    box = scenes.box("Box", 2.0, made_of=red)
    box.data.materials.append(lamp)
    top = int(np.argmax([p.center.z for p in box.data.polygons]))
    box.data.polygons[top].material_index = 1
    reading = read()
    found, surfaces = only(reading)
    for surface in surfaces:
        is_top = surface.shape.bounds[0][2] > 0.9
        np.testing.assert_allclose(surface.emission, [1, 2, 3] if is_top else [0, 0, 0])
        np.testing.assert_allclose(surface.reflectance, [0, 0, 0] if is_top else [0.6, 0.1, 0.1], rtol=1e-6)
    assert reading.scene.surfaces[found.polygon_surface[top]].emission[2] == 3


def test_object_slots_and_same_material_twice(read):
    red, blue = scenes.material("Red", (0.6, 0, 0)), scenes.material("Blue", (0, 0, 0.6))
    ball = scenes.sphere("Ball", 8, 4, made_of=red)
    ball.data.materials.append(red)
    for polygon in ball.data.polygons:
        polygon.material_index = polygon.index % 2
    assert only(read())[1][0].reflectance[0] == pytest.approx(0.6)
    for slot in ball.material_slots:
        slot.link, slot.material = "OBJECT", blue
    assert only(read())[1][0].reflectance[2] == pytest.approx(0.6)
    ball.material_slots[0].material = red
    reading = read()
    found, surfaces = only(reading)
    assert {surface.reflectance[2] > 0 for surface in surfaces} == {True, False}
    assert found.kind == "POLYGONS" and "several materials" in reading.warnings[0]


def test_without_material_blenders_grey(read):
    scenes.sphere("Ball")
    np.testing.assert_allclose(only(read())[1][0].reflectance, 0.8)


def test_warnings_name_material_and_objects(read):
    glass = scenes.new_material("Glass")
    nodes = glass.node_tree.nodes
    nodes.clear()
    shader = nodes.new("ShaderNodeBsdfGlass")
    shader.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    glass.node_tree.links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    for k in range(5):
        scenes.grid(f"Pane {k}", matrix=Matrix.Translation((0, 0, k)), made_of=glass)
    (warning,) = read().warnings
    assert "Material 'Glass'" in warning and "'Pane 0'" in warning and "2 more" in warning and "Glass BSDF" in warning


def test_background(read):
    scenes.grid("Floor")
    np.testing.assert_array_equal(read().scene.background, 0)
    world = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0):
        world.color = (0.1, 0.2, 0.3)
        np.testing.assert_allclose(read().scene.background, [0.1, 0.2, 0.3], rtol=1e-6)
        world.use_nodes = True
    node = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    node.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1)
    node.inputs["Strength"].default_value = 4.0
    reading = read()
    np.testing.assert_allclose(reading.scene.background, [2, 1, 4])
    assert reading.warnings == []
    sky = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    world.node_tree.links.new(sky.outputs[0], node.inputs["Color"])
    np.testing.assert_allclose(read().scene.background, [4, 0, 4])  # as Cycles shows a node without an image


def test_reading_changes_nothing(read):
    scenes.lit_ball()
    bpy.data.objects["Ball"].hide_viewport = True
    before = sorted(name for kind in ("objects", "meshes", "collections") for name in getattr(bpy.data, kind).keys())
    read()
    after = sorted(name for kind in ("objects", "meshes", "collections") for name in getattr(bpy.data, kind).keys())
    assert before == after and bpy.data.objects["Ball"].hide_viewport


def test_front_and_back_are_those_of_cycles(read, tmp_path):
    """A material that emits 1 from the front and 0.25 from the back, seen by Cycles and by the reading."""
    made = scenes.material("Sided", emission=(1, 1, 1))
    nodes, links = made.node_tree.nodes, made.node_tree.links
    strength, backfacing = nodes.new("ShaderNodeMix"), nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    factor, front, back = (socket for socket in strength.inputs if socket.enabled)
    links.new(backfacing, factor)
    front.default_value, back.default_value = 1.0, 0.25
    emission = next(node for node in nodes if node.bl_idname == "ShaderNodeEmission")
    links.new(next(s for s in strength.outputs if s.enabled), emission.inputs["Strength"])
    plane = scenes.grid("Plane", 2, 10.0, made_of=made)
    look_down_at(0.0)
    for scale in [(1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, 1), (-1, -1, -1)]:
        plane.scale = scale
        bpy.context.view_layer.update()
        _, surfaces = only(read())
        (upper,) = [s for s in surfaces if s.normals(np.zeros((1, 3)))[0, 2] > 0]
        assert upper.emission[0] == pytest.approx(rendered(tmp_path), abs=1e-3), scale


def look_down_at(height):
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.camera.location.z = height + 5
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format = "OPEN_EXR"


def rendered(folder):
    """Red of the picture's middle, linear."""
    bpy.context.scene.render.filepath = str(folder / "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(bpy.context.scene.render.filepath)
    value = image.pixels[4 * (4 * 2 + 2)]
    bpy.data.images.remove(image)
    return value


@pytest.mark.parametrize("changes", range(4))
def test_what_changes_between_slices_is_read_anew(addon, changes):
    """Each object copied is a sign of life; what was copied before a change is copied again, at last in one go."""
    boxes = [scenes.box(f"Box {k}", 1.0, Matrix.Translation((3 * k, 0, 0))) for k in range(8)]
    bpy.context.view_layer.update()
    steps, seen = addon("operators.reading.read_scene").read_steps(bpy.context), 0
    for _ in range(changes):
        for _ in range(4):
            next(steps)
        boxes[0].location.y += 3.0
        bpy.data.objects.remove(boxes.pop())
        bpy.context.view_layer.update()
    while True:
        try:
            next(steps)
            seen += 1
        except StopIteration as end:
            reading = end.value
            break
    assert [read.name for read in reading.objects] == [box.name for box in boxes] and not reading.refused
    # disturbed so often, it goes through at once
    assert (seen > len(boxes) or changes == 3) and reading.objects[0].matrix[1, 3] == 3.0 * changes
    assert (reading.objects[0].matrix == np.array(boxes[0].matrix_world)).all()
