"""Charts of a field: of planes the unit square, cut where light bends or jumps, of spheres the faces of a cube.

Arrays are those of surfaces (n,) of one kind; each kind answers the same questions.
"""

import numpy as np

from .charts import CHARTS, JUMP, charts_of
from .shapes.shape import unit
from .tolerances import TOUCHING


def graded(t):
    """Chart coordinate t in [0, 1] -> position along a plane's edge: nodes crowd to the borders, where neighbours
    meet and light has d log d terms, quadratically."""
    return t * t * (3 - 2 * t)


def graded_slope(t):
    return 6 * t * (1 - t)


def ungraded(s):
    return 0.5 - np.sin(np.arcsin(np.clip(1 - 2 * s, -1.0, 1.0)) / 3)


class Rectangles:
    """Charts of a scene's planes: cuts, jumps, across, see charts; starts (n surfaces, 2, CHARTS) in lattice steps,
    grid of them a chart; count (n surfaces,) of charts; border: see charts."""

    def __init__(self, scene, grid):
        self.scene, self.grid = scene, grid
        layout = charts_of(scene)
        self.cuts, self.jumps, self.across = layout.cuts, layout.jumps, layout.across
        self.starts, self.count = layout.starts(grid), layout.across.prod(axis=1)
        self.linear = np.array([s.shape.linear for s in scene.surfaces])
        self.twist = np.array([s.shape.twist for s in scene.surfaces])
        self.border = layout.border

    def lattice(self, surface, face, steps):
        """Numbers of charts and lattice steps (n, 2) -> places (n, 3) on the surfaces' lattices."""
        return np.column_stack([steps, steps[:, 0] * 0])

    def local(self, surface, place):
        """Places (n, 3) on lattices -> local coordinates (n, 3)."""
        steps, starts = place[:, :2], self.starts[surface]
        begun = (steps[:, :, None] >= starts) & (np.arange(CHARTS) < self.across[surface][:, :, None])
        chart = begun.sum(axis=2) - 1
        t = (steps - np.take_along_axis(starts, chart[:, :, None], axis=2)[:, :, 0]) / self.grid
        return self._off_border(surface, chart, t)

    def within(self, surface, face, at):
        """Chart coordinates (n, 2) in charts of these numbers -> local coordinates (n, 3)."""
        return self._off_border(surface, self.number(surface, face), at)

    def _off_border(self, surface, chart, t):
        """Off the planes' borders and the lines where light jumps."""
        border, sides = self.border[surface], []
        for k in (0, 1):
            cut = self.cuts[surface[:, None], (0, 1), chart + k]
            jump = self.jumps[surface[:, None], (0, 1), chart + k]
            off = np.where((cut == 0) | (cut == 1), border, np.where(jump, JUMP * border, 0.0))
            sides.append(cut + (off, -off)[k])
        at = sides[0] + (sides[1] - sides[0]) * graded(t)
        return np.column_stack([at, 0 * at[:, 0]])

    def normals(self, surface, local, across):
        """local, across (n, 3): coordinates, and these through the inverse map -> vectors (n, 3) along the fronts'
        normals; near each edge of a plane as that lies."""
        u, v, twist = self.linear[surface, :, 0], self.linear[surface, :, 1], self.twist[surface]
        return np.cross(u + local[:, 1:2] * twist, v + local[:, :1] * twist)

    def number(self, surface, face):
        """(n, 2): charts' numbers along both edges"""
        return np.stack(np.divmod(face, self.across[surface, 1]), axis=1)

    def areas(self, surface, face, low, high):
        """Corners (n, 2) in chart coordinates -> areas (n,) m^2 between"""
        chart = self.number(surface, face)
        extent = self._along(surface, chart, high) - self._along(surface, chart, low)
        return self.scene.areas[surface] * extent.prod(axis=1)

    def _along(self, surface, chart, t):
        """Coordinates t (n, 2) in charts (n, 2) -> positions along the planes' edges."""
        low, high = (self.cuts[surface[:, None], (0, 1), chart + k] for k in (0, 1))
        return low + (high - low) * graded(t)

    def inset(self, surface, points):
        """Points (n, 3) m of one surface moved off its border."""
        shape, border = self.scene.surfaces[surface].shape, self.border[surface]
        local = shape.local(points)
        local[:, :2], local[:, 2] = np.clip(local[:, :2], border, 1 - border), 0.0  # where `world` puts the twist
        return shape.world(local)

    def at(self, surface, local):
        """Local coordinates (n, 3) -> numbers of charts (n,) and coordinates (n, 2) in them, from 0 to 1."""
        at = local[:, :2]
        chart = (at[:, :, None] >= self.cuts[surface, :, 1:-1]).sum(axis=2)
        chart = np.minimum(chart, self.across[surface] - 1)
        low, high = (self.cuts[surface[:, None], (0, 1), chart + k] for k in (0, 1))
        face = chart[:, 0] * self.across[surface, 1] + chart[:, 1]
        return face, np.clip(ungraded((at - low) / (high - low)), 0.0, 1.0)


class Cubes:
    """Charts of the spheres of a scene: faces of the cube around each, equi-angular, in the order -x, -y, -z, x, y, z.
    depth (n surfaces,): of the unit sphere, where its points lie."""

    def __init__(self, scene, grid, depth):
        self.scene, self.grid, self.depth = scene, grid, depth
        self.origin = np.array([s.shape.origin for s in scene.surfaces])
        self.count = np.full(len(scene), 6)

    def lattice(self, surface, face, steps):
        place = np.zeros((len(surface), 3), np.int64)
        axis, rows = face % 3, np.arange(len(surface))
        place[rows, (axis + 1) % 3], place[rows, (axis + 2) % 3] = steps[:, 0], steps[:, 1]
        place[rows, axis] = np.where(face >= 3, self.grid, 0)
        return place

    def local(self, surface, place):
        return unit(np.tan((2 * place / self.grid - 1) * (np.pi / 4)))

    def within(self, surface, face, at):
        axis, rows, local = face % 3, np.arange(len(face)), np.empty((len(face), 3))
        local[rows, (axis + 1) % 3] = np.tan((2 * at[:, 0] - 1) * (np.pi / 4))
        local[rows, (axis + 2) % 3] = np.tan((2 * at[:, 1] - 1) * (np.pi / 4))
        local[rows, axis] = np.where(face >= 3, 1.0, -1.0)
        return unit(local)

    def normals(self, surface, local, across):
        return across

    def number(self, surface, face):
        return np.zeros((len(face), 2), int)

    def areas(self, surface, face, low, high):
        a, b = np.tan((2 * low - 1) * np.pi / 4), np.tan((2 * high - 1) * np.pi / 4)
        angle = _solid(b[:, 0], b[:, 1]) - _solid(a[:, 0], b[:, 1])
        angle += _solid(a[:, 0], a[:, 1]) - _solid(b[:, 0], a[:, 1])
        return self.scene.areas[surface] * angle / (4 * np.pi)

    def inset(self, surface, points):
        """Points (n, 3) m of one surface moved to its depth."""
        return self.origin[surface] + self.depth[surface] * (points - self.origin[surface])

    def at(self, surface, local):
        x, y, z = np.ascontiguousarray(local.T)
        ax, ay, az = np.abs(x), np.abs(y), np.abs(z)
        axis = np.where((ax >= ay) & (ax >= az), 0, np.where(ay >= az, 1, 2))
        first = 3 * np.arange(len(local))
        top, a, b = (local.ravel().take(first + k) for k in (axis, (axis + 1) % 3, (axis + 2) % 3))
        size = np.maximum(np.abs(top), 1e-300)
        at = np.arctan(np.stack([a / size, b / size], axis=1)) * (2 / np.pi) + 0.5
        return axis + 3 * (top > 0), np.clip(at, 0.0, 1.0)


class FieldCharts:
    """The charts of all surfaces (n,) of a scene, of both kinds, and where these lie in space: points and normals."""

    def __init__(self, scene, contacts, grid):
        shapes = [s.shape for s in scene.surfaces]
        self.origin = np.array([s.origin for s in shapes])
        self.linear, self.twist = np.array([s.linear for s in shapes]), np.array([s.twist for s in shapes])
        self.inverse = np.array([s.inverse for s in shapes])
        self.sign = scene.sign
        self.depth = np.ones(len(shapes))  # of the unit sphere: off its own inner side, where that hides something
        self.depth[contacts.shells[0]] = 1 - 4 * TOUCHING
        self.rectangles = Rectangles(scene, grid)
        self.kinds = self.rectangles, Cubes(scene, grid, self.depth)
        self.kind = np.array([s.is_ball for s in shapes], int)  # (n surfaces,) which of the kinds
        self.count = np.choose(self.kind, [kind.count for kind in self.kinds])
        self.span = CHARTS * (grid + 1)  # places of all lattices along each axis

    def each(self, what, surface, *given):
        """What the charts of each one's kind tell of surfaces (n,), and given (n, ...): arrays (n, ...)."""
        kind = self.kind[surface]
        first = kind[0] if len(kind) else 0
        if (kind == first).all():
            return getattr(self.kinds[first], what)(surface, *given)
        out, places = [], [np.flatnonzero(kind == k) for k in range(len(self.kinds))]
        for charts, some in zip(self.kinds, places):
            out.append(getattr(charts, what)(surface.take(some), *(a.take(some, axis=0) for a in given)))
        return _merged(out, places) if isinstance(out[0], np.ndarray) else [_merged(p, places) for p in zip(*out)]

    def keys(self, surface, face, steps):
        """surface, face (n,), steps (n, 2) on the face -> (n,) keys; a point on two faces has one key."""
        x, y, z = self.each("lattice", surface, face, steps).T
        return ((surface * self.span + x) * self.span + y) * self.span + z

    def of_keys(self, keys):
        """keys (n,) -> surface (n,), place (n, 3) on its lattice."""
        rest, z = np.divmod(keys, self.span)
        rest, y = np.divmod(rest, self.span)
        surface, x = np.divmod(rest, self.span)
        return surface, np.stack([x, y, z], axis=1)

    def part(self, surface, face):
        """(n,) The part of its surface that each chart is on, by the number of its first one: a sphere is one part,
        each chart of a plane is."""
        return np.where(self.kind[surface] == 0, face, 0)

    def local(self, surface, points):
        """points (n, 3) m on surfaces (n,) -> their local coordinates (n, 3)"""
        return np.einsum("nij,nj->ni", self.inverse.take(surface, axis=0), points - self.origin.take(surface, axis=0))

    def points(self, surface, local):
        """Local coordinates (n, 3) on surfaces (n,) -> points (n, 3) m"""
        affine = np.einsum("nij,nj->ni", self.linear.take(surface, axis=0), local * self.depth[surface][:, None])
        twist = (local[:, 0] * local[:, 1])[:, None] * self.twist.take(surface, axis=0)
        return self.origin.take(surface, axis=0) + affine + twist

    def normals(self, surface, local):
        """Unit normals (n, 3) there, of the surfaces' sides."""
        across = np.einsum("nji,nj->ni", self.inverse.take(surface, axis=0), local)
        return unit(self.each("normals", surface, local, across)) * self.sign[surface][:, None]

    def inset(self, surface, points):
        """Points (n, 3) m of one surface moved off its border, or to its depth."""
        return self.kinds[self.kind[surface]].inset(surface, points)


def _merged(parts, places):
    """Parts (k, ...) of arrays, each at its places (k,), as one."""
    out = np.empty((sum(map(len, places)), *parts[0].shape[1:]), parts[0].dtype)
    for part, some in zip(parts, places):
        out[some] = part
    return out


def _solid(x, y):
    """Solid angle of the rectangle (0, 0)..(x, y) at distance 1 from its corner."""
    return np.arctan2(x * y, np.sqrt(1 + x * x + y * y))
