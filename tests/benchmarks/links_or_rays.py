"""Links against rays on the same scenes: CPU seconds of solving and of reading off 4,000 places, stated errors, and
which of them the plan chooses.

python tests/benchmarks/links_or_rays.py docs/benchmarks/links_or_rays.json
"""

import sys
import time

import numpy as np
import output  # first: it finds the package
import rooms
import scenes

from pdm_core import Plane, Scene, SceneError, Surface
from pdm_core import radiosity as links
from pdm_core.choice import Choice, choose
from pdm_core.read_off import spread_points
from pdm_core.signs_of_life import finish

SLOW = 60.0  # s after which a way is given up
PLACES = 4000  # that are read off, spread over all surfaces


def boxes(count, seed=3):
    """Boxes on a floor under a lamp and a sky, as in the issue that asked for rays."""
    rng, side = np.random.default_rng(seed), 2.2 * np.sqrt(count)
    surfaces = []

    def add(corner, u, v, reflectance):
        plane = Plane(corner, u, v)
        surfaces.extend(Surface(plane, reflectance, side=way) for way in ("front", "back"))

    add((-side / 2, -side / 2, 0), (side, 0, 0), (0, side, 0), 0.6)
    lamp = Plane((-side / 8, side / 8, side / 2), (side / 4, 0, 0), (0, -side / 4, 0))
    surfaces.append(Surface(lamp, 0, (8, 7, 6), "front", "Lamp"))
    across = int(np.ceil(np.sqrt(count)))
    for k in range(count):
        middle = (np.array([k % across, k // across]) + 0.5) * side / across - side / 2 + rng.uniform(-0.3, 0.3, 2)
        turn, (w, d, h) = rng.uniform(0, np.pi), rng.uniform(0.4, 1.2, 3)
        u, v = w * np.array([np.cos(turn), np.sin(turn), 0]), d * np.array([-np.sin(turn), np.cos(turn), 0])
        z = np.array([0, 0, h])
        o, rho = np.array([*middle, 0]) - (u + v) / 2, rng.uniform(0.2, 0.8, 3)
        for face in ((o, v, u), (o + z, u, v), (o, u, z), (o + u, v, z), (o + u + v, -u, z), (o + v, -v, z)):
            add(*face, rho)
    return Scene(surfaces, (0.2, 0.25, 0.3))


def solved(scene, target, by_rays):
    """CPU s of solving, with reading, and the Solution by one way or the other; None where too slow or refused."""
    start, before = time.process_time(), links.choose
    links.choose = lambda *_: Choice(by_rays, "asked for")
    try:
        solution = finish(links.solve_steps(scene, target, SLOW))
    except SceneError:
        return None, None, None
    finally:
        links.choose = before
    solving = time.process_time() - start
    rng = np.random.default_rng(1)
    surface = np.sort(rng.choice(len(scene), PLACES, p=scene.areas / scene.areas.sum()))
    solution.incident(surface, spread_points(scene, surface, rng))
    return solving, time.process_time() - start, solution if solution.error <= target else None


def cases():
    """(name, Scene)"""
    for name in ("seed_room", "cornell_spheres"):
        yield name, rooms.load(name)[1]
    for count in (13, 30, 100, 300):
        yield f"{count} balls in a room", scenes.spheres_in_room(count, (6.0, 5.0, 3.0), 7)
    for count in (1, 3, 8):
        yield f"{count} balls sunk in the floor", scenes.sunk_balls(count)
    for count in (1, 3, 8):
        yield f"{count} pairs of balls through each other", scenes.paired_balls(count)
    for count in (2, 5, 15, 50):
        yield f"{count} boxes", boxes(count)


def main(path):
    rows = []
    for name, scene in cases():
        for target in (0.04, 0.01):
            row = {"scene": name, "shapes": len(scene.shapes), "target": target}
            for way, by_rays in (("links", False), ("rays", True)):
                solving, seconds, solution = solved(scene, target, by_rays)
                row[way] = {"solving": solving, "seconds": seconds, "stated": solution and solution.error}
            choice = choose(scene, target)
            row["chosen"] = "rays" if choice.by_rays else "links"
            row["predicted"] = {"links": choice.links, "rays": choice.rays}
            rows.append(row)
            print(row, flush=True)
            output.save(path, {"machine": output.machine(), "rows": rows})


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "build/bench/links_or_rays.json")
