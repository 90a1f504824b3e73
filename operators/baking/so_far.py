"""The best so far, in the colours of the meshes while a bake in a window goes on; before it ends, in whatever way, they
are put back."""

import time

from ...pdm_core.foretell import seconds_to
from ...pdm_core.signs_of_life import mapped
from .colour_attribute import Colours, write_colours
from .field_at import Field
from .layer import blended

LEAST = 3.0  # s that solving takes still, by what is foretold: sooner, the end itself is seen
SHARE = 0.1  # of the time that evaluating again may take
MOST = 1.0, 0.25  # of what is left, the first time and again, after which it is given up: the vertices are too many


class SoFar:
    """Of a bake with BakeSettings, [(ReadObject, BakePoints)] and an end told by enough(); show() is called when there
    is something to be seen."""

    def __init__(self, settings, targets, enough, show):
        self.settings, self.enough, self.show = settings, enough, show
        # the others get their meshes at the end
        self.targets = [(t, p) for t, p in targets if not (t.is_applied or t.is_single_user)]
        self.best, self.history, self.due, self.undo = None, [], 0.0, None

    def steps(self, solving):
        """The Progress of a solver at each step, and at those between them that evaluate its best so far."""
        try:
            while True:
                try:
                    now = next(solving)
                except StopIteration as end:
                    return end.value
                yield now
                if now.best is not self.best:
                    self.best = now.best
                    yield from self._show(now)
        finally:
            solving.close()

    def _show(self, now):
        self.history.append((now.seconds, now.best.error))
        left = (seconds_to(self.history, self.settings.target_error) or 0.0) - now.seconds
        if limit := self.settings.time_limit:
            left = min(left, limit - now.seconds)
        begun = time.perf_counter()
        if left < LEAST or begun < self.due or not self.targets:
            return
        until = begun + MOST[self.undo is not None] * left
        values = yield from mapped(self._evaluate(until), lambda _: now)
        self.due = time.perf_counter() + (time.perf_counter() - begun) / SHARE
        if values is not None:
            self._write(values)

    def _evaluate(self, until):
        """[(k, 3)] at the points of each target, None where that took too long; yields."""
        steps = Field(self.best, self.settings.quantity).at_places([p.places() for _, p in self.targets], True)
        try:
            while True:
                yield next(steps)
                if time.perf_counter() > until or self.enough():
                    return None
        except StopIteration as end:
            return end.value
        finally:
            steps.close()

    def _write(self, values):
        items = [
            Colours(target.name, p.domain, p.colours(v * 2.0**self.settings.exposure))
            for (target, p), v in zip(self.targets, values, strict=True)
        ]
        items = [blended(self.settings, item) for item in items]
        undo = write_colours(items, self.settings.attribute, self.settings.data_type)
        self.undo = self.undo or undo
        self.show()

    def take_back(self):
        """The colours as they were before."""
        if self.undo:
            self.undo()
            self.undo = None
