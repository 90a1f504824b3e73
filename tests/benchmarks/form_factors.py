"""Error against time of the form factors, each case beside the plain published method: JSON and a table.

python tests/benchmarks/form_factors.py OUTPUT.json
"""

import sys
import time

import numpy as np
from output import ROOT, machine, save

sys.path.insert(0, str(ROOT / "tests" / "core"))

from rooms import both_sides, cube_planes  # noqa: E402

from pdm_core import Plane, Polygon, Scene, Sphere, Surface, form_factors, pdm_form_factor  # noqa: E402

OPPOSITE, ADJACENT = 0.199824895698387, 0.200043776075403


def worst(pairs):
    """Largest relative error of (value, exact) pairs."""
    return float(max(abs(a - b) / abs(b) for a, b in pairs))


def row(case, method, error, seconds, **more):
    return {"case": case, "method": method, "error": error, "seconds": seconds, **more}


def timed(function, *arguments, **options):
    start = time.perf_counter()
    result = function(*arguments, **options)
    return result, time.perf_counter() - start


def seed_room():
    """The row of one face, with the paper's three factors, and all 49, against values known to ten digits."""
    planes, ball = [Surface(p) for p in cube_planes()], Surface(Sphere.at((0, 0, 0), 1))
    exact = {(0, 1): 0.1542499315, (0, 2): 0.1968931067, (0, 6): 4 * np.pi / 216, (6, 0): 1 / 6}
    scene = Scene([*planes, ball])
    form_factors(scene, 1e-2)  # the first call loads code
    for rtol in (1e-2, 1e-4, 1e-6, 1e-7, 1e-8):
        f = form_factors(scene, rtol, rows=[0])
        error = worst([(f.F[k], v) for k, v in exact.items() if k[0] == 0])
        closure = float(np.abs(f.background).max())
        yield row("paper's room, three factors", f"rtol {rtol:g}", error, f.seconds, closure=closure,
                  stated=float((f.error[0, 1:] / f.F[0, 1:]).max()))  # fmt: skip
    for rtol in (1e-2, 1e-4, 1e-6, 1e-7, 1e-8):
        f = form_factors(scene, rtol)
        error = worst([(f.F[k], v) for k, v in exact.items()])
        closure = float(np.abs(f.background).max())
        yield row("paper's room", f"rtol {rtol:g}", error, f.seconds, closure=closure, stated=float(f.error.max()))
    for patches in (1, 3, 6):
        d = (patches, patches)

        def three(d=d):
            hidden = [ball.shape]
            return [pdm_form_factor(planes[0], planes[k], d, d, 5, hidden) for k in (1, 2)] + [
                pdm_form_factor(planes[0], ball, d, (4, 8))
            ]

        value, seconds = timed(three)
        error = worst(zip(value, list(exact.values())[:3]))
        yield row("paper's room", f"published, {patches * patches} patches", error, seconds)


def squares():
    edge = [Surface(Plane((0, 0, 0), (1, 0, 0), (0, 1, 0))), Surface(Plane((0, 0, 0), (0, 1, 0), (0, 0, 1)))]
    near = [Surface(Plane((0, 0, 0), (1, 0, 0), (0, 1, 0))), Surface(Plane((0, 0, 1e-3), (0, 1, 0), (1, 0, 0)))]
    for name, pair, exact in (
        ("squares sharing an edge", edge, ADJACENT),
        ("squares 1e-3 apart", near, 0.9980056319075797),
    ):
        f = form_factors(Scene(pair))
        yield row(name, "closed form", worst([(f.F[0, 1], exact)]), f.seconds)
        for d in (1, 3, 6):
            value, seconds = timed(pdm_form_factor, *pair, (d, d), (d, d))
            yield row(name, f"published, {d * d} patches", worst([(value, exact)]), seconds)


def patched_cube():
    """216 planes; each face's patches sum to the cube's known factors, every row to 1."""
    patches = [
        Surface(Plane(p.origin + p.u * i / 6 + p.v * j / 6, p.u / 6, p.v / 6))
        for p in cube_planes(0.5)
        for i in range(6)
        for j in range(6)
    ]
    f = form_factors(Scene(patches), 1e-8)
    blocks = f.F.reshape(6, 36, 6, 36).mean(axis=1).sum(axis=2)
    error = worst([(blocks[0, 1], OPPOSITE), *((blocks[0, k], ADJACENT) for k in range(2, 6))])
    closure = float(np.abs(f.F.sum(axis=1) - 1).max())
    exchange = float(np.abs(f.F - f.F.T).max() / f.F.max())
    pair = f.seconds / (216 * 215) * 1e6
    yield row(
        "cube of 216 planes",
        "closed form",
        error,
        f.seconds,
        closure=closure,
        reciprocity=exchange,
        microseconds_a_pair=pair,
    )
    subset = [(0, 36 + 7), (0, 80), (3, 200)]
    value, seconds = timed(lambda: [pdm_form_factor(patches[a], patches[b]) for a, b in subset])
    error = worst([(v, f.F[k]) for v, k in zip(value, subset)])
    yield row("cube of 216 planes", "published, 3 pairs", error, seconds, microseconds_a_pair=seconds / 3 * 1e6)


def crowded_room():
    rng = np.random.default_rng(3)
    grid = [(x, y, z) for x in (-2, 0, 2) for y in (-2, 2) for z in (-1.6, 1.5)]
    balls = [Sphere.at(c, r) for c, r in zip(grid, rng.uniform(0.2, 0.95, 12))]
    screens = [
        Plane((-1, -0.8, -2.5), (1.8, 0.3, 0), (0, 0.2, 4)),
        Plane((0.7, 0.9, -2), (1.2, -0.9, 0.1), (0.1, 0.1, 3)),
    ]
    surfaces = [Surface(s) for s in [*cube_planes(), *balls]] + [s for p in screens for s in both_sides(p)]
    scene = Scene(surfaces)
    f = form_factors(scene, 1e-1)
    exchange = scene.areas[:, None] * f.F
    error = float(np.abs(exchange - exchange.T).max() / exchange.max())
    more = {"closure": float(np.abs(f.background).max()), "sampled": f.counts["sampled"], "exact": f.counts["exact"]}
    yield row("12 balls, 2 screens", "rtol 0.1; error: reciprocity", error, f.seconds, **more)


def contact():
    for gap in (1e-1, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12, 0.0):
        floor = cube_planes()
        f = form_factors(Scene([Surface(s) for s in [*floor, Sphere.at((0, 0, -2 + gap), 1)]]), 1e-3)
        reciprocity = abs(f.F[6, 0] * 4 * np.pi / 36 - f.F[0, 6]) / f.F[0, 6]
        closure = float(np.abs(f.background).max())
        yield row(
            f"ball over floor, gap {gap:g}",
            "rtol 1e-3; error: reciprocity",
            float(reciprocity),
            f.seconds,
            closure=closure,
        )
    for gap in (1e-1, 1e-4, 1e-12, 0.0):
        pair = [Sphere.at((0, 0, -1 - gap / 2), 1), Sphere.at((0, 0, 1 + gap / 2), 1)]
        f = form_factors(Scene([Surface(s) for s in [*cube_planes(), *pair]]), 1e-3)
        closure = float(np.abs(f.background).max())
        error = abs(f.F[6, 7] - f.F[7, 6]) / f.F[6, 7]
        yield row(f"two balls, gap {gap:g}", "rtol 1e-3; error: reciprocity", float(error), f.seconds, closure=closure)
    corner = form_factors(Scene([Surface(s) for s in [*cube_planes(), Sphere.at((-2.5, -2.5, -2.5), 0.5)]]), 1e-3)
    by_symmetry = worst([(corner.F[6, 2], corner.F[6, 0]), (corner.F[6, 5], corner.F[6, 0])])
    closure = float(np.abs(corner.background).max())
    yield row("ball touching three walls", "rtol 1e-3; error: symmetry", by_symmetry, corner.seconds, closure=closure)


def inside():
    f = form_factors(Scene([Surface(Sphere.at((1, 2, 3), 2), side="back")]))
    yield row("inside a sphere", "whole", abs(f.F[0, 0] - 1), f.seconds)
    ball, dome = Sphere.at((0.2, 0.1, 0), 1), Sphere.at((0, 0, 0), 3)
    f = form_factors(Scene([Surface(ball), Surface(dome, side="back")]), 1e-6)
    yield row("ball in a dome", "rtol 1e-6", worst([(f.F[0, 1], 1), (f.F[1, 0], 1 / 9)]), f.seconds)


def around(loops, points=48):
    """Points (n, 3) and steps (n, 3) m of Gauss rules along the edges of loops, holes turning the other way."""
    s, weight = np.polynomial.legendre.leggauss(points)
    begin = np.concatenate(loops)
    along = np.concatenate([np.roll(loop, -1, axis=0) - loop for loop in loops])
    at = begin[:, None] + (s[:, None] + 1) / 2 * along[:, None]
    return at.reshape(-1, 3), (weight[:, None] / 2 * along[:, None]).reshape(-1, 3)


def by_contours(one, other):
    """A_1 F_12 m^2 of two outlines with their holes, apart and in full view of each other: Stokes on both, Sparrow
    1963; no part of what it checks."""
    (p, dp), (q, dq) = around(one), around(other)
    return float((np.log(np.linalg.norm(p[:, None] - q, axis=2)) * (dp @ dq.T)).sum() / (2 * np.pi))


def polygons():
    """Of polygons that are no rectangles: outlines (n, 2) in the plane z = 0, beside those turned over at z = 1."""
    turn = np.pi / 3 * np.arange(6)
    ell = np.array([(0, 0), (2, 0), (2, 0.7), (0.8, 0.7), (0.8, 1.5), (0, 1.5)])
    square, hole = np.array([(0, 0), (3, 0), (3, 3), (0, 3)]), np.array([(1, 2), (2, 2), (2, 1), (1, 1)])
    cases = {
        "triangle, triangle": ([[(0, 0), (1, 0), (0, 1)]], [[(0.2, 0), (1.4, 0.3), (0.5, 1.1)]]),
        "slivers of triangles": ([[(0, 0), (1, 0), (1, 1e-3)]], [[(0, 0.3), (0.9, 0.01), (1, 0)]]),
        "hexagon, hexagon": ([np.column_stack([np.cos(turn), np.sin(turn)])],) * 2,
        "L, L turned": ([ell], [ell[:, ::-1][::-1] + (0.3, -0.2)]),
        "square, square with a square hole": ([square], [square, hole]),
        "both with a square hole": ([square, hole], [square * 0.9, hole + (0.1, 0.2)]),
    }
    for name, pair in cases.items():
        for slant in (0.0, 0.4):  # the upper one also tilted
            low, high = ([np.array(loop, float) for loop in loops] for loops in pair)
            low = [np.column_stack([loop, 0 * loop[:, 0]]) for loop in low]
            high = [np.column_stack([loop, 1 + slant * loop[:, 0]])[::-1] for loop in high]
            shapes = [Polygon(loops[0], loops[1:]) for loops in (low, high)]
            f = form_factors(Scene([Surface(shape) for shape in shapes]), 1e-10)
            exact = by_contours(low, high)
            pairs = [(f.F[0, 1] * shapes[0].area, exact), (f.F[1, 0] * shapes[1].area, exact)]
            yield row(name + ", tilted" * (slant > 0), "rtol 1e-10; beside contours", worst(pairs), f.seconds)
    wall = Plane((0, 0, 0), (0, 1, 0), (0, 0, 1))
    cut = [Polygon([(0, 0, 0), (1, 0, 0), (0.4, 1, 0), (0, 1, 0)]), Polygon([(1, 0, 0), (1, 1, 0), (0.4, 1, 0)])]
    f = form_factors(Scene([Surface(wall), *map(Surface, cut)]), 1e-10)
    yield row("square cut askew, beside a square", "closed form", worst([(f.F[0, 1:].sum(), ADJACENT)]), f.seconds)


def main(output):
    rows = []
    for cases in (seed_room, squares, patched_cube, polygons, crowded_room, contact, inside):
        for result in cases():
            rows.append(result)
            case, method, error, seconds, *more = result.values()
            more = " ".join(f"{k} {v:.2g}" for k, v in zip(list(result)[4:], more))
            print(f"{case:27} {method:32} {error:9.1e} {seconds:8.3f} s  {more}", flush=True)
    save(output, {"about": machine(), "rows": rows})


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "build/bench/form_factors.json")
