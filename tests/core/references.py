"""Rooms with reference radiances from an independent path tracer: tests/data, see its README."""

import json
from pathlib import Path

import numpy as np

from pdm_core import Mesh, Plane, Polygon, Scene, Sphere, Surface
from pdm_core.signs_of_life import finish

DATA = Path(__file__).resolve().parents[1] / "data"
NAMES = ("boxes50", "furnished_room", "window_room", "knot_room")


def load(name):
    """The reference's arrays, its Scene (everything reflects on both sides and emits from its front), and the front
    surface of each object."""
    data = np.load(DATA / f"{name}.npz")
    spec, surfaces, front = json.loads(str(data["spec"])), [], []
    for item in spec["objects"]:
        shape = _shape(item)
        front.append(len(surfaces))
        surfaces.append(Surface(shape, item["rho"], item["emit"], name=item["name"]))
        if not isinstance(shape, Sphere):
            surfaces.append(Surface(shape, item["rho"], side="back", name=f"{item['name']} (back)"))
    return data, Scene(surfaces, spec.get("sky", 0)), np.array(front)


def _shape(item):
    if item["kind"] == "plane":
        return Plane(item["o"], item["u"], item["v"])
    if item["kind"] == "sphere":
        return Sphere.at(item["c"], item["r"])
    if item["kind"] == "polygon":
        return Polygon(item["outline"], item.get("holes", ()))
    return Mesh(item["vertices"], item["faces"], smooth=False)


def measured(data, scene, front, solution):
    """Relative L2 error of the radiance at the reference's points, area-weighted, of L - Le."""
    surface = front[data["surface"]]
    found = finish(solution.radiance_steps(surface, data["P"]))
    weight = data["w"][:, None]
    wrong, light = found - data["L"], data["L"] - scene.emission[surface]
    return float(np.sqrt((weight * wrong**2).sum() / (weight * light**2).sum()))
