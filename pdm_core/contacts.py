"""Where shapes nearly touch, light varies over the width of the gap's mouth: cells are made that small beforehand.

Surpluses cannot tell: in a gap both sides see little but each other, so a coarse field there agrees with itself.
"""

import numpy as np

from .scene import Sphere

ACROSS = 1.0  # a cell's size, of the distance at which the gap around it has opened by its curvature
FACING = 0.7  # least cosine between planes that have a gap between them rather than a corner
FLAT = 0.2
GAPS, EXTENT = 4.0, 0.2  # cells in a gap between planes: no larger than so many gaps or that part of the plane's radius


def crowded(field, smallest, wanted):
    """Leaves larger than the scale of a nearby contact with a sphere or of one with another shape, and `smallest` m,
    or FLAT of it in gaps between planes: those are as large as the planes, contacts of spheres are points.

    wanted (n surfaces,): whether a surface is to be resolved at all.
    """
    leaves = field.leaves[wanted[field.surface[field.leaves]]]
    leaves = leaves[np.sqrt(field.sizes()[leaves]) > FLAT * smallest]
    if not len(leaves):
        return leaves
    points, size = field.points[field.nodes[leaves, 4]], np.sqrt(field.sizes()[leaves])
    own = field.scene.shape_of[field.surface[leaves]]
    split = np.zeros(len(leaves), bool)
    for k, shape in enumerate(field.scene.shapes):
        centre, radius = shape.bounds
        near = np.flatnonzero((own != k) & (np.linalg.norm(points - centre, axis=1) < radius + 3 * size))
        if not len(near):
            continue
        if isinstance(shape, Sphere):
            reach2 = np.einsum("ni,ni->n", shape.local(points[near]), shape.local(points[near]))
            scale = shape.semi_axes[2] * np.sqrt(np.maximum(reach2 - 1, 0.0))  # tangent from the point: sqrt(d^2 - r^2)
            scale = np.maximum(scale, smallest)
        else:
            gap = np.linalg.norm(points[near] - shape.project(points[near]), axis=1)
            round_ = field.is_sphere[field.surface[leaves[near]]]
            curved = np.array([s.bounds[1] for s in field.scene.shapes])[own[near]]
            flat = _flat_gap(field, leaves[near], points[near], size[near], shape)
            curved = np.sqrt(gap * (gap + 2 * curved))
            scale = np.where(round_, np.maximum(curved, smallest), np.maximum(flat, FLAT * smallest))
        split[near] |= size[near] > ACROSS * scale
    return leaves[split]


def _flat_gap(field, cells, points, size, plane):
    """Sizes (n,) m to which cells of planes, by their centres and sizes, are resolved before another plane."""
    normal = field.normals[field.nodes[cells, 4]]
    offset = plane.project(points) - points
    across = np.abs(np.einsum("ni,ni->n", normal, offset))
    beside = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - across**2, 0.0))
    gap = np.hypot(across, np.maximum(beside - size / 2, 0.0))
    scale = np.maximum(GAPS * gap, EXTENT * plane.bounds[1])  # within the gap surpluses can tell
    return np.where(np.abs(normal @ plane.normal) > FACING, scale, np.inf)
