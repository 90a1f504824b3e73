"""The published method: form factors by Gauss quadrature over both parameter domains (Baranoski, UFRGS 1992)."""

import numpy as np

from .quadrature import gauss_square
from .scene import Plane, SceneError, Sphere, Surface
from .view import ShapeTable, segment_blocked

SEGMENTS_AT_ONCE = 1 << 18


def parametric(surface, st):
    """Points (n, 3) m of a surface at parameters (n, 2) in the unit square, and area vectors dP/ds x dP/dt (n, 3) m^2.

    A plane's are its own; a sphere's are (theta / pi, phi / 2 pi), theta from the pole, as in the paper. The area
    vectors point out of the side.
    """
    s, t = st.T
    shape = surface.shape
    if isinstance(shape, Plane):
        area = np.broadcast_to(surface.sign * np.cross(shape.u, shape.v), (len(st), 3))
        return shape.world(np.column_stack([s, t, 0 * s])), area
    theta, phi = np.pi * s, 2 * np.pi * t
    local = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    area = 2 * np.pi**2 * np.sin(theta)[:, None] * local
    cofactor = abs(np.linalg.det(shape.linear)) * shape.inverse
    return shape.world(local), surface.sign * (area @ cofactor)


def patch_samples(surface, divisions, points):
    """Gauss points (n, 3) m of a surface in equal parameter rectangles, and weighted area vectors (n, 3) m^2."""
    nodes, weights = gauss_square(points)
    rows, columns = divisions
    cell = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1).reshape(-1, 1, 2)
    position, area = parametric(surface, ((cell + nodes) / [rows, columns]).reshape(-1, 2))
    return position, area * np.tile(weights, rows * columns)[:, None] / (rows * columns)


def pdm_form_factor(a, b, divisions_a=(1, 1), divisions_b=(1, 1), points=5, occluders=()):
    """The form factor from Surface a to Surface b exactly as published: a float.

    divisions: patches along (s, t) of a plane, (theta, phi) of a sphere; points: Gauss points a direction.
    occluders: shapes tested against each segment. The error is large where a and b share an edge: see form_factors.
    """
    for surface in (a, b):
        if not isinstance(surface, Surface):
            raise SceneError(f"pdm_form_factor takes two Surfaces, not {surface!r}")
    for shape in occluders:
        if not isinstance(shape, Plane | Sphere):
            raise SceneError(f"pdm_form_factor: occluder {shape!r} is not a Plane or Sphere")
    if min(*divisions_a, *divisions_b, points) < 1:
        raise SceneError("pdm_form_factor: divisions and points must be at least 1")
    pa, na = patch_samples(a, divisions_a, points)
    pb, nb = patch_samples(b, divisions_b, points)
    table = ShapeTable(tuple(occluders)) if occluders else None
    total = 0.0
    step = max(1, SEGMENTS_AT_ONCE // len(pb))
    for start in range(0, len(pa), step):
        part = slice(start, start + step)
        e = pb - pa[part, None]
        kernel = np.maximum(np.einsum("id,ijd->ij", na[part], e), 0) * np.maximum(-np.einsum("jd,ijd->ij", nb, e), 0)
        i, j = np.nonzero(kernel)
        d = e[i, j].T
        value = kernel[i, j] / np.einsum("di,di->i", d, d) ** 2
        x = pa[part][i].T
        for k in range(len(occluders)):
            value[segment_blocked(table, x, d, np.full(len(i), k))] = 0.0
        total += value.sum()
    return float(total / (np.pi * a.shape.area))
