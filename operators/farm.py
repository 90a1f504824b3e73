"""`--command pdm bake --files ...`: one Blender a file, several at a time; what is done is not done again.

Every file's results are written under other names and renamed when whole, the report last: a report tells that its file
is done, from which bytes and with which options. Whatever kills the run, the next one goes on where it ended.
"""

import hashlib
import json
import os
import subprocess
import sys
import time
from collections import namedtuple
from pathlib import Path

import bpy

from ..pdm_core.signs_of_life import TICK
from .baking.report import counted, percent, version
from .told_to_end import told_to_end
from .whole_file import whole_file

Task = namedtuple("Task", "source blend report log")
STATES = DONE, SKIPPED, FAILED, STOPPED = "done", "skipped", "failed", "stopped"
SUMMARY = "summary.json"


def run(files, folder, words, processes):
    """Bakes every file into `folder`; `words`: the other options of `pdm bake`. Returns the summary, which is written
    there too: {files [{file, state, seconds, error, between_vertices, warnings, message}], done, skipped, failed,
    stopped, seconds}."""
    asked = []
    # to end between two files' steps, lest one is begun or done and not in the summary
    with told_to_end(lambda *_: asked.append(True)):
        return _run(_tasks(files, folder), folder, words, processes, asked)


def _run(waiting, folder, words, processes, asked):
    start, rows, running = time.perf_counter(), {}, {}
    try:
        while waiting or running:
            if asked:
                raise KeyboardInterrupt
            while waiting and len(running) < processes:
                task = waiting.pop(0)
                if problem := _problem(task):
                    rows[task.source] = _tell(task, FAILED, message=problem)
                elif _is_done(task, key := _key(task, words)):
                    rows[task.source] = _tell(task, SKIPPED, _read(task.report))
                else:
                    running[task] = _start(task, words, processes), key, time.perf_counter()
            for task, (process, key, begun) in list(running.items()):
                if process.poll() is not None:
                    del running[task]
                    rows[task.source] = _end(task, process.returncode, key, time.perf_counter() - begun)
            if running:
                time.sleep(TICK)
    finally:
        for process, _, _ in running.values():
            process.terminate()
        for task, (process, _, _) in running.items():
            process.wait()
            _clean(task)
        for task in [*running, *waiting]:
            rows[task.source] = {"file": str(task.source), "state": STOPPED}
        summary = {"files": [rows[path] for path in rows]}
        summary |= {
            state: sum(row["state"] == state for row in rows.values()) for state in (DONE, SKIPPED, FAILED, STOPPED)
        }
        summary["seconds"] = time.perf_counter() - start
        _write(Path(folder, SUMMARY), summary)
    return summary


def one_line(summary):
    parts = [f"{summary[state]} {state}" for state in STATES if summary[state]]
    return f"{counted(len(summary['files']), 'file')}: {', '.join(parts)}; {summary['seconds']:.1f} s"


def clash(files):
    """Two files whose results would have one name, or None."""
    names = {}
    for path in map(Path, files):
        other = names.setdefault(path.stem.casefold(), path)
        if other != path:
            return other, path
    return None


def _tasks(files, folder):
    """A Task for each file, in order, none twice."""
    found = {}
    for path in (Path(name).absolute() for name in files):
        base = Path(folder).absolute() / path.stem
        found[path] = Task(path, *(base.with_name(f"{path.stem}{end}") for end in (".blend", ".json", ".log")))
    return list(found.values())


def _problem(task):
    if not task.source.is_file():
        return "there is no such file"
    if task.blend.exists() and task.blend.samefile(task.source):
        return "its result would replace it; choose another folder"
    if task.report.name == SUMMARY:
        return f"its report would have the summary's name, {SUMMARY}; rename it"
    return None


def _key(task, words):
    """What the result depends on."""
    with open(task.source, "rb") as file:
        digest = hashlib.file_digest(file, "sha256")
    versions = {"extension": version(), "blender": bpy.app.version_string}
    return {"sha256": digest.hexdigest(), "options": list(words), "versions": versions}


def _is_done(task, key):
    report = _read(task.report)
    return task.blend.is_file() and report is not None and report.get("job") == key


def _read(path):
    """A report, or None where there is no whole one."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _part(path):
    return path.with_name(f"{path.stem}.part{path.suffix}")


def _start(task, words, processes):
    _clean(task)
    outputs = ["--output", str(_part(task.blend)), "--report", str(_part(task.report))]
    environment = dict(os.environ)
    if processes > 1:  # several at a time: one thread each for numpy
        environment.setdefault("OPENBLAS_NUM_THREADS", "1")
    with open(task.log, "w", encoding="utf-8") as log:
        return subprocess.Popen(
            [*_blender(task.source), "bake", *words, *outputs], stdout=log, stderr=subprocess.STDOUT, env=environment
        )


def _blender(source):
    """The words before those of `pdm` that work on a file in another Blender."""
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "-b", str(source), "--command", "pdm"]
    # the bpy wheel has no such option: open the file and call what the option would
    package = __package__.rpartition(".")[0]
    return [sys.executable, str(Path(__file__).with_name("farm_child.py")), str(source), package]


def _end(task, code, key, seconds):
    """Results take their names; the row of the summary."""
    report = _read(_part(task.report))
    if code != 0 or report is None:
        message = _last_words(task.log) if code >= 0 else f"it was ended by signal {-code}"
        _clean(task, keep_log=True)
        return _tell(task, FAILED, seconds=seconds, message=message or f"Blender ended with {code}")
    os.replace(_part(task.blend), task.blend)
    _write(task.report, {**report, "job": key})  # last: it tells that all is there
    _clean(task)
    return _tell(task, DONE, report, seconds)


def _last_words(log):
    lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    errors = [line.partition("pdm: error: ")[2] for line in lines if "pdm: error: " in line]
    return (errors or lines or [""])[-1]


def _clean(task, keep_log=False):
    for path in (_part(task.blend), _part(task.report), *([] if keep_log else [task.log])):
        path.unlink(missing_ok=True)


def _write(path, value):
    with whole_file(path) as part:
        Path(part).write_text(json.dumps(value, indent=1, allow_nan=False), encoding="utf-8")


def _tell(task, state, report=None, seconds=0.0, message=""):
    """The row of a file, also said on stderr."""
    row = {"file": str(task.source), "state": state, "seconds": seconds, "message": message}
    if report:
        row |= {name: report[name] for name in ("error", "between_vertices")} | {"warnings": len(report["warnings"])}
    text = message or (f"error {percent(row['error'])}" if report else "")
    print(f"pdm: {task.source.name} {state}: {text}", file=sys.stderr, flush=True)
    return row
