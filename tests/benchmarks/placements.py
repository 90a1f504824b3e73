"""A closed room of 12 surfaces in 96 placements: angles, offsets to 1e4 sizes, scales. JSON and a line each.

    python tests/benchmarks/placements.py [OUTPUT.json]

Reflectance .7, emission .3, background 1: the radiance is 1 everywhere. Closure: how far the form factors of nodes sum
from 1. CPU seconds of solve at 1 %, against those of the aligned room in turns.
"""

import sys
import time

import numpy as np
from output import machine, save

from pdm_core import Plane, Scene, Surface, solve
from pdm_core.links.approach import Approach

TARGET, COUNT, TURNS = 0.01, 96, 3


def room(turn, offset, size):
    x, y, z = turn @ np.diag(size * np.array([1.0, 1.3, 0.8]))
    o = np.array(offset, float)
    edges = [(o, x, y), (o + z, y, x), (o, y, z), (o, z, x), (o + y, x, z), (o + x, z, y)]
    return Scene([Surface(Plane(*e), 0.7, 0.3, side=side) for e in edges for side in ("front", "back")], 1.0)


def placements():
    rng = np.random.default_rng(0)
    for k in range(COUNT):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if k % 2 else np.eye(3)[rng.permutation(3)]
        size, away = 10 ** rng.uniform(-6, 6), 10 ** rng.uniform(-1, 4)
        yield turn, away * size * rng.normal(size=3), size, away


def seconds(scene):
    start = time.process_time()
    solution = solve(scene, TARGET)
    return time.process_time() - start, solution


def row(turn, offset, size, away):
    scene, aligned = room(turn, offset, size), room(np.eye(3), np.zeros(3), 1.0)
    pairs = [(seconds(scene), seconds(aligned)) for _ in range(TURNS)]
    solution = pairs[-1][0][1]
    transport = Approach(scene, 0.01, "").transport
    f, everyone = transport.field, np.arange(len(scene))
    sums = transport.factors.matrix(f.points, f.normals, f.node_surface, everyone, True).sum(axis=1)
    uv = np.random.default_rng(1).random((50, 2))
    error = [
        np.abs(solution.radiance(k, s.shape.world(np.column_stack([uv, 0 * uv[:, 0]]))) - 1).max()
        for k, s in enumerate(scene.surfaces)
    ]
    return {
        "size_m": size, "sizes_away": away, "closure": float(np.abs(sums - 1).max()), "furnace": float(max(error)),
        "stated": float(solution.error), "cpu_seconds": min(mine for (mine, _), _ in pairs),
        "cpu_over_aligned": float(np.median([mine / other for (mine, _), (other, _) in pairs])),
    }  # fmt: skip


def main(output="build/bench/placements.json"):
    seconds(room(np.eye(3), np.zeros(3), 1.0))  # the first run of a process loads code
    rows = [row(*where) for where in placements()]
    worst = {key: max(r[key] for r in rows) for key in ("closure", "furnace", "stated", "cpu_over_aligned")}
    print(len(rows), "placements, the worst:", worst)
    save(output, {"about": machine(), "worst": worst, "rows": rows})


if __name__ == "__main__":
    main(*sys.argv[1:])
