"""Materials as reflectance and emission of front and back, against values worked out by hand."""

import bpy
import numpy as np
import pytest
import scenes

GREY = (0.2, 0.4, 0.6)


@pytest.fixture
def read(addon):
    return addon("operators.reading.materials").read_material


class Nodes:
    """A material whose nodes a test adds and links; `surface` is what the output shows."""

    def __init__(self, name="Made"):
        self.material = scenes.new_material(name)
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.tree.nodes.new("ShaderNodeOutputMaterial")

    def add(self, kind, **values):
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in values.items():
            self.set(node.inputs[name.replace("_", " ")], value)
        return node

    def set(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif isinstance(value, tuple):
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def mix(self, factor, first, second):
        node = self.add("MixShader")
        for socket, value in zip(node.inputs, (factor, first.outputs[0], second.outputs[0]), strict=True):
            self.set(socket, value)
        return node

    def sum(self, first, second):
        node = self.add("AddShader")
        for socket, shader in zip(node.inputs, (first, second), strict=True):
            self.set(socket, shader.outputs[0])
        return node

    def backfacing(self):
        return self.add("NewGeometry").outputs["Backfacing"]

    def surface(self, shader):
        self.tree.links.new(shader.outputs[0], self.output.inputs["Surface"])
        return self.material


def check(look, reflectance, emission=(0, 0, 0), back_reflectance=None, back_emission=None, warnings=()):
    sides = [reflectance, reflectance if back_reflectance is None else back_reflectance]
    np.testing.assert_allclose(look.reflectance, np.array(sides, float), rtol=1e-6, atol=1e-7)
    sides = [emission, emission if back_emission is None else back_emission]
    np.testing.assert_allclose(look.emission, np.array(sides, float), rtol=1e-6, atol=1e-7)
    assert len(look.warnings) == len(warnings), look.warnings
    for words, text in zip(warnings, look.warnings, strict=True):
        assert all(word in text for word in words.split("|")), text


def test_principled(read):
    made = Nodes()
    shader = made.add("BsdfPrincipled", Base_Color=GREY, Emission_Color=(1.0, 0.5, 0.25), Emission_Strength=4.0)
    check(read(made.surface(shader)), GREY, (4, 2, 1))
    shader.inputs["Emission Strength"].default_value = 0.0
    check(read(made.material), GREY)


def test_default_material_has_no_warnings(read):
    check(read(scenes.new_material("Plain")), (0.8, 0.8, 0.8))


def test_diffuse_and_emission(read):
    made = Nodes()
    check(read(made.surface(made.add("BsdfDiffuse", Color=GREY))), GREY)
    check(read(made.surface(made.add("Emission", Color=GREY, Strength=10.0))), (0, 0, 0), (2, 4, 6))


def test_add_and_nested_mix(read):
    made = Nodes()
    white, lamp = made.add("BsdfDiffuse", Color=(0.8, 0.8, 0.8)), made.add("Emission", Color=GREY, Strength=5.0)
    check(read(made.surface(made.sum(white, lamp))), (0.8, 0.8, 0.8), (1, 2, 3))
    inner = made.mix(0.25, white, lamp)  # 0.6 grey, a quarter of the lamp
    black = made.add("BsdfDiffuse", Color=(0.0, 0.0, 0.0))
    check(read(made.surface(made.mix(0.5, black, inner))), (0.3, 0.3, 0.3), (0.125, 0.25, 0.375))
    over = made.mix(0.0, white, lamp)
    over.inputs[0].default_value = 1.0
    check(read(made.surface(over)), (0, 0, 0), (1, 2, 3))


def test_an_open_shader_input_is_black(read):
    made = Nodes()
    mix = made.add("MixShader")
    mix.inputs[0].default_value = 0.25
    made.tree.links.new(made.add("BsdfDiffuse", Color=(0.8, 0.8, 0.8)).outputs[0], mix.inputs[1])
    check(read(made.surface(mix)), (0.6, 0.6, 0.6))


def test_backfacing_switches_shaders(read):
    made = Nodes()
    lamp, grey = made.add("Emission", Color=(1.0, 1.0, 1.0), Strength=3.0), made.add("BsdfDiffuse", Color=GREY)
    material = made.surface(made.mix(made.backfacing(), lamp, grey))
    check(read(material), (0, 0, 0), (3, 3, 3), GREY, (0, 0, 0))


def test_backfacing_switches_values(read):
    """Strength = 3 (1 - Backfacing); and a colour mixed by Backfacing."""
    made = Nodes()
    inverse, times = made.add("Math"), made.add("Math")
    inverse.operation, times.operation = "SUBTRACT", "MULTIPLY"
    inverse.inputs[0].default_value = 1.0
    made.set(inverse.inputs[1], made.backfacing())
    made.set(times.inputs[0], inverse.outputs[0])
    times.inputs[1].default_value = 3.0
    mix = made.add("Mix")
    mix.data_type = "RGBA"
    factor, a, b = (socket for socket in mix.inputs if socket.enabled)
    made.set(factor, made.backfacing())
    a.default_value, b.default_value = (*GREY, 1), (0.1, 0.1, 0.1, 1)
    shader = made.add("BsdfPrincipled", Emission_Color=(1.0, 1.0, 1.0))
    made.set(shader.inputs["Emission Strength"], times.outputs[0])
    made.set(shader.inputs["Base Color"], next(s for s in mix.outputs if s.enabled))
    check(read(made.surface(shader)), GREY, (3, 3, 3), (0.1, 0.1, 0.1), (0, 0, 0))


def test_backface_culling_is_none_of_cycles(read):
    made = Nodes()
    material = made.surface(made.sum(made.add("BsdfDiffuse", Color=GREY), made.add("Emission", Color=(1.0, 1.0, 1.0))))
    material.use_backface_culling = True
    check(read(material), GREY, (1, 1, 1))


def test_constants_through_reroutes_values_and_muted_links(read):
    made = Nodes()
    value, colour = made.add("Value"), made.add("RGB")
    value.outputs[0].default_value, colour.outputs[0].default_value = 2.0, (*GREY, 1)
    reroute = made.tree.nodes.new("NodeReroute")
    made.tree.links.new(colour.outputs[0], reroute.inputs[0])
    lamp = made.add("Emission", Color=reroute.outputs[0], Strength=value.outputs[0])
    check(read(made.surface(lamp)), (0, 0, 0), (0.4, 0.8, 1.2))
    lamp.inputs["Strength"].default_value = 7.0
    lamp.inputs["Strength"].links[0].is_muted = True
    check(read(made.material), (0, 0, 0), (1.4, 2.8, 4.2))


def test_linked_texture_warns_and_uses_the_plain_value(read):
    made = Nodes()
    shader = made.add("BsdfPrincipled", Base_Color=GREY)
    made.set(shader.inputs["Base Color"], made.add("TexImage").outputs["Color"])
    check(read(made.surface(shader)), GREY, warnings=["Base Color|Image Texture|plain value"])


def test_mix_by_a_noise_uses_its_mean(read):
    made = Nodes()
    mix = made.mix(0.5, made.add("BsdfDiffuse", Color=(0.8, 0.8, 0.8)), made.add("Emission", Color=(1.0, 1.0, 1.0)))
    made.set(mix.inputs[0], made.add("TexNoise").outputs[0])
    check(read(made.surface(mix)), (0.4, 0.4, 0.4), (0.5, 0.5, 0.5), warnings=["Noise Texture|mean of 0.5"])


@pytest.mark.parametrize(
    "ray, emits", [("Camera", 0), ("Shadow", 0), ("Glossy", 0), ("Transmission", 0), ("Diffuse", 1)]
)
def test_light_paths_are_those_of_diffuse_rays(read, ray, emits):
    made = Nodes()
    mix = made.mix(0.5, made.add("BsdfDiffuse", Color=GREY), made.add("Emission", Color=(1.0, 1.0, 1.0)))
    made.set(mix.inputs[0], made.add("LightPath").outputs[f"Is {ray} Ray"])
    check(read(made.surface(mix)), (0, 0, 0) if emits else GREY, (emits,) * 3)


def test_chains_are_read_once_and_to_any_depth(read):
    """Mix shaders that share both inputs, one after another: as many readings as nodes, not two to their number."""
    made = Nodes()
    shader = made.add("BsdfDiffuse", Color=GREY)
    for _ in range(18):
        shader = made.mix(0.5, shader, shader)
    check(read(made.surface(shader)), GREY)
    value = made.add("Value")
    value.outputs[0].default_value = 0.0
    for _ in range(1500):
        following = made.add("Math", Value=value.outputs[0])
        following.operation, following.inputs[1].default_value = "ADD", 0.5
        value = following
    lamp = made.add("Emission", Color=(1.0, 1.0, 1.0), Strength=value.outputs[0])
    check(read(made.surface(lamp)), (0, 0, 0), (750,) * 3)


def test_circles_are_named(read):
    made = Nodes()
    one, other = made.mix(0.5, *[made.add("Emission")] * 2), made.mix(0.5, *[made.add("Emission")] * 2)
    made.tree.links.new(one.outputs[0], other.inputs[1])
    made.tree.links.new(other.outputs[0], one.inputs[1])
    check(read(made.surface(one)), (0, 0, 0), warnings=["circle|black|remove"])


def test_a_shown_bake_is_no_light(read):
    made = Nodes()
    shown = made.add("Attribute")
    shown.attribute_name = "Radiosity"
    lamp = made.surface(made.add("Emission", Color=shown.outputs["Color"], Strength=2.0))
    warnings = ["baked attribute 'Radiosity'|not taken as light", "grey is taken"]
    check(read(lamp, frozenset({"Radiosity"})), (0.8, 0.8, 0.8), warnings=warnings)
    assert read(lamp).shines


def test_a_volume_alone_is_no_surface(read):
    made = Nodes()
    made.tree.links.new(made.add("VolumePrincipled").outputs[0], made.output.inputs["Volume"])
    look = read(made.material)
    assert "volume" in look.absent
    check(look, (0, 0, 0))


def test_unknown_shaders_warn(read):
    made = Nodes()
    glass = made.surface(made.add("BsdfGlass", Color=GREY))
    check(read(glass), GREY, warnings=["Glass BSDF|taken as diffuse"])
    check(read(made.surface(made.add("BsdfToon", Color=GREY))), GREY, warnings=["Toon BSDF|not supported"])
    check(read(made.surface(made.add("Holdout"))), (0, 0, 0), warnings=["Holdout|black"])


@pytest.mark.parametrize("name, value", [("Metallic", 1.0), ("Transmission Weight", 0.5), ("Alpha", 0.5)])
def test_principled_beyond_diffuse_warns(read, name, value):
    made = Nodes()
    shader = made.add("BsdfPrincipled", Base_Color=GREY)
    shader.inputs[name].default_value = value
    check(read(made.surface(shader)), GREY, warnings=[name])


def test_reflectance_is_limited_aloud(read, addon):
    limit = addon("pdm_core.scene").MAX_REFLECTANCE
    made = Nodes()
    white = made.add("BsdfDiffuse", Color=(1.0, 0.5, 1.0))
    check(read(made.surface(white)), (limit, 0.5, limit), warnings=["limited"])
    check(read(made.surface(made.sum(white, white))), (limit, limit, limit), warnings=["2|limited"])
    assert limit < 1


def test_negative_colours_are_taken_as_black_aloud(read):
    made = Nodes()
    check(read(made.surface(made.add("Emission", Color=GREY, Strength=-1.0))), (0, 0, 0), warnings=["below 0"])


def test_volume_displacement_and_no_surface_warn(read):
    made = Nodes()
    check(read(made.material), (0, 0, 0), warnings=["no surface"])
    made.surface(made.add("BsdfDiffuse", Color=GREY))
    made.set(made.output.inputs["Volume"], made.add("VolumeScatter").outputs[0])
    made.set(made.output.inputs["Displacement"], made.add("Displacement").outputs[0])
    check(read(made.material), GREY, warnings=["volume", "displacement"])


def test_the_output_that_cycles_renders_counts(read):
    made = Nodes()
    made.surface(made.add("BsdfDiffuse", Color=(0.1, 0.1, 0.1)))
    made.output.target = "EEVEE"
    made.output = made.add("OutputMaterial")
    made.output.target = "CYCLES"
    check(read(made.surface(made.add("BsdfDiffuse", Color=GREY))), GREY)


def test_without_nodes_the_viewport_colour(read):
    material = bpy.data.materials.new("Plain")
    material.use_nodes = False
    material.diffuse_color = (*GREY, 1)
    always_nodes = bpy.app.version >= (5, 0)  # then those of a new material count
    check(read(material), (0.8, 0.8, 0.8) if always_nodes else GREY)


def test_no_material_is_blenders_grey(read):
    check(read(None), (0.8, 0.8, 0.8))
