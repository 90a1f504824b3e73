"""CPU time to our measured error, by rays and by Cycles' vertex bake of the same vertices, in the same run.

    PYTHON_WITH_BPY tests/benchmarks/rays_beside_cycles.py [OUTPUT.json [VERTICES]]

Ours: solving and reading all vertices; its error is what the references in tests/data tell, from an independent path
tracer. Cycles' error is its noise alone, from two seeds (what its triangles and vertices are off comes on top), fitted
as in beside_cycles.py; its CPU seconds are those to as much noise as ours is off.
"""

import sys
import time

import bpy
import numpy as np
from beside_cycles import bake, build, norm, settings
from output import ROOT, machine, save

from pdm_core import solve

sys.path.insert(0, str(ROOT / "tests" / "core"))
import references  # noqa: E402

ROOMS = "furnished_room", "knot_room"
TARGETS = 0.04, 0.02, 0.01
SAMPLES = (4, 16, 64, 256)  # of few the time is hardly more than that of the set-up


def sky(scene):
    """The world of the scene's background."""
    world = bpy.data.worlds.new("Sky")
    if not world.node_tree:
        world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    strongest = max(float(np.max(scene.background)), 1e-30)
    background.inputs["Color"].default_value = (*(scene.background / strongest), 1.0)
    background.inputs["Strength"].default_value = strongest if np.any(scene.background) else 0.0
    bpy.context.scene.world = world


def cycles(scene, made):
    """[{samples, noise, cpu_seconds}]"""
    rows = []
    for samples in SAMPLES:
        (one, cpu), (other, again) = bake(made, samples, 1), bake(made, samples, 2)
        size = norm(scene, made, [(a + b) / 2 for a, b in zip(one, other)])
        noise = norm(scene, made, [a - b for a, b in zip(one, other)]) / np.sqrt(2) / size
        rows.append({"samples": samples, "noise": noise, "cpu_seconds": (cpu + again) / 2})
    return rows


def seconds_to(rows, level):
    """CPU seconds that Cycles takes to so much noise."""
    samples, noise, cpu = (np.array([row[key] for row in rows]) for key in ("samples", "noise", "cpu_seconds"))
    scale = float(np.exp(np.mean(np.log(noise**2 * samples))))
    each, start = np.polyfit(samples, cpu, 1, w=1 / cpu)
    return float(max(start, 0.0) + each * scale / level**2)


def main(output="build/bench/rays_beside_cycles.json", vertices="4000"):
    rows = []
    for name in ROOMS:
        reference, scene, front = references.load(name)
        made = build(scene, front, int(vertices))
        settings()
        sky(scene)
        theirs = cycles(scene, made)
        surface = np.concatenate([np.full(len(points), k) for k, _, points in made])
        points = np.concatenate([points for *_, points in made])
        for target in TARGETS:
            start = time.process_time()
            solution = solve(scene, target)
            solved = time.process_time() - start
            solution.incident(surface, points)
            spent = time.process_time() - start
            row = {"scene": name, "vertices": len(points), "target": target, "stated": float(solution.error)}
            row["measured"] = references.measured(reference, scene, front, solution)
            row |= {"solving": solved, "cpu_seconds": spent, "cycles": theirs}
            row["cycles_seconds"] = seconds_to(theirs, row["measured"])
            row["ratio"] = row["cycles_seconds"] / spent
            rows.append(row)
            print({k: v for k, v in row.items() if k != "cycles"}, flush=True)
            save(output, {"about": {**machine(), "blender": bpy.app.version_string}, "rows": rows})


if __name__ == "__main__":
    main(*sys.argv[1:])
