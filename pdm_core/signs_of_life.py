"""Long work as generators that yield signs of life and return the result: driven, mapped, made of work on arrays."""

from inspect import isgenerator
from threading import Event, Thread

TICK = 0.03  # s between two signs of life, the last part of a slice of the window


def in_thread(work, *arguments):
    """Yields every TICK s until work(*arguments), which touches nothing but arrays, is done; returns its result.
    Closed, it waits for the end, of a generator for its next step alone."""
    outcome, closed = [], Event()

    def run():
        try:
            result = work(*arguments)
            outcome.append((_until(closed, result) if isgenerator(result) else result, None))
        except Exception as error:
            outcome.append((None, error))

    thread = Thread(target=run)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(TICK)
            yield
    finally:
        closed.set()
        thread.join()
    result, error = outcome[0]
    if error is not None:
        raise error
    return result


def _until(closed, steps):
    """Drives a generator to its end, or until an Event is set; returns what it returns."""
    try:
        while not closed.is_set():
            try:
                next(steps)
            except StopIteration as end:
                return end.value
    finally:
        steps.close()


def finish(steps, tell=None):
    """Drives a generator to its end, calls tell(step) at each step, returns what it returns."""
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        if tell is not None:
            tell(step)


def mapped(steps, change):
    """Generator: yields change(step) at each step of another, returns what that returns; closed, it closes that too."""
    return unfolded(steps, lambda step: (change(step),))


def unfolded(steps, more):
    """The same that yields all of more(step) at each step."""
    try:
        while True:
            try:
                step = next(steps)
            except StopIteration as end:
                return end.value
            yield from more(step)
    finally:
        steps.close()
