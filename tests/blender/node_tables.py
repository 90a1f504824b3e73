"""Node trees to compare with Cycles, by name: each builds on a Tree and returns the socket that is the diffuse colour.

Numbers vary with the UV map (0.1 to 0.9 and more), colours with a colour attribute.
"""

import bpy
import numpy as np
import scenes


class Absent(Exception):
    """A node that this version does not have."""


class Tree:
    """A node tree that grows: add(kind, settings, **inputs by name or number) gives the node."""

    def __init__(self, tree):
        self.tree = tree

    def add(self, kind, inputs=(), **settings):
        try:
            node = self.tree.nodes.new(kind if kind.startswith("Node") else f"ShaderNode{kind}")
        except RuntimeError:
            raise Absent(kind) from None
        for name, value in settings.items():
            setattr(node, name, value)
        for where, value in dict(inputs).items():
            self.put(next(s for s in node.inputs if s.identifier == where), value)
        return node

    def put(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif isinstance(value, bpy.types.Node):
            self.tree.links.new(next(s for s in value.outputs if s.enabled), socket)
        elif socket.type == "RGBA" and not np.isscalar(value):
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def uv(self):
        return self.add("UVMap", uv_map="UVMap").outputs[0]

    def number(self, k=0):
        """A number that varies, one for each k."""
        return self.add("SeparateXYZ", {"Vector": self.uv()}).outputs[k]

    def colour(self, name="Tint"):
        return self.add("VertexColor", layer_name=name).outputs["Color"]


def material(name, build):
    """A diffuse material of the colour that build(Tree) returns."""
    made = scenes.new_material(name)
    made.node_tree.nodes.clear()
    tree = Tree(made.node_tree)
    try:
        shader = tree.add("BsdfDiffuse", {"Color": build(tree)})
    except Absent:
        bpy.data.materials.remove(made)
        raise
    tree.add("OutputMaterial", {"Surface": shader})
    return made


def image_file(depth, kind="PNG", ending="png", space="sRGB"):
    """A file of that many bits a channel, with alpha, as a render saves it."""
    made, settings = image(alpha=True, is_float=True, space="Linear Rec.709"), bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = kind, "RGBA", depth
    path = f"{bpy.app.tempdir}picture{depth}.{ending}"
    made.save_render(path)
    loaded = bpy.data.images.load(path)
    loaded.colorspace_settings.name = space
    return loaded


def image(name="Picture", alpha=False, is_float=False, space="sRGB", size=(13, 9), mode="STRAIGHT"):
    """A packed image of random pixels."""
    made = bpy.data.images.new(name, *size, alpha=alpha, float_buffer=is_float)
    made.colorspace_settings.name = space
    pixels = np.random.default_rng(5).uniform(0.05, 0.95, (size[1], size[0], 4)).astype(np.float32)
    pixels[..., 3] = np.linspace(0.2, 1.0, size[0]) if alpha else 1.0
    made.pixels.foreach_set(pixels.ravel())
    made.alpha_mode = mode
    made.pack()
    return made


TREES = {}


def tree(name):
    def keep(build):
        TREES[name] = build
        return build

    return keep


def each(names, title):
    def keep(make):
        for name in names:
            tree(f"{title} {str(name).lower()}")(lambda t, name=name: make(t, name))
        return make

    return keep


@tree("colour attribute")
def _(t):
    return t.colour()


@tree("byte colours")
def _(t):
    return t.colour("Bytes")


@each(["Color", "Vector", "Fac", "Alpha"], "attribute")
def _(t, name):
    node = t.add("Attribute", attribute_name="Bytes")
    return next(s for s in node.outputs if s.identifier == name)


@each(["UVMap", "Second"], "uv")
def _(t, name):
    return t.add("UVMap", uv_map=name)


@each(["Generated", "UV", "Object"], "coordinates")
def _(t, name):
    scaled = t.add("VectorMath", {"Vector": t.add("TexCoord").outputs[name], "Vector_001": (0.4, 0.3, 0.6)})
    scaled.operation = "MULTIPLY_ADD"
    t.put(scaled.inputs[2], (0.5, 0.4, 0.5))
    return scaled


@tree("position")
def _(t):
    return t.add("VectorMath", {"Vector": t.add("NewGeometry").outputs["Position"]}, operation="FRACTION")


MAPPED = {"Location": (0.1, 0.2, 0.3), "Rotation": (0.2, 0.1, 0.7), "Scale": (0.5, 0.8, 1.1)}


@each(["POINT", "TEXTURE", "VECTOR", "NORMAL"], "mapping")
def _(t, kind):
    given = {k: v for k, v in MAPPED.items() if k != "Location" or kind in ("POINT", "TEXTURE")}
    return t.add("VectorMath", {"Vector": t.add("Mapping", {"Vector": t.uv(), **given}, vector_type=kind)},
                 operation="ABSOLUTE")  # fmt: skip


@each(["REPEAT", "EXTEND", "CLIP", "MIRROR"], "image")
def _(t, kind):
    moved = t.add("Mapping", {"Vector": t.uv(), "Scale": (2.3, 1.9, 1.0), "Location": (-0.6, -0.4, 0)})
    return t.add("TexImage", {"Vector": moved}, image=image(), extension=kind).outputs["Color"]


@each(["Linear", "Closest", "Cubic", "Smart"], "image")
def _(t, kind):
    return t.add("TexImage", image=image(), interpolation=kind).outputs["Color"]


@each(["sRGB", "Non-Color", "Linear Rec.709"], "image space")
def _(t, space):
    return t.add("TexImage", image=image(space=space)).outputs["Color"]


@tree("image float")
def _(t):
    return t.add("TexImage", image=image(is_float=True, space="Linear Rec.709")).outputs["Color"]


@each(["STRAIGHT", "CHANNEL_PACKED", "NONE"], "image with alpha")
def _(t, mode):
    return t.add("TexImage", image=image(alpha=True, mode=mode)).outputs["Color"]


@each(["STRAIGHT", "CHANNEL_PACKED"], "image mixed by its alpha")
def _(t, mode):
    node = t.add("TexImage", image=image(alpha=True, mode=mode))
    return t.add("MixRGB", {"Fac": node.outputs["Alpha"], "Color1": (0.2, 0.5, 0.3), "Color2": node.outputs["Color"]})


@each(["SPHERE", "TUBE"], "image projection")
def _(t, kind):
    vector = t.add("TexCoord").outputs["Object"]
    return t.add("TexImage", {"Vector": vector}, image=image(), projection=kind).outputs["Color"]


@tree("image by generated coordinates")
def _(t):
    return t.add("TexImage", {"Vector": t.add("TexCoord").outputs["Generated"]}, image=image()).outputs["Color"]


@each(["sRGB", "Non-Color"], "image of bytes with alpha")
def _(t, space):
    return t.add("TexImage", image=image(alpha=True, space=space)).outputs["Color"]


@each(["8", "16"], "image file of bits")
def _(t, depth):
    return t.add("TexImage", image=image_file(depth)).outputs["Color"]


@each(["8", "16"], "image file mixed by its alpha of bits")
def _(t, depth):
    node = t.add("TexImage", image=image_file(depth))
    return t.add("MixRGB", {"Fac": node.outputs["Alpha"], "Color1": (0.2, 0.5, 0.3), "Color2": node.outputs["Color"]})


@each(["sRGB", "Linear Rec.709"], "image of floats with alpha")
def _(t, space):
    return t.add("TexImage", image=image(alpha=True, is_float=True, space=space)).outputs["Color"]


@tree("image file of linear floats")
def _(t):
    return t.add("TexImage", image=image_file("32", "OPEN_EXR", "exr", "Linear Rec.709")).outputs["Color"]


@each(["POINT", "TEXTURE", "VECTOR", "NORMAL"], "texture mapping")
def _(t, kind):
    node = t.add("TexImage", {"Vector": t.colour()}, image=image())
    held = node.texture_mapping
    held.vector_type, held.translation = kind, (0.2, 0.1, 0.3)
    held.rotation, held.scale = (0.2, 0.3, 0.4), (2.0, 1.5, 0.7)
    held.mapping_x, held.mapping_y, held.mapping_z = "Y", "Z", "X"
    return node.outputs["Color"]


@tree("texture mapping of a gradient")
def _(t):
    node = t.add("TexGradient")
    node.texture_mapping.scale, node.texture_mapping.mapping_x = (0.7, 1, 1), "Y"
    return node.outputs["Color"]


@each(["Color", "Vector", "Fac", "Alpha"], "attribute without a name")
def _(t, name):
    none = next(s for s in t.add("Attribute", attribute_name="").outputs if s.identifier == name)
    return t.add("Math", {"Value": none, "Value_001": 0.5}, operation="MULTIPLY")


@tree("a uv map as a number")
def _(t):
    return t.add("Attribute", attribute_name="Second").outputs["Fac"]


BLENDS = ("MIX DARKEN MULTIPLY BURN LIGHTEN SCREEN DODGE ADD OVERLAY SOFT_LIGHT LINEAR_LIGHT DIFFERENCE EXCLUSION "
          "SUBTRACT DIVIDE HUE SATURATION COLOR VALUE").split()  # fmt: skip


@each(BLENDS, "mix")
def _(t, kind):
    inputs = {"Factor_Float": t.number(), "A_Color": t.colour(), "B_Color": t.colour("Bytes")}
    return t.add("Mix", inputs, data_type="RGBA", blend_type=kind, clamp_result=True)


@each(["MIX", "OVERLAY", "HUE"], "legacy mix")
def _(t, kind):
    return t.add("MixRGB", {"Fac": 0.7, "Color1": t.colour(), "Color2": (0.3, 0.5, 0.2)}, blend_type=kind)


@tree("mix numbers")
def _(t):
    return t.add("Mix", {"Factor_Float": t.number(1), "A_Float": t.number(), "B_Float": 0.3}, data_type="FLOAT")


@each(["UNIFORM", "NON_UNIFORM"], "mix vectors")
def _(t, kind):
    inputs = {"Factor_Vector": (0.2, 0.5, 0.9), "Factor_Float": 0.3, "A_Vector": t.uv(), "B_Vector": (0.3, 0.2, 0.8)}
    return t.add("Mix", inputs, data_type="VECTOR", factor_mode=kind)


def bend(curve, y):
    curve.points[0].location = (0.0, 0.1)
    curve.points.new(0.4, y)


@tree("rgb curves")
def _(t):
    node = t.add("RGBCurve", {"Fac": 0.8, "Color": t.colour()})
    for k, y in enumerate((0.3, 0.6, 0.7, 0.5)):
        bend(node.mapping.curves[k], y)
    node.mapping.update()
    return node


@each(["HORIZONTAL", "EXTRAPOLATED"], "rgb curves beyond their ends")
def _(t, kind):
    moved = t.add("VectorMath", {"Vector": t.colour(), "Vector_001": (0.5, 0.5, 0.5)}, operation="SUBTRACT")
    node = t.add("RGBCurve", {"Color": moved})
    node.mapping.extend = kind
    bend(node.mapping.curves[3], 0.6)
    node.mapping.update()
    return node


@tree("vector curves")
def _(t):
    node = t.add("VectorCurve", {"Vector": t.uv()})
    bend(node.mapping.curves[0], 0.7)
    node.mapping.update()
    return t.add("VectorMath", {"Vector": node, "Vector_001": (0.5, 0.5, 0.5)}, operation="MULTIPLY")


@tree("float curve")
def _(t):
    node = t.add("FloatCurve", {"Value": t.number()})
    bend(node.mapping.curves[0], 0.7)
    node.mapping.update()
    return node


@tree("gamma")
def _(t):
    return t.add("Gamma", {"Color": t.colour(), "Gamma": 1.7})


@tree("invert")
def _(t):
    return t.add("Invert", {"Color": t.colour(), "Fac": 0.8})


@tree("brightness and contrast")
def _(t):
    return t.add("BrightContrast", {"Color": t.colour(), "Bright": 0.1, "Contrast": -0.3})


@tree("hue and saturation")
def _(t):
    return t.add("HueSaturation", {"Hue": 0.62, "Saturation": 0.8, "Value": 0.9, "Fac": 0.9, "Color": t.colour()})


MATHS = (
    "ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD POWER LOGARITHM SQRT INVERSE_SQRT ABSOLUTE EXPONENT MINIMUM MAXIMUM "
    "LESS_THAN GREATER_THAN SIGN COMPARE SMOOTH_MIN SMOOTH_MAX ROUND FLOOR CEIL TRUNC FRACT MODULO FLOORED_MODULO WRAP "
    "SNAP PINGPONG SINE COSINE TANGENT ARCSINE ARCCOSINE ARCTANGENT ARCTAN2 SINH COSH TANH RADIANS DEGREES"
).split()


@each(MATHS, "math")
def _(t, kind):
    a = t.add("Math", {"Value": t.number(), "Value_001": 0.13}, operation="SUBTRACT")
    return t.add("Math", {"Value": a, "Value_001": t.number(1), "Value_002": 0.37}, operation=kind, use_clamp=True)


VECTORS = (
    "ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD CROSS_PRODUCT PROJECT REFLECT REFRACT FACEFORWARD DOT_PRODUCT "
    "DISTANCE LENGTH SCALE NORMALIZE ABSOLUTE MINIMUM MAXIMUM FLOOR CEIL FRACTION MODULO WRAP SNAP SINE COSINE TANGENT "
    "SIGN POWER"
).split()


@each(VECTORS, "vectors")
def _(t, kind):
    inputs = {"Vector": t.colour(), "Vector_001": t.colour("Bytes")}
    try:
        node = t.add("VectorMath", inputs, operation=kind)
    except TypeError:
        raise Absent(kind) from None
    for socket, value in zip(list(node.inputs)[2:], ((0.3, 0.7, 0.2), 0.6)):
        socket.default_value = value
    if node.outputs[1].enabled:
        return t.add("Math", {"Value": node.outputs[1], "Value_001": 0.5}, operation="MULTIPLY")
    return t.add("VectorMath", {"Vector": node, "Vector_001": (0.5, 0.5, 0.5)}, operation="MULTIPLY")


@each(["LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"], "map range")
def _(t, kind):
    inputs = {"Value": t.number(), "From Min": 0.2, "From Max": 0.7, "To Min": 0.8, "To Max": 0.1, "Steps": 3.0}
    return t.add("MapRange", inputs, interpolation_type=kind)


@tree("map range of nothing")
def _(t):
    return t.add("MapRange", {"Value": t.number(), "From Min": 0.5, "From Max": 0.5, "To Min": 0.3, "To Max": 0.8})


@tree("map range of vectors")
def _(t):
    inputs = {"Vector": t.colour(), "From_Max_FLOAT3": (0.8, 0.6, 0.7), "To_Min_FLOAT3": (0.1, 0.2, 0.3)}
    return t.add("MapRange", inputs, data_type="FLOAT_VECTOR")


@each(["MINMAX", "RANGE"], "clamp")
def _(t, kind):
    return t.add("Clamp", {"Value": t.number(), "Min": 0.6, "Max": 0.3}, clamp_type=kind)


@each(["LINEAR", "EASE", "CONSTANT", "B_SPLINE", "CARDINAL"], "ramp")
def _(t, kind):
    node = t.add("ValToRGB", {"Fac": t.number()})
    node.color_ramp.interpolation = kind
    node.color_ramp.elements[0].color = (0.1, 0.6, 0.2, 1)
    node.color_ramp.elements.new(0.37).color = (0.8, 0.1, 0.3, 0.4)
    return node


@each(["RGB", "HSV", "HSL"], "separate and combine")
def _(t, kind):
    one = t.add("SeparateColor", {"Color": t.colour()}, mode=kind)
    inputs = {"Red": one.outputs[1], "Green": one.outputs[0], "Blue": one.outputs[2]}
    return t.add("CombineColor", inputs, mode=kind)


@each(["HSV", "HSL"], "combine hues beyond 1")
def _(t, kind):
    hue = t.add("Math", {"Value": t.number(), "Value_001": 3.0, "Value_002": -0.7}, operation="MULTIPLY_ADD")
    return t.add("CombineColor", {"Red": hue, "Green": t.number(1), "Blue": 0.6}, mode=kind)


@each(["RGB", "HSV"], "old separate and combine")
def _(t, kind):
    one = t.add(f"Separate{kind}", {"Image" if kind == "RGB" else "Color": t.colour()})
    return t.add(f"Combine{kind}", {kind[0]: one.outputs[2], kind[1]: one.outputs[1], kind[2]: one.outputs[0]})


@tree("combine xyz")
def _(t):
    return t.add("CombineXYZ", {"X": t.number(1), "Y": 0.3, "Z": t.number()})


@tree("rgb to bw")
def _(t):
    return t.add("RGBToBW", {"Color": t.colour()})


@tree("links convert colours to numbers and vectors to numbers")
def _(t):
    a = t.add("Math", {"Value": t.colour(), "Value_001": 0.5}, operation="MULTIPLY")
    b = t.add("Math", {"Value": t.uv(), "Value_001": 0.5}, operation="MULTIPLY")
    return t.add("CombineXYZ", {"X": a, "Y": b, "Z": t.number()})


@tree("blackbody")
def _(t):
    warm = t.add("MapRange", {"Value": t.number(), "To Min": 1200.0, "To Max": 13000.0})
    colour = t.add("Blackbody", {"Temperature": warm})
    return t.add("VectorMath", {"Vector": colour, "Vector_001": (0.2, 0.2, 0.2)}, operation="MULTIPLY")


@tree("checker")
def _(t):
    return t.add("TexChecker", {"Vector": t.uv(), "Color1": (0.1, 0.2, 0.7), "Scale": 3.7}).outputs[0]


@tree("checker of the object")
def _(t):
    return t.add("TexChecker", {"Color1": t.colour(), "Color2": (0.3, 0.2, 0.1), "Scale": 4.3}).outputs["Color"]


@each(["LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"], "gradient")
def _(t, kind):
    return t.add("TexGradient", {"Vector": t.add("TexCoord").outputs["Object"]}, gradient_type=kind).outputs[1]


@each([1, 2], "bricks squashed every")
def _(t, frequency):
    inputs = {"Vector": t.uv(), "Color1": (0.8, 0.2, 0.1), "Color2": (0.3, 0.6, 0.2), "Mortar": (0.1, 0.1, 0.6),
              "Scale": 3.3, "Mortar Size": 0.15, "Mortar Smooth": 0.6, "Bias": 0.1}  # fmt: skip
    return t.add("TexBrick", inputs, squash_frequency=frequency, squash=0.7).outputs["Color"]


@each([0, 1, 2, 5, 10], "magic")
def _(t, depth):
    return t.add("TexMagic", {"Vector": t.uv(), "Scale": 1.3, "Distortion": 0.8}, turbulence_depth=depth).outputs[0]


@each(["BANDS SIN", "BANDS SAW", "RINGS TRI"], "wave")
def _(t, kind):
    shape, profile = kind.split()
    inputs = {"Vector": t.uv(), "Scale": 0.7, "Phase Offset": 0.4}
    return t.add("TexWave", inputs, wave_type=shape, wave_profile=profile).outputs[1]


@tree("reroutes and muted nodes")
def _(t):
    muted = t.add("Gamma", {"Color": t.colour(), "Gamma": 3.0})
    muted.mute = True
    reroute = t.add("NodeReroute")
    t.put(reroute.inputs[0], muted.outputs[0])
    return reroute.outputs[0]


def group(name, inside, inputs):
    """A node group of one colour output: inside(Tree, the input node) -> socket."""
    made = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for one in inputs:
        made.interface.new_socket(one, in_out="INPUT", socket_type="NodeSocketColor").default_value = (0.2, 0.4, 0.6, 1)
    made.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    tree = Tree(made)
    shown = inside(tree, tree.add("NodeGroupInput"))
    tree.put(tree.add("NodeGroupOutput").inputs[0], shown)
    return made


@tree("groups in groups")
def _(t):
    inner = group("Inner", lambda g, given: g.add("Invert", {"Color": given.outputs[0], "Fac": 0.5}).outputs[0], ["A"])

    def outer(g, given):
        first = g.add("Group", node_tree=inner)
        g.put(first.inputs[0], given.outputs[0])
        second = g.add("Group", node_tree=inner)
        g.put(second.inputs[0], given.outputs[1])
        return g.add("MixRGB", {"Fac": 0.3, "Color1": first.outputs[0], "Color2": second.outputs[0]}).outputs[0]

    node = t.add("Group", node_tree=group("Outer", outer, ["A", "B"]))
    t.put(node.inputs[0], t.colour())
    return node.outputs[0]


@tree("several in a row")
def _(t):
    node = t.add("TexImage", {"Vector": t.add("Mapping", {"Vector": t.uv(), "Scale": (0.7, 0.7, 1)})}, image=image())
    curve = t.add("HueSaturation", {"Color": node.outputs["Color"], "Saturation": 0.5})
    return t.add("MixRGB", {"Fac": t.number(), "Color1": curve, "Color2": t.colour()}, blend_type="MULTIPLY")
