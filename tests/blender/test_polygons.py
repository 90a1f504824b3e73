"""Objects as people make them: what is flat becomes polygons, the rest meshes, and each corner knows its own side."""

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix
from test_cases import sky


@pytest.fixture
def points(addon):
    module = addon("operators.baking.bake_points")
    return lambda target, domain="AUTO": module.bake_points(*module.corners_of(target), domain)


def only(reading):
    assert reading.refused == []
    (found,) = reading.objects
    return found, [reading.scene.surfaces[k] for k in found.surfaces]


def from_faces(name, vertices, faces, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    if smooth:
        mesh.shade_smooth()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


def window_wall(name="Wall", cells=5, windows=((1, 1), (3, 3))):
    """A grid of cells without those."""
    obj = scenes.grid(name, cells, float(cells))
    b = bmesh.new()
    b.from_mesh(obj.data)
    places = [Matrix.Translation((i + 0.5 - cells / 2, j + 0.5 - cells / 2, 0)).translation for i, j in windows]
    gone = [f for f in b.faces if any((f.calc_center_median() - p).length < 0.1 for p in places)]
    bmesh.ops.delete(b, geom=gone, context="FACES")
    b.to_mesh(obj.data)
    b.free()
    return obj


def house():
    """Walls and a gable roof, closed, 7 faces."""
    v = [(-1, -2, 0), (1, -2, 0), (1, 2, 0), (-1, 2, 0), (-1, -2, 2), (1, -2, 2), (1, 2, 2), (-1, 2, 2)]
    v += [(0, -2, 3), (0, 2, 3)]
    faces = [(3, 2, 1, 0), (0, 1, 5, 8, 4), (2, 3, 7, 9, 6), (1, 2, 6, 5), (3, 0, 4, 7), (5, 6, 9, 8), (7, 4, 8, 9)]
    return from_faces("House", v, faces)


def stairs(steps=6):
    profile = [(0.0, 0.0)] + [p for k in range(steps) for p in ((k, k + 1.0), (k + 1.0, k + 1.0))] + [(steps, 0.0)]
    n = len(profile)
    v = [(x, y, z) for y in (0.0, 2.0) for x, z in profile]
    faces = [tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1))]
    faces += [(k, n + k, n + (k + 1) % n, (k + 1) % n) for k in range(n)]
    obj = from_faces("Stairs", v, faces)
    b = bmesh.new()
    b.from_mesh(obj.data)
    bmesh.ops.recalc_face_normals(b, faces=b.faces)
    b.to_mesh(obj.data)
    b.free()
    return obj


def test_a_wall_with_windows_is_one_polygon(read):
    window_wall()
    found, (front, back) = only(read())
    assert (found.kind, found.label, found.exactness) == ("POLYGONS", "polygon", "exact")
    assert front.shape is back.shape and len(front.shape.outline) == 4 and len(front.shape.holes) == 2
    assert front.shape.area == pytest.approx(23, rel=1e-6)
    np.testing.assert_allclose(front.shape.normal, [0, 0, 1], atol=1e-6)


@pytest.mark.parametrize("matrix", [Matrix(), Matrix.Diagonal((-1, 2, 1, 1)), Matrix.Rotation(1.1, 4, (1, 2, 3))])
def test_polygons_under_matrices_face_as_their_mesh(read, matrix):
    obj = window_wall()
    obj.matrix_world = matrix
    bpy.context.view_layer.update()
    found, (front, _) = only(read())
    linear = np.array(obj.matrix_world, float)[:3, :3]
    normal = np.linalg.inv(linear).T @ [0, 0, 1]
    assert front.shape.normal @ normal / np.linalg.norm(normal) == pytest.approx(1, abs=1e-6)
    assert front.shape.area == pytest.approx(23 * np.linalg.norm(np.cross(linear[:, 0], linear[:, 1])), rel=1e-5)


def test_a_house_is_polygons_without_insides(read):
    house()
    found, surfaces = only(read())
    assert (found.label, len(surfaces)) == ("5 planes, 2 polygons", 7)
    lamp = scenes.grid("Lamp", 1, 0.5, Matrix.Translation((0, 0, 1)), scenes.material("L", emission=(1, 1, 1)))
    assert len(read().objects[0].surfaces) == 14
    lamp.location.z = 9.0
    bpy.context.view_layer.update()
    assert len(read().objects[0].surfaces) == 7


def test_stairs_are_planes_and_two_sides(read):
    stairs(20)
    found, surfaces = only(read())
    assert found.label == "42 planes, 2 polygons" and len(surfaces) == 44


def bevelled(segments, smooth):
    obj = scenes.box("Box", 2.0)
    bevel = obj.modifiers.new("Bevel", "BEVEL")
    bevel.segments, bevel.width = segments, 0.1
    if smooth:
        obj.modifiers.new("Weighted", "WEIGHTED_NORMAL")
        obj.data.shade_smooth()
    return obj


BEVELS = [(1, False, "18 planes, 8 polygons"), (3, True, "6 planes, mesh of")]


@pytest.mark.parametrize("segments, smooth, label", BEVELS)
def test_large_faces_of_bevelled_boxes_are_exact(read, segments, smooth, label):
    bevelled(segments, smooth)
    found, surfaces = only(read())
    assert found.label.startswith(label) and not found.bakeable and "'Bevel'" in found.reason
    assert all(surface.side == "front" for surface in surfaces)


def test_the_original_cornell_box(read):
    """Typed by hand: its left wall is bent by half a percent, its blocks' tops are no parallelograms."""
    left = [(552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0)]
    floor = [(552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)]
    top = [(130, 165, 65), (82, 165, 225), (240, 165, 272), (290, 165, 114)]
    from_faces("Left", left, [(0, 1, 2, 3)])
    from_faces("Floor", floor, [(0, 1, 2, 3)])
    from_faces("Top", top, [(0, 1, 2, 3)])
    reading = read()
    assert [(o.name, o.label) for o in reading.objects] == [
        ("Left", "2 polygons"), ("Floor", "polygon"), ("Top", "polygon"),
    ]  # fmt: skip
    assert all(o.bakeable and o.exactness == "exact" for o in reading.objects)


def test_each_corner_of_a_bent_face_is_on_its_own_triangle(read, points):
    obj = from_faces("Bent", [(0, 0, 0), (1, 0, 0), (1, 1, 0.3), (0, 1, 0)], [(0, 1, 2, 3)])
    reading = read()
    found, _ = only(reading)
    at = np.array([v.co for v in obj.data.vertices], float)[[loop.vertex_index for loop in obj.data.loops]]
    for k in range(4):
        shape = reading.scene.surfaces[found.corner_surface[k]].shape
        assert np.linalg.norm(shape.project(at[k : k + 1]) - at[k]) < 1e-6
    obj.data.calc_loop_triangles()
    for triangle, surface in zip(obj.data.loop_triangles, found.triangle_surface, strict=True):
        middle = at[list(triangle.loops)].mean(axis=0, keepdims=True)
        assert np.linalg.norm(reading.scene.surfaces[surface].shape.project(middle) - middle) < 1e-6
    assert points(found).domain == "CORNER"


# --- mended ---------------------------------------------------------------------------------------------------------


def test_split_vertices_are_welded_for_recognition_only(read, points):
    """As glTF and STL come in: every face its own vertices."""
    obj = scenes.sphere("Ball", 16, 8)
    window_wall().location.z = -3
    for each in list(bpy.data.objects):
        b = bmesh.new()
        b.from_mesh(each.data)
        bmesh.ops.split_edges(b, edges=b.edges)
        b.to_mesh(each.data)
        b.free()
    bpy.context.view_layer.update()
    reading = read()
    assert [o.label for o in reading.objects] == ["UV sphere 16 x 8", "polygon"]
    assert len(points(reading.objects[0]).points) == len(obj.data.vertices)


def test_opposite_neighbours_are_baked_on_their_own_side(read, points):
    obj = scenes.grid("Floor", 3)
    obj.data.polygons[4].flip()
    reading = read()
    found, (front, back) = only(reading)
    assert found.label == "plane"
    sides = [reading.scene.surfaces[k].side for k in found.polygon_surface]
    assert sides == ["back" if k == 4 else "front" for k in range(9)]
    assert len(points(found, "CORNER").points) == 16 + 4


def test_doubled_faces_and_faces_without_area_are_said(read):
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0)]
    from_faces("Odd", square, [(0, 1, 2, 3), (3, 2, 1, 0), (0, 4, 1)])
    reading = read()
    found, (front, back) = only(reading)
    assert found.label == "plane" and found.bakeable
    assert [reading.scene.surfaces[k].side for k in found.polygon_surface[:2]] == ["front", "back"]
    assert len(reading.warnings) == 2 and all("'Odd'" in text for text in reading.warnings)


# --- meshes ---------------------------------------------------------------------------------------------------------


def test_shading_decides_where_a_mesh_is_read_off(read, points):
    """Smooth: once a vertex. Flat: once a face corner, each with a normal and a point of its own face."""
    bpy.ops.mesh.primitive_torus_add(major_segments=32, minor_segments=12)
    obj = bpy.context.object
    obj.data.shade_smooth()
    found, (surface,) = only(read())
    smooth = points(found)
    assert smooth.domain == "POINT" and len(smooth.points) == 32 * 12
    np.testing.assert_allclose(np.linalg.norm(smooth.normals, axis=1), 1, atol=1e-6)
    obj.data.shade_flat()
    found, (surface,) = only(read())
    flat = points(found)
    assert flat.domain == "CORNER" and len(flat.points) == 32 * 12 * 4
    triangle, _ = surface.shape.nearest(flat.inward)
    own = surface.shape.triangle_normals[triangle]
    assert (np.einsum("ki,ki->k", own, flat.normals) > 0.99).all()


def test_sharp_edges_and_auto_smooth(read, points):
    bpy.ops.mesh.primitive_cylinder_add(vertices=32)
    obj = bpy.context.object
    obj.data.shade_smooth()
    obj.data.set_sharp_from_angle(angle=0.5)
    found, surfaces = only(read())
    assert found.label == "2 polygons, mesh of 32 faces" and len(surfaces) == 3
    read_off = points(found)
    assert read_off.domain == "CORNER" and len(read_off.points) == 4 * 32
    (mesh,) = [k for k, _, _ in read_off.runs if hasattr(read().scene.surfaces[k].shape, "corner_normals")]
    start, stop = next((a, b) for k, a, b in read_off.runs if k == mesh)
    assert np.abs(read_off.normals[start:stop, 2]).max() < 1e-3  # not bent towards the lids


def test_custom_normals_are_those_of_the_mesh(read, points):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    obj = bpy.context.object
    obj.data.shade_smooth()
    up = np.tile([0.0, 0.6, 0.8], (len(obj.data.vertices), 1))
    obj.data.normals_split_custom_set_from_vertices(up.tolist())
    found, _ = only(read())
    np.testing.assert_allclose(points(found).normals, np.tile([0, 0.6, 0.8], (len(up), 1)), atol=2e-3)


def test_materials_part_a_mesh(read):
    bpy.ops.mesh.primitive_torus_add()
    obj = bpy.context.object
    for name in ("A", "B"):
        obj.data.materials.append(scenes.material(name))
    for polygon in obj.data.polygons:
        polygon.material_index = polygon.center.x > 0
    found, surfaces = only(read())
    assert len(surfaces) == 2 and {surface.name for surface in surfaces} == {"Torus mesh 1", "Torus mesh 2"}


def test_open_meshes_have_both_sides_closed_ones_the_outer(read):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20)
    sheet = bpy.context.object
    for vertex in sheet.data.vertices:
        vertex.co.z = 0.2 * np.sin(3 * vertex.co.x) * np.cos(2 * vertex.co.y)
    found, surfaces = only(read())
    assert [surface.side for surface in surfaces] == ["front", "back"] and surfaces[0].shape is surfaces[1].shape


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (1, 2, 0.5)])
def test_mirrored_meshes_face_as_cycles_says(read, points, scale):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    obj = bpy.context.object
    obj.data.shade_smooth()
    obj.scale = scale
    bpy.context.view_layer.update()
    found, (surface,) = only(read())
    read_off = points(found)
    outward = read_off.points / np.array(scale) ** 2
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    assert (np.einsum("ki,ki->k", read_off.normals, outward) > 0.95).all()
    assert (np.einsum("ki,ki->k", surface.normals(read_off.points), read_off.normals) > 0.95).all()


def test_triangulated_by_a_modifier_and_baked(read, points):
    bpy.ops.mesh.primitive_torus_add(major_segments=24, minor_segments=8)
    obj = bpy.context.object
    obj.modifiers.new("Triangulate", "TRIANGULATE").quad_method = "FIXED_ALTERNATE"
    window_wall().modifiers.new("Triangulate", "TRIANGULATE")
    reading = read()
    torus, wall = reading.objects
    assert torus.bakeable and wall.bakeable and wall.label == "polygon"
    assert len(torus.corner_surface) == len(obj.data.loops)
    assert len(torus.triangle_surface) == 2 * len(obj.data.polygons)


def test_faces_that_overlap_in_a_plane_are_a_mesh(read, points):
    """A ramp that winds over itself, flattened: its outline crosses itself."""
    angle = np.linspace(0, 3.5 * np.pi, 40)
    radius = 1 + 0.03 * angle
    inner = np.column_stack([0.6 * np.cos(angle), 0.6 * np.sin(angle), 0 * angle])
    outer = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    faces = [(k, 40 + k, 41 + k, k + 1) for k in range(39)]
    from_faces("Ramp", np.vstack([inner, outer]).tolist(), faces)
    found, surfaces = only(read())
    assert (found.kind, found.exactness) == ("MESH", "approximate") and found.bakeable
    assert points(found).normals is not None


def test_random_faces_are_read(read, points):
    """Lattice points: degenerate, doubled, crossing, coplanar faces of all kinds."""
    rng = np.random.default_rng(6)
    for k in range(40):
        vertices = np.round(rng.normal(size=(10, 3)) * 1.5)
        vertices[:, 2] += 20 * k
        faces = [tuple(rng.choice(10, rng.integers(3, 6), replace=False).tolist()) for _ in range(8)]
        from_faces(f"Odd {k}", vertices.tolist(), faces)
    reading = read()
    assert len(reading.objects) + len(reading.refused) == 40 and len(reading.refused) < 3
    for found in reading.objects:
        read_off = points(found, "CORNER")
        assert len(read_off.scatter) == len(found.object.data.loops) and np.isfinite(read_off.points).all()


# --- baked --------------------------------------------------------------------------------------------------------


def lamp(height=3.0):
    light = scenes.material("Lamp", emission=(5, 5, 5))
    return scenes.sphere("Lamp", radius=0.3, matrix=Matrix.Translation((0, 0, height)), made_of=light)


def mean_of(obj, polygons):
    """Mean red of the corners of some polygons."""
    values = scenes.colours(obj)[:, 0]
    loops = [k for p in polygons for k in obj.data.polygons[p].loop_indices]
    return values[loops].mean()


def test_each_side_of_a_doubled_mesh_has_its_own_light():
    """Its upper faces see the lamp, the lower ones on them do not."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12, size=2)
    sheet = bpy.context.object
    for vertex in sheet.data.vertices:
        vertex.co.z = 0.1 * np.sin(3 * vertex.co.x) * np.cos(2 * vertex.co.y)
    b = bmesh.new()
    b.from_mesh(sheet.data)
    made = bmesh.ops.duplicate(b, geom=list(b.faces))
    bmesh.ops.reverse_faces(b, faces=[g for g in made["geom"] if isinstance(g, bmesh.types.BMFace)])
    b.to_mesh(sheet.data)
    b.free()
    lamp()
    assert bpy.ops.pdm.bake(target_error=0.05, domain="CORNER") == {"FINISHED"}
    up = [p.index for p in sheet.data.polygons if p.normal.z > 0]
    down = [p.index for p in sheet.data.polygons if p.normal.z < 0]
    assert len(up) == len(down) and mean_of(sheet, up) > 0.02 and mean_of(sheet, down) < 1e-3


def test_light_through_a_window_and_not_through_its_wall():
    wall = window_wall(windows=((2, 2),))
    wall.location.z = 1.5
    floor = scenes.grid("Floor", 10, 5.0)
    lamp()
    assert bpy.ops.pdm.bake(target_error=0.05, domain="CORNER") == {"FINISHED"}
    middle = [p.index for p in floor.data.polygons if p.center.length < 0.4]
    beside = [p.index for p in floor.data.polygons if max(abs(p.center.x), abs(p.center.y)) > 2]
    seen = 0.8 * 5 * (0.3 / 3) ** 2  # the whole lamp
    assert mean_of(floor, middle) == pytest.approx(seen, rel=0.1) and mean_of(floor, beside) < 0.1 * seen


@pytest.mark.parametrize("inverted", [False, True])
def test_a_carpet_in_a_cube_as_a_room_is_in_it(inverted):
    """Whichever way the cube's normals look: exactly on its floor and wall, carpet and picture were outside, black."""
    grey = scenes.material("Grey", (0.5, 0.5, 0.5))
    room = Matrix.Translation((0, 0, 1.25)) @ Matrix.Diagonal((4, 3, 2.5, 1))
    scenes.box("Room", 1.0, room, grey, inverted)
    scenes.sphere("Lamp", 16, 8, 0.2, Matrix.Translation((0, 0, 2)), scenes.material("Lamp", emission=(10, 10, 10)))
    wall = Matrix.Translation((0.5, 1.5, 1.2)) @ Matrix.Rotation(np.pi / 2, 4, "X")
    things = [scenes.grid("Carpet", 4, 1.0, made_of=grey), scenes.grid("Picture", 1, 0.6, wall, grey)]
    for level, name in enumerate(("On the Floor", "Over the Floor")):
        matrix = Matrix.Translation((1.0 - 2 * level, 0, 2e-3 * level))
        things.append(scenes.grid(name, 1, 0.4, matrix, grey))
    assert bpy.ops.pdm.bake(target_error=0.02) == {"FINISHED"}
    carpet, picture, on, over = (scenes.colours(obj)[:, 0] for obj in things)
    assert carpet.min() > 0.02 and picture.min() > 0.02
    assert on.mean() == pytest.approx(over.mean(), rel=0.05)


def test_flat_and_smooth_shaded_meshes_are_baked_as_they_are_shaded():
    """A hexagonal ring of many facets under a lamp: flat ones end in edges, smooth ones do not."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=7)
    ball = bpy.context.object
    ball.data.vertices[5].co *= 1.02  # no exact sphere
    lamp(4.0)
    spread = {}
    for name in ("shade_smooth", "shade_flat"):
        getattr(ball.data, name)()
        assert bpy.ops.pdm.bake(target_error=0.02, domain="CORNER") == {"FINISHED"}
        values = scenes.colours(ball)[:, 0]
        vertex = np.array([loop.vertex_index for loop in ball.data.loops])
        spread[name] = max(np.ptp(values[vertex == k]) for k in range(len(ball.data.vertices)))
    assert spread["shade_smooth"] < 0.02 * spread["shade_flat"]


@pytest.mark.parametrize("scale", [(1, 1, 0), (0, 1, 1), (0.5, 0.5, 1e-9)])
def test_a_monkey_scaled_to_nothing_hides_nothing_of_a_furnace(scale):
    """All show 1; the floor under it was down to .95 and the monkey to .3, its emission alone."""
    bpy.ops.mesh.primitive_monkey_add(location=(0.1, 0.2, 1.2), rotation=(0.3, 0.4, 0.2) if scale[0] < 1 else (0, 0, 0))
    monkey = bpy.context.object
    monkey.scale = scale
    objects = [scenes.grid("Floor", 8, 4.0), monkey]
    for k, (obj, grey) in enumerate(zip(objects, (0.5, 0.7))):
        made = scenes.material(f"Grey {k}", (grey,) * 3)
        nodes, links = made.node_tree.nodes, made.node_tree.links
        both, emission = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (1 - grey, 1 - grey, 1 - grey, 1)
        links.new(next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfDiffuse").outputs[0], both.inputs[0])
        links.new(emission.outputs[0], both.inputs[1])
        links.new(both.outputs[0], nodes["Material Output"].inputs["Surface"])
        obj.data.materials.append(made)
    sky()
    bpy.context.view_layer.update()
    assert bpy.ops.pdm.bake(target_error=0.02) == {"FINISHED"}
    for obj in objects:
        np.testing.assert_allclose(scenes.colours(obj)[:, :3], 1.0, atol=5e-3)
