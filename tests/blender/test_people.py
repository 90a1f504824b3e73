"""What showed up in scenes as people make them, each as its smallest case."""

import bpy
import scenes

L = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]


def thing(name, vertices, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def l_room():
    """An L-shaped room open above, its floor one face with a vertex in the corner that points inwards."""
    thing(
        "Walls", [(x, y, z) for z in (0, 2) for x, y in L], [((k + 1) % 6, k, k + 6, (k + 1) % 6 + 6) for k in range(6)]
    )
    return thing("Floor", [(x, y, 0) for x, y in L], [range(6)])


def sky():
    world = bpy.data.worlds.new("Sky")
    world.color = (1, 1, 1)
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    bpy.context.scene.world = world


def test_polygons_under_the_sky_alone():
    floor = l_room()
    sky()
    assert bpy.ops.pdm.bake(target_error=0.04) == {"FINISHED"}
    colours = scenes.colours(floor)[:, :3]
    assert (colours > 0.05).all() and (colours < 1).all()


def test_a_corner_that_points_inwards_sees_along_both_of_its_edges():
    floor = l_room()
    sky()
    bpy.ops.pdm.bake(target_error=0.02)
    colours = scenes.colours(floor)[:, 0]
    beside = colours[[2, 4]].mean()  # at ends of the edges that meet there
    assert abs(colours[2] - colours[4]) < 0.03 * beside
    assert colours[3] > 1.3 * beside


def test_a_vertex_in_the_edge_of_a_box_is_read_beside_it():
    """The floor's vertices at the foot of a box are as bright as just before it, not half in the dark."""
    l_room()  # for a polygon
    x = (0, 0.5, 0.99, 1.0, 1.5, 2.0)
    faces = [(6 * j + i, 6 * j + i + 1, 6 * j + i + 7, 6 * j + i + 6) for j in range(5) for i in range(5)]
    ground = thing("Ground", [(a, b - 5, 0) for b in x for a in x], faces)
    crate = scenes.add("Crate", lambda b: scenes.bmesh.ops.create_cube(b, size=1))
    crate.location = (1.5, -3.5, 0.5)
    sky()
    bpy.ops.pdm.bake(target_error=0.02)
    colours = scenes.colours(ground)[:, 0].reshape(6, 6)
    assert abs(colours[4, 3] / colours[4, 2] - 1) < 0.04  # in its edge, and 1 cm before it
    assert abs(colours[3, 3] / colours[2, 2] - 1) < 0.03  # at its corner
    around = colours[3:, 3:].ravel()[[0, 1, 2, 3, 5, 6, 7, 8]]
    assert around.min() <= colours[4, 4] <= around.max()  # under it, where nobody looks


def test_what_modifiers_leave_without_colours_is_said(addon):
    floor = l_room()
    post = scenes.add("Post", lambda b: scenes.bmesh.ops.create_cube(b, size=0.2))
    post.location = (1, 1, 0.5)
    post.modifiers.new("Array", "ARRAY")
    sky()
    bpy.ops.pdm.bake(target_error=0.1)
    report = bpy.context.scene.pdm_radiosity.report()
    assert [text for text in report["warnings"] if "'Post'" in text and "Apply Modifiers" in text]
    bpy.ops.pdm.bake(target_error=0.1, apply_modifiers=True)
    report = bpy.context.scene.pdm_radiosity.report()
    assert not [text for text in report["warnings"] if "Apply Modifiers" in text]
    assert scenes.colours(floor).any() and all(entry["baked"] for entry in report["objects"])


def test_a_cup_is_dark_where_it_stands():
    """Its foot, smooth and pressed on the table, does not see the sky under it."""
    thing("Table", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
    cup = scenes.add(
        "Cup",
        lambda b: scenes.bmesh.ops.create_cone(
            b, cap_ends=True, cap_tris=True, segments=24, radius1=0.2, radius2=0.3, depth=0.6
        ),
    )
    cup.location = (0, 0, 0.3)
    cup.data.polygons.foreach_set("use_smooth", [True] * len(cup.data.polygons))
    sky()
    bpy.ops.pdm.bake(target_error=0.04)
    foot = [k for k, v in enumerate(cup.data.vertices) if v.co.z < -0.29 and v.co.xy.length < 0.1]
    colours = scenes.colours(cup)[:, 0]
    if len(colours) != len(cup.data.vertices):
        foot = [k for k, loop in enumerate(cup.data.loops) if loop.vertex_index in foot]
    assert len(foot) and colours[foot].max() < 0.2 < colours.max()
