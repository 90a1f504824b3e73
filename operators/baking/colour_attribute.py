"""Writes colour attributes: every mesh gets its colours, or none does and all are as before."""

from dataclasses import dataclass

import bpy
import numpy as np

from .still_there import still_there

MAX_NAME_BYTES = 63  # Blender's names are 63 bytes of UTF-8; 4.2 returns no attribute for longer ones
BUILT_IN = frozenset(
    "position normal radius id velocity rest_position material_index sharp_face sharp_edge crease_vert crease_edge "
    "bevel_weight_vert bevel_weight_edge custom_normal freestyle_edge freestyle_face".split()
)  # Blender gives these a meaning of its own; 5.2 lets a colour take such a name


class BakeError(RuntimeError):
    """The bake cannot be done; the message names the object or option and says what to do."""


@dataclass
class Colours:
    """What one mesh object receives. colours (n, 4) linear float32, n points or corners."""

    object_name: str
    domain: str  # 'POINT' or 'CORNER'
    colours: np.ndarray


def colours_of(targets, points, values):
    """[Colours] of ReadObjects, of values [(k, 3)] at the BakePoints of each."""
    return [Colours(t.name, p.domain, p.colours(v)) for t, p, v in zip(targets, points, values, strict=True)]


def values_in(layer):
    """(n, 4) float32 of a colour attribute."""
    values = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", values)
    return values.reshape(-1, 4)


@dataclass
class _Saved:
    """A mesh's attribute of the baked name as it was, with the choice of active and render colour."""

    existed: bool
    domain: str
    data_type: str
    values: np.ndarray
    active: str
    render: str


def check_name(name):
    """Raises BakeError where `name` cannot be a colour attribute's name in every supported Blender."""
    if not name.strip():
        raise BakeError("The attribute name is empty; enter a name such as Radiosity")
    if len(name.encode()) > MAX_NAME_BYTES:
        raise BakeError(
            f"The attribute name {name!r} has {len(name.encode())} bytes and Blender keeps {MAX_NAME_BYTES}; shorten it"
        )
    if name.startswith(".") or name in BUILT_IN:
        raise BakeError(f"The attribute name {name!r} is reserved by Blender; choose another")


def check_target(obj, name):
    """Raises BakeError where the mesh of `obj` cannot receive a colour attribute `name`."""
    mesh = obj.data
    if obj.mode in {"EDIT", "SCULPT"}:
        raise BakeError(f"Object {obj.name!r} is in {obj.mode.title()} Mode; switch to Object Mode first")
    if not mesh.is_editable:
        raise BakeError(f"Object {obj.name!r}: its mesh {mesh.name!r} is linked from a library; make it local first")
    taken = mesh.attributes.get(name)
    if (taken is not None and not _is_colour(taken)) or name in mesh.uv_layers:
        raise BakeError(f"Object {obj.name!r} has an attribute {name!r} that is no colour; choose another name")
    if name in obj.vertex_groups:
        raise BakeError(f"Object {obj.name!r} has a vertex group {name!r}; choose another attribute name")


def write_colours(items, name, data_type):
    """Writes `items`, a list of Colours, as attribute `name`, active in viewport and render.

    All or none: where one fails the meshes already written are put back, and BakeError is raised. Returns a function
    that puts all back that are there still, for who fails later.
    """
    done = []

    def undo():
        for mesh, mesh_name, saved in reversed(done):
            if mesh := still_there(mesh, mesh_name, bpy.data.meshes):
                _restore(mesh, name, saved)

    _check_finite(items)
    try:
        for item in items:
            obj = _find(item, name)
            done.append((obj.data, obj.data.name, _save(obj.data, name)))
            _write(obj.data, name, data_type, item.domain, item.colours)
    except Exception as error:
        undo()
        if isinstance(error, BakeError):
            raise
        raise BakeError(
            f"Object {item.object_name!r}: writing its colours failed ({error}); nothing was changed"
        ) from error
    return undo


def _check_finite(items):
    for item in items:
        if not np.isfinite(item.colours).all():
            raise BakeError(
                f"Object {item.object_name!r}: its colours came out not finite after evaluation; nothing was changed. "
                "Lower the exposure; if that does not help, report this with the file"
            )


def _is_colour(attribute):
    return attribute.data_type in {"FLOAT_COLOR", "BYTE_COLOR"} and attribute.domain in {"POINT", "CORNER"}


def object_of(name):
    """The object by name: the reference held before the solve may have died, as after an undo."""
    obj = bpy.data.objects.get((name, None))
    if obj is None:
        raise BakeError(f"Object {name!r} was removed or renamed during the bake; bake again")
    return obj


def _find(item, name):
    """The object that receives Colours as attribute `name`."""
    obj = object_of(item.object_name)
    check_target(obj, name)
    mesh = obj.data
    if len(item.colours) != len(mesh.vertices if item.domain == "POINT" else mesh.loops):
        raise BakeError(f"Object {item.object_name!r} was edited during the bake; bake again")
    return obj


def _save(mesh, name):
    colours = mesh.color_attributes
    old = colours.get(name)
    choice = (colours.active_color_name, colours.default_color_name)
    if old is None:
        return _Saved(False, "", "", np.empty((0, 4)), *choice)
    return _Saved(True, old.domain, old.data_type, values_in(old), *choice)


def _write(mesh, name, data_type, domain, values):
    colours = mesh.color_attributes
    old = colours.get(name)
    if old is not None and (old.domain, old.data_type) != (domain, data_type):
        colours.remove(old)
        old = None
    attribute = old or colours.new(name=name, type=data_type, domain=domain)
    if attribute is None or attribute.name != name:
        if attribute is not None:
            colours.remove(attribute)
        raise BakeError(f"Mesh {mesh.name!r} cannot hold a colour attribute {name!r}; choose another name")
    attribute.data.foreach_set("color", np.ascontiguousarray(values, np.float32).ravel())
    _choose(mesh, name, name)


def _choose(mesh, active, render):
    """By name: the index is over all attributes in some versions and over colours in others."""
    mesh.color_attributes.active_color_name = active
    mesh.color_attributes.default_color_name = render
    mesh.update()


def _restore(mesh, name, saved):
    written = mesh.color_attributes.get(name)
    if saved.existed:
        if len(saved.values) == len(mesh.vertices if saved.domain == "POINT" else mesh.loops):  # not edited since
            _write(mesh, name, saved.data_type, saved.domain, saved.values)
    elif written is not None:
        mesh.color_attributes.remove(written)
    _choose(mesh, saved.active, saved.render)
