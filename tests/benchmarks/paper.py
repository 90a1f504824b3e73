"""The published paper's tables, checked: prints them, and writes docs/paper.md.

    python tests/benchmarks/paper.py [OUTPUT.json [PAPER.md]]

Its room: a unit sphere centred in a closed cube of side 6. Per line: the printed value, what the same recipe gives here
(pdm_form_factor), the exact one and form_factors'; then the row sum of a face against patches and seconds, with and
without the sphere; then two unit squares that share an edge.
"""

import sys
import time
from pathlib import Path

from output import machine, save

from pdm_core import Plane, Scene, Sphere, Surface, form_factors, pdm_form_factor

A = 3.0
EDGES = [
    ((-A, -A, -A), (6, 0, 0), (0, 6, 0)),
    ((-A, -A, A), (0, 6, 0), (6, 0, 0)),
    ((-A, -A, -A), (0, 6, 0), (0, 0, 6)),
    ((A, -A, -A), (0, 0, 6), (0, 6, 0)),
    ((-A, A, -A), (6, 0, 0), (0, 0, 6)),
    ((-A, -A, -A), (0, 0, 6), (6, 0, 0)),
]
BALL = Sphere.at((0, 0, 0), 1)
ADJACENT, OPPOSITE, SPHERE_FACE = 0.1968931067, 0.1542499315, 1 / 6
SQUARES = 0.200043776075403  # perpendicular unit squares with a common edge
PRINTED = {  # (what, patches a side of a face): the paper's figure
    ("face to adjacent face", 3): 0.22249, ("face to adjacent face", 6): 0.20974,
    ("face to opposite face", 3): 0.15401, ("face to opposite face", 6): 0.15427,
    ("sphere to face", 3): 0.16735, ("sphere to face", 6): 0.16683,
    ("sphere to side face", 3): 0.16693, ("sphere to side face", 6): 0.16673,
}  # fmt: skip
PRINTED_SUMS = {9: 1.1, 36: 1.05}
OF_BALL = {3: (4, 8), 6: (8, 8)}  # patches of the sphere to so many a side of a face; its poles look at two faces


def faces():
    return [Surface(Plane(*edges)) for edges in EDGES]


def recipe(what, side):
    """The published rule at the paper's patches: value and seconds."""
    room, ball = faces(), Surface(BALL)
    start = time.process_time()
    if what.startswith("sphere"):
        value = pdm_form_factor(ball, room[2 if "side" in what else 0], OF_BALL[side], (side, side))
    else:
        other = room[1] if "opposite" in what else room[2]
        value = pdm_form_factor(room[0], other, (side, side), (side, side), 5, [BALL])
    return value, time.process_time() - start


def printed_values():
    start = time.process_time()
    factors = form_factors(Scene([*faces(), Surface(BALL)]), 1e-8)
    seconds = time.process_time() - start
    names = ("face to adjacent face", "face to opposite face", "sphere to face", "sphere to side face")
    ours = dict(zip(names, (factors.F[0, 2], factors.F[0, 1], factors.F[6, 0], factors.F[6, 2])))
    exact = dict(zip(names, (ADJACENT, OPPOSITE, SPHERE_FACE, SPHERE_FACE)))
    for (what, side), value in PRINTED.items():
        same, took = recipe(what, side)
        yield {
            "what": what, "patches": side * side, "paper": value, "recipe": same, "recipe_seconds": took,
            "exact": exact[what], "ours": float(ours[what]), "ours_seconds": seconds,
        }  # fmt: skip


def row_sums():
    """The sum over all targets from one face, by patches: with the sphere, and in the empty cube."""
    for hidden in (True, False):
        for side in (1, 2, 3, 6, 10):
            room, start = faces(), time.process_time()
            block = [BALL] if hidden else []
            total = sum(pdm_form_factor(room[0], f, (side, side), (side, side), 5, block) for f in room[1:])
            total += pdm_form_factor(room[0], Surface(BALL), (side, side), (4, 8)) if hidden else 0.0
            yield {"sphere": hidden, "patches": side * side, "sum": total, "seconds": time.process_time() - start}


def shared_edge():
    one = Surface(Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    two = Surface(Plane((0, 0, 0), (0, 1, 0), (0, 0, 1)))
    for side in (1, 3, 6, 12):
        value = pdm_form_factor(one, two, (side, side), (side, side))
        yield {"patches": side * side, "error": value / SQUARES - 1}


TEXT = """# The paper revisited

The parametric differential method was published by Baranoski (UFRGS, 1992; in Portuguese). Its experiment is a unit
sphere centred in a closed cube of side 6, patches of 5 x 5 Gauss points each. This page sets its tables beside the same
recipe, carried out anew, and beside exact values. One command makes every figure here:
`python tests/benchmarks/paper.py` (Python {python}, numpy {numpy}, one thread).

## Its form factors

| factor | patches of a face | the paper | the same recipe here | CPU s | exact | `form_factors`, off by |
|---|---|---|---|---|---|---|
{printed}

The sphere has 32 and 64 patches; its poles look at two faces, and *side faces* are the other four. The paper gives one
figure for each pair of faces; those of one kind are equal, there and here. All form factors of the room at once, to
1e-8, take `form_factors` {ours_seconds:.2f} s.

## Row sums

What leaves a face of a closed room must arrive: its factors sum to 1. By the recipe:

| patches of a face | the paper | with the sphere | CPU s | empty cube | CPU s |
|---|---|---|---|---|---|
{sums}

The sum nears 1 as one over the patches of a side, while the work grows as their fourth power: halving the error costs
16 times the time.

## What it got right

- The rule itself: sphere to face and opposite faces are right to a thousandth with nine patches.
- Parametric surfaces as they are, the unnormalised normal as the area element, no polygons in between: that is what
  this extension is built on.
- Occlusion of a pair only by what can lie between.

## What it attributed wrongly

- It blames occlusion for the row sum of 1.1. The empty cube has the same: the **shared edge** does it, where the
  integrand is singular. Two unit squares at a right angle with a common edge, by the same rule:

| patches | error |
|---|---|
{edge}

  An exact inner integral over one of the two, and an ordinary Gauss rule over the other, does not have it: that is what
  `form_factors` and `solve` do.
- A row sum that is off by d shifts the mean radiance by about rho d / (1 - rho): at a reflectance of .8 the row sum of
  {nine:.2f} costs {shift:.0%}. Dividing the row by its sum hides that and does not mend it: the adjacent faces keep too
  much.

## Misprints

Its equation (1) lost a dt; r in (5) means r squared on the right; and it tests the whole line through two points for
occluders, not the segment between them, which is right only inside its box.
"""


def page(rows):
    printed = "\n".join(
        "| {what} | {patches} | {paper:.5f} | {recipe:.5f} | {recipe_seconds:.2f} | {exact:.10f} | {0:.0e} |".format(
            abs(row["ours"] - row["exact"]), **row) for row in rows["printed"]
    )  # fmt: skip
    by = {(row["sphere"], row["patches"]): row for row in rows["row_sums"]}
    sums = "\n".join(
        f"| {n} | {PRINTED_SUMS.get(n, '')} | {by[True, n]['sum']:.4f} | {by[True, n]['seconds']:.2f} "
        f"| {by[False, n]['sum']:.4f} | {by[False, n]['seconds']:.2f} |" for _, n in by if _
    )  # fmt: skip
    edge = "\n".join(f"| {row['patches']} | {row['error']:+.1%} |" for row in rows["shared_edge"])
    nine, about = by[True, 9]["sum"], machine()
    return TEXT.format(
        printed=printed, sums=sums, edge=edge, nine=nine, shift=0.8 * (nine - 1) / 0.2, python=about["python"],
        numpy=about["numpy"], ours_seconds=rows["printed"][0]["ours_seconds"],
    )  # fmt: skip


def main(output="build/bench/paper.json", text=None):
    rows = {"printed": list(printed_values()), "row_sums": list(row_sums()), "shared_edge": list(shared_edge())}
    for row in rows["printed"]:
        print("{what:22} {patches:3} patches: paper {paper:.5f}, same recipe {recipe:.5f} ({recipe_seconds:.2f} s), "
              "exact {exact:.10f}, ours off by {0:.0e}".format(abs(row["ours"] - row["exact"]), **row))  # fmt: skip
    for row in rows["row_sums"]:
        print("row sum {0}: {patches:3} patches {sum:.4f} in {seconds:.2f} s".format(
            "with the sphere" if row["sphere"] else "of the empty cube", **row))  # fmt: skip
    for row in rows["shared_edge"]:
        print("squares with a common edge, {patches:3} patches: {error:+.1%}".format(**row))
    save(output, {"about": machine(), **rows})
    if text:
        Path(text).write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
