"""Node trees on planes: the colours that Cycles' own bake of the diffuse colour gives, and those that we read."""

import bpy
import numpy as np
import scenes

PASS = "Cycles"


def patch(name, materials, cells=5, seed=1):
    """A square 2 x 2 of cells with vertices and UVs moved at random, so that no vertex lies on a texture's edge; once
    for each material, all at one place: far from the origin Cycles moves the corners it bakes by more."""
    rng = np.random.default_rng(seed)
    obj = scenes.grid(name, cells, 2.0)
    mesh, copies = obj.data, len(materials)
    places = scenes.vertices(obj)
    places[:, :2] += rng.uniform(-0.1, 0.1, (len(places), 2))
    places[:, 2] = rng.uniform(-0.2, 0.2, len(places))
    faces = np.array([polygon.vertices[:] for polygon in mesh.polygons])
    mesh.clear_geometry()
    every = (faces + len(places) * np.arange(copies)[:, None, None]).reshape(-1, 4)
    mesh.from_pydata(np.tile(places, (copies, 1)), [], every.tolist())
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.repeat(np.arange(copies, dtype=np.int32), len(faces)))
    corner = np.tile(places[faces.ravel()], (copies, 1))
    uv = corner[:, :2] / 2 + 0.5 + 0.05 * np.sin(7 * corner[:, 1:3])
    for layer, values in (("UVMap", uv), ("Second", 1.5 * uv[:, ::-1] + 0.2)):
        mesh.uv_layers.new(name=layer).uv.foreach_set("vector", values.astype(np.float32).ravel())
    for layer, kind, domain, k in (("Tint", "FLOAT_COLOR", "CORNER", 1), ("Bytes", "BYTE_COLOR", "POINT", 2)):
        made = mesh.color_attributes.new(layer, kind, domain)
        values = np.random.default_rng(k).uniform(0.1, 0.9, (len(made.data) // copies, 4)).astype(np.float32)
        values[:, 3] = 1.0
        made.data.foreach_set("color", np.tile(values, (copies, 1)).ravel())
    mesh.update()
    return obj


def baked(obj):
    """(corners, 3): Cycles' DIFFUSE COLOR pass at the corners of an object."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.bake.target = "VERTEX_COLORS"
    scene.cycles.samples = 1
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    colours = obj.data.color_attributes
    colours.active_color = colours.new(PASS, "FLOAT_COLOR", "CORNER")
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"COLOR"})
    return scenes.colours(obj, PASS)[:, :3].astype(float)


def corners(obj):
    """(corners, 3) m in the world, a little towards the middle of their faces, as Cycles bakes them."""
    vertex = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", vertex)
    count = np.empty(len(obj.data.polygons), np.int32)
    obj.data.polygons.foreach_get("loop_total", count)
    matrix = np.array(obj.matrix_world, float)
    points = (scenes.vertices(obj) @ matrix[:3, :3].T + matrix[:3, 3])[vertex]
    starts = np.cumsum(count) - count
    inward = np.repeat(np.add.reduceat(points, starts) / count[:, None], count, axis=0) - points
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return points + 1e-4 * np.maximum(np.abs(points).max(axis=1, keepdims=True), 1.0) * inward


def lit(objects, samples):
    """(vertices, 3): irradiance / pi at the vertices of objects in turn, by Cycles."""
    scene = bpy.context.scene
    scene.render.engine, scene.render.bake.target = "CYCLES", "VERTEX_COLORS"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.max_bounces, cycles.diffuse_bounces = "CPU", samples, 32, 32
    cycles.use_adaptive_sampling = cycles.use_light_tree = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    for other in bpy.context.view_layer.objects:
        other.select_set(other in objects)
    for obj in objects:
        made = obj.data.color_attributes
        made.active_color = made.get(PASS) or made.new(PASS, "FLOAT_COLOR", "POINT")
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    return np.concatenate([scenes.colours(obj, PASS)[:, :3] for obj in objects]).astype(float)
