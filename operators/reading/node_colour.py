"""Nodes that calculate with colours, as Cycles does: Mix, curves, Color Ramp, Hue/Saturation, Blackbody, ..."""

import numpy as np

from .node_math import of_inputs, over
from .node_values import constant, derive, joined, luminance, mixed, part
from .node_walk import Recipe, Unknown

TABLE = 256  # entries by which Cycles knows curves and ramps


def hsv_of_rgb(rgb):
    """(n, 3) -> hue, saturation, value in 0..1"""
    most, least = rgb.max(axis=1), rgb.min(axis=1)
    spread = most - least
    saturation = np.where(most != 0, over(spread, most), 0.0)
    return np.stack([np.where(saturation != 0, _hue(rgb, most, spread), 0.0), saturation, most], axis=1)


def _hue(rgb, most, spread):
    c = over(most[:, None] - rgb, spread[:, None])
    by_red, by_green = c[:, 2] - c[:, 1], 2 + c[:, 0] - c[:, 2]
    hue = np.where(rgb[:, 0] == most, by_red, np.where(rgb[:, 1] == most, by_green, 4 + c[:, 1] - c[:, 0]))
    return (hue / 6) % 1.0


def rgb_of_hsv(hsv):
    """(n, 3) -> (n, 3)"""
    return _coloured(hsv[:, :1], hsv[:, 1:2], hsv[:, 2:])


def _coloured(hue, saturation, value):
    """(n, 1) each -> (n, 3)"""
    return value * (1 + saturation * (_pure(hue) - 1))


def _pure(hue):
    """(n, 1) -> (n, 3) the full colour of a hue"""
    return np.clip(np.abs(6 * hue - [3, 2, 4]) * [1, -1, -1] + [-1, 2, 2], 0.0, 1.0)


def hsl_of_rgb(rgb):
    most, least = rgb.max(axis=1), rgb.min(axis=1)
    light, spread = (most + least) / 2, most - least
    saturation = over(spread, 1 - np.abs(2 * light - 1))
    saturation = np.where(light > 0.5, over(spread, 2 - most - least), over(spread, most + least))
    return np.stack([np.where(spread != 0, _hue(rgb, most, spread), 0.0), saturation, light], axis=1)


def rgb_of_hsl(hsl):
    hue, saturation, light = hsl.T
    chroma = (1 - np.abs(2 * light - 1)) * saturation
    return (_pure(hue[:, None]) - 0.5) * chroma[:, None] + light[:, None]


# How colour b goes over colour a by a share t (n, 1); t is 0 to 1.


def _overlay(a, b, t):
    return np.where(a < 0.5, a * (1 - t + 2 * t * b), 1 - (1 - t + 2 * t * (1 - b)) * (1 - a))


def _divide(a, b, t):
    return np.where(b != 0, (1 - t) * a + t * over(a, b), a)


def _dodge(a, b, t):
    left = 1 - t * b
    return np.where(a != 0, np.where(left <= 0, 1.0, np.minimum(over(a, left), 1.0)), 0.0)


def _burn(a, b, t):
    left = 1 - t + t * b
    return np.where(left <= 0, 0.0, np.clip(1 - over(1 - a, left), 0.0, 1.0))


def _soft_light(a, b, t):
    screen = 1 - (1 - b) * (1 - a)
    return (1 - t) * a + t * ((1 - a) * b * a + a * screen)


def _between(a, b, t):
    return (1 - t) * a + t * b


def _of_hsv(change, needs_colour):
    """A blend by hue, saturation, value: change(hsv of a, hsv of b, t) -> hsv, left out where b or a is grey."""

    def blend(a, b, t):
        a, b, t = np.broadcast_arrays(a, b, np.repeat(t, 3, axis=1) if t.shape[1] == 1 else t)
        own, other = hsv_of_rgb(a), hsv_of_rgb(b)
        keeps = {"b": other[:, 1:2] == 0, "a": own[:, 1:2] == 0, "": np.zeros((len(a), 1), bool)}[needs_colour]
        return np.where(keeps, a, change(a, own, other, t))

    return blend


def _take_hue(a, own, other, t):
    return _between(a, rgb_of_hsv(np.stack([other[:, 0], own[:, 1], own[:, 2]], axis=1)), t)


def _take_saturation(a, own, other, t):
    saturation = _between(own[:, 1], other[:, 1], t[:, 0])
    return rgb_of_hsv(np.stack([own[:, 0], saturation, own[:, 2]], axis=1))


def _take_value(a, own, other, t):
    return rgb_of_hsv(np.stack([own[:, 0], own[:, 1], _between(own[:, 2], other[:, 2], t[:, 0])], axis=1))


def _take_colour(a, own, other, t):
    return _between(a, rgb_of_hsv(np.stack([other[:, 0], other[:, 1], own[:, 2]], axis=1)), t)


_BLENDS = {
    "MIX": _between,
    "ADD": lambda a, b, t: a + t * b,
    "MULTIPLY": lambda a, b, t: _between(a, a * b, t),
    "SUBTRACT": lambda a, b, t: a - t * b,
    "SCREEN": lambda a, b, t: 1 - (1 - t + t * (1 - b)) * (1 - a),
    "OVERLAY": _overlay,
    "DIVIDE": _divide,
    "DIFFERENCE": lambda a, b, t: _between(a, np.abs(a - b), t),
    "EXCLUSION": lambda a, b, t: np.maximum(_between(a, a + b - 2 * a * b, t), 0.0),
    "DARKEN": lambda a, b, t: _between(a, np.minimum(a, b), t),
    "LIGHTEN": lambda a, b, t: _between(a, np.maximum(a, b), t),
    "DODGE": _dodge,
    "BURN": _burn,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda a, b, t: a + t * (2 * b - 1),
    "HUE": _of_hsv(_take_hue, "b"),
    "SATURATION": _of_hsv(_take_saturation, "a"),
    "VALUE": _of_hsv(_take_value, ""),
    "COLOR": _of_hsv(_take_colour, "b"),
}


def _mix(output, walk):
    node = output.node
    kind = node.data_type
    if kind not in ("FLOAT", "VECTOR", "RGBA"):
        return Unknown()
    suffix = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}[kind]
    by_parts = kind == "VECTOR" and node.factor_mode == "NON_UNIFORM"
    names = ["Factor_Vector" if by_parts else "Factor_Float", f"A_{suffix}", f"B_{suffix}"]
    blend = node.blend_type if kind == "RGBA" else "MIX"
    return _blended(output, names, blend, node.clamp_factor, kind == "RGBA" and node.clamp_result)


def _mix_rgb(output, walk):
    return _blended(output, ["Fac", "Color1", "Color2"], output.node.blend_type, True, output.node.use_clamp)


def _blended(output, names, blend, clamp_factor, clamp_result):
    function = _BLENDS[blend]

    def made(factor, a, b):
        if clamp_factor:
            factor = derive(lambda f: np.clip(f, 0.0, 1.0), factor)
        if blend == "MIX":
            result = mixed(factor, a, b)
        else:
            result = derive(lambda f, one, other: function(one, other, f), factor, a, b)
        return derive(lambda array: np.clip(array, 0.0, 1.0), result) if clamp_result else result

    return Recipe([output.input(name) for name in names], made)


def _looked_up(table, at):
    """table (k, c) over 0..1 at places (n,), straight beyond its ends"""
    place = at * (len(table) - 1)
    index = np.clip(place, 0, len(table) - 2).astype(int)
    return table[index] + (place - index)[:, None] * (table[index + 1] - table[index])


def _curve_table(node, chains):
    """(table (TABLE, c), least, most): each column a row of curves applied one after the other."""
    mapping = node.mapping
    mapping.initialize()
    ends = [(curve.points[0].location[0], curve.points[-1].location[0]) for curve in mapping.curves]
    least, most = min(0.0, *(a for a, _ in ends)), max(1.0, *(b for _, b in ends))
    columns = []
    for chain in chains:
        values = np.linspace(least, most, TABLE)
        for k in chain:
            values = np.array([mapping.evaluate(mapping.curves[k], float(x)) for x in values])
        columns.append(values)
    return np.column_stack(columns), least, most


def _curves(chains, factor, socket):
    """A reader of curves: chains of curve numbers, one a component."""

    def read(output, walk):
        table, least, most = _curve_table(output.node, chains)
        goes_on = output.node.mapping.extend == "EXTRAPOLATED"

        def curved(share, value):
            at = (value - least) / (most - least)
            at = at if goes_on else np.clip(at, 0.0, 1.0)
            columns = [_looked_up(table[:, k : k + 1], at[:, k]) for k in range(len(chains))]
            return _between(value, np.concatenate(columns, axis=1), share)

        return Recipe([output.input(factor), output.input(socket)], lambda *values: derive(curved, *values))

    return read


def _ramp(output, walk):
    ramp = output.node.color_ramp
    table = np.array([ramp.evaluate(k / (TABLE - 1)) for k in range(TABLE)])
    is_stepped = ramp.interpolation == "CONSTANT"

    def coloured(factor):
        at = np.clip(factor[:, 0], 0.0, 1.0)
        return table[(at * (TABLE - 1)).astype(int)] if is_stepped else _looked_up(table, at)

    columns = slice(3, 4) if output.socket.identifier == "Alpha" else slice(3)
    return Recipe([output.input("Fac")], lambda factor: derive(lambda f: coloured(f)[:, columns], factor))


def _hue_saturation(hue, saturation, value, factor, colour):
    hsv = hsv_of_rgb(colour)
    strength = np.clip(hsv[:, 1:2] * saturation, 0.0, 1.0)
    changed = _coloured((hsv[:, :1] + hue + 0.5) % 1.0, strength, hsv[:, 2:] * value)
    return np.maximum(_between(colour, changed, factor), 0.0)


def _contrast(colour, bright, contrast):
    return np.maximum((1 + contrast) * colour + bright - contrast / 2, 0.0)


_TO = {"RGB": lambda rgb: rgb, "HSV": hsv_of_rgb, "HSL": hsl_of_rgb}


def _rgb_of_any_hsv(hsv):
    """A hue beyond 0..1 is one of its last sixth."""
    hue = hsv[:, 0]
    hue = np.where((hue >= 0) & (hue < 1), hue, np.where(hue == 1, 0.0, (5 + (6 * hue) % 1.0) / 6))
    return rgb_of_hsv(np.column_stack([hue, hsv[:, 1:]]))


_FROM = {"RGB": lambda rgb: rgb, "HSV": _rgb_of_any_hsv, "HSL": rgb_of_hsl}


def _separate(names, source, mode=None):
    def read(output, walk):
        k, to = names.index(output.socket.identifier), _TO[mode or output.node.mode]
        return Recipe([output.input(source)], lambda colour: part(derive(to, colour), k))

    return read


def _combine(names, mode=None):
    def read(output, walk):
        back = _FROM[mode or output.node.mode]
        return Recipe([output.input(name) for name in names], lambda *values: derive(back, joined(*values)))

    return read


def blackbody(kelvin):
    """Temperatures (n, 1) -> linear Rec.709 (n, 3); the fit that Cycles uses, of luminance 1."""
    t = kelvin[:, 0]
    row = np.searchsorted([965, 1167, 1449, 1902, 3315, 6365], t, side="right")
    safe = np.clip(t, 800.0, 12000.0)
    red, green, blue = _RED[row].T, _GREEN[row].T, _BLUE[row].T
    rgb = np.stack([
        red[0] / safe + red[1] * safe + red[2],
        green[0] / safe + green[1] * safe + green[2],
        ((blue[0] * safe + blue[1]) * safe + blue[2]) * safe + blue[3],
    ], axis=1)  # fmt: skip
    rgb = np.where((t >= 12000)[:, None], [0.8262954810464208, 0.9945080501520986, 1.566307710274283], rgb)
    rgb = np.where((t < 800)[:, None], [5.413294490189271, -0.20319390035873933, -0.0822535242887164], rgb)
    return np.maximum(rgb, 0.0)


_RED = np.array([
    [1.61919106e3, -2.05010916e-3, 5.02995757],
    [2.48845471e3, -1.11330907e-3, 3.22621544],
    [3.34143193e3, -4.86551192e-4, 1.76486769],
    [4.09461742e3, -1.27446582e-4, 7.25731635e-1],
    [4.67028036e3, 2.91258199e-5, 1.26703442e-1],
    [4.59509185e3, 2.87495649e-5, 1.50345020e-1],
    [3.78717450e3, 9.35907826e-6, 3.99075871e-1],
])  # fmt: skip
_GREEN = np.array([
    [-4.88999748e2, 6.04330754e-4, -7.55807526e-2],
    [-7.55994277e2, 3.16730098e-4, 4.78306139e-1],
    [-1.02363977e3, 1.20223470e-4, 9.36662319e-1],
    [-1.26571316e3, 4.87340896e-6, 1.27054498],
    [-1.42529332e3, -4.01150431e-5, 1.43972784],
    [-1.17554822e3, -2.16378048e-5, 1.30408023],
    [-5.00799571e2, -4.59832026e-6, 1.09098763],
])  # fmt: skip
_BLUE = np.array([
    [5.96945309e-11, -4.85742887e-8, -9.70622247e-5, -4.07936148e-3],
    [2.40430366e-11, 5.55021075e-8, -1.98503712e-4, 2.89312858e-2],
    [-1.40949732e-11, 1.89878968e-7, -3.56632824e-4, 9.10767778e-2],
    [-3.61460868e-11, 2.84822009e-7, -4.93211319e-4, 1.56723440e-1],
    [-1.97075738e-11, 1.75359352e-7, -2.50542825e-4, -2.22783266e-2],
    [-1.61997957e-13, -1.64216008e-8, 3.86216271e-4, -7.38077418e-1],
    [6.72650283e-13, -2.73078809e-8, 4.24098264e-4, -7.52335691e-1],
])  # fmt: skip


def _own_value(output, walk):
    """A node that holds its value in its output socket."""
    value = constant(np.array(output.socket.default_value, float).ravel()[:3])
    return Recipe([], lambda: value)


READERS = {
    "ShaderNodeValue": _own_value,
    "ShaderNodeRGB": _own_value,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeRGBCurve": _curves([(3, 0), (3, 1), (3, 2)], "Fac", "Color"),
    "ShaderNodeVectorCurve": _curves([(0,), (1,), (2,)], "Fac", "Vector"),
    "ShaderNodeFloatCurve": _curves([(0,)], "Factor", "Value"),
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeGamma": of_inputs(["Color", "Gamma"], lambda c, g: np.where(c > 0, np.power(np.abs(c), g), c)),
    "ShaderNodeInvert": of_inputs(["Fac", "Color"], lambda f, c: _between(c, 1 - c, f)),
    "ShaderNodeBrightContrast": of_inputs(["Color", "Bright", "Contrast"], _contrast),
    "ShaderNodeHueSaturation": of_inputs(["Hue", "Saturation", "Value", "Fac", "Color"], _hue_saturation),
    "ShaderNodeRGBToBW": of_inputs(["Color"], luminance),
    "ShaderNodeBlackbody": of_inputs(["Temperature"], blackbody),
    "ShaderNodeSeparateColor": _separate(["Red", "Green", "Blue"], "Color"),
    "ShaderNodeCombineColor": _combine(["Red", "Green", "Blue"]),
    "ShaderNodeSeparateRGB": _separate(["R", "G", "B"], "Image", "RGB"),
    "ShaderNodeCombineRGB": _combine(["R", "G", "B"], "RGB"),
    "ShaderNodeSeparateHSV": _separate(["H", "S", "V"], "Color", "HSV"),
    "ShaderNodeCombineHSV": _combine(["H", "S", "V"], "HSV"),
}
