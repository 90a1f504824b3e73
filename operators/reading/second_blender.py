"""A script run by a second Blender in the background: our own file is never touched."""

import subprocess
import sys
import time
from pathlib import Path

import bpy

from ...pdm_core.signs_of_life import TICK


def run_steps(script, words, log, seconds, files=()):
    """Generator that yields None while a second Blender runs a script with these words, on a file if one is given, for
    so many seconds at most; what it says goes to the file log. Closed, it ends that too."""
    end = time.perf_counter() + seconds
    with open(log, "w", encoding="utf-8") as said:
        process = subprocess.Popen(_command(script, words, files), stdout=said, stderr=subprocess.STDOUT)
    try:
        while process.poll() is None and time.perf_counter() < end:
            time.sleep(TICK)
            yield
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def _command(script, words, files):
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "-b", "--factory-startup", *files, "--python", str(script), "--", *words]
    return [sys.executable, str(script), "--", *words]  # the bpy wheel; a script opens its file itself


def last_words(log, none):
    """The last line of a log, or what is to be said where there is none."""
    lines = Path(log).read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return lines[-1] if lines else none
