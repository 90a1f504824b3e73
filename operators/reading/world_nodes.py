"""A world's nodes as a sum of one radiance and of weighted images; worlds that are no such sum are told apart."""

from dataclasses import dataclass

import bpy
import numpy as np

from .node_places import OF_DIFFUSE_RAYS


class NotPlain(Exception):
    """The nodes are more than constants and images; the message names the first of them that is."""


@dataclass(frozen=True, eq=False)
class Image:
    """An Environment Texture times weight (3,). mapping: (type, location, rotation, scale (3,)), or None."""

    image: bpy.types.Image
    projection: str
    mapping: tuple | None
    weight: np.ndarray

    @property
    def is_plain(self):
        return self.projection == "EQUIRECTANGULAR" and self.mapping is None


def terms_of(tree, warnings):
    """(radiance (3,), [Image]) whose sum the world is; NotPlain where it is not such a sum."""
    output = tree.get_output_node("CYCLES")
    if output is None or _source(output.inputs["Surface"]) is None:
        warnings.append("it has no surface shader: it is taken as black; link a Background to its output")
        return np.zeros(3), []
    if _source(output.inputs["Volume"]) is not None:
        warnings.append("it has a volume: that is left out")
    if any(node.bl_idname == "ShaderNodeLightPath" for node in tree.nodes):
        warnings.append("it has a Light Path node: it is read as for rays from diffuse surfaces")
    constant, images = np.zeros(3), []
    stack = [(_source(output.inputs["Surface"]), np.ones(3), frozenset())]
    while stack:
        source, weight, above = stack.pop()
        if source is None or not weight.any():
            continue
        node = source.node
        if node.name in above:
            raise NotPlain("its circle of nodes")
        above = above | {node.name}
        if node.bl_idname in ("ShaderNodeBackground", "ShaderNodeEmission"):
            weight = weight * _value(node.inputs["Strength"], above)
            images_or_constant = _colour(node.inputs["Color"], weight, above)
            if isinstance(images_or_constant, Image):
                images.append(images_or_constant)
            else:
                constant = constant + images_or_constant
        elif node.bl_idname == "ShaderNodeAddShader":
            stack += [(_source(socket), weight, above) for socket in node.inputs]
        elif node.bl_idname == "ShaderNodeMixShader":
            factor = np.clip(_value(node.inputs[0], above), 0.0, 1.0)
            stack.append((_source(node.inputs[1]), weight * (1 - factor), above))
            stack.append((_source(node.inputs[2]), weight * factor, above))
        else:
            raise NotPlain(_title(node))
    return constant, images


def _colour(socket, weight, above):
    """The radiance (3,) of a colour socket times weight (3,), or its Image."""
    source = _source(socket)
    if source is None or source.node.bl_idname != "ShaderNodeTexEnvironment":
        return weight * _value(socket, above)
    node = source.node
    if node.image is None:
        return weight * [1.0, 0.0, 1.0]  # as Cycles shows what is missing
    plain = node.texture_mapping
    if any(plain.rotation) or any(plain.translation) or tuple(plain.scale) != (1.0, 1.0, 1.0):
        raise NotPlain(_title(node))
    return Image(node.image, node.projection, _mapping(node.inputs["Vector"]), weight)


def _mapping(socket):
    """(type, location, rotation, scale) of the Mapping node that a vector socket is linked to, None for directions."""
    source = _source(socket)
    if source is None or _is_direction(source):
        return None
    node = source.node
    inner = _source(node.inputs["Vector"]) if node.bl_idname == "ShaderNodeMapping" else None
    if inner is None or not _is_direction(inner):
        raise NotPlain(_title(node))
    names = [name for name in ("Location", "Rotation", "Scale") if name in node.inputs and node.inputs[name].enabled]
    if any(_source(node.inputs[name]) is not None for name in names):
        raise NotPlain(_title(node))
    values = {name: np.array(node.inputs[name].default_value, float) for name in names}
    zero, one = np.zeros(3), np.ones(3)
    return node.vector_type, values.get("Location", zero), values.get("Rotation", zero), values.get("Scale", one)


def _is_direction(source):
    return source.node.bl_idname == "ShaderNodeTexCoord" and source.identifier == "Generated"


def _value(socket, above):
    """(3,) of a colour or number socket that is one constant to diffuse rays; NotPlain where it is not."""
    source = _source(socket)
    if source is None:
        return _plain(socket)
    node = source.node
    if node.name in above:
        raise NotPlain("its circle of nodes")
    above = above | {node.name}
    if node.bl_idname in ("ShaderNodeValue", "ShaderNodeRGB"):
        return _plain(source)
    if node.bl_idname == "ShaderNodeLightPath" and source.identifier in OF_DIFFUSE_RAYS:
        return np.full(3, OF_DIFFUSE_RAYS[source.identifier])
    if node.bl_idname == "ShaderNodeMath" and node.operation in _MATH:
        result = _MATH[node.operation](*(_value(each, above) for each in node.inputs[:2]))
        return np.clip(result, 0.0, 1.0) if node.use_clamp else result
    if node.bl_idname == "ShaderNodeMix" and node.data_type in ("FLOAT", "RGBA") and node.blend_type == "MIX":
        factor, a, b = (_value(each, above) for each in node.inputs if each.enabled)
        factor = np.clip(factor, 0.0, 1.0) if node.clamp_factor else factor
        result = (1 - factor) * a + factor * b
        return np.clip(result, 0.0, 1.0) if node.data_type == "RGBA" and node.clamp_result else result
    raise NotPlain(_title(node))


def _plain(socket):
    return np.broadcast_to(np.array(socket.default_value, float).ravel()[:3], 3)


def _source(socket):
    """The output socket that feeds an input socket, past reroutes and muted nodes, or None."""
    passed = set()
    while socket.is_linked and not socket.links[0].is_muted:
        output = socket.links[0].from_socket
        node = output.node
        if node.name in passed:
            return None
        passed.add(node.name)
        if node.mute:
            inner = [link.from_socket for link in node.internal_links if link.to_socket == output]
        elif node.bl_idname == "NodeReroute":
            inner = node.inputs[:1]
        else:
            return output
        if not inner:
            return None
        socket = inner[0]
    return None


def _title(node):
    return f"its {node.bl_label} node" if node.bl_label else f"its {node.bl_idname}"


_MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "MAXIMUM": np.maximum,
    "MINIMUM": np.minimum,
    "GREATER_THAN": lambda a, b: (a > b).astype(float),
    "LESS_THAN": lambda a, b: (a < b).astype(float),
}
