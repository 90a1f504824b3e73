"""Subdivide for the Bake: the shapes stay the same, what the mesh carries is kept, there are no cracks."""

import json
import math

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix
from test_bake import bake


@pytest.fixture
def subdivide(addon):
    def run(obj, times):
        addon("operators.subdivide").subdivide({obj: times})
        return obj

    return run


@pytest.fixture
def shapes_of(addon):
    """MeshShapes of an object's mesh."""

    def find(obj):
        arrays = addon("operators.reading.mesh_arrays").arrays_of(obj.data)
        return addon("operators.reading.mesh_shapes").find_shapes(arrays.vertices, arrays.corners, arrays.counts)

    return find


def is_whole(mesh, euler):
    """No cracks: vertices - edges + faces is what the closed or open shape has, and no edge has one face in a closed
    one."""
    work = bmesh.new()
    work.from_mesh(mesh)
    count = len(work.verts) - len(work.edges) + len(work.faces)
    rims = sum(edge.is_boundary for edge in work.edges)
    loose = sum(not edge.link_faces for edge in work.edges)
    work.free()
    return count == euler and not loose and (rims == 0) == (euler == 2)


@pytest.mark.parametrize("times", [2, 3, 7])
@pytest.mark.parametrize("segments, rings", [(3, 3), (8, 4), (32, 16)])
def test_a_uv_sphere_becomes_a_finer_one(subdivide, shapes_of, segments, rings, times):
    ball = subdivide(scenes.sphere("Ball", segments, rings, radius=2.5), times)
    shapes = shapes_of(ball)
    (found,) = shapes.shapes
    assert (found.segments, found.rings) == (times * segments, times * rings)
    assert len(ball.data.vertices) == found.segments * (found.rings - 1) + 2 and is_whole(ball.data, 2)
    np.testing.assert_allclose(found.matrix, np.diag([2.5, 2.5, 2.5, 1.0]), atol=3e-6)
    radius = np.linalg.norm(scenes.vertices(ball), axis=1)
    np.testing.assert_allclose(radius, 2.5, rtol=3e-5)


def test_spheres_sheared_moved_inverted_and_triangulated(subdivide, shapes_of):
    def build(b):
        bmesh.ops.create_uvsphere(b, u_segments=12, v_segments=7, radius=1.0)
        bmesh.ops.triangulate(b, faces=b.faces)
        bmesh.ops.reverse_faces(b, faces=b.faces)
        bmesh.ops.transform(
            b, matrix=Matrix(((1, 0.4, 0, 3), (0, 2, 0, 1), (0.2, 0, 0.5, 0), (0, 0, 0, 1))), verts=b.verts
        )

    ball = scenes.add("Ball", build)
    (before,) = shapes_of(ball).shapes
    (after,) = shapes_of(subdivide(ball, 4)).shapes
    assert (after.segments, after.rings, after.is_outward) == (48, 28, False)
    # the same ellipsoid, whatever its axes are called
    np.testing.assert_allclose(
        after.matrix[:3, :3] @ after.matrix[:3, :3].T, before.matrix[:3, :3] @ before.matrix[:3, :3].T, atol=2e-5
    )
    np.testing.assert_allclose(after.matrix[:3, 3], before.matrix[:3, 3], atol=1e-5)


def test_boxes_and_grids_stay_their_planes(subdivide, shapes_of):
    box = subdivide(scenes.box("Box", 3.0), 5)
    assert shapes_of(box).label == "6 planes" and len(box.data.polygons) == 150 and is_whole(box.data, 2)
    floor = subdivide(scenes.grid("Floor", 2, 4.0), 8)
    assert shapes_of(floor).label == "plane" and len(floor.data.vertices) == 17**2 and is_whole(floor.data, 1)
    odd = scenes.add("Odd", lambda b: bmesh.ops.create_circle(b, segments=7, radius=1.0, cap_ends=True))
    assert is_whole(subdivide(odd, 3).data, 1)


def test_a_mesh_of_balls_and_planes(subdivide, shapes_of):
    def build(b):
        bmesh.ops.create_grid(b, x_segments=1, y_segments=1, size=5)
        for x in (-2, 2):
            bmesh.ops.create_uvsphere(b, u_segments=8, v_segments=6, radius=1, matrix=Matrix.Translation((x, 0, 2)))

    shapes = shapes_of(subdivide(scenes.add("Both", build), 2))
    assert shapes.label == "2 UV spheres, 1 plane"
    assert {getattr(shape, "segments", 16) for shape in shapes.shapes} == {16}


def carrying(obj):
    """UVs, attributes of each domain, a seam, a sharp edge, two materials, a vertex group, linear in x."""
    mesh = obj.data
    for name in ("One", "Two"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons[0].material_index = 1
    layer = mesh.uv_layers.new(name="Map")
    work = bmesh.new()
    work.from_mesh(mesh)
    for face in work.faces:
        face.smooth = True
        for loop in face.loops:
            loop[work.loops.layers.uv["Map"]].uv = loop.vert.co.xy
    work.edges.ensure_lookup_table()
    work.edges[0].seam, work.edges[0].smooth = True, False
    work.to_mesh(mesh)
    work.free()
    height = mesh.attributes.new("height", "FLOAT", "POINT")
    height.data.foreach_set("value", scenes.vertices(obj)[:, 0].astype(np.float32))
    mesh.attributes.new("tag", "INT", "FACE").data[0].value = 7
    group = obj.vertex_groups.new(name="Weight")
    for index, co in enumerate(scenes.vertices(obj)):
        group.add([index], co[0] + 0.5, "REPLACE")
    return layer


def test_what_the_mesh_carries_is_kept(subdivide):
    box = scenes.box("Box", 1.0)
    carrying(box)
    mesh = subdivide(box, 4).data
    x = scenes.vertices(box)[:, 0]
    uv = np.array([loop.uv[:] for loop in mesh.uv_layers["Map"].data])
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    np.testing.assert_allclose(uv, scenes.vertices(box)[corner, :2], atol=1e-6)
    np.testing.assert_allclose([item.value for item in mesh.attributes["height"].data], x, atol=1e-6)
    assert sum(item.value == 7 for item in mesh.attributes["tag"].data) == 16
    assert sum(p.material_index == 1 for p in mesh.polygons) == 16 and all(p.use_smooth for p in mesh.polygons)
    assert sum(e.use_seam for e in mesh.edges) == sum(e.use_edge_sharp for e in mesh.edges) == 4
    weights = [next((g.weight for g in v.groups), 0.0) for v in mesh.vertices]
    np.testing.assert_allclose(weights, x + 0.5, atol=1e-6)
    assert [m.name for m in mesh.materials] == ["One", "Two"] and box.vertex_groups[0].name == "Weight"


def test_custom_normals_are_kept(subdivide):
    floor = scenes.grid("Floor", 1, 2.0)
    tilted = np.tile(np.array([0.6, 0.0, 0.8]), (4, 1))
    floor.data.normals_split_custom_set(tilted.tolist())
    names = {a.name for a in floor.data.attributes}
    mesh = subdivide(floor, 3).data
    normals = np.array([n.vector[:] for n in mesh.corner_normals])
    np.testing.assert_allclose(normals, np.tile(tilted[0], (len(normals), 1)), atol=1e-3)
    assert {a.name for a in mesh.attributes} == names


def test_a_balls_texture_map_has_no_jumps(subdivide):
    """Each new corner's UV is within its old face's, and neighbours in a face stay neighbours in the map."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, calc_uvs=True)
    mesh = subdivide(bpy.context.object, 2).data
    uv = np.array([loop.uv[:] for loop in mesh.uv_layers[0].data])
    for polygon in mesh.polygons:
        own = uv[polygon.loop_start : polygon.loop_start + polygon.loop_total]
        assert (np.ptp(own, axis=0) < (1.1 / 16, 1.1 / 16)).all()


@pytest.mark.parametrize("method", ["ADAPTIVE", "UNIFORM"])
def test_the_report_asks_for_it_and_it_is_enough(method):
    floor, ball, lamp = scenes.lit_ball()
    lamp.data.materials[0], before = lamp.data.materials[0], len(floor.data.vertices)
    report = bake()
    assert report["between_vertices"] > 0.05
    assert bpy.ops.pdm.subdivide(method=method) == {"FINISHED"}
    report = bake()
    assert report["between_vertices"] <= 0.01
    assert len(floor.data.vertices) > before and len(lamp.data.vertices) == 4
    assert is_whole(floor.data, 1) and is_whole(ball.data, 2)
    assert next(o["label"] for o in report["objects"] if o["name"] == "Ball").startswith("UV sphere")


@pytest.mark.parametrize("method", ["ADAPTIVE", "UNIFORM"])
def test_the_light_at_hand_is_not_solved_again(addon, monkeypatch, method):
    """What a bake has kept is taken as it is; where an object has been turned in its place since, it is solved."""
    floor, _, _ = scenes.lit_ball()
    bake_steps, last = addon("operators.baking.bake"), addon("operators.baking.again").last
    light, finish = addon("operators.light_at_hand"), addon("pdm_core.signs_of_life").finish
    solve, solved = light.solve_steps, []
    monkeypatch.setattr(light, "solve_steps", lambda *words: solved.append(True) or solve(*words))
    report = finish(bake_steps.bake_steps(bpy.context, bake_steps.BakeSettings(target_error=0.05), last=last))
    names = {entry["name"] for entry in report["objects"] if entry["baked"]}
    found = finish(light.light_steps(bpy.context, report, names, lambda: False))[2]
    assert (before := found) is last.solution and not solved
    floor.rotation_euler.z = np.pi / 8
    bpy.context.view_layer.update()
    found = finish(light.light_steps(bpy.context, report, names, lambda: False))[2]
    assert found is not before and solved
    solved.clear()  # it is what is at hand now
    assert finish(addon("operators.subdivide").subdivide_steps(bpy.context, method))[0] > 0
    assert not solved
    last.drop()


def test_parts_are_the_fewest_that_are_enough(addon):
    """Of a light whose error between vertices is known; the report had it from a few points, 2 times off."""
    uniform = addon("operators.uniform")
    truth = lambda n: 0.2 * n**-1.5  # noqa: E731
    wrong = [(1, truth(1)), *((n, 2 * truth(n)) for n in (2, 4, 8, 16))]
    known, times = {1: truth(1)}, uniform.needed([wrong], [1.0], 0.01)
    for _ in range(uniform.LOOKS):
        known[int(times[0])] = truth(times[0])
        times = uniform.needed([sorted(known.items())], [1.0], 0.01)
    assert times.tolist() == [math.ceil((0.2 / 0.01) ** (1 / 1.5))] and int(times[0]) in known


@pytest.mark.parametrize("method", ["ADAPTIVE", "UNIFORM"])
def test_the_budget_is_kept(method):
    scenes.lit_ball()
    bake()
    bpy.ops.pdm.subdivide(method=method, budget=500)
    assert 143 < sum(len(obj.data.vertices) for obj in bpy.data.objects) <= 500
    assert "the vertices allowed are too few" in bpy.context.scene.pdm_radiosity.report()["warnings"][-1]


@pytest.mark.parametrize("by", ["limit", "wish"])
def test_it_ends_at_the_time_limit_or_by_a_wish(addon, monkeypatch, by):
    """Shapes that run through one another, along whose seams the light jumps."""
    floor, ball, lamp = scenes.lit_ball()
    ball.location.z = 0
    report, adaptive = bake(), addon("operators.adaptive")
    before = len(floor.data.vertices) + len(ball.data.vertices)
    if by == "limit":
        light = addon("operators.light_at_hand")
        solve = light.solve_steps
        monkeypatch.setattr(light, "solve_steps", lambda scene, target, limit, enough: solve(scene, target))
        report["settings"]["time_limit"] = 1e-9
    steps = adaptive.adaptive_steps(bpy.context, report, 10_000, enough=lambda: by == "wish")
    _, added, short = addon("pdm_core.signs_of_life").finish(steps)
    assert short == "it was ended early"
    assert 0 < added == len(floor.data.vertices) + len(ball.data.vertices) - before < 1000  # one round's


def spot_on(obj):
    """A small lamp close over the middle of the top of a unit box, in the dark: the light bends there alone."""
    matrix = Matrix.Translation((0.1, 0, 0.6)) @ Matrix.Rotation(np.pi, 4, "X")
    scenes.grid("Lamp", 1, 0.1, matrix, scenes.material("Glow", emission=(5.0, 5.0, 5.0)))
    if not obj.data.materials:
        obj.data.materials.append(scenes.material("Grey"))


def test_what_the_mesh_carries_is_kept_adaptively():
    box = scenes.box("Box", 1.0)
    carrying(box)
    spot_on(box)
    bake(target_error=0.05)
    assert bpy.ops.pdm.subdivide() == {"FINISHED"}
    mesh, x = box.data, scenes.vertices(box)[:, 0]
    assert 20 < len(mesh.vertices) < 2000 and is_whole(mesh, 2)
    uv = np.array([loop.uv[:] for loop in mesh.uv_layers["Map"].data])
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    np.testing.assert_allclose(uv, scenes.vertices(box)[corner, :2], atol=1e-6)
    np.testing.assert_allclose([item.value for item in mesh.attributes["height"].data], x, atol=1e-6)
    weights = [next((g.weight for g in v.groups), 0.0) for v in mesh.vertices]
    np.testing.assert_allclose(weights, x + 0.5, atol=1e-6)
    assert [m.name for m in mesh.materials[:2]] == ["One", "Two"] and all(p.use_smooth for p in mesh.polygons)
    area = np.array([p.area for p in mesh.polygons])
    for kept in ([p.material_index == 1 for p in mesh.polygons], [i.value == 7 for i in mesh.attributes["tag"].data]):
        assert area[np.array(kept)].sum() == pytest.approx(1, rel=1e-6)
    ends = scenes.vertices(box)[[edge.vertices[:] for edge in mesh.edges]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert length[[e.use_seam for e in mesh.edges]].sum() == pytest.approx(1, rel=1e-6)
    assert length[[e.use_edge_sharp for e in mesh.edges]].sum() == pytest.approx(1, rel=1e-6)
    assert {a.name for a in mesh.attributes if "pdm" in a.name} == set()
    # the bottom is in the dark: its quad is as it was
    assert sum(len(p.vertices) == 4 and p.center.z < -0.49 for p in mesh.polygons) == 1
    entry = next(o for o in bake(target_error=0.05)["objects"] if o["name"] == "Box")
    assert entry["label"] == "6 planes" and entry["exactness"] == "exact"


def test_custom_normals_are_kept_adaptively():
    floor, _, _ = scenes.lit_ball()
    tilted = np.tile(np.array([0.6, 0.0, 0.8]), (len(floor.data.loops), 1))
    floor.data.normals_split_custom_set(tilted.tolist())
    bake()
    bpy.ops.pdm.subdivide()
    assert len(floor.data.vertices) > 100
    normals = np.array([n.vector[:] for n in floor.data.corner_normals])
    np.testing.assert_allclose(normals, np.tile(tilted[0], (len(normals), 1)), atol=1e-3)


def test_polygons_with_holes_are_refined_and_stay_polygons():
    def frame(b):
        bmesh.ops.create_grid(b, x_segments=3, y_segments=3, size=2)
        middle = [f for f in b.faces if f.calc_center_median().length < 0.1]
        bmesh.ops.delete(b, geom=middle, context="FACES")
        bmesh.ops.dissolve_faces(b, faces=b.faces[:4])

    wall = scenes.add("Wall", frame, made_of=scenes.material("Wall"))
    scenes.sphere("Ball", matrix=Matrix.Translation((1, 0, 1.5)), made_of=scenes.material("Ball"))
    lamp = Matrix.Translation((1, 0, 4)) @ Matrix.Rotation(np.pi, 4, "X")
    scenes.grid("Lamp", 1, 1.0, lamp, scenes.material("Lamp", emission=(5.0, 4.0, 3.0)))
    label = next(o["label"] for o in bake(target_error=0.02)["objects"] if o["name"] == "Wall")
    bpy.ops.pdm.subdivide()
    after = bake(target_error=0.02)
    assert after["between_vertices"] <= 0.02 and len(wall.data.vertices) > 100
    assert next(o["label"] for o in after["objects"] if o["name"] == "Wall") == label == "polygon"
    assert is_whole(wall.data, 0)


def test_two_faces_on_both_sides_of_a_vertex_have_no_triangle_in_common(addon):
    """Suzanne has a vertex of two edges: both of its faces, cut across its neighbours, left one triangle twice."""
    bpy.ops.mesh.primitive_monkey_add()
    mesh = bpy.context.object.data
    found = addon("operators.baking.adaptive_mesh").triangulated(mesh)
    assert len(found.corners) == len(mesh.loop_triangles)
    corners = np.sort(found.corners, axis=1)
    assert len(np.unique(corners, axis=0)) == len(corners)
    edges = np.sort(found.corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert np.unique(edges, axis=0, return_counts=True)[1].max() == 2


def test_copies_leave_the_objects_as_they_were():
    floor, ball, _ = scenes.lit_ball()
    bake()
    bpy.ops.pdm.subdivide(copies=True)
    assert len(floor.data.vertices) == 25 and len(ball.data.vertices) == 114 and floor.hide_render
    copies = [obj for obj in bpy.context.scene.objects if obj.name.startswith(("Floor.", "Ball."))]
    assert len(copies) == 2 and all(len(obj.data.vertices) > 150 and not obj.hide_render for obj in copies)
    report = bake()
    assert report["between_vertices"] <= 0.01 and {o["name"] for o in report["objects"]} == {
        "Floor.001", "Ball.001", "Lamp"
    }  # fmt: skip


def test_what_fails_leaves_all_meshes_as_they_were(addon, monkeypatch):
    floor, ball, _ = scenes.lit_ball()
    bake()
    before, count, cut = len(bpy.data.meshes), [0], addon("operators.adaptive").cut

    def fail_second(*arguments):
        count[0] += 1
        if count[0] == 2:
            raise MemoryError("full")
        cut(*arguments)

    monkeypatch.setattr(addon("operators.adaptive"), "cut", fail_second)
    for copies in (False, True):
        count[0] = 0
        with pytest.raises(RuntimeError, match="full"):
            bpy.ops.pdm.subdivide(copies=copies)
        assert count[0] == 2 and len(floor.data.vertices) == 25 and len(ball.data.vertices) == 114
        assert len(bpy.data.meshes) == before and not floor.hide_render


def test_uniform_after_adaptive_keeps_the_sphere(addon, shapes_of):
    _, ball, _ = scenes.lit_ball()
    bake(target_error=0.03)
    bpy.ops.pdm.subdivide()
    (shape,) = shapes_of(ball).shapes
    count = len(ball.data.polygons)
    assert not shape.is_even
    addon("operators.subdivide").subdivide({ball: 2})
    (finer,) = shapes_of(ball).shapes
    assert len(ball.data.polygons) > 3 * count and is_whole(ball.data, 2)
    np.testing.assert_allclose(finer.matrix, shape.matrix, atol=1e-5)


def test_few_vertices(addon):
    """The errors' root sum of squares is below the target, and no object could do with fewer parts."""
    needed = addon("operators.uniform").needed
    errors, faces = np.array([0.3, 0.04, 0.0001, 0.2]), np.array([1.0, 500, 8, 30])
    curves = [[(1, error), *((n, error / n**2) for n in (2, 4, 8))] for error in errors]

    def left(times):
        return np.sqrt((errors**2 / times**4.0).sum())

    times = needed(curves, faces, 0.01)
    assert times[2] == 1 and times[0] > times[3] > times[1] > 1 and 0.006 < left(times) <= 0.01
    best = (errors**2 / faces) ** (1 / 6)  # least sum of faces N^2, see Lagrange
    best *= ((errors**2 / best**4).sum() / 0.01**2) ** 0.25
    assert (faces * times**2).sum() < 1.8 * (faces * np.maximum(best, 1) ** 2).sum()
    assert (needed(curves, faces, 1.0) == 1).all()
    # a shadow that two parts do not show yet
    assert needed([[(1, 0.3), (2, 0.3), (4, 0.1), (8, 0.02)], [(1, 0.001)]], [1, 1000], 0.02).tolist()[1] == 1


def test_a_glare_that_nobody_sees_does_not_hide_the_shadows():
    """A lamp just below a ceiling, as in the Cornell box: most of all light is on the ceiling behind it."""
    white = scenes.material("White", (0.7, 0.7, 0.7))
    floor = scenes.grid("Floor", 1, 5.0, made_of=white)
    up = Matrix.Translation((0, 0, 5)) @ Matrix.Rotation(np.pi, 4, "X")
    scenes.grid("Ceiling", 1, 5.0, up, white)
    scenes.grid("Lamp", 1, 1.0, Matrix.Translation((0, 0, -0.002)) @ up, scenes.material("Lamp", emission=(20, 20, 20)))
    scenes.box("Box", 1.5, Matrix.Translation((0.3, 0.2, 1.5)), white)
    bpy.ops.pdm.bake(target_error=0.05)
    bpy.ops.pdm.subdivide()
    assert len(floor.data.vertices) > 50
    bpy.ops.pdm.bake(target_error=0.05)
    colours, at = scenes.colours(floor)[:, 0], scenes.vertices(floor)[:, :2]
    if len(colours) != len(at):
        at = at[[loop.vertex_index for loop in floor.data.loops]]
    shadow = np.abs(at - [0.3, 0.2]).max(axis=1) < 0.5
    assert shadow.any() and colours[shadow].max() < 0.5 * colours.max()


def test_what_cannot_be_subdivided_is_said():
    floor, _, _ = scenes.lit_ball()
    with pytest.raises(RuntimeError, match="Bake first"):
        bpy.ops.pdm.subdivide()
    floor.shape_key_add(name="Basis")
    bpy.ops.object.select_all(action="DESELECT")
    floor.select_set(True)
    with pytest.raises(RuntimeError, match="Floor.*shape keys"):
        bpy.ops.pdm.subdivide(times=2, objects="SELECTED")
    assert len(floor.data.vertices) == 25


@pytest.mark.parametrize("method", ["ADAPTIVE", "UNIFORM"])
def test_meshes_that_stay_too_coarse_are_told_with_the_reason(method):
    """Of two floors that are too coarse the one that cannot be changed stays, and it is said why: always."""
    floor, _, _ = scenes.lit_ball()
    floor.shape_key_add(name="Basis")
    scenes.grid("Other", 1, 3.0, Matrix.Translation((0, 4, 0)), made_of=scenes.material("Other"))
    bake(target_error=0.03)
    said = "'Floor' has shape keys; apply or remove them"
    assert bpy.ops.pdm.subdivide(method=method) == {"FINISHED"}
    assert said in bpy.context.scene.pdm_radiosity.report()["warnings"][-1]
    bake(target_error=0.03)
    assert bpy.ops.pdm.subdivide(method=method) == {"CANCELLED"}
    assert said in bpy.context.scene.pdm_radiosity.report()["warnings"][-1]
    assert len(floor.data.vertices) == 25


def test_the_baked_attribute_stays_the_active_one():
    floor, _, _ = scenes.lit_ball()
    other = floor.data.color_attributes.new(name="Other", type="BYTE_COLOR", domain="CORNER")
    other.data.foreach_set("color", np.full(4 * len(other.data), 0.5, np.float32))
    bake()
    bpy.ops.pdm.subdivide()
    colours = floor.data.color_attributes
    assert colours.active_color_name == "Radiosity" and len(floor.data.color_attributes["Other"].data) > 64
    np.testing.assert_allclose(scenes.colours(floor, "Other"), 0.5, atol=0.01)


def test_the_command_line_subdivides(addon, tmp_path, capfd):
    scenes.lit_ball()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    report = tmp_path / "report.json"
    main = addon("operators.command_line").main
    assert main(["bake", "--subdivide", "--report", str(report)]) == 0
    assert json.loads(report.read_text())["between_vertices"] <= 0.01
    assert "subdivided" in capfd.readouterr().err
    assert main(["bake", "--subdivide", "0", "--report", str(report)]) == 2
