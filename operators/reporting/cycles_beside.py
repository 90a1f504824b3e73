"""Cycles' vertex bake of a copy of the scene, in a second Blender in the background: our scene is never touched."""

import os
import tempfile
from pathlib import Path

import bpy
import numpy as np

from ...pdm_core.read_off import materials_at
from ...pdm_core.signs_of_life import mapped
from ..baking.bake_points import bake_points, corners_of, means
from ..baking.colour_attribute import BakeError
from ..reading.second_blender import last_words, run_steps

SAMPLES = (1, 4, 16, 64, 256, 1024)
SCRIPT = Path(__file__).with_name("cycles_script.py")


def cycles_steps(context, reading, targets, seconds):
    """Generator of texts; returns runs [{setting, noise, seconds, cpu_seconds, peak_megabytes, values {name:
    (pairs, 3)}, sizes}].

    values: radiance at each (vertex, surface) pair, as bake_points orders them; noise: relative L2, from two seeds.
    Ends after so many seconds with what is done. BakeError where nothing is.
    """
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "copy.blend")
        bpy.ops.wm.save_as_mainfile(filepath=copy, copy=True, compress=False)
        log, words = os.path.join(folder, "log.txt"), [folder, ",".join(map(str, SAMPLES)), *(t.name for t in targets)]
        steps = run_steps(SCRIPT, words, log, seconds, [copy])
        yield from mapped(steps, lambda _: _said(_done(folder)))
        runs = [_run(path, count, reading, targets) for count, path in _done(folder).items()]
        if not runs:
            raise BakeError(f"no bake was done within {seconds:.0f} s ({last_words(log, 'no message')})")
        return runs


def _done(folder):
    """{samples: file} of the bakes that are done."""
    paths = {count: os.path.join(folder, f"{count}.npz") for count in SAMPLES}
    return {count: path for count, path in paths.items() if os.path.exists(path)}


def _said(done):
    return f"Cycles, {list(done)[-1]} samples done" if done else "Cycles, starting"


def _run(path, count, reading, targets):
    scene, sizes, values, noise, total = reading.scene, {}, {}, 0.0, 0.0
    with np.load(path) as data:
        (wall, cpu), peak = data["seconds"].tolist(), data["peak"]
        for k, target in enumerate(targets):
            pairs = bake_points(*corners_of(target), "CORNER")
            rho, emission = materials_at(scene, pairs.surfaces, pairs.points)
            size = len(pairs.points)
            one, other = (rho * means(pairs.scatter, data[f"{seed}:{k}"], size) for seed in (1, 2))
            noise, total = noise + ((one - other) ** 2).sum() / 2, total + ((one + other) ** 2).sum() / 4
            values[target.name], sizes[target.name] = emission + one, len(one)
    return {
        "setting": f"{count} samples", "noise": float(np.sqrt(noise / max(total, 1e-300))), "seconds": wall,
        "cpu_seconds": cpu, "peak_megabytes": float(peak) if np.isfinite(peak) else None, "nodes": None,
        "values": values, "sizes": sizes,
    }  # fmt: skip
