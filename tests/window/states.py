"""From an empty scene to a picture, by the mouse alone; each state of the sidebar on the way."""

import time

import bpy
from hands import area, baked, clear, first_scene, key, module, panel, pick, press, running, say, settings, shot, until


def steps():
    yield from panel()
    clear()
    yield 2.0
    shot("01-empty")
    first_scene()
    shot("02-stale")
    yield 4.0
    shot("03-ready")
    begun = time.perf_counter()
    yield from press("pdm.bake")
    yield from until(lambda: not running() and baked())
    say(f"first bake seen after {time.perf_counter() - begun:.1f} s with the time the mouse took to find the button")
    shot("04-done")
    shading = area().spaces.active.shading
    assert shading.color_type == "VERTEX"
    yield from press("pdm.show_colours")
    assert (shading.type, shading.light, shading.color_type) == ("SOLID", "STUDIO", "MATERIAL")
    shot("05-put-back")
    yield from press("pdm.show_colours")
    assert shading.color_type == "VERTEX"

    yield from pick("DRAFT")
    yield from press("pdm.bake")
    yield from until(lambda: not running())
    coarse, light = settings().report()["vertices"], module("operators.baking.again").last
    solved = light.solution
    yield from press("pdm.subdivide")
    yield from until(lambda: not running() and len(bpy.data.objects["Plane"].data.vertices) > 4)
    shot("06-subdivided")
    assert solved is not None and light.solution is solved  # read at the new vertices
    fine = len(bpy.data.objects["Plane"].data.vertices)
    key("ctrl+z")
    yield 3.0
    shot("07-bake-undone")
    assert len(bpy.data.objects["Plane"].data.vertices) == fine and settings().report()["vertices"] == coarse
    key("ctrl+z")
    yield 2.0
    assert len(bpy.data.objects["Plane"].data.vertices) == 4
    shot("08-undone")

    yield from press("preview_material(remove=False)")
    shot("09-preview")
    assert any(material.use_nodes for material in bpy.data.materials)
    yield from press("preview_material(remove=True)", share=0.87)
    shot("10-no-preview")
