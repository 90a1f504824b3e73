"""Interpreters that the tests need: found among what is installed, with their packages in build/venv."""

import glob
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build"
TESTS = ["pytest", "hypothesis"]
CORE = {"core-numpy-1.26": ("3.11", ["numpy==1.26.*", *TESTS]), "core-numpy-newest": ("3.13", ["numpy", *TESTS])}
BLENDER = {  # each wheel fits one Python
    "blender-4.2": ("3.11", ["bpy==4.2.*", *TESTS]),
    "blender-4.5": ("3.11", ["bpy==4.5.*", *TESTS]),
    "blender-5.2": ("3.13", ["bpy==5.2.*", *TESTS]),
}
FARM = {"farm": ("3.13", ["openjd-cli", "mini-racer", "pytest"])}  # beside the last of these


class MissingPython(Exception):
    """The Python of that version was not found."""


def find_python(version):
    """The path of a working interpreter of `version` ("3.11"), or None."""
    for candidate in [f"python{version}", "python3", "python", *managed_pythons(version), sys.executable]:
        try:
            # a version manager's shim may stand on PATH and only say "not found"; venv may be packaged apart
            asked = "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2]); print(sys.executable)"
            found = subprocess.run([candidate, "-c", asked], capture_output=True, text=True)
        except OSError:
            continue
        answer = found.stdout.split("\n")
        if found.returncode == 0 and answer[0] == version:
            return answer[1]
    return None


def managed_pythons(version):
    """Interpreters of `version` that pyenv has installed, whether or not its shims may start them here."""
    roots = [os.environ.get("PYENV_ROOT"), str(Path.home() / ".pyenv")]
    shim = shutil.which(f"python{version}")
    if shim and Path(shim).parent.name == "shims":
        roots.append(str(Path(shim).parents[1]))
    patterns = [f"{glob.escape(root)}/versions/{version}.*/bin/python" for root in roots if root]
    return [path for pattern in patterns for path in sorted(glob.glob(pattern), reverse=True)]


def venv(name, version, packages):
    """The interpreter of build/venv/`name` with `packages`, made anew if they changed."""
    folder = BUILD / "venv" / name
    stamp = folder / "packages.txt"
    python = folder / "bin" / "python"
    wanted = f"{version} {' '.join(packages)}\n"
    if stamp.is_file() and stamp.read_text() == wanted:
        return str(python)
    base = find_python(version)
    if base is None:
        raise MissingPython(version)
    shutil.rmtree(folder, ignore_errors=True)
    print(f"making {folder.relative_to(ROOT)}: Python {version}, {', '.join(packages)}", flush=True)
    subprocess.run([base, "-m", "venv", str(folder)], check=True)
    subprocess.run([str(python), "-m", "pip", "install", "--quiet", *packages], check=True)
    stamp.write_text(wanted)
    return str(python)


def first_blender():
    """(name, python) of the oldest Blender whose Python is here: newer ones read what it writes."""
    for name, (version, packages) in BLENDER.items():
        try:
            return name, venv(name, version, packages)
        except MissingPython:
            continue
    raise MissingPython(" or ".join(sorted({version for version, _ in BLENDER.values()})))
