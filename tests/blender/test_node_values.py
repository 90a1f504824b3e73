"""Node trees of every kind against the colours that Cycles bakes of them; chains, circles and what is unknown."""

import bmesh
import bpy
import cycles_colours
import node_tables
import numpy as np
import pytest
import scenes
from calls import calls


@pytest.fixture
def read(addon):
    return addon("operators.reading.materials").read_material


@pytest.fixture
def colours(addon, read):
    """colours(obj, points, slot=0): (n, 3) reflectance of the front of one material there, and its warnings."""
    layers, varying = addon("operators.reading.mesh_layers"), addon("operators.reading.varying")
    arrays_of = addon("operators.reading.mesh_arrays").arrays_of

    def at(obj, points, slot=0):
        look = read(obj.data.materials[slot])
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        found = layers.gather_layers(evaluated, arrays_of(evaluated.data), look.needs, {})
        if found is not None:
            index = np.empty(len(obj.data.polygons), np.int32)
            obj.data.polygons.foreach_get("material_index", index)
            chosen = np.repeat(index, found.arrays.counts - 2) == slot
            look = look.on(varying.Faces(found, np.array(obj.matrix_world), chosen))
        value = look.reflectance[0]
        return value(points) if callable(value) else np.tile(value, (len(points), 1)), look.warnings

    return at


def test_every_node_as_cycles_bakes_it(colours, addon):
    """Within 1e-3 at every corner."""
    most = addon("pdm_core.scene").MAX_REFLECTANCE
    materials = []
    for name, build in node_tables.TREES.items():
        try:
            materials.append(node_tables.material(name, build))
        except node_tables.Absent:
            pass  # of another version of Blender
    obj = cycles_colours.patch("Table", materials)
    theirs, points = (np.split(a, len(materials)) for a in (cycles_colours.baked(obj), cycles_colours.corners(obj)))
    wrong = {}
    for k, material in enumerate(materials):
        ours, warnings = colours(obj, points[k], k)
        off = np.abs(np.clip(ours, 0, most) - np.clip(theirs[k], 0, most)).max()
        if off > 1e-3 or warnings:
            wrong[material.name] = (off, warnings)
    assert not wrong
    assert len(materials) > 150


@pytest.mark.parametrize("blend", [0.0, 0.4])
def test_box_projection_as_cycles_bakes_it(colours, blend):
    """On triangles that look every way."""

    def build(t):
        vector, image = t.add("TexCoord").outputs["Object"], node_tables.image()
        settings = {"image": image, "projection": "BOX", "projection_blend": blend}
        return t.add("TexImage", {"Vector": vector}, **settings).outputs["Color"]

    made = node_tables.material("Boxes", build)
    ball = scenes.add("Ball", lambda b: bmesh.ops.create_icosphere(b, subdivisions=3, radius=1.0), made_of=made)
    theirs = cycles_colours.baked(ball)
    off = np.abs(colours(ball, cycles_colours.corners(ball))[0] - theirs).max(axis=1)
    assert (off < 2e-3).mean() > 0.99


def bent(obj):
    made = obj.modifiers.new("Bend", "SIMPLE_DEFORM")
    made.deform_method, made.angle = "BEND", 1.0


def keyed(obj):
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Key")
    key.data[7].co.z, key.data[9].co.x, key.value = 0.7, -0.5, 0.8


def pressed(obj):
    obj.scale.z = 0.0


@pytest.mark.parametrize("change", [bent, keyed, pressed])
@pytest.mark.parametrize("name", ["Generated", "Object"])
def test_coordinates_of_what_is_moved(colours, change, name):
    """Generated ones stay those of the mesh as it was modelled, the object's own are of where it is, as in Cycles."""
    halved = {"Vector_001": (0.4, 0.4, 0.4), "Vector_002": (0.5, 0.5, 0.5)}

    def build(t):
        return t.add("VectorMath", {"Vector": t.add("TexCoord").outputs[name], **halved}, operation="MULTIPLY_ADD")

    obj = cycles_colours.patch("Moved", [node_tables.material("Place", build)])
    change(obj)
    bpy.context.view_layer.update()
    shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    theirs, points = cycles_colours.baked(obj), cycles_colours.corners(shown)
    ours, warnings = colours(obj, points)
    np.testing.assert_allclose(ours, theirs, atol=1e-3)
    assert not warnings


def chain(length):
    def build(t):
        colour = t.colour()
        for k in range(length // 2):
            mixed = t.add("MixRGB", {"Fac": 0.5, "Color1": colour, "Color2": (0.2, 0.4, 0.6)}, blend_type="MULTIPLY")
            colour = t.add("Gamma", {"Color": mixed, "Gamma": 1.0 + 0.01 * (k % 3)})
        return colour

    return node_tables.material("Chain", build)


def test_a_thousand_nodes_in_a_row(read, colours):
    """Each is read once, in as many steps as any other."""
    counted = {}
    for length in (100, 1000):
        made = chain(length)
        with calls() as counted[length]:
            assert read(made).needs == {("attribute", "Tint")}
    assert counted[1000]["operators.reading.node_colour._mix_rgb"] == 500
    assert counted[1000].total() < 10 * counted[100].total()
    values, warnings = colours(
        cycles_colours.patch("Deep", [made]), np.random.default_rng(0).uniform(-0.9, 0.9, (9, 3))
    )
    assert np.isfinite(values).all() and not warnings


def test_circles_through_groups_and_reroutes_are_named(read):
    def build(t):
        one, other = t.add("NodeReroute"), t.add("NodeReroute")
        t.put(one.inputs[0], other.outputs[0])
        t.put(other.inputs[0], one.outputs[0])
        return one.outputs[0]

    look = read(node_tables.material("Reroutes", build))
    assert "circle" in look.warnings[0] and not look.reflectance[0].any()

    def numbers(t):
        one, other = t.add("Math"), t.add("Math")
        t.put(one.inputs[0], other.outputs[0])
        t.put(other.inputs[0], one.outputs[0])
        return one.outputs[0]

    assert "circle" in read(node_tables.material("Numbers", numbers)).warnings[0]


def test_empty_groups_give_their_plain_value(read):
    look = read(node_tables.material("Empty", lambda t: t.add("Group").outputs or t.add("RGB").outputs[0]))
    assert not look.warnings


def test_a_muted_link_counts_as_none(colours):
    def build(t):
        return t.add("Gamma", {"Color": t.colour(), "Gamma": 1.0})

    made = node_tables.material("Muted", build)
    gamma = next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeGamma")
    gamma.inputs["Color"].default_value = (0.2, 0.3, 0.4, 1)
    gamma.inputs["Color"].links[0].is_muted = True
    obj = cycles_colours.patch("Muted", [made])
    np.testing.assert_allclose(colours(obj, np.zeros((3, 3)))[0], [[0.2, 0.3, 0.4]] * 3, rtol=1e-6)


@pytest.mark.parametrize("kind", ["TexNoise", "TexVoronoi", "TexWhiteNoise"])
def test_noises_are_taken_by_their_mean_aloud(read, kind):
    def build(t):
        ramp = t.add("ValToRGB", {"Fac": t.add(kind)})
        ramp.color_ramp.elements[0].color = (0.2, 0.0, 0.4, 1)
        return ramp

    look = read(node_tables.material("Noise", build))
    np.testing.assert_allclose(look.reflectance[0], [0.6, 0.5, 0.7], atol=2e-3)
    assert len(look.warnings) == 1 and "mean" in look.warnings[0] and "Texture" in look.warnings[0]


def test_what_is_unknown_is_named_with_its_reason(read):
    def build(t):
        return t.add("Invert", {"Color": t.add("TexCoord").outputs["Reflection"], "Fac": 0.7})

    look = read(node_tables.material("Unknown", build))
    assert len(look.warnings) == 1
    assert all(word in look.warnings[0] for word in ("Color", "Invert", "Texture Coordinate", "Reflection", "plain"))


def test_what_is_not_shown_is_not_warned_of(read):
    def build(t):
        return t.add("MixRGB", {"Fac": 0.0, "Color1": (0.3, 0.3, 0.3), "Color2": t.add("TexNoise").outputs[0]})

    look = read(node_tables.material("Hidden", build))
    np.testing.assert_allclose(look.reflectance[0], 0.3, rtol=1e-6)
    assert not look.warnings


def test_facing_and_fresnel_are_means_over_directions(read):
    """The mean of 1 - c over projected directions is 1/3; a dielectric of index 1.5 reflects 9.18 % of it."""
    for build, right in (
        (lambda t: t.add("LayerWeight").outputs["Facing"], 1 / 3),
        (lambda t: t.add("Fresnel", {"IOR": 1.5}), 0.0918),
    ):
        look = read(node_tables.material("View", build))
        np.testing.assert_allclose(look.reflectance[0], right, rtol=5e-3)
        assert "mean over all directions" in look.warnings[0]


def test_colours_of_the_object(colours):
    made = node_tables.material("Object", lambda t: t.add("ObjectInfo").outputs["Color"])
    for k, rgb in enumerate(((0.1, 0.2, 0.3), (0.7, 0.6, 0.5))):
        obj = scenes.grid(f"Object {k}", made_of=made)
        obj.color = (*rgb, 1)
        np.testing.assert_allclose(colours(obj, np.zeros((2, 3)))[0], [rgb] * 2, rtol=1e-6)
