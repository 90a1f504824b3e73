"""What lies on what in one plane where one of the two is a mesh: a carpet on a floor, a picture on a wall, a crate.

Of two faces in one plane one lies on a side of the other, by the rule that holds between planes, see contacts. Nothing
comes to what is between the two, neither rays nor lamps' light, and what shines there gives nothing. Rays from that
side meet the one that lies there first.
"""

import numpy as np

from ..boxes import overlap
from ..coincident import ALONG
from ..connected import connected
from ..layers import rounded
from ..shapes.shape import PARALLEL
from .grid import pairs_of
from .near_flats import ON
from .side_by_side import SideBySide

ALIKE = 1 - PARALLEL**2 / 2  # cosine of normals of faces that lie against each other
DEEP = 8  # faces that lie on each other, one by one, up to which rays meet them in that order


class Lying:
    """Of Facets: piece (m + b,), a number for facets of a shape that hang together in one plane, that of one of them;
    pieces (p,), those that others lie on; of pairs (k,) place, of a piece among these, facet, of another shape that
    lies on it, and toward (k, 3), the unit normal of the side that it lies on. late (m, 2): how much later the front
    and the back of each facet are met than what coincides with it: sides that are dark, and those others lie on."""

    def __init__(self, facets):
        self.facets, self.pieces = facets, np.zeros(0, int)
        self.late = (facets.surface[: facets.count] < 0).astype(float)
        one, other = _in_one_plane(facets)
        if not len(one):
            return
        self.piece = _pieces(facets, np.unique(facets.shape[np.append(one, other)]))
        larger, smaller, toward = self._sides(one, other)
        lower, upper = np.append(larger, smaller), np.append(smaller, larger)
        toward = np.append(toward, -toward, axis=0)
        self._order(lower, upper, toward)
        pair, first = np.unique(self.piece[lower] * facets.count + upper, return_index=True)
        piece, self.facet = np.divmod(pair, facets.count)
        self.toward = toward[first]
        self.pieces, self.place = np.unique(piece, return_inverse=True)
        self.planes = SideBySide(facets, facets.normal[self.pieces], facets.tolerance)
        self.low, self.high = self.planes.boxes(self.place, facets.given(self.facet))

    def __len__(self):
        return len(self.pieces)

    def covers(self, facet, points, normals):
        """(n,) Whether something lies on facets (n,) at points (n, 3) m about the facets' centre of these, on the side
        that normals (n, 3) look to."""
        out = np.zeros(len(points), bool)
        if not len(self):
            return out
        piece = self.piece[facet]
        place = np.minimum(np.searchsorted(self.pieces, piece), len(self) - 1)
        some = np.flatnonzero(self.pieces[place] == piece)
        x, y = self.planes.at(place[some], points[some])
        for point, which in pairs_of(x, y, self.low, self.high):
            point = some[point]
            on = place[point] == self.place[which]
            on &= np.einsum("ni,ni->n", normals[point], self.toward[which]) > 0
            point, which = point[on], which[on]
            out[point[self.facets.within(self.facet[which], points[point])]] = True
        return out

    def _sides(self, one, other):
        """Facets one, other (k,) in one plane -> the larger and the smaller, by the areas of their pieces, of equal
        ones the later, and the unit normal (k, 3) of the larger's side that the smaller lies on."""
        facets, body = self.facets, _bodies(self.facets)
        area = np.linalg.norm(np.cross(facets.u, facets.v), axis=1) / np.where(facets.triangle, 2, 1)
        area = rounded(np.bincount(self.piece[: facets.count], area, facets.count))[self.piece[: facets.count]]
        equal = area[one] == area[other]
        swap = np.where(equal, facets.shape[one] > facets.shape[other], area[one] < area[other])
        larger, smaller = np.where(swap, other, one), np.where(swap, one, other)
        lit = facets.lit[larger, None] * facets.normal[larger]
        same = np.einsum("ki,ki->k", lit, facets.lit[smaller, None] * facets.normal[smaller]) > 0
        # what looks the same way lies before it, but solids behind what shows its back too; what looks the other way is
        # against it, but walls of two rooms are behind each other, and equal sheets show a side each
        shows_back = (facets.surface[larger] >= 0).all(axis=1) & (body[larger] >= 0)
        walls = np.minimum(body[larger], body[smaller]) >= np.where(equal, 0, 1)
        behind = np.where(same, shows_back & (body[smaller] < 0), walls)
        return larger, smaller, np.where(behind[:, None], -lit, lit)

    def _order(self, lower, upper, toward):
        """Makes sides of facets lower (k,) later than those of the upper (k,) that look the same way, toward (k, 3)."""
        normal, late = self.facets.normal, self.late.ravel()
        lower, upper = (2 * k + (np.einsum("ki,ki->k", normal[k], toward) < 0) for k in (lower, upper))
        for _ in range(DEEP):
            np.maximum.at(late, lower, late[upper] + 1)
        self.late = late.reshape(-1, 2)


def _in_one_plane(facets):
    """Facets (k,), (k,) of meshes and of other shapes that overlap in one plane, each pair once."""
    found = [np.zeros((2, 0), int)]
    for pair in facets.near_facets:
        pair = np.sort(pair, axis=0)
        parallel = np.einsum("ni,ni->n", *facets.normal[pair])
        pair = pair[:, np.abs(parallel) > ALIKE]
        corners = facets.given(pair.ravel()).reshape(2, -1, 4, 3)
        # the smaller one's over the larger one's plane
        height = np.einsum("pnci,pni->pnc", corners[::-1] - corners[:, :, :1], facets.normal[pair])
        flush = np.abs(height).max(axis=2).min(axis=0) <= ON * facets.tolerance
        pair, corners = pair[:, flush], corners[:, flush].reshape(-1, 4, 3)
        one, other = np.arange(2 * pair.shape[1]).reshape(2, -1)
        deep = overlap(corners, facets.normal[pair.ravel()], one, other, ON * facets.tolerance)
        found.append(pair[:, deep])
    return np.unique(np.concatenate(found, axis=1), axis=1)


def _bodies(facets):
    """(m,) Where the shapes of facets are: 1 on their lit side, as of a room's walls, -1 behind it, as of a solid's
    faces, 0 of sheets."""
    shape, shapes = facets.shape[: facets.count], facets.scene.shapes
    middle = np.array([s.middle if s.is_mesh else s.bounds[0] for s in shapes]) - facets.centre
    height = facets.lit * np.einsum("ni,ni->n", middle[shape] - facets.origin, facets.normal)
    body = np.where(np.abs(height) > ON * facets.tolerance, np.sign(height), 0.0)
    return np.where(facets.own[shape] < 0, body, facets.body[shape])


def _pieces(facets, shapes):
    """(m + b,) See Lying: of flat shapes, and of those of shapes (k,) that are meshes."""
    of, given = facets.shape[: facets.count], facets.scene.shapes
    plane = np.flatnonzero(facets.own[of] >= 0)
    meshes = shapes[facets.own[shapes] < 0]
    facet = np.concatenate([facets.first[k] + np.arange(given[k].facet_count) for k in meshes])
    corners = np.concatenate([given[k].corners for k in meshes]) - facets.centre
    names = np.concatenate([given[k].places.names for k in meshes])
    # of the triangles at an edge those that look the same way follow each other
    edge, triangle = (names ^ np.roll(names, -1, axis=1)).ravel(), np.repeat(np.arange(len(facet)), 3)
    normal = facets.normal[facet]
    order = np.lexsort([normal[triangle] @ ALONG[:3], edge, of[facet][triangle]])
    edge, triangle = edge[order], triangle[order]
    one, other = triangle[:-1], triangle[1:]
    same = (edge[1:] == edge[:-1]) & (of[facet[one]] == of[facet[other]])
    same &= np.einsum("ni,ni->n", normal[one], normal[other]) > ALIKE
    height = np.einsum("nci,ni->nc", corners[other] - corners[one][:, :1], normal[one])
    same &= np.abs(height).max(axis=1) <= ON * facets.tolerance
    one, other = facet[one[same]], facet[other[same]]
    return connected(len(facets.shape), np.append(one, plane), np.append(other, facets.first[of[plane]]))
