"""Surfaces and scenes: what the user hands over, checked once and packed into arrays.

Lengths are metres, radiance is linear RGB, arrays are float64.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .checked import LEAST, MOST, SceneError, colour, number, told_by
from .coincident import one_and_the_same
from .shapes.shape import Shape, box_of, lattice, tolerance_of

MEAN_POINTS = 4096  # at which what varies is averaged
MAX_REFLECTANCE = 0.999999  # at 1 an enclosed light has no steady state
COARSEST = 1e-3  # relative rounding of coordinates beyond which no scene is left
LOST = 3.0  # tolerances: a shape no larger is not told from none, its sides not from what touches


class Light:
    """A lamp, see lights.py: name; colour (3,), what its sizes are multiplied by; distant: its samples are directions;
    shadows: whether anything blocks its light; beam: of one that shines into a cone, apex (3,) m, unit axis (3,) and
    half angle of a round cone that holds all its light, else None; cone, of what is not distant: place (3,) m of its
    middle, unit axis (3,) and half angle of its light there, and its own size, m. receivers, blockers: sets of the
    Shapes that alone its light comes to directly, and that alone block it, or None for all."""

    name = ""
    distant = False
    shadows = True
    beam = receivers = blockers = None
    sizes = np.zeros(2)  # m, length and width of what may be cut

    def cut(self, length):
        """[Light] parts of it that are alike, about so many m long at most."""
        return [self]

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

    def holds(self, points):
        """(n,) Whether points (n, 3) m see the inner side of the ball that the samples are on."""
        return np.zeros(len(points), bool)

    def beyond(self, way, points):
        """Of rays along ways (3, ..., n) m from points (n, 3) m to sample places the length (..., n) m that is behind
        the light and that nothing hides, nan where the light does not reach so far aside; None where there is no
        such."""

    def pattern(self, directions):
        """Unit directions (..., 3) in which light leaves it -> (...) radiance, of one that shines evenly."""
        return np.ones(np.shape(directions)[:-1])

    def power_along(self, directions):
        """The same -> (...) its relative power in these directions."""
        return self.pattern(directions)


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
        if problem := self.shape.problem:
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
        return self.shape.is_ball and self.side == "back"

    @property
    def varies(self):
        """Whether its reflectance or emission differs from place to place."""
        return callable(self.reflectance) or callable(self.emission)

    def reflectance_at(self, points):
        """(n, 3) at points (n, 3) m of it."""
        return self._told("reflectance", points, MAX_REFLECTANCE)

    def emission_at(self, points):
        """Radiance (n, 3) at points (n, 3) m of it."""
        return self._told("emission", points, MOST)

    def _told(self, what, points, most):
        """(n, 3) of a constant (3,), or of a function of points (n, 3) m, within 0 and most."""
        value = getattr(self, what)
        if callable(value):
            return np.clip(told_by(value, points, f"Surface {self.name!r}: {what}"), 0.0, most)
        return np.broadcast_to(value, (len(points), 3))

    def normals(self, points):
        """Unit normals (n, 3) of this side at points (n, 3) of it."""
        return self.sign * self.shape.normals(points)


def _mean_over(shape, value, at):
    """(3,) of a constant, or the mean of a function over a shape: at points spread over its area."""
    return shape.mean_of(at, shape.spread(MEAN_POINTS)) if callable(value) else value


def _sky(sky, directions):
    """Radiance (n, 3) of a sky, a function, along directions (n, 3)."""
    return np.maximum(told_by(sky, directions, "Scene background"), 0.0)


def _shapes_of(surfaces, rounding):
    """Each shape of the surfaces once, and which of them each surface is a side of (n surfaces,)."""
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
    order, sides = dict(zip(given, place.tolist())), {}
    for surface in surfaces:
        key = (order[id(surface.shape)], surface.side)
        if key in sides:
            raise SceneError(
                f"Surface {surface.name!r} and surface {sides[key]!r} are the same side of one shape; remove one"
            )
        sides[key] = surface.name
    return tuple(list(given.values())[k] for k in kept), np.array([order[id(s.shape)] for s in surfaces])


def _all_of(given, kind, several):
    """What was given as a tuple; SceneError where it is not of several of a kind."""
    try:
        out = tuple(given)
    except TypeError:
        raise SceneError(f"Scene: {given!r} is no list; give one of {several}") from None
    for one in out:
        if not isinstance(one, kind):
            raise SceneError(f"Scene: {one!r} is no {kind.__name__.lower()}; give a list of {several}")
    return out


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
        surfaces = _all_of(self.surfaces, Surface, "Surfaces")
        lights = _all_of(self.lights, Light, "lights: PointLight, SpotLight, SunLight or AreaLight")
        if not surfaces:
            raise SceneError("The scene has no surfaces; add at least one plane or UV sphere")
        sky = self.background if callable(self.background) else None
        mean = _sky(sky, lattice(MEAN_POINTS)).mean(axis=0) if sky else self.background
        background = colour(mean, "Scene background")
        rounding = number(self.rounding, "Scene rounding", "a relative one such as 2**-53 or 2**-24", 0, COARSEST)
        shapes, shape_of = _shapes_of(surfaces, rounding)
        for name, value in (
            ("surfaces", surfaces),
            ("background", background),
            ("sky", sky),
            ("lights", lights),
            ("rounding", rounding),
            ("shapes", shapes),
            ("shape_of", shape_of),
        ):
            object.__setattr__(self, name, value)
        if not LEAST < self.size < MOST or not all(LEAST**2 < s.area for s in self.shapes):
            raise SceneError(f"Scene: its extent is {self.size:g} m; scale it to metres of ordinary size")

    def __len__(self):
        return len(self.surfaces)

    @cached_property
    def areas(self):
        """(n surfaces,) m^2"""
        return np.array([s.shape.area for s in self.surfaces])

    @cached_property
    def sign(self):
        """(n surfaces,) Surface.sign"""
        return np.array([s.sign for s in self.surfaces])

    @cached_property
    def inside(self):
        """(n surfaces,) Surface.is_inside"""
        return np.array([s.is_inside for s in self.surfaces])

    @cached_property
    def sides(self):
        """(n shapes, 2) the surfaces on the front and on the back of each shape, or -1"""
        out = np.full((len(self.shapes), 2), -1)
        out[self.shape_of, np.where(self.sign > 0, 0, 1)] = np.arange(len(self))
        return out

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
        return _sky(self.sky, directions)

    @property
    def plurals(self):
        """[str] The kinds of shapes that links do not know as they are."""
        return sorted({shape.plural for shape in self.shapes} - {None})

    def of_shapes(self, shapes):
        """(n surfaces,) Whether each is a side of one of the shapes; all are where these are None."""
        return np.array([shapes is None or surface.shape in shapes for surface in self.surfaces])

    @cached_property
    def tolerance(self):
        """m; coordinates that differ by no more are the same."""
        return tolerance_of(self.shapes, self.rounding)

    @cached_property
    def size(self):
        """m; the diameter that relative tolerances refer to."""
        low, high = box_of(self.shapes)
        return float(np.linalg.norm(high - low))


def in_pieces(scene):
    """scene -> (Scene with polygons and meshes in pieces, (n pieces,) the surface that each is a piece of)."""
    surfaces, owner = [], []
    for k, surface in enumerate(scene.surfaces):
        surfaces += [replace(surface, shape=piece) for piece in surface.shape.pieces]
        owner += [k] * len(surface.shape.pieces)
    return Scene(surfaces, scene.background, scene.rounding), np.array(owner)
