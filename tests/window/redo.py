"""The Redo panel after a bake: another exposure, quantity, domain and type are seen at once, without solving."""

import time

import bpy
import numpy as np
from hands import (
    click,
    first_scene,
    key,
    move,
    panel,
    pick,
    press,
    region,
    running,
    say,
    settings,
    shot,
    until,
    window,
    xdo,
)

ROW, HEADER, TITLE = 23, 45, 20  # pixels: of the Redo panel's rows, down to the middle of the first; the window's title
ROWS = {"exposure": 7, "quantity": 4, "domain": 5, "data_type": 6}
EXPECTED = {"exposure": 1.0, "quantity": "IRRADIANCE", "domain": "POINT", "data_type": "BYTE_COLOR"}


def colours():
    data = bpy.data.objects["Sphere"].data.color_attributes["Radiosity"].data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def place(below):
    """A place of the Redo panel, so many pixels below its top."""
    own = region("HUD")
    return own.x + int(0.7 * own.width), window().height + TITLE - own.y - own.height + below


def change(name):
    """By the mouse: a number is typed, a menu is scrolled to its next entry."""
    x, y = place(HEADER + ROW * ROWS[name])
    move(x, y)
    yield 0.5
    if name == "exposure":
        xdo("click", "--repeat", 2, "--delay", 60, 1)
        yield 0.7
        key("ctrl+a")
        xdo("type", "1")
        key("Return")
    else:
        xdo("keydown", "ctrl", "click", 5, "keyup", "ctrl")


def steps():
    yield from panel()
    first_scene()
    yield 2.0
    yield from pick("GOOD")
    yield from press("pdm.bake")
    yield from until(lambda: not running())
    first, before = settings().report()["seconds"], colours()
    say(f"bake {first['total']:.1f} s, of it solving {first['solve']:.1f} s")
    x, y = place(12)
    move(x, y)
    yield 0.5
    closed = region("HUD").height
    click(x, y)
    yield from until(lambda: region("HUD").height > 3 * closed)
    yield 1.0
    shot("open")
    for name, value in EXPECTED.items():
        last, begun = settings().last_report, time.perf_counter()
        yield from change(name)
        yield from until(lambda last=last: settings().last_report != last)
        report = settings().report()
        taken, solving = time.perf_counter() - begun, report["seconds"]["solve"]
        say(f"{name} {value}: {taken:.1f} s with the mouse, solving {solving:.2f} s")
        shot(name)
        assert report["settings"][name] == value and report["seconds"]["solve"] < 0.1 * first["solve"]
        if name == "exposure":
            assert np.allclose(colours(), 2 * before, rtol=1e-5)
