"""Hands and eyes for scripts in Blender's window: mouse, keys, pictures, the sidebar's buttons.

Places are pixels of the screen from its top left. What yields is called by `yield from`: Blender draws meanwhile.
"""

import importlib
import os
import subprocess
import time
from pathlib import Path

import bpy

FOLDER = Path(os.environ["SHOT_FOLDER"])
STEP = 9  # pixels between places that are looked at for buttons, at an interface scale of 1
HEADER = 25  # pixels from one folded part of the panel to the next
HOVER = 0.06  # s until Blender knows what is under the mouse


def say(text):
    """A line that shot.sh shows."""
    print(f"window: {text}", flush=True)


def window():
    return bpy.context.window_manager.windows[0]


def area(kind="VIEW_3D"):
    return next(area for area in window().screen.areas if area.type == kind)


def region(kind="UI"):
    return next(region for region in area().regions if region.type == kind)


def view():
    """For bpy.context.temp_override."""
    return {"window": window(), "area": area(), "region": region("WINDOW")}


def panel(category="Radiosity"):
    """Opens the sidebar at a tab; it must have been drawn once."""
    area().spaces.active.show_region_ui = True
    yield 0.5
    region().active_panel_category = category
    area().tag_redraw()
    yield 0.7


def xdo(*words):
    subprocess.run(["xdotool", *map(str, words)], check=True)


def key(name):
    xdo("search", "--onlyvisible", "--name", "Blender", "windowfocus")  # keys go to the window in focus
    time.sleep(0.1)
    xdo("key", name)


def move(x, y):
    xdo("mousemove", x, y)


def click(x, y):
    xdo("mousemove", x, y, "click", 1)


def shot(name):
    subprocess.run(["import", "-window", "root", str(FOLDER / f"shot-{name}.png")], check=True)


def under_mouse():
    """The Python of the button that the mouse is over, or ''."""
    manager = bpy.context.window_manager
    with bpy.context.temp_override(window=window(), area=area(), region=region()):
        for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
            manager.clipboard = ""
            try:
                if copy.poll():
                    copy()
            except RuntimeError:  # this button has none
                continue
            if manager.clipboard:
                return manager.clipboard
    return ""


def buttons(top=0.0, share=0.5):
    """[(Python, x, y)] of all buttons of the sidebar, from the top down, at a share of its width; what the mouse meets
    is all that tells where they are."""
    own, found = region(), []
    x, height = int(own.x + share * own.width), window().height
    scale = bpy.context.preferences.system.ui_scale
    first = height - own.y - own.height + top
    move(own.x - 200, height - own.y - 50)  # away from the last button, which Blender goes on taking for the one
    yield 0.3
    for y in range(int(first), height - own.y, int(STEP * scale)):
        move(x, y)
        yield HOVER
        python = under_mouse()
        if python and (not found or found[-1][0] != python):
            found.append((python, x, y))
    return found


def scroll(notches):
    """Turns the wheel over the sidebar, down where positive; near its end, as a list in the middle would take it."""
    own = region()
    move(own.x + own.width // 2, window().height - own.y - own.height // 12)
    yield 0.3
    xdo("click", "--repeat", abs(notches), "--delay", 30, 5 if notches > 0 else 4)
    yield 0.7


def press(words, share=0.5):
    """Clicks the first button of the sidebar whose Python has these words."""
    for python, x, y in (yield from buttons(share=share)):
        if words in python:
            move(x, y + 3)
            yield 0.2
            click(x, y + 3)
            yield 0.4
            return
    raise AssertionError(f"no button {words!r}")


def clear():
    """Deletes everything, as a user would."""
    with bpy.context.temp_override(**view()):
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()


def first_scene():
    """What a new user makes: the cube deleted; a plane, a UV sphere, an area light."""
    clear()
    with bpy.context.temp_override(**view()):
        bpy.ops.mesh.primitive_plane_add(size=4)
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(0, 0, 0.7))
        bpy.ops.object.light_add(type="AREA", radius=1, location=(1, -1, 3))
        bpy.context.object.data.energy = 200
        bpy.ops.ed.undo_push(message="The scene")


def settings():
    return bpy.context.scene.pdm_radiosity


def module(name):
    """A module of the installed extension."""
    return importlib.import_module(f"bl_ext.user_default.pdm_radiosity.{name}")


def running():
    return module("operators.modal_steps").current.stage is not None


def until(done, most=150.0):
    """Waits for done(), most seconds at most."""
    start = time.perf_counter()
    while not done():
        assert time.perf_counter() < start + most, "waited too long"
        yield 0.1
    yield 0.5


def baked(name="Plane"):
    return "Radiosity" in bpy.data.objects[name].data.color_attributes


def started(error):
    """A bake to this target, by the button, until it has some result."""
    settings().preset = "CUSTOM"
    settings().target_error = error
    yield 0.3
    yield from press("pdm.bake")
    yield from until(running)
    yield from until(lambda: not running() or module("operators.modal_steps").current.can_be_kept())
    assert running(), "it ended before anything could be pressed"


def pick(preset):
    """A target error."""
    settings().preset = preset
    yield 0.3


def unfold(below="pdm.export"):
    """Clicks the headers of Advanced, Objects, Report, Details and Error Against Time below a button, the last first:
    those above stay where they are."""
    found = yield from buttons()
    x, y = next((x, y) for python, x, y in reversed(found) if below in python)
    for part in range(5, 0, -1):
        click(x - 60, y + 8 + HEADER * part)
        yield 0.7
