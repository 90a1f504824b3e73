"""How long work runs: at once in scripts; in a window in slices, between which Blender handles input and draws."""

import math
import time
import traceback

from ..pdm_core import SceneError
from ..pdm_core.foretell import seconds_to
from ..pdm_core.signs_of_life import finish
from .baking.bake import Stage
from .baking.colour_attribute import BakeError
from .baking.report import duration, percent
from .edit_mode import object_mode
from .told import told
from .words import say

CATEGORY = "Radiosity"  # tab of the sidebar
TICK = 0.002  # s between timer events: hardly a wait between slices
SLICE = 0.04  # s of work in each, and then no more than what a step takes longer than the last, 50 ms at most: input
# waits no longer than .1 s
DRAWING = 0.1  # share of the time that drawing the progress may take
DRAWN = 0.2, 5.0  # s, least and most from one drawing to the next
TWICE = 2  # slices after which Blender draws, as it finds out only then what is under the mouse
GROWTH = 1.2  # of what waits between slices are thought to take, at most, from one to the next
SOLVING = 0.9  # of the bar; the rest is reading and evaluating
CANCELS = "Esc cancels"
AFTER = "Evaluating", "Checking"  # stages after solving
NAVIGATION = set("MOUSEMOVE MIDDLEMOUSE WHEELUPMOUSE WHEELDOWNMOUSE TRACKPADPAN TRACKPADZOOM MOUSEROTATE".split())
CLICKS = {"LEFTMOUSE", "INBETWEEN_MOUSEMOVE"}
CANCEL, KEEP = "CANCEL", "KEEP"


class _Current:
    """What runs in a window, one at a time. stage: the Stage it is at, None where nothing runs; history
    [(seconds, error)]; wish: '', CANCEL or KEEP, what the user asks of it; slices: seconds that each took; problem: why
    the last one failed, or ''."""

    def __init__(self):
        self.stage = self.steps = self.timer = None
        self.begin(None, None)
        self.stage = None

    def begin(self, steps, timer, target=0.0, can_keep=False):
        self.steps, self.timer, self.target, self.can_keep = steps, timer, target, can_keep
        self.stage = Stage("Reading the scene", 0.0, math.inf)
        self.begun, self.history, self.wish, self.slices, self.fraction = time.perf_counter(), [], "", [], 0.0
        self.problem = ""

    def at(self, stage):
        self.stage = stage
        if stage.error < (self.history[-1][1] if self.history else math.inf):
            self.history.append((self.elapsed(), stage.error))

    def elapsed(self):
        return time.perf_counter() - self.begun

    def left(self):
        """Seconds that solving may still take, None where nothing is known, it is over, or it should have been."""
        if self.stage.text.startswith(AFTER) or self.wish == KEEP:
            return None
        whole = seconds_to(self.history, self.target) if self.target else None
        return None if whole is None or whole < self.elapsed() else whole - self.elapsed()

    def done(self):
        """0 to 1 for the bar, by the time it may take; never back."""
        now = self.stage.fraction
        if self.target:
            left = self.left()
            now = SOLVING * (0.0 if left is None else self.elapsed() / max(self.elapsed() + left, 1e-9))
            if self.stage.text.startswith(AFTER):
                now = SOLVING + (1 - SOLVING) * self.stage.fraction
        self.fraction = max(self.fraction, min(now, 1.0))
        return self.fraction

    def can_be_kept(self):
        """Whether there is a result that Keep the Best So Far could bake."""
        return self.can_keep and self.stage is not None and math.isfinite(self.stage.error) and not self.wish


current = _Current()


class Idle:
    """Mixed into operators that must wait for what runs."""

    @classmethod
    def poll(cls, context):
        if current.stage is not None:
            cls.poll_message_set("A bake is running")
        return current.stage is None and context.scene is not None

    def refuse(self, text):
        """Says why nothing is done."""
        self.report({"ERROR"}, told(str(text)))
        return {"CANCELLED"}


class AfterBake(Idle):
    """Mixed into operators on what was baked."""

    @classmethod
    def poll(cls, context):
        if context.scene is None or not context.scene.pdm_radiosity.last_report:
            cls.poll_message_set("Bake first")
            return False
        return super().poll(context)


class Steps(Idle):
    """Mixed into operators whose work is a generator of Stages. make_steps(context) is the generator, done(context,
    result) reports what it returns."""

    in_window = False  # started by a button
    target = 0.0  # error towards which it works, 0 where there is no one such
    can_keep = False  # whether current.wish KEEP ends it with what there is

    def execute(self, context):
        try:
            with object_mode(context):
                result = finish(self.make_steps(context))
        except (BakeError, SceneError) as error:
            return self.fail(error)
        return self.done(context, result)

    def invoke(self, context, event):
        self.in_window = True
        self.steps = self.make_steps(context)
        self.stopped_at = self.drawn_at = time.perf_counter()  # of itself, as a button was pressed
        self.usual, self.lost, self.since = TICK, 0.0, 0
        timer = context.window_manager.event_timer_add(TICK, window=context.window)
        current.begin(self.steps, timer, self.target, self.can_keep)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set(status())
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if current.steps is not self.steps:
            return {"CANCELLED"}  # the add-on was disabled meanwhile
        if event.type == "ESC" or current.wish == CANCEL:
            current.wish = ""
            return self.stopped(context)
        if event.type != "TIMER":
            # looking around and our own panels are allowed, editing the scene under the bake is not
            allowed = event.type in NAVIGATION or (event.type in CLICKS and over_our_panels(context, event))
            return {"PASS_THROUGH" if allowed else "RUNNING_MODAL"}
        try:
            self.advance(context)
        except StopIteration as end:
            self.cancel(context)
            return self.done(context, end.value)
        except (BakeError, SceneError) as error:
            self.cancel(context)
            return self.fail(error)
        except Exception as error:
            # raised further, Blender would go on calling a bake that is dead
            self.cancel(context)
            traceback.print_exc()
            return self.fail(f"The bake failed, please report the console's text: {type(error).__name__}: {error}")
        return {"RUNNING_MODAL"}

    def advance(self, context):
        """One slice of the work; StopIteration carries the result."""
        start = time.perf_counter()
        waited = start - self.stopped_at
        self.usual = min(waited, GROWTH * self.usual)
        self.lost += waited - self.usual  # to drawing
        least, most = DRAWN
        if start - self.drawn_at > min(max(self.lost / DRAWING, least), most):  # a new stage waits too: a bake has five
            # input waits for what is drawn, and for no step besides
            self.drawn_at, self.stopped_at, self.lost, self.since = start, start, 0.0, 0
            redraw_sidebars(context)
            context.workspace.status_text_set(status())
            return
        limit, now = 0.0 if self.since < TWICE else SLICE, start
        while True:
            current.at(next(self.steps))
            last, now = now, time.perf_counter()
            if 2 * now - last > start + limit:
                break
        self.stopped_at = now
        self.since += 1
        current.slices.append(now - start)

    def stopped(self, context):
        """Esc was pressed."""
        self.cancel(context)
        self.report({"INFO"}, say("{} cancelled, nothing was changed", say(self.bl_label)))
        return {"CANCELLED"}

    def cancel(self, context):
        """Also called by Blender, when the window closes or another file is loaded."""
        stop_bake(context)
        redraw_sidebars(context)

    def fail(self, error):
        """Said by the panel too: of what runs in a window Blender tells only for a moment, in the status bar."""
        current.problem = str(error) if self.in_window else ""
        return self.refuse(error)


def status():
    """Where the work is, on one line."""
    stage = current.stage
    reached = say(", error {}", percent(stage.error)) if math.isfinite(stage.error) else ""
    return f"{told(stage.text)}: {100 * current.done():.0f} %{reached}, {duration(current.elapsed())}.  {say(CANCELS)}"


def stop_bake(context):
    """Ends the work that runs in a window, if any: nothing of it is kept. Also when the add-on is disabled."""
    try:
        if current.steps is not None:
            context.window_manager.event_timer_remove(current.timer)
            if context.workspace is not None:
                context.workspace.status_text_set(None)
            current.steps.close()
            if context.view_layer is not None:
                context.view_layer.update()  # what that puts back is no change, which would come after the end
    finally:
        current.stage = current.steps = current.timer = None


def redraw_sidebars(context):
    """Only the sidebar: a whole viewport takes longer to draw than a slice."""
    for region in _sidebars(context.window_manager.windows):
        region.tag_redraw()


def over_our_panels(context, event):
    """Whether the mouse is over a sidebar that shows our tab."""
    return any(
        region.x <= event.mouse_x < region.x + region.width and region.y <= event.mouse_y < region.y + region.height
        for region in our_sidebars([context.window])
    )


def our_sidebars(windows):
    """Those whose open tab is ours; one that is closed keeps its tab, and is a pixel wide."""
    return [region for region in _sidebars(windows) if region.active_panel_category == CATEGORY]


def _sidebars(windows):
    areas = [area for window in windows for area in window.screen.areas if area.type == "VIEW_3D"]
    return [region for area in areas for region in area.regions if region.type == "UI"]
