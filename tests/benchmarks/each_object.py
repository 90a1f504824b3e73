"""Each object's own error: measured and stated, at 4 and 1 %, where dark objects stand beside bright ones.

    python tests/benchmarks/each_object.py [OUTPUT.json]

The classic rooms, a room split by a partition with light on one side, and a room lit through a hole in another's wall.
Errors are relative L2 errors of L - Le over one object's surfaces, against a run at TIGHT; stated ones are
Solution.surface_errors. Objects whose light is below a hundredth of the brightest one's count nothing. What it costs:
CPU seconds of solve, and of the same run that goes on for the whole scene's error only, in turns.
"""

import sys
import time

import numpy as np
from output import machine, save
from rooms import load
from scenes import points_over, thirteen_spheres, walls

from pdm_core import Plane, Scene, Sphere, Surface, each_surface, solve

TARGETS = (0.04, 0.01)
TIGHT, TIGHT_SECONDS = 0.0015, 30
OWN = each_surface.OWN
TURNS = 2
ON_EACH = 200  # points on each surface at least: contacts are small
GREY = np.full((6, 3), 0.7)


def two_sided(origin, u, v, reflectance, name):
    plane = Plane(origin, u, v)
    return [Surface(plane, reflectance, name=name), Surface(plane, reflectance, side="back", name=f"{name} (back)")]


def split_room():
    """4 x 3 x 2.5 m, a partition that ends .5 m below the ceiling, a lamp on one side, a ball on the other."""
    surfaces = walls((4.0, 3.0, 2.5), GREY)
    surfaces += two_sided((2.0, 0, 0), (0, 3.0, 0), (0, 0, 2.0), 0.6, "partition")
    surfaces.append(Surface(Sphere.at((1.0, 1.5, 1.2), 0.2), 0.0, 10.0, name="lamp"))
    surfaces.append(Surface(Sphere.at((3.0, 1.5, 0.4), 0.4), 0.6, name="ball"))
    return Scene(surfaces)


def lit_through_a_hole():
    """Two rooms of 3 x 3 x 2.5 m with a hole of .5 x .5 m in the wall between; a lamp in one, a ball in the other."""
    surfaces = walls((3.0, 3.0, 2.5), GREY)[:3] + walls((3.0, 3.0, 2.5), GREY)[3:5]
    other = [(s.shape.origin + [3.0, 0, 0], s.shape.u, s.shape.v) for s in walls((3.0, 3.0, 2.5), GREY)]
    surfaces += [Surface(Plane(*p), 0.7, name=f"far {k}") for k, p in enumerate(other) if k != 2]
    y, z = np.array([0, 1.0, 0]), np.array([0, 0, 1.0])
    for k, (a, b, c, d) in enumerate([(0, 3, 0, 1), (0, 3, 1.5, 2.5), (0, 1.25, 1, 1.5), (1.75, 3, 1, 1.5)]):
        surfaces += two_sided((3.0, a, c), (b - a) * y, (d - c) * z, 0.7, f"between {k}")
    surfaces.append(Surface(Sphere.at((1.0, 1.5, 1.9), 0.2), 0.0, 10.0, name="lamp"))
    surfaces.append(Surface(Sphere.at((4.5, 1.5, 0.4), 0.4), 0.6, name="ball"))
    return Scene(surfaces)


SCENES = {
    "seed_room": lambda: load("seed_room")[1],
    "cornell_spheres": lambda: load("cornell_spheres")[1],
    "thirteen_spheres": thirteen_spheres,
    "split_room": split_room,
    "lit_through_a_hole": lit_through_a_hole,
}


def own_errors(scene, solution, tight):
    """(n surfaces,) Measured relative error of each, and its mean radiance, of the brightest one's."""
    error, light = np.zeros(len(scene)), np.zeros(len(scene))
    for k, points, _ in points_over(scene, seed=1, least=ON_EACH):
        true = tight.radiance(k, points) - scene.emission[k]
        wrong = solution.radiance(k, points) - scene.emission[k] - true
        light[k] = np.linalg.norm(true, axis=1).mean()
        error[k] = np.sqrt((wrong**2).mean() / max((true**2).mean(), 1e-300))
    return error, light / light.max()


def seconds_of(scene, target):
    """CPU seconds of solve: as it is, and with no demands on each surface."""
    least = [np.inf, np.inf]
    for _ in range(TURNS):
        for k, own in enumerate((each_surface.OWN, 1e9)):
            each_surface.OWN = own
            try:
                start = time.process_time()
                solve(scene, target)
                least[k] = min(least[k], time.process_time() - start)
            finally:
                each_surface.OWN = OWN
    return least


def rows_of(name):
    scene = SCENES[name]()
    solve(scene, 0.1)  # the first run of a process loads code
    tight = solve(scene, TIGHT, time_limit=TIGHT_SECONDS)
    for target in TARGETS:
        solution = solve(scene, target)
        error, light = own_errors(scene, solution, tight)
        counts = light > each_surface.DIM
        worst = int(np.argmax(error * counts))
        seconds, whole_only = seconds_of(scene, target)
        yield {
            "scene": name,
            "target": target,
            "stated": float(solution.error),
            "worst_surface": scene.surfaces[worst].name,
            "worst_measured": float(error[worst]),
            "worst_stated": float(solution.surface_errors[worst]),
            "true": int((solution.surface_errors >= error)[counts].sum()),
            "surfaces": [
                {"name": s.name, "light": float(b), "measured": float(e), "stated": float(o)}
                for s, b, e, o in zip(scene.surfaces, light, error, solution.surface_errors)
                if b > each_surface.DIM
            ],
            "cpu_seconds": seconds,
            "cpu_seconds_without": whole_only,
            "tight_stated": float(tight.error),
        }


def main(output="build/bench/each_object.json"):
    rows = []
    for name in SCENES:
        for row in rows_of(name):
            rows.append(row)
            print(
                f"{name:18} {row['target']:5.0%}  whole {row['stated']:6.2%}  worst {row['worst_surface']:12}"
                f" measured {row['worst_measured']:6.1%} stated {row['worst_stated']:6.1%}"
                f"  true for {row['true']} of {len(row['surfaces'])}"
                f"  {row['cpu_seconds']:5.2f} s CPU, {row['cpu_seconds_without']:.2f} s without",
                flush=True,
            )
    save(output, {"about": machine(), "rows": rows})


if __name__ == "__main__":
    main(*sys.argv[1:])
