"""The most memory that a run of many took of a process: above what that held as the run began."""

import ctypes
from pathlib import Path


def count_anew(process="self"):
    """From now on -> resident MB (10^6 bytes) now, for `added_megabytes`; None where the system cannot tell, as Linux
    alone does."""
    counter = Path("/proc", str(process), "clear_refs")
    if not counter.exists():
        return None
    # what earlier runs freed is handed back first: taken again, it would not count
    getattr(ctypes.CDLL(None), "malloc_trim", int)(0)
    counter.write_text("5")  # man 5 proc: the high-water mark of resident memory, and nothing else
    return _megabytes(process, "VmRSS:")


def added_megabytes(held, process="self"):
    """MB at the most since count_anew returned `held`, above that; None where that is None."""
    most = None if held is None else _megabytes(process, "VmHWM:")
    return None if most is None else max(most - held, 0.0)


def _megabytes(process, mark):
    lines = Path("/proc", str(process), "status").read_text().splitlines()
    found = [line.split()[1] for line in lines if line.startswith(mark)]
    return int(found[0]) * 1024 / 1e6 if found else None  # a process that has just ended has none
