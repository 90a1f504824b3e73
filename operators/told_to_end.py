"""Ctrl-C, and being told to end: Blender's own handler waits for an event loop that does not run in scripts."""

import signal
from contextlib import contextmanager


@contextmanager
def told_to_end(handler=signal.default_int_handler):
    """What handles both meanwhile; that of Python raises KeyboardInterrupt."""
    before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, own in before.items():
            signal.signal(number, own if own is not None else signal.SIG_DFL)
