"""Worlds with a small bright sun, with and without a building in the way: our bake beside Cycles' of the same objects.

    PYTHON_WITH_BPY tests/benchmarks/worlds.py [OUTPUT.json [TARGET [PART_OF_A_NAME]]]

An equirectangular image whose sun is four pixels, and each type of sky texture of the version, over a floor alone and
over the floor with a ball and a box of lights_shaded.py, where the numbers are told.
"""

import sys
from math import radians

import bpy
import lights_shaded as shaded
import numpy as np

MAP = 1024  # pixels of the map by which Cycles samples a world


def image():
    """An Environment Texture: a sky that darkens upwards, a dim ground, a sun of 2 x 2 pixels at 40 degrees."""
    height, width = 256, 512
    up = (np.arange(height) + 0.5) / height * 180 - 90
    pixels = np.ones((height, width, 4), np.float32)
    sky = np.exp(-np.maximum(up, 0) / 40)[:, None] * (0.5, 0.7, 1.0)
    pixels[..., :3] = np.where(up[:, None] > 0, sky, (0.1, 0.08, 0.06))[:, None]
    row = int((40 + 90) / 180 * height)
    pixels[row : row + 2, 300:302, :3] = (9000, 8000, 6000)
    made = bpy.data.images.new("Sky", width, height, float_buffer=True)
    made.pixels.foreach_set(pixels.ravel())
    made.update()
    made.pack()
    node = new_node("TexEnvironment")
    node.image = made
    return node, 1.0


def sky(kind):
    node = new_node("TexSky")
    node.sky_type = kind
    if kind not in ("PREETHAM", "HOSEK_WILKIE"):
        node.sun_elevation, node.sun_rotation = radians(35), radians(70)
    return node, 0.1


def new_node(kind):
    return bpy.context.scene.world.node_tree.nodes.new(f"ShaderNode{kind}")


def worlds():
    """Yield (name, function that makes the node and tells its strength)."""
    yield "image with a sun", image
    for kind in bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items.keys():
        if kind != "HOSEK_WILKIE":  # Cycles has it no more
            yield f"sky {kind.lower()}", lambda kind=kind: sky(kind)


def set_up(with_building, make):
    """[objects to bake]"""
    objects = shaded.set_up("floor")
    if not with_building:
        for obj in list(bpy.context.scene.objects):
            if obj != objects[0]:
                bpy.data.objects.remove(obj)
        objects = objects[:1]
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", MAP
    background = next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    node, strength = make()
    background.inputs["Strength"].default_value = strength
    world.node_tree.links.new(node.outputs[0], background.inputs["Color"])
    return objects


def row(name, with_building, make, target, bake):
    found, _ = shaded.measured(set_up(with_building, make), target, bake)
    return {"world": name, "building": with_building, **found}


def main(output=None, target="0.01", part=""):
    every = [(name, building, make) for name, make in worlds() for building in (False, True)]
    shaded.table(
        "world",
        [(n + ", building" * b, lambda bake, n=n, b=b, m=m: row(n, b, m, float(target), bake)) for n, b, m in every],
        output, part, {"samples": shaded.SAMPLES["floor"], "target": float(target)}, ("world", "building"),
    )  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:])
