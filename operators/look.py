"""Keeps the sidebar's list of objects current: changes mark it stale, and while it is shown the scene is read again.

The reading waits until nothing changes for a moment, runs in slices, and stays away from scenes that take long to read.
"""

import time
import traceback

import bpy

from ..pdm_core import SceneError
from .baking.bake import look_at_steps
from .baking.colour_attribute import BakeError
from .live import own_changes
from .modal_steps import SLICE, current, our_sidebars, redraw_sidebars
from .words import many, say

QUIET = 0.4  # s without a change before the scene is read
SLOWEST = 0.3  # s of work; where the first step of the last reading took longer, only the button reads again
READ = bpy.types.Object, bpy.types.Mesh, bpy.types.Material, bpy.types.World, bpy.types.Light, bpy.types.Curve


class _Watch:
    """is_stale: something has changed since the scene was read; problem: why it cannot be read, or ''; told: what the
    last bake failed at, when the panel was last drawn."""

    def __init__(self):
        self.is_stale, self.problem, self.is_slow, self.is_reading = True, "", False, False
        self.changed, self.took, self.told = 0.0, 0.0, ""
        self.steps = self.seen = self.window = None

    def change(self):
        current.problem = ""
        self.is_stale, self.changed, self.steps = True, time.perf_counter(), None

    def fail(self, problem):
        self.steps, self.is_stale, self.problem = None, False, problem


watch = _Watch()


def panel_shown(context):
    """Told by the panel that it is drawn: the scene is read soon, if it has changed."""
    watch.window = context.window
    signature = _signature(context.scene)
    if signature != watch.seen:
        watch.seen, problem = signature, current.problem
        watch.change()
        if problem is not watch.told:  # it was changed while the bake ran, which failed at that
            current.problem = problem
    watch.told = current.problem
    _read_soon()


def _read_soon():
    if watch.is_stale and not watch.is_slow and watch.window is not None and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=QUIET)


def _signature(scene):
    """What changes without the dependency graph saying so: objects added, removed, renamed, hidden from renders."""
    last = scene.pdm_radiosity.last_report
    return scene.name, len(last), hash(tuple((obj.name, obj.hide_render) for obj in scene.objects))


def changed(scene, depsgraph):
    if watch.is_reading or current.stage is not None:
        return
    for update in depsgraph.updates:
        if isinstance(update.id, READ) and (
            update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading
        ):
            watch.change()
            _read_soon()  # a light that is dimmed leaves the sidebar as it was drawn
            return


def forget():
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    watch.__init__()


def _tick():
    """Seconds until it wants to be called again, or None."""
    now = time.perf_counter()
    if current.stage is not None or now - watch.changed < QUIET:
        return QUIET
    windows = bpy.context.window_manager.windows
    if watch.window not in list(windows) or not any(region.width > 1 for region in our_sidebars([watch.window])):
        return None  # read when it is drawn again
    with bpy.context.temp_override(window=watch.window):
        try:
            if not _read(bpy.context):
                return 0.0
        except (BakeError, SceneError) as error:
            watch.fail(str(error))
        except Exception as error:  # raised further, the next drawing of the panel would only start it again
            traceback.print_exc()
            watch.fail(f"The scene could not be read, please report the console's text: {error}")
        redraw_sidebars(bpy.context)
    return None


def _read(context):
    """One slice of the reading; True when done."""
    start, watch.is_reading = time.perf_counter(), True
    try:
        if watch.steps is None:
            watch.steps, begun = look_at_steps(context), time.thread_time()  # whatever else the machine does
            with own_changes(context):  # what was shown for the reading is hidden again, and that is no change
                next(watch.steps)
            watch.took = time.thread_time() - begun
        while time.perf_counter() - start < SLICE:
            next(watch.steps)
    except StopIteration as end:
        watch.steps, watch.is_stale, watch.problem = None, False, ""
        watch.is_slow = watch.took > SLOWEST
        context.scene.pdm_radiosity.keep_scan(end.value)
        return True
    finally:
        watch.is_reading = False
    return False


def summary(settings):
    """(icon, text): what a bake will do, on one line."""
    scan = settings.scan()
    if watch.problem:
        return "ERROR", watch.problem
    if scan is None or (watch.is_stale and not scan["objects"]):
        return "VIEWZOOM", say("Looking at the scene ...")
    lights = scan.get("shining") or {"count": 0, "sky": False}
    parts = [many(len(scan["objects"]), "object", "objects")]
    parts += [many(lights["count"], "light", "lights")] if lights["count"] or not lights["sky"] else []
    parts += [say("sky")] * lights["sky"] + [say("{} refused", len(scan["refused"]))] * bool(scan["refused"])
    return "FILE_REFRESH" if watch.is_stale else "CHECKMARK" if not scan["refused"] else "INFO", ", ".join(parts)


def is_dark(settings):
    """Whether there are objects but nothing shines."""
    scan = settings.scan()
    return bool(scan and scan["objects"] and (lights := scan.get("shining")) and not (lights["count"] or lights["sky"]))


def foreseen(settings):
    """[sentence] of what would go wrong with a bake."""
    return (settings.scan() or {}).get("foreseen", [])


def is_empty(settings):
    """As far as is known: what is new may not have been read yet."""
    scan = settings.scan()
    return scan is not None and not scan["objects"]


def is_surely_empty(settings):
    return is_empty(settings) and not watch.is_stale
