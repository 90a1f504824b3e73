"""The sidebar narrow, in the light theme, at 125 %, with everything unfolded."""

from pathlib import Path

import bpy
from hands import (
    first_scene,
    move,
    panel,
    pick,
    press,
    region,
    running,
    say,
    settings,
    shot,
    unfold,
    until,
    view,
    window,
    xdo,
)


def narrow(width):
    """Drags the sidebar's left border, some pixels of which can be grasped, until it is so wide."""
    for off in (7, 8, *range(6, -4, -1)):  # by version
        own = region()
        x, y, before = own.x + off, window().height - own.y - own.height // 2, own.width
        move(x, y)
        yield 0.6
        xdo("mousedown", 1)
        yield 0.6
        for to in (x + (before - width) // 2, x + before - width):
            move(to, y)
            yield 0.6
        xdo("mouseup", 1)
        yield 1.5  # a busy machine takes its time to draw
        if abs(region().width - width) < 25:
            return
    raise AssertionError(f"the sidebar stays {region().width} wide")


def steps():
    yield from panel()
    first_scene()
    bpy.data.objects["Sphere"].modifiers.new("Wave", "WAVE")
    mesh = bpy.data.meshes.new("A wire of a long name")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    bpy.context.collection.objects.link(bpy.data.objects.new(mesh.name, mesh))
    yield 2.0
    yield from pick("DRAFT")
    yield from press("pdm.bake")
    yield from until(lambda: not running())
    preferences = bpy.context.preferences
    yield from unfold()
    shot("usual")
    settings().listed_index = 0
    yield 1.0
    shot("refused")
    settings().listed_index = [item.name for item in settings().listed].index("Plane")
    yield 1.0
    shot("coarse")
    yield from narrow(170)
    shot("narrow")
    yield from narrow(290)
    preferences.view.ui_scale = 1.25
    yield 1.5
    shot("125")
    preferences.view.ui_scale = 1.0
    themes = [path for path in bpy.utils.preset_paths("interface_theme")]
    light = [file for path in themes for file in Path(path).glob("*ight.xml")]
    with bpy.context.temp_override(**view()):
        bpy.ops.script.execute_preset(filepath=str(light[0]), menu_idname="USERPREF_MT_interface_theme_presets")
    yield 1.5
    shot("light")
    if "pt_PT" in bpy.app.translations.locales:
        preferences.view.language = "pt_PT"
        yield 2.0
        shot("portuguese")
        assert bpy.app.translations.pgettext_iface("Bake Radiosity", "Operator") == "Calcular radiosidade"
    else:
        say("this Blender comes without Portuguese")
