"""The Redo panel after a bake: another exposure is seen at once, without solving."""

import time

import bpy
import numpy as np
from hands import area, first_scene, module, panel, pick, press, running, say, settings, shot, until, view

CHANGES = ("exposure", 1.0), ("quantity", "IRRADIANCE"), ("domain", "CORNER"), ("data_type", "BYTE_COLOR")


def colours():
    data = bpy.data.objects["Sphere"].data.color_attributes["Radiosity"].data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def steps():
    yield from panel()
    first_scene()
    yield 2.0
    yield from pick("GOOD")
    begun = time.perf_counter()
    yield from press("pdm.bake")
    yield from until(lambda: not running())
    first, before = settings().report(), colours()
    say(f"bake {first['seconds']['total']:.1f} s, solving {first['seconds']['solve']:.1f} s")
    done = bpy.context.window_manager.operators[-1]
    assert done.bl_idname == "PDM_OT_bake" and module("operators.baking.again").last.solution is not None
    for name, value in CHANGES:
        setattr(bpy.context.window_manager.operators[-1].properties, name, value)
        begun = time.perf_counter()
        with bpy.context.temp_override(**view()):
            bpy.ops.ed.undo_redo()
        yield 0.5
        seconds = settings().report()["seconds"]
        say(f"redo {name}: {time.perf_counter() - begun - 0.5:.1f} s, solving {seconds['solve']:.2f} s")
        assert seconds["solve"] < 0.2 * first["seconds"]["solve"] and settings().report()["settings"][name] == value
        if name == "exposure":
            assert np.allclose(colours(), 2 * before, rtol=1e-5)
    shot("redone")
    assert area().type == "VIEW_3D"
