"""The solver against known answers and against an independent path tracer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rooms import cube_planes

from pdm_core import Plane, Scene, SceneError, Sphere, Surface, deadline, each_surface, solve, solve_steps
from pdm_core.links import approach, light, refinement, transport
from pdm_core.links.approach import warnings_of
from pdm_core.signs_of_life import finish

REFERENCE = Path(__file__).resolve().parents[1] / "data"
NEVER = 1e5  # s


def box(reflectance, emission, size=(2.0, 3.0, 2.5), scale=1.0, origin=(0.0, 0.0, 0.0)):
    """Six walls that face inwards; one reflectance and one emission each, or one for all."""
    x, y, z = np.diag(size) * scale
    o = np.array(origin, float)
    edges = [(o, x, y), (o + z, y, x), (o, y, z), (o + x, z, y), (o, z, x), (o + y, x, z)]
    reflectance, emission = np.broadcast_to(reflectance, 6), np.broadcast_to(emission, 6)
    return [Surface(Plane(*e), r, m, name=f"wall {k}") for k, (e, r, m) in enumerate(zip(edges, reflectance, emission))]


def points_on(shape, count, rng):
    if isinstance(shape, Plane):
        return shape.world(np.column_stack([rng.random((count, 2)), np.zeros(count)]))
    return shape.project(shape.origin + rng.normal(size=(count, 3)) * shape.semi_axes[2])


def everywhere(solution, count=40):
    rng = np.random.default_rng(3)
    return [solution.radiance(k, points_on(s.shape, count, rng)) for k, s in enumerate(solution.scene.surfaces)]


@pytest.mark.parametrize("rho", [0.5, 0.95, 0.999])
def test_uniform_enclosure(rho):
    for radiance in everywhere(solve(Scene(box(rho, 1.0)), 1e-2)):
        assert np.abs(radiance * (1 - rho) - 1).max() < 1e-2


def test_inside_a_sphere():
    solution = solve(Scene([Surface(Sphere.at((1, 2, 3), 2.0), 0.8, 1.0, side="back")]), 1e-2)
    assert np.abs(everywhere(solution)[0] - 5.0).max() < 5e-2


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_every_surface_emits_what_it_absorbs(scale):
    rho = np.array([0.9, 0.1, 0.5, 0.7, 0.3, 0.0])
    touching = Sphere.at(np.array([1, 1, 0.4]) * scale, 0.4 * scale)
    screen = Plane(*(np.array([[0.2, 2.4, 0], [1, 0, 0], [0, 0, 1]]) * scale))  # stands on the floor
    egg = np.array([[0.3, 0.1, 0, 1.2], [0, 0.25, 0, 2.0], [0, 0, 0.4, 1.5], [0, 0, 0, 1 / scale]]) * scale
    extra = [Surface(touching, 0.3, 0.7), Surface(screen, 0.6, 0.4), Surface(screen, 0.2, 0.8, side="back")]
    extra.append(Surface(Sphere(egg), 0.8, 0.2))
    solution = solve(Scene(box(rho, 1 - rho, scale=scale) + extra), 1e-2)
    for radiance in everywhere(solution):
        assert np.abs(radiance - 1).max() < 1e-2


def test_small_lamp_over_a_floor():
    lamp, height, radius = Sphere.at((0, 0, 1.0), 0.01), 1.0, 0.01
    floor = Plane((-5, -5, 0), (10, 0, 0), (0, 10, 0))
    solution = solve(Scene([Surface(floor, 0.5, 0.0), Surface(lamp, 0.0, 100.0)]), 1e-2)
    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [0, 2.0, 0], [-3, 3, 0]])
    distance = np.linalg.norm(points - [0, 0, height], axis=1)
    expected = 100 * radius**2 * height / distance**3
    assert np.abs(solution.incident(0, points)[:, 0] / expected - 1).max() < 1e-3


def test_darkness_and_background():
    dark = solve(Scene(box(0.5, 0.0)), 1e-2)
    assert dark.error == 0 and all((radiance == 0).all() for radiance in everywhere(dark))
    ball = Surface(Sphere.at((0, 0, 0), 1.0), 0.5)
    sky = solve(Scene([ball], background=(1.0, 2.0, 3.0)), 1e-2)
    assert np.abs(everywhere(sky)[0] - [0.5, 1.0, 1.5]).max() < 1e-12
    black = solve(Scene([Surface(ball.shape)], background=(1.0, 2.0, 3.0)), 1e-2)
    assert (everywhere(black)[0] == 0).all()


def test_irradiance_in_space_agrees_with_the_surface():
    solution = solve(Scene(box(0.5, [0, 1, 0, 0, 0, 0])), 1e-2)
    points = points_on(solution.scene.surfaces[0].shape, 50, np.random.default_rng(0))
    points = points * [0.8, 0.8, 1] + [0.2, 0.3, 1e-5]
    here, there = solution.incident(0, points), solution.irradiance(points, np.tile([0.0, 0, 1], (50, 1)))
    assert np.linalg.norm(here - there) < 2e-2 * np.linalg.norm(there)


def test_relight_agrees_with_a_new_solution():
    rho, lamp = np.array([0.6, 0.7, 0.5, 0.4, 0.3, 0.2]), np.array([0, 1.0, 0, 0, 0, 0])
    ball = Surface(Sphere.at((1, 1, 0.6), 0.5), 0.7)
    old = solve(Scene(box(rho, lamp) + [ball]), 1e-2)
    scene = Scene([Surface(s.shape, 0.9 * s.reflectance, 2 * s.emission) for s in old.scene.surfaces])
    for a, b in zip(everywhere(old.relight(scene)), everywhere(solve(scene, 1e-2))):
        assert np.linalg.norm(a - b) < 2e-2 * np.linalg.norm(b)
    with pytest.raises(SceneError, match="same shapes"):
        old.relight(Scene(box(rho, lamp)))


def test_relight_solves_anew_where_there_was_no_light():
    wall, shelf = Plane((0, -3, -3), (0, 6, 0), (0, 0, 6)), Plane((-2, -1, 0), (1, 0, 0), (0, 2, 0))
    lamp = Sphere.at((2, 0, -2), 0.5)  # before the wall, below the shelf behind it

    def scene(glow):
        sides = [Surface(wall, 0.5), Surface(wall, 0.5, side="back", name="rear")]
        return Scene([*sides, Surface(lamp, 0.0, 1.0), Surface(shelf, 0.3, glow)])

    old = solve(scene(0.0), 1e-2)
    assert old.plan.counts["dark"] == 2 and (old.radiance(1, points_on(wall, 9, np.random.default_rng(0))) == 0).all()
    other = Scene([replace(s, emission=float(k == 3)) for k, s in enumerate(old.scene.surfaces)])
    relit, right = old.relight(other), solve(other, 2e-3)
    at = points_on(wall, 40, np.random.default_rng(0)) * [1, 0.5, 0.5]
    assert relit.error <= 1e-2 and relit.radiance(1, at) == pytest.approx(right.radiance(1, at), rel=0.05, abs=1e-4)
    old.anew = None  # as of what is no end of a solve
    with pytest.raises(SceneError, match="rear"):
        old.relight(other)


def test_progress_and_cancel(monkeypatch):
    scene = Scene(box(0.5, [0, 1, 0, 0, 0, 0]))
    steps = solve_steps(scene, 1e-2)
    fraction, error, seconds = next(steps)
    assert 0 <= fraction <= 1 and error > 0 and seconds >= 0
    steps.close()
    seen = []
    solution = solve(scene, 1e-2, progress=lambda *step: seen.append(step))
    assert len(seen) > 2 and solution.error <= 1e-2 and solution.history
    monkeypatch.setattr(deadline, "GRACE", (0.0, NEVER))  # however long a busy machine takes for a first solution
    limited = solve(scene, 1e-6, time_limit=1e-3)
    assert limited.warnings and np.isfinite(limited.error)


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan")])
def test_bad_target(bad):
    with pytest.raises(SceneError, match="target_error"):
        solve(Scene(box(0.5, 1.0)), bad)


def test_convex_room_needs_no_visibility():
    solution = solve(Scene(box(0.5, [0, 1, 0, 0, 0, 0])), 1e-2)
    assert solution.counts.get("exact", 0) == 0 and solution.counts.get("sampled", 0) == 0
    counts = solution.plan.counts
    assert counts["apart"] == 6 and counts["free pairs"] == counts["pairs"] - 6  # a wall does not see itself


def test_a_lone_shining_ball_on_a_floor_needs_no_visibility():
    floor = Plane((-3, -3, 0), (6, 0, 0), (0, 6, 0))
    ball = Surface(Sphere.at((0, 0, 1), 1.0), 0.4, 2.0, name="ball")
    sides = [Surface(floor, 0.5, name="top"), Surface(floor, 0.5, side="back", name="underside")]
    solution = solve(Scene([*sides, ball]), 1e-2)
    counts = solution.plan.counts
    assert solution.counts.get("exact", 0) == solution.counts.get("sampled", 0) == 0 < solution.counts["free"]
    assert counts["dark"] == 1 and counts["free pairs"] == counts["pairs"] - counts["apart"]
    # on the floor all light comes from the ball, uniform but for what the floor sends back: closed form of the sphere
    d = np.array([1.5, 2.0, 2.9])
    there = np.column_stack([d, 0 * d, 0 * d]), np.tile([0.0, 0, 1], (3, 1)), np.zeros(3, int)
    direct = solution._light.transport.direct(*there) @ solution._light.colours
    assert np.abs(direct[:, 0] / (2 / (d**2 + 1) ** 1.5) - 1).max() < 1e-12


def test_memory_is_bounded_and_said(monkeypatch):
    scene = Scene(box(0.5, [0, 1, 0, 0, 0, 0]) + [Surface(Sphere.at((1, 1, 0.6), 0.5), 0.7)])
    monkeypatch.setattr(transport, "MEMORY", 4 * 400**2)
    coarse = solve(scene, 1e-4)
    rows = coarse._light.transport.rows
    assert rows is None or rows.bytes <= 4 * 400**2  # gone where they made room for finer ones
    assert coarse.error > 1e-4 and np.isfinite(coarse.error)
    full, missed = coarse.warnings
    assert "memory" in full and "above the target" in missed and "time limit" not in missed
    assert warnings_of(coarse, True, 2 * coarse.error, False) == []  # what was asked for is there


def test_more_time_is_advised_where_it_helps():
    scene = Scene(box(0.5, [0, 1, 0, 0, 0, 0]) + [Surface(Sphere.at((1, 1, 0.6), 0.5), 0.7)])
    coarse = finish(solve_steps(scene, 1e-4, enough=lambda: True))
    assert "raise the time limit or the target error" in coarse.warnings[-1]
    (tried,) = warnings_of(coarse, False, 1e-4, False)
    assert "time limit" not in tried and "raise the target error" in tried


def test_a_solution_that_made_room_for_a_better_one_is_not_relit(monkeypatch):
    scene = Scene(box(0.5, [0, 1, 0, 0, 0, 0]) + [Surface(Sphere.at((1, 1, 0.6), 0.5), 0.7)])
    early = finish(solve_steps(scene, 1e-4, enough=lambda: True))  # the first round is not the last one's links
    assert early.warnings and early.relight(scene).error > 0
    early.let_go()
    with pytest.raises(SceneError, match="solve again"):
        early.relight(scene)
    assert np.isfinite(early.radiance(0, [[1.0, 1.0, 0.0]])).all()


def test_links_are_made_finer_where_a_finer_field_no_longer_helps(monkeypatch):
    """Links too coarse by far: their errors are those of the field at every node, which surpluses then only follow."""
    scene = Scene(box(0.5, [0, 1, 0, 0, 0, 0]) + [Surface(Sphere.at((1, 1, 0.6), 0.5), 0.7)])
    usual = solve(scene, 4e-3)
    sharpened = []
    link_up = refinement.Refinement.link_up

    def watched(state, target):
        sharpened.append(state.sharpness)
        link_up(state, target)

    monkeypatch.setattr(refinement.Refinement, "link_up", watched)
    monkeypatch.setattr(refinement, "LINK_SHARE", 4.0)
    coarse = solve(scene, 4e-3)
    assert min(sharpened) < 1 and coarse.error <= 4e-3
    difference = [a - b for a, b in zip(everywhere(coarse), everywhere(usual))]
    size = np.sqrt(sum(np.mean(r**2) for r in everywhere(usual)))
    assert np.sqrt(sum(np.mean(d**2) for d in difference)) < (coarse.error + usual.error) * size


def furnished(grey):
    """A closed room with a lamp, a ball, and a roof over it that no light reaches."""
    rho = np.array([0.6, 0.7, 0.5, 0.4, 0.3, 0.2])
    lamp = Plane((0.7, 1.2, 2.4), (0, 0.6, 0), (0.6, 0, 0))
    emission = (3.0, 6.0, 1.5) if grey else (3.0, 0.0, 0.0)
    surfaces = box(rho, 0.0) + [Surface(lamp, 0.0, emission), Surface(lamp, 0.5, side="back")]
    tint = 0.7 if grey else (0.7, 0.2, 0.1)
    surfaces.append(Surface(Sphere.at((1, 1, 0.6), 0.5), tint))
    return Scene([*surfaces, Surface(Plane((0, 0, 3), (1, 0, 0), (0, 1, 0)), 0.5, name="roof")])


@pytest.mark.parametrize("grey", [True, False])
def test_what_the_plan_leaves_out_changes_nothing(grey, monkeypatch):
    scene = furnished(grey)
    lean = solve(scene, 1e-2)
    assert lean.plan.counts["channels"] == (1 if grey else 3) and lean.plan.counts["dark"] >= 1
    planned = approach.plan_by_links

    def everything(*given):
        result = planned(*given)
        result.reached[:] = True
        return result

    monkeypatch.setattr(approach, "plan_by_links", everything)
    monkeypatch.setattr(light, "proportional_channels", lambda scene: (np.arange(3), np.eye(3)))
    full = solve(scene, 1e-2)
    assert len(full._light.transport.reflectors) > len(lean._light.transport.reflectors)
    difference = [a - b for a, b in zip(everywhere(lean), everywhere(full))]
    size = np.sqrt(sum(np.mean(r**2) for r in everywhere(full)))
    assert np.sqrt(sum(np.mean(d**2) for d in difference)) < 1e-2 * size


@pytest.mark.parametrize("name", ["seed_room", "cornell_spheres"])
def test_reference_rooms(name):
    data = np.load(REFERENCE / f"{name}.npz")
    surfaces, index = [], []
    for entry in json.loads(str(data["spec"]))["objects"]:
        index.append(len(surfaces))
        if entry["kind"] == "sphere":
            surfaces.append(Surface(Sphere.at(entry["c"], entry["r"]), entry["rho"], entry["emit"]))
            continue
        plane = Plane(entry["o"], entry["u"], entry["v"])
        surfaces += [Surface(plane, entry["rho"], entry["emit"]), Surface(plane, entry["rho"], 0.0, side="back")]
    scene = Scene(surfaces)
    solution, where = solve(scene, 1e-2), np.array(index)[data["surface"]]
    found = np.empty_like(data["L"])
    for k in np.unique(where):
        found[where == k] = solution.radiance(k, data["P"][where == k])
    received = data["L"] - scene.emission[where]
    assert np.linalg.norm(found - data["L"]) < 2e-2 * np.linalg.norm(received)


@pytest.mark.parametrize("rho", [0.99, 0.999])
def test_the_stated_error_is_true_where_the_room_amplifies_it(rho):
    shapes = [*cube_planes(), Sphere.at((0, 0, 0), 1)]
    scene = Scene([Surface(s, rho, 1.0 if k == 1 else 0.0) for k, s in enumerate(shapes)])
    coarse, fine = solve(scene, 1e-2), solve(scene, 3e-3)
    rng = np.random.default_rng(4)
    wrong = total = 0.0
    for k, shape in enumerate(shapes):
        points = shape.project(rng.uniform(-3, 3, (40, 3)))
        radiance = fine.radiance(k, points)
        wrong += ((coarse.radiance(k, points) - radiance) ** 2).sum()
        total += ((radiance - scene.emission[k]) ** 2).sum()
    assert np.sqrt(wrong / total) < coarse.error + fine.error
    assert coarse.error < 1e-2


def test_each_surfaces_own_error_is_true():
    """A room split by a partition: all direct light is sent on a little too dark, and what is behind gets less."""
    partition = Plane((2.0, 0, 0), (0, 3.0, 0), (0, 0, 2.0))
    surfaces = box(0.7, 0.0, size=(4.0, 3.0, 2.5)) + [Surface(partition, 0.6), Surface(partition, 0.6, side="back")]
    surfaces += [Surface(Sphere.at((1.0, 1.5, 1.2), 0.2), 0.0, 10.0), Surface(Sphere.at((3.0, 1.5, 0.4), 0.4), 0.6)]
    scene = Scene(surfaces)
    found, fine = solve(scene, 0.04), solve(scene, 0.005)
    for k, (value, true) in enumerate(zip(everywhere(found, 200), everywhere(fine, 200))):
        off, light = np.linalg.norm(value - true), np.linalg.norm(true - scene.emission[k])
        assert off <= found.surface_errors[k] * light, k


def test_links_are_made_finer_where_they_are_most_of_the_error(monkeypatch):
    """A lamp and a shelf in narrow gaps: errors of links go to one side there, which no finer field would mend."""
    lamp, shelf = (
        Plane((1.15, 1.6, 3.96), (0, 1.51, 0), (1.45, 0, 0)),
        Plane((3.3e-3, 0.98, 0.88), (0, 1.2, 0), (0, 0, 0.8)),
    )
    panels = [Surface(lamp, 0.29, 5.8), Surface(lamp, 0.29, side="back")]
    panels += [Surface(shelf, 0.5), Surface(shelf, 0.5, side="back")]
    # of the whole scene's light: the dark backs' own would ask for more
    monkeypatch.setattr(each_surface, "OWN", 1e9)
    solution = solve(Scene(box(0.46, 0.0, size=(4.61, 4.03, 4.11)) + panels), 1e-2)
    assert solution.error < 1e-2 and not solution.warnings
    assert solution.nodes < 4000


@pytest.mark.parametrize("gap", (1e-6, 1e-3, 0.1))
def test_what_is_seen_between_samples_keeps_its_light(gap):
    """A frame of floor around a carpet, too narrow for samples to see: its exact factor is shared out all the same."""
    walls = [Surface(plane, 0.7, 0.3) for plane in cube_planes()]
    carpet = Plane((-2.95, -2.95, -3 + gap), (5.9, 0, 0), (0, 5.9, 0))
    surfaces = [*walls, *(Surface(carpet, 0.7, 0.3, side=side) for side in ("front", "back"))]
    solution = solve(Scene(surfaces), 0.02)
    assert all(np.abs(r - 1).max() < 1e-4 for r in everywhere(solution))


@pytest.mark.parametrize("radius", [0.3, 1.5])
@pytest.mark.parametrize("target", [0.16, 0.04])
def test_it_is_dark_where_a_ball_touches_the_floor(radius, target):
    """Light comes to the point of contact over ever more bounces: none is left, at whatever error of the scene."""
    surfaces = [
        Surface(Plane((-5, -5, 0), (10, 0, 0), (0, 10, 0)), 0.85),
        Surface(Sphere.at((0.3, 0.4, radius), radius), 0.8),
    ]
    light = solve(Scene(surfaces, background=1.0), target).incident(0, [(0.3 + 0.05 * radius, 0.4, 0)])
    assert (light < 0.1).all()
