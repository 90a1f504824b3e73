"""Lamps: points and balls, spots, suns, areas. They send light and neither block nor reflect.

Colours are powers in watts, for suns irradiances in W/m^2, as Blender's. A ball of power P has the radiance
P / (4 pi^2 r^2), a point the intensity P / (4 pi), an area A the radiance P / (pi A).
"""

from functools import cached_property

import numpy as np

from .at_once import CACHED
from .checked import LEAST, MOST, SceneError, colour, direction_of, finite, number, yes_or_no
from .closed_forms import disc_unoccluded, dot, sphere_unoccluded
from .contour import polygon_unoccluded
from .light_beams import across_cone, beam_unoccluded
from .scene import Light
from .shapes.shape import FLATTEST, cone_lattice, frames, lattice, square_lattice, tiles, unit

__all__ = ["AreaLight", "Light", "PointLight", "SpotLight", "SunLight"]

CORNERS = 96  # of a polygon of an ellipse's area; what a point receives from it is off by less than 1e-5
BEAM_CORNERS = 32  # the same of one with a spread, less than 1e-4
WIDE = np.radians(60)  # half angle of a cone from which on it is no beam
RIM, RIM_MARGIN = 64, 1.01  # directions along the edge of a stretched cone; what lies between them


def _label(name):
    if not isinstance(name, str):
        raise SceneError(f"A light's name is {name!r}; use a string")
    return f"Light {name!r}" if name else "A light without a name"


class PointLight(Light):
    """A point, or with a radius in m a ball that shines evenly; power (3,) W, or one number.

    faces: instead of the ball a disc of its radius that faces whatever it lights (Blender's Soft Falloff).
    """

    def __init__(self, position, power, radius=0.0, faces=False, shadows=True, name=""):
        self.name, label = name, _label(name)
        self.position = finite(position, (3,), f"{label}: position")
        self.colour = colour(power, f"{label}: power")
        self.radius = max(number(radius, f"{label}: radius", "0 or metres above it", -LEAST, MOST), 0.0)
        self.radius = self.radius if self.radius > LEAST else 0.0
        self.faces, self.shadows = yes_or_no(faces, f"{label}: faces"), yes_or_no(shadows, f"{label}: shadows")

    @property
    def cone(self):
        """See Light: all around."""
        return self.position, np.array([0.0, 0, 1]), np.pi, self.radius

    def unoccluded(self, points, normals):
        offset = self.position - points
        distance = np.linalg.norm(offset, axis=1)
        if self.radius == 0:
            cosine = np.einsum("ij,ij->i", normals, offset)
            return np.maximum(cosine, 0.0) / (4 * np.pi**2 * np.maximum(distance, LEAST) ** 3)
        # a facing disc fills the cone that a ball of the same centre does whose distance is that of the disc's rim
        farther = np.hypot(distance, self.radius) if self.faces else distance
        centres = unit(offset) * (farther / self.radius)[:, None]
        seen = sphere_unoccluded(np.zeros_like(offset), normals, centres, np.ones(len(offset)))
        factor = np.where(farther < self.radius, 1.0, seen)  # inside the ball there is light all around
        return factor / (4 * np.pi**2 * self.radius**2)

    def holds(self, points):
        """See Light: those within the ball; a disc stands before its ball's far side, wherever it is seen from."""
        within = np.linalg.norm(self.position - points, axis=1) < self.radius
        return np.ones(len(points), bool) if self.faces else within

    def samples(self, count):
        if self.radius == 0 or count == 1:
            return self.position[None].copy(), None, np.ones(1)
        normals = lattice(2 * count)  # half of them look away from any point
        return self.position + self.radius * normals, normals, np.full(2 * count, 1 / (2 * count))

    def beyond(self, way, points):
        """See Light: a disc's rays end in its plane."""
        if self.radius == 0 or not self.faces:
            return None
        offset = (self.position - points).T.copy()
        distance = np.maximum(np.sqrt(dot(offset, offset)), LEAST)
        ahead, square = dot(way, offset) / distance, dot(way, way)  # ahead: along the disc's axis
        slope2 = np.maximum(square - ahead**2, 0.0) * distance**2
        within = (ahead > 0) & (slope2 <= (self.radius * ahead) ** 2)
        part = np.where(within, distance / np.maximum(ahead, LEAST), 1.0)
        return np.where(within, np.sqrt(square) * (1 - part), np.nan)


class SpotLight(PointLight):
    """A point light that shines within a cone: angle is its full opening in radians, up to pi.

    blend: the part of the cone, 0 to 1, over which it fades to its edge, as Blender's. axes (3, 3): a linear map that
    makes the cone of another one about (0, 0, -1), for cones that are not round; else direction (3,) is the axis.
    """

    def __init__(
        self, position, direction, power, angle, blend=0.0, radius=0.0, faces=False, axes=None, shadows=True, name=""
    ):
        super().__init__(position, power, radius, faces, shadows, name)
        label = _label(name)
        self.direction = direction_of(direction, f"{label}: direction")
        self.angle = number(angle, f"{label}: angle", "radians above 0, at most pi", LEAST, np.pi * (1 + 1e-6))
        self.blend = min(max(number(blend, f"{label}: blend", "0 to 1", -1e-6, 1 + 1e-6), 0.0), 1.0)
        self.to_cone = self._inverse(axes, label)

    def _inverse(self, axes, label):
        """(3, 3): world directions to those in which the cone is round about (0, 0, -1)."""
        if axes is None:
            return frames(-self.direction[None])[0]
        axes = finite(axes, (3, 3), f"{label}: axes")
        values = np.linalg.svd(axes, compute_uv=False)
        if not values[2] > FLATTEST * values[0]:
            raise SceneError(f"{label}: it is scaled flat; give its axes three directions")
        return np.linalg.inv(axes / values[0])

    def pattern(self, directions):
        turned = np.tensordot(self.to_cone, np.moveaxis(directions, -1, 0), 1)
        length = np.sqrt(dot(turned, turned))
        return self._fading(-turned[2] / np.where(length > 0, length, 1.0))

    def _fading(self, cosine):
        """(...) What is left of the light at cosines (...) to the cone's axis."""
        edge = np.cos(self.angle / 2)
        x = np.clip((cosine - edge) / max((1 - edge) * self.blend, 1e-9), 0.0, 1.0)
        return x * x * (3 - 2 * x)

    @cached_property
    def beam(self):
        turn, axes = 2 * np.pi * np.arange(RIM) / RIM, np.linalg.inv(self.to_cone)
        edge = np.full(RIM, np.sin(self.angle / 2))
        rim = np.column_stack([edge * np.cos(turn), edge * np.sin(turn), np.full(RIM, -np.cos(self.angle / 2))])
        axis, rim = unit(-axes[:, 2]), unit(rim @ axes.T)
        half = np.arctan2(np.linalg.norm(np.cross(rim, axis), axis=1), rim @ axis).max() * RIM_MARGIN
        return _beam(self.position, axis, half, self.radius)

    @property
    def cone(self):
        return self.position, *(self.beam[1:] if self.beam else (self.direction, np.pi / 2)), self.radius

    def unoccluded(self, points, normals):
        points, normals = np.asarray(points, float), np.asarray(normals, float)
        if self.beam is None:
            return self._unoccluded(points, normals)
        out, some = np.zeros(len(points)), np.flatnonzero(_within(self.beam, points))
        out[some] = self._unoccluded(points[some], normals[some])
        return out

    def _unoccluded(self, points, normals):
        whole = super().unoccluded(points, normals)
        offset = self.position - points
        distance = np.linalg.norm(offset, axis=1)
        if self.radius == 0:
            return whole * self.pattern(-unit(offset))
        half, lit = np.arctan2(self.radius, distance), (distance > 0) & (whole > 0)
        if not self.faces:
            half = np.arcsin(np.minimum(self.radius / np.maximum(distance, LEAST), 1.0))
            lit &= distance > self.radius  # from within a ball shines evenly
        share = np.ones(len(points))
        share[lit] = across_cone(self.to_cone, self._fading, unit(offset[lit]), normals[lit], half[lit])
        return whole * share


def _beam(centre, axis, half, radius):
    """The cone about all cones of a half angle from a ball of that radius about the centre, see Light.beam."""
    return (centre - axis * radius / np.sin(half), axis, half) if half < WIDE else None


def _within(beam, points):
    """(n,) Whether points (n, 3) m are in a Light's beam, or so near its edge that rounding may tell."""
    apex, axis, half = beam
    offset = points - apex
    return offset @ axis >= (np.cos(half) - 1e-9) * np.linalg.norm(offset, axis=1)


class SunLight(Light):
    """Light from far away: irradiance (3,) W/m^2, or one number, of what faces it; direction (3,) is the light's own.

    angle: the full opening in radians, up to pi, of the cone from which it comes evenly; 0 casts sharp shadows.
    """

    distant = True

    def __init__(self, direction, irradiance, angle=0.0, shadows=True, name=""):
        self.name, label = name, _label(name)
        self.direction = direction_of(direction, f"{label}: direction")
        self.colour = colour(irradiance, f"{label}: irradiance")
        self.angle = max(number(angle, f"{label}: angle", "0 to pi radians", -1e-6, np.pi * (1 + 1e-6)), 0.0)
        self.angle = self.angle if self.angle > LEAST else 0.0
        self.shadows = yes_or_no(shadows, f"{label}: shadows")

    def unoccluded(self, points, normals):
        normals = np.asarray(normals, float)
        if self.angle == 0:
            return np.maximum(normals @ -self.direction, 0.0) / np.pi
        sine = np.sin(min(self.angle, np.pi) / 2)
        centres = np.broadcast_to(-self.direction / sine, normals.shape)
        seen = sphere_unoccluded(np.zeros_like(normals), normals, centres, np.ones(len(normals)))
        return seen / (np.pi * sine**2)

    def samples(self, count):
        """Unit directions towards the light (k, 3), None, weights (k,)"""
        if self.angle == 0 or count == 1:
            return -self.direction[None], None, np.ones(1)
        cone = cone_lattice(count, -self.direction, min(self.angle, np.pi) / 2)
        return cone, None, np.full(count, 1 / count)


class AreaLight(Light):
    """A parallelogram, or the ellipse within it, about centre (3,) m with the edges u, v (3,) m, shining along u x v.

    power (3,) W, or one number. spread: the full opening in radians, up to pi, of the cone into which each point of it
    shines, fading as between the slats of a grid: Blender's; at pi it shines evenly.
    """

    def __init__(self, centre, u, v, power, ellipse=False, spread=np.pi, shadows=True, name=""):
        self.name, label = name, _label(name)
        self.centre = finite(centre, (3,), f"{label}: centre")
        self.u, self.v = finite(u, (3,), f"{label}: u"), finite(v, (3,), f"{label}: v")
        self.colour = colour(power, f"{label}: power")
        self.ellipse, self.shadows = yes_or_no(ellipse, f"{label}: ellipse"), yes_or_no(shadows, f"{label}: shadows")
        self.spread = number(spread, f"{label}: spread", "radians above 0, at most pi", LEAST, np.pi * (1 + 1e-6))
        longest = max(np.abs(self.u).max(), np.abs(self.v).max())
        if not (longest > LEAST and np.linalg.norm(np.cross(self.u / longest, self.v / longest)) > FLATTEST):
            raise SceneError(f"{label}: it has no area; give it a size above 0 in both directions")
        if any((self.centre + edge / 2 == self.centre - edge / 2).all() for edge in (self.u, self.v)):
            raise SceneError(f"{label}: its size is lost in the rounding of its place; move it nearer to the origin")

    @property
    def sizes(self):
        return np.linalg.norm([self.u, self.v], axis=1)

    def cut(self, length):
        if self.ellipse:
            return [self]
        corners, steps = tiles(self.sizes, length)
        (u, v), middles = steps[:, None] * [self.u, self.v], corners + steps / 2 - 0.5
        centres, rest = self.centre + middles @ [self.u, self.v], (False, self.spread, self.shadows, self.name)
        return [AreaLight(centre, u, v, self.colour, *rest) for centre in centres]

    @cached_property
    def area(self):
        """m^2"""
        whole = float(np.linalg.norm(np.cross(self.u, self.v)))
        return whole * np.pi / 4 if self.ellipse else whole

    @cached_property
    def normal(self):
        """(3,) the unit direction in which it shines."""
        return unit(np.cross(self.u, self.v))

    @cached_property
    def corners(self):
        """(k, 3) m of the outline, counter-clockwise seen from its front; for an ellipse a polygon of its area."""
        if not self.ellipse:
            s, t = np.array([[-1.0, 1, 1, -1], [-1, -1, 1, 1]]) / 2
        else:
            count = CORNERS if self._is_even else BEAM_CORNERS
            turn = 2 * np.pi * np.arange(count) / count
            size = np.sqrt(np.pi / (count * np.sin(2 * np.pi / count) / 2)) / 2
            s, t = size * np.cos(turn), size * np.sin(turn)
        return self.centre + np.outer(s, self.u) + np.outer(t, self.v)

    @property
    def _is_round(self):
        across, sizes = abs(self.u @ self.v), np.array([self.u @ self.u, self.v @ self.v])
        return self.ellipse and max(across, np.ptp(sizes)) < 1e-6 * sizes.max()

    @property
    def _is_even(self):
        return self.spread > np.pi * (1 - 1e-6)

    @property
    def beam(self):
        radius = np.sqrt(self.u @ self.u + self.v @ self.v) / 2
        return _beam(self.centre, self.normal, self.spread / 2, radius)

    @property
    def cone(self):
        return self.centre, self.normal, self.spread / 2, np.sqrt(self.area)

    def power_along(self, directions):
        return self.pattern(directions) * (directions @ self.normal)

    def pattern(self, directions):
        cosine = directions @ self.normal
        if self._is_even:
            return np.ones(cosine.shape)
        half = self.spread / 2
        tangent = np.sqrt(np.maximum(1 - cosine**2, 0.0)) / np.maximum(cosine, LEAST)
        return np.maximum(np.tan(half) - tangent, 0.0) / (np.tan(half) - half) * (cosine > 0)

    def unoccluded(self, points, normals):
        """points (n, 3) m, unit normals (n, 3) -> (n,) irradiance / pi for 1 W, horizon-clipped; 0 behind it"""
        points, normals = np.asarray(points, float), np.asarray(normals, float)
        out = np.zeros(len(points))
        # the plane's own points see its edge alone; what rounding puts before them is no light
        height = (points - self.centre) @ self.normal
        front = np.flatnonzero(height > 1e-12 * (np.abs(points - self.centre).max(axis=1) + np.sqrt(self.area)))
        for part in np.array_split(front, len(front) // CACHED + 1):
            x, n = points[part], normals[part]
            if self._is_even and self._is_round:
                out[part] = disc_unoccluded(x, n, self.centre, self.u / 2, self.v / 2)
            elif self._is_even:
                out[part] = polygon_unoccluded(x, n, np.broadcast_to(self.corners, (len(part), *self.corners.shape)))
            else:
                out[part] = beam_unoccluded(x, n, self.corners, self.normal, self.spread / 2)
        return out / (np.pi * self.area)

    def samples(self, count):
        s, t = square_lattice(count).T
        if self.ellipse:
            radius = np.sqrt(s)
            s, t = 0.5 + radius * np.cos(2 * np.pi * t) / 2, 0.5 + radius * np.sin(2 * np.pi * t) / 2
        positions = self.centre + np.outer(s - 0.5, self.u) + np.outer(t - 0.5, self.v)
        return positions, np.tile(self.normal, (count, 1)), np.full(count, 1 / count)
