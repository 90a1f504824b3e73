"""Procedural textures: checks, bricks, gradients and waves exactly as Cycles has them, noises by their mean."""

import numpy as np

from .node_math import moved_in_node
from .node_places import read_off
from .node_values import constant, derive
from .node_walk import Recipe, Unknown, title

NUDGE = 1e-6  # by which Cycles keeps whole numbers off the edges
TURN = 2 * np.pi


def pattern(names, function):
    """A reader: function(node) -> f(vector, *inputs) -> (n, 1) or (n, 3); the vector is the generated coordinates
    where nothing is linked."""

    def read(output, walk):
        vector = output.input("Vector")
        is_linked = walk.is_linked(vector)
        made = function(output.node)
        if made is None:
            return _its_mean(output, walk)
        wants_number = output.socket.identifier == "Fac"

        def whole(given, *inputs):
            place = moved_in_node(output.node, given if is_linked else read_off("generated"))
            result = derive(made, place, *inputs)
            return derive(lambda a: _as(a, wants_number), result)

        return Recipe([vector, *(output.input(name) for name in names)], whole)

    return read


def _as(array, wants_number):
    """(n, 1), (n, 3) or (n, 4) colour and factor -> what the output holds"""
    if array.shape[1] == 4:
        return array[:, 3:] if wants_number else array[:, :3]
    if wants_number:
        return array.mean(axis=1, keepdims=True)
    return np.repeat(array, 3, axis=1) if array.shape[1] == 1 else array


def _checker(node):
    def checks(vector, one, other, scale):
        cell = np.abs(np.floor((vector * scale + NUDGE) * (1 - NUDGE))).astype(np.int64) % 2
        is_one = ((cell[:, :1] == cell[:, 1:2]) == (cell[:, 2:] == 1)) * 1.0
        return np.concatenate([np.where(is_one == 1, one, other), is_one], axis=1)

    return checks


def _gradient(node):
    kind = node.gradient_type

    def shade(vector):
        x, y, z = vector.T
        ball = np.maximum(0.999999 - np.sqrt(x * x + y * y + z * z), 0.0)
        x = {
            "LINEAR": lambda: x,
            "QUADRATIC": lambda: np.maximum(x, 0.0) ** 2,
            "EASING": lambda: np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1)),
            "DIAGONAL": lambda: (x + y) / 2,
            "RADIAL": lambda: np.arctan2(y, x) / TURN + 0.5,
            "QUADRATIC_SPHERE": lambda: ball * ball,
            "SPHERICAL": lambda: ball,
        }[kind]()
        return np.clip(x, 0.0, 1.0)[:, None]

    return shade


def _hashed(n):
    """Whole numbers (n,) -> 0..1, as Cycles tints bricks"""
    n = (n.astype(np.uint32) + np.uint32(1013)) & np.uint32(0x7FFFFFFF)
    n = (n >> np.uint32(13)) ^ n
    n = n * (n * n * np.uint32(60493) + np.uint32(19990303)) + np.uint32(1376312589)
    return 0.5 * ((n & np.uint32(0x7FFFFFFF)) / 1073741824.0)


def _brick(node):
    offset, offset_every, squash, squash_every = (
        node.offset, node.offset_frequency, node.squash, node.squash_frequency
    )  # fmt: skip

    def bricks(vector, one, other, mortar, scale, size, smooth, bias, width, height):
        p = vector * scale
        size, smooth, bias, width, height = (a[:, 0] for a in (size, smooth, bias, width, height))
        row = np.floor(p[:, 1] / height).astype(np.int64)
        shift = np.zeros(len(p))
        if offset_every and squash_every:
            width = width * np.where(row % squash_every, 1.0, squash)
            shift = np.where(row % offset_every, 0.0, width * offset)
        column = np.floor((p[:, 0] + shift) / width).astype(np.int64)
        x, y = p[:, 0] + shift - width * column, p[:, 1] - height * row
        tint = np.clip(_hashed((row << 16) + (column & 0xFFFF)) + bias, 0.0, 1.0)
        edge = np.minimum(np.minimum(x, y), np.minimum(width - x, height - y))
        t = np.clip((1 - edge / size) / smooth, 0.0, 1.0)
        soft = np.where(smooth == 0, 1.0, t * t * (3 - 2 * t))
        share = np.where(edge >= size, 0.0, soft)[:, None]
        brick = one + tint[:, None] * (other - one)
        return np.concatenate([brick * (1 - share) + mortar * share, share], axis=1)

    return bricks


def _magic(node):
    depth = node.turbulence_depth

    def swirls(vector, scale, distortion):
        px, py, pz = ((vector * scale) % TURN).T
        d = distortion[:, 0] * np.ones(len(px))
        x, y, z = np.sin((px + py + pz) * 5), np.cos((-px + py - pz) * 5), -np.cos((-px - py + pz) * 5)
        if depth > 0:
            x, y, z = x * d, y * d, z * d
            y = -np.cos(x - y + z) * d
        steps = [
            lambda: (np.cos(x - y - z) * d, y, z),
            lambda: (x, y, np.sin(-x - y - z) * d),
            lambda: (-np.cos(-x + y - z) * d, y, z),
            lambda: (x, -np.sin(-x + y + z) * d, z),
            lambda: (x, -np.cos(-x + y + z) * d, z),
            lambda: (np.cos(x + y + z) * d, y, z),
            lambda: (x, y, np.sin(x + y - z) * d),
            lambda: (-np.cos(-x - y + z) * d, y, z),
            lambda: (x, -np.sin(x - y + z) * d, z),
        ]
        for step in steps[: max(depth - 1, 0)]:
            x, y, z = step()
        half = np.where(d != 0, 2 * d, 1.0)
        return 0.5 - np.stack([x / half, y / half, z / half], axis=1)

    return swirls


def _wave(node):
    if node.inputs["Distortion"].is_linked or node.inputs["Distortion"].default_value != 0:
        return None  # a noise
    is_bands, profile = node.wave_type == "BANDS", node.wave_profile
    direction = node.bands_direction if is_bands else node.rings_direction

    def waves(vector, scale, phase):
        p = (vector * scale + NUDGE) * (1 - NUDGE)
        if is_bands:
            n = p.sum(axis=1) * 10 if direction == "DIAGONAL" else p[:, "XYZ".index(direction)] * 20
        else:
            away = p * [direction != axis for axis in "XYZ"]
            n = np.sqrt((away**2).sum(axis=1)) * 20
        n = n[:, None] + phase
        if profile == "SIN":
            return 0.5 + 0.5 * np.sin(n - np.pi / 2)
        n = n / TURN
        return n - np.floor(n) if profile == "SAW" else np.abs(n - np.floor(n + 0.5)) * 2

    return waves


_MEAN = 0.5  # of the outputs of noises, which fill 0 to 1


def _its_mean(output, walk):
    if output.socket.identifier in ("Position", "W", "Orientation"):
        return Unknown()
    note = f"its {title(output.node)} is not followed: its plain mean of {_MEAN} is used"
    return Recipe([], lambda: constant(np.full(3 if output.socket.type != "VALUE" else 1, _MEAN), (note,)))


READERS = {
    "ShaderNodeTexChecker": pattern(["Color1", "Color2", "Scale"], _checker),
    "ShaderNodeTexGradient": pattern([], _gradient),
    "ShaderNodeTexBrick": pattern(
        ["Color1", "Color2", "Mortar", "Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height"],
        _brick,
    ),
    "ShaderNodeTexMagic": pattern(["Scale", "Distortion"], _magic),
    "ShaderNodeTexWave": pattern(["Scale", "Phase Offset"], _wave),
} | {
    f"ShaderNodeTex{name}": _its_mean for name in ("Noise", "Voronoi", "Musgrave", "WhiteNoise", "Gabor")
}  # fmt: skip
