"""How time and memory grow: with vertices, spheres, reflectance, tight targets; what new light costs. JSON and a table.

    python tests/benchmarks/scaling.py [OUTPUT.json]

Each case runs in its own process, for its peak memory; seconds are CPU seconds.
"""

import json
import resource
import subprocess
import sys
import time

import numpy as np
from output import machine, save
from rooms import load, vertices
from scenes import spheres_in_room, thirteen_spheres, walls

from pdm_core import Scene, Sphere, Surface, solve

VERTICES = (2000, 8000, 32000, 128000)
SPHERES, SPHERES_TARGET = (10, 30, 100, 300), 0.04
REFLECTANCE = (0.5, 0.9, 0.99, 0.999)
TARGET = 0.01
TIGHT = (0.001, 0.0004)  # the second needs more memory than there is
LIMIT = 600  # s of one case; what takes longer is said


def timed(scene, target):
    start = time.process_time()
    solution = solve(scene, target)
    return solution, {"cpu_seconds": time.process_time() - start, "stated": float(solution.error)}


def case_vertices(count):
    """Cornell's room: the solution, and its evaluation at so many vertices."""
    _, scene, front = load("cornell_spheres")
    solution, row = timed(scene, TARGET)
    start = time.process_time()
    exactly = sum(len(solution.radiance(s, points)) for s, points in vertices(scene, front, int(count)))
    seconds = time.process_time() - start
    return {**row, "vertices": exactly, "evaluate_seconds": seconds, "microseconds_a_vertex": 1e6 * seconds / exactly}


def case_spheres(count):
    solution, row = timed(spheres_in_room(int(count), (6.0, 5.0, 3.0), seed=7), SPHERES_TARGET)
    return {**row, "spheres": int(count), "nodes": solution.nodes}


def case_reflectance(rho):
    """A room with a ball, lit from one wall; and where every surface shines, the error against E / (1 - rho)."""
    rho, ball = float(rho), Sphere.at((2.0, 2.0, 1.0), 0.8)
    planes = [s.shape for s in walls((4.0, 5.0, 3.0), np.zeros((6, 3)))]
    lit = [Surface(shape, rho, float(k == 1)) for k, shape in enumerate([*planes, ball])]
    solution, row = timed(Scene(lit), TARGET)
    uniform = solve(Scene([Surface(shape, rho, 1.0) for shape in [*planes, ball]]), TARGET)
    points = np.random.default_rng(0).random((200, 3)) * [4, 5, 3]
    worst = max(np.abs(uniform.radiance(k, points) * (1 - rho) - 1).max() for k in range(7))
    return {**row, "reflectance": rho, "iterations": solution.counts["iterations"], "uniform_error": float(worst)}


def case_tight(target):
    """13 balls, as exactly as the memory allows."""
    solution, row = timed(thirteen_spheres(), float(target))
    return {**row, "target": float(target), "nodes": solution.nodes, "warnings": solution.warnings}


def case_relight(_):
    """Cornell's room with other colours: solved and evaluated again from what is known of its shapes."""
    _, scene, front = load("cornell_spheres")
    places = list(vertices(scene, front, 8000))
    start = time.process_time()
    solution = solve(scene, TARGET)
    for s, points in places:
        solution.radiance(s, points)
    first = time.process_time() - start
    other = Scene(tuple(Surface(s.shape, s.reflectance * [1, 0.7, 0.9], s.emission * [0.5, 1, 2], s.side, s.name)
                        for s in scene.surfaces))  # fmt: skip
    start = time.process_time()
    again = solution.relight(other)
    solved = time.process_time() - start
    for s, points in places:
        again.radiance(s, points)
    second = time.process_time() - start
    return {"first_seconds": first, "relight_solve_seconds": solved, "relight_seconds": second,
            "stated": float(again.error)}  # fmt: skip


CASES = {
    "vertices": (case_vertices, VERTICES),
    "spheres": (case_spheres, SPHERES),
    "reflectance": (case_reflectance, REFLECTANCE),
    "tight": (case_tight, TIGHT),
    "relight": (case_relight, (0,)),
}


def growth(rows, size):
    """Exponents of CPU time between neighbouring sizes, and the one fitted to all."""
    rows = [row for row in rows if "cpu_seconds" in row]
    x, y = (np.log([row[key] for row in rows]) for key in (size, "cpu_seconds"))
    return {"steps": (np.diff(y) / np.diff(x)).tolist(), "fitted": float(np.polyfit(x, y, 1)[0])}


def main(output="build/bench/scaling.json", *child):
    if child:
        row = CASES[child[0]][0](child[1])
        row["peak_megabytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
        print(json.dumps(row))
        return
    found = {}
    for name, (_, sizes) in CASES.items():
        found[name] = []
        for size in sizes:
            words = [sys.executable, __file__, output, name, str(size)]
            try:
                text = subprocess.run(words, check=True, capture_output=True, timeout=LIMIT).stdout
                row = json.loads(text)
            except subprocess.TimeoutExpired:
                row = {name: size, "stopped_after_seconds": LIMIT}
            found[name].append(row)
            print(name, ", ".join(f"{k} {v:.4g}" if np.isscalar(v) else f"{k} {v}" for k, v in row.items()), flush=True)
    found["growth_with_spheres"] = growth(found["spheres"], "spheres")
    print("growth with spheres", found["growth_with_spheres"])
    save(output, {"about": machine(), **found})


if __name__ == "__main__":
    main(*sys.argv[1:])
