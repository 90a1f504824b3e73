"""Places on surfaces as receivers of rays: moved off what bounds their shapes, and told what they must not meet."""

import numpy as np

from ..read_off import runs_of
from ..tolerances import CLEAR, KEPT
from .beside import beside
from .bundles import Receivers


class Placed(Receivers):
    """Receivers at points (n, 3) m near surfaces (n,): points on them, at exact places (n, 3) m in the scene.

    normals (n, 3): shading normals of points on meshes, of the surface's side, nan or None for the mesh's own; middle
    (n, 3) m: a point of the face that a point of a mesh belongs to, nan or None for the nearest; triangle (n,): of a
    mesh, where it is known.
    """

    def __init__(self, facets, surface, points, normals=None, middle=None, triangle=None):
        out, normal, faces = np.array(points, float), *np.zeros((2, len(points), 3))
        scene = facets.scene
        shape, sign, inside = (of[surface] for of in (scene.shape_of, scene.sign, scene.inside))
        own, least = np.where(facets.own[shape] < 0, -1, facets.plane[facets.first[shape]]), KEPT * facets.tolerance
        which = facets.plane_of[shape]
        flat, rest = np.flatnonzero(which >= 0), np.flatnonzero(which < 0)
        out[flat] = facets.planes.inset(which[flat], out[flat], least)
        normal[flat] = faces[flat] = sign[flat, None] * facets.planes.normal[which[flat]]
        facet = facets.first[shape]
        given = {"normals": normals, "middle": middle, "triangle": triangle}
        for k, some in runs_of(surface[rest]):
            some = rest[some]
            told = {what: a[some] for what, a in given.items() if a is not None}
            thing = scene.surfaces[k].shape
            *there, at = thing.receiving(out[some], scene.sign[k], least, **told)
            if at is not None:
                there[:2] = beside(facets).lifted(thing, at, *there)
                facet[some] += at[0]
            out[some], normal[some], faces[some] = there
        under = facets.lying.covers(facet, out - facets.centre, faces) | facets.lying.within[surface]
        start = np.where((own < 0) | inside, facets.tolerance, -CLEAR * facets.tolerance)
        super().__init__(out - facets.centre, normal, own, start, inside, surface, faces, under)
        self.exact = out

    def reorder(self, index):
        """Makes the n-th place that of index[n] (n,)."""
        for name, value in vars(self).items():
            setattr(self, name, value.take(index, axis=0))


def read_places(facets, surface, points, normals=None, inward=None):
    """Placed points (n, 3) m of surfaces (n,) where colours are read off; normals, inward as Placed's."""
    own = beside(facets)
    return Placed(facets, surface, own.moved(surface, points), normals, own.shown(surface, points, normals, inward))


def at_hits(facets, facet, front, place):
    """Placed at places (h, 3) m about the facets' centre, where rays met facets (h,), front (h,) bool."""
    surface = facets.surface[facet, np.where(front, 0, 1)]
    return Placed(facets, surface, place + facets.centre, triangle=facet - facets.first[facets.shape[facet]])
