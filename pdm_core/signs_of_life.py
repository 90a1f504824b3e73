"""Long work as generators that yield signs of life and return the result: driven, mapped, made of work on arrays."""

from threading import Thread

TICK = 0.03  # s between two signs of life, the last part of a slice of the window


def in_thread(work, *arguments):
    """Yields every TICK s until work(*arguments), which touches nothing but arrays, is done; returns its result."""
    outcome = []

    def run():
        try:
            outcome.append((work(*arguments), None))
        except Exception as error:
            outcome.append((None, error))

    thread = Thread(target=run)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(TICK)
            yield
    finally:
        thread.join()
    result, error = outcome[0]
    if error is not None:
        raise error
    return result


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
