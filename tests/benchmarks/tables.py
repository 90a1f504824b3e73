"""Tables of the README and the pages from the benchmarks' output: what is between `<!-- name -->` and `<!-- end -->`.

python tests/benchmarks/tables.py
"""

import json
import re

from output import ROOT

DATA = ROOT / "docs" / "benchmarks"
NAMES = {
    "seed_room": "closed room with a ball",
    "cornell_spheres": "Cornell box with two balls",
    "thirteen_spheres": "13 balls, one the lamp",
    "split_room": "split by a partition",
    "lit_through_a_hole": "lit through a hole",
}
MANY = {
    "boxes50": "50 boxes under a lamp and a sky",
    "furnished_room": "furnished room",
    "window_room": "L-shaped room with windows, polygons",
    "knot_room": "knot of 4,998 triangles in a room",
}
PLOTTED = "vertices_8000"
TOLD = (0.04, 0.01, 0.0025, 0.001)  # targets of the first table
VERTICES = 1000, 40_000  # rows of the second


def rows(name):
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))["rows"]


def percent(value):
    return f"{100 * value:.2g} %"


def number(value):
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def table(head, body):
    lines = [head, ["---"] * len(head), *body]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def error_and_time():
    body = []
    for row in rows("rooms"):
        if row["target"] in TOLD:
            measured = row.get("measured", row.get("from_tight"))
            seconds = row["solve_seconds"] + row[PLOTTED]["seconds"]
            told = percent(measured) if measured is not None else "(the reference)"
            body.append(
                [NAMES[row["room"]], f"{100 * row['target']:g} %", percent(row["stated"]), told, number(seconds)]
            )
    return table(["room", "target", "stated", "measured", "seconds"], body)


def beside_cycles():
    body = []
    for row in rows("beside_cycles"):
        if not VERTICES[0] < row["vertices"] < VERTICES[1]:
            continue
        level = row["levels"]["0.01"]
        line = [NAMES[row["scene"]], f"{row['vertices']:,}", f"{number(row['fit']['0.01'])} s"]
        for what in ("stated", "measured"):
            found = level.get(what)
            line += [f"{number(found['cpu_seconds'])} s", number(found["ratio"])] if found else ["", ""]
        body.append(line)
    return table(["room", "vertices", "Cycles", "target 1 %", "ratio", "measured 1 %", "ratio"], body)


def each_object():
    body = [
        [
            NAMES[row["scene"]], f"{100 * row['target']:g} %", row["worst_surface"], percent(row["worst_measured"]),
            percent(row["worst_stated"]), f"{row['true']} of {len(row['surfaces'])}", number(row["cpu_seconds"]),
            number(row["cpu_seconds_without"]),
        ]
        for row in rows("each_object")
    ]  # fmt: skip
    return table(["room", "target", "worst surface", "measured", "stated", "true", "CPU s", "without"], body)


def many_shapes():
    body = [
        [
            MANY.get(row["scene"], row["scene"]), f"{row['shapes']:,}", f"{100 * row['target']:g} %",
            percent(row["stated"]), percent(row["measured"]) if "measured" in row else "", number(row["seconds"]),
        ]
        for row in rows("many_shapes")
    ]  # fmt: skip
    return table(["scene", "shapes", "target", "stated", "measured", "CPU s of solving"], body)


def modifiers():
    tables = json.loads((DATA / "modifiers.json").read_text(encoding="utf-8"))["tables"]
    head = ["", "read, in the benchmark, as", "light off by", "baked"]
    return table(head, [
        [row["what"], row["label"], f"{row['light']:.1%}".replace("%", " %"), row["bake"]]
        for row in tables[max(tables, key=lambda name: tuple(map(int, name.split("."))))]
    ])  # fmt: skip


PLACES = {
    "README.md": (error_and_time, beside_cycles, each_object, many_shapes),
    "docs/pipelines.md": (modifiers,),
}


def main():
    for name, makers in PLACES.items():
        path = ROOT / name
        text = path.read_text(encoding="utf-8")
        for make in makers:
            pattern = re.compile(rf"<!-- {make.__name__} -->\n.*?\n<!-- end -->", re.DOTALL)
            if not pattern.search(text):
                raise SystemExit(f"{name} has no place for {make.__name__}")
            start, end = pattern.search(text).span()
            text = f"{text[:start]}<!-- {make.__name__} -->\n{make()}\n<!-- end -->{text[end:]}"
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
