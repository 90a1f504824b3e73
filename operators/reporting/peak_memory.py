"""The most memory that a run of many took of a process: above what that held as the run began."""

import ctypes
from pathlib import Path

STATUS = Path("/proc/self/status")


def count_anew():
    """From now on -> resident MB (10^6 bytes) now, for `added_megabytes`; None where the system cannot tell, as Linux
    alone does."""
    counter = STATUS.with_name("clear_refs")
    if not counter.exists():
        return None
    # what earlier runs freed is handed back first: taken again, it would not count
    getattr(ctypes.CDLL(None), "malloc_trim", int)(0)
    counter.write_text("5")  # man 5 proc: the high-water mark of resident memory, and nothing else
    return _megabytes("VmRSS:")


def added_megabytes(held):
    """MB at the most since count_anew returned `held`, above that; None where that is None."""
    return None if held is None else max(_megabytes("VmHWM:") - held, 0.0)


def _megabytes(mark):
    found = [line.split()[1] for line in STATUS.read_text().splitlines() if line.startswith(mark)]
    return int(found[0]) * 1024 / 1e6
