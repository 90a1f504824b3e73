"""Worlds with a small bright sun, with and without a building in the way: our bake beside Cycles' of the same objects.

    PYTHON_WITH_BPY tests/benchmarks/worlds.py [OUTPUT.json [TARGET [PART_OF_A_NAME]]]

An equirectangular image whose sun is four pixels, and each type of sky texture of the version, over a floor alone and
over the floor with a ball and a box of lights_shaded.py, where the numbers are told.
"""

import sys
import time
from math import radians

import bpy
import lights_shaded as shaded
import numpy as np
from lights import extension

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
    objects = set_up(with_building, make)
    bpy.context.view_layer.update()
    start = time.process_time()
    ours, report = shaded.by_us(objects, target, bake)
    start = time.process_time() - start
    (one, seconds), (other, _) = shaded.by_cycles(objects, 1), shaded.by_cycles(objects, 2)
    found = {"world": name, "building": with_building, "stated": report["error"]}
    found |= shaded.compared(ours, one, other, shaded.areas(objects))
    return {**found, "vertices": len(ours), "cpu_seconds": start, "cycles_seconds": seconds}


def main(output=None, target="0.01", part=""):
    module = extension()
    sys.modules["pdm_extension"].register()
    bake = module("operators.baking.bake")
    rows, version = [], ".".join(map(str, bpy.app.version[:2]))
    print(f"{'world':40} {'L2 %':>7} {'worst %':>8} {'noise %':>8} {'stated %':>8} {'CPU s':>6}   (Blender {version})")
    for name, make in worlds():
        for with_building in (False, True):
            if part not in name:
                continue
            rows.append(row(name, with_building, make, float(target), bake))
            found = rows[-1]
            numbers = [100 * found[key] for key in ("l2", "worst", "noise", "stated")]
            print(f"{name + (', building' if with_building else ''):40} {numbers[0]:7.3f} {numbers[1]:8.3f} "
                  f"{numbers[2]:8.3f} {numbers[3]:8.3f} {found['cpu_seconds']:6.1f}", flush=True)  # fmt: skip
            if output:
                about = {"samples": shaded.SAMPLES["floor"], "target": float(target)}
                shaded.keep(output, version, rows, about, ("world", "building"))
    sys.modules["pdm_extension"].unregister()


if __name__ == "__main__":
    main(*sys.argv[1:])
