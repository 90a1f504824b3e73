"""What textures read of a mesh: triangles, UV maps, attributes, texture space; copies that need no Blender any more."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(eq=False)
class MeshLayers:
    """vertices (n, 3) m, local; triangles (t, 3) corners, corner_vertex (c,), polygon (t,) of each triangle; layers
    {(kind, name): (c, k)} by corners; space: (centre (3,), half size (3,)) of generated coordinates; colour (4,) of
    the object; missing: [(kind, name)] that the mesh has not; default_colour: the name of the attribute named ''."""

    vertices: np.ndarray
    triangles: np.ndarray
    corner_vertex: np.ndarray
    polygon: np.ndarray
    space: tuple
    colour: np.ndarray
    layers: dict = field(default_factory=dict)
    missing: list = field(default_factory=list)
    default_colour: str = ""
    default_is_bake: bool = False


def gather_layers(obj, depsgraph, needs, baked=frozenset()):
    """The MeshLayers of a mesh object as evaluated, with what `needs`, {(kind, name)}, asks for; None for nothing.
    baked: names of colour attributes that hold bakes."""
    if not needs:
        return None
    mesh = obj.evaluated_get(depsgraph).data
    mesh.calc_loop_triangles()
    triangles = _array(mesh.loop_triangles, "loops", np.int32, 3)
    space = (np.array(mesh.texspace_location, float), np.array(mesh.texspace_size, float))
    found = MeshLayers(
        vertices=_array(mesh.vertices, "co", np.float32, 3).astype(float),
        triangles=triangles,
        corner_vertex=_array(mesh.loops, "vertex_index", np.int32),
        polygon=_array(mesh.loop_triangles, "polygon_index", np.int32),
        space=space,
        colour=np.array(obj.color, float),
    )
    colours = mesh.color_attributes
    if len(colours) and 0 <= colours.render_color_index < len(colours):
        found.default_colour = colours[colours.render_color_index].name
        found.default_is_bake = found.default_colour in baked
    for kind, name in needs:
        if kind in ("uv", "attribute"):
            values = _uv(mesh, name) if kind == "uv" else _attribute(mesh, name or found.default_colour, found)
            if values is None:
                found.missing.append((kind, name))
            else:
                found.layers[kind, name] = values
    return found


def _array(collection, name, kind, width=1):
    values = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


def _uv(mesh, name):
    """(c, 2) or None"""
    maps = mesh.uv_layers
    layer = maps.get(name) if name else next((each for each in maps if each.active_render), None)
    return None if layer is None else _array(layer.uv, "vector", np.float32, 2)


_FIELDS = {  # of attributes' data, by their type: (name, numbers)
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}


def _attribute(mesh, name, found):
    """(c, 4): a colour attribute with its alpha, another as its number three times or its vector, alpha 1; or None."""
    attribute = mesh.attributes.get(name) if name else None
    if attribute is None or attribute.data_type not in _FIELDS or attribute.domain not in ("POINT", "CORNER", "FACE"):
        return None
    what, width = _FIELDS[attribute.data_type]
    kind = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(attribute.data_type, np.float32)
    values = _array(attribute.data, what, kind, width).reshape(-1, width).astype(np.float32)
    if attribute.domain == "POINT":
        values = values[found.corner_vertex]
    elif attribute.domain == "FACE":
        values = np.repeat(values, _array(mesh.polygons, "loop_total", np.int32), axis=0)
    whole = np.zeros((len(values), 4), np.float32)
    whole[:, 3] = 1.0
    whole[:, :width] = values
    if width == 1:
        whole[:, :3] = values
    return whole
