"""Is the stated error true? Random rooms at a target of 1 % against runs at a quarter of it: JSON and a table.

    python tests/benchmarks/truth.py [OUTPUT.json [ROOMS [PROCESSES]]]

Rooms have coloured walls, a lamp (a sphere, or a square below the ceiling), up to two screens that stand free and up
to 12 spheres, many on the floor; reflectances reach .95. Errors are relative L2 errors of L - Le over all surfaces.
"""

import sys
import time
from multiprocessing import Pool

import numpy as np
from output import machine, save
from scenes import difference, separate, walls

from pdm_core import Plane, Scene, Sphere, Surface, solve

TARGET, TIGHTER = 0.01, 4.0
TRIES = 50


def random_room(seed):
    rng = np.random.default_rng(seed)
    size = rng.uniform(2, 6, 3)
    brightest = rng.uniform(0.3, 0.95)
    surfaces = walls(size, rng.uniform(0.1, brightest, (6, 3)))
    lamp, placed = random_lamp(rng, size)
    surfaces += lamp
    for _ in range(rng.integers(0, 3)):
        surfaces += random_screen(rng, size, placed)
    for _ in range(rng.integers(0, 13)):
        surfaces += random_ball(rng, size, placed)
    return Scene(surfaces)


def random_lamp(rng, size):
    """Surfaces of a lamp and [(centre, radius)] of a sphere around it."""
    emission = rng.uniform(1, 10)
    if rng.random() < 0.5:
        radius = rng.uniform(0.1, 0.35)
        centre = np.clip(rng.random(3) * size, 1.05 * radius, size - 1.05 * radius)
        return [Surface(Sphere.at(centre, radius), 0.0, emission, name="lamp")], [(centre, radius)]
    width, depth = rng.uniform(0.2, 0.8, 2)
    centre = size * [0.5, 0.5, 1.0] - [0, 0, rng.uniform(0.02, 0.3)]
    plane = Plane(centre - [width / 2, depth / 2, 0], (0, depth, 0), (width, 0, 0))
    sides = [Surface(plane, 0.0, emission, name="lamp"), Surface(plane, 0.5, side="back", name="lamp (back)")]
    return sides, [(centre, 0.6 * np.hypot(width, depth))]


def random_screen(rng, size, placed):
    """Both sides of a rectangle somewhere free in the room, or nothing where there is no place for it."""
    for _ in range(TRIES):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        u, v = frame[0] * rng.uniform(0.3, 1), frame[1] * rng.uniform(0.3, 1)
        centre, radius = rng.random(3) * size, np.linalg.norm(u + v) / 2
        inside = (centre > radius).all() and (centre < size - radius).all()
        if inside and separate((centre, radius), placed):
            placed.append((centre, radius))
            plane, rho = Plane(centre - (u + v) / 2, u, v), rng.uniform(0.1, 0.9, 3)
            return [Surface(plane, rho, name="screen"), Surface(plane, rho, side="back", name="screen (back)")]
    return []


def random_ball(rng, size, placed):
    for _ in range(TRIES):
        radius = rng.uniform(0.08, 0.22) * size.min()
        centre = radius + rng.random(3) * (size - 2 * radius)
        if rng.random() < 0.4:
            centre[2] = radius  # it stands on the floor
        if separate((centre, radius), placed):
            placed.append((centre, radius))
            return [Surface(Sphere.at(centre, radius), rng.uniform(0.1, 0.95, 3), name="ball")]
    return []


def run(seed):
    scene = random_room(seed)
    cpu = time.process_time()
    solution = solve(scene, TARGET)
    cpu = time.process_time() - cpu
    tighter = solve(scene, TARGET / TIGHTER)
    return {
        "seed": seed,
        "surfaces": len(scene),
        "stated": float(solution.error),
        "measured": difference(scene, solution, tighter),
        "tighter_stated": float(tighter.error),
        "solve_cpu_seconds": cpu,
    }


def main(output="build/bench/truth.json", rooms="100", processes="1"):
    rows = []
    pool = Pool(int(processes))
    for row in pool.imap(run, range(int(rooms))):
        rows.append(row)
        seed = row["seed"]
        print(
            f"{seed:3}  {row['surfaces']:2} surfaces  stated {row['stated']:6.2%}  measured {row['measured']:6.2%}"
            f"  solve {row['solve_cpu_seconds']:5.2f} s CPU{'' if row['measured'] <= row['stated'] else '  BROKEN'}",
            flush=True,
        )
    ratio = np.array([row["stated"] / row["measured"] for row in rows])
    summary = {
        "rooms": len(rows),
        "true": int((ratio >= 1).sum()),
        "target_reached": sum(row["stated"] <= TARGET for row in rows),
        "median_stated_over_measured": float(np.median(ratio)),
        "least_stated_over_measured": float(ratio.min()),
        "median_cpu_seconds": float(np.median([row["solve_cpu_seconds"] for row in rows])),
    }
    print(summary)
    save(output, {"about": machine(), "summary": summary, "rows": rows})


if __name__ == "__main__":
    main(*sys.argv[1:])
