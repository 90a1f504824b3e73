"""Where shapes nearly touch: light varies over the width of the gap's mouth and surpluses cannot tell.

In a gap both sides see little but each other, so a coarse field there agrees with itself. Cells are made that small
beforehand.
"""

import numpy as np

from .charts import FACING
from .field import DEEPEST

# cells in a gap between planes: no larger than so many gaps or that part of the other plane's radius, or, in charts
# that end where the gap does, so that nodes crowd there anyway, that one
GAPS, EXTENT, GRADED_EXTENT = 4.0, 0.2, 0.5


def crowded(field, touching, flat, wanted):
    """Leaves that can be split and are larger than the scale of a nearby contact, and than touching (n shapes,) m of
    the two shapes, `flat` of it in gaps between planes: as large as those are, contacts of spheres are points.

    wanted (n surfaces,): whether a surface is to be resolved at all.
    """
    leaves = field.leaves[field.level[field.leaves] < DEEPEST]
    leaves = leaves[wanted[field.surface[leaves]]]
    leaves = leaves[np.sqrt(field.sizes()[leaves]) > min(flat, 1.0) * touching.min()]
    if not len(leaves):
        return leaves
    points, size = field.points[field.nodes[leaves, 4]], np.sqrt(field.sizes()[leaves])
    own = field.scene.shape_of[field.surface[leaves]]
    split, bend = np.zeros(len(leaves), bool), np.array([shape.bend for shape in field.scene.shapes])
    for k, shape in enumerate(field.scene.shapes):
        centre, radius = shape.bounds
        near = np.flatnonzero((own != k) & (np.linalg.norm(points - centre, axis=1) < radius + 3 * size))
        if not len(near):
            continue
        gap, least = shape.gap(points[near]), np.minimum(touching[k], touching[own[near]])
        radius = np.minimum(shape.bend, bend[own[near]])
        tangent = np.sqrt(gap * (gap + 2 * np.where(np.isfinite(radius), radius, 0.0)))
        wide = _flat_gap(field, leaves[near], points[near], size[near], shape)
        scale = np.where(np.isfinite(radius), np.maximum(tangent, least), np.maximum(wide, flat * least))
        split[near] |= size[near] > scale
    return leaves[split]


def _flat_gap(field, cells, points, size, plane):
    """Sizes (n,) m to which cells of planes, by their centres and sizes, are resolved before another plane."""
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
    return np.where((np.abs(normal @ plane.normal) > FACING) & ~closed, scale, np.inf)
