"""How often the add-on's functions are called: what work takes, whatever the machine."""

import sys
import threading
from collections import Counter
from contextlib import contextmanager

from conftest import MODULE


@contextmanager
def calls():
    """Counter {"operators.live.relight": times} of what is called meanwhile; each resumption of a generator is one."""
    counted = Counter()

    def note(frame, event, _):
        name = frame.f_globals.get("__name__") or ""
        if event == "call" and name.startswith(MODULE):
            counted[f"{name[len(MODULE) + 1 :]}.{frame.f_code.co_qualname}"] += 1

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        yield counted
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
