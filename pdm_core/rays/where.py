"""Which node of its surface a point is next to: of charts by its cell, of meshes by the nearest corner of its face."""

import numpy as np

from ..at_once import AT_ONCE, parts
from ..read_off import runs_of
from .rows import heaviest


def nodes_near(nodes, surface, points):
    """(n,) Nodes next to points (n, 3) m of surfaces (n,), -1 where a surface has none: generator of the fraction
    done."""
    out, done = np.full(len(points), -1), 0
    has = nodes.number[surface] > 0
    for some in parts(np.flatnonzero(has & nodes.charts.has[surface]), AT_ONCE):
        own = surface[some]
        node, weight = nodes.lattice.columns(own, nodes.charts.places(own, points[some]))
        out[some] = heaviest(node, weight)
        done += len(some)
        yield done / len(points)
    some = np.flatnonzero(has & ~nodes.charts.has[surface])
    for k, mine in runs_of(surface[some]):
        mine, first = some[mine], nodes.facets.first[nodes.facets.scene.shape_of[k]]
        triangle, bary = nodes.facets.scene.surfaces[k].shape.nearest(points[mine])
        node, weight = nodes.on_meshes(np.full(len(mine), k), first + triangle, bary[:, 1:])
        out[mine] = heaviest(node, weight)
        done += len(mine)
        yield done / len(points)
    return out
