"""Scenes of the benchmarks, besides the rooms of tests/data."""

import numpy as np

from pdm_core import Plane, Scene, Sphere, Surface

POINTS = 1500  # where two runs are compared, spread over the area, and LEAST on each surface
LEAST = 12


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


def boxes_in_room(count, size, seed):
    """The same room and lamp with count - 1 closed boxes that float in it, turned at random."""
    room = spheres_in_room(count, size, seed)
    rng, surfaces = np.random.default_rng(seed), room.surfaces[:7]
    for ball in room.surfaces[7:]:
        centre, radius = ball.shape.bounds
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        u, v, z = (turn * rng.uniform(0.6, 1.0, 3) * 2 * radius / np.sqrt(3)).T
        o = centre - (u + v + z) / 2
        for face in ((o, v, u), (o + z, u, v), (o, u, z), (o + u, v, z), (o + u + v, -u, z), (o + v, -v, z)):
            plane = Plane(*face)
            surfaces = [*surfaces, *(Surface(plane, ball.reflectance, side=way) for way in ("front", "back"))]
    return Scene(surfaces)


def sunk_balls(count):
    """A lit room with up to sixteen balls, a sixth of each below its floor."""
    surfaces, places = _furnished(count)
    return Scene([*surfaces, *(_ball((x, y, 0.7 * r), r) for x, y, r in places)])


def paired_balls(count):
    """A lit room in which up to sixteen pairs of balls that run through each other float."""
    surfaces, places = _furnished(count)
    for x, y, r in places:
        surfaces += [_ball((x, y, 1.5), r), _ball((x, y + 0.8 * r, 1.5), 0.7 * r)]
    return Scene(surfaces)


def _furnished(count):
    """Surfaces of a room 6 x 5 x 3 with a square lamp below its ceiling, and places (x, y, radius) of what is in it."""
    rng = np.random.default_rng(count)
    lamp = Surface(Plane((2, 2, 2.9), (0, 1, 0), (1, 0, 0)), 0.0, 5.0, "front", "lamp")
    y, x = np.divmod(np.arange(count), 4)
    middle = (np.column_stack([x, y]) + 0.5 + rng.uniform(-0.2, 0.2, (count, 2))) * (1.5, 1.2)
    places = np.column_stack([middle, rng.uniform(0.2, 0.5, count)])
    return [*walls((6.0, 5.0, 3.0), np.full(6, 0.7)), lamp], places


def _ball(centre, radius):
    return Surface(Sphere.at(centre, radius), 0.6, 0.0, "front")


def points_over(scene, seed, least=LEAST):
    """Yield (surface, points, area m^2 of each) spread over all surfaces, at least so many on each."""
    rng = np.random.default_rng(seed)
    for k, surface in enumerate(scene.surfaces):
        count = max(least, int(POINTS * scene.areas[k] / scene.areas.sum()))
        shape = surface.shape
        if isinstance(shape, Plane):
            points = shape.world(np.column_stack([rng.random((count, 2)), np.zeros(count)]))
        else:
            points = shape.project(shape.origin + rng.normal(size=(count, 3)))
        yield k, points, scene.areas[k] / count


def difference(scene, solution, tighter):
    """Relative L2 difference of two solutions' L - Le."""
    wrong = total = 0.0
    for k, points, area in points_over(scene, seed=1):
        one, other = solution.radiance(k, points), tighter.radiance(k, points)
        wrong += area * ((one - other) ** 2).sum()
        total += area * ((other - scene.emission[k]) ** 2).sum()
    return float(np.sqrt(wrong / total))
