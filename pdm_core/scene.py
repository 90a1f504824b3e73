"""Shapes, surfaces and scenes: what the user hands over, checked once and packed into arrays.

Lengths are metres, radiance is linear RGB, arrays are float64.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .checked import LEAST, MOST, SceneError, colour, number, vector
from .coincident import REACHES, one_and_the_same

MEAN_POINTS = 4096  # at which what varies is averaged
MAX_REFLECTANCE = 0.999999  # at 1 an enclosed light has no steady state
FLATTEST = 1e-9  # a shape thinner than this part of its extent has no usable area or inside
ROUNDINGS = 4  # of a coordinate: two shapes' own, through a matrix each
COARSEST = 1e-3  # relative rounding of coordinates beyond which no scene is left
LOST = 2.0  # tolerances: a shape no larger is not told from none
ARITHMETIC = 16 * 2**-53  # relative to the extent: what our own sums and products of coordinates lose


def tolerance_of(shapes, rounding=2**-53):
    """m; coordinates of the shapes that differ by no more are the same: their rounding, relative, can do so."""
    centres, radii = (np.array(part) for part in zip(*(s.bounds for s in shapes)))
    reach = float((np.abs(centres).max(axis=1) + radii).max())
    extent = np.linalg.norm((centres + radii[:, None]).max(axis=0) - (centres - radii[:, None]).min(axis=0))
    return ROUNDINGS * rounding * reach + ARITHMETIC * float(extent)


def unit(vectors):
    """vectors (..., 3) scaled to length 1; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


class Shape:
    """An affine image of a reference shape: point = origin + linear @ local."""

    twist = np.zeros(3)
    half = False  # whether it is a triangle, half of what (s, t) in [0, 1]^2 are

    @cached_property
    def inverse(self):
        """(3, 3): world offsets from the origin to local coordinates."""
        return np.linalg.inv(self.linear)

    def local(self, points):
        """points (n, 3) m -> (n, 3) local coordinates."""
        return (np.asarray(points, float) - self.origin) @ self.inverse.T

    def world(self, local):
        """local (n, 3) -> points (n, 3) m."""
        local = np.asarray(local, float)
        return self.origin + local @ self.linear.T + local[:, :1] * local[:, 1:2] * self.twist


class Plane(Shape):
    """The parallelogram corner + s*u + t*v, 0 <= s, t <= 1. Its front is along u x v; u, v need not be orthogonal.

    Local coordinates are (s, t, height along the unit normal in units of sqrt(area)).
    """

    def __init__(self, corner, u, v):
        self.origin = vector(corner, (3,), "Plane corner")
        self.u = vector(u, (3,), "Plane u")
        self.v = vector(v, (3,), "Plane v")

    @classmethod
    def through(cls, corners):
        """The parallelogram with corners (4, 3) m, counter-clockwise seen from its front."""
        plane = cls(corners[0], corners[1] - corners[0], corners[3] - corners[0])
        plane.__dict__["corners"] = corners  # not the sums of rounded edges
        plane.__dict__["twist"] = corners[0] - corners[1] + corners[2] - corners[3]
        return plane

    def moved(self, corners):
        """The same shape at corners (4, 3) m."""
        return Plane.through(corners)

    @cached_property
    def twist(self):
        """(3,) m; what the third corner is off by rounding, so that points near every edge are on it."""
        return np.zeros(3)

    def __repr__(self):
        return f"Plane({self.origin.tolist()}, {self.u.tolist()}, {self.v.tolist()})"

    @cached_property
    def area(self):
        """m^2"""
        return float(np.linalg.norm(self._across))

    @cached_property
    def _across(self):
        """(3,) u x v"""
        return np.cross(self.u, self.v)

    @cached_property
    def normal(self):
        """(3,) unit normal of the front."""
        return unit(self._across)

    @cached_property
    def linear(self):
        """(3, 3) with columns u, v and the unit normal times sqrt(area)."""
        return np.column_stack([self.u, self.v, self.normal * np.sqrt(self.area)])

    @cached_property
    def corners(self):
        """(4, 3) counter-clockwise seen from the front."""
        c, u, v = self.origin, self.u, self.v
        return np.array([c, c + u, c + u + v, c + v])

    @cached_property
    def marks(self):
        """(12,) m; the same of the same shape."""
        centre = self.bounds[0]
        reach = np.abs((self.corners - centre) @ REACHES.T).max(axis=0)
        return np.concatenate([centre, np.sqrt(self.area) * self.normal, reach])

    @cached_property
    def bounds(self):
        """Centre (3,) and radius of a sphere around the shape."""
        centre = self.origin + (self.u + self.v) / 2
        return centre, float(np.linalg.norm(self.corners - centre, axis=1).max())

    def project(self, points):
        """points (n, 3) -> nearest points (n, 3) on the shape, local coordinates clipped to the outline."""
        local = self.local(points)
        local[:, :2] = np.clip(local[:, :2], 0.0, 1.0)
        local[:, 2] = 0.0
        return self.world(local)

    def spread(self, count):
        """Points (count, 3) m spread evenly over the area."""
        return self.world(np.column_stack([square_lattice(count), np.zeros(count)]))

    @cached_property
    def thickness(self):
        """m; the lesser distance of two opposite edges."""
        return self.area / float(max(np.linalg.norm(self.u), np.linalg.norm(self.v)))

    def normals(self, points):
        """Unit normals (n, 3) of the front at points (n, 3)."""
        return np.broadcast_to(self.normal, (len(points), 3))

    def problem(self):
        """What is wrong with the shape, as a sentence, or None."""
        return self._problem

    @cached_property
    def _problem(self):
        if not all(np.isfinite(a).all() for a in (self.origin, self.u, self.v)):
            return "its coordinates are not finite; apply a valid transform"
        longest = max(np.linalg.norm(self.u), np.linalg.norm(self.v))
        if not (longest > 0 and np.linalg.norm(np.cross(self.u / longest, self.v / longest)) > FLATTEST):
            return "it has no area; give it two edges of different directions or remove it"
        return None


class Sphere(Shape):
    """An affine image of the unit sphere (ellipsoids too), given by a 4x4 matrix. Its front is outside."""

    def __init__(self, matrix):
        self.matrix = vector(matrix, (4, 4), "Sphere matrix")
        self.origin = self.matrix[:3, 3]
        self.linear = self.matrix[:3, :3]

    @classmethod
    def at(cls, center, radius):
        """The round sphere at center (3,) m with radius m."""
        radius = number(radius, "Sphere radius", "metres above 0", above=0)
        matrix = np.eye(4)
        matrix[:3, :3] *= radius
        matrix[:3, 3] = vector(center, (3,), "Sphere center")
        return cls(matrix)

    def __repr__(self):
        return f"Sphere({self.matrix.tolist()})"

    @cached_property
    def semi_axes(self):
        """(3,) m, longest first."""
        return np.linalg.svd(self.linear, compute_uv=False)

    @cached_property
    def is_round(self):
        return bool(self.semi_axes[0] - self.semi_axes[2] <= 1e-12 * self.semi_axes[0])

    @cached_property
    def area(self):
        """m^2; 4 pi R_G((ab)^2, (ac)^2, (bc)^2), Carlson 1995 / DLMF 19.33.1"""
        a, b, c = self.semi_axes / self.semi_axes[0]
        return float(4 * np.pi * self.semi_axes[0] ** 2 * _carlson_rg((a * b) ** 2, (a * c) ** 2, (b * c) ** 2))

    @cached_property
    def bounds(self):
        """Centre (3,) and radius of a sphere around the shape."""
        return self.origin, float(self.semi_axes[0])

    def spread(self, count):
        """Points (count, 3) m spread over the area, evenly over that of a round sphere."""
        return self.world(lattice(count))

    def project(self, points):
        """points (n, 3) -> points (n, 3) on the shape along the ray from its centre (the exact shape's vertex)."""
        local = self.local(points)
        length = np.linalg.norm(local, axis=1, keepdims=True)
        local = np.where(length > 0, local / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
        return self.world(local)

    @property
    def marks(self):
        """(12,) m; the same of the same shape."""
        centre = self.bounds[0]
        reach = np.linalg.norm(REACHES @ self.linear, axis=1)
        return np.concatenate([centre, np.zeros(3), reach])

    @property
    def thickness(self):
        """m; twice the shortest semi-axis."""
        return 2 * float(self.semi_axes[2])

    def normals(self, points):
        """Unit outward normals (n, 3) at points (n, 3)."""
        return unit(self.local(points) @ self.inverse)

    def problem(self):
        """What is wrong with the shape, as a sentence, or None."""
        if not np.isfinite(self.matrix).all():
            return "its matrix is not finite; apply a valid transform"
        if not self.semi_axes[2] > FLATTEST * self.semi_axes[0]:
            return "it is scaled flat; give it a volume or replace it by a plane"
        return None


def _carlson_rg(x, y, z):
    """Carlson's symmetric integral R_G by duplication of R_F and R_D; relative error 1e-15."""
    z, y, x = sorted((x, y, z), reverse=True)  # z the largest: keeps R_D regular
    a, b, c, total, weight = x, y, z, 0.0, 1.0
    while max(abs(a - b), abs(b - c), abs(a - c)) > 1e-3 * (a + b + c):
        mean = np.sqrt(a * b) + np.sqrt(a * c) + np.sqrt(b * c)
        total += weight / (np.sqrt(c) * (c + mean))
        weight /= 4
        a, b, c = (a + mean) / 4, (b + mean) / 4, (c + mean) / 4
    m = (a + b + c) / 3
    p, q = 1 - a / m, 1 - b / m
    r = -(p + q)
    e2, e3 = p * q - r * r, p * q * r
    rf = (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44) / np.sqrt(m)
    m = (a + b + 3 * c) / 5
    p, q = 1 - a / m, 1 - b / m
    r = -(p + q) / 3
    e2, e3 = p * q - 6 * r * r, (3 * p * q - 8 * r * r) * r
    e4, e5 = 3 * (p * q - r * r) * r * r, p * q * r**3
    rd = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    rd = 3 * total + weight * rd / (m * np.sqrt(m))
    return (z * rf - (z - x) * (z - y) * rd / 3 + np.sqrt(x * y / z)) / 2


class Light:
    """A lamp, see lights.py: name; colour (3,), what its sizes are multiplied by; distant: its samples are directions;
    shadows: whether anything blocks its light; beam: of one that shines into a cone, apex (3,) m, unit axis (3,) and
    half angle of a round cone that holds all its light, else None."""

    name = ""
    distant = False
    shadows = True
    beam = None

    def unoccluded(self, points, normals):
        """points (n, 3) m, unit normals (n, 3) -> (n,) irradiance / pi where colour is 1, horizon-clipped"""
        raise NotImplementedError

    def samples(self, count):
        """positions (k, 3) m, or unit directions to what is distant; normals (k, 3) or None; weights (k,); k <= count.

        The visible share of the light at x is sum w_j kappa_j V_j / sum w_j kappa_j with d the direction from x, and
        kappa_j = max(n . d, 0) max(-n_j . d, 0) pattern(-d) / r^2; without normals the second cosine is 1, and of what
        is distant kappa_j = max(n . d, 0).
        """
        raise NotImplementedError

    def pattern(self, directions):
        """Unit directions (..., 3) in which light leaves it -> (...) relative radiance: 1 where it shines evenly."""
        return np.ones(np.shape(directions)[:-1])


@dataclass(frozen=True, eq=False)
class Surface:
    """One side of a shape with a material.

    reflectance (3,) in [0, 1), emission (3,) as radiance; a single number stands for three equal channels, and where
    either varies it is a function of points (n, 3) m on the shape that returns (n, 3).
    """

    shape: Shape
    reflectance: np.ndarray = (0.0, 0.0, 0.0)
    emission: np.ndarray = (0.0, 0.0, 0.0)
    side: str = "front"
    name: str = ""

    def __post_init__(self):
        if not isinstance(self.name, str):
            raise SceneError(f"A surface's name is {self.name!r}; use a string")
        label = f"Surface {self.name!r}" if self.name else "A surface without a name"
        if not isinstance(self.shape, Shape):
            raise SceneError(f"{label}: its shape is {self.shape!r}; give a Plane, Sphere, Polygon or Mesh")
        if problem := self.shape.problem():
            raise SceneError(f"{label}: {problem}")
        if not isinstance(self.side, str) or self.side not in ("front", "back"):
            raise SceneError(f"{label}: side is {self.side!r}; use 'front' or 'back'")
        for what in ("reflectance", "emission"):
            if not callable(getattr(self, what)):
                object.__setattr__(self, what, colour(getattr(self, what), f"{label}: {what}"))
        if not callable(self.reflectance) and (self.reflectance >= 1).any():
            raise SceneError(
                f"{label}: reflectance is {self.reflectance.tolist()}; use numbers below 1, at most {MAX_REFLECTANCE}"
            )

    @property
    def sign(self):
        """+1 where the surface faces along its shape's front, -1 on the back."""
        return 1.0 if self.side == "front" else -1.0

    @property
    def is_inside(self):
        """True for the inner side of a sphere, the only surface that sees itself."""
        return isinstance(self.shape, Sphere) and self.side == "back"

    @property
    def varies(self):
        """Whether its reflectance or emission differs from place to place."""
        return callable(self.reflectance) or callable(self.emission)

    def reflectance_at(self, points):
        """(n, 3) at points (n, 3) m of it."""
        return _value_at(self.reflectance, points, MAX_REFLECTANCE)

    def emission_at(self, points):
        """Radiance (n, 3) at points (n, 3) m of it."""
        return _value_at(self.emission, points, MOST)

    def normals(self, points):
        """Unit normals (n, 3) of this side at points (n, 3) of it."""
        return self.sign * self.shape.normals(points)


def _mean_over(shape, value, at):
    """(3,) of a constant, or the mean of a function over a shape: at points spread over its area."""
    return at(shape.spread(MEAN_POINTS)).mean(axis=0) if callable(value) else value


def _mean_over_directions(sky):
    """(3,) mean radiance of a sky over all directions."""
    return np.maximum(np.asarray(sky(lattice(MEAN_POINTS)), float), 0.0).mean(axis=0)


def lattice(count):
    """Unit directions (count, 3) spread evenly over the sphere: the spherical Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + np.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def square_lattice(count):
    """Points (count, 2) of the unit square spread evenly: Roberts' R2 sequence."""
    steps = np.array([0.7548776662466927, 0.5698402909980532])
    return (0.5 + np.outer(np.arange(count), steps)) % 1.0


def _value_at(value, points, most):
    """A constant (3,), or a function of points, at points (n, 3) -> (n, 3) within 0 and most"""
    if callable(value):
        return np.clip(np.asarray(value(points), float).reshape(len(points), 3), 0.0, most)
    return np.broadcast_to(value, (len(points), 3))


@dataclass(frozen=True, eq=False)
class Scene:
    """Surfaces, lights, and the background radiance from outside: (3,), or a function of directions (n, 3) -> (n, 3).

    Surfaces may share one shape, the same object or one at the same place, which occludes once. rounding: of the
    coordinates, relative (Blender's: 2**-24); what touches is decided by it.
    """

    surfaces: tuple
    background: np.ndarray = (0.0, 0.0, 0.0)
    rounding: float = 2**-53
    lights: tuple = ()  # Light objects, which neither block nor reflect
    sky: object = field(init=False)  # the background where it is a function, else None
    shapes: tuple = field(init=False)  # each shape once, in order of appearance
    shape_of: np.ndarray = field(init=False)  # (n surfaces,) index into shapes

    def __post_init__(self):
        try:
            surfaces = tuple(self.surfaces)
        except TypeError:
            raise SceneError(f"Scene: surfaces are {self.surfaces!r}; give a list of Surfaces") from None
        if not surfaces:
            raise SceneError("The scene has no surfaces; add at least one plane or UV sphere")
        for surface in surfaces:
            if not isinstance(surface, Surface):
                raise SceneError(f"Scene: {surface!r} is not a Surface")
        try:
            lights = tuple(self.lights)
        except TypeError:
            raise SceneError(f"Scene: lights are {self.lights!r}; give a list of lights") from None
        for light in lights:
            if not isinstance(light, Light):
                raise SceneError(f"Scene: {light!r} is no light; give a PointLight, SpotLight, SunLight or AreaLight")
        sky = self.background if callable(self.background) else None
        background = _mean_over_directions(sky) if sky else colour(self.background, "Scene background")
        rounding = number(self.rounding, "Scene rounding", "a relative one such as 2**-53 or 2**-24", 0, COARSEST)
        given = {id(s.shape): s.shape for s in surfaces}
        tolerance = tolerance_of(given.values(), rounding)
        for surface in surfaces:  # before they are compared: lost in the rounding, different shapes look the same
            if surface.shape.thickness < LOST * tolerance:
                raise SceneError(
                    f"Surface {surface.name!r} is {surface.shape.thickness:.2g} m small where coordinates are known to "
                    f"{tolerance:.2g} m; move the scene nearer to the origin or leave it out"
                )
        first = one_and_the_same(list(given.values()), tolerance_of(given.values()))
        kept, place = np.unique(first, return_inverse=True)
        shapes, order = [list(given.values())[k] for k in kept], dict(zip(given, place.tolist()))
        sides = {}
        for surface in surfaces:
            key = (order[id(surface.shape)], surface.side)
            if key in sides:
                raise SceneError(
                    f"Surface {surface.name!r} and surface {sides[key]!r} are the same side of one shape; remove one"
                )
            sides[key] = surface.name
        object.__setattr__(self, "surfaces", surfaces)
        object.__setattr__(self, "background", background)
        object.__setattr__(self, "sky", sky)
        object.__setattr__(self, "lights", lights)
        object.__setattr__(self, "rounding", rounding)
        object.__setattr__(self, "shapes", tuple(shapes))
        object.__setattr__(self, "shape_of", np.array([order[id(s.shape)] for s in surfaces]))
        if not LEAST < self.size < MOST or not all(LEAST**2 < s.area for s in self.shapes):
            raise SceneError(f"Scene: its extent is {self.size:g} m; scale it to metres of ordinary size")

    def __len__(self):
        return len(self.surfaces)

    @cached_property
    def areas(self):
        """(n surfaces,) m^2"""
        return np.array([s.shape.area for s in self.surfaces])

    @cached_property
    def reflectance(self):
        """(n surfaces, 3), the mean of those that vary"""
        return np.array([_mean_over(s.shape, s.reflectance, s.reflectance_at) for s in self.surfaces])

    @cached_property
    def emission(self):
        """(n surfaces, 3) radiance, the mean of those that vary"""
        return np.array([_mean_over(s.shape, s.emission, s.emission_at) for s in self.surfaces])

    def sky_at(self, directions):
        """Radiance (n, 3) from outside along unit directions (n, 3) towards it."""
        if self.sky is None:
            return np.broadcast_to(self.background, (len(directions), 3))
        return np.maximum(np.asarray(self.sky(directions), float).reshape(len(directions), 3), 0.0)

    @cached_property
    def tolerance(self):
        """m; coordinates that differ by no more are the same."""
        return tolerance_of(self.shapes, self.rounding)

    @cached_property
    def size(self):
        """m; the diameter that relative tolerances refer to."""
        centres, radii = zip(*(s.bounds for s in self.shapes))
        centres, radii = np.array(centres), np.array(radii)
        low, high = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
        return float(np.linalg.norm(high - low))
