"""Whole Blender scenes at random: primitives scaled, mirrored, turned, parented, touching, coincident, crossing.

    python tests/stability/fuzz_blender.py [SCENES [FIRST SEED]]

Two of three are furnaces: every material emits what it does not reflect and the world's light is 1, so that all
radiance is 1. The others have lamps: there colours need only be finite and not negative. A scene fails if a bake ends
in anything but an error of its own words, changes anything but its colours, or is further off than what is stated.
"""

import os
import subprocess
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "blender")]

TARGET, SECONDS = 0.05, 30.0
TOUCHING = 1e-5  # of a scene's size: vertices so near another object lie against it, or within it by rounding
ROUNDED = 2e-4  # of colours, kept as single precision, and of walls whose corners are


def inside(scenes, first):
    """Within a Blender that has the add-on."""
    import bpy
    import conftest
    from blender_scenes import furnace_error, made_up, state

    conftest.install()
    failed, found, began = 0, Counter(), time.process_time()
    for seed in range(first, first + scenes):
        bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
        furnace = bool(seed % 3)
        made_up(seed, furnace)
        before = state()
        try:
            bpy.ops.pdm.bake(target_error=TARGET, time_limit=SECONDS)
        except RuntimeError as error:
            found["out of time" if "time_limit" in str(error) else "refused"] += 1
            print(f"seed {seed}: {error}", flush=True)
            problem = "changed" if state() != before else ""
        except Exception:
            problem = traceback.format_exc(limit=-2)
        else:
            report = bpy.context.scene.pdm_radiosity.report()
            found["left out"] += bool(report["refused"])
            found["above the target"] += report["error"] is None or report["error"] > TARGET
            problem = "changed" if state() != before else furnace_error(report, furnace, TOUCHING, ROUNDED)
        if problem:
            failed += 1
            print(f"seed {seed}: {problem}", flush=True)
    took = time.process_time() - began
    print(f"{scenes} Blender scenes from seed {first}: {failed} failed; {dict(found)}, {took:.0f} s", flush=True)
    bpy.ops.preferences.addon_disable(module=conftest.MODULE)
    os._exit(int(failed > 0))


def main(scenes="1000", first="0"):
    """Starts a Blender of a fresh configuration: the first found, or of the interpreter BLENDER_PYTHON."""
    import run

    python = os.environ.get("BLENDER_PYTHON") or run.first_blender()[1]
    with run.fresh_blender(run.build_zip()) as environment:
        words = [python, __file__, "inside", scenes, first]
        return subprocess.run(words, env={**environment, "OPENBLAS_NUM_THREADS": "1"}).returncode


if __name__ == "__main__":
    if sys.argv[1:2] == ["inside"]:
        inside(int(sys.argv[2]), int(sys.argv[3]))
    sys.exit(main(*sys.argv[1:]))
