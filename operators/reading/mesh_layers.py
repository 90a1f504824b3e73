"""What textures read of a mesh: UV maps, attributes, texture space; copies that need no Blender any more."""

from dataclasses import dataclass, field, replace

import numpy as np

from .mesh_arrays import Arrays, arrays_of

DEFORMING = set(  # modifiers that move vertices, which Generated coordinates do not follow
    "ARMATURE CAST CLOTH CORRECTIVE_SMOOTH CURVE DISPLACE HOOK LAPLACIANDEFORM LAPLACIANSMOOTH LATTICE MESH_DEFORM "
    "OCEAN SHRINKWRAP SIMPLE_DEFORM SMOOTH SOFT_BODY SURFACE_DEFORM WARP WAVE".split()
)
FOLLOWS = "its Generated coordinates are those of the mesh as its modifiers leave it, and Cycles' are not; apply them"


@dataclass(eq=False)
class MeshLayers:
    """arrays: the mesh's Arrays; layers {(kind, name): (c, k)} by corners; space: (centre (3,), half size (3,)) of
    generated coordinates; colour (4,) of the object; missing: [(kind, name)] that the mesh has not; told: [sentence];
    default_colour: the name of the attribute that is named ''."""

    arrays: Arrays
    space: tuple
    colour: np.ndarray
    layers: dict = field(default_factory=dict)
    missing: list = field(default_factory=list)
    told: list = field(default_factory=list)
    default_colour: str = ""


def gather_layers(obj, arrays, needs, copies):
    """The MeshLayers of an evaluated object with what `needs`, {(kind, name)}, asks for; None for nothing. arrays: of
    its mesh; copies: a dict kept over all calls while no mesh changes, so that instances share theirs."""
    if not needs:
        return None
    mesh = obj.data
    key = (mesh.as_pointer(), needs)
    if key not in copies:
        copies[key] = found = _gathered(mesh, arrays, needs)
        if ("generated", "") in needs and obj.original.type == "MESH":
            _add_undeformed(found, obj.original, arrays)
    return replace(copies[key], colour=np.array(obj.color, float))


def _gathered(mesh, arrays, needs):
    space = (np.array(mesh.texspace_location, float), np.array(mesh.texspace_size, float))
    found = MeshLayers(arrays, space, np.ones(4))
    colours = mesh.color_attributes
    if len(colours) and 0 <= colours.render_color_index < len(colours):
        found.default_colour = colours[colours.render_color_index].name
    for kind, name in needs:
        if kind in ("uv", "attribute"):
            values = _uv(mesh, name) if kind == "uv" else _attribute(mesh, name or found.default_colour, arrays)
            if values is None:
                found.missing.append((kind, name))
            else:
                found.layers[kind, name] = values
    return found


def _add_undeformed(found, original, arrays):
    """Generated coordinates are of the mesh before anything moves its vertices: of corners, where that shows."""
    if not (original.modifiers or original.data.shape_keys):
        return
    base, (centre, half) = arrays_of(original.data), found.space
    if np.array_equal(base.corners, arrays.corners) and np.array_equal(base.counts, arrays.counts):
        at = base.vertices[base.corners]
        found.layers["generated", ""] = (at - centre) / np.where(half != 0, 2 * half, 1.0) + 0.5
    elif original.data.shape_keys or any(m.show_viewport and m.type in DEFORMING for m in original.modifiers):
        found.told.append(FOLLOWS)


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


def _attribute(mesh, name, arrays):
    """(c, 5): a colour attribute with its alpha, another as its number three times or its vector, alpha 1; and the
    number it is where one is asked for; or None."""
    attribute = mesh.attributes.get(name) if name else None
    if attribute is None or attribute.data_type not in _FIELDS or attribute.domain not in ("POINT", "CORNER", "FACE"):
        return None
    what, width = _FIELDS[attribute.data_type]
    kind = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(attribute.data_type, np.float32)
    values = _array(attribute.data, what, kind, width).reshape(-1, width).astype(np.float32)
    if attribute.domain == "POINT":
        values = values[arrays.corners]
    elif attribute.domain == "FACE":
        values = np.repeat(values, arrays.counts, axis=0)
    whole = np.zeros((len(values), 5), np.float32)
    whole[:, 3] = 1.0
    whole[:, :width] = values
    if width == 1:
        whole[:, :3] = values
    whole[:, 4] = whole[:, 0] if width == 2 else whole[:, :3].mean(axis=1)
    return whole
