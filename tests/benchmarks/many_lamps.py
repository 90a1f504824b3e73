"""200 lamps over 200 boxes: CPU seconds to solve and to read off, at a target of 4 %.

python tests/benchmarks/many_lamps.py docs/benchmarks/many_lamps.json
"""

import sys
import time

import links_or_rays
import numpy as np
import output

from pdm_core import PointLight, Scene, SpotLight, solve
from pdm_core.signs_of_life import finish

LAMPS, BOXES, TARGET, SEED = 200, 200, 0.04, 3
EACH = 8  # points of each surface where colours are read


def lamps(kind, low, high):
    rng = np.random.default_rng(SEED)
    places = np.column_stack([rng.uniform(low, high, (LAMPS, 2)), rng.uniform(2.5, 3.5, LAMPS)])
    make = {
        "points": lambda place: PointLight(place, 20.0),
        "balls of 10 cm": lambda place: PointLight(place, 20.0, 0.1),
        "spots of 57 degrees": lambda place: SpotLight(place, (0, 0, -1), 60.0, 1.0, 0.15, 0.1),
    }
    return [make[kind](place) for place in places]


def main(path):
    given = links_or_rays.boxes(BOXES)
    surfaces = [s for s in given.surfaces if not np.any(s.emission)]
    centres = np.array([s.shape.bounds[0] for s in surfaces])
    surface = np.repeat(np.arange(len(surfaces)), EACH)
    points = np.concatenate([s.shape.spread(EACH) for s in surfaces])
    rows = []
    for kind in ("points", "balls of 10 cm", "spots of 57 degrees"):
        scene = Scene(surfaces, lights=lamps(kind, centres[:, :2].min(axis=0), centres[:, :2].max(axis=0)))
        start = time.process_time()
        solution = solve(scene, TARGET)
        solved = time.process_time() - start
        finish(solution.incident_steps(surface, points))
        total = time.process_time() - start
        row = {"lamps": kind, "stated": solution.error, "points": len(points), "solve": solved, "all": total}
        rows.append(row)
        print(row, flush=True)
        output.save(path, {"machine": output.machine(), "target": TARGET, "rows": rows})


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "build/bench/many_lamps.json")
