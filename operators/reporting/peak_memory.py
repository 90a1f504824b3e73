"""The most memory that a process held since it was last asked to count anew."""

from pathlib import Path


def count_anew(process="self"):
    """From now on. Linux alone does so: elsewhere nothing is told of one run of many, see peak_megabytes."""
    counter = Path("/proc", str(process), "clear_refs")
    if counter.exists():
        counter.write_text("5")  # man 5 proc: the high-water mark of resident memory, and nothing else


def peak_megabytes(process="self"):
    """Resident MB (10^6 bytes), what the process held before included; None where the system cannot tell."""
    status = Path("/proc", str(process), "status")
    if not status.exists():
        return None
    marks = [line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM:")]
    return int(marks[0]) * 1024 / 1e6 if marks else None  # a process that has just ended has none
