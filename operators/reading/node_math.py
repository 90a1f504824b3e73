"""Nodes that calculate with numbers and vectors, as Cycles does: Math, Vector Math, Map Range, Clamp, Mapping, ..."""

import numpy as np

from .node_values import derive, joined, part
from .node_walk import Recipe, Unknown

EPSILON = 1.1920929e-07  # of single precision, within which Compare takes numbers as equal


def of_inputs(identifiers, function):
    """A reader: function of the arrays of these inputs."""

    def read(output, walk):
        return Recipe([output.input(name) for name in identifiers], lambda *values: derive(function, *values))

    return read


def over(a, b):
    """a / b, 0 where b is 0."""
    zero = b == 0
    return np.where(zero, 0.0, a / np.where(zero, 1.0, b))


def _power(a, b):
    return np.where((a < 0) & (b != np.trunc(b)), 0.0, np.power(a, b))


def _logarithm(a, b):
    valid = (a > 0) & (b > 0)
    return np.where(valid, over(np.log(np.where(valid, a, 1.0)), np.log(np.where(valid, b, 1.0))), 0.0)


def _modulo(a, b):
    return np.where(b != 0, np.fmod(a, np.where(b != 0, b, 1.0)), 0.0)


def _wrap(a, most, least):
    extent = most - least
    return np.where(extent != 0, a - extent * np.floor(over(a - least, extent)), least)


def _ping_pong(a, b):
    turns = over(a - b, 2 * b)
    return np.where(b != 0, np.abs((turns - np.floor(turns)) * 2 * b - b), 0.0)


def _smooth_least(a, b, k):
    h = over(np.maximum(k - np.abs(a - b), 0.0), k)
    return np.minimum(a, b) - h**3 * k / 6


def _inverse_root(a):
    return np.where(a > 0, 1 / np.sqrt(np.where(a > 0, a, 1.0)), 0.0)


_MATH = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: over(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _power(a, b),
    "LOGARITHM": lambda a, b, c: _logarithm(a, b),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0.0)),
    "INVERSE_SQRT": lambda a, b, c: _inverse_root(a),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "EXPONENT": lambda a, b, c: np.exp(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0,
    "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, EPSILON)) * 1.0,
    "SMOOTH_MIN": _smooth_least,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_least(-a, -b, c),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: a - np.floor(a),
    "MODULO": lambda a, b, c: _modulo(a, b),
    "FLOORED_MODULO": lambda a, b, c: np.where(b != 0, a - np.floor(over(a, b)) * b, 0.0),
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: np.floor(over(a, b)) * b,
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: np.arcsin(np.clip(a, -1, 1)),
    "ARCCOSINE": lambda a, b, c: np.arccos(np.clip(a, -1, 1)),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "SINH": lambda a, b, c: np.sinh(a),
    "COSH": lambda a, b, c: np.cosh(a),
    "TANH": lambda a, b, c: np.tanh(a),
    "RADIANS": lambda a, b, c: np.radians(a),
    "DEGREES": lambda a, b, c: np.degrees(a),
}


def _math(output, walk):
    node = output.node
    if node.operation not in _MATH:
        return Unknown(f" of operation {node.operation}, which is not read")
    return _clamped(_MATH[node.operation], node.use_clamp, list(output.node.inputs), output)


def _clamped(function, clamp, sockets, output):
    def limited(*arrays):
        return np.clip(function(*arrays), 0.0, 1.0) if clamp else function(*arrays)

    return Recipe([output.input(s.identifier) for s in sockets], lambda *values: derive(limited, *values))


def _dot(a, b):
    return np.sum(a * b, axis=1, keepdims=True)


def _length(a):
    return np.sqrt(_dot(a, a))


def _unit(a):
    return over(a, _length(a))


def _reflect(a, b):
    normal = _unit(b)
    return a - 2 * _dot(normal, a) * normal


def _refract(a, b, ratio):
    normal = _unit(b)
    cosine = _dot(normal, a)
    k = 1 - ratio**2 * (1 - cosine**2)
    return np.where(k < 0, 0.0, ratio * a - (ratio * cosine + np.sqrt(np.maximum(k, 0.0))) * normal)


_VECTOR_MATH = {  # of a, b, c and the number `scale`; beside those of Math that go component by component
    "CROSS_PRODUCT": lambda a, b, c, s: np.cross(a, b),
    "PROJECT": lambda a, b, c, s: over(_dot(a, b), _dot(b, b)) * b,
    "REFLECT": lambda a, b, c, s: _reflect(a, b),
    "REFRACT": lambda a, b, c, s: _refract(a, b, s),
    "FACEFORWARD": lambda a, b, c, s: np.where(_dot(c, b) < 0, a, -a),
    "DOT_PRODUCT": lambda a, b, c, s: _dot(a, b),
    "DISTANCE": lambda a, b, c, s: _length(a - b),
    "LENGTH": lambda a, b, c, s: _length(a),
    "SCALE": lambda a, b, c, s: a * s,
    "NORMALIZE": lambda a, b, c, s: _unit(a),
    "FRACTION": lambda a, b, c, s: a - np.floor(a),
}
_NUMBERS = {"DOT_PRODUCT", "DISTANCE", "LENGTH"}  # what comes out of Value instead of Vector


def _vector_math(output, walk):
    operation = output.node.operation
    if operation in _VECTOR_MATH:
        function = _VECTOR_MATH[operation]
    elif operation in _MATH:
        function = lambda a, b, c, s: _MATH[operation](a, b, c)  # noqa: E731
    else:
        return Unknown(f" of operation {operation}, which is not read")
    if (operation in _NUMBERS) != (output.socket.identifier == "Value"):
        return Unknown(f", whose {output.socket.name} is not in use")
    inputs = [output.input(name) for name in ("Vector", "Vector_001", "Vector_002", "Scale")]
    return Recipe(inputs, lambda *values: derive(function, *values))


def _smooth(x):
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def _smoother(x):
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (x * (x * 6 - 15) + 10)


def _stepped(x, steps):
    return np.where(steps > 0, over(np.floor(x * (steps + 1)), steps), 0.0)


def _map_range(output, walk):
    node = output.node
    of_vectors = node.data_type == "FLOAT_VECTOR"
    names = ["Value", "From Min", "From Max", "To Min", "To Max", "Steps"]
    if of_vectors:
        names = ["Vector", *(f"{name.replace(' ', '_')}_FLOAT3" for name in names[1:])]

    def mapped(value, least, most, low, high, steps):
        x = over(value - least, most - least)
        if node_kind == "STEPPED":
            x = _stepped(x, steps)
        elif node_kind != "LINEAR":
            x = _smooth(x) if node_kind == "SMOOTHSTEP" else _smoother(x)
        result = low + x * (high - low)
        if not of_vectors:
            result = np.where(least != most, result, 0.0)
        return np.clip(result, np.minimum(low, high), np.maximum(low, high)) if clamp else result

    node_kind, clamp = node.interpolation_type, node.clamp
    return Recipe([output.input(name) for name in names], lambda *values: derive(mapped, *values))


def _clamp(output, walk):
    is_range = output.node.clamp_type == "RANGE"

    def limited(value, least, most):
        if is_range:
            least, most = np.minimum(least, most), np.maximum(least, most)
        return np.minimum(np.maximum(value, least), most)

    return Recipe([output.input(name) for name in ("Value", "Min", "Max")], lambda *values: derive(limited, *values))


def rotation(angles):
    """Euler angles XYZ (n, 3) -> matrices (n, 3, 3)"""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz],
        [cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz],
        [-sy, cy * sx, cy * cx],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _turned(vectors, angles):
    matrices = rotation(angles)
    return vectors @ matrices[0].T if len(matrices) == 1 else np.einsum("nij,nj->ni", matrices, vectors)


def _turned_back(vectors, angles):
    matrices = rotation(angles)
    return vectors @ matrices[0] if len(matrices) == 1 else np.einsum("nji,nj->ni", matrices, vectors)


_MAPPINGS = {
    "POINT": lambda v, at, turn, scale: _turned(v * scale, turn) + at,
    "TEXTURE": lambda v, at, turn, scale: over(_turned_back(v - at, turn), scale),
    "VECTOR": lambda v, at, turn, scale: _turned(v * scale, turn),
    "NORMAL": lambda v, at, turn, scale: _unit(_turned(over(v, scale), turn)),
}


def _mapping(output, walk):
    kind = output.node.vector_type
    inputs = output.inputs()
    none = np.zeros((1, 3))
    names = ["Vector", *(["Location"] if "Location" in inputs else []), "Rotation", "Scale"]

    def moved(vector, *others):
        at, turn, scale = others if len(others) == 3 else (none, *others)
        return _MAPPINGS[kind](vector, at, turn, scale)

    return Recipe([output.input(name) for name in names], lambda *values: derive(moved, *values))


def moved_in_node(node, vector):
    """The Value of a texture's place moved by what its node holds itself, as Cycles does: the sidebar's Texture
    Mapping."""
    held, kind = node.texture_mapping, node.texture_mapping.vector_type
    at, turn, scale = (np.array(v, float)[None] for v in (held.translation, held.rotation, held.scale))
    swap = np.zeros((3, 3))
    for k, axis in enumerate((held.mapping_x, held.mapping_y, held.mapping_z)):
        if axis != "NONE":
            swap[k, "XYZ".index(axis)] = 1.0
    if not at.any() and not turn.any() and (scale == 1).all() and (swap == np.eye(3)).all():
        return vector
    return derive(lambda v: _MAPPINGS[kind](v @ swap.T, at, turn, scale), vector)


def _separate_xyz(output, walk):
    k = "XYZ".index(output.socket.identifier)
    return Recipe([output.input("Vector")], lambda vector: part(vector, k))


def _combine_xyz(output, walk):
    return Recipe([output.input(name) for name in "XYZ"], joined)


READERS = {
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeSeparateXYZ": _separate_xyz,
    "ShaderNodeCombineXYZ": _combine_xyz,
}
