"""Where planes are cut into charts: along lines at which light bends or jumps, so that no cell has to lie across them.

Next to a narrow gap light varies over the gap's width along the whole rim of the other plane; a chart that ends there
has its nodes crowd towards it, and along the rim of a very narrow one lies a strip of a few gaps on either side, whose
cells are long and thin. Where another plane stands on a plane or crosses it light jumps: charts that meet there share
no nodes. Lines that run askew are left to refinement, as are more of them than CHARTS.
"""

from dataclasses import dataclass

import numpy as np

from .coincident import apart
from .contacts import contacts_of, entries
from .tolerances import CLEAR, TOUCHING

CHARTS = 7  # along each edge of a plane, at most
LINES = 2  # cuts along each edge at most, at contacts; as many rims of gaps, each of them with a strip on either side
NARROW = 0.1  # width of a gap, of the other plane's radius, up to which a chart ends at its rim
STRIP, THIN = 8.0, 0.03  # widths of strips along rims, of the gap, and of a gap that has them, of the planes' radii
ALIGNED, APART = 1e-5, 2e-4  # of the edges: how far from straight along the chart, and how near each other, rims are
JUMP = 2.5  # times what points keep from a border: off a line where light jumps
ROOM = 8.0  # times that: between lines, and between them and a border, where there are to be points
FACING = 0.7  # least cosine between planes that have a gap between them; others stand on each other


@dataclass(frozen=True)
class Charts:
    """cuts (n surfaces, 2, CHARTS + 1): of planes along both edges, from 0 to 1, padded with 1 behind; jumps, of the
    same shape: whether light may jump at a cut, so that the charts beside it share no nodes; border (n surfaces, 2): of
    their edges, what points keep from the planes' own."""

    cuts: np.ndarray
    jumps: np.ndarray
    border: np.ndarray

    @property
    def across(self):
        """(n surfaces, 2): number of charts along both edges; 1 of spheres."""
        return (self.cuts[:, :, :-1] < 1).sum(axis=2)

    def starts(self, steps):
        """(n surfaces, 2, CHARTS): where each begins on a lattice of so many steps a chart; one later at jumps."""
        return np.arange(CHARTS) * steps + np.cumsum(self.jumps[:, :, :-1], axis=2)


def charts_of(scene):
    """The Charts of a scene, found once."""
    if "_charts" not in scene.__dict__:
        border = contacts_of(scene).border
        parts = zip(_rims(scene), _contact_lines(scene, border))
        surface, axis, at, weight = (np.concatenate(part) for part in parts)
        line, jump = 2 * surface + axis, np.isfinite(weight)
        line, at, jump = _chosen(line, at, jump, weight, border.ravel())
        cuts, jumps = np.ones((2 * len(scene), CHARTS + 1)), np.zeros((2 * len(scene), CHARTS + 1), bool)
        cuts[:, 0] = 0.0
        place = 1 + np.arange(len(line)) - np.searchsorted(line, line)
        cuts[line, place], jumps[line, place] = at, jump
        shape = (len(scene), 2, CHARTS + 1)
        object.__setattr__(scene, "_charts", Charts(cuts.reshape(shape), jumps.reshape(shape), border))
    return scene._charts


def _chosen(line, at, jump, weight, border):
    """Of possible cuts (k,) those of most weight, apart from each other and CHARTS - 1 a line, sorted along it."""
    order = np.lexsort((at, line))
    beside = jump[order] & np.append(False, jump[order][:-1])
    far = np.diff(at[order], prepend=-1.0) > np.where(beside, np.maximum(TOUCHING, ROOM * border[line[order]]), APART)
    group = np.cumsum(far | (np.diff(line[order], prepend=-1) > 0))
    order = order[np.lexsort((-weight[order], group))]
    order = order[np.unique(np.sort(group), return_index=True)[1]]  # the weightiest of those that lie together
    order = order[np.lexsort((-weight[order], line[order]))]
    rank = np.arange(len(order)) - np.searchsorted(line[order], line[order])
    order = order[rank < np.where(np.isinf(weight[order]), CHARTS - 1, LINES)]
    order = order[np.lexsort((at[order], line[order]))]
    return line[order], at[order], jump[order]


def _rims(scene):
    """Where narrow gaps before planes end: surface, axis, at, weight (k,) of cuts; none of a line with many."""
    planes = contacts_of(scene).planes
    found = [np.zeros((3, 0))]
    corners, radius = planes.corners, planes.radius[planes.flat]
    for k in np.flatnonzero(planes.flat[scene.shape_of]):
        surface = scene.surfaces[k]
        local = surface.shape.local(corners.reshape(-1, 3)).reshape(corners.shape)
        height = surface.sign * local[..., 2] * np.sqrt(surface.shape.area)
        close = (height.min(axis=1) > ALIGNED * radius) & (height.max(axis=1) < NARROW * radius)  # not at contacts
        close &= ((local[..., :2].max(axis=1) > 0) & (local[..., :2].min(axis=1) < 1)).all(axis=1)
        gap = height[close].mean(axis=1, keepdims=True)
        for axis in range(2):
            at, to = local[close, :, axis], np.roll(local[close, :, axis], -1, axis=1)
            straight = np.abs(to - at) < ALIGNED
            width = STRIP * gap / np.linalg.norm(surface.shape.linear[:, axis])
            rims, strips = apart(at[straight & (at > APART) & (at < 1 - APART)], APART), np.zeros(0)
            thin = (gap < THIN * radius[close][:, None]) & straight
            if thin.any():
                inner, wide = np.clip(at, 0.0, 1.0)[thin], np.broadcast_to(width, at.shape)[thin]
                strips = np.concatenate([inner - wide, inner + wide])
                strips = strips[(strips > APART) & (strips < 1 - APART)]
                strips = strips[(np.abs(strips[:, None] - rims) > APART).all(axis=1)]
            if len(rims) <= LINES:  # more of them would cost more nodes than they save
                rims = apart(np.concatenate([rims, strips]), APART)
                if len(rims) < CHARTS:
                    found.append(np.array([np.full(len(rims), k), np.full(len(rims), axis), rims]))
    surface, axis, at = np.concatenate(found, axis=1)
    return surface.astype(int), axis.astype(int), at, np.full(len(at), np.inf)


def _contact_lines(scene, border):
    """Where planes stand on planes or cross them, along one of their edges: surface, axis, at, weight (k,) of possible
    cuts, the longer the weightier."""
    contacts = contacts_of(scene)
    planes, (surface, other) = contacts.planes, entries(contacts.stands, scene.shape_of)
    flat = planes.flat[scene.shape_of[surface]] & planes.flat[other]
    surface, a, b = surface[flat], planes.number[scene.shape_of[surface[flat]]], planes.number[other[flat]]
    upright = np.abs(np.einsum("ni,ni->n", planes.normal[a], planes.normal[b])) < FACING
    surface, a, b = surface[upright], a[upright], b[upright]
    offset, near = planes.corners[b] - planes.corners[a, :1], CLEAR * contacts.tolerance
    place = np.einsum("nij,ncj->nci", planes.inverse[a, :2], offset)
    height = np.einsum("nci,ni->nc", offset, planes.normal[a])
    height[np.abs(height) < near] = 0.0
    after, above = np.roll(place, -1, axis=1), np.roll(height, -1, axis=1)
    through = height * above < 0
    part = np.divide(height, height - above, out=np.zeros_like(height), where=through)[..., None]
    ends = np.concatenate([place, place + part * (after - place)], axis=1)
    there = np.concatenate([height == 0, through], axis=1)[..., None]
    low, high = np.where(there, ends, np.inf).min(axis=1), np.where(there, ends, -np.inf).max(axis=1)
    low, high = np.nan_to_num(low, posinf=2.0), np.nan_to_num(high, neginf=-2.0)
    middle, length = (low + high) / 2, np.minimum(high, 1.0) - np.maximum(low, 0.0)
    border = border[surface]
    room = np.maximum(TOUCHING, ROOM * border)
    is_line = (high - low < np.maximum(ALIGNED, border)) & (length[:, ::-1] > APART)
    is_line &= (middle > room) & (middle < 1 - room)
    sign = scene.sign[surface]
    k, axis = np.nonzero(is_line & ((sign[:, None] * height).max(axis=1) > 0)[:, None])
    return surface[k], axis, middle[k, axis], length[k, 1 - axis]
