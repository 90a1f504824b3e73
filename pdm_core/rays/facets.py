"""What rays meet: the scene's shapes as triangles, parallelograms and balls, in arrays.

A facet is o + s u + t v, of a triangle with s + t <= 1. A ball is the affine image of the unit ball. Numbers of balls
come after those of facets. Each knows its shape, the surfaces on its two sides, and where on their charts it lies.
"""

import copy
from functools import cached_property

import numpy as np

from ..shapes.plane import Planes
from ..shapes.shape import box_of, unit
from ..tolerances import FLUSH
from .lying import Lying
from .near_facets import near_facets
from .near_flats import WIDER, near_flats
from .sieve import Sieve

POINTED = 64.0, 1e-2  # tolerances, or of its length, that a facet's corners move at most by this: where it is a sliver
FINEST = 1e-10  # of the scene's size: the least tolerance, at which what our sums lose at a slant is within WIDER


class Facets:
    """Of a scene: m facets and b balls.

    origin, u, v (m, 3) m about `centre` (3,), a little wider than the shapes are, see WIDER; triangle (m,) bool; chart
    (m, 2, 3): chart position = chart @ (1, s, t); of a mesh it is (s, t) itself; shape (m + b,); surface (m + b, 2):
    that of the front and of the back, or -1; planes, plane_of (n shapes,): the rectangles among them, and which of
    those each is, or -1; own, flat: see there; ball_centre (b, 3), ball_linear, ball_inverse (b, 3, 3); first (n
    shapes,): each shape's first facet; is_ball (n shapes,) bool; area (m,) m^2, of the shapes as they
    are; lit (m,): 1 where the front counts as the side that each looks to, -1 where there is a back alone; lying: the
    Lying of them; late, plane: its.
    """

    def __init__(self, scene):
        self.scene, shapes = scene, scene.shapes
        self.centre = sum(box_of(shapes)) / 2
        self.tolerance = max(scene.tolerance, FINEST * scene.size)
        parts = [shape.facets for shape in shapes]
        origin, u, v, self.triangle, self.chart = (np.concatenate(part) for part in zip(*parts))
        count = np.array([len(part[0]) for part in parts])
        self.is_ball = count == 0
        balls = np.flatnonzero(self.is_ball)
        self.flat = np.flatnonzero([shape.is_flat for shape in shapes])  # shapes in a plane
        rectangles = [k for k, shape in enumerate(shapes) if shape.is_rectangle]
        self.planes, self.plane_of = Planes([shapes[k] for k in rectangles]), np.full(len(shapes), -1)
        self.plane_of[rectangles] = np.arange(len(rectangles))
        # the shape that points on each do not meet: its own, but for what may hide parts of itself
        self.own = np.where([shape.is_mesh for shape in shapes], -1, np.arange(len(shapes)))
        self.shape = np.concatenate([np.repeat(np.arange(len(shapes)), count), balls])
        self.first = np.cumsum(count) - count
        self.first[balls] = len(origin) + np.arange(len(balls))
        self.surface = scene.sides[self.shape]
        self.origin, self.u, self.v = origin - self.centre, u, v
        across = np.cross(u, v)
        self.normal = unit(across)
        self.lit = np.where(self.surface[: len(origin), 0] >= 0, 1.0, -1.0)
        self.area = np.linalg.norm(across, axis=1) / np.where(self.triangle, 2, 1)
        self._widen()
        self.ball_centre = np.array([shapes[k].origin - self.centre for k in balls]).reshape(-1, 3)
        self.ball_linear = np.array([shapes[k].linear for k in balls]).reshape(-1, 3, 3)
        self.ball_inverse = np.array([shapes[k].inverse for k in balls]).reshape(-1, 3, 3)
        self.lying = Lying(self)
        self.late, self.plane = self.lying.late, self.lying.plane

    def _widen(self):
        """Moves the borders of all facets outwards by WIDER: walls whose coordinates were rounded apart are closed.
        Their charts tell where they lie all the same."""
        edges = np.linalg.norm(np.stack([self.v, self.u, self.u - self.v]), axis=2)
        area = np.maximum(self.area * np.where(self.triangle, 2, 1), 1e-300)
        s, t, beyond = WIDER * self.tolerance * edges / area
        beyond = np.where(self.triangle, s + t + beyond, 2 * np.maximum(s, t))
        most = np.maximum(POINTED[0] * self.tolerance / np.maximum(edges.max(axis=0), 1e-300), POINTED[1])
        scale = np.minimum(1, most / beyond)
        s, t, beyond = s * scale, t * scale, beyond * scale
        grown = 1 + np.stack([np.where(self.triangle, beyond, 2 * k) for k in (s, t)], axis=1)
        self.origin -= s[:, None] * self.u + t[:, None] * self.v
        self.u, self.v = self.u * grown[:, :1], self.v * grown[:, 1:]
        first, along = self.chart[:, :, :1], self.chart[:, :, 1:]
        first = first - along @ np.stack([s, t], axis=1)[:, :, None]
        self.chart = np.concatenate([first, along * grown[:, None]], axis=2)

    def blocking(self, light):
        """The Facets of what may block a Light: what rays towards it meet, and not from where they start."""
        if light.blockers is None:
            return self
        some = np.zeros(len(self.scene.shapes), bool)
        some[self.scene.shape_of[self.scene.of_shapes(light.blockers)]] = True
        return self.only(*map(np.flatnonzero, np.split(some[self.shape], [self.count])))

    def only(self, flat, ball):
        """Some of them alone: which facets (k,), which balls (j,)."""
        out = copy.copy(self)
        for name in ("boxes", "ball_reach", "sieve", "near_flats", "near_facets"):
            vars(out).pop(name, None)
        both = np.concatenate([flat, self.count + ball])
        for which, names in (
            (flat, ("origin", "u", "v", "triangle", "chart", "normal", "lit", "late")),
            (ball, ("ball_centre", "ball_linear", "ball_inverse")),
            (both, ("shape", "surface", "plane")),
        ):
            for name in names:
                setattr(out, name, getattr(self, name).take(which, axis=0))
        return out

    def middles(self):
        """(m, 3) m of the facets."""
        return self.origin + (self.u + self.v) / np.where(self.triangle, 3.0, 2.0)[:, None]

    def corners(self, which):
        """(k, 4, 3) m of facets (k,), in turn around them; of triangles the last one is there twice."""
        o, u, v = (array[which] for array in (self.origin, self.u, self.v))
        return np.stack([o, o + u, o + v + np.where(self.triangle[which, None], 0.0, u), o + v], axis=1)

    def on_triangles(self, facet, at):
        """Places (h, 2) of hits on meshes' triangles, which facets reach a little beyond."""
        there = self.chart_at(facet, at)
        return there / np.maximum(there.sum(axis=1, keepdims=True), 1.0)

    def before(self, points, normals):
        """(n, 3) m: points (n, 3) that stand for light sent along normals (n, 3), moved off its plane, in which things
        must not hide them."""
        return points + FLUSH * self.tolerance * normals

    def within(self, which, points):
        """(k,) Whether points (k, 3) m in the planes of facets (k,) are in their outlines."""
        u, v, normal, at = self.u[which], self.v[which], self.normal[which], points - self.origin[which]
        s, t, area = (np.einsum("ki,ki->k", np.cross(*ends), normal) for ends in ((at, v), (u, at), (u, v)))
        return (s >= 0) & (t >= 0) & (np.where(self.triangle[which], s + t, np.maximum(s, t)) <= area)

    def chart_at(self, facet, at):
        """Chart positions (h, 2) of hits; a facet's own (s, t) are on it, a little wider than the shape is."""
        local = np.flatnonzero(facet < self.count)
        chart = self.chart.take(facet[local], axis=0)
        at = at.astype(float)
        there = at.take(local, axis=0)
        at[local] = chart[:, :, 0] + chart[:, :, 1] * there[:, :1] + chart[:, :, 2] * there[:, 1:]
        return np.clip(at, 0.0, 1.0)

    @cached_property
    def boxes(self):
        """low, high (3, m + b) m of the facets and the balls."""
        corners, reach = self.corners(slice(None)), self.ball_reach
        low = np.concatenate([corners.min(axis=1), self.ball_centre - reach])
        return low.T.copy(), np.concatenate([corners.max(axis=1), self.ball_centre + reach]).T.copy()

    @cached_property
    def ball_reach(self):
        """(b, 3) m, how far balls reach from their centres along each axis."""
        return np.linalg.norm(self.ball_linear, axis=2)

    @cached_property
    def sieve(self):
        """The Sieve of the facets."""
        return Sieve(self)

    @cached_property
    def near_flats(self):
        """See near_flats; a list, as what parts cells and what points are moved off both go through it."""
        return list(near_flats(self))

    @cached_property
    def near_facets(self):
        """See near_facets; a list, as meshes' light is kept anew where that gets finer."""
        return list(near_facets(self))

    @property
    def count(self):
        """How many facets there are, balls aside."""
        return len(self.origin)
