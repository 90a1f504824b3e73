"""Are seconds foretold? Random rooms solved to a first target, then to tighter ones: foretold against needed seconds.

    python tests/benchmarks/foretold.py [OUTPUT.json [ROOMS [WAY]]]

WAY `links` (the default): rooms of few shapes at 1 %, then .5 and .25 %; `boxes` and `rays`: scenes of 3 to 24 boxes
and balls, and of 20 to 100 shapes of all kinds, by rays at 4 %, then 2 and 1 %. What is foretold comes from the first
solution alone, see `seconds_to` in pdm_core/foretell.py and pdm_core/rays/solution.py. Compared are CPU seconds on one
thread (OPENBLAS_NUM_THREADS=1): what else runs on the machine meanwhile is not what is foretold.
"""

import sys
import time

import numpy as np
from output import machine, save
from random_scenes import boxes_and_balls, random_scene
from truth import random_room

from pdm_core import solve
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

TARGETS = {"links": (0.01, 0.005, 0.0025), "boxes": (0.04, 0.02, 0.01), "rays": (0.04, 0.02, 0.01)}
MAKE = {"links": random_room, "boxes": boxes_and_balls, "rays": lambda seed: random_scene(seed)[0]}
FACTOR = 2.0


def run(seed, way):
    scene = MAKE[way](seed)
    first, share = solved(scene, TARGETS[way][0], way)
    row = {"seed": seed, "history": first.history, "targets": []}
    for target in TARGETS[way][1:]:
        start = time.process_time()
        solution, _ = solved(scene, target, way)
        entry = {"target": target, "foretold": share * first.seconds_to(target)}
        row["targets"].append({**entry, "needed": time.process_time() - start, "stated": float(solution.error)})
    return row


def solved(scene, target, way):
    """The Solution, and the CPU seconds of each second that it took."""
    wall, cpu = time.perf_counter(), time.process_time()
    solution = solve(scene, target) if way == "links" else finish(ray_steps(scene, target, None, "asked for"))
    return solution, (time.process_time() - cpu) / (time.perf_counter() - wall)


def main(output="build/bench/foretold.json", rooms="100", way="links"):
    rows = []
    for seed in range(int(rooms)):
        rows.append(run(seed, way))
        save(output, {"about": machine(), "summary": summary(rows), "rows": rows})
        told = "  ".join(
            f"{t['target']:.2%}: {t['foretold']:5.1f} s foretold, {t['needed']:5.1f} needed"
            for t in rows[-1]["targets"]
        )
        print(f"{seed:3}  {told}", flush=True)
    print(summary(rows))


def summary(rows):
    """Of foretold over needed seconds, for each target: {target: {...}}."""
    told = {}
    for k, target in enumerate(row["target"] for row in rows[0]["targets"]):
        ratio = np.array([row["targets"][k]["foretold"] / row["targets"][k]["needed"] for row in rows])
        told[str(target)] = {
            "rooms": len(rows),
            "within_factor_2": float(np.mean((ratio < FACTOR) & (ratio > 1 / FACTOR))),
            "median": float(np.median(ratio)),
            "percentiles_10_90": np.percentile(ratio, [10, 90]).tolist(),
        }
    return told


if __name__ == "__main__":
    main(*sys.argv[1:])
