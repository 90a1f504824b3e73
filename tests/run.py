"""What the Makefile calls: builds the zip, runs tests and demo.

    python tests/run.py test | test-window | zip | demo | bench | report | stability | lint

Runs on any Python 3.8 or newer. A Python that is missing is said loudly and its tests count as skipped; with CI=true
in the environment they count as failed.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pythons import BLENDER, BUILD, CORE, FARM, ROOT, MissingPython, find_python, first_blender, venv

WINDOW = {  # scripts, and the screens they need
    "states": "1600x900",
    "running": "1600x900",
    "redo": "1600x900",
    "pressed": "1600x1800",
    "looks": "1600x1800",
}
SUITE_SECONDS = 1800  # a Blender that hangs at exit must not hang the run


def main(words):
    command = words[0] if len(words) == 1 else None
    commands = {
        "test": test,
        "test-window": test_window,
        "zip": make_zip,
        "demo": demo,
        "bench": bench,
        "stability": stability,
        "lint": lint,
        "report": report,
    }
    if command not in commands:
        print(__doc__)
        return 2
    BUILD.mkdir(exist_ok=True)
    try:
        return commands[command]()
    except MissingPython as missing:
        print(f"Python {missing} was not found; install it", file=sys.stderr)
        return 1


def test():
    """Every suite, as many at once as there are cores, two at most; the last line is the totals alone."""
    totals = dict.fromkeys(("passed", "failed", "skipped"), 0)
    try:
        package = build_zip()
    except MissingPython as missing:
        package = None
        add(totals, {say_missing("the Blender suites", missing): len(BLENDER) + len(FARM)})
    suites = [*CORE, *(BLENDER if package else ())]
    with ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as pool:
        for counts in pool.map(lambda name: run_alone(name, package), suites):
            add(totals, counts)
    for name in FARM if package else ():  # in the last Blender's environment, which is there by now
        suites.append(name)
        add(totals, run_alone(name, package))
    print_failures(suites)
    print("\n{passed} passed, {failed} failed, {skipped} skipped".format(**totals))
    return 1 if totals["failed"] or not totals["passed"] else 0


def run_alone(name, package):
    """One suite, on one thread, as another has the other core; what it says is printed at its end."""
    with fresh_blender(package) as environment, open(BUILD / f"test-{name}.log", "w+", encoding="utf-8") as log:
        folder = "tests/core" if name in CORE else "tests/farm" if name in FARM else "tests/blender"
        environment["OPENBLAS_NUM_THREADS"] = "1"
        if name in FARM:
            with contextlib.suppress(MissingPython):  # which it needs too
                blender = list(BLENDER)[-1]
                environment["PDM_PYTHON"] = venv(blender, *BLENDER[blender])
        counts = run_suite(name, [folder], environment, log)
        log.seek(0)
        print(f"\n--- {name}\n{log.read()}", flush=True)
    return counts


def test_window():
    """Scripts in a Blender with a window, pictures of which go to build/window: of BLENDER, or of each system in the
    folders that WINDOW_ROOTS lists (see tests/window/shot.sh)."""
    package, failed = build_zip(), []
    for root in os.environ.get("WINDOW_ROOTS", "").split(os.pathsep):
        for name, size in WINDOW.items():
            picture = BUILD / "window" / (Path(root).name or "blender") / f"{name}.png"
            print(f"\n=== {picture.relative_to(ROOT)}", flush=True)
            words = ["bash", "tests/window/shot.sh", str(package), f"tests/window/{name}.py", str(picture)]
            environment = {**os.environ, "SHOT_SIZE": size, "BLENDER_ROOT": root}
            failed += [name] * (subprocess.run(words, cwd=ROOT, env=environment).returncode != 0)
    print(f"\n{len(failed)} failed {' '.join(failed)}")
    return 1 if failed else 0


def make_zip():
    print(build_zip())
    return 0


def demo():
    """The demo scenes through the installed zip."""
    python = first_blender()[1]
    with fresh_blender(build_zip()) as environment:
        return subprocess.run([python, "tests/demo/bake_rooms.py"], cwd=ROOT, env=environment).returncode


def stability():
    """Half an hour of stiff, extreme and everyday scenes; writes docs/stability.md."""
    return subprocess.run(
        [venv("bench", "3.13", ["numpy", "matplotlib"]), "tests/stability/run.py"], cwd=ROOT
    ).returncode


def bench():
    """Every benchmark, on one thread so that CPU seconds compare; some 80 minutes. Output in docs/benchmarks."""
    python = venv("bench", "3.13", ["numpy", "matplotlib"])
    blender = venv("blender-5.2", *BLENDER["blender-5.2"])
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    runs = [
        [python, "rooms.py", "rooms.json", "../error_time.png"],
        [python, "scaling.py", "scaling.json"],
        [python, "form_factors.py", "form_factors.json"],
        [blender, "beside_cycles.py", "beside_cycles.json"],
        [blender, "lights.py", "lights.json"],
        [blender, "lights_shaded.py", "lights_shaded.json"],
        [blender, "relight.py", "relight.json"],
        [blender, "subdivision.py", "subdivision.json"],
        [python, "polygons_and_meshes.py", "polygons_and_meshes.json"],
        [blender, "modifiers.py", "modifiers.json"],
        [blender, "reading.py", "reading.json"],
        [python, "truth.py", "truth.json"],
        [python, "placements.py", "placements.json"],
        [python, "each_object.py", "each_object.json"],
        [python, "many_shapes.py", "many_shapes.json"],
        [python, "links_or_rays.py", "links_or_rays.json"],
        [python, "paper.py", "paper.json", "../paper.md"],
        [python, "foretold.py", "foretold.json"],
        [python, "tables.py"],
    ]
    code = 0
    for interpreter, script, *outputs in runs:
        print(f"\n=== {script}", flush=True)
        words = [interpreter, f"tests/benchmarks/{script}", *(f"docs/benchmarks/{name}" for name in outputs)]
        code = subprocess.run(words, cwd=ROOT, env=environment).returncode or code
    return code


def report():
    """Error against run time: of the report's scenes by the installed zip, docs/results; the README's plot of the
    classic rooms, and its tables from docs/benchmarks. Some 12 minutes."""
    python, plain = venv("blender-5.2", *BLENDER["blender-5.2"]), venv("bench", "3.13", ["numpy", "matplotlib"])
    runs = [
        [python, "results.py", "docs/results"],
        [plain, "rooms.py", "docs/benchmarks/rooms.json", "docs/error_time.png"],
        [plain, "tables.py"],
    ]
    code = 0
    with fresh_blender(build_zip()) as environment:
        for interpreter, script, *outputs in runs:
            words = [interpreter, f"tests/benchmarks/{script}", *outputs]
            code = subprocess.run(words, cwd=ROOT, env={**environment, "OPENBLAS_NUM_THREADS": "1"}).returncode or code
    return code


def lint():
    python = venv("lint", "3.13", ["ruff"]) if find_python("3.13") else venv("lint", "3.11", ["ruff"])
    return subprocess.run([python, "-m", "ruff", "check", "."], cwd=ROOT).returncode


def build_zip():
    """Builds and validates the extension with Blender's own tool; returns the zip's path."""
    python = first_blender()[1]
    tool = next(Path(python).parents[1].glob("lib/**/blender_ext.py"))
    folder = BUILD / "zip"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    run_tool = [python, str(tool)]
    subprocess.run([*run_tool, "build", "--source-dir", str(ROOT), "--output-dir", str(folder)], check=True)
    (package,) = folder.glob("*.zip")
    subprocess.run([*run_tool, "validate", str(package)], check=True)
    return package


@contextlib.contextmanager
def fresh_blender(package):
    """An environment whose Blender has no configuration yet, and where tests find the zip."""
    with tempfile.TemporaryDirectory() as folder:
        yield {**os.environ, "BLENDER_USER_RESOURCES": folder, "PDM_ZIP": str(package)}


def run_suite(name, paths, environment, log=None):
    """Runs pytest in the suite's own interpreter and process, its output into `log`, if that is given; returns
    {"passed": n, "failed": n, "skipped": n}."""
    version, packages = {**CORE, **BLENDER, **FARM}[name]
    try:
        python = venv(name, version, packages)
    except MissingPython as missing:
        return {say_missing(name, missing): 1}
    print(f"\n=== {name}, Python {version}", flush=True)
    result = BUILD / f"test-{name}.xml"
    result.unlink(missing_ok=True)
    words = [python, "-m", "pytest", "-q", "-c", "tests/pytest.ini", f"--junitxml={result}", *paths]
    try:
        run = subprocess.run(
            words, cwd=ROOT, env=environment, timeout=SUITE_SECONDS, stdout=log, stderr=log and subprocess.STDOUT
        )
        code = run.returncode
    except subprocess.TimeoutExpired:
        code = "timeout"
    counts = read_counts(result) if result.is_file() else {"passed": 0, "failed": 0, "skipped": 0}
    if code != 0 and not counts["failed"]:
        print(f"!!! {name} ended with {code} although no test failed", flush=True)
        counts["failed"] = 1
    return counts


def read_counts(path):
    suites = [suite.attrib for suite in ElementTree.parse(path).iter("testsuite")]
    tests, failures, errors, skipped = (
        sum(int(s[key]) for s in suites) for key in ("tests", "failures", "errors", "skipped")
    )
    failed = failures + errors
    return {"passed": tests - failed - skipped, "failed": failed, "skipped": skipped}


def print_failures(suites):
    """What failed and why, once more, where the end of a long log is all that one sees."""
    for name in suites:
        path = BUILD / f"test-{name}.xml"
        for case in ElementTree.parse(path).iter("testcase") if path.is_file() else ():
            for problem in (*case.iter("failure"), *case.iter("error")):
                said = " ".join(problem.get("message", "").split())[:300]
                print(f"\nFAILED {name}: {case.get('classname')}::{case.get('name')}: {said}", flush=True)


def say_missing(what, version):
    """Says it and returns what it counts as."""
    counts_as = "failed" if os.environ.get("CI") == "true" else "skipped"
    print(f"\n!!! Python {version} was not found: {what} cannot run and counts as {counts_as}", flush=True)
    return counts_as


def add(totals, counts):
    for key, number in counts.items():
        totals[key] += number


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
