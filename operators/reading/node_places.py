"""Nodes that say where a point is, or what the mesh or the ray holds there: coordinates, attributes, geometry."""

import numpy as np

from .mesh_arrays import in_world
from .node_values import at_places, constant, derive, part
from .node_walk import Recipe, Unknown

# light that falls on diffuse surfaces is asked for by diffuse rays
OF_DIFFUSE_RAYS = {
    "Is Camera Ray": 0.0, "Is Shadow Ray": 0.0, "Is Diffuse Ray": 1.0, "Is Glossy Ray": 0.0, "Is Singular Ray": 0.0,
    "Is Reflection Ray": 1.0, "Is Transmission Ray": 0.0, "Is Volume Scatter Ray": 0.0,
}  # fmt: skip
_STEPS = 256  # of the cosine, for means over directions


def read_off(kind, name=""):
    """The Value of what places hold: see varying.Places."""
    return at_places(lambda places: places.read(kind, name), (kind, name))


def uv(name=""):
    """The Value of a UV map as a vector, "" for the one that is rendered."""
    return read_off("uv", name)


def of_object(other):
    """The Value of places in the coordinates of another object, or for None in the object's own."""
    if other is None:
        return read_off("local")
    inverse = np.linalg.pinv(np.array(other.matrix_world, float))
    return derive(lambda points: in_world(inverse, points), read_off("world"))


def _given(value):
    return Recipe([], lambda: value)


def _coordinates(output, walk):
    name = output.socket.identifier
    if name == "UV":
        return _given(uv())
    if name == "Generated":
        return _given(read_off("generated"))
    if name == "Object":
        return _given(of_object(output.node.object))
    return Unknown(f", whose {name} coordinates are not read")


def _uv_map(output, walk):
    return _given(uv(output.node.uv_map))


def _attribute(name, output, walk):
    if name in walk.baked:
        return _given(at_places(None, ("bake", name)))
    values = read_off("attribute", name)
    kind = output.socket.identifier
    if kind in ("Alpha", "Fac"):
        return _given(part(values, 3 if kind == "Alpha" else 4))
    return _given(derive(lambda rgba: rgba[:, :3], values))


def _mesh_attribute(output, walk):
    node = output.node
    if node.attribute_type == "GEOMETRY" and not node.attribute_name:
        none = {"Alpha": 1.0, "Fac": 0.0}.get(output.socket.identifier, np.zeros(3))
        return _given(constant(none))
    if node.attribute_type == "GEOMETRY":
        return _attribute(node.attribute_name, output, walk)
    if node.attribute_type in ("OBJECT", "INSTANCER") and node.attribute_name == "color":
        return _colour_of_the_object(output)
    return Unknown(f" of {node.attribute_type.lower()} attribute {node.attribute_name!r}, which is not read")


def _colour_attribute(output, walk):
    return _attribute(output.node.layer_name, output, walk)


def _colour_of_the_object(output):
    values = read_off("object", "color")
    return _given(part(values, 3) if output.socket.identifier == "Alpha" else derive(lambda rgba: rgba[:, :3], values))


def _object_info(output, walk):
    name = output.socket.identifier
    if name in ("Color", "Alpha"):
        return _colour_of_the_object(output)
    return Unknown(f", whose {name} is not read")


def _geometry(output, walk):
    name = output.socket.identifier
    if name == "Backfacing":
        walk.has_sides = True
        return _given(constant(walk.side))
    if name == "Position":
        return _given(read_off("world"))
    return Unknown(f", whose {name} is not read")


def _light_path(output, walk):
    name = output.socket.identifier
    return _given(constant(OF_DIFFUSE_RAYS[name])) if name in OF_DIFFUSE_RAYS else Unknown()


def fresnel(cosine, ior):
    """The share that a dielectric reflects, unpolarised; cosine and ior broadcast."""
    g = np.sqrt(np.maximum(ior**2 - 1 + cosine**2, 0.0))
    a, b = (g - cosine) / (g + cosine), (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return np.where(ior**2 - 1 + cosine**2 > 0, 0.5 * a**2 * (1 + b**2), 1.0)


def over_directions(share, parameter):
    """The Value of the mean of share(cosine, parameter) over the directions that diffuse light comes from."""
    cosine = np.sqrt((np.arange(_STEPS) + 0.5) / _STEPS)  # equal parts of the projected half sphere
    note = "it depends on the direction it is seen from (Fresnel, Facing): the mean over all directions is taken"
    return derive(lambda x: share(cosine, x).mean(axis=1, keepdims=True), parameter).noted(note)


def _fresnel(output, walk):
    def made(ior):
        return over_directions(lambda cosine, n: fresnel(cosine, np.maximum(n, 1e-5)), ior)

    return Recipe([output.input("IOR")], made)


def _layer_weight(output, walk):
    if output.socket.identifier == "Fresnel":

        def share(cosine, blend):
            return fresnel(cosine, 1 / np.maximum(1 - blend, 1e-5))

    else:

        def share(cosine, blend):
            blend = np.clip(blend, 0.0, 1 - 1e-5)
            return 1 - cosine ** np.where(blend < 0.5, 2 * blend, 0.5 / (1 - blend))

    return Recipe([output.input("Blend")], lambda blend: over_directions(share, blend))


READERS = {
    "ShaderNodeTexCoord": _coordinates,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeAttribute": _mesh_attribute,
    "ShaderNodeVertexColor": _colour_attribute,
    "ShaderNodeObjectInfo": _object_info,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
}
