"""The published method as a whole: its factors, the uniform enclosure, and how slowly it converges."""

import numpy as np
import pytest
from rooms import cube_planes, scene_of

from pdm_core import Mesh, Plane, Polygon, Scene, SceneError, Sphere, Surface, pdm_form_factor, solve
from pdm_core.compare import difference, points_over
from pdm_core.patch_radiosity import _factors, patch_radiosity_steps
from pdm_core.signs_of_life import finish


def patch_radiosity(scene, divisions=3, points=5):
    return finish(patch_radiosity_steps(scene, divisions, points))


def test_factors_are_those_of_the_published_method():
    room = [Surface(plane) for plane in cube_planes()]
    scene = Scene([*room, Surface(Sphere.at((0, 0, 0), 1))])
    divisions = [(3, 3)] * 6 + [(3, 6)]
    factors, _, counts = finish(_factors(scene, divisions, 4))
    start = np.cumsum([0, *(a * b for a, b in divisions)])
    for a, b in ((0, 1), (0, 2), (6, 0)):
        block = factors[start[a] : start[a + 1], start[b] : start[b + 1]]
        area = np.full(len(block), 1.0)
        if a == 6:  # patches of a sphere differ in size
            edges = np.cos(np.pi * np.arange(4) / 3)
            area = np.repeat(edges[:-1] - edges[1:], 6)
        whole = (area * block.sum(axis=1)).sum() / area.sum()
        others = [s.shape for k, s in enumerate(scene.surfaces) if k not in (a, b)]
        wanted = pdm_form_factor(scene.surfaces[a], scene.surfaces[b], divisions[a], divisions[b], 4, others)
        assert np.isclose(whole, wanted, rtol=2e-3)  # areas are by quadrature there
    assert counts["sampled"] > 0


def test_a_scene_of_light_alone():
    """Nothing reflects: patches shine as they are, wherever they are read off."""
    scene = Scene([Surface(plane, 0.0, 0.1 * k) for k, plane in enumerate(cube_planes())])
    solution = patch_radiosity(scene, 2, 2)
    for k in range(6):
        points = cube_planes()[k].world(np.column_stack([np.random.default_rng(k).random((9, 2)), np.zeros(9)]))
        assert np.allclose(solution.radiance(k, points), 0.1 * k)


def test_bilinear_between_the_middles_of_patches():
    scene = Scene([Surface(Plane((0, 0, 0), (2, 0, 0), (0, 2, 0)), 0.5, 1.0)])
    solution = patch_radiosity(scene, 2, 2)
    solution.patches = np.array([0.0, 1.0, 2.0, 3.0])[:, None] * np.ones(3)
    at = np.array([[0.5, 0.5, 0], [0.5, 1.5, 0], [1, 1, 0], [0, 0, 0], [2, 2, 0], [1.5, 1, 0]])
    assert np.allclose(solution.radiance(0, at)[:, 0], [0, 1, 1.5, 0, 3, 2.5])


def test_shared_edges_stall_it():
    """Where faces share edges the error falls slower than patches grow, design section 5: ours is right to 1 %."""
    scene = Scene([Surface(plane, 0.5, float(k == 1), name=str(k)) for k, plane in enumerate(cube_planes())])
    exact = solve(scene, 0.002)
    surface, points = points_over(scene, 400)
    truth = finish(exact.radiance_steps(surface, points))
    error = []
    for divisions in (2, 4, 8):
        solution = patch_radiosity(scene, divisions, 3)
        value = finish(solution.radiance_steps(surface, points))
        error.append(difference(value, truth, scene.emission[surface]).l2)
    assert error[0] > error[1] > error[2] > 0.02
    assert error[0] / error[2] < 16  # 16 times the patches, 256 times the pairs
    ours = finish(solve(scene, 0.01).radiance_steps(surface, points))
    assert difference(ours, truth, scene.emission[surface]).l2 < 0.01


def test_points_are_spread_evenly_over_the_area():
    scene = scene_of([Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), Plane((5, 0, 0), (3, 0, 0), (0, 1, 0))])
    surface, points = points_over(scene, 4000)
    assert abs((surface == 1).mean() - 0.75) < 0.02
    assert abs(points[surface == 0].mean(axis=0)[:2] - 0.5).max() < 0.03


def test_polygons_are_trimmed_patches():
    """The cube with a floor of an L: its patches are the whole floor's, or nothing, and where it is none nothing is
    read off."""
    floor, *others = cube_planes()
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1 / 3, 0), (1 / 3, 1 / 3, 0), (1 / 3, 1, 0), (0, 1, 0)])
    corner = Polygon(floor.world(corners))
    scenes = [Scene([Surface(p, 0.5, float(k == 4)) for k, p in enumerate([*others, f])]) for f in (floor, corner)]
    (whole, _, _), (cut, real, _) = (finish(_factors(scene, [(3, 3)] * 6, 3)) for scene in scenes)
    assert real.sum() == 5 * 9 + 5
    assert np.abs(cut[real][:, :45] - whole[real][:, :45]).max() < 1e-15
    assert np.abs(cut[:45, real] - whole[:45, real]).max() < 1e-15 and not cut[~real].any() and not cut[:, ~real].any()
    solution = patch_radiosity(scenes[1], 3, 3)
    at = np.array([[0.1, 0.1, 0], [0.3, 0.3, 0], [0.3, 0.9, 0]])
    assert (solution.radiance(5, corner.world(at)) > 0.05).all()
    hidden = Surface(Polygon(0.5 * floor.world(corners)))  # half way up, before some of it
    assert finish(_factors(Scene([*scenes[0].surfaces, hidden]), [(3, 3)] * 7, 3))[0][:54, :54].sum() < whole.sum()
    mesh = Mesh(floor.corners, [[0, 1, 2]])
    with pytest.raises(SceneError, match="'rock' is a mesh"):
        patch_radiosity(Scene([Surface(mesh, name="rock")]))


@pytest.mark.parametrize("wrong", [0, -1, 0.2, np.nan, "many", None])
def test_wrong_divisions_are_named(wrong):
    with pytest.raises(SceneError, match="divisions"):
        patch_radiosity(scene_of(cube_planes()), wrong)
    with pytest.raises(SceneError, match="Scene"):
        patch_radiosity("room")


def test_too_many_patches_are_refused_before_the_work():
    with pytest.raises(SceneError, match="fewer divisions"):
        patch_radiosity(scene_of(cube_planes()), 100)
