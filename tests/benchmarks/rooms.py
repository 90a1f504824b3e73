"""Error against time of a bake's numerics, in three rooms: JSON, a table and a plot.

    python tests/benchmarks/rooms.py [OUTPUT.json [PLOT.png]]

The rooms of tests/data and one with 13 spheres. Errors are relative L2 errors of L - Le: at the reference
points, which come from an independent path tracer and carry noise of .13 and .09 %, and against our own run at TIGHT,
over random points of all surfaces. Times are those of solve() and of evaluating so many vertices.
"""

import json
import sys
import time

import numpy as np
from output import REFERENCE, machine, save
from scenes import difference, thirteen_spheres

from pdm_core import Plane, Scene, Sphere, Surface, solve

ROOMS = ("seed_room", "cornell_spheres")
THIRTEEN = "thirteen_spheres"
TARGETS = (0.04, 0.02, 0.01, 0.005, 0.0025, 0.001)
TIGHT = 0.001
VERTICES = (500, 2000, 8000, 32000)
PLOTTED = 8000


def load(name):
    """The reference data of a room, its Scene (planes with both sides) and the front surface of each object."""
    data = np.load(REFERENCE / f"{name}.npz")
    surfaces, front = [], []
    for item in json.loads(str(data["spec"]))["objects"]:
        plane = item["kind"] == "plane"
        shape = Plane(item["o"], item["u"], item["v"]) if plane else Sphere.at(item["c"], item["r"])
        front.append(len(surfaces))
        surfaces.append(Surface(shape, item["rho"], item["emit"], name=item["name"]))
        if plane:
            surfaces.append(Surface(shape, item["rho"], side="back", name=f"{item['name']} (back)"))
    return data, Scene(surfaces), np.array(front)


def reference_error(data, scene, front, solution):
    """Relative L2 error of L - Le at the reference points."""
    wrong = total = 0.0
    for k, surface in enumerate(front):
        points, normals = data["P"][data["surface"] == k], data["N"][data["surface"] == k]
        reference = data["L"][data["surface"] == k]
        along = (scene.surfaces[surface].normals(points) * normals).sum(axis=1) > 0
        for side, mine in ((surface, along), (surface + 1, ~along)):
            if mine.any():
                radiance = solution.radiance(side, points[mine])
                wrong += ((radiance - reference[mine]) ** 2).sum()
                total += ((reference[mine] - scene.emission[side]) ** 2).sum()
    return float(np.sqrt(wrong / total))


def vertices(scene, front, count):
    """About count points a room, spread evenly over its objects: grids of the planes, rings of the spheres."""
    side = int(np.sqrt(count / len(front)))
    s, t = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side)))
    for surface in front:
        shape = scene.surfaces[surface].shape
        if isinstance(shape, Plane):
            yield surface, shape.world(np.column_stack([s, t, 0 * s]))
        else:
            theta, phi = np.pi * s, 2 * np.pi * t
            ring = np.sin(theta)
            yield surface, shape.world(np.column_stack([ring * np.cos(phi), ring * np.sin(phi), np.cos(theta)]))


def run(name):
    if name in ROOMS:
        data, scene, front = load(name)
    else:
        scene = thirteen_spheres()
        data, front = None, np.arange(len(scene))
    solve(scene, 0.1)  # the first run of a process loads code
    found = []
    for target in TARGETS:
        start, cpu = time.perf_counter(), time.process_time()
        solution = solve(scene, target)
        row = {"room": name, "target": target, "stated": float(solution.error), "nodes": solution.nodes}
        row["solve_seconds"], row["solve_cpu_seconds"] = time.perf_counter() - start, time.process_time() - cpu
        for count in VERTICES:
            start, cpu = time.perf_counter(), time.process_time()
            exactly = sum(len(solution.radiance(s, points)) for s, points in vertices(scene, front, count))
            seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
            row[f"vertices_{count}"] = {"vertices": exactly, "seconds": seconds, "cpu_seconds": cpu}
        if data is not None:
            row["measured"] = reference_error(data, scene, front, solution)
        row["warnings"] = solution.warnings
        found.append((row, solution))
    for row, solution in found:
        if row["target"] > TIGHT:
            row["from_tight"] = difference(scene, solution, found[-1][1])
        yield row


def plot(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6, 4.4))
    for name, colour in zip((*ROOMS, THIRTEEN), ("tab:blue", "tab:orange", "tab:green")):
        mine = [row for row in rows if row["room"] == name and row["target"] > TIGHT]
        seconds = [row["solve_seconds"] + row[f"vertices_{PLOTTED}"]["seconds"] for row in mine]
        key = "measured" if name in ROOMS else "from_tight"
        axes.loglog(seconds, [100 * row[key] for row in mine], "o-", color=colour, label=f"{name}, measured")
        axes.loglog(seconds, [100 * row["stated"] for row in mine], "x--", color=colour, label=f"{name}, stated")
    axes.set_xlabel(f"seconds, with {PLOTTED} vertices")
    axes.set_ylabel("relative L2 error of the light, %")
    axes.grid(True, which="both", alpha=0.3)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "25" else "")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main(output, picture=None):
    rows = []
    for name in (*ROOMS, THIRTEEN):
        for row in run(name):
            rows.append(row)
            measured = f"measured {row['measured']:6.2%}" if "measured" in row else ""
            tight = f"from tight {row['from_tight']:6.2%}" if "from_tight" in row else ""
            with_vertices = " ".join(f"{row['solve_seconds'] + row[f'vertices_{n}']['seconds']:6.2f}" for n in VERTICES)
            print(
                f"{name:16} target {row['target']:6.2%}  stated {row['stated']:6.2%}  {measured:16} {tight:17} "
                f"seconds with {VERTICES} vertices: {with_vertices}; {row['nodes']} nodes",
                flush=True,
            )
    save(output, {"about": machine(), "rows": rows})
    if picture:
        plot(rows, picture)


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["build/bench/rooms.json"]))
