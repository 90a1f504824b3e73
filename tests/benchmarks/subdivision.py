"""Subdivide for the Bake: vertices that a floor of four needs under Cornell's lamp, evenly and where the light bends.

    PYTHON_WITH_BPY tests/benchmarks/subdivision.py [OUTPUT.json]

Error between vertices: relative L2 of all light, at 4,000 random points that neither way has seen; the report's own 32
on a floor of four vertices are off by a quarter.
`uniform` N: each face of the floor as N x N, up to the first that is enough for 1 %; `asked`: what Uniform takes by
itself from the report. CPU seconds of subdividing, the solving in them where it solves again.
"""

import importlib
import sys
import time

import bpy
from output import ROOT, machine, save

sys.path.insert(0, str(ROOT / "tests" / "demo"))  # before the benchmarks' own module of the same name
import rooms as demo  # noqa: E402
from lights import extension  # noqa: E402

TARGETS = (0.01,)
SOLVED = 0.01  # the bake's own target: what is between vertices is told apart from it
PARTS = 20, 24, 26, 28, 29, 30, 31, 32, 36, 40, 48


def floor():
    demo.build("cornell", cells=1)
    made = bpy.data.objects["Floor"]
    bpy.ops.object.select_all(action="DESELECT")
    made.select_set(True)
    return made


def bake(target):
    """The floor alone gets colours: the error between vertices is its own."""
    bpy.ops.pdm.bake(objects="SELECTED", target_error=target)
    return bpy.context.scene.pdm_radiosity.report()


def between(made):
    looks = importlib.import_module("pdm_extension.operators.baking.between_vertices")
    usual, looks.MANY = looks.MANY, looks.MOST
    found = {"vertices": len(made.data.vertices), "between": bake(SOLVED)["between_vertices"]}
    looks.MANY = usual
    return found


def subdivided(target, **settings):
    made = floor()
    before = bake(target)["between_vertices"]
    start = time.process_time()
    bpy.ops.pdm.subdivide(objects="SELECTED", **settings)
    return {"seconds": time.process_time() - start, "before": before, **between(made)}


def least(target):
    """The first N of PARTS that is enough."""
    rows = []
    for parts in PARTS:
        made = floor()
        bpy.ops.pdm.subdivide(objects="SELECTED", times=parts)
        rows.append({"N": parts, **between(made)})
        if rows[-1]["between"] <= target:
            break
    return rows


def main(output=ROOT / "docs" / "benchmarks" / "subdivision.json"):
    extension()
    sys.modules["pdm_extension"].register()
    rows = []
    for target in TARGETS:
        row = {
            "target": target,
            "adaptive": subdivided(target, method="ADAPTIVE"),
            "asked": subdivided(target, method="UNIFORM"),
        }
        print(row, flush=True)
        rows.append(row)
    uniform = least(0.01)
    sys.modules["pdm_extension"].unregister()
    save(output, {"machine": machine(), "blender": bpy.app.version_string, "floor": rows, "uniform": uniform})
    for row in uniform:
        print(row)


if __name__ == "__main__":
    main(*sys.argv[1:])
