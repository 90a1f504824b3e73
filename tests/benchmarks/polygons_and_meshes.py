"""Polygons and meshes by rays: one room of three makes, growth in faces, a ball as finer and finer meshes, coarse ones.

    python tests/benchmarks/polygons_and_meshes.py [OUTPUT.json [PART ...]]

Other parts that OUTPUT.json has stay as they are.

`walls`: a room whose front has two windows under a sky, its walls as polygons, rectangles and triangles: CPU seconds
and how far they differ at the same points, relative L2. `growth`: a bumpy sheet of ever
more faces in a lit room, each in a process of its own: CPU seconds of solving and of reading off 5,000 vertices, peak
memory; `fine`: the same of 300,000 faces, with all its vertices. `terrain`: of 20,000 triangles with ten houses of
polygons under a sky and a sun that is a ball, beside the same to a quarter of the target.
`ball`: icospheres beside the Sphere. `coarse`: an icosphere of 80 faces, flat and smooth.
"""

import ast
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from output import machine, save
from random_scenes import difference
from scenes import walls

from pdm_core import Mesh, Plane, Polygon, Scene, Sphere, Surface, solve
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

PATIENCE = 180.0  # s at most, of a run
TARGET, TIGHTER = 0.04, 4.0
FACES = 1000, 3162, 10_000, 31_623, 100_000
READ = 5000  # vertices
ROOM = np.array([5.0, 4.0, 2.8])
WINDOWS = (0.3, 2.2, 0.3, 2.5), (2.8, 4.7, 0.3, 2.5)  # m: low and high along x, low and high along z, of the wall y = 0
PAINTS = [(0.5, 0.4, 0.3), (0.8, 0.8, 0.8), (0.6, 0.2, 0.2), (0.7, 0.7, 0.7), (0.7, 0.7, 0.7), (0.3, 0.5, 0.3)]


def timed(scene, target):
    start = time.process_time()
    solution = finish(ray_steps(scene, target, PATIENCE, ""))
    return solution, time.process_time() - start


# --- one room of three makes ------------------------------------------------------------------------------------------


def front_parts():
    """The wall with the windows as rectangles (low x, high x, low z, high z): 8 with one pier cut in two."""
    (a, b, low, high), (c, d, _, _) = WINDOWS
    x, z = ROOM[[0, 2]]
    return [(0, a, 0, z / 2), (0, a, z / 2, z), (a, b, 0, low), (a, b, high, z), (b, c, 0, z), (c, d, 0, low),
            (c, d, high, z), (d, x, 0, z)]  # fmt: skip


def rectangle(low_x, high_x, low_z, high_z):
    """(4, 3) m in the wall y = 0, seen from within the room."""
    return np.array([[high_x, 0, low_z], [low_x, 0, low_z], [low_x, 0, high_z], [high_x, 0, high_z]])


def triangles_of(corners, cells):
    """(2 cells^2, 3, 3) m of a parallelogram (4, 3)."""
    at = np.stack(np.meshgrid(*[np.arange(cells)] * 2, indexing="ij"), -1).reshape(-1, 1, 2)
    halves = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    s, t = np.moveaxis((at[:, None] + halves).reshape(-1, 3, 2) / cells, 2, 0)[..., None]
    return corners[0] + s * (corners[1] - corners[0]) + t * (corners[3] - corners[0])


def room(make):
    """Walls as `polygons`; as `rectangles`, 8 around the windows; as 200 triangles: each a polygon, `triangles`,
    or a mesh a wall, `meshes`."""
    loops = [surface.shape.corners for surface in walls(ROOM, np.array(PAINTS))]
    (front,) = (k for k, loop in enumerate(loops) if not loop[:, 1].any())
    if make == "polygons":
        shapes = [[Polygon(loop)] for loop in loops]
        shapes[front] = [Polygon(rectangle(0, ROOM[0], 0, ROOM[2]), [rectangle(*w)[::-1] for w in WINDOWS])]
    elif make == "rectangles":
        shapes = [[Plane.through(loop)] for loop in loops]
        shapes[front] = [Plane.through(rectangle(*part)) for part in front_parts()]
    else:
        cut = [triangles_of(loop, 4) for loop in loops]  # 5 walls of 32
        small = [triangles_of(rectangle(*part), 2 if k in (0, 1, 4, 7) else 1) for k, part in enumerate(front_parts())]
        cut[front] = np.concatenate(small)
        if make == "triangles":
            shapes = [[Polygon(t) for t in wall] for wall in cut]
        else:
            shapes = [[Mesh(t.reshape(-1, 3), np.arange(3 * len(t)).reshape(-1, 3), False)] for t in cut]
    surfaces = [Surface(s, paint, name=f"wall {k}") for k, (own, paint) in enumerate(zip(shapes, PAINTS)) for s in own]
    cupboard = Plane((3.2, 2.2, 0), (1.2, 0, 0), (0, 0, 1.6))
    surfaces += [Surface(cupboard, 0.5, side=side, name="cupboard") for side in ("front", "back")]
    return Scene(surfaces, background=(0.8, 1.0, 1.3))


def shared_points(count=400):
    """Points (n, 3) and normals (n, 3) of the walls, the same for all makes, and the reflectance (n, 3) there."""
    rng, rows = np.random.default_rng(4), []
    for k, surface in enumerate(walls(ROOM, np.array(PAINTS))):
        at = surface.shape.world(np.column_stack([rng.random((count, 2)), np.zeros(count)]))
        normals = surface.normals(at)
        in_window = np.zeros(count, bool)
        if np.abs(normals[0, 1]) > 0.5 and not at[0, 1]:
            for low_x, high_x, low_z, high_z in WINDOWS:
                in_window |= (low_x < at[:, 0]) & (at[:, 0] < high_x) & (low_z < at[:, 2]) & (at[:, 2] < high_z)
        rows.append((at[~in_window], normals[~in_window], np.tile(PAINTS[k], (int((~in_window).sum()), 1))))
    return (np.concatenate(part) for part in zip(*rows))


def walls_part():
    points, normals, rho = shared_points()
    points = points + 1e-4 * normals
    found, out = {}, []
    for make in ("polygons", "rectangles", "triangles", "meshes"):
        scene = room(make)
        solution, cpu = timed(scene, TARGET)
        start = time.process_time()
        found[make] = rho * solution.irradiance(points, normals)
        out.append({
            "walls": make, "surfaces": len(scene), "nodes": solution.nodes, "stated": solution.error,
            "cpu_seconds": cpu, "read_cpu_seconds": time.process_time() - start,
            "off": {other: float(np.linalg.norm(found[make] - light) / np.linalg.norm(light))
                    for other, light in found.items() if other != make},
        })  # fmt: skip
        print(out[-1], flush=True)
    return {"target": TARGET, "rows": out}


# --- growth in faces --------------------------------------------------------------------------------------------------


def sheet(faces):
    """A bumpy sheet of so many triangles, about, over the floor of a room with a lamp."""
    cells = max(int(np.sqrt(faces / 2)), 2)
    x, y = np.meshgrid(*[np.linspace(0.2, 3.8, cells + 1)] * 2, indexing="ij")
    z = 0.5 + 0.15 * np.sin(3 * x) * np.cos(4 * y) + 0.05 * np.sin(11 * x + 5 * y)
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = Mesh(np.stack([x, y, z], -1).reshape(-1, 3), faces)
    surfaces = walls(np.array([4.0, 4.0, 3.0]), np.array(PAINTS))
    surfaces += [Surface(mesh, 0.6, side=side, name=f"sheet {side}") for side in ("front", "back")]
    surfaces.append(Surface(Plane((1.6, 1.6, 2.9), (0, 0.8, 0), (0.8, 0, 0)), 0.0, 12.0, name="lamp"))
    return Scene(surfaces)


def growth_one(faces, target, read=READ):
    start = time.process_time()
    scene = sheet(faces)
    solution = solve(scene, target, time_limit=10 * PATIENCE)
    solved = time.process_time() - start
    mesh = scene.surfaces[6].shape
    points = mesh.vertices[:: max(len(mesh.vertices) // read, 1)]
    solution.radiance(6, points)
    row = {
        "faces": len(mesh.triangles), "target": target, "stated": solution.error, "nodes": solution.nodes,
        "cpu_seconds": solved, "points": len(points), "read_cpu_seconds": time.process_time() - start - solved,
        "peak_megabytes": own_peak(),
    }  # fmt: skip
    print(row)


def own_peak():
    """MB; the figure of getrusage begins at that of the process that started this one."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def apart(*arguments):
    """The row of growth_one in a process of its own."""
    words = [sys.executable, __file__, "growth_one", *map(str, arguments)]
    row = ast.literal_eval(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    print(row, flush=True)
    return row


def fine_part():
    return apart(300_000, TARGET, 300_000)


def growth_part():
    out = {}
    for target in (0.04,):
        rows = []
        for faces in FACES:
            rows.append(apart(faces, target))
        size, cpu = (np.log([row[name] for row in rows]) for name in ("faces", "cpu_seconds"))
        out[str(target)] = {"rows": rows, "exponent": float(np.polyfit(size, cpu, 1)[0]),
                            "last_exponent": float((cpu[-1] - cpu[-2]) / (size[-1] - size[-2]))}  # fmt: skip
    return out


# --- terrain ----------------------------------------------------------------------------------------------------------


def terrain(cells=100):
    def height(x, y):
        return 2 * np.sin(x / 6) * np.cos(y / 5) + 0.5 * np.sin(1.3 * x + y)

    x, y = np.meshgrid(*[np.linspace(-30, 30, cells + 1)] * 2, indexing="ij")
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    ground = Mesh(np.stack([x, y, height(x, y)], -1).reshape(-1, 3), faces)
    surfaces, rng = [Surface(ground, (0.3, 0.4, 0.2), name="ground")], np.random.default_rng(0)
    for k in range(10):
        x, y = rng.uniform(-20, 20, 2)
        w, d, h = rng.uniform(3, 6, 3)
        low = np.array([(x, y), (x + w, y), (x + w, y + d), (x, y + d)])
        low = np.column_stack([low, np.full(4, height(x, y) - 0.5)])
        high = low + [0, 0, h]
        ridge = [(high[a] + high[b]) / 2 + [0, 0, h / 2] for a, b in ((0, 3), (1, 2))]
        a, b, c, d = low
        e, f, g, i = high
        sides = [a, b, f, e], [b, c, g, ridge[1], f], [c, d, i, g], [d, a, e, ridge[0], i]
        sides += [e, f, ridge[1], ridge[0]], [g, i, ridge[0], ridge[1]]
        surfaces += [Surface(Polygon(np.array(side)), (0.6, 0.5, 0.4), name=f"house {k + 1}") for side in sides]
    away = 6000.0  # m: a hundred times the terrain's width
    sun = Sphere.at(away * np.array([0.5, 0.3, 0.8]), away * np.tan(np.radians(0.53 / 2)))
    surfaces.append(Surface(sun, 0.0, (8e4, 7.5e4, 6.5e4), name="sun"))
    return Scene(surfaces, background=(0.3, 0.5, 0.8))


def terrain_part():
    scene = terrain()
    solution, cpu = timed(scene, TARGET)
    start = time.process_time()
    points = scene.surfaces[0].shape.vertices
    solution.radiance(0, points)
    read = time.process_time() - start
    row = {"faces": len(scene.surfaces[0].shape.triangles), "target": TARGET, "stated": solution.error,
           "nodes": solution.nodes, "cpu_seconds": cpu, "points": len(points), "read_cpu_seconds": read}  # fmt: skip
    print(row, flush=True)
    tighter, _ = timed(scene, TARGET / TIGHTER)
    row |= {"measured": float(difference(scene, solution, tighter, 3000)[0]), "tighter_stated": tighter.error}
    print(row, flush=True)
    return row


# --- balls ------------------------------------------------------------------------------------------------------------


def icosphere(finer):
    """Vertices on the unit sphere and triangles: 20 4^finer."""
    g = (1 + 5**0.5) / 2
    points = np.array([np.roll((0.0, s, t * g), k) for k in range(3) for s in (-1, 1) for t in (-1, 1)])
    near = np.linalg.norm(points[:, None] - points, axis=2) < 2.01
    faces = np.array(
        [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] & near[j, k] & near[i, k]]
    )
    faces[np.linalg.det(points[faces]) < 0] = faces[np.linalg.det(points[faces]) < 0][:, ::-1]
    for _ in range(finer):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        edges, number = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = number.reshape(3, -1) + len(points)
        points = np.concatenate([points, points[edges].mean(axis=1)])
        i, j, k = faces.T
        faces = np.concatenate([np.column_stack(t) for t in ((i, a, c), (a, j, b), (c, b, k), (a, b, c))])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points / np.linalg.norm(points, axis=1, keepdims=True), faces


def with_ball(shape):
    surfaces = walls(np.array([4.0, 4.0, 3.0]), np.array(PAINTS))
    surfaces.append(Surface(shape, (0.7, 0.6, 0.5), name="ball"))
    surfaces.append(Surface(Plane((1.4, 1.4, 2.9), (0, 0.8, 0), (0.8, 0, 0)), 0.0, 12.0, name="lamp"))
    return Scene(surfaces)


CENTRE, RADIUS = np.array([2.0, 2.0, 1.1]), 0.7


def ball_part(target=0.04):
    """Light on the room's walls and on the ball, read at the same points of both."""
    rng = np.random.default_rng(6)
    normal = rng.normal(size=(400, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    exact, _ = timed(with_ball(Sphere.at(CENTRE, RADIUS)), target)
    at = [
        surface.shape.world(np.column_stack([rng.random((300, 2)), np.zeros(300)]))
        for surface in exact.scene.surfaces[:6]
    ]

    def light(solution):
        on_walls = [solution.radiance(k, points) for k, points in enumerate(at)]
        return np.concatenate(on_walls), solution.radiance(6, CENTRE + RADIUS * normal)

    right, rows = light(exact), []
    for finer in range(4):
        points, faces = icosphere(finer)
        solution, cpu = timed(with_ball(Mesh(CENTRE + RADIUS * points, faces)), target)
        off = [float(np.linalg.norm(a - b) / np.linalg.norm(b)) for a, b in zip(light(solution), right)]
        row = {
            "faces": len(faces),
            "cpu_seconds": cpu,
            "stated": solution.error,
            "walls_off": off[0],
            "ball_off": off[1],
        }
        rows.append(row)
        print(row, flush=True)
    for last, row in zip(rows, rows[1:]):
        row["orders"] = [float(np.log2(last[name] / row[name])) for name in ("walls_off", "ball_off")]
    return {"target": target, "exact_stated": exact.error, "rows": rows}


def coarse_part():
    rows = []
    for finer, smooth in ((0, False), (0, True), (1, False), (1, True)):
        points, faces = icosphere(finer)
        for target in (0.04, 0.01):
            scene = with_ball(Mesh(CENTRE + RADIUS * points, faces, smooth))
            solution, cpu = timed(scene, target)
            tighter, _ = timed(scene, target / TIGHTER)
            measured, each, _ = difference(scene, solution, tighter, 3000)
            rows.append({
                "faces": len(faces), "smooth": smooth, "target": target, "stated": solution.error, "cpu_seconds": cpu,
                "measured": float(measured), "mesh_stated": float(solution.surface_errors[6]),
                "mesh_measured": float(each[6]), "tighter_stated": tighter.error, "nodes": solution.nodes,
            })  # fmt: skip
            print(rows[-1], flush=True)
    return rows


PARTS = {
    "walls": walls_part, "growth": growth_part, "fine": fine_part, "terrain": terrain_part, "ball": ball_part,
    "coarse": coarse_part,
}  # fmt: skip


def main(output="build/bench/polygons_and_meshes.json", *parts):
    kept = json.loads(Path(output).read_text()) if Path(output).exists() else {}
    for name in parts or PARTS:
        kept[name] = PARTS[name]()
        save(output, kept | {"about": machine()})


if __name__ == "__main__":
    if sys.argv[1:2] == ["growth_one"]:
        growth_one(int(sys.argv[2]), float(sys.argv[3]), *map(int, sys.argv[4:]))
    else:
        main(*sys.argv[1:])
