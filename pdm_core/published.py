"""The published method: Gauss points on patches, every pair tested along its segment."""

import numpy as np

from .at_once import AT_ONCE, slices
from .checked import SceneError, array, of_kind
from .numerics import gauss_square
from .sampled import segment_blocked
from .scene import Surface
from .shape_table import ShapeTable
from .shapes.shape import Shape


def parametric(surface, st):
    """Points (n, 3) m of a surface at parameters (n, 2) in the unit square, and area vectors dP/ds x dP/dt (n, 3) m^2.

    A plane's are its own, a polygon's those of its bounding rectangle, without area outside it; a sphere's are
    (theta / pi, phi / 2 pi), theta from the pole, as in the paper. The area vectors point out of the side.
    """
    points, area = surface.shape.parametric(st)
    return points, surface.sign * area


def patch_samples(surface, divisions, points):
    """Gauss points (n, 3) m of a surface in equal parameter rectangles, and weighted area vectors (n, 3) m^2."""
    nodes, weights = gauss_square(points)
    rows, columns = divisions
    cell = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1).reshape(-1, 1, 2)
    position, area = parametric(surface, ((cell + nodes) / [rows, columns]).reshape(-1, 2))
    return position, area * np.tile(weights, rows * columns)[:, None] / (rows * columns)


def published_kernel(x, n, y, m):
    """Points (k, 3), (l, 3) m and weighted area vectors there -> of the pairs that face each other indices i, j (p,),
    segments y - x (3, p) and pi times what the pair adds to A F, where nothing hides it (p,)."""
    e = y - x[:, None]
    kernel = np.maximum(np.einsum("id,ijd->ij", n, e), 0) * np.maximum(-np.einsum("jd,ijd->ij", m, e), 0)
    i, j = np.nonzero(kernel)
    d = e[i, j].T
    return i, j, d, kernel[i, j] / np.einsum("di,di->i", d, d) ** 2


def pdm_form_factor(a, b, divisions_a=(1, 1), divisions_b=(1, 1), points=5, occluders=()):
    """The form factor from Surface a to Surface b exactly as published: a float.

    divisions: patches along (s, t) of a plane or a polygon, (theta, phi) of a sphere; points: Gauss points a direction.
    occluders: shapes tested against each segment. The error is large where a and b share an edge: see form_factors.
    """
    for surface in (a, b):
        of_kind(surface, Surface, "pdm_form_factor")
    if not isinstance(occluders, tuple | list) or not all(isinstance(s, Shape) and not s.is_mesh for s in occluders):
        raise SceneError(f"pdm_form_factor: occluders are {occluders!r}; give a list of Planes, Spheres and Polygons")
    counts = [array(k, "pdm_form_factor: divisions and points") for k in (divisions_a, divisions_b, points)]
    whole = all(((k == np.floor(k)) & (k >= 1) & (k <= AT_ONCE)).all() for k in counts)
    if [k.shape for k in counts] != [(2,), (2,), ()] or not whole:
        raise SceneError(
            f"pdm_form_factor: divisions must be two whole numbers each, points one, all from 1 to {AT_ONCE}"
        )
    divisions_a, divisions_b, points = (k.astype(int).tolist() for k in counts)
    pa, na = patch_samples(a, divisions_a, points)
    pb, nb = patch_samples(b, divisions_b, points)
    occluders = [part for shape in occluders for part in shape.pieces]
    table = ShapeTable(tuple(occluders)) if occluders else None
    total = 0.0
    for part in slices(len(pa), AT_ONCE // len(pb)):
        i, _, d, value = published_kernel(pa[part], na[part], pb, nb)
        x = pa[part][i].T
        for k in range(len(occluders)):
            value[segment_blocked(table, x, d, np.full(len(i), k))] = 0.0
        total += value.sum()
    return float(total / (np.pi * a.shape.area))
