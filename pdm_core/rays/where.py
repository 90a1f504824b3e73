"""Which node of its surface a point is next to: of charts by its cell, of meshes by the nearest corner of its face."""

import numpy as np

from ..read_off import runs_of
from .bundles import ball_chart

POINTS = 1 << 16  # at once


def nodes_near(nodes, surface, points):
    """(n,) Nodes next to points (n, 3) m of surfaces (n,), -1 where a surface has none: generator of the fraction
    done."""
    out, done = np.full(len(points), -1), 0
    has = nodes.number[surface] > 0
    for some in _parts(np.flatnonzero(has & ~nodes.is_mesh[surface])):
        own = surface[some]
        node, weight = nodes.lattice.columns(own, _chart_at(nodes, own, points[some]))
        out[some] = node[np.arange(len(some)), weight.argmax(axis=1)]
        done += len(some)
        yield done / len(points)
    some = np.flatnonzero(has & nodes.is_mesh[surface])
    for k, mine in runs_of(surface[some]):
        mine, first = some[mine], nodes.facets.first[nodes.facets.scene.shape_of[k]]
        triangle, bary = nodes.facets.scene.surfaces[k].shape.nearest(points[mine])
        node, weight = nodes.on_meshes(np.full(len(mine), k), first + triangle, bary[:, 1:])
        out[mine] = node[np.arange(len(mine)), weight.argmax(axis=1)]
        done += len(mine)
        yield done / len(points)
    return out


def _chart_at(nodes, own, points):
    """Chart positions (n, 2) of points (n, 3) m of surfaces (n,), none of them meshes."""
    flat, shapes = ~nodes.is_mesh, [s.shape for s in nodes.facets.scene.surfaces]
    inverse, origin = np.zeros((len(shapes), 3, 3)), np.zeros((len(shapes), 3))
    inverse[flat] = [shape.inverse for shape, is_flat in zip(shapes, flat) if is_flat]
    origin[flat] = [shape.origin for shape, is_flat in zip(shapes, flat) if is_flat]
    local = np.einsum("nij,nj->ni", inverse[own], points - origin[own])
    at, ball = local[:, :2], nodes.is_ball[own]
    at[ball] = ball_chart(local[ball])
    return np.clip(at, 0.0, 1.0)


def _parts(index):
    return [index[k : k + POINTS] for k in range(0, len(index), POINTS)]
