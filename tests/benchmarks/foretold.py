"""Are seconds foretold? Random rooms solved to 1 %, then to .5 and .25 %: foretold against needed seconds.

    python tests/benchmarks/foretold.py [OUTPUT.json [ROOMS]]

What is foretold comes from the history of the solution at 1 % alone, see pdm_core/foretell.py. Compared are CPU seconds
on one thread (OPENBLAS_NUM_THREADS=1): what else runs on the machine meanwhile is not what is foretold.
"""

import sys
import time

import numpy as np
from output import machine, save
from truth import random_room

from pdm_core import solve
from pdm_core.foretell import seconds_to

FIRST, TARGETS = 0.01, (0.005, 0.0025)
FACTOR = 2.0


def run(seed):
    scene = random_room(seed)
    first, share = solved(scene, FIRST)
    row = {"seed": seed, "history": first.history, "targets": []}
    for target in TARGETS:
        start = time.process_time()
        solution, _ = solved(scene, target)
        entry = {"target": target, "foretold": share * seconds_to(first.history, target)}
        row["targets"].append({**entry, "needed": time.process_time() - start, "stated": float(solution.error)})
    return row


def solved(scene, target):
    """The Solution, and the CPU seconds of each second that it took."""
    wall, cpu = time.perf_counter(), time.process_time()
    solution = solve(scene, target)
    return solution, (time.process_time() - cpu) / (time.perf_counter() - wall)


def main(output="build/bench/foretold.json", rooms="100"):
    rows = []
    for seed in range(int(rooms)):
        rows.append(run(seed))
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
    for k, target in enumerate(TARGETS):
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
