"""The best so far, in the colours of the meshes while a bake in a window goes on; before it ends, in whatever way, and
before the file is saved, they are put back."""

import numpy as np

from ...pdm_core.signs_of_life import mapped, unfolded
from .bake_points import each_of
from .colour_attribute import colours_of, write_colours
from .field_at import Field
from .layer import blended

# s that solving takes still, by what is foretold, and for each colour: sooner, the end itself is seen. Where colours
# change Blender smooths a view anew: by software 5 s of work for 10,000
LEAST = 3.0, 2e-3
LATER = 8.0  # times as long as up to the last one until the next


class _Shown:
    """The SoFar whose colours the meshes have, or None."""

    now = None


class SoFar:
    """Of a bake with BakeSettings and [(ReadObject, BakePoints)]; show() is called when there is something to be seen.

    What the solution's cells hold is read, not gathered anew for each vertex: that takes as long as solving."""

    def __init__(self, settings, targets, show):
        self.settings, self.show = settings, show
        # the others get their meshes at the end
        self.targets = [(t, p) for t, p in targets if not (t.is_applied or t.is_single_user)]
        self.best, self.due, self.undo = None, 0.0, None

    def steps(self, solving):
        """The Progress of a solver at each step, and at those between them that read its best so far."""
        return unfolded(solving, self._at)

    def _at(self, now):
        yield now
        if now.best is not self.best:
            self.best = now.best
            yield from self._show(now)

    def _show(self, now):
        left = (self.best.seconds_to(self.settings.target_error) or 0.0) - now.seconds
        if limit := self.settings.time_limit:
            left = min(left, limit - now.seconds)
        worth = max(LEAST[0], LEAST[1] * sum(p.size for _, p in self.targets))
        if left < worth or now.seconds < self.due or not self.targets:
            return
        self.due = LATER * now.seconds
        places = [np.concatenate(part) for part in zip(*((p.surfaces, p.points) for _, p in self.targets))]
        values = yield from mapped(Field(self.best, self.settings.quantity).held(*places), lambda _: now)
        self._write(values * 2.0**self.settings.exposure)

    def _write(self, values):
        targets, points = zip(*self.targets)
        items = [blended(self.settings, item) for item in colours_of(targets, points, each_of(values, points))]
        undo = write_colours(items, self.settings.attribute, self.settings.data_type)
        self.undo, _Shown.now = self.undo or undo, self
        self.show()

    def take_back(self):
        """The colours as they were before."""
        undo, self.undo, _Shown.now = self.undo, None, None
        if undo:
            undo()


def saving():
    """What a file keeps is no bake that may be cancelled; the next best is shown again."""
    if _Shown.now:
        _Shown.now.take_back()
