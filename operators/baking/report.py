"""The report of a bake: a dict for JSON, and its one line."""

import math
import tomllib
from dataclasses import asdict
from pathlib import Path

import bpy
import numpy as np

from ..reading.read_scene import some
from ..words import many, say
from .left_out import left_out, other

SCHEMA = 1
MOST_NAMED = 4  # objects in one warning
NEARLY_ALL = 0.95  # of the colours, which an exposure should keep below white
FORETOLD = (0.01, 0.005, 0.0025)  # targets
MANIFEST = Path(__file__).parents[2] / "blender_manifest.toml"


def bake_report(context, settings, reading, solution, between, items, points, seconds):
    """dict of plain JSON types (infinite and undefined numbers are None).

    schema: rises where a key goes or comes to mean something else, see docs/report.schema.json
    versions {extension, blender, numpy}; file, scene; settings (those of bpy.ops.pdm.bake)
    objects [{name, kind, label, exactness, baked, reason, domain, vertices, between, error}]: every recognised object;
        exactness 'exact' or 'approximate'; the last four if baked; between: its part of between_vertices; error: its
        own, relative to its own light; of one too coarse also finer [[N, between if each face were N x N]]
    shining {count, sky}: objects and lights that shine, whether light comes from outside; facing_away [name]: objects
        that light comes to only from behind
    refused [{name, reason}], the reason goes on after the name; hidden: mesh objects that a render does not show
    lights [{name, type}]: lamps that shine, and suns in the world's map, by Blender's types
    warnings [text]
    left_out [{kind, name, what, effect, advice}]: refused objects, those without colours, and what warnings tell
    vertices: how many the baked meshes have; colours: how many values were written to points or corners
    above_one {share, exposure}: of the colours, which views show white; the exposure at which hardly any is, stops
    error: estimated relative error of the radiance; error_parts {name: part}; history [[seconds, error]]
    foretold {target: seconds}: what solving to it may take, from the history
    heat_map {attribute, top}, or None: the estimated error as colours, and what the last one of the ramp stands for
    between_vertices: the same of colours interpolated between the vertices, measured at points within the faces
    seconds {read, solve, evaluate, check, write, total}; plan [text]; counts {name: number}
    """
    errors = [solution.error_over([surface for surface, _, _ in p.runs]) for p in points]
    written = {item.object_name: rest for item, *rest in zip(items, items, between.parts, errors, strict=True)}
    found = scan_result(reading, written)
    objects, warnings = found["objects"], found["warnings"]
    warnings += [*solution.warnings, *_own_warnings(settings, between, items), *_uncoloured(objects)]
    report = {
        "schema": SCHEMA,
        "versions": {"extension": version(), "blender": bpy.app.version_string, "numpy": np.__version__},
        "file": bpy.data.filepath,
        "scene": context.scene.name,
        "settings": asdict(settings),
        **found,
        "left_out": left_out(objects, found["refused"], warnings),
        "vertices": sum(entry["vertices"] for entry in objects),
        "colours": sum(len(item.colours) for item in items),
        "above_one": _above_one(settings, items),
        "error": solution.error,
        "between_vertices": between.error,
        "error_parts": dict(solution.error_parts),
        "history": [list(entry) for entry in solution.history],
        "foretold": {f"{target:g}": solution.seconds_to(target) for target in FORETOLD},
        "seconds": {**seconds, "total": sum(seconds.values())},
        "plan": list(solution.plan.lines),
        "counts": dict(solution.counts),
    }
    return plain(report)


def scan_result(reading, written=None):
    """What the sidebar lists before a bake: the same entries as in a report; written {name: of those baked}."""
    return {
        "objects": [_object_entry(o, *(written or {}).get(o.name, ())) for o in reading.objects],
        "refused": [{"name": name, "reason": reason} for name, reason in reading.refused],
        "hidden": reading.hidden,
        "lights": [{"name": name, "type": kind} for name, kind in reading.lights],
        "warnings": list(reading.warnings),
    }


def one_line(report):
    """What was done, for the status bar and the terminal."""
    baked = sum(entry["baked"] for entry in report["objects"])
    text = say(
        "Baked {}, {}: estimated error {}, {} s; between vertices {}",
        many(baked, "object", "objects"),
        many(report["vertices"], "vertex", "vertices"),
        percent(report["error"]),
        f"{report['seconds']['total']:.2f}",
        percent(report["between_vertices"]),
    )
    refused = len(report["refused"])
    extra = [
        (refused, ("object refused", "objects refused")),
        (len(report["left_out"]) - refused, ("thing left out or approximated", "things left out or approximated")),
        (len(other(report["warnings"])), ("warning", "warnings")),
    ]
    return "; ".join([text, *(many(n, *words) for n, words in extra if n)])


def percent(error):
    """A relative error as text; None and inf are unknown."""
    if error is None or not math.isfinite(error):
        return "unknown"
    return f"{100 * error:,.0f} %" if error >= 0.995 else f"{100 * error:.2g} %"


def duration(seconds):
    """12 s, 2 min 5 s, 1 h 44 min, 3 min"""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    large, small = (whole // 60, whole % 60) if whole < 3600 else (whole // 3600, whole % 3600 // 60)
    units = ("min", "s") if whole < 3600 else ("h", "min")
    return f"{large:,} {units[0]}" + (f" {small} {units[1]}" if small else "")


def roughly(seconds):
    """The same of what is only foretold: whole minutes, and of hours tens of them"""
    step = 1 if seconds < 60 else 60 if seconds < 3600 else 600
    return duration(step * round(seconds / step))


def counted(number, one, many=None):
    """1 object, 2,000 objects"""
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def version():
    """The extension's version, from its manifest."""
    return tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]


def _object_entry(read, item=None, between=0.0, error=0.0):
    return {
        "name": read.name,
        "kind": read.kind,
        "label": read.label,
        "exactness": read.exactness,
        "baked": item is not None,
        "reason": read.reason,
        "domain": item.domain if item else "",
        "vertices": len(read.base.vertices) if item else 0,
        "between": between,
        "error": error,
    }


def _above_one(settings, items):
    most = np.concatenate([item.colours[:, :3].max(axis=1) for item in items])
    stops = math.log2(max(np.quantile(most, NEARLY_ALL), 1.0))
    return {"share": (most > 1).mean(), "exposure": round(settings.exposure - math.ceil(10 * stops) / 10, 1)}


def _own_warnings(settings, between, items):
    warnings = []
    if not any(item.colours[:, :3].any() for item in items):
        warnings.append("All is black: no light comes to the baked sides; see where lights look and what hides them")
    coarse = between.too_coarse(settings.target_error)
    if len(coarse):
        named = ", ".join(f"{items[k].object_name} {percent(between.parts[k])}" for k in coarse[:MOST_NAMED])
        more = f" and {counted(len(coarse) - MOST_NAMED, 'other')}" if len(coarse) > MOST_NAMED else ""
        warnings.append(
            f"Colours between the vertices are {percent(between.error)} off ({named}{more}): subdivide these meshes"
        )
    if settings.data_type == "BYTE_COLOR":
        clipped = {item.object_name: int((item.colours[:, :3] > 1).any(axis=1).sum()) for item in items}
        if any(clipped.values()):
            names = ", ".join(name for name, count in clipped.items() if count)
            warnings.append(
                f"{counted(sum(clipped.values()), 'colour')} above 1 clipped in bytes ({names}); "
                "lower the exposure or use float colours"
            )
    return warnings


def _uncoloured(objects):
    """A sentence for objects that are in the light but stay without colours because of their modifiers."""
    names = [entry["name"] for entry in objects if not entry["baked"] and "modifier" in entry["reason"]]
    if not names:
        return []
    text = f"{some('object', names)} got no colours, as modifiers change the vertices: bake with Apply Modifiers on"
    return [text]


def plain(value):
    """numpy scalars and containers as JSON's own types."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
