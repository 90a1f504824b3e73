"""What all shapes have in common, and points and vectors they are made of."""

from functools import cached_property

import numpy as np

FLATTEST = 1e-9  # a shape thinner than this part of its extent has no usable area or inside
ROUNDINGS = 4  # of a coordinate: two shapes' own, through a matrix each
INSET = 2e-4  # of its extent: what points that receive light keep from a shape's border at least
PARALLEL = 1e-3  # sine up to which what is near a flat shape lies against it
SIDES = 6  # of the directions in which normals are told apart
ARITHMETIC = 16 * 2**-53  # relative to the extent: what our own sums and products of coordinates lose


def bounds_of(shapes):
    """Centres (n, 3) m and radii (n,) m of spheres around shapes."""
    return [np.array(part) for part in zip(*(s.bounds for s in shapes))]


def box_of(shapes):
    """low, high (3,) m of the box around these spheres."""
    centres, radii = bounds_of(shapes)
    return (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)


def tolerance_of(shapes, rounding=2**-53):
    """m; coordinates of the shapes that differ by no more are the same: their rounding, relative, can do so."""
    centres, radii = bounds_of(shapes)
    low, high = box_of(shapes)
    reach = float((np.abs(centres).max(axis=1) + radii).max())
    extent = np.linalg.norm(high - low)
    return ROUNDINGS * rounding * reach + ARITHMETIC * float(extent)


def unit(vectors):
    """vectors (..., 3) scaled to length 1; a zero vector stays zero."""
    length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., None]  # twice as fast as norm
    return vectors / np.where(length > 0, length, 1.0)


def lattice(count):
    """Unit directions (count, 3) spread evenly over the sphere: the spherical Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + np.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def side_of(normals):
    """(n,) Which of SIDES normals (n, 3) look to."""
    axis = np.argmax(np.abs(normals), axis=1)
    return axis * 2 + (normals[np.arange(len(normals)), axis] > 0)


def frames(axes):
    """Right-handed frames (n, 3, 3) of unit vectors in rows, the last along unit axes (n, 3)."""
    x = unit(np.cross(np.eye(3)[np.argmin(np.abs(axes), axis=1)], axes))
    return np.stack([x, np.cross(axes, x), axes], axis=1)


def cones(half, count, first=0.5):
    """Unit directions (n, 3, count) spread evenly over cones of half angles (n,) about the third axis; first: .5 is for
    sums, 1 takes in the rim."""
    k = np.arange(count)
    # 1 less the cosine: exact of narrow cones too
    lost = np.multiply.outer(2 * np.sin(np.asarray(half) / 2) ** 2, (k + first) / count)
    ring, turn = np.sqrt(lost * (2 - lost)), np.pi * (1 + np.sqrt(5)) * k
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), 1 - lost], axis=1)


def cone_lattice(count, axis, half):
    """Unit directions (count, 3) spread evenly over a cone of that half angle about a unit axis (3,)."""
    return cones([half], count)[0].T @ frames(axis[None])[0]


def square_lattice(count):
    """Points (count, 2) of the unit square spread evenly: Roberts' R2 sequence."""
    steps = np.array([0.7548776662466927, 0.5698402909980532])
    return (0.5 + np.outer(np.arange(count), steps)) % 1.0


def tile_counts(sizes, length):
    """How many tiles, each so many m at most, sizes m take, at least 1 each."""
    return np.ceil(sizes / length).clip(1)


def tiles(sizes, length):
    """Corners (k, 2) in the unit square and steps (2,) of tiles of what has sizes (2,) m, each so many m at most."""
    number = tile_counts(sizes, length)
    return np.argwhere(np.ones(number.astype(int))) / number, 1 / number


class Shape:
    """An affine image of a reference shape: point = origin + linear @ local. A kind of shape has, of points (n, 3) m:

    area, m^2; box: low, high (3,) m; bounds: centre (3,) m and radius of a sphere around it; thickness, m; marks, (12,)
    m: the same of the same shape; facets, what rays meet: origin, u, v (k, 3) m, whether triangles (k,), chart
    (k, 2, 3), see rays.facets; facet_count of them; problem: what is wrong with it, a sentence, or None
    project(points) -> the nearest points on it; normals(points): unit (n, 3), of the front
    spread(count) -> points (count, 3) m spread evenly over the area
    inset(points, least) -> the nearest points on it that keep at least so many m, and INSET, from its border
    unhidden(points, normals, sign, tolerance) -> (n,) irradiance / pi where the radiance of the side of the sign is 1
    and nothing hides it

    Those that links know as they are also have unit_height, m in local coordinates; extent(directions (k, 3)) -> (k,),
    (k,) how far they reach along them from their centre, least and most; moved(origin (3,) m, corners (4, 3) m, of
    planes) -> the same shape there, seen from the origin. Those of the published method have parametric(st (n, 2)) ->
    points and area vectors (n, 3) m^2 of the front, and parameters(local (n, 3)) -> s, t (n,).
    """

    twist = np.zeros(3)
    half = False  # whether it is a triangle, half of what (s, t) in [0, 1]^2 are
    is_flat = False  # whether it lies in a plane, with a normal, an outline and two sides
    is_ball = False
    is_rectangle = False  # whether it may be one
    is_mesh = False  # whether parts of it may hide others; of all else [0, 1]^2 are places, for cells of light
    plural = None  # of what links do not know as it is
    bend = np.inf  # m; least radius of what is round
    lift = 0.0  # m; what points are lifted off it at most that stand for its light
    wraps = False  # whether its second parameter runs around it
    first_cells = 1, 1  # along its parameters, where an integral over it begins
    least_cells = 1, 1  # along the chart's axes

    @property
    def apart(self):
        """[Shape] what of it hangs together: as a lamp each of these is one."""
        return [self]

    def cut(self, length):
        """[Shape] parts of it, about so many m long at most, that are lamps of their own."""
        return [self]

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

    def gap(self, points):
        """points (n, 3) m -> (n,) m from it"""
        return np.linalg.norm(points - self.project(points), axis=1)

    @property
    def chart_lengths(self):
        """(2,) m along the chart's axes"""
        return np.linalg.norm(self.linear[:, :2], axis=0)

    @property
    def chart_area(self):
        """m^2 of what the whole chart is"""
        return self.area

    @staticmethod
    def to_chart(local):
        """local (n, 3) -> (n, 2) on the chart"""
        return local[:, :2]

    @staticmethod
    def from_chart(at):
        """(n, 2) on the chart -> local (n, 3)"""
        return np.column_stack([at, np.zeros(len(at))])

    @classmethod
    def cells(cls, shapes, own, low, high, places):
        """Of cells low (k, 2) to high (k, 2) of the charts of shapes own (k,), of this kind: the part of the chart's
        area that each is (k,), 0 where nothing of the shape is in it, and so many places, spread evenly over it, on the
        chart (k, places, 2)."""
        size = high - low
        return size.prod(axis=1), low[:, None] + size[:, None] * square_lattice(places)

    @property
    def pieces(self):
        """[Shape] convex, that fill it and that the exact engine knows; the same ones each time."""
        return [self]

    def face_normals(self, points):
        """Unit normals (n, 3) of the front at points (n, 3), however it is shaded."""
        return self.normals(points)

    def samples(self, count):
        """Points (k, 3) m that stand for all of the area, about `count` of them seen from anywhere."""
        return self.spread(count)

    def area_shares(self, points):
        """m^2 that each of its samples, points (k, 3) m, stands for."""
        return np.full(len(points), self.area / len(points))

    def mean_of(self, at, points):
        """(3,) The mean over its area of what a function tells of its samples, points (k, 3) m."""
        return np.average(at(points), axis=0, weights=self.area_shares(points))

    def against(self, points, normals, sign, near):
        """(n,) Whether points, whose normals (n, 3) look away from space, lie against the side of the sign, at most
        `near` m from it, or are within: then that gives them nothing."""
        return np.zeros(len(points), bool)

    def receiving(self, points, sign, least, normals=None, middle=None, triangle=None):
        """points (n, 3) m near it -> where they receive light on the side of the sign, at least so many m from the
        border, normals there (n, 3), those of faces (n, 3), and None; what is told of points on meshes counts there
        alone."""
        points = self.inset(points, least)
        normals = sign * self.normals(points)
        return points, normals, normals, None


class Flat(Shape):
    """A shape in a plane, with a unit `normal` (3,) of the front, an `outline` (n, 3) m, counter-clockwise seen from
    there, and factor(points (n, 3) m, unit normals (n, 3)) -> (n,) irradiance / pi for radiance 1, seen from either
    side where nothing hides it."""

    is_flat, lift = True, np.inf  # what is in its plane must not hide them

    @property
    def box(self):
        return self.outline.min(axis=0), self.outline.max(axis=0)

    @property
    def around(self):
        """(4, 3) m; corners of its chart, counter-clockwise seen from the front."""
        return self.world([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])

    def normals(self, points):
        return np.broadcast_to(self.normal, (len(points), 3))

    def parameters(self, local):
        return local[:, 0], local[:, 1]

    def heights(self, points):
        """points (n, 3) m -> (n,) m over the plane, on the side of the front"""
        return (points - self.bounds[0]) @ self.normal

    def unhidden(self, points, normals, sign, tolerance):
        out = np.zeros(len(points))
        seen = np.flatnonzero(sign * self.heights(points) > tolerance)  # what is no higher lies in its plane
        out[seen] = self.factor(points[seen], normals[seen])
        return out

    def against(self, points, normals, sign, near):
        flush = np.abs(self.heights(points)) < near
        return flush & (sign * (normals @ self.normal) < PARALLEL**2 / 2 - 1)
