"""Kinds of stiff, extreme and everyday scenes, at random sizes and places. Each is a furnace (every surface emits what
it does not reflect, and the background is 1: then all radiance is 1) or lit by a lamp, for the tracer to judge."""

import numpy as np

from pdm_core import Plane, Scene, Sphere, Surface

LAMP = 10.0


class Place:
    """Turned at random, moved and scaled."""

    def __init__(self, rng, offset=0.0, scale=1.0):
        q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        q[0] *= np.linalg.det(q)
        self.turn, self.offset = scale * q, offset * scale * rng.normal(size=3)
        self.scale = scale

    def plane(self, corner, u, v):
        return Plane(self.turn @ np.array(corner, float) + self.offset, self.turn @ u, self.turn @ v)

    def ball(self, centre, radius):
        return Sphere.at(self.turn @ np.array(centre, float) + self.offset, radius * self.scale)

    def ellipsoid(self, centre, axes, rng):
        matrix = np.eye(4)
        matrix[:3, :3] = self.turn @ np.linalg.qr(rng.normal(size=(3, 3)))[0] * axes
        matrix[:3, :3] *= np.sign(np.linalg.det(matrix[:3, :3]))
        matrix[:3, 3] = self.turn @ np.array(centre, float) + self.offset
        return Sphere(matrix)

    def box(self, low, high, shear=0.0):
        """Six planes that look outward."""
        low, size = np.array(low, float), np.array(high, float) - low
        x, y, z = np.diag(size)
        z = z + shear * size[2] * np.array([1.0, 0, 0])
        edges = [(0 * x, y, x), (z, x, y), (0 * x, x, z), (y, z, x), (0 * x, z, y), (x, y, z)]
        return [self.plane(low + o, u, v) for o, u, v in edges]


SIDES = ("front", "back")


def furnace(shapes, rho, rounding=2**-53):
    """rho: of all shapes, or of each (n,)."""
    each = np.broadcast_to(rho, len(shapes))
    surfaces = [
        Surface(s, each[k], 1 - each[k], side=side, name=f"shape {k}") for k, s in enumerate(shapes) for side in SIDES
    ]
    return Scene(surfaces, 1.0, rounding)


def lit(place, shapes, rho, background=0.1, lamp=(0, 0, 4.0), size=1.0):
    surfaces = [Surface(s, rho, side=side, name=f"shape {k}") for k, s in enumerate(shapes) for side in SIDES]
    corner = np.array(lamp, float) - [size / 2, size / 2, 0]
    shining = place.plane(corner, [0, size, 0], [size, 0, 0])
    return Scene([*surfaces, Surface(shining, 0.0, LAMP, name="lamp"), Surface(shining, 0.0, side="back")], background)


def between(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# Every kind: (rng) -> (size of the extreme, Scene, 'furnace' or 'tracer': who judges it)


def gap(rng):
    place, d, rho = Place(rng), between(rng, 1e-3, 0.3), 1 - between(rng, 1e-2, 0.5)
    shapes = [place.plane((0, 0, 0), [1, 0, 0], [0, 1, 0]), place.plane((0, 0, d), [0, 1, 0], [1, 0, 0])]
    return f"gap {d:.1e}, reflectance {rho:.3f}", furnace(shapes, rho), "furnace"


def closed_room(rng):
    away, rho = between(rng, 1, 1e4), 1 - between(rng, 1e-3, 0.5)
    place = Place(rng, away)
    return f"{away:.0e} sizes away, reflectance {rho:.3f}", furnace(place.box((0, 0, 0), (1, 1.3, 0.8)), rho), "furnace"


def flat_room(rng):
    wide = between(rng, 10, 1e6)
    return f"{wide:.0e} wide", furnace(Place(rng).box((0, 0, 0), (wide, wide, 1)), 0.7), "furnace"


def long_room(rng):
    far = between(rng, 10, 1e4)
    return f"{far:.0e} long", furnace(Place(rng).box((0, 0, 0), (far, 1, 1)), 0.7), "furnace"


def sheared_room(rng):
    steep = between(rng, 0.3, 1e3)
    return f"sheared to {1 / steep:.0e}", furnace(Place(rng).box((0, 0, 0), (1, 1, 1), steep), 0.6), "furnace"


def stiff_room(rng):
    lost = between(rng, 1e-6, 1e-1)
    return f"reflectance 1 - {lost:.0e}", furnace(Place(rng).box((0, 0, 0), (1, 1, 1)), 1 - lost), "furnace"


def scale(rng):
    size = between(rng, 1e-9, 1e9)
    place = Place(rng, scale=size)
    shapes = [
        *place.box((0, 0, 0), (1, 1, 1)),
        place.ball((3, 0, 0.5), 0.5),
        place.plane((-5, -5, 0), [10, 0, 0], [0, 10, 0]),
    ]
    return f"{size:.0e} m", furnace(shapes, 0.5), "furnace"


def far_away(rng):
    away = between(rng, 1e4, 1e9)
    return f"{away:.0e} sizes away", furnace(Place(rng, away).box((0, 0, 0), (1, 1, 1)), 0.5), "furnace"


def ball_over_plane(rng):
    d, place = between(rng, 1e-7, 1), Place(rng)
    shapes = [place.plane((-2, -2, 0), [4, 0, 0], [0, 4, 0]), place.ball((0.1, 0.2, 0.5 + d), 0.5)]
    return f"gap {d:.0e}", lit(place, shapes, 0.5), "tracer"


def ball_in_plane(rng):
    height, place = rng.uniform(-0.5, 0.5), Place(rng)
    shapes = [place.plane((-2, -2, 0), [4, 0, 0], [0, 4, 0]), place.ball((0.1, 0.2, height), 0.5)]
    return f"centre {height:+.2f} over the plane, radius .5", lit(place, shapes, 0.5), "tracer"


def balls_that_cross(rng):
    d, place = rng.uniform(0.2, 1.1), Place(rng)
    shapes = [place.ball((0, 0, 1), 0.6), place.ball((d, 0, 1), 0.5), place.plane((-2, -2, 0), [4, 0, 0], [0, 4, 0])]
    return f"centres {d:.2f} apart, radii .6, .5", lit(place, shapes, 0.5), "tracer"


def ball_over_cube(rng):
    r, place = rng.uniform(0.9, 1.6), Place(rng)
    shapes = [*place.box((-1, -1, -1), (1, 1, 1)), place.ball((0, 0, 0), r)]
    surfaces = [Surface(s, 0.5, name=f"shape {k}") for k, s in enumerate(shapes)]
    shining = place.plane((-0.5, -0.5, 4), [0, 1, 0], [1, 0, 0])
    return f"radius {r:.2f}, half edge 1", Scene([*surfaces, Surface(shining, 0.0, LAMP)], 0.1), "tracer"


def carpet(rng):
    d, place = rng.choice([0.0, between(rng, 1e-9, 1e-1)]), Place(rng, between(rng, 1, 100))
    shapes = place.box((0, 0, 0), (4, 4, 3))
    shapes += [place.plane((0.05, 0.05, d), [3.9, 0, 0], [0, 3.9, 0])]
    return f"{d:.0e} over the floor", furnace(shapes, 0.7), "furnace"


def box_on_floor(rng):
    place, width = Place(rng, between(rng, 1, 100)), between(rng, 1e-2, 2)
    shapes = [*place.box((0, 0, 0), (width, 1, 1)), place.plane((-3, -3, 0), [6, 0, 0], [0, 6, 0])]
    return f"{width:.2f} wide", furnace(shapes, 0.5), "furnace"


def boxes_side_by_side(rng):
    place, n = Place(rng, between(rng, 1, 100)), int(rng.integers(2, 5))
    shapes = [s for k in range(n) for s in place.box((k, 0, 0), (k + 1, 1, rng.choice([1, 1.5])))]
    surfaces = [Surface(s, 0.5, 0.5, name=f"shape {k}") for k, s in enumerate(shapes)]
    return f"{n} boxes", Scene(surfaces, 1.0), "furnace"


def dome(rng):
    r, place = between(rng, 1.2, 100), Place(rng)
    shapes = [place.ball((0, 0, 0), r), *place.box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)), place.ball((0, 0, 0.8), 0.2)]
    return f"radius {r:.1f} around a box and a ball", furnace(shapes, 0.6), "furnace"


def thin_ellipsoid(rng):
    ratio, place = between(rng, 1, 1e4), Place(rng)
    shapes = [place.ellipsoid((0, 0, 1), [1, 0.7, 1 / ratio], rng), place.plane((-2, -2, -0.5), [4, 0, 0], [0, 4, 0])]
    return f"axes 1 : {1 / ratio:.0e}", furnace(shapes, 0.5), "furnace"


def narrow_screen(rng):
    aspect, place = between(rng, 10, 1e6), Place(rng)
    shapes = [*place.box((-2, -2, -2), (2, 2, 2)), place.plane((0, -1, -0.3), [0, 2, 0], [2 / aspect, 0, 0])]
    return f"aspect {aspect:.0e}", furnace(shapes, 0.6), "furnace"


def slit(rng):
    d, place = between(rng, 1e-6, 1e-1), Place(rng)
    shapes = place.box((0, 0, 0), (1, 1, 1))
    shapes[1] = place.plane((0, 0, 1), [1, 0, 0], [0, 1 - d, 0])
    return f"{d:.0e} wide", furnace(shapes, 0.7), "furnace"


def maze(rng):
    place, n = Place(rng), int(rng.integers(2, 5))
    shapes = place.box((0, 0, 0), (n + 1, 1, 1))
    for k in range(n):
        y = 0.0 if k % 2 else 0.3
        shapes.append(place.plane((k + 1, y, 0), [0, 0.7, 0], [0, 0, 1]))
    surfaces = [Surface(s, 0.7, side=side, name=f"shape {i}") for i, s in enumerate(shapes) for side in SIDES]
    lamp = place.ball((0.5, 0.5, 0.5), 0.2)
    return f"{n} turns", Scene([*surfaces, Surface(lamp, 0.0, LAMP)]), "tracer"


def lamp_under_ceiling(rng):
    d, place = between(rng, 1e-7, 0.3), Place(rng)
    shapes = place.box((0, 0, 0), (4, 4, 3))
    return f"gap {d:.0e}", lit(place, shapes, 0.7, lamp=(2, 2, 3 - d), background=0.0), "tracer"


KINDS = [
    gap, closed_room, flat_room, long_room, sheared_room, stiff_room, scale, far_away, ball_over_plane, ball_in_plane,
    balls_that_cross, ball_over_cube, carpet, box_on_floor, boxes_side_by_side, dome, thin_ellipsoid, narrow_screen,
    slit, maze, lamp_under_ceiling,
]  # fmt: skip
