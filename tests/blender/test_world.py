"""Worlds as read, beside what Cycles bakes under them on planes that face all ways and shade nothing."""

import sys
from math import radians

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Euler, Matrix
from test_lights import baked_by_cycles, places

HEIGHT = 64


@pytest.fixture
def planes():
    """The six sides of a turned cube."""
    turned = Euler((0.3, 0.5, 0.2)).to_matrix().to_4x4()
    sides = [(0, 0, 0), (90, 0, 0), (180, 0, 0), (270, 0, 0), (0, 90, 0), (0, 270, 0)]
    made = []
    for k, side in enumerate(sides):
        turn = turned @ Euler([radians(angle) for angle in side]).to_matrix().to_4x4()
        made.append(scenes.grid(f"Side {k}", 1, 1.0, turn @ Matrix.Translation((0, 0, 1))))
    return made


class World:
    """A new world of nodes."""

    def __init__(self, fineness=256):
        self.world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
        if bpy.app.version < (5, 0):
            self.world.use_nodes = True
        # what Cycles takes its samples by; it takes long to make it as fine as it likes
        self.world.cycles.sampling_method, self.world.cycles.sample_map_resolution = "MANUAL", fineness
        self.nodes, self.links = self.world.node_tree.nodes, self.world.node_tree.links
        self.background = next(node for node in self.nodes if node.bl_idname == "ShaderNodeBackground")
        self.output = next(node for node in self.nodes if node.bl_idname == "ShaderNodeOutputWorld")

    def add(self, kind, **settings):
        node = self.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def image(self, pixels, **settings):
        """An Environment Texture of pixels (h, w, 3)."""
        image = bpy.data.images.new("Light", pixels.shape[1], pixels.shape[0], float_buffer=True)
        rgba = np.ones((*pixels.shape[:2], 4), np.float32)
        rgba[..., :3] = pixels
        image.pixels.foreach_set(rgba.ravel())
        image.update()
        image.pack()
        node = self.add("TexEnvironment", image=image, **settings)
        self.links.new(node.outputs["Color"], self.background.inputs["Color"])
        return node

    def mapping(self, node, kind, **values):
        mapping = self.add("Mapping", vector_type=kind)
        for name, value in values.items():
            mapping.inputs[name].default_value = value
        self.links.new(self.add("TexCoord").outputs["Generated"], mapping.inputs["Vector"])
        self.links.new(mapping.outputs[0], node.inputs["Vector"])


def pattern(height=HEIGHT, width=2 * HEIGHT):
    """Pixels (h, w, 3) that look the same from no two sides."""
    t, s = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    return np.stack([t**2 * 2, 0.2 + 3 * (np.abs(s - 0.3) < 0.08) * (t > 0.4), 1.5 * s], axis=-1)


def under_all(sky, normals):
    """(n, 3) irradiance / pi at unit normals (n, 3) where nothing hides the SkyMap, from its pixels."""
    each, of = np.unique(normals.round(6), axis=0, return_inverse=True)
    shape, of_map = sky.values.shape[:2], sys.modules[type(sky).__module__]
    cosine = np.maximum(each @ of_map.directions_of(*shape).reshape(-1, 3).T, 0)
    light = of_map.solid_angles(*shape)[..., None] * sky.values
    return (cosine @ light.reshape(-1, 3) / np.pi)[of.ravel()]


def compare(reading, planes, error=5e-3, samples=1024):
    """That the background and suns give everywhere what Cycles bakes, to error of the brightest."""
    points, normals = places(planes)
    sky = reading.scene.sky
    found = under_all(sky, normals) if sky else np.tile(reading.scene.background, (len(points), 1))
    for light in reading.scene.lights:
        found = found + light.unoccluded(points, normals)[:, None] * light.colour
    known = baked_by_cycles(planes, samples)
    assert known.max() > 0
    assert np.abs(found - known).max() < error * known.max()


def test_an_image_all_around(read, planes):
    made = World()
    made.image(pattern())
    made.background.inputs["Strength"].default_value = 2.5
    reading = read()
    assert reading.warnings == [] and reading.lights == []
    compare(reading, planes, 1e-2)


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR", "NORMAL"])
def test_a_turned_image(read, planes, kind):
    made = World()
    made.mapping(made.image(pattern()), kind, Rotation=(0.4, 0.3, 2.0), Scale=(1.0, 1.5, 0.8))
    compare(read(), planes, 1e-2)


def test_a_mirror_ball(read, planes):
    made = World()
    made.image(pattern(HEIGHT, HEIGHT), projection="MIRROR_BALL")
    compare(read(), planes, 1e-2)


def test_a_small_sun_in_an_image_is_a_light(read, planes):
    made = World(1024)
    pixels = pattern(256, 512) * 0.3
    pixels[200:202, 100:102] = [30000, 25000, 15000]
    made.image(pixels)
    reading = read()
    assert reading.lights == [("Sun of world Sky", "SUN")]
    (sun,) = reading.scene.lights
    assert sun.angle < radians(2) and reading.scene.sky.values.max() < 3
    compare(reading, planes, 1e-2)


def test_what_the_camera_sees_is_not_what_lights(read, planes):
    made = World()
    made.image(pattern())
    seen = made.add("Background")
    seen.inputs["Color"].default_value = (50, 0, 0, 1)
    mix, path = made.add("MixShader"), made.add("LightPath")
    made.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    made.links.new(made.background.outputs[0], mix.inputs[1])
    made.links.new(seen.outputs[0], mix.inputs[2])
    both, plain = made.add("AddShader"), made.add("Background")
    plain.inputs["Color"].default_value = (0.1, 0.5, 0.2, 1)
    made.links.new(mix.outputs[0], both.inputs[0])
    made.links.new(plain.outputs[0], both.inputs[1])
    made.links.new(both.outputs[0], made.output.inputs["Surface"])
    reading = read()
    assert any("Light Path" in text for text in reading.warnings)
    compare(reading, planes, 1e-2)


def test_other_nodes_are_rendered_once(read, planes, addon, monkeypatch):
    made = World()
    gradient, ramp, mapping = made.add("TexGradient"), made.add("ValToRGB"), made.add("Mapping")
    mapping.inputs["Rotation"].default_value = (0, radians(-90), 0)
    made.links.new(made.add("TexCoord").outputs["Generated"], mapping.inputs["Vector"])
    made.links.new(mapping.outputs[0], gradient.inputs["Vector"])
    made.links.new(gradient.outputs["Color"], ramp.inputs["Fac"])
    made.links.new(ramp.outputs["Color"], made.background.inputs["Color"])
    ramp.color_ramp.elements[0].color = (0.1, 0.2, 0.05, 1)
    ramp.color_ramp.elements[1].color = (0.2, 0.5, 2.0, 1)
    before = [len(getattr(bpy.data, kind)) for kind in ("worlds", "scenes", "images", "objects", "cameras")]
    reading = read()
    assert before == [len(getattr(bpy.data, kind)) for kind in ("worlds", "scenes", "images", "objects", "cameras")]
    assert any("Color Ramp node was rendered once" in text for text in reading.warnings)
    compare(reading, planes, 1e-2)
    ramp.color_ramp.elements[1].color = (2.0, 0.5, 0.1, 1)
    changed = read().scene.sky.values
    assert not np.array_equal(changed, reading.scene.sky.values)
    monkeypatch.setattr(addon("operators.reading.second_blender"), "_command", lambda *_: ["false"])
    assert np.array_equal(read().scene.sky.values, changed)  # remembered


def sky_types():
    names = bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items.keys()
    return [name for name in names if name != "HOSEK_WILKIE"]


@pytest.mark.parametrize("kind", sky_types())
def test_skies(read, planes, kind):
    made = World()
    sky = made.add("TexSky", sky_type=kind)
    if kind != "PREETHAM":
        sky.sun_elevation, sky.sun_rotation = radians(40), radians(70)
    made.links.new(sky.outputs[0], made.background.inputs["Color"])
    made.background.inputs["Strength"].default_value = 0.1
    reading = read()
    assert reading.lights == ([] if kind == "PREETHAM" else [("Sun of world Sky", "SUN")])
    compare(reading, planes, 1e-2)


def test_worlds_that_give_nothing_say_so(read, planes):
    made = World()
    node = made.image(pattern())
    image = node.image
    image.unpack(method="REMOVE")
    image.source, image.filepath = "FILE", "/nowhere/sky.hdr"
    reading = read()
    assert reading.scene.sky is None and (reading.scene.background == 0).all()
    assert any("'/nowhere/sky.hdr' is missing" in text and "black" in text for text in reading.warnings)
    made.world.cycles_visibility.diffuse = False
    reading = read()
    assert reading.warnings == [
        "World 'Sky': is not visible to diffuse rays: it lights nothing; switch Ray Visibility > Diffuse on"
    ]


def test_a_renderer_that_fails_is_said(read, planes, addon, monkeypatch):
    made = World()
    made.links.new(made.add("TexNoise").outputs["Color"], made.background.inputs["Color"])
    monkeypatch.setattr(addon("operators.reading.second_blender"), "_command", lambda *_: ["false"])
    reading = read()
    assert (reading.scene.background == 0).all()
    assert any("Noise Texture node could not be rendered" in text for text in reading.warnings)
