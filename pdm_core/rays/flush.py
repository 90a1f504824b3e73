"""What lies against a shining mesh hides what shines there: a lamp's foot gives nothing through the table it stands on.

A lamp is seen by points a little off its faces, which would lie beyond what touches these. Nor do rays meet it there.
"""

import numpy as np

from ..at_once import AT_ONCE, slices
from ..shapes.shape import PARALLEL
from .near_flats import ON

ALIKE = 1 - PARALLEL**2 / 2  # cosine of normals of faces that lie against each other
# barycentric coordinates of places all over a triangle, by which it is told that all of it is hidden
ASKED = np.array([(a, b, 8 - a - b) for a in range(9) for b in range(9 - a)]) / 8 * 0.99 + 0.01 / 3


class Flush:
    """Facets (k,) of others that lie in the planes of the facets of a mesh, number `own` among the shapes of Facets:
    normal (k, 3); frame (k, 3, 2), origin (k, 3) m, by which places are in their outlines; middle (k, 3) m of their
    shapes."""

    def __init__(self, facets, own):
        self.reach = ON * facets.tolerance
        one, other = facets.flush
        which = np.unique(other[facets.shape[one] == own])
        shape = facets.shape[which]
        self.normal, self.triangle = facets.normal[which], facets.triangle[which]
        moved = facets.moved[shape, None] * self.normal
        self.origin = facets.origin[which] - moved + facets.centre
        edges = np.stack([facets.u[which], facets.v[which]], axis=1)
        self.frame = np.linalg.pinv(edges) if len(which) else np.zeros((0, 3, 2))
        middles = [facets.scene.shapes[k].bounds[0] for k in (own, *shape)]
        self.own_middle, self.middle = middles[0], np.array(middles[1:]).reshape(-1, 3)

    def __len__(self):
        return len(self.normal)

    def hides(self, points, normals):
        """(n,) Whether what shines at points (n, 3) m of the mesh along normals (n, 3) is hidden by what lies there.

        A body's faces are hidden by what is no body on the same side, as a floor that it stands on, and by all that
        looks against them; a sheet, or an inside, by what looks against it unless that is of a body behind it: the
        walls of two rooms may be one."""
        out, reach = np.zeros(len(points), bool), self.reach
        body = np.einsum("ni,ni->n", self.own_middle - points, normals) < -reach
        for part in slices(len(points), AT_ONCE // max(len(self), 1)):
            way, cosine = points[part, None] - self.origin, normals[part] @ self.normal.T
            lies = (np.abs(cosine) > ALIKE) & (np.abs(np.einsum("nki,ki->nk", way, self.normal)) <= reach)
            s, t = np.moveaxis(np.einsum("nki,kij->nkj", way, self.frame), 2, 0)
            lies &= (s >= 0) & (t >= 0) & (np.where(self.triangle, s + t, np.maximum(s, t)) <= 1)
            behind = np.einsum("nki,ni->nk", self.middle - points[part, None], normals[part]) < -reach
            against = cosine < 0
            out[part] = (lies & np.where(body[part, None], against | ~behind, against & ~behind)).any(axis=1)
        return out

    def shown(self, mesh, sign):
        """A part of the mesh, a Mesh, without its triangles of which all is hidden on the side of the sign; as it is
        where none is left."""
        places = np.einsum("pk,tki->tpi", ASKED, mesh.corners).reshape(-1, 3)
        hidden = self.hides(places, np.repeat(sign * mesh.triangle_normals, len(ASKED), axis=0))
        left = ~hidden.reshape(-1, len(ASKED)).all(axis=1)
        return mesh if left.all() or not left.any() else type(mesh).of(mesh.corners[left])


def late(facets):
    """(m, 2) How much later the front and the back of each facet are met than what coincides with it, of what is flush:
    a side that is dark; and where two fronts lie against each other, as a crate's and a table's, these."""
    out = (facets.surface[: facets.count] < 0).astype(float)
    if facets.flush.size:
        one, other = facets.flush
        normal, middle = facets.normal[one], np.array([s.bounds[0] for s in facets.scene.shapes]) - facets.centre
        inward = [
            np.einsum("ni,ni->n", middle[facets.shape[k]] - facets.origin[k], facets.normal[k]) > ON * facets.tolerance
            for k in (one, other)
        ]
        # walls of two rooms lie back to back
        fronts = (np.einsum("ni,ni->n", normal, facets.normal[other]) < 0) & ~(inward[0] & inward[1])
        for k in (one[fronts], other[fronts]):
            out[k, 0] = np.maximum(out[k, 0], 0.5)
    return out


def flush_pairs(facets):
    """Facets (k,) of meshes and those (k,) of others that lie in their planes, where these are given."""
    found = [np.zeros((2, 0), int)]
    for one, other in facets.near_facets:
        parallel = np.abs(np.einsum("ni,ni->n", facets.normal[one], facets.normal[other])) > ALIKE
        one, other = one[parallel], other[parallel]
        moved = facets.moved[facets.shape[other], None] * facets.normal[other]
        corners = facets.corners(one) + moved[:, None] - facets.origin[other, None]
        height = np.abs(np.einsum("nci,ni->nc", corners, facets.normal[other])).min(axis=1)
        found.append(np.stack([one, other])[:, height <= ON * facets.tolerance])
    return np.concatenate(found, axis=1)
