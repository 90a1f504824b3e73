"""What a solution's cells hold, read at once: the light itself where it is even, and near it elsewhere."""

import numpy as np
import pytest

from pdm_core import Mesh, Plane, Scene, Sphere, Surface, solve
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

SOLVERS = {"links": lambda scene: solve(scene, 0.01), "rays": lambda scene: finish(ray_steps(scene, 0.01, None, ""))}
CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # normals inward


@pytest.fixture(params=SOLVERS)
def solved(request):
    return SOLVERS[request.param]


def walls(size):
    return [Plane(c[0], c[1] - c[0], c[3] - c[0]) for c in (size * CORNERS[list(face)] for face in FACES)]


def held(solution, surface, points):
    return finish(solution.held_steps(np.full(len(points), surface), points))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_in_a_furnace_it_is_the_furnaces(solved, size):
    scene = Scene([Surface(wall, 0.5, 1.0) for wall in walls(size)])
    solution = solved(scene)
    for k, surface in enumerate(scene.surfaces):
        np.testing.assert_allclose(held(solution, k, surface.shape.spread(50)), 2.0, rtol=0.02)  # E / (1 - rho)


def test_on_a_mesh_too():
    scene = Scene([Surface(Mesh(CORNERS, FACES, smooth=False), 0.5, 1.0)])
    points = scene.surfaces[0].shape.spread(50)
    np.testing.assert_allclose(held(SOLVERS["rays"](scene), 0, points), 2.0, rtol=0.02)


def test_it_is_near_what_is_gathered(solved):
    room = [Surface(wall, (0.7, 0.5, 0.3)) for wall in walls(2.0)]
    solution = solved(Scene([*room, Surface(Sphere.at((1, 1, 1.4), 0.2), 0.0, 5.0)]))
    points = room[0].shape.spread(200)
    gathered = solution.incident(0, points)
    assert np.linalg.norm(held(solution, 0, points) - gathered) < 0.1 * np.linalg.norm(gathered)
