"""Scenes of the benchmarks, besides the rooms of ../shared/reference."""

import numpy as np

from pdm_core import Plane, Scene, Sphere, Surface


def walls(size, reflectance):
    """Six planes (floor, ceiling, left, back, front, right) that face into the box 0..size; reflectance (6, 3)."""
    x, y, z = np.diag(size)
    o = np.zeros(3)
    edges = [(o, x, y), (o + z, y, x), (o, y, z), (o, z, x), (o + y, x, z), (o + x, z, y)]
    return [Surface(Plane(*e), r, name=f"wall {k}") for k, (e, r) in enumerate(zip(edges, reflectance))]


def separate(sphere, others, gap=0.0):
    """Whether a sphere (centre, radius) is apart from others."""
    return all(np.linalg.norm(sphere[0] - c) > sphere[1] + r + gap for c, r in others)


def thirteen_spheres():
    """A room 6 x 5 x 3 with 13 spheres, one of them the lamp, half of them standing on the floor; seed fixed."""
    return spheres_in_room(13, (6.0, 5.0, 3.0), seed=7)


def spheres_in_room(count, size, seed):
    """A coloured room with `count` spheres, the first the lamp below the ceiling; the more, the smaller."""
    rng, size = np.random.default_rng(seed), np.array(size)
    lamp = size * [0.5, 0.5, 0.8], 0.08 * size.min()
    largest = 0.5 * (size.prod() / count / 8) ** (1 / 3)
    placed = [lamp]
    while len(placed) < count:
        radius = largest * rng.uniform(0.5, 1.0)
        centre = radius + rng.random(3) * (size - 2 * radius)
        if rng.random() < 0.5:
            centre[2] = radius  # on the floor
        if separate((centre, radius), placed):
            placed.append((centre, radius))
    surfaces = walls(size, rng.uniform(0.3, 0.8, (6, 3)))
    surfaces.append(Surface(Sphere.at(*lamp), 0.0, 12.0, name="lamp"))
    for k, sphere in enumerate(placed[1:]):
        surfaces.append(Surface(Sphere.at(*sphere), rng.uniform(0.2, 0.9, 3), name=f"ball {k}"))
    return Scene(surfaces)
