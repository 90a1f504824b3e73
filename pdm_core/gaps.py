"""Where shapes nearly touch: light varies over the width of the gap's mouth and surpluses cannot tell.

In a gap both sides see little but each other, so a coarse field there agrees with itself. Cells are made that small
beforehand.
"""

import numpy as np

from .charts import FACING, STRIP, THIN

# cells in a gap between planes: no larger than so many gaps or that part of the other plane's radius, or, in charts
# that end where the gap does, so that nodes crowd there anyway, that one
GAPS, EXTENT, GRADED_EXTENT = 4.0, 0.2, 0.5
# in strips along its rim, by their width at most so much wider than they are made, no wider across than so many gaps:
# the light of the mouth is gone before the first nodes of a strip see it
WITHIN, ACROSS = 1.1, 3.0


def crowded(field, touching, flat, wanted):
    """Halvings of leaves that are larger than the scale of a nearby contact, and than touching (n shapes,) m of
    the two shapes, `flat` of it in gaps between planes: as large as those are, contacts of spheres are points.

    wanted (n surfaces,): whether a surface is to be resolved at all.
    """
    leaves = field.leaves[wanted[field.surface[field.leaves]]]
    extent = _extents(field, leaves)
    large = extent.max(axis=1) > min(flat, 1.0) * touching.min()
    leaves, extent = leaves[large], extent[large]
    points, size = field.points[field.nodes[leaves, 4]], np.sqrt(field.sizes()[leaves])
    own = field.scene.shape_of[field.surface[leaves]]
    split, bend = np.zeros((len(leaves), 2), bool), np.array([shape.bend for shape in field.scene.shapes])
    chart = _extents(field, field.root[field.surface[leaves]] + field.face[leaves])
    for k, shape in enumerate(field.scene.shapes):
        centre, radius = shape.bounds
        near = np.flatnonzero((own != k) & (np.linalg.norm(points - centre, axis=1) < radius + 3 * extent.max(axis=1)))
        if not len(near):
            continue
        gap, least = shape.gap(points[near]), np.minimum(touching[k], touching[own[near]])
        radius = np.minimum(shape.bend, bend[own[near]])
        tangent = np.sqrt(gap * (gap + 2 * np.where(np.isfinite(radius), radius, 0.0)))
        narrow, wide = _flat_gap(field, leaves[near], points[near], size[near], shape)
        scale = np.where(np.isfinite(radius), np.maximum(tangent, least), np.maximum(wide, flat * least))
        # what is long reaches into contacts by its ends
        split[near] |= np.where(np.isfinite(radius), extent[near].T, size[near]).T > scale[:, None]
        gap = np.where(np.isfinite(radius), 0.0, narrow)[:, None]
        split[near] |= (chart[near] < WITHIN * STRIP * gap) & (extent[near] > ACROSS * gap)
    return np.intersect1d(field.both(leaves)[split.ravel()], field.halvings)


def _extents(field, cells):
    """(n, 2) m Widths of cells (n,) along both axes, through their middles."""
    nodes = field.nodes[cells]
    return np.linalg.norm(field.points[nodes[:, (7, 5)]] - field.points[nodes[:, (1, 3)]], axis=2)


def _flat_gap(field, cells, points, size, plane):
    """Cells of planes, by their centres and sizes, before another plane: the gap's width (n,) m, 0 but where there
    are strips along its rim, and sizes (n,) m to which they are resolved."""
    normal = field.normals[field.nodes[cells, 4]]
    offset = plane.project(points) - points
    across = np.abs(np.einsum("ni,ni->n", normal, offset))
    beside = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - across**2, 0.0))
    gap = np.hypot(across, np.maximum(beside - size / 2, 0.0))
    own = field.surface[cells]
    ends = (field.charts[own] > 1) | (field.scene.areas[own] <= plane.area)
    # within the gap surpluses can tell
    scale = np.maximum(GAPS * gap, np.where(ends, GRADED_EXTENT, EXTENT) * plane.bounds[1])
    closed = across <= field.contacts.apart  # nothing lies between
    facing = (np.abs(normal @ plane.normal) > FACING) & ~closed
    strips = facing & (field.charts[own] > 1) & (across < THIN * plane.bounds[1]) & (beside < STRIP * across)
    return np.where(strips, across, 0.0), np.where(facing, scale, np.inf)
