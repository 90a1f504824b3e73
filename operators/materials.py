"""Materials and worlds as diffuse reflectance and emission, by the plain values of their nodes.

Cycles calls the side that a mesh's normals face the front, under mirroring object matrices too.
"""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..pdm_core.scene import MAX_REFLECTANCE
from .preview_nodes import before_preview

NO_MATERIAL = 0.8  # the grey that Blender gives an object without material
FRONT, BACK = 0, 1
REFLECTED, EMITTED = 0, 1
UNLIKE_DIFFUSE = {"Metallic": 0.0, "Transmission Weight": 0.0, "Alpha": 1.0}  # of a Principled shader, with its default


@dataclass(frozen=True, eq=False)
class Appearance:
    """reflectance (2, 3) of front and back, at most MAX_REFLECTANCE; emission (2, 3) as radiance; warnings: sentences
    that go on after the material's name."""

    reflectance: np.ndarray
    emission: np.ndarray
    warnings: list = field(default_factory=list)
    is_volume: bool = False  # no surface at all, only what is inside


@dataclass(eq=False)
class _Nodes:
    """What reading one node tree knows: warnings; the values of output sockets already read; names of colour attributes
    that hold bakes, which are no light."""

    warnings: list = field(default_factory=list)
    known: dict = field(default_factory=dict)
    baked: frozenset = frozenset()

    def warn(self, text):
        if text not in self.warnings:
            self.warnings.append(text)


def read_material(material, baked=frozenset()):
    """The Appearance of a Material, or of None for an object without one. baked: names of colour attributes that hold
    bakes: emission by them is not light."""
    nodes, is_volume = _Nodes(baked=baked), False
    if material is None:
        light = _diffuse(np.full((2, 3), NO_MATERIAL))
    elif not _uses_nodes(material):
        light = _diffuse(np.tile(material.diffuse_color[:3], (2, 1)))
    else:
        output = material.node_tree.get_output_node("CYCLES")
        is_volume = bool(output and _source(output.inputs["Volume"]) and not _source(output.inputs["Surface"]))
        light = np.zeros((2, 2, 3)) if is_volume else _surface(output, nodes)
        for name in ("Volume", "Displacement"):
            if output and _source(output.inputs[name]):
                nodes.warn(f"its {name.lower()} is left out")
    low, high = light.min(), light[:, REFLECTED].max()
    if low < 0:
        nodes.warn("colours below 0 are taken as 0")
    if high > MAX_REFLECTANCE:
        nodes.warn(f"its reflectance of {high:.4g} is limited to {MAX_REFLECTANCE}")
    light = np.maximum(light, 0.0)
    reflectance = np.minimum(light[:, REFLECTED], MAX_REFLECTANCE)
    return Appearance(reflectance, light[:, EMITTED], nodes.warnings, is_volume)


def node_emission(data):
    """(what the nodes of a light or world emit (3,), or None where it uses none, warnings), by their plain values"""
    if not _uses_nodes(data):
        return None, []
    nodes = _Nodes()
    output = data.node_tree.get_output_node("CYCLES")
    light = _surface(output, nodes)[FRONT, EMITTED]
    if output and "Volume" in output.inputs and _source(output.inputs["Volume"]):
        nodes.warn("its volume is left out")
    return light, nodes.warnings


def _uses_nodes(data):
    if data.node_tree is None:
        return False
    # materials and worlds always have nodes from 5.0 on, lights later, and asking is deprecated where they do
    always = bpy.app.version >= (5, 0) and not isinstance(data, bpy.types.Light)
    return always or getattr(data.bl_rna.properties["use_nodes"], "is_deprecated", False) or data.use_nodes


def _surface(output, nodes):
    source = _source(output.inputs["Surface"]) if output else None
    if source is None:
        nodes.warn("it has no surface shader and is taken as black")
        return np.zeros((2, 2, 3))
    order = _in_order(source)
    if order is None:
        nodes.warn("its nodes are linked in a circle and it is taken as black: remove one of these links")
        return np.zeros((2, 2, 3))
    for each in order:  # what a socket needs has been read before it: no chain is too deep, none is read twice
        (_shader if each.type == "SHADER" else _known)(each, nodes)
    return _shader(source, nodes)


def _in_order(source):
    """Output sockets that an output socket's node depends on, each after what it needs itself; None in a circle."""
    order, state, stack = [], {}, [(source, False)]
    while stack:
        output, is_done = stack.pop()
        key = _key(output)
        if is_done:
            state[key] = "done"
            order.append(output)
        elif state.get(key) != "done":
            if state.get(key) == "open":
                return None
            state[key] = "open"
            stack.append((output, True))
            is_read = output.node.bl_idname in _SHADERS or output.node.bl_idname in ("ShaderNodeMath", "ShaderNodeMix")
            needed = [_source(socket) for socket in output.node.inputs] if is_read else []
            stack += [(other, False) for other in needed if other is not None and state.get(_key(other)) != "done"]
            if any(other is not None and state.get(_key(other)) == "open" for other in needed):
                return None
    return order


def _key(output):
    return output.node.name, output.identifier


def _source(socket):
    """The output socket that feeds an input socket, past reroutes, muted nodes and our preview, or None."""
    passed_by = set()
    while socket.is_linked and not socket.links[0].is_muted:
        output = socket.links[0].from_socket
        node = output.node
        if node.name in passed_by:
            return None
        passed_by.add(node.name)
        if before_preview(node):
            socket = before_preview(node)
            continue
        if node.mute:
            passed = [link.from_socket for link in node.internal_links if link.to_socket == output]
        elif node.bl_idname == "NodeReroute":
            passed = node.inputs[:1]
        else:
            return output
        if not passed:
            return None
        socket = passed[0]
    return None


# A shader's light is an array (side, REFLECTED or EMITTED, rgb).


def _diffuse(colour):
    light = np.zeros((2, 2, 3))
    light[:, REFLECTED] = colour
    return light


def _emission(colour, strength):
    light = np.zeros((2, 2, 3))
    light[:, EMITTED] = colour * strength
    return light


def _shader(output, nodes):
    """Light (2, 2, 3) of the shader node that an output socket belongs to."""
    key = _key(output)
    if key not in nodes.known:
        nodes.known[key] = _SHADERS.get(output.node.bl_idname, _other_shader)(output.node, nodes)
    return nodes.known[key]


def _other_shader(node, nodes):
    text = f"its {_title(node)} is not supported"
    if node.inputs.get("Color"):
        nodes.warn(f"{text} and is taken as diffuse, of its plain colour")
        return _diffuse(_value(node.inputs["Color"], nodes))
    nodes.warn(f"{text} and is taken as black")
    return np.zeros((2, 2, 3))


def _principled(node, nodes):
    for name, default in UNLIKE_DIFFUSE.items():
        if _source(node.inputs[name]) or node.inputs[name].default_value != default:
            nodes.warn(f"its {name} is left out: it is taken as opaque and diffuse")
    strength = _value(node.inputs["Emission Strength"], nodes)
    light = _diffuse(_value(node.inputs["Base Color"], nodes))
    if strength.any() and not _is_bake(node.inputs["Emission Color"], nodes):
        light[:, EMITTED] = _value(node.inputs["Emission Color"], nodes) * strength
    return light


def _diffuse_bsdf(node, nodes):
    return _diffuse(_value(node.inputs["Color"], nodes))


def _emission_shader(node, nodes):
    if _is_bake(node.inputs["Color"], nodes):
        return np.zeros((2, 2, 3))
    return _emission(_value(node.inputs["Color"], nodes), _value(node.inputs["Strength"], nodes))


def _is_bake(socket, nodes):
    """Whether a socket shows a colour attribute that a bake has written: light that is there already."""
    source = _source(socket)
    name = source and {
        "ShaderNodeVertexColor": "layer_name", "ShaderNodeAttribute": "attribute_name"
    }.get(source.node.bl_idname)  # fmt: skip
    if not name or getattr(source.node, name) not in nodes.baked:
        return False
    nodes.warn(f"it shows the baked attribute {getattr(source.node, name)!r}, which is not taken as light")
    return True


def _input_shader(socket, nodes):
    source = _source(socket)
    return np.zeros((2, 2, 3)) if source is None else _shader(source, nodes)


def _add_shader(node, nodes):
    return _input_shader(node.inputs[0], nodes) + _input_shader(node.inputs[1], nodes)


def _mix_shader(node, nodes):
    factor = np.clip(_value(node.inputs[0], nodes), 0.0, 1.0)[:, None]
    first, second = (_input_shader(socket, nodes) for socket in node.inputs[1:3])
    return (1 - factor) * first + factor * second


_SHADERS = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfDiffuse": _diffuse_bsdf,
    "ShaderNodeEmission": _emission_shader,
    "ShaderNodeBackground": _emission_shader,
    "ShaderNodeAddShader": _add_shader,
    "ShaderNodeMixShader": _mix_shader,
}


# A socket's value is an array (side, 3), a number three times.


def _value(socket, nodes):
    """What a colour or number socket is on either side; the socket's plain value, with a warning, where unknown."""
    source = _source(socket)
    value = None if source is None else _known(source, nodes)
    if value is not None:
        return value
    if source is not None:
        nodes.warn(
            f"the {socket.name} of its {_title(socket.node)} is linked to {_title(source.node)}: "
            "the socket's plain value is used"
        )
    return _plain(socket)


def _plain(socket):
    return np.tile(np.broadcast_to(np.array(socket.default_value, float).ravel()[:3], 3), (2, 1))


def _known(output, nodes):
    """(2, 3), or None where the node is none of those whose value is one constant for either side."""
    key = _key(output)
    if key not in nodes.known:
        nodes.known[key] = _constant(output, nodes)
    return nodes.known[key]


def _constant(output, nodes):
    node = output.node
    if node.bl_idname == "ShaderNodeLightPath" and output.identifier in _OF_DIFFUSE_RAYS:
        return np.full((2, 3), _OF_DIFFUSE_RAYS[output.identifier])
    if node.bl_idname in ("ShaderNodeValue", "ShaderNodeRGB"):
        return _plain(output)
    if node.bl_idname == "ShaderNodeNewGeometry" and output.identifier == "Backfacing":
        return np.array([[0.0] * 3, [1.0] * 3])
    if node.bl_idname == "ShaderNodeMath" and node.operation in _MATH:
        a, b = (_value(socket, nodes) for socket in node.inputs[:2])
        result = _MATH[node.operation](a, b)
        return np.clip(result, 0.0, 1.0) if node.use_clamp else result
    if node.bl_idname == "ShaderNodeMix" and node.data_type in ("FLOAT", "RGBA") and node.blend_type == "MIX":
        factor, a, b = (_value(socket, nodes) for socket in node.inputs if socket.enabled)
        factor = np.clip(factor, 0.0, 1.0) if node.clamp_factor else factor
        result = (1 - factor) * a + factor * b
        return np.clip(result, 0.0, 1.0) if node.data_type == "RGBA" and node.clamp_result else result
    return None


# light that falls on diffuse surfaces is asked for by diffuse rays
_OF_DIFFUSE_RAYS = {
    "Is Camera Ray": 0.0, "Is Shadow Ray": 0.0, "Is Diffuse Ray": 1.0, "Is Glossy Ray": 0.0, "Is Singular Ray": 0.0,
    "Is Transmission Ray": 0.0,
}  # fmt: skip


_MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "GREATER_THAN": lambda a, b: (a > b).astype(float),
    "LESS_THAN": lambda a, b: (a < b).astype(float),
}


def _title(node):
    return f"{node.bl_label} node" if node.bl_label else node.bl_idname
