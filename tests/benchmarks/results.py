"""Error against run time of the report's scenes by `bpy.ops.pdm.convergence`, beside the published method and Cycles.

    PYTHON_WITH_BPY tests/benchmarks/results.py FOLDER [SECONDS [SCENE ...]]

PDM_ZIP names the built extension (tests/run.py sets it, `make report`). Writes FOLDER/<scene>.html, .json, .csv and
README.md, the tables side by side. SCENES is the one list: later scenes are added there.
"""

import json
import os
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "demo"), str(ROOT / "tests" / "benchmarks")]

import rooms as demo_rooms  # noqa: E402

MODULE = "bl_ext.user_default.pdm_radiosity"
SECONDS, CELLS = 120.0, 24
TIGHTEST = 0.00125
KINDS = ("html", "json", "csv")


def demo(name):
    # tests/benchmarks has a module of the same name: the demo's was imported first
    demo_rooms.build(name, cells=CELLS)


def thirteen_balls():
    """The room of scenes.thirteen_spheres from Blender's own primitives."""
    from output import machine  # noqa: F401  puts the core on the path
    from scenes import thirteen_spheres

    from pdm_core import Sphere

    bpy.ops.wm.read_homefile(use_empty=True)
    for surface in thirteen_spheres().surfaces:
        emission = surface.emission if surface.emission.any() else None
        material = demo_rooms.diffuse(surface.name, surface.reflectance, emission)
        if isinstance(surface.shape, Sphere):
            demo_rooms.ball(surface.name, surface.shape.origin, surface.shape.semi_axes[0], material)
        else:
            demo_rooms.wall(surface.name, surface.shape.origin, surface.shape.u, surface.shape.v, material, CELLS)


def default_primitives():
    """Add > Plane, Cube, UV Sphere and one more Plane as lamp: moved apart, nothing else touched."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=10)
    bpy.ops.mesh.primitive_cube_add(location=(1.8, 0, 1))
    bpy.ops.mesh.primitive_uv_sphere_add(location=(-1.8, 0, 1))
    bpy.ops.mesh.primitive_plane_add(size=2, location=(0, 0, 5))
    bpy.context.object.data.materials.append(demo_rooms.diffuse("Lamp", (0.8, 0.8, 0.8), (10, 10, 10)))


SCENES = {
    "paper_room": ("The paper's room, a ball in a cube", lambda: demo("paper")),
    "cornell": ("Cornell box with two balls", lambda: demo("cornell")),
    "thirteen_balls": ("13 balls in a room, one the lamp", thirteen_balls),
    "default_primitives": ("Plane, cube, UV sphere and a plane as lamp", default_primitives),
}


def run(name, folder, seconds):
    """The result, and its page renamed after the scene."""
    SCENES[name][1]()
    bpy.context.scene.name = SCENES[name][0]  # the title of its page
    bpy.ops.pdm.convergence(time_limit=seconds, tightest=TIGHTEST, published=True, cycles=True, folder=str(folder))
    for kind in KINDS:
        os.replace(folder / f"convergence.{kind}", folder / f"{name}.{kind}")
    return json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))


def table(results):
    """README.md of the folder."""
    about = next(iter(results.values()))["about"]
    lines = [
        "# Error against run time",
        "",
        f"Made by `make report`: Blender {about['blender']}, numpy {about['numpy']}, {about['cores']} cores, "
        f"{about['date']}. Each page has the plot, all figures and where the error sits.",
        "",
        "Errors are relative L2 errors of the reflected light against the tightest run of *this bake*, whose own "
        "stated error is the floor: below it differences mean nothing. This bake and the published method are measured "
        "over all surfaces, Cycles at the baked vertices; its noise and what is left, the facets' bias, apart.",
    ]
    for name, result in results.items():
        lines += ["", f"## [{SCENES[name][0]}]({name}.html)", "", f"Floor {result['floor']:.2%}.", ""]
        lines += ["| method | setting | seconds | stated | measured | noise |", "|---|---|---|---|---|---|"]
        for row in result["runs"]:
            measured = row["measured"] or {}
            error = (measured.get("surfaces") or measured.get("vertices") or {}).get("l2")
            texts = [f"{v:.2%}" if v is not None else "" for v in (row["stated"], error, row.get("noise"))]
            lines.append(f"| {row['method']} | {row['setting']} | {row['seconds']:.2f} | {' | '.join(texts)} |")
    lines += ["", "## Where ours loses", "", *(f"- {text}" for text in losses(results)), ""]
    return "\n".join(lines)


def losses(results):
    """Runs of others that are both quicker and better than every run of this bake that is as quick."""
    found = []
    for name, result in results.items():
        mine = [(r["seconds"], r["stated"] if r["reference"] else r["measured"]["surfaces"]["l2"])
                for r in result["runs"] if r["method"] == "this bake"]  # fmt: skip
        for row in result["runs"]:
            if row["method"] == "this bake":
                continue
            error = (row["measured"].get("surfaces") or row["measured"]["vertices"])["l2"]
            best = min((e for s, e in mine if s <= row["seconds"]), default=float("inf"))
            if error < best:
                first = f"ours has {best:.1%} by then" if best < float("inf") else "ours has nothing by then"
                what = f"{row['method']}, {row['setting']}, {row['seconds']:.2f} s: {error:.1%}"
                found.append(f"{SCENES[name][0]}: {what}; {first}")
    return found or ["In none of these scenes: at each run of the others this bake has a smaller error by then."]


def main(folder="build/results", seconds=SECONDS, *names):
    folder = Path(folder)
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["PDM_ZIP"], repo="user_default", enable_on_install=True
    )
    try:
        results = {name: run(name, folder, float(seconds)) for name in names or SCENES}
    finally:
        bpy.ops.preferences.addon_disable(module=MODULE)
    text = table(results)
    (folder / "README.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
