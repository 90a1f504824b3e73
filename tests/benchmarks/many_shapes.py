"""Scenes of many shapes, polygons and meshes by rays: CPU seconds, stated and measured errors, growth with number.

python tests/benchmarks/many_shapes.py docs/benchmarks/many_shapes.json
"""

import resource
import sys
import time

import output  # first: it finds the package

sys.path.insert(0, str(output.ROOT / "tests" / "core"))

import links_or_rays
import references
import scenes

from pdm_core import solve

LIMIT = 60.0  # s
GROWTH = (5, 15, 50, 150, 500, 1500)


def solved(scene, target):
    """The Solution, and a row of what it took."""
    signs = []
    start, wall = time.process_time(), time.perf_counter()
    solution = solve(scene, target, LIMIT, lambda *_: signs.append(time.perf_counter() - wall))
    seconds = time.process_time() - start
    gaps = [b - a for a, b in zip([0.0, *signs], signs)]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    row = {"shapes": len(scene.shapes), "target": target, "seconds": seconds, "stated": solution.error}
    row |= {"parts": solution.error_parts, "nodes": solution.nodes, "first_sign": signs[0], "longest_gap": max(gaps)}
    return solution, row | {"peak_megabytes_so_far": peak}


def main(path):
    rows = []
    data = {"machine": output.machine(), "rows": rows}

    def keep(name, row):
        rows.append({"scene": name, **row})
        print(rows[-1], flush=True)
        output.save(path, data)

    for count in GROWTH:
        keep(f"{count} boxes", solved(links_or_rays.boxes(count), 0.04)[1])
    for name in references.NAMES:
        reference, scene, front = references.load(name)
        for target in (0.04, 0.013, 0.01) if name == "knot_room" else (0.04, 0.01):
            solution, row = solved(scene, target)
            start = time.process_time()
            row["measured"] = references.measured(reference, scene, front, solution)
            row["points"], row["reading"] = len(reference["P"]), time.process_time() - start
            keep(name, row)
    for what, make in (("balls", scenes.spheres_in_room), ("floating boxes", scenes.boxes_in_room)):
        keep(f"300 {what} in a room", solved(make(300, (6.0, 5.0, 3.0), 7), 0.04)[1])


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "build/bench/many_shapes.json")
