"""A picture of the baked scene, each vertex showing exactly its colour: for `--image` and the demo."""

import math
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..baking.colour_attribute import BakeError
from ..reading.preview_nodes import new_material
from ..reading.render_visible import evaluated, mesh_shown, render_visible

SAMPLES = 8  # they only smooth the outlines: the light is in the colours
GEOMETRY = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
VIEW_FROM = Vector((0.5, -0.75, 0.45)).normalized()  # the fitted camera's direction from the scene


def render_image(context, attribute, path):
    """Renders `context.scene` to the PNG `path`: Cycles on the CPU, the colours of `attribute` as emission.

    From the scene's camera, else from one that sees every object. A side that was not baked (the back of a mesh) is
    see-through; an object without the attribute is black. Works on a throw-away copy: scene and file stay as they are.
    """
    with _temporary_data():
        copy = bpy.data.scenes.new("PDM picture")
        copy.world = context.scene.world
        shown = _copy_objects(context, copy, _baked_material(attribute))
        copy.camera = _scene_camera(context, copy) or _fitted_camera(copy, shown)
        _set_up(copy, context.scene.render, path)
        bpy.ops.render.render(write_still=True, scene=copy.name)


@contextmanager
def _temporary_data():
    """Removes whatever is created within."""
    kinds = ("scenes", "objects", "meshes", "cameras", "materials")
    before = {kind: set(getattr(bpy.data, kind)) for kind in kinds}
    try:
        yield
    finally:
        # not scenes.remove(): without a window, as under --command, it crashes
        bpy.data.batch_remove([block for kind in kinds for block in set(getattr(bpy.data, kind)) - before[kind]])


def _copy_objects(context, copy, material):
    """The visible geometry as evaluated, linked into `copy`; returns the new objects."""
    visible = [obj for obj in render_visible(context.view_layer) if obj.type in GEOMETRY]
    shown = []
    with evaluated(context, visible) as graph:
        for obj in visible:
            mesh = mesh_shown(obj, graph)
            mesh.materials.clear()
            mesh.materials.append(material)
            mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
            shown.append(_placed(copy, obj.name, mesh, obj.evaluated_get(graph).matrix_world))
    return shown


def _placed(scene, name, data, matrix):
    """A new object at `matrix`, which may shear: only a parent's inverse holds any matrix."""
    obj = bpy.data.objects.new(name, data)
    obj.parent = bpy.data.objects.new(name, None)
    obj.matrix_parent_inverse = matrix
    scene.collection.objects.link(obj.parent)
    scene.collection.objects.link(obj)
    return obj


def _baked_material(attribute):
    material = new_material("PDM picture")
    tree = material.node_tree
    tree.nodes.clear()
    colour = tree.nodes.new("ShaderNodeAttribute")  # black where the mesh has no such attribute
    colour.attribute_name = attribute
    emission = tree.nodes.new("ShaderNodeEmission")
    behind = tree.nodes.new("ShaderNodeNewGeometry")
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    mix = tree.nodes.new("ShaderNodeMixShader")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(colour.outputs["Color"], emission.inputs["Color"])
    tree.links.new(behind.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def _scene_camera(context, copy):
    camera = context.scene.camera
    if camera is None:
        return None
    matrix = camera.evaluated_get(context.evaluated_depsgraph_get()).matrix_world
    return _placed(copy, camera.name, camera.data, matrix)


def _fitted_camera(copy, shown):
    """A perspective camera from above that has the sphere around `shown` in view."""
    corners = [obj.matrix_parent_inverse @ Vector(c) for obj in shown for c in obj.bound_box]
    if not corners:
        raise BakeError("There is nothing to render; show at least one object")
    low, high = Vector(map(min, zip(*corners))), Vector(map(max, zip(*corners)))
    radius = max((high - low).length / 2, 1e-9)
    data = bpy.data.cameras.new("PDM picture")
    data.sensor_fit, data.angle = "VERTICAL", math.radians(40)
    distance = radius / math.sin(data.angle / 2)
    data.clip_start, data.clip_end = distance / 1000, distance + 2 * radius
    turn = VIEW_FROM.to_track_quat("Z", "Y").to_matrix().to_4x4()
    return _placed(copy, data.name, data, Matrix.Translation((low + high) / 2 + VIEW_FROM * distance) @ turn)


def _set_up(copy, original, path):
    render = copy.render
    try:
        render.engine = "CYCLES"
    except TypeError as error:
        raise BakeError("The picture needs Cycles; enable the add-on Cycles Render Engine") from error
    copy.cycles.device = "CPU"
    copy.cycles.samples = SAMPLES
    copy.cycles.use_adaptive_sampling = copy.cycles.use_denoising = False
    for name in ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y"):
        setattr(render, name, getattr(original, name))
    copy.view_settings.view_transform = "Standard"
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGB"
    render.use_file_extension, render.dither_intensity = False, 0.0
    render.filepath = path
