"""Long work on arrays as a generator: in a thread of its own, joined before the generator ends, however it ends."""

from threading import Thread

TICK = 0.05  # s between two signs of life


def in_thread(work, *arguments):
    """Yields every TICK s until work(*arguments), which touches nothing but arrays, is done; returns what it returns."""
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
