"""Where points near a mesh receive light: on their face, off its rims, lifted off it, with shading normals."""

from functools import cached_property

import numpy as np

from ..tolerances import FLUSH, KEPT
from .triangles import INNER, barycentric, inner

OPPOSITE = -0.5  # cosine of a face to the normal told below which that is another face's
LIFTED = 1e-4  # of a triangle's size: what points that give or receive light are lifted off it


class MeshReceiving:
    """Of a Mesh."""

    def __init__(self, mesh):
        self.mesh = mesh

    @cached_property
    def _longest(self):
        """(t,) m of the triangles' edges."""
        return np.linalg.norm(self.mesh.corners - np.roll(self.mesh.corners, 1, axis=1), axis=2).max(axis=1)

    def at(self, points, sign, least, normals=None, middle=None, triangle=None):
        """points (n, 3) m near it -> where they receive light on the side of the sign, at least so many m off it, and
        shading normals there (n, 3): those told, its own where they are nan or None; its faces' (n, 3); and which
        triangles they are on (n,) and where (n, 3) m.
        middle (n, 3) m: a point of the face that each belongs to, nan or None for the nearest; triangle (n,): where it
        is known."""
        mesh, toward = self.mesh, points
        if middle is not None:  # clearly on its own face
            known = np.isfinite(middle).all(axis=1)
            toward = np.where(known[:, None], points + INNER * (np.nan_to_num(middle) - points), points)
        if triangle is None:
            triangle, bary = mesh.nearest(toward)
        else:
            bary = barycentric(toward, mesh.corners[triangle])
        flat = sign * mesh.triangle_normals[triangle]
        smooth = sign * np.einsum("nk,nki->ni", bary, mesh.corner_normals[triangle])
        if normals is not None:
            given = np.isfinite(normals).all(axis=1) & (np.abs(np.nan_to_num(normals)).max(axis=1) > 0)
            smooth = np.where(given[:, None], np.nan_to_num(normals), smooth)
            # of two faces back to back, however they are cut, the nearest may be the other one
            flat[given & (np.einsum("ni,ni->n", flat, smooth) < OPPOSITE)] *= -1
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        smooth = np.where(length > 1e-12, smooth / np.maximum(length, 1e-300), flat)
        corners, inside = mesh.corners[triangle], inner(bary)
        foot, place = (np.einsum("nk,nki->ni", a, corners) for a in (bary, inside))
        place += self._inward(triangle, inside, least)
        bent = np.linalg.norm(flat - smooth, axis=1)  # of flat faces none: what is thin is not lifted through
        lift = np.maximum(LIFTED * bent * np.sqrt(mesh.areas[triangle]), FLUSH / KEPT * least)
        # off the face, or along the light's own normal where faces meet in a ridge
        return place + lift[:, None] * (flat + smooth) / 2, smooth, flat, (triangle, foot)

    def _inward(self, triangle, bary, least):
        """(n, 3) m: how far points, bary (n, 3) on triangles (n,), are moved along them, so as to keep at least so many
        m from where the mesh ends: what touches it there may be a little before them."""
        mesh = self.mesh
        out, least = np.zeros((len(triangle), 3)), min(least, mesh.thickness / 4)
        # others keep it anyway
        some = np.flatnonzero(least * self._longest[triangle] > 2 * INNER * mesh.areas[triangle])
        if not len(some) or not len(mesh.ways_in[0]):
            return out
        (names, ways), name = mesh.ways_in, mesh.places.names[triangle[some]]
        found = np.minimum(np.searchsorted(names, name), len(names) - 1)
        way = np.einsum("nk,nki->ni", np.where(names[found] == name, bary[some], 0.0), ways[found])
        normal = mesh.triangle_normals[triangle[some]]
        out[some] = least * (way - np.einsum("ni,ni->n", way, normal)[:, None] * normal)
        return out
