"""The same scenes as other kinds of shapes, and by rays: what the engine of links never sees.

A variant: scene -> (Scene, for each of its surfaces the one of the scene that it stands for).
"""

from dataclasses import replace

import numpy as np

from pdm_core import Mesh, Plane, Polygon, Scene, Sphere
from pdm_core.links.approach import link_steps
from pdm_core.rays.solution import ray_steps
from pdm_core.signs_of_life import finish

CELLS = 3  # of a plane's mesh, along each edge
TURNS, RINGS = 24, 12  # of a ball's


def solve_by_rays(scene, target, limit):
    """As pdm_core.solve where rays are chosen, whatever the scene holds."""
    return finish(ray_steps(scene, target, limit, "forced"))


def solve_by_links(scene, target, limit):
    """As pdm_core.solve where links are chosen, whatever they cost."""
    return finish(link_steps(scene, target, limit, "forced"))


def as_it_is(scene):
    return scene


def with_polygons(scene):
    """Planes as polygons."""
    return _with(scene, lambda s: Polygon(s.corners) if isinstance(s, Plane) else s)


def with_meshes(scene):
    """Planes as flat meshes, balls as smooth ones."""
    return _with(scene, lambda s: Mesh(*_grid(s), False) if isinstance(s, Plane) else Mesh(*_ball(s), True))


def as_one_mesh(scene):
    """All planes that look alike and shine alike as one mesh, welded or not as they come: open, non-manifold, crossing
    itself."""
    groups = {}
    for k, s in enumerate(scene.surfaces):
        if isinstance(s.shape, Plane):
            sides = tuple(t.side for t in scene.surfaces if t.shape is s.shape)
            groups.setdefault((sides, *s.reflectance, *s.emission, s.side), []).append(k)
    made, surfaces = {}, [s for s in scene.surfaces if isinstance(s.shape, Sphere)]
    for members in groups.values():
        shapes = [scene.surfaces[k].shape for k in members]
        key = tuple(id(s) for s in shapes)
        if key not in made:
            made[key] = Mesh(*_joined([_grid(s) for s in shapes]), False)
        surfaces.append(replace(scene.surfaces[members[0]], shape=made[key]))
    return Scene(surfaces, scene.background, scene.rounding)


VARIANTS = [as_it_is, with_polygons, with_meshes, as_one_mesh]


def _with(scene, changed):
    made = {id(s): changed(s) for s in scene.shapes}
    # surfaces may hold a shape that coincides with the one of the scene: the same again
    surfaces = [replace(s, shape=made[id(scene.shapes[k])]) for s, k in zip(scene.surfaces, scene.shape_of)]
    return Scene(surfaces, scene.background, scene.rounding)


def _grid(plane):
    """Vertices and faces of a plane."""
    t = np.linspace(0, 1, CELLS + 1)
    s, t = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    k = np.arange((CELLS + 1) ** 2).reshape(CELLS + 1, CELLS + 1)
    faces = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    return plane.world(np.column_stack([s, t, 0 * s])), faces


def _ball(ball):
    """Vertices and faces of a ball."""
    turn, polar = np.meshgrid(2 * np.pi * np.arange(TURNS) / TURNS, np.pi * np.arange(RINGS + 1) / RINGS)
    local = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    k = np.arange(TURNS * (RINGS + 1)).reshape(RINGS + 1, TURNS)
    k[0], k[-1] = k[0, 0], k[-1, 0]
    after = np.roll(k, -1, axis=1)
    faces = np.stack([k[:-1], k[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    faces = [list(dict.fromkeys(face)) for face in faces.tolist()]
    if np.linalg.det(ball.linear) < 0:
        faces = [face[::-1] for face in faces]
    return ball.world(local.reshape(-1, 3)), faces


def _joined(parts):
    """Vertices and faces of several."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([v for v, _ in parts]), np.concatenate([f + k for (_, f), k in zip(parts, first)])


def knows(variant, kind):
    """Whether the judge of a kind can judge its variant: the tracer follows few triangles."""
    return variant in (as_it_is, with_polygons) or kind.__name__ not in TRACED


TRACED = {"ball_over_plane", "ball_in_plane", "balls_that_cross", "ball_over_cube", "maze", "lamp_under_ceiling"}
