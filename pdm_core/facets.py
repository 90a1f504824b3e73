"""Polygons and meshes as convex pieces for the exact engine: triangles, parallelograms with one corner twice."""

from dataclasses import replace

import numpy as np

from .mesh import Mesh
from .polygon import Polygon
from .scene import Plane, Scene


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
    """[Facet] of a Polygon or a Mesh, the same ones each time."""
    if "_facets" not in shape.__dict__:
        corners = shape.triangles if isinstance(shape, Polygon) else shape.vertices[shape.triangles]
        shape.__dict__["_facets"] = [Facet.of(c, shape.thickness) for c in corners]
    return shape.__dict__["_facets"]


def in_pieces(scene):
    """scene -> (Scene with polygons and meshes in pieces, (n pieces,) the surface that each is a piece of)."""
    surfaces, owner = [], []
    for k, surface in enumerate(scene.surfaces):
        pieces = facets_of(surface.shape) if isinstance(surface.shape, Polygon | Mesh) else [surface.shape]
        surfaces += [replace(surface, shape=piece) for piece in pieces]
        owner += [k] * len(pieces)
    return Scene(surfaces, scene.background, scene.rounding), np.array(owner)
