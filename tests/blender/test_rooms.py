"""The demo rooms end to end: what the bake wrote against the solution, and against an independent path tracer."""

import importlib
import json
from pathlib import Path

import bpy
import numpy as np
import pytest
import rooms
import scenes
from conftest import MODULE

REFERENCE = Path(__file__).resolve().parents[1] / "data"
FILES = {"cornell": "cornell_spheres.npz", "paper": "seed_room.npz"}
TARGET = 0.02


@pytest.fixture(scope="module", params=sorted(rooms.ROOMS))
def room(request):
    """(name, its Solution, {object name: (index of the surface its normals face, world vertices, colours)}), baked."""
    rooms.build(request.param, cells=12)
    module, solutions = importlib.import_module(f"{MODULE}.operators.baking.bake"), []
    with pytest.MonkeyPatch.context() as patch:
        solve = module._solve

        def listening(*arguments):
            solutions.append((yield from solve(*arguments)))
            return solutions[0]

        patch.setattr(module, "_solve", listening)
        assert bpy.ops.pdm.bake(target_error=TARGET) == {"FINISHED"}
    reading = importlib.import_module(f"{MODULE}.operators.reading.read_scene").read_scene(bpy.context)
    baked = {}
    for read in reading.objects:
        obj = bpy.data.objects[read.name]
        (surface,) = set(np.asarray(read.polygon_surface).tolist())
        matrix = np.array(obj.matrix_world)
        world = scenes.vertices(obj) @ matrix[:3, :3].T + matrix[:3, 3]
        baked[read.name] = surface, world, scenes.colours(obj)
    return request.param, solutions[0], baked


def test_every_object_shows_the_solution(room):
    name, solution, baked = room
    assert len(baked) == {"cornell": 8, "paper": 7}[name]
    assert solution.error <= TARGET
    for surface, world, colours in baked.values():
        np.testing.assert_allclose(colours[:, :3], solution.radiance(surface, world), rtol=1e-6, atol=1e-9)


def test_room_agrees_with_the_path_tracer(room):
    name, solution, baked = room
    data = np.load(REFERENCE / FILES[name])
    objects = json.loads(str(data["spec"]))["objects"]
    radiance = np.empty_like(data["L"])
    for k, entry in enumerate(objects):
        here = data["surface"] == k
        radiance[here] = solution.radiance(baked[entry["name"].title()][0], data["P"][here])
    emission = np.array([entry["emit"] for entry in objects], float)[data["surface"]]
    error = np.linalg.norm(radiance - data["L"]) / np.linalg.norm(data["L"] - emission)
    assert error < TARGET
