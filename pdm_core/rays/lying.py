"""What lies on what in one plane: a carpet on a floor, a picture on a wall, crates on each other.

Of two faces in one plane the smaller lies on a side of the larger, of equal ones the later. Nothing comes to what is
between the two, neither rays nor lamps' light, and what shines there gives nothing. Rays from that side meet the one
that lies there first, and what starts in the plane meets nothing of it.
"""

import numpy as np

from ..boxes import near, overlap
from ..coincident import ALONG
from ..connected import connected
from ..layers import bodies, lies_toward, ranks, reaches_beyond, rounded
from ..scene import LOST
from ..shapes.shape import PARALLEL
from .grid import pairs_of
from .near_flats import ON
from .side_by_side import SideBySide

ALIKE = 1 - PARALLEL**2 / 2  # cosine of normals of faces that lie against each other
DEEP = 64  # faces that lie on each other, one by one, up to which rays meet them in that order
FEW = 8  # corners of flat shapes that may be a room's walls


class Lying:
    """Of Facets: piece (m + b,), a number for facets of a shape that hang together in one plane, that of one of them;
    pieces (p,), those that others lie on; of pairs (k,) place, of a piece among these, facet, of another shape that
    lies on it, and toward (k, 3), the unit normal of the side that it lies on; borne: of those where the smaller lies
    on the larger names (j + 1,), sorted, and side (j + 1,), 1 for the front, -1 for the back. late (m, 2): how much
    later the front and the back of each facet are met than what coincides with it: sides that are dark, and those that
    others lie on; plane (m + b,): of facets and balls the shape that stands for all in one plane with them, their own
    where nothing is; within (n surfaces + 1,): which are inner sides of closed meshes whose walls lie on each other."""

    def __init__(self, facets):
        self.facets, self.pieces = facets, np.zeros(0, int)
        self.piece, self.borne = np.arange(len(facets.shape)), (np.array([np.iinfo(int).max]), np.zeros(1, int))
        self.within = _within_flat(facets)
        self.late = (facets.surface[: facets.count] < 0).astype(float)
        self.late[self.within[facets.surface[: facets.count]]] = 1.0
        self.plane = facets.shape
        one, other = _in_one_plane(facets)
        if not len(one):
            return
        self.piece = _pieces(facets, np.unique(facets.shape[np.append(one, other)]))
        self.plane = self._planes(one, other)
        larger, smaller, toward = self._sides(one, other)
        lower, upper = np.append(larger, smaller), np.append(smaller, larger)
        toward = np.append(toward, -toward, axis=0)
        self._order(lower, upper, toward)
        borne, first = np.unique(self.piece[larger] * facets.count + smaller, return_index=True)
        front = np.einsum("ki,ki->k", toward[first], facets.normal[larger[first]]) > 0
        self.borne = np.append(borne, self.borne[0]), np.append(np.where(front, 1, -1), 0)
        pair, first = np.unique(self.piece[lower] * facets.count + upper, return_index=True)
        piece, self.facet = np.divmod(pair, facets.count)
        self.toward = toward[first]
        self.pieces, self.place = np.unique(piece, return_inverse=True)
        self.planes = SideBySide(facets, facets.normal[self.pieces], facets.tolerance)
        self.low, self.high = self.planes.boxes(self.place, facets.corners(self.facet))

    def __len__(self):
        return len(self.pieces)

    def bears(self, facet, others):
        """(n,) 1 where others (n,) lie on the fronts of facets (n,), or of their pieces, -1 on the backs, 0 where they
        do not or these lie on them."""
        name = self.piece[facet] * self.facets.count + others
        names, side = self.borne
        place = np.searchsorted(names, name)
        return np.where(names[place] == name, side[place], 0)

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

    def _planes(self, one, other):
        """(m + b,) See Lying, of facets one, other (k,) in one plane: of several shapes the first flat one."""
        facets, piece, count = self.facets, self.piece, len(self.facets.first)
        label = connected(len(piece), piece[one], piece[other])[piece]
        some = facets.shape[: facets.count]
        rank = np.full(len(piece), 2 * count)  # flat ones first
        np.minimum.at(rank, label[: facets.count], some + np.where(facets.own[some] < 0, count, 0))
        several = np.isin(label, label[np.append(one, other)])
        return np.where(several, rank[label] % count, facets.shape)

    def _sides(self, one, other):
        """Facets one, other (k,) in one plane -> the larger and the smaller, by the areas of their pieces, of equal
        ones the later, and the unit normal (k, 3) of the larger's side that the smaller lies on."""
        facets, count = self.facets, self.facets.count
        some, which = np.unique(self.piece[np.stack([one, other])], return_inverse=True)
        which = which.reshape(2, -1)
        body, whole = _bodies(facets, np.append(one, other), self.piece[:count])
        area = rounded(np.bincount(whole, facets.area, count)[whole[some]])
        rank = ranks(area, facets.shape[some])
        swap = rank[which[0]] > rank[which[1]]
        larger, smaller = np.where(swap, (other, one), (one, other))
        lit, two_sided = facets.lit[some, None] * facets.normal[some], (facets.surface[some] >= 0).all(axis=1)
        corners, owner = facets.corners(np.arange(count)), whole[some]
        i, j = np.where(swap, which[::-1], which)

        def beyond(k):
            near = ON * facets.tolerance
            return reaches_beyond(corners, facets.normal, whole, owner[i[k]], owner[j[k]], near)

        return larger, smaller, lies_toward(lit, body[some], two_sided, area, rank, i, j, beyond)

    def _order(self, lower, upper, toward):
        """Makes sides of facets lower (k,) later than those of the upper (k,) that look the same way, toward (k, 3)."""
        normal, late = self.facets.normal, self.late.ravel()
        lower, upper = (2 * k + (np.einsum("ki,ki->k", normal[k], toward) < 0) for k in (lower, upper))
        for _ in range(DEEP):
            if (late[lower] > late[upper]).all():
                break
            np.maximum.at(late, lower, late[upper] + 1)
        self.late = late.reshape(-1, 2)


def _within_flat(facets):
    """See Lying.within."""
    scene, near = facets.scene, ON * facets.tolerance
    inner = [shape.inner_side(near) if shape.is_mesh else 0 for shape in scene.shapes]
    return np.append(np.array(inner)[scene.shape_of] * scene.sign == 1, False)


def _in_one_plane(facets):
    """Facets (k,), (k,) of unlike shapes that overlap in one plane, each pair once."""
    found = [np.zeros((2, 0), int)]
    for pair in (*facets.near_facets, _of_flats(facets)):
        pair = np.sort(pair, axis=0)
        pair = pair[:, _are_flush(facets, *pair)]
        corners = facets.corners(pair.ravel())
        one, other = np.arange(2 * pair.shape[1]).reshape(2, -1)
        deep = overlap(corners, facets.normal[pair.ravel()], one, other, ON * facets.tolerance)
        found.append(pair[:, deep])
    return np.unique(np.concatenate(found, axis=1), axis=1)


def _are_flush(facets, one, other):
    """(k,) Whether facets one, other (k,) are in one plane: the smaller one over the larger one's."""
    pair = np.stack([one, other])
    parallel = np.einsum("ni,ni->n", *facets.normal[pair])
    out = np.abs(parallel) > ALIKE
    pair = pair[:, out]
    corners = facets.corners(pair.ravel()).reshape(2, -1, 4, 3)
    height = np.einsum("pnci,pni->pnc", corners[::-1] - corners[:, :, :1], facets.normal[pair])
    out[out] = np.abs(height).max(axis=2).min(axis=0) <= LOST * facets.tolerance  # lids of what is thicker are not
    return out


def _of_flats(facets):
    """Facets (2, k) of unlike flat shapes whose boxes come near each other, of those that are in one plane."""
    found = [np.zeros(0, int)]
    for flat, facet in facets.near_flats:
        some = facets.own[facets.shape[facet]] >= 0
        flat, facet = facets.first[flat[some]], facet[some]
        found.append(facet[_are_flush(facets, flat, facet)])
    some = np.unique(np.concatenate(found))
    low, high = (end[:, some].T for end in facets.boxes)
    pair = some[np.stack(near(low, high, ON * facets.tolerance))]
    return pair[:, facets.shape[pair[0]] != facets.shape[pair[1]]]


def _bodies(facets, some, piece):
    """(m,) Where the shapes of facets are: 1 on their lit side, as of a room's walls, -1 behind it, as of a solid's
    faces, 0 of sheets; (m,) the pieces, piece (m,), with those that go on in others as one. Walls that are shapes of
    their own are told by those that they share edges with: of them all that touch the shapes of facets some (k,)."""
    shape, shapes, count = facets.shape[: facets.count], facets.scene.shapes, len(facets.first)
    middle = np.array([s.middle if s.is_mesh else s.bounds[0] for s in shapes]) - facets.centre
    height = facets.lit * np.einsum("ni,ni->n", middle[shape] - facets.origin, facets.normal)
    body = np.where(np.abs(height) > ON * facets.tolerance, np.sign(height), 0.0)
    flat = (np.bincount(shape, minlength=count) > 0) & (np.bincount(shape, body != 0, count) == 0)
    inward, whole = _flat_bodies(facets, np.flatnonzero(flat), some)
    joined = np.bincount(whole, minlength=count)[whole] > 1
    return body + inward[shape], np.where(joined[shape], piece[facets.first[whole[shape]]], piece)


def _flat_bodies(facets, flat, some):
    """(n shapes,), (n shapes,) As bodies, of shapes flat (f,), each in a plane."""
    shapes, out, whole = facets.scene.shapes, np.zeros(len(facets.first)), np.arange(len(facets.first))
    few = np.full((len(flat), FEW, 3), np.nan)
    for own, k in zip(few, flat):
        corners = shapes[k].vertices if shapes[k].is_mesh else shapes[k].outline
        if len(corners) <= FEW:
            own[: len(corners)] = corners
    known = np.isfinite(few[:, :1]).all(axis=(1, 2))
    flat, few = flat[known], few[known]
    i, j = near(np.nanmin(few, axis=1), np.nanmax(few, axis=1), facets.tolerance)
    asked = np.isin(flat, facets.shape[some])
    first = facets.first[flat]
    lit = facets.lit[first, None] * facets.normal[first]
    keep = asked[i] | asked[j] | (np.einsum("ni,ni->n", lit[i], lit[j]) > ALIKE)
    out[flat], label = bodies(few, lit, i[keep], j[keep], 4 * facets.tolerance)
    whole[flat] = flat[label]
    return out, whole


def _pieces(facets, shapes):
    """(m + b,) See Lying: of flat shapes, and of those of shapes (k,) that are meshes."""
    of = facets.shape[: facets.count]
    plane = np.flatnonzero(facets.own[of] >= 0)
    beside = [np.zeros((2, 0), int), np.stack([plane, facets.first[of[plane]]])]
    if (facets.own[shapes] < 0).any():
        beside.append(_bent_nowhere(facets, shapes[facets.own[shapes] < 0]))
    return connected(len(facets.shape), *np.concatenate(beside, axis=1))


def _bent_nowhere(facets, meshes):
    """Facets (2, k) of meshes (m,) that meet at an edge in one plane."""
    of, given = facets.shape[: facets.count], facets.scene.shapes
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
    return np.stack([facet[one[same]], facet[other[same]]])
