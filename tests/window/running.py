"""While a bake runs, how it ends, Live, and what is refused."""

import bpy
from hands import first_scene, key, module, panel, pick, press, running, settings, shot, started, until


def steps():
    yield from panel()
    first_scene()
    yield 2.0
    yield from started(1e-5)
    shot("11-running")
    key("Escape")
    yield from until(lambda: not running())
    shot("12-cancelled")
    yield from started(1e-5)
    yield from press("pdm.stop(keep=False)")
    yield from until(lambda: not running())
    shot("13-cancelled-by-button")
    before = settings().last_report
    yield from started(1e-5)
    yield from press("pdm.stop(keep=True)")
    shot("14-keeping")
    yield from until(lambda: not running())
    assert settings().last_report != before and settings().report()["error"] > 1e-5
    shot("15-kept")

    yield from pick("DRAFT")
    yield from press("pdm.live")
    assert settings().live
    yield from until(lambda: not running())
    shot("16-live-on")
    bpy.data.objects["Area"].data.color = 1, 0.3, 0.2
    yield 4.0
    shot("17-live")
    bpy.data.objects["Sphere"].location.x += 0.5
    yield 1.5
    shot("18-live-moved")

    mesh = bpy.data.meshes.new("Wire")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    bpy.context.collection.objects.link(bpy.data.objects.new("Wire", mesh))
    yield 2.0
    shot("19-refused")
    for light in bpy.data.lights:
        light.energy = 0
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Strength"].default_value = 0
    yield 4.0  # the panel says so, and its buttons have come down, before the mouse looks for one
    shot("20-dark")
    yield from press("pdm.bake")
    yield from until(lambda: module("operators.modal_steps").current.problem)
    shot("21-error")
