"""Blender's lights as read, beside what Cycles bakes of the same light on surfaces that nothing shades."""

from math import pi, radians

import bpy
import cycles_colours
import numpy as np
import pytest
import scenes
from mathutils import Euler, Matrix

TILTED = Matrix.Translation((0.3, -0.2, 2.5)) @ Euler((0.3, 0.4, 0.1)).to_matrix().to_4x4()
SAMPLES = 1024


def lamp(kind, matrix=TILTED, name="Lamp", **settings):
    data = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = matrix
    bpy.context.collection.objects.link(obj)
    return obj


def receivers():
    """A floor, and beside it a plane that leans; neither shades the other where they are read off."""
    lean = Matrix.Translation((6, 0.2, 1)) @ Euler((0.5, 0.3, 0.2)).to_matrix().to_4x4()
    return scenes.grid("Floor", 2, 4.0), scenes.grid("Lean", 1, 1.0, lean)


def places(objects):
    """points (n, 3) m and unit normals (n, 3) of all vertices"""
    points, normals = [], []
    for obj in objects:
        matrix = np.array(obj.matrix_world)
        own = scenes.vertices(obj) @ matrix[:3, :3].T + matrix[:3, 3]
        points.append(own)
        normals.append(np.tile(matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]), (len(own), 1)))
    return np.concatenate(points), np.concatenate(normals)


def baked_by_cycles(objects, samples=SAMPLES):
    """(n, 3) direct irradiance / pi at all vertices"""
    scene = bpy.context.scene
    scene.render.engine, scene.render.bake.target = "CYCLES", "VERTEX_COLORS"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = cycles.use_light_tree = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    bpy.context.view_layer.update()
    for obj in list(bpy.context.view_layer.objects):
        obj.select_set(obj in objects)
    for obj in objects:
        if "Cycles" not in obj.data.color_attributes:
            obj.data.color_attributes.new("Cycles", "FLOAT_COLOR", "POINT")
        obj.data.color_attributes.active_color = obj.data.color_attributes["Cycles"]
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"})
    return np.concatenate([scenes.colours(obj, "Cycles")[:, :3] for obj in objects])


def compare(read, samples=SAMPLES, error=5e-3):
    """That what is read gives everywhere what Cycles bakes, to error of the brightest."""
    objects = [obj for obj in bpy.data.objects if obj.type == "MESH"]
    scene = read().scene
    points, normals = places(objects)
    found = sum(light.unoccluded(points, normals)[:, None] * light.colour for light in scene.lights)
    known = baked_by_cycles(objects, samples)
    assert known.max() > 0
    assert np.abs(found - known).max() < error * known.max()


@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 1, 0.2), (-1, 1, 1), (1, 1, -1)])
@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_areas(read, shape, scale):
    receivers()
    turn = Euler((pi, 0, 0)).to_matrix().to_4x4() if scale[2] < 0 else Matrix()  # then it shines along its +z
    matrix = TILTED @ turn @ Matrix.Diagonal((*scale, 1))
    lamp("AREA", matrix, shape=shape, size=1.0, size_y=0.6, energy=100, color=(1, 0.5, 0.25))
    compare(read)


@pytest.mark.parametrize("degrees", [150, 60, 30])
def test_spreads_of_areas(read, degrees):
    receivers()
    lamp("AREA", shape="RECTANGLE", size=1.0, size_y=2.0, energy=100, spread=radians(degrees))
    compare(read)


def soft(settings, on):
    """Soft Falloff, which 4.2 has too."""
    return {**settings, "use_soft_falloff": on}


@pytest.mark.parametrize("on", [True, False])
@pytest.mark.parametrize("radius", [0.0, 0.1, 1.0])
def test_points(read, radius, on):
    receivers()
    scaled = TILTED @ Matrix.Diagonal((2, 0.5, 1, 1))  # which does not count
    lamp("POINT", scaled, **soft({"shadow_soft_size": radius, "energy": 50, "color": (0.2, 1, 0.4)}, on))
    compare(read)


@pytest.mark.parametrize("radius, blend, scale", [(0, 0, 1), (0, 1, 2), (0.1, 0.3, 0.5), (0.6, 0.15, 1)])
@pytest.mark.parametrize("on", [True, False])
def test_spots(read, radius, blend, scale, on):
    receivers()
    matrix = TILTED @ Matrix.Diagonal((scale, 1, 1, 1))
    settings = {"shadow_soft_size": radius, "energy": 80, "spot_size": 1.3, "spot_blend": blend}
    lamp("SPOT", matrix, **soft(settings, on))
    compare(read)


@pytest.mark.parametrize("degrees", [0, 0.5, 30, 90])
def test_suns(read, degrees):
    receivers()
    lamp("SUN", energy=3, angle=radians(degrees), color=(1, 0.9, 0.7))
    compare(read)


def test_exposure_temperature_and_normalize(read):
    """Of those that lights have: before 4.5 the energy alone."""
    receivers()
    newer = {"normalize": False, "exposure": 1.5, "use_temperature": True, "temperature": 4000.0}
    common = {"energy": 2.0, **{k: v for k, v in newer.items() if k in bpy.types.Light.bl_rna.properties}}
    for kind, settings in [
        ("POINT", {"shadow_soft_size": 0.0}),
        ("POINT", {"shadow_soft_size": 0.4}),
        ("SPOT", {"shadow_soft_size": 0.4, "spot_size": 2.0}),
        ("AREA", {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.5}),
        ("SUN", {"angle": 0.3}),
        ("SUN", {"angle": 0.0}),
    ]:
        made = lamp(kind, **common, **settings)
        compare(read, 8192, 1e-2)  # a vertex lies where the spot fades
        bpy.data.objects.remove(made)


@pytest.mark.parametrize("kind, settings", [("POINT", {"shadow_soft_size": 0.2}), ("SUN", {}), ("AREA", {})])
def test_a_light_that_casts_no_shadows(read, kind, settings):
    receivers()
    scenes.grid(
        "Card", 1, 1.5, Matrix.Translation((0.2, -0.1, 1.2))
    )  # which would hide it from the middle of the floor
    lamp(kind, energy=30, use_shadow=False, **settings)
    compare(read)


def test_rays_that_see_a_light(read):
    objects = receivers()
    made = lamp("POINT", energy=30)
    made.visible_camera = made.visible_glossy = made.visible_transmission = False
    compare(read)
    made.visible_diffuse = False
    assert read().scene.lights == () and baked_by_cycles(objects, 16).max() == 0


def nodes_of(data):
    if not data.node_tree:
        data.use_nodes = True
    return data.node_tree.nodes


def test_nodes_that_are_constant(read):
    receivers()
    obj = lamp("POINT", shadow_soft_size=0.0, energy=10)
    emission = next(node for node in nodes_of(obj.data) if node.bl_idname == "ShaderNodeEmission")
    emission.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1)
    emission.inputs["Strength"].default_value = 3.0
    compare(read)
    falloff = obj.data.node_tree.nodes.new("ShaderNodeLightFalloff")
    obj.data.node_tree.links.new(falloff.outputs[0], emission.inputs["Strength"])
    assert any("'Lamp' the Strength" in text and "Falloff" in text for text in read().warnings)


def test_instances_of_lights(read):
    receivers()
    made = lamp("POINT", Matrix(), shadow_soft_size=0.0, energy=20)
    group = bpy.data.collections.new("Lamps")
    for collection in list(made.users_collection):
        collection.objects.unlink(made)
    group.objects.link(made)
    for x in (-1, 1):
        empty = bpy.data.objects.new(f"Instancer {x}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", group
        empty.location = (x, 0, 2)
        bpy.context.collection.objects.link(empty)
    compare(read)
    assert sorted(light.name for light in read().scene.lights) == ["Lamp (Instancer -1)", "Lamp (Instancer 1)"]


def test_what_is_left_out_is_said(read):
    receivers()
    lamp("POINT", name="Dark", energy=0)
    lamp("POINT", name="Hole", energy=-10)
    lamp("POINT", name="Unseen", energy=10).visible_diffuse = False
    lamp("AREA", Matrix.Diagonal((1, 0, 1, 1)), name="Flat", energy=10)
    lamp("AREA", name="Portal", energy=10).data.cycles.is_portal = True
    hidden = lamp("POINT", name="Hidden", energy=10)
    hidden.hide_render = True
    shadowless = lamp("POINT", name="Shadowless", energy=10, use_shadow=False)
    linked = lamp("SUN", name="Linked", energy=1)
    linked.hide_viewport = True  # which does not count
    shadowless.data.cycles.max_bounces = 2
    reading = read()
    assert sorted((light.name, light.shadows) for light in reading.scene.lights) == [
        ("Linked", True),
        ("Shadowless", False),
    ]
    assert sorted(reading.lights) == [("Linked", "SUN"), ("Shadowless", "POINT")]
    for name, text in {
        "Dark": "no strength", "Hole": "takes light away", "Unseen": "not visible to diffuse", "Flat": "no area",
        "Shadowless": "limited to 2 bounces",
    }.items():  # fmt: skip
        assert any(f"Light '{name}'" in warning and text in warning for warning in reading.warnings), name
    assert not any("Portal" in warning or "Hidden" in warning for warning in reading.warnings)


def test_lights_alone_are_light(addon):
    scenes.grid("Floor")
    bake = addon("operators.baking.bake")
    reading = addon("operators.reading.read_scene").read_scene(bpy.context)
    with pytest.raises(addon("operators.baking.colour_attribute").BakeError, match="Nothing shines: add a light"):
        bake.check_light(bpy.context, reading)
    made = lamp("POINT", energy=0)
    with pytest.raises(addon("operators.baking.colour_attribute").BakeError, match="light 'Lamp' sends none"):
        bake.check_light(bpy.context, addon("operators.reading.read_scene").read_scene(bpy.context))
    made.data.energy = 1
    reading = addon("operators.reading.read_scene").read_scene(bpy.context)
    bake.check_light(bpy.context, reading)
    assert addon("pdm_core.plan").lit(reading.scene).tolist() == [True, False]


def test_lamps_light_and_are_blocked_by_what_they_are_linked_to(addon):
    """Beside Cycles: a sun that misses a panel, an area light for two of three things, one that a ball does not block,
    by included and by excluded members, some of them in a collection within."""
    floor = scenes.grid("Floor", 12, 4.0, made_of=scenes.material("Floor"))
    leaning = Matrix.Translation((-0.9, 0, 0.8)) @ Matrix.Rotation(0.3, 4, "X")
    panel = scenes.grid("Panel", 2, 1.2, leaning, scenes.material("Panel", (0.8, 0.3, 0.2)))
    ball = scenes.sphere("Ball", 64, 32, 0.6, Matrix.Translation((1.0, 0.3, 0.8)), scenes.material("Ball"))
    turned = Matrix.Translation((0.3, -0.4, 3)) @ Euler((0.2, 0.3, 0)).to_matrix().to_4x4()
    sun = lamp("SUN", turned, name="Sun", energy=2, angle=0.0)
    area = lamp("AREA", turned, name="Area", energy=60, size=0.4)
    point = lamp("POINT", Matrix.Translation((-0.3, 1.2, 2)), name="Point", energy=60, shadow_soft_size=0.0)

    def members(name, included=(), excluded=(), within=()):
        made = bpy.data.collections.new(name)
        for obj in (*included, *excluded):
            made.objects.link(obj)
        for entry in list(made.collection_objects)[len(included) :]:
            entry.light_linking.link_state = "EXCLUDE"
        if within:
            inner = bpy.data.collections.new(f"{name} within")
            made.children.link(inner)
            for obj in within:
                inner.objects.link(obj)
        return made

    sun.light_linking.receiver_collection = members("Not the panel", excluded=[panel])
    area.light_linking.receiver_collection = members("Floor and ball", included=[floor], within=[ball])
    area.light_linking.blocker_collection = members("Panel alone", included=[panel])
    point.light_linking.blocker_collection = members("Not the ball", excluded=[ball])
    scene = bpy.context.scene
    scene.world = None
    bpy.ops.pdm.bake(target_error=0.01, quantity="IRRADIANCE", domain="POINT", attribute="Ours")
    assert not scene.pdm_radiosity.report()["left_out"]
    theirs = cycles_colours.lit([floor, panel], 1024)
    ours = np.concatenate([scenes.colours(obj, "Ours")[:, :3] for obj in (floor, panel)])
    assert np.linalg.norm(ours - theirs) < 0.03 * np.linalg.norm(theirs)


def test_linked_emission_is_named(read):
    glow = scenes.grid("Glow", made_of=scenes.material("Glow", emission=(1, 1, 1)))
    glow.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    assert any("'Glow'" in text and "light linking" in text for text in read().warnings)
