"""The buttons that states.py and running.py leave out: the example room, mending, scanning, exporting, freeing, error
against time."""

import bpy
from hands import clear, key, panel, pick, press, running, scroll, settings, shot, unfold, until, xdo


def steps():
    yield from panel()
    clear()
    yield 1.0
    yield from press("pdm.example_room")
    yield 3.0
    room = bpy.context.window_manager.windows[0].scene
    assert room.name == "Radiosity Example" and len(room.objects) == 10
    curve = bpy.data.curves.new("Twin", "FONT")
    curve.body = "I"  # one flat face: the light goes the quick way
    room.collection.objects.link(bpy.data.objects.new("Text", curve))
    yield 2.0
    yield from pick("DRAFT")
    yield from press("pdm.bake")
    yield from until(lambda: not running() and settings().last_report)
    last = settings().last_report
    yield from press("pdm.live")
    yield from until(lambda: not running() and settings().last_report != last)
    shot("1-room")
    yield from press("pdm.free_live", share=0.87)
    assert not settings().live
    yield from press("pdm.export")
    yield 1.5
    shot("2-export")
    xdo("search", "--onlyvisible", "--name", "File View", "windowfocus", "mousemove", "--window", "%1", 300, 200)
    yield 0.5
    xdo("key", "Escape")
    yield from until(lambda: len(bpy.context.window_manager.windows) == 1, 20)
    yield from unfold()
    names = [item.name for item in settings().listed]
    settings().listed_index = names.index("Text")
    yield 1.0
    yield from scroll(8)
    shot("3-text")
    yield from press("pdm.mend")
    yield 1.5
    assert room.objects["Text"].type == "MESH"
    shot("4-mended")
    yield from press("pdm.scan")
    assert settings().listed[[item.name for item in settings().listed].index("Text")].kind
    yield from scroll(60)
    yield from press("pdm.convergence(")
    yield from until(running)
    yield 3.0
    shot("5-convergence")
    key("Escape")
    yield 1.0
    key("Escape")
    yield from until(lambda: not running())
