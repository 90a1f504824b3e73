"""Polygons and meshes as convex pieces for the exact engine: rectangles, or triangles, which are parallelograms with
one corner twice."""

from dataclasses import replace

import numpy as np

from .mesh import Mesh
from .outlines import edges_of
from .polygon import Polygon
from .scene import Plane, Scene

ALIGNED, NARROW = 1e-12, 1e-5  # of the longer side: how straight edges are, and how far from each other, of rectangles


class Facet(Plane):
    """The triangle with corners (3, 3) m, counter-clockwise seen from its front; thickness m: of what it is a part of.

    local is affine, with s + t <= 1 within; world takes the whole square, whose side t = 1 is the last corner.
    """

    half = True

    @classmethod
    def of(cls, corners, thickness):
        facet = cls.through(corners[[0, 1, 2, 2]])
        facet.__dict__["thickness"] = thickness
        return facet

    def moved(self, corners):
        """The same part at corners (4, 3) m."""
        return Facet.of(corners[:3], self.thickness)

    @property
    def area(self):
        """m^2"""
        return float(np.linalg.norm(np.cross(self.u, self.v))) / 2

    def problem(self):
        """None: what is wrong with the whole has been said, and a part may be narrow."""
        return None


def facets_of(shape):
    """[Plane] of a Polygon or a Mesh: rectangles where all its corners are right angles, else triangles; the same ones
    each time."""
    if "_facets" not in shape.__dict__:
        pieces = _rectangles(shape) if isinstance(shape, Polygon) else None
        if pieces is None:
            corners = shape.triangles if isinstance(shape, Polygon) else shape.vertices[shape.triangles]
            pieces = [Facet.of(c, shape.thickness) for c in corners]
        shape.__dict__["_facets"] = pieces
    return shape.__dict__["_facets"]


def _rectangles(polygon):
    """[Plane], from one height at which it has a corner to the next; None if it has edges that are not upright or
    level, or corners at all but the same height."""
    corner, axes, sides = polygon._chart
    p, q = edges_of(polygon._flat_loops)
    size = sides.max()
    if (np.abs(q - p).min(axis=1) > ALIGNED * size).any():
        return None
    y = _apart(np.concatenate([p[:, 1], q[:, 1]]), ALIGNED * size)
    x = _apart(p[:, 0], ALIGNED * size)
    if min(np.diff(x).min(), np.diff(y).min()) < NARROW * size:
        return None
    upright = np.abs(q - p)[:, 1] > NARROW * size
    at, low, high = p[upright, 0], *np.sort([p[upright, 1], q[upright, 1]], axis=0)
    open_, done = {}, []  # spans, (start, end) in x, that go on upwards: the height at which each began
    for middle, bottom in zip(np.append((y[:-1] + y[1:]) / 2, np.inf), y):
        spans = np.sort(at[(low < middle) & (middle < high)])
        spans = {tuple(span) for span in np.searchsorted(x, spans.reshape(-1, 2) - NARROW * size / 2).tolist()}
        for span in open_.keys() - spans:
            done.append((*x[list(span)], open_.pop(span), bottom))
        for span in spans - open_.keys():
            open_[span] = bottom
    ends = np.array(done)[:, [0, 2, 1, 2, 1, 3, 0, 3]].reshape(-1, 4, 2)
    return [Plane.through(corners) for corners in corner + ends @ axes]


def _apart(values, tolerance):
    """The values in order, of those within the tolerance of each other the first."""
    values = np.sort(values)
    return values[np.diff(values, prepend=-np.inf) > tolerance]


def in_pieces(scene):
    """scene -> (Scene with polygons and meshes in pieces, (n pieces,) the surface that each is a piece of)."""
    surfaces, owner = [], []
    for k, surface in enumerate(scene.surfaces):
        pieces = facets_of(surface.shape) if isinstance(surface.shape, Polygon | Mesh) else [surface.shape]
        surfaces += [replace(surface, shape=piece) for piece in pieces]
        owner += [k] * len(pieces)
    return Scene(surfaces, scene.background, scene.rounding), np.array(owner)
