"""Run by a second Blender on a copy of a world: renders it from a point in all directions, as diffuse surfaces see it.

    blender -b --factory-startup --python world_script.py -- FOLDER NAME
    python world_script.py -- FOLDER NAME                        (the bpy wheel)

Reads the world NAME of FOLDER/world.blend, writes FOLDER/map.npz: radiance (h, w, 3), row 0 looking down, without the
discs of sky textures' suns; irradiance (3,), towards (3,) and angle of these.
"""

import os
import sys
from math import pi, radians

import bpy
import numpy as np

WIDTH, SAMPLES = 512, 9
NEAR, NEAR_WIDTH = radians(1.5), 256  # about a sun, and pixels across
EDGE = 0.02  # of a disc's brightest, down to which it reaches
SEEN = {
    "Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0, "Ray Length": 1e10,
}  # fmt: skip


def main(folder, name):
    with bpy.data.libraries.load(os.path.join(folder, "world.blend")) as (_, wanted):
        wanted.worlds = [name]
    (world,) = wanted.worlds
    skies = seen_by_diffuse_rays(world.node_tree)
    scene = set_up(world)
    for sky in skies:
        sky.sun_disc = False
    radiance = rendered(scene, folder, WIDTH, WIDTH // 2)
    found = {"irradiance": np.zeros(3), "towards": np.zeros(3), "angle": 0.0}
    if skies:
        for sky in skies:
            sky.sun_disc = True
        extra = rendered(scene, folder, WIDTH, WIDTH // 2) - radiance
        if extra.max() > 0:
            found = sun(scene, folder, max(sky.sun_size for sky in skies), extra, radiance)
    np.savez(os.path.join(folder, "part.npz"), radiance=radiance, **found)
    os.replace(os.path.join(folder, "part.npz"), os.path.join(folder, "map.npz"))


def seen_by_diffuse_rays(tree, done=None):
    """Fixes what Light Path nodes say, in groups too; returns the sky textures that show their sun's disc."""
    done = set() if done is None else done
    skies = []
    if tree is None or tree.name_full in done:
        return skies
    done.add(tree.name_full)
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeLightPath":
            for output in node.outputs:
                value = tree.nodes.new("ShaderNodeValue").outputs[0]
                value.default_value = SEEN.get(output.identifier, 0.0)
                for link in list(output.links):
                    tree.links.new(value, link.to_socket)
        elif node.bl_idname == "ShaderNodeTexSky":
            if getattr(node, "sun_disc", False) and node.sky_type not in ("PREETHAM", "HOSEK_WILKIE"):
                skies.append(node)
        elif node.bl_idname == "ShaderNodeOutputWorld":
            for link in list(node.inputs["Volume"].links):
                tree.links.remove(link)
        elif node.bl_idname == "ShaderNodeGroup":
            skies += seen_by_diffuse_rays(node.node_tree, done)
    return skies


def set_up(world):
    """A scene of nothing but the world, seen by a camera that looks everywhere."""
    scene = bpy.data.scenes.new("World")
    scene.world = world
    world.cycles_visibility.camera = True
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.rotation_euler = (pi / 2, 0, -pi / 2)  # the middle of the picture is +x
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.type = "PANO"
    panorama(camera.data).panorama_type = "EQUIRECTANGULAR"
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.samples = SAMPLES
    scene.render.use_persistent_data = True
    scene.render.film_transparent = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.resolution_percentage = 100
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    return scene


def panorama(camera):
    return camera if hasattr(camera, "panorama_type") else camera.cycles


def rendered(scene, folder, width, height):
    """(h, w, 3) linear, row 0 the lowest"""
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.filepath = os.path.join(folder, "map.exr")
    bpy.ops.render.render(write_still=True, scene=scene.name)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(image.size[1], image.size[0], -1)[..., :3].copy()
    bpy.data.images.remove(image)
    return values


def sun(scene, folder, size, extra, radiance):
    """What the suns' discs, of angle size, add, extra (h, w, 3) on the map beyond radiance: irradiance, the direction
    towards it and its angle, from a picture of its neighbourhood."""
    height, width = extra.shape[:2]
    row, column = np.unravel_index(extra.sum(axis=2).argmax(), (height, width))
    up, turn = pi * ((row + 0.5) / height - 0.5), 2 * pi * ((column + 0.5) / width - 0.5)
    low, high = max(up - NEAR - size / 2, -pi / 2), min(up + NEAR + size / 2, pi / 2)
    aside = min((high - low) / max(np.cos(max(abs(low), abs(high))), 1e-3), pi)  # wide where the sun stands high
    view = panorama(scene.camera.data)
    view.latitude_min, view.latitude_max = low, high
    view.longitude_min, view.longitude_max = turn - aside, turn + aside
    near = rendered(scene, folder, NEAR_WIDTH, NEAR_WIDTH).astype(float)
    edges = low + np.arange(NEAR_WIDTH + 1) / NEAR_WIDTH * (high - low)
    near = np.maximum(near - radiance[row, column], 0.0)
    near[near.sum(axis=2) < EDGE * near.sum(axis=2).max()] = 0.0
    light = near * (np.diff(np.sin(edges)) * 2 * aside / NEAR_WIDTH)[:, None, None]
    turns = turn - aside + (np.arange(NEAR_WIDTH) + 0.5) / NEAR_WIDTH * 2 * aside
    ups, turns = np.meshgrid((edges[:-1] + edges[1:]) / 2, turns, indexing="ij")
    towards = np.stack([np.cos(ups) * np.cos(turns), -np.cos(ups) * np.sin(turns), np.sin(ups)], axis=-1)
    centre = np.einsum("ij,ijk->k", light.sum(axis=2), towards)
    return {"irradiance": light.sum(axis=(0, 1)), "towards": centre / np.linalg.norm(centre), "angle": size}


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1 :])
