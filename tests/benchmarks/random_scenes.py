"""Is the error that rays state true? Random scenes of many kinds of shapes: JSON and a table.

    python tests/benchmarks/random_scenes.py [OUTPUT.json [SCENES [SECONDS [KIND]]]]

Scenes hold 20 to 100 boxes, planes, balls, concave polygons and ones with holes, and small meshes, in a room or on a
floor, under a lamp (a ball, a square, a light) and in the open a sky too. Errors are relative L2 errors of L - Le over
all surfaces, measured against a run at a quarter of the target; begun anew until so many seconds of CPU are over.
KIND `boxes`, against runs at a third of the target: 20 to 300 boxes, planes and balls alone.
KIND `few`, against an independent path tracer: 3 to 12 concave polygons, ones with holes, meshes of large and small
faces, flat and smooth, and balls, in a room or on a floor, whose walls may be polygons or meshes of two triangles each.
"""

import sys
import time

import numpy as np
from output import ROOT, machine, save
from scenes import separate, walls

from pdm_core import AreaLight, Mesh, Plane, PointLight, Polygon, Scene, Sphere, SunLight, Surface
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

sys.path.insert(0, str(ROOT / "tests" / "stability"))
from tracer import measured_error  # noqa: E402

PLACES, PATHS = 400, (128, 1024)  # that are traced; paths of each, the second where the first do not tell
NOISE = 2.0  # standard deviations of the tracer's that count as agreement
TARGET, TIGHTER = 0.04, {"many": 4.0, "boxes": 3.0}
PATIENCE = 20.0  # s of CPU at most, of a run
POINTS, LEAST = {"many": 3000, "boxes": 1000}, (1, 16)  # where runs are compared; at least of a surface
ENOUGH = 8  # points of a surface, that tell its own error
TRIES = 30


def random_scene(seed, things, most):
    """A scene of 20 to so many of these things, and how many."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(4, 8, 3) * [1, 1, 0.5]
    brightest, in_room = rng.uniform(0.4, 0.9), rng.random() < 0.5
    if in_room:
        surfaces = walls(size, rng.uniform(0.1, brightest, (6, 3)))
    else:
        floor = Plane((0, 0, 0), (size[0], 0, 0), (0, size[1], 0))
        surfaces = [Surface(floor, rng.uniform(0.1, brightest, 3), name="floor")]
    lamp, lights, placed = random_lamp(rng, size)
    surfaces += lamp
    count, made = rng.integers(20, most + 1), 0
    for _ in range(TRIES * count):
        radius = rng.uniform(0.4, 1.0) * 0.5 * (size.prod() / count) ** (1 / 3)
        centre = radius + rng.random(3) * (size - 2 * radius)
        if not separate((centre, radius), placed):
            continue
        placed.append((centre, radius))
        surfaces += rng.choice(things)(rng, centre, radius, rng.uniform(0.1, brightest, 3), rng.random() < 0.5)
        made += 1
        if made == count:
            break
    background = 0.0 if in_room else rng.uniform(0.1, 1, 3) * (rng.random() < 0.7)
    return Scene(surfaces, background, rounding=2**-24, lights=lights), made


def few_scene(seed):
    """A scene of few shapes, and how many."""
    rng = np.random.default_rng([7, seed])
    size, smooth = rng.uniform(3, 6, 3) * [1, 1, 0.6], rng.random() < 0.4
    brightest, in_room = rng.uniform(0.4, 0.9), rng.random() < 0.6
    surfaces = [of_other_make(rng, s) for s in walls(size, rng.uniform(0.1, brightest, (6, 3)))[: 6 if in_room else 1]]
    emission, centre = rng.uniform(5, 20), size * [*rng.uniform(0.3, 0.7, 2), 0.85]
    side = rng.uniform(0.2, 0.8)
    lamp = Sphere.at(centre, side / 3) if rng.random() < 0.5 else Plane(centre, (0, side, 0), (side, 0, 0))
    surfaces.append(Surface(lamp, 0.0, emission, name="lamp"))
    placed, count, made = [(centre, 1.5 * side)], rng.integers(3, 13), 0
    for _ in range(TRIES * count):
        radius = rng.uniform(0.4, 1.0) * 0.6 * (size.prod() / count) ** (1 / 3)
        centre = radius + rng.random(3) * (size - 2 * radius)
        if made < count and (centre > 0).all() and separate((centre, radius), placed):
            placed.append((centre, radius))
            kind = rng.choice([random_ball, random_polygon, random_mesh, random_octahedron])
            shading = smooth if kind in (random_mesh, random_octahedron) else rng.random() < 0.5
            surfaces += kind(rng, centre, radius, rng.uniform(0.1, brightest, 3), shading)
            made += 1
    background = 0.0 if in_room else rng.uniform(0.1, 1, 3) * (rng.random() < 0.7)
    return Scene(surfaces, background, rounding=2**-24), made


def boxes_and_balls(seed):
    """A scene of 3 to 24 of them, in a room or on a floor."""
    rng = np.random.default_rng([31, seed])
    size, brightest, in_room = rng.uniform(3, 6, 3) * [1, 1, 0.6], rng.uniform(0.4, 0.85), rng.random() < 0.6
    surfaces = walls(size, rng.uniform(0.1, brightest, (6, 3)))[: 6 if in_room else 1]
    lamp, lights, placed = random_lamp(rng, size)
    surfaces += lamp
    count, made = rng.integers(3, 25), 0
    for _ in range(TRIES * count):
        radius = rng.uniform(0.4, 1.0) * 0.55 * (size.prod() / count) ** (1 / 3)
        centre = radius + rng.random(3) * (size - 2 * radius)
        if made < count and (centre > 0).all() and separate((centre, radius), placed):
            placed.append((centre, radius))
            kind = random_box if rng.random() < 0.5 else random_ball
            surfaces += kind(rng, centre, radius, rng.uniform(0.1, brightest, 3), rng.random() < 0.5)
            made += 1
    background = 0.0 if in_room else rng.uniform(0.1, 1, 3) * (rng.random() < 0.7)
    return Scene(surfaces, background, rounding=2**-24, lights=lights)


def of_other_make(rng, surface):
    """A wall as it is, as a polygon, or as a mesh of two triangles."""
    corners, make = surface.shape.corners, rng.integers(3)
    if make == 0:
        return surface
    shape = Polygon(corners) if make == 1 else Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), False)
    return Surface(shape, surface.reflectance, name=surface.name)


def random_octahedron(rng, centre, radius, reflectance, smooth):
    """Eight large faces."""
    points = np.concatenate([np.eye(3), -np.eye(3)]) * rng.uniform(0.5, 1, (6, 1)) * radius @ turned(rng, False).T
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return [Surface(Mesh(centre + points, faces, bool(smooth)), reflectance, name="octahedron")]


def random_lamp(rng, size):
    """Surfaces of a lamp, lights and [(centre, radius)] of a sphere around it."""
    emission, centre = rng.uniform(5, 20), size * rng.uniform(0.3, 0.7, 3) * [1, 1, 0] + [0, 0, 0.85 * size[2]]
    kind = rng.integers(4)
    if kind == 0:
        radius = rng.uniform(0.05, 0.25)
        return [Surface(Sphere.at(centre, radius), 0.0, emission, name="lamp")], (), [(centre, radius)]
    side = rng.uniform(0.2, 0.8)
    around = [(centre, side)]
    if kind == 1:
        plane = Plane(centre - [side / 2, side / 2, 0], (0, side, 0), (side, 0, 0))
        return [Surface(plane, 0.0, emission, name="lamp")], (), around
    if kind == 2:
        return [], (AreaLight(centre, (0, side, 0), (side, 0, 0), 20 * emission),), around
    if rng.random() < 0.5:
        return [], (PointLight(centre, 20 * emission, radius=rng.uniform(0, 0.15)),), around
    direction = [*rng.uniform(-0.7, 0.7, 2), -1.0]
    return [], (SunLight(direction, emission, rng.uniform(0, 0.2)), PointLight(centre, emission, 0.1)), around


def turned(rng, upright):
    """A random rotation (3, 3), or one about the vertical."""
    if upright:
        turn = rng.uniform(0, 2 * np.pi)
        return np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return frame * np.sign(np.linalg.det(frame))


def both(shape, reflectance, name):
    return [Surface(shape, reflectance, side=side, name=f"{name} {side}") for side in ("front", "back")]


def random_box(rng, centre, radius, reflectance, stands):
    half, frame = radius * rng.uniform(0.3, 1, 3) / np.sqrt(3), turned(rng, stands)
    if stands:
        centre = [*centre[:2], half[2]]
    out = []
    for axis in range(3):
        u, v = 2 * half[axis - 2] * frame[:, axis - 2], 2 * half[axis - 1] * frame[:, axis - 1]
        for sign in (-1, 1):
            middle = centre + sign * half[axis] * frame[:, axis]
            u, v = (u, v) if sign > 0 else (v, u)
            out.append(Surface(Plane(middle - (u + v) / 2, u, v), reflectance, name="box"))
            u, v = (u, v) if sign > 0 else (v, u)
    return out


def random_plane(rng, centre, radius, reflectance, _stands):
    u, v = turned(rng, False)[:2] * radius * rng.uniform(0.5, 1, (2, 1))
    return both(Plane(centre - (u + v) / 2, u, v), reflectance, "plane")


def random_ball(rng, centre, radius, reflectance, stands):
    radius *= rng.uniform(0.4, 1)
    centre = [*centre[:2], radius] if stands else centre
    return [Surface(Sphere.at(centre, radius), reflectance, name="ball")]


def random_polygon(rng, centre, radius, reflectance, star):
    """A star of 5 to 8 points, or a frame."""
    frame = turned(rng, False)[:, :2]
    if star:
        count = 2 * rng.integers(5, 9)
        turn = 2 * np.pi * np.arange(count) / count
        flat = np.column_stack([np.cos(turn), np.sin(turn)]) * np.where(np.arange(count) % 2, 1, 0.5)[:, None] * radius
        return both(Polygon(centre + flat @ frame.T), reflectance, "star")
    square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]) * radius / np.sqrt(2)
    hole = square * rng.uniform(0.4, 0.8)
    return both(Polygon(centre + square @ frame.T, [centre + hole @ frame.T]), reflectance, "frame")


def random_mesh(rng, centre, radius, reflectance, smooth):
    """A lumpy ball of 12 x 7 faces."""
    around, along = 12, 7
    turn, polar = np.meshgrid(2 * np.pi * np.arange(around) / around, np.pi * np.arange(1, along) / along)
    ring = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=2).reshape(-1, 3)
    points = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    points = points * rng.uniform(0.7, 1, (len(points), 1)) * radius
    faces = [
        [r * around + c, (r + 1) * around + c, (r + 1) * around + d, r * around + d]
        for r in range(along - 2)
        for c, d in ((c, (c + 1) % around) for c in range(around))
    ]
    top, bottom, last = len(ring), len(ring) + 1, (along - 2) * around
    faces += [[top, c, (c + 1) % around] for c in range(around)]
    faces += [[bottom, last + (c + 1) % around, last + c] for c in range(around)]
    return [Surface(Mesh(centre + points, faces, bool(smooth)), reflectance, name="mesh")]


def points_of(scene, number, seed=3):
    """About so many: surface (k,), points (k, 3) m and the area m^2 (k,) of each, over all surfaces."""
    rng, surface, points, weight = np.random.default_rng(seed), [], [], []
    least = int(np.clip(number // len(scene), *LEAST))
    for k, own in enumerate(scene.surfaces):
        count = max(least, int(number * scene.areas[k] / scene.areas.sum()))
        some = own.shape.spread(4 * count)
        points.append(some[rng.choice(len(some), count, replace=False)])
        surface.append(np.full(count, k))
        weight.append(np.full(count, scene.areas[k] / count))
    return np.concatenate(surface), np.concatenate(points), np.concatenate(weight)


def difference(scene, one, other, number):
    """Relative L2 difference of two solutions' L - Le at about so many points, each surface's own, 0 where too few tell
    it, and the squares of their light (n,)"""
    surface, points, weight = points_of(scene, number)
    a, b = (scene.reflectance[surface] * finish(s.incident_steps(surface, points)) for s in (one, other))
    off, norm = (np.bincount(surface, weight * (v**2).sum(axis=1), len(scene)) for v in (a - b, b))
    tells = np.bincount(surface, minlength=len(scene)) >= ENOUGH
    return np.sqrt(off.sum() / norm.sum()), np.sqrt(tells * off / np.maximum(norm, 1e-300)), norm


def solved(scene, target):
    """The solution by rays, and CPU s."""
    start = time.process_time()
    solution = finish(ray_steps(scene, target, None, "", lambda: time.process_time() - start > PATIENCE))
    return solution, time.process_time() - start


SOLIDS = [random_box, random_plane, random_ball]
THINGS = {"many": ([*SOLIDS, random_polygon, random_mesh], 100), "boxes": (SOLIDS, 300)}


def run(seed, kind):
    scene, shapes = few_scene(seed) if kind == "few" else random_scene(seed, *THINGS[kind])
    solution, cpu = solved(scene, TARGET)
    row = {
        "seed": seed,
        "shapes": int(shapes),
        "surfaces": len(scene),
        "stated": float(solution.error),
        "parts": {k: float(v) for k, v in solution.error_parts.items()},
        "solve_cpu_seconds": cpu,
    }
    return row | (traced(scene, solution, seed) if kind == "few" else beside_tighter(scene, solution, kind))


def traced(scene, solution, seed):
    """Beside a path tracer: measured, and its own noise; by more paths where these do not tell."""
    for paths in PATHS:
        measured, noise = measured_error(scene, solution, PLACES, paths, np.random.default_rng(seed))
        if measured**2 + NOISE * noise**2 <= solution.error**2:
            break
    return {"measured": float(measured), "noise": float(noise), "paths": paths}


def beside_tighter(scene, solution, kind):
    tighter, _ = solved(scene, TARGET / TIGHTER[kind])
    measured, each, norm = difference(scene, solution, tighter, POINTS[kind])
    lit = norm / scene.areas > (0.05 * np.sqrt((norm / scene.areas).max())) ** 2
    own = each[lit] / np.maximum(solution.surface_errors[lit], 1e-12)
    return {
        "measured": float(measured),
        "noise": 0.0,
        "tighter_stated": float(tighter.error),
        "surfaces_true": float((own <= 1).mean()),
        "worst_surface": float(own.max()),
    }


def holds(row):
    """Whether what is stated covers what is measured above the reference's noise."""
    return row["measured"] ** 2 - NOISE * row["noise"] ** 2 <= row["stated"] ** 2


def main(output="build/bench/random_scenes.json", scenes="100", seconds="900", kind="many"):
    rows = []
    for seed in range(int(scenes)):
        rows.append(row := run(seed, kind))
        print(
            f"{seed:3}  {row['shapes']:3} shapes  stated {row['stated']:6.2%}  measured {row['measured']:6.2%} "
            f"+- {row['noise']:5.2%}  {row['solve_cpu_seconds']:5.2f} s CPU{'' if holds(row) else '  BROKEN'}",
            flush=True,
        )
        report(rows, output)
        if time.process_time() > float(seconds):
            break


def report(rows, output):
    """Written after every scene, as they take long. Ratios of those that are measured above the noise."""
    told = [row for row in rows if row["measured"] > row["noise"]]
    ratio = np.array([row["stated"] / row["measured"] for row in told] or [np.nan])
    summary = {
        "scenes": len(rows),
        "true": sum(holds(row) for row in rows),
        "measured_below_stated": sum(row["measured"] <= row["stated"] for row in rows),
        "target_reached": sum(row["stated"] <= TARGET for row in rows),
        "above_noise": len(told),
        "median_stated_over_measured": float(np.median(ratio)),
        "least_stated_over_measured": float(ratio.min()),
        "percentile_95_stated_over_measured": float(np.percentile(ratio, 95)),
        "median_cpu_seconds": float(np.median([row["solve_cpu_seconds"] for row in rows])),
    }
    save(output, {"about": machine(), "summary": summary, "rows": rows})


if __name__ == "__main__":
    main(*sys.argv[1:])
