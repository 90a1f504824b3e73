"""The parts of a mesh that hang together: what shines in many places is as many lamps."""

import numpy as np

from ..connected import connected
from .triangle_tiles import MOST
from .triangles import halves


def parts_of(mesh):
    """[Mesh] of the triangles of a Mesh that hang together, by the places of their corners; of more than MOST such
    parts those near each other are one. Itself where all hang together."""
    name = np.unique(mesh.places.names, return_inverse=True)[1].reshape(-1, 3)
    label = connected(name.max() + 1, name[:, :2].ravel(), name[:, 1:].ravel())
    part = np.unique(label[name[:, 0]], return_inverse=True)[1]
    number = np.bincount(part)
    if len(number) == 1:
        return [mesh]
    middle = mesh.corners.mean(axis=1)
    middle = np.column_stack([np.bincount(part, m) / number for m in middle.T])
    own = np.empty(len(number), int)
    for k, some in enumerate(_near_each_other(middle)):
        own[some] = k
    order = np.argsort(own[part], kind="stable")
    cuts = np.flatnonzero(np.diff(own[part][order])) + 1
    corners = (mesh.corners[some] for some in np.split(order, cuts))
    return [type(mesh).of(c) for c in corners]


def _near_each_other(places):
    """[index (k,)] of places (n, 3), MOST at most, halved along where they are furthest apart."""
    groups = [np.arange(len(places))]
    while len(groups) < min(MOST, len(places)):
        groups.sort(key=len)
        groups += halves(groups.pop(), places)
    return groups
