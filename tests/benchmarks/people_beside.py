"""The people's scenes: each saved by Blender, baked as it comes by the built zip, and beside Cycles' vertex bake.

    python tests/benchmarks/people_beside.py [SCENE ...]      all by default; about 40 minutes

Writes docs/benchmarks/people_scenes.json (what is there of other scenes and versions stays) and, into build/people, the
.blend files and pictures: ours, Cycles', and their signed difference where grey is none.
L2 over face corners by area, relative to what is not emitted there: ours against the mean of two of Cycles' bakes;
noise is that mean's own. l2_elsewhere leaves out the corners at which the two differ by definition: what lies against
another object, which Cycles bakes as if it were not there or all black, and normals bent over a sharp edge,
which Cycles lights from below the face's horizon.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUTPUT = ROOT / "docs" / "benchmarks" / "people_scenes.json"
FOLDER = Path(os.environ.get("PEOPLE", ROOT / "build" / "people"))
NAMES = (
    "kitchen", "attic", "gallery", "dungeon", "stairs", "street", "desk", "cornell", "suzanne", "product", "level",
    "terrain",
)  # fmt: skip
REFINED = ("cornell", "level")  # as coarse as people have them: baked, given vertices by Subdivide, baked again
# s of CPU: what takes no longer at 4 % is also baked at 2 %, by the newest version
CHEAP = float(os.environ.get("CHEAP", 5))
SECONDS = float(os.environ.get("CYCLES_SECONDS", 40))  # of each of Cycles' two bakes, about
TOUCHING, BENT = 1e-4, 0.35  # m of another object; radians of a normal from its face's
LONGEST = float(os.environ.get("LONGEST", 1800))  # s, one scene in one version
NEWEST = "5.2"
MODULE = "bl_ext.user_default.pdm_radiosity"


def main(*names):
    sys.path.insert(0, str(ROOT / "tests"))
    import run

    FOLDER.mkdir(parents=True, exist_ok=True)
    versions = os.environ.get("VERSIONS", "blender-4.2 blender-5.2").split()
    package = run.build_zip()
    for name in names or NAMES:
        for version in versions:
            with run.fresh_blender(package) as environment:
                python = run.venv(version, *run.BLENDER[version])
                words = [python, __file__, "--inside", name]
                try:
                    subprocess.run(words, env={**environment, "OPENBLAS_NUM_THREADS": "1"}, timeout=LONGEST)
                except subprocess.TimeoutExpired:
                    print(f"{name}, {version}: not done within {LONGEST} s", flush=True)


def inside(name):
    import bpy

    bpy.ops.extensions.package_install_files(
        filepath=os.environ["PDM_ZIP"], repo="user_default", enable_on_install=True
    )
    try:
        work(name)
    finally:
        bpy.ops.preferences.addon_disable(module=MODULE)


def work(name):
    import bpy
    import numpy as np
    import people_scenes

    version = ".".join(map(str, bpy.app.version[:2]))
    name_here = name if version == NEWEST else f"{name}-{version}"  # older ones do not read what newer ones save
    path = FOLDER / f"{name_here}.blend"
    if not path.exists():
        people_scenes.build(name, path)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    rows = [ours(0.04)]
    if name in REFINED:
        rows[0]["l2"], rows[0]["noise"] = None, None
        bpy.ops.pdm.subdivide()
        path = FOLDER / f"{name}-{version}-finer.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        rows.append(ours(0.04) | {"subdivided": True})
    first = rows[-1]
    colours = corners("Radiosity")
    theirs = cycles(name_here, path)
    compare(first, colours, theirs)
    np.savez(FOLDER / f"ours-{name}-{version}.npz", **colours)
    if version != NEWEST:
        return keep(name, version, rows)
    if first["cpu_seconds"] < CHEAP:
        rows.append(ours(0.02) | {"subdivided": name in REFINED})
        compare(rows[-1], corners("Radiosity"), theirs)
    keep(name, version, rows)
    pictures(f"{name}-{version}", path, colours, theirs)


def keep(name, version, rows):
    from output import machine, save

    for row in rows:
        print(name, version, json.dumps({k: v for k, v in row.items() if k != "counts"}), flush=True)
    found = json.loads(OUTPUT.read_text()) if OUTPUT.exists() else {"scenes": {}}
    found["machine"] = machine()
    found["scenes"].setdefault(name, {})[version] = rows
    save(OUTPUT, found)


def ours(target):
    import bpy

    cpu, wall = time.process_time(), time.perf_counter()
    bpy.ops.pdm.bake(target_error=target)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    report = bpy.context.scene.pdm_radiosity.report()
    (FOLDER / f"report-{Path(bpy.data.filepath).stem}-{bpy.app.version[0]}-{target}.json").write_text(
        json.dumps(report, indent=1)
    )
    kinds = [entry["exactness"] for entry in report["objects"]]
    return {
        "target": target, "stated": report["error"], "between_vertices": report["between_vertices"], "seconds": wall,
        "cpu_seconds": cpu, "parts": {k: round(v, 2) for k, v in report["seconds"].items()},
        "vertices": report["vertices"], "exact": kinds.count("exact"), "approximate": kinds.count("approximate"),
        "refused": report["refused"], "not_baked": [e["name"] for e in report["objects"] if not e["baked"]],
        "warnings": report["warnings"], "counts": report["counts"],
    }  # fmt: skip


def corners(attribute):
    """{object name: (corners, 3)} of the meshes that have the attribute, points' colours at their corners."""
    import bpy
    import numpy as np

    found = {}
    for obj in bpy.context.view_layer.objects:
        made = obj.data.color_attributes.get(attribute) if obj.type == "MESH" else None
        if made is None:
            continue
        values = np.empty(4 * len(made.data), np.float32)
        made.data.foreach_get("color", values)
        values = values.reshape(-1, 4)[:, :3].astype(float)
        if made.domain == "POINT":
            vertex = np.empty(len(obj.data.loops), np.int32)
            obj.data.loops.foreach_get("vertex_index", vertex)
            values = values[vertex]
        found[obj.name] = values
    return found


def cycles(name, path):
    """{"values": {object: (2, corners, 3)}, "glow": {object: (corners, 3)}, "samples", "seconds"}: radiance from two
    seeds and what of it is emitted, kept in FOLDER."""
    import bpy
    import numpy as np

    kept = FOLDER / f"cycles-{name}.npz"
    if not kept.exists():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
        scene.render.engine, scene.render.bake.target = "CYCLES", "VERTEX_COLORS"
        options = scene.cycles
        options.device = "CPU"
        options.use_adaptive_sampling = options.use_denoising = False
        options.use_light_tree = len([o for o in scene.objects if o.type == "LIGHT"]) > 4
        options.max_bounces = options.diffuse_bounces = 128
        options.sample_clamp_direct = options.sample_clamp_indirect = 0.0
        names = [o.name for o in bpy.context.view_layer.objects if o.type == "MESH"]
        for obj in list(bpy.context.view_layer.objects):
            obj.select_set(obj.name in names)
        for key in names:
            obj = bpy.data.objects[key]
            if obj.data.users > 1:
                obj.data = obj.data.copy()
            attributes = obj.data.color_attributes
            attributes.active_color = attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
            bpy.context.view_layer.objects.active = obj

        def bake(samples, seed):
            options.samples, options.seed = samples, seed
            start = time.perf_counter()
            bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT", "COLOR"})
            return corners("Cycles"), time.perf_counter() - start

        options.samples = 1
        bpy.ops.object.bake(type="EMIT")
        glow = corners("Cycles")
        bake(1, 0)
        base = bake(1, 0)[1]
        each = max((bake(9, 0)[1] - base) / 8, 1e-4)
        samples = int(min(max((SECONDS - base) / each, 16), 4096))
        (one, seconds), (other, again) = bake(samples, 1), bake(samples, 2)
        arrays = {key: np.stack([one[key], other[key]]) + glow[key] for key in names}
        named = {f"{part}:{k}": v for part, each in (("v", arrays), ("g", glow)) for k, v in each.items()}
        np.savez(kept, samples=samples, seconds=(seconds + again) / 2, **named)
    with np.load(kept) as data:
        values, glow = ({key[2:]: data[key] for key in data.files if key.startswith(part)} for part in ("v:", "g:"))
        return {
            "values": values, "glow": glow, "samples": int(data["samples"]), "seconds": float(data["seconds"])
        }  # fmt: skip


def weights(obj):
    """(corners,) m^2"""
    import numpy as np

    mesh = obj.data
    counts, areas = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("loop_total", counts)
    mesh.polygons.foreach_get("area", areas)
    return np.repeat(areas / counts, counts)


def alike(objects):
    """{name: (corners,) bool} of those that mean the same to both: free of other objects, as smooth as they are."""
    import bpy
    import numpy as np
    from mathutils.bvhtree import BVHTree

    places, trees = {}, {}
    for obj in bpy.context.view_layer.objects:
        if obj.type == "MESH":
            places[obj.name] = [obj.matrix_world @ vertex.co for vertex in obj.data.vertices]
            trees[obj.name] = BVHTree.FromPolygons(places[obj.name], [face.vertices for face in obj.data.polygons])
    found = {}
    for name in objects:
        others, mesh = [tree for other, tree in trees.items() if other != name], bpy.data.objects[name].data
        free = np.array([all(t.find_nearest(at, TOUCHING)[0] is None for t in others) for at in places[name]])
        vertex = np.array([loop.vertex_index for loop in mesh.loops])
        shown = np.array([corner.vector for corner in mesh.corner_normals])
        own = np.repeat([face.normal for face in mesh.polygons], [face.loop_total for face in mesh.polygons], axis=0)
        found[name] = free[vertex] & ((shown * own).sum(axis=1) > np.cos(BENT))
    return found


def compare(row, colours, theirs):
    import bpy
    import numpy as np

    apart = size = noise = apart_elsewhere = size_elsewhere = 0.0
    same = alike(colours)
    each = {}
    for name, values in colours.items():
        pair = theirs["values"][name]
        if pair.shape[1] != len(values):
            continue
        w = weights(bpy.data.objects[name])[:, None]
        good = np.isfinite(pair).all(axis=(0, 2))
        mean, w, reflected = pair[:, good].mean(axis=0), w[good], (pair.mean(axis=0) - theirs["glow"][name])[good]
        a, s = (w * (values[good] - mean) ** 2).sum(), (w * reflected**2).sum()
        n = (w * (pair[0][good] - pair[1][good]) ** 2).sum() / 4
        apart, size, noise = apart + a, size + s, noise + n
        bias = (w * (values[good] - mean)).sum() / max((w * mean).sum(), 1e-30)
        each[name] = [float(np.sqrt(v / max(s, 1e-30))) for v in (a, n)] + [float(bias)]
        w = w * same[name][good, None]
        apart_elsewhere += (w * (values[good] - mean) ** 2).sum()
        size_elsewhere += (w * reflected**2).sum()
    row["l2"], row["noise"] = (float(np.sqrt(v / max(size, 1e-30))) for v in (apart, noise))
    row["l2_elsewhere"] = float(np.sqrt(apart_elsewhere / max(size_elsewhere, 1e-30)))
    row["cycles"] = {"samples": theirs["samples"], "seconds": theirs["seconds"]}
    row["mean_off"] = {k: [round(x, 4) for x in v] for k, v in sorted(each.items(), key=lambda i: -i[1][0])[:6]}


def pictures(stem, path, colours, theirs):
    import importlib

    import bpy
    import numpy as np

    render_image = importlib.import_module(f"{MODULE}.operators.reporting.render_image").render_image
    bpy.ops.wm.open_mainfile(filepath=str(path))
    mean = {name: np.nan_to_num(v.mean(axis=0)) for name, v in theirs["values"].items()}
    areas = np.concatenate([weights(bpy.data.objects[name]) for name in mean])
    bright = np.concatenate([v.max(axis=1) for v in mean.values()])
    order = np.argsort(bright)
    gain = 0.85 / bright[order][np.searchsorted(np.cumsum(areas[order]), 0.97 * areas.sum())]
    shown = {"Ours": {k: gain * v for k, v in colours.items()}, "Cycles": {k: gain * v for k, v in mean.items()}}
    shown["Apart"] = {
        k: np.clip(0.2 + 2.0 * (shown["Ours"][k] - v) / (0.1 + v), 0, 1)
        for k, v in shown["Cycles"].items()
        if k in colours and len(colours[k]) == len(v)
    }
    for attribute, values in shown.items():
        for name, rows in values.items():
            mesh = bpy.data.objects[name].data
            if attribute in mesh.color_attributes:
                mesh.color_attributes.remove(mesh.color_attributes[attribute])
            made = mesh.color_attributes.new(attribute, "FLOAT_COLOR", "CORNER")
            if len(made.data) == len(rows):
                data = np.ones((len(rows), 4), np.float32)
                data[:, :3] = rows
                made.data.foreach_set("color", data.ravel())
        render_image(bpy.context, attribute, str(FOLDER / f"{stem}-{attribute.lower()}.png"))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        inside(sys.argv[2])
    else:
        main(*sys.argv[1:])
