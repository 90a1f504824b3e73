"""What touches what, decided once, by the rounding of the coordinates themselves.

Planes in one plane have one meaning. Where they look the same way they lie in layers, the smaller on top (of equal ones
the later). Where they look opposite ways they are in contact, the smaller before the larger, and dark to each other;
unless both are walls of rooms, which then lie back to back. On what has two sides others are on either, see
lies_toward. What is closer than the rounding counts as in contact.
The layers are parted by a little more than the rounding, so that everything later finds them in order; what lies
between two of them receives nothing.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .at_once import in_turn
from .boxes import near, overlap
from .in_depth import against_dome
from .layers import bodies, lies_toward, moves, ranks, reaches_beyond, rounded, welded
from .scene import Scene
from .shape_table import ShapeTable
from .shapes.shape import PARALLEL, bounds_of, box_of, tolerance_of, unit
from .tolerances import CLEAR
from .wedges import Rays, Wedges, edges, feet, to_border, within

NUDGE = 1e-7, 1e-2  # of its shorter edge, of each at most: what points keep from a plane's border, off the next plane
PARTED = 256.0  # tolerances between layers: seen at a slant, edges are told apart by ten
BESIDE = 1e-2  # of its radius: a ball whose middle is no further from a plane has no side of it


@dataclass(frozen=True)
class Contacts:
    """Of the shapes of a scene; entries sorted by the first of each pair.

    covers: (surface, shape) index arrays (k,): the surface lies against that plane, and is dark where they overlap.
    stands: (shape, other) index arrays (k,): planes that others touch or cross, not in one plane; balls that touch or
    cross planes.
    tolerance m: what touching coordinates really differ by, and our sums of them. parted m: the distance of the top
    layer from its plane's place, 0 without layers. warnings: for the user.
    """

    scene: Scene
    covers: tuple
    stands: tuple
    tolerance: float
    parted: float = 0.0
    warnings: list = field(default_factory=list)

    @property
    def apart(self):
        """m; what points keep from the borders of their planes, where others stand or layers have been parted."""
        return self.parted + CLEAR * self.tolerance

    def covered(self, points, surface):
        """Whether points (n, 3) m on surfaces (n,) (-1: free) lie between two planes in contact -> (n,) bool"""
        out = np.zeros(len(points), bool)
        point, shape = entries(self.covers, surface)
        if len(point):
            inside = within(self.planes, self.planes.number[shape], points[point], CLEAR / 2 * self.tolerance)
            out[point[inside]] = True
        return out

    def clear(self, points, surface):
        """points (n, 3) m on surfaces (n,): those at the feet of others on planes moved into the open between these,
        see wedges, as far as points keep from borders; balls' off planes that they touch; those covered moved before
        what covers them: nobody sees them, and light that goes on as if they were seen is smooth."""
        point, shape = entries(self.stands, self.scene.shape_of[surface])
        if len(point):
            points, flat = points.copy(), self.planes.flat[self.scene.shape_of[surface[point]]]
            self._off_planes(points, surface, point[~flat], shape[~flat])
            self._into_the_open(points, surface, point[flat], self.planes.number[shape[flat]])
        if (dark := self.covered(points, surface)).any():
            points = points.copy()
            points[dark] += self.apart * self._normals(surface[dark])
        return points

    def _off_planes(self, points, surface, point, shape):
        """Moves those of points (n, 3) m on balls' surfaces (n,) that lie on planes, pairs (point, shape) (e,), to the
        side that the ball's middle is on; where it is on neither, to the lit one."""
        near, planes, k = CLEAR * self.tolerance, self.planes, self.planes.number[shape]
        ball = self.scene.shape_of[surface[point]]
        middle = np.einsum("ni,ni->n", planes.middle[ball] - planes.corners[k, 0], planes.normal[k])
        beside = np.abs(middle) > BESIDE * planes.radius[ball]
        normal = np.where(beside, np.sign(middle), planes.lit[k])[:, None] * planes.normal[k]
        height = np.einsum("ni,ni->n", points[point] - planes.corners[k, 0], normal)
        on = (np.abs(height) < near) & within(planes, k, points[point], -near)
        np.add.at(points, point[on], (near - height[on])[:, None] * normal[on])

    def _into_the_open(self, points, surface, point, k):
        """Moves those of points (n, 3) m on planes' surfaces (n,) that others stand at, pairs (point, plane k) (e,)."""
        some, place = np.unique(point, return_inverse=True)
        surface, place = surface[some], place.reshape(-1)
        own, normals = self.planes.number[self.scene.shape_of[surface]], self._normals(surface)
        keeps = self.keeps[surface]
        at, end = to_border(self.planes, own, points[some], self.border[surface])
        place, k = self._standing(at, own, normals, place, k)
        shows = (1 + (self.planes.lit[:, None] * (1, -1) > 0)) * (self.scene.sides[self.planes.index] >= 0)
        rays = feet(self.planes, shows, at, normals, (place, k), CLEAR * keeps, self.apart)
        tip = at[rays.point] + CLEAR * keeps[rays.point, None] * rays.direction
        parted = np.unique(rays.point[within(self.planes, own[rays.point], tip, keeps[rays.point])])
        if not len(parted):
            return
        rays = rays.take(np.isin(rays.point, parted))
        first = unit(self.planes.corners[own, 1] - self.planes.corners[own, 0])
        wedges = Wedges(Rays.of(rays, edges(self.planes, own, end, normals, parted)), normals, first)
        which = wedges.point
        there = at[which] + (keeps[which] / wedges.lean)[:, None] * wedges.middle
        wide = within(self.planes, own[which], there, 0.0) & (wedges.width > PARALLEL)
        best = wedges.best(4 * wide + 2 * ~self.covered(there, surface[which]) + (wedges.shown > 0))
        best = best[wide[best]]
        points[some[which[best]]] = there[best]

    def _standing(self, points, own, normals, point, k):
        """Of pairs (point, plane k) (e,) those where the plane goes through the point, of points (n, 3) m on planes own
        (n,), and is not all behind the surface there, normals (n, 3)."""
        planes, at = self.planes, points[point]
        height = np.einsum("ni,ni->n", at - planes.corners[k, 0], planes.normal[k])
        on = np.flatnonzero((np.abs(height) < self.apart) & within(planes, k, at, -self.apart))
        point, k = point[on], k[on]
        offset = planes.corners[k] - planes.corners[own[point], :1]
        above = np.einsum("nci,ni->nc", offset, normals[point]).max(axis=1) > self.apart
        return point[above], k[above]

    @cached_property
    def keeps(self):
        """(n surfaces,) m; what points keep from their planes' borders and from what stands there: as far from all, as
        light differs by the direction that a corner is come near from; 0 of balls."""
        shorter = np.zeros(len(self.scene.shapes))
        shorter[self.planes.index] = np.maximum(self.apart, NUDGE[0] * self.planes.edges.min(axis=1))
        return shorter[self.scene.shape_of]

    @cached_property
    def border(self):
        """(n surfaces, 2): of planes' edges, what points keep from their borders; 0 of balls."""
        edges = np.ones((len(self.scene.shapes), 2))
        edges[self.planes.index] = self.planes.edges
        return np.minimum(self.keeps[:, None] / edges[self.scene.shape_of], NUDGE[1])

    def _normals(self, surface):
        """Unit normals (n, 3) of surfaces (n,) on planes."""
        return self.scene.sign[surface][:, None] * self.planes.normal[self.planes.number[self.scene.shape_of[surface]]]

    @cached_property
    def shells(self):
        """(surface, shape) index arrays (k,): inner sides of spheres, and shapes that reach beyond them: what does so
        is hidden by the sphere itself."""
        inner = np.flatnonzero(self.scene.inside)
        surface, shape = (a.ravel() for a in np.meshgrid(inner, np.arange(len(self.scene.shapes)), indexing="ij"))
        other = self.scene.shape_of[surface] != shape
        surface, shape = surface[other], shape[other]
        if not len(surface):
            return surface, shape
        table, reaches, dome = ShapeTable(self.scene.shapes), np.zeros(len(surface), bool), self.scene.shape_of[surface]
        for of, k in zip(("ball_of", "polygon_of"), table.by_kind(shape)):
            if len(k):
                cross, outside = against_dome(table, dome[k], **{of: shape[k]})
                reaches[k] = cross | outside
        return surface[reaches], shape[reaches]

    @cached_property
    def planes(self):
        return _Planes(self.scene)


class _Planes:
    """The scene's planes as arrays; number (n shapes,): of each shape among them."""

    def __init__(self, scene):
        flat = np.array([s.is_flat for s in scene.shapes])
        self.flat, self.index, self.number = flat, np.flatnonzero(flat), np.cumsum(flat) - 1
        self.middle, self.radius = bounds_of(scene.shapes)
        planes = [scene.shapes[k] for k in self.index]
        self.corners = np.array([p.corners for p in planes]).reshape(-1, 4, 3)
        self.normal = np.array([p.normal for p in planes]).reshape(-1, 3)
        self.inverse = np.array([p.inverse for p in planes]).reshape(-1, 3, 3)
        self.area = np.array([p.area for p in planes])
        self.half = np.array([p.half for p in planes], bool)
        twist = np.array([p.twist for p in planes]).reshape(-1, 3)
        self.twisted = np.where(self.half, 0.0, np.einsum("ni,ni->n", twist, self.normal))  # m, a corner off its plane
        self.edges = np.linalg.norm(self.corners[:, [1, 3]] - self.corners[:, [0]], axis=2)
        front, back = (scene.sides >= 0).T
        self.lit = np.where(front[self.index], 1.0, -1.0)  # which side counts as the front
        self.two_sided = (front & back)[self.index]


def contacts_of(scene):
    """The Contacts of a scene; of one that was settled, those it was settled by."""
    if "_contacts" not in scene.__dict__:
        object.__setattr__(scene, "_contacts", _touching(scene)[0])
    return scene._contacts


def settle(scene):
    """scene -> (Scene, origin (3,) m): near the origin, and with its layers parted; found once.

    Points of the one are those of the other minus the origin; surfaces keep their order.
    """
    if "_settled" not in scene.__dict__:
        settled, origin = _settle(scene)
        object.__setattr__(settled, "_settled", (settled, np.zeros(3)))
        object.__setattr__(scene, "_settled", (settled, origin))
    return scene._settled


def _settle(scene):
    contacts, corners = _touching(scene)
    low, high = box_of(scene.shapes)
    middle = (low + high) / 2
    origin = middle if np.linalg.norm(middle) > np.linalg.norm(high - low) else np.zeros(3)
    if not origin.any() and (corners == contacts.planes.corners).all():
        return _moved(scene, [scene.shapes[k] for k in scene.shape_of], contacts), origin
    planes = contacts.planes
    parted = [corners[k] if flat else None for k, flat in zip(planes.number, planes.flat)]
    shapes = [shape.moved(origin, its) for shape, its in zip(scene.shapes, parted)]
    return _moved(scene, [shapes[k] for k in scene.shape_of], contacts), origin


def settled_again(settled, scene):
    """The scene, of the same surfaces as the one that was settled but under other light, with its shapes."""
    return _moved(scene, [s.shape for s in settled.surfaces], contacts_of(settled))


def _moved(scene, shapes, contacts):
    surfaces = tuple(replace(s, shape=shape) for s, shape in zip(scene.surfaces, shapes))
    moved = Scene(surfaces, scene.sky or scene.background, scene.rounding, scene.lights)
    object.__setattr__(moved, "tolerance", contacts.tolerance)
    object.__setattr__(moved, "_contacts", replace(contacts, scene=moved))
    return moved


def _touching(scene):
    """Contacts of the scene, and the corners (planes, 4, 3) m of its planes with the layers parted."""
    planes = _Planes(scene)
    i, j = near(planes.corners.min(axis=1), planes.corners.max(axis=1), scene.tolerance)
    corners = welded(planes.corners, i, j, 2 * scene.tolerance)
    outline, lit = planes.corners.copy(), planes.lit[:, None] * planes.normal
    outline[planes.half, 3] = np.nan  # the third one again
    body, whole = bodies(outline, lit, i, j, 2 * scene.tolerance)
    # the larger comes first, of equal ones the earlier
    area = rounded(np.bincount(whole, planes.area)[whole])
    rank = ranks(area, np.arange(len(area)))
    i, j = np.where(rank[i] < rank[j], i, j), np.where(rank[i] < rank[j], j, i)
    height = np.einsum("kci,ki->kc", planes.corners[j] - planes.corners[i, :1], planes.normal[i])
    flush = np.abs(height).max(axis=1) <= scene.tolerance
    over = flush & overlap(planes.corners, planes.normal, i, j, scene.tolerance)
    lower, upper = i[over], j[over]

    def beyond(k):
        return reaches_beyond(planes.corners, planes.normal, whole, whole[lower[k]], whole[upper[k]], scene.tolerance)

    toward = lies_toward(lit, body, planes.two_sided, area, rank, lower, upper, beyond)
    shown = np.einsum("ki,ki->k", lit[upper], np.where(body[upper, None] > 0, lit[lower], toward)) > 0
    # of bodies in contact all but the edges is hidden: they keep theirs, unless one looks into them
    apart = shown | (body[upper] == 0) | planes.two_sided[upper]
    heights = np.abs(np.concatenate([height[np.abs(height) <= scene.tolerance], planes.twisted]))
    tolerance = max(
        tolerance_of(scene.shapes, 0.0), 2 * heights.max(initial=0), 2 * np.abs(corners - planes.corners).max(initial=0)
    )
    layer = moves(planes.normal, rank, lower[apart], upper[apart], toward[apart])
    corners += (PARTED * tolerance * layer[:, None] * planes.normal)[:, None]
    rest = np.flatnonzero(~flush & (height.min(axis=1) <= scene.tolerance))
    rest = rest[height[rest].max(axis=1) >= -scene.tolerance]
    ball, plane = _rests(scene, planes)
    stands = (
        np.concatenate([planes.index[i[rest]], planes.index[j[rest]], ball]),
        np.concatenate([planes.index[j[rest]], planes.index[i[rest]], plane]),
    )
    covers = _covers(scene, planes, lower, upper, toward)
    warnings = _thin(scene, planes, lower, upper, height[over])
    parted = PARTED * tolerance * float(np.abs(layer).max(initial=0))
    return Contacts(scene, _sorted(*covers), _sorted(*stands), tolerance, parted, warnings), corners


def _rests(scene, planes):
    """(ball, plane) shape indices (k,) of balls that touch planes or cross them."""
    half = planes.radius[:, None] * np.ones(3)
    low, high = planes.middle - half, planes.middle + half
    low[planes.index], high[planes.index] = planes.corners.min(axis=1), planes.corners.max(axis=1)
    a, b = near(low, high, scene.tolerance)
    a, b = np.concatenate([a, b]), np.concatenate([b, a])
    mixed = ~planes.flat[a] & planes.flat[b]
    ball, plane = a[mixed], b[mixed]
    k = planes.number[plane]
    linear = np.array([s.linear for s in scene.shapes])
    height = np.einsum("ni,ni->n", planes.middle[ball] - planes.corners[k, 0], planes.normal[k])
    reach = np.linalg.norm(np.einsum("ni,nij->nj", planes.normal[k], linear[ball]), axis=1)
    touch = np.abs(height) <= reach + scene.tolerance
    return ball[touch], plane[touch]


def _covers(scene, planes, i, j, toward):
    """(surface, shape) pairs (k,): surfaces that look at the plane which lies against them."""
    pairs = [np.zeros((2, 0), int)]
    for one, other, direction in ((i, j, toward), (j, i, -toward)):
        looks = np.einsum("ki,ki->k", planes.normal[one], direction)[:, None] * (1, -1) > 0
        pair, which = np.nonzero(looks)
        surface = scene.sides[planes.index[one[pair]], which]
        pairs.append(np.stack([surface, planes.index[other[pair]]])[:, surface >= 0])
    return np.concatenate(pairs, axis=1)


def _thin(scene, planes, i, j, height):
    """Sentences for pairs whose gap, heights (k, 4) m, is none only because their coordinates are rounded."""
    names = {}
    for surface, shape in zip(scene.surfaces, scene.shape_of):
        names.setdefault(int(shape), surface.name)
    thin = np.flatnonzero(np.abs(height.mean(axis=1)) > scene.tolerance / 8) if len(height) else []
    return [
        f"{names[planes.index[i[k]]]!r} and {names[planes.index[j[k]]]!r} are closer than the rounding of their "
        "coordinates: taken as in contact"
        for k in thin
    ]


def _sorted(first, second):
    order = np.argsort(first, kind="stable")
    return first[order], second[order]


def entries(pairs, keys):
    """Of sorted pairs ((k,), (k,)) and keys (n,): positions among the keys and seconds of the pairs that begin so."""
    first, second = pairs
    low, high = (np.searchsorted(first, keys, side=side) for side in ("left", "right"))
    place, step = in_turn(high - low)
    return place, second[low[place] + step]
