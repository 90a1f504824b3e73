"""Textured scenes as the core gets them: colours at places, means, what is a light, what is missing or named."""

import bmesh
import bpy
import cycles_colours
import node_tables
import numpy as np
import pytest
import scenes
from mathutils import Matrix


@pytest.fixture
def read(addon):
    def reading(**settings):
        bpy.context.view_layer.update()
        return addon("operators.reading.read_scene").read_scene(bpy.context, **settings)

    return reading


def picture(t, image=None, **settings):
    return t.add("TexImage", image=image or node_tables.image(size=(16, 16)), **settings).outputs["Color"]


def emission(name, build, strength=1.0):
    """An Emission material of the colour that build(Tree) returns."""
    made = scenes.new_material(name)
    made.node_tree.nodes.clear()
    tree = node_tables.Tree(made.node_tree)
    shader = tree.add("Emission", {"Color": build(tree), "Strength": strength})
    tree.add("OutputMaterial", {"Surface": shader})
    return made


def textured(obj, scale=1.0):
    """A UV map by the places of the corners, each face the whole square where scale is None."""
    mesh = obj.data
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    uv = scenes.vertices(obj)[vertex, :2] * (scale or 1.0) + 0.5
    if scale is None:
        uv = np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (len(mesh.polygons), 1))
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.astype(np.float32).ravel())
    return obj


def colour_at(surface, points):
    return surface.reflectance_at(np.asarray(points, float))


def test_a_floor_of_checks(read):
    """Checks of a quarter, black and white: right at places, and half on the whole."""
    checks = node_tables.material(
        "Checks",
        lambda t: t.add("TexChecker", {"Vector": t.uv(), "Color1": (0.8,) * 3, "Color2": (0.2,) * 3, "Scale": 8.0}),
    )
    turned = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.7, 4, "X")
    textured(scenes.grid("Floor", 3, 1.0, turned, checks))
    reading = read()
    front = reading.scene.surfaces[0]
    at = np.random.default_rng(0).uniform(-0.5, 0.5, (500, 2))
    is_one = (np.floor(8 * (at + 0.5)) @ [1, 1]).astype(int) % 2 == 1
    world = np.column_stack([at, np.zeros(500), np.ones(500)]) @ np.array(turned).T
    np.testing.assert_allclose(colour_at(front, world[:, :3])[:, 0], np.where(is_one, 0.8, 0.2), atol=1e-6)
    np.testing.assert_allclose(reading.scene.reflectance[0], 0.5, atol=0.01)
    assert front.varies and not reading.warnings


def test_spheres_are_mapped_by_their_faces(read):
    """At the corners of its faces a ball shows what Cycles bakes there."""
    made = node_tables.material("Picture", picture)
    ball = scenes.add(
        "Ball",
        lambda b: bmesh.ops.create_uvsphere(b, u_segments=24, v_segments=12, radius=1.0, calc_uvs=True),
        Matrix.Diagonal((1.0, 0.8, 1.3, 1.0)),
        made,
    )
    surface = next(s for s in read().scene.surfaces if s.name.startswith("Ball"))
    theirs = cycles_colours.baked(ball)
    inner = np.abs(theirs - colour_at(surface, cycles_colours.corners(ball))).max(axis=1)
    assert np.median(inner) < 1e-3
    assert (inner > 5e-3).mean() < 0.05  # across the seam and at the poles faces share a corner


def test_boxes_whose_faces_show_the_image_each(read):
    image = node_tables.image(size=(8, 8))
    each = node_tables.material("Each", lambda t: picture(t, image, interpolation="Closest"))
    box = textured(scenes.box("Box", 2.0, made_of=each), None)
    scenes.grid("Floor", 1, 9.0, Matrix.Translation((0, 0, -3)))
    scene = read().scene
    mean = np.array(image.pixels[:]).reshape(8, 8, 4)[..., :3]
    mean = np.where(mean <= 0.04045, mean / 12.92, ((mean + 0.055) / 1.055) ** 2.4).mean(axis=(0, 1))
    sides = [k for k, s in enumerate(scene.surfaces) if s.name.startswith("Box") and "back" not in s.name]
    assert len(sides) == 6 and len(box.data.polygons) == 6
    np.testing.assert_allclose(scene.reflectance[sides], np.tile(mean, (6, 1)), rtol=0.02)


def test_pictures_light_only_what_nothing_else_lights(read):
    textured(scenes.grid("Backdrop", 1, 1.0, made_of=emission("Sky card", picture)))
    scenes.grid("Floor", 1, 4.0, Matrix.Translation((0, 0, -1)), scenes.material("Floor"))
    alone = read()
    assert alone.scene.emission[0].max() > 0.1 and not alone.warnings
    scenes.grid("Lamp", 1, 1.0, Matrix.Translation((0, 0, 3)), scenes.material("Lamp", emission=(5, 5, 5)))
    lit = read()
    assert not lit.scene.emission[0].any() and lit.scene.emission.max() > 1
    said = [text for text in lit.warnings if "Sky card" in text]
    assert len(said) == 1 and all(word in said[0] for word in ("Backdrop", "picture", "not a light", "Strength"))


def test_a_picture_turned_up_is_a_light(read):
    textured(scenes.grid("Screen", 1, 1.0, made_of=emission("Screen", picture, 3.0)))
    scenes.grid("Lamp", 1, 1.0, Matrix.Translation((0, 0, 3)), scenes.material("Lamp", emission=(5, 5, 5)))
    scene = read().scene
    screen = next(k for k, s in enumerate(scene.surfaces) if s.name == "Screen")
    assert scene.emission[screen].min() > 0.3


def test_a_world_makes_pictures_of_them(read):
    textured(scenes.grid("Backdrop", 1, 1.0, made_of=emission("Card", picture)))
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    world.color = (0.3, 0.3, 0.3)
    if world.node_tree:
        background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
        background.inputs["Color"].default_value = (0.3, 0.3, 0.3, 1)
    reading = read()
    assert not reading.scene.emission.any() and "not a light" in reading.warnings[0]


def test_missing_images_and_uv_maps_are_named(read):
    lost = bpy.data.images.new("Lost", 4, 4)
    lost.source, lost.filepath = "FILE", "//nowhere.png"
    scenes.grid("One", 1, 1.0, made_of=node_tables.material("Torn", lambda t: picture(t, lost)))
    made = node_tables.material("Unmapped", lambda t: t.add("TexImage", {"Vector": t.uv()}, image=node_tables.image()))
    scenes.grid("Two", 1, 1.0, Matrix.Translation((0, 0, 1)), made)
    said = "\n".join(read().warnings)
    for word in ("Torn", "Lost", "missing", "plain value", "'Two'", "UV map 'UVMap'"):
        assert word in said


def test_generated_coordinates_that_cannot_be_followed_are_named(read):
    made = node_tables.material("Place", lambda t: t.add("TexCoord").outputs["Generated"])
    for name, kinds in (("Finer", ["SUBSURF"]), ("Moved", ["WAVE"]), ("Both", ["WAVE", "SUBSURF"])):
        obj = scenes.grid(name, 3, made_of=made)
        for kind in kinds:
            obj.modifiers.new(kind.title(), kind)
    told = [text for text in read().warnings if "Generated" in text]
    assert len(told) == 1 and "'Both'" in told[0]


def test_tiles_are_read_from_their_files(read, tmp_path):
    for number, rgb in ((1001, (1.0, 0.0, 0.0)), (1002, (0.0, 1.0, 0.0))):
        one = bpy.data.images.new("Tile", 4, 4)
        one.pixels.foreach_set(np.tile(np.float32([*rgb, 1]), 16))
        one.filepath_raw, one.file_format = str(tmp_path / f"wall.{number}.png"), "PNG"
        one.save()
    tiled = bpy.data.images.load(str(tmp_path / "wall.1001.png"))
    tiled.source = "TILED"
    tiled.filepath = str(tmp_path / "wall.<UDIM>.png")
    if len(tiled.tiles) < 2:
        tiled.tiles.new(1002)
    images = len(bpy.data.images)
    floor = scenes.grid("Wall", 1, 1.0, made_of=node_tables.material("Tiles", lambda t: picture(t, tiled)))
    textured(floor).data.uv_layers[0].uv.foreach_set("vector", np.float32([0, 0, 2, 0, 2, 1, 0, 1]))
    reading = read()
    front = reading.scene.surfaces[0]
    corners = cycles_colours.corners(floor)
    along = corners[1] - corners[0]
    found = colour_at(front, [corners[0] + 0.25 * along, corners[0] + 0.75 * along])
    np.testing.assert_allclose(found, [[1, 0, 0], [0, 1, 0]], atol=1e-5)
    assert not reading.warnings and len(bpy.data.images) == images


def test_holes_are_named_and_what_is_wholly_clear_takes_no_part(read):
    leaf = scenes.new_material("Leaf")
    shader = next(n for n in leaf.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    node = node_tables.Tree(leaf.node_tree).add("TexImage", image=node_tables.image(alpha=True))
    leaf.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    leaf.node_tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
    textured(scenes.grid("Plant", 1, 1.0, made_of=leaf))
    air = scenes.new_material("Air")
    air.node_tree.nodes.clear()
    tree = node_tables.Tree(air.node_tree)
    tree.add("OutputMaterial", {"Surface": tree.add("BsdfTransparent")})
    scenes.grid("Pane", 1, 1.0, Matrix.Translation((0, 0, 1)), air)
    reading = read()
    assert any("Leaf" in text and "Alpha" in text for text in reading.warnings)
    assert reading.refused == [("Pane", "is wholly transparent and takes no part in this light")]


@pytest.mark.parametrize("name", ["Radiosity", ""])
def test_a_shown_bake_is_no_light(read, name):
    """B1: also through other nodes, and as the attribute without a name."""

    def build(t):
        return t.add("Gamma", {"Color": t.add("VertexColor", layer_name=name).outputs["Color"]})

    floor = scenes.grid("Floor", 2, 1.0, made_of=emission("Shown", build))
    colours = floor.data.color_attributes
    made = colours.new("Radiosity", "FLOAT_COLOR", "POINT")
    made.data.foreach_set("color", np.ones(4 * len(made.data), np.float32))
    colours.active_color = made
    colours.render_color_index = 0
    reading = read(baked=("Radiosity",))
    assert not reading.scene.emission.any()
    assert any("baked attribute 'Radiosity'" in text for text in reading.warnings)


def test_nothing_of_blender_is_asked_later(read):
    """What varies is evaluated from copies: the scene may be emptied meanwhile."""
    textured(scenes.grid("Floor", 2, 1.0, made_of=node_tables.material("Kept", picture)))
    surface = read().scene.surfaces[0]
    before = colour_at(surface, np.zeros((1, 3)))
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
    np.testing.assert_array_equal(colour_at(surface, np.zeros((1, 3))), before)


def test_panes_let_light_in_or_do_not(addon):
    """Beside Cycles, on a floor below: what lets most light through is nearer to nothing, what lets less to a wall; and
    a face of a solid box alone that is clear lets the sun into the box."""
    bake = addon("operators.baking.bake")
    scenes.grid("Floor", 1, 0.5, made_of=scenes.material("Floor"))
    pane = scenes.new_material("Pane")
    alpha = pane.node_tree.nodes["Principled BSDF"].inputs["Alpha"]
    scenes.grid("Pane", 1, 2.0, Matrix.Translation((0, 0, 1)), pane)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 3.0, 0.0
    bpy.context.collection.objects.link(sun)
    floor, bpy.context.scene.world = bpy.data.objects["Floor"], None
    settings = bake.BakeSettings(target_error=0.05, attribute="Ours", quantity="IRRADIANCE", domain="POINT")
    for value in (0.2, 0.8):
        alpha.default_value = value
        bpy.context.view_layer.update()
        bake.finish(bake.bake_steps(bpy.context, settings))
        ours, theirs = scenes.colours(floor, "Ours")[:, 0].mean(), cycles_colours.lit([floor], 512).mean()
        clear = 3.0 / np.pi
        assert abs(theirs - (1 - value) * clear) < 0.03 * clear  # but for what the pane throws back
        assert ours == pytest.approx(clear if value < 0.5 else 0.0, rel=1e-3, abs=1e-6)
    bpy.data.objects.remove(bpy.data.objects["Pane"])
    box = scenes.box("Box", 2.0, Matrix.Translation((0, 0, 0.9)), scenes.material("Wall"))
    box.data.materials.append(pane)
    top = max(box.data.polygons, key=lambda polygon: polygon.center.z)
    top.material_index = 1
    for value, expected in ((0.1, 3.0 / np.pi), (0.9, 0.0)):
        alpha.default_value = value
        bpy.context.view_layer.update()
        reading = addon("operators.reading.read_scene").read_scene(bpy.context)
        scene = reading.scene
        got = addon("pdm_core").solve(scene, 0.05).irradiance([[0.0, 0.0, 0.3]], [[0.0, 0.0, 1.0]])[0, 0]
        assert got >= expected if expected else got == pytest.approx(0.0, abs=1e-9)
        assert any("clear" in text for text in reading.warnings) == (value < 0.5)
