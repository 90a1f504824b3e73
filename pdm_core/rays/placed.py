"""Places on surfaces as receivers of rays: moved off what bounds their shapes, and told what they must not meet."""

import numpy as np

from ..read_off import runs_of
from .bundles import Receivers
from .facets import KEPT

MET = 8.0  # tolerances within which what lies against a flat shape hides what is beyond


class Placed(Receivers):
    """Receivers at points (n, 3) m near surfaces (n,): points on them, at exact places (n, 3) m in the scene.

    normals (n, 3): shading normals of points on meshes, of the surface's side, nan or None for the mesh's own; middle
    (n, 3) m: a point of the face that a point of a mesh belongs to, nan or None for the nearest; triangle (n,): of a
    mesh, where it is known.
    """

    def __init__(self, facets, surface, points, normals=None, middle=None, triangle=None):
        scene = facets.scene
        out, normal = np.array(points, float), np.zeros((len(points), 3))
        own, start = np.full(len(points), -1), np.zeros(len(points))
        inside = np.zeros(len(points), bool)
        given = {"normals": normals, "middle": middle, "triangle": triangle}
        for k, some in runs_of(surface):
            side, number, least = scene.surfaces[k], scene.shape_of[k], KEPT * facets.tolerance
            told = {what: a[some] for what, a in given.items() if a is not None}
            out[some], normal[some] = side.shape.receiving(out[some], side.sign, least, **told)
            out[some] += facets.moved[number] * side.sign * normal[some]
            sees_itself = side.shape.is_mesh or side.is_inside
            own[some] = -1 if side.shape.is_mesh else number
            inside[some] = side.is_inside
            start[some] = facets.tolerance if sees_itself else -MET * facets.tolerance
        super().__init__(out - facets.centre, normal, own, start, inside)
        self.surface, self.exact = surface, out
