"""Materials and worlds as diffuse reflectance and emission, by the plain values of their nodes.

Cycles calls the side that a mesh's normals face the front, under mirroring object matrices too.
"""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..pdm_core.scene import MAX_REFLECTANCE

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


def read_material(material):
    """The Appearance of a Material, or of None for an object without one."""
    warnings = []
    if material is None:
        light = _diffuse(np.full((2, 3), NO_MATERIAL))
    elif not _uses_nodes(material):
        light = _diffuse(np.tile(material.diffuse_color[:3], (2, 1)))
    else:
        output = material.node_tree.get_output_node("CYCLES")
        light = _surface(output, warnings)
        for name in ("Volume", "Displacement"):
            if output and _source(output.inputs[name]):
                warnings.append(f"its {name.lower()} is left out")
        if material.use_backface_culling:
            light[BACK] = 0.0
    low, high = light.min(), light[:, REFLECTED].max()
    if low < 0:
        warnings.append("colours below 0 are taken as 0")
    if high > MAX_REFLECTANCE:
        warnings.append(f"its reflectance of {high:.4g} is limited to {MAX_REFLECTANCE}")
    light = np.maximum(light, 0.0)
    return Appearance(np.minimum(light[:, REFLECTED], MAX_REFLECTANCE), light[:, EMITTED], warnings)


def read_world(world):
    """(background radiance (3,), warnings) of a World, or black for None."""
    if world is None:
        return np.zeros(3), []
    if not _uses_nodes(world):
        return np.array(world.color, float), []
    warnings = []
    output = world.node_tree.get_output_node("CYCLES")
    light = _surface(output, warnings)[FRONT, EMITTED]
    if output and _source(output.inputs["Volume"]):
        warnings.append("its volume is left out")
    return np.maximum(light, 0.0), warnings


def _uses_nodes(data):
    # materials and worlds always have nodes from 5.0 on, and asking is deprecated there
    return data.node_tree is not None and (bpy.app.version >= (5, 0) or data.use_nodes)


def _surface(output, warnings):
    source = _source(output.inputs["Surface"]) if output else None
    if source is None:
        warnings.append("it has no surface shader and is taken as black")
        return np.zeros((2, 2, 3))
    return _shader(source, warnings)


def _source(socket):
    """The output socket that feeds an input socket, past reroutes and muted nodes, or None."""
    while socket.is_linked and not socket.links[0].is_muted:
        output = socket.links[0].from_socket
        node = output.node
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


def _shader(output, warnings):
    """Light (2, 2, 3) of the shader node that an output socket belongs to."""
    node = output.node
    read = _SHADERS.get(node.bl_idname)
    if read is not None:
        return read(node, warnings)
    text = f"its {_title(node)} is not supported"
    if node.inputs.get("Color"):
        warnings.append(f"{text} and is taken as diffuse, of its plain colour")
        return _diffuse(_value(node.inputs["Color"], warnings))
    warnings.append(f"{text} and is taken as black")
    return np.zeros((2, 2, 3))


def _principled(node, warnings):
    for name, default in UNLIKE_DIFFUSE.items():
        if _source(node.inputs[name]) or node.inputs[name].default_value != default:
            warnings.append(f"its {name} is left out: it is taken as opaque and diffuse")
    strength = _value(node.inputs["Emission Strength"], warnings)
    light = _diffuse(_value(node.inputs["Base Color"], warnings))
    if strength.any():
        light[:, EMITTED] = _value(node.inputs["Emission Color"], warnings) * strength
    return light


def _diffuse_bsdf(node, warnings):
    return _diffuse(_value(node.inputs["Color"], warnings))


def _emission_shader(node, warnings):
    return _emission(_value(node.inputs["Color"], warnings), _value(node.inputs["Strength"], warnings))


def _input_shader(socket, warnings):
    source = _source(socket)
    return np.zeros((2, 2, 3)) if source is None else _shader(source, warnings)


def _add_shader(node, warnings):
    return _input_shader(node.inputs[0], warnings) + _input_shader(node.inputs[1], warnings)


def _mix_shader(node, warnings):
    factor = np.clip(_value(node.inputs[0], warnings), 0.0, 1.0)[:, None]
    first, second = (_input_shader(socket, warnings) for socket in node.inputs[1:3])
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


def _value(socket, warnings):
    """What a colour or number socket is on either side; the socket's plain value, with a warning, where unknown."""
    source = _source(socket)
    value = None if source is None else _known(source, warnings)
    if value is not None:
        return value
    if source is not None:
        warnings.append(
            f"the {socket.name} of its {_title(socket.node)} is linked to {_title(source.node)}: "
            "the socket's plain value is used"
        )
    return _plain(socket)


def _plain(socket):
    return np.tile(np.broadcast_to(np.array(socket.default_value, float).ravel()[:3], 3), (2, 1))


def _known(output, warnings):
    """(2, 3), or None where the node is none of those whose value is one constant for either side."""
    node = output.node
    if node.bl_idname in ("ShaderNodeValue", "ShaderNodeRGB"):
        return _plain(output)
    if node.bl_idname == "ShaderNodeNewGeometry" and output.identifier == "Backfacing":
        return np.array([[0.0] * 3, [1.0] * 3])
    if node.bl_idname == "ShaderNodeMath" and node.operation in _MATH:
        a, b = (_value(socket, warnings) for socket in node.inputs[:2])
        result = _MATH[node.operation](a, b)
        return np.clip(result, 0.0, 1.0) if node.use_clamp else result
    if node.bl_idname == "ShaderNodeMix" and node.data_type in ("FLOAT", "RGBA") and node.blend_type == "MIX":
        factor, a, b = (_value(socket, warnings) for socket in node.inputs if socket.enabled)
        factor = np.clip(factor, 0.0, 1.0) if node.clamp_factor else factor
        result = (1 - factor) * a + factor * b
        return np.clip(result, 0.0, 1.0) if node.data_type == "RGBA" and node.clamp_result else result
    return None


_MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "GREATER_THAN": lambda a, b: (a > b).astype(float),
    "LESS_THAN": lambda a, b: (a < b).astype(float),
}


def _title(node):
    return f"{node.bl_label} node" if node.bl_label else node.bl_idname
