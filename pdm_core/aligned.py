"""Form factors of rectangles with edges parallel to three orthogonal axes, in closed form.

Sums of an elementary primitive over sixteen pairs of corners (Gross, Spindler and Hahne 1981; Ehlert and Smith 1993).
"""

from itertools import product

import numpy as np

from .tolerances import TINY


def _parallel(x, y, z):
    """Primitive for parallel rectangles: x, y offsets along the edges, z distance (...)."""
    a, b = np.sqrt(x * x + z * z), np.sqrt(y * y + z * z)
    return y * a * np.arctan2(y, a) + x * b * np.arctan2(x, b) - z * z / 2 * _log(x * x + y * y + z * z)


def _perpendicular(x, xi, y):
    """Primitive for perpendicular rectangles: x and xi distances from the common line, y offset along it (...)."""
    r2 = x * x + xi * xi
    r = np.sqrt(r2)
    return y * r * np.arctan2(y, r) - (r2 - y * y) / 4 * _log(r2 + y * y)


def _log(r2):
    return np.log(np.where(r2 > 0, r2, 1.0))  # always times a factor that vanishes with r2


def _corner_sum(primitive, a0, a1, b0, b1, c0, c1, d0, d1):
    """Sum of (-1)^(i+j+k+l) primitive(a_i, b_j, c_k, d_l) over the corners."""
    total = 0.0
    for index in product(range(2), repeat=4):
        corner = (ends[k] for ends, k in zip(((a0, a1), (b0, b1), (c0, c1), (d0, d1)), index))
        total = total + (-1) ** sum(index) * primitive(*corner)
    return total / (2 * np.pi)


def _along_axes(vectors):
    """Whether unit vectors (m, 3) lie along one axis of their frame; by the components across, not the cosine."""
    return np.sort(np.abs(vectors), axis=1)[:, 1] <= TINY


def aligned_rectangles(surfaces, i, j):
    """Unoccluded form factors (m,) of pairs i -> j (m,) of surfaces, and which pairs are aligned rectangles (m,).

    Absolute error about 1e-15 of the larger area over the source's.
    """
    planes = [k for k in np.unique(np.concatenate([i, j])) if surfaces[k].shape.is_rectangle]
    number = np.full(len(surfaces), -1)
    number[planes] = np.arange(len(planes))
    shapes = [surfaces[k].shape for k in planes]
    if not shapes:
        return np.zeros(len(i)), np.zeros(len(i), bool)
    u, v, origin = (np.array([getattr(s, name) for s in shapes]) for name in ("u", "v", "origin"))
    length_u, length_v = np.linalg.norm(u, axis=1), np.linalg.norm(v, axis=1)
    e, f = u / length_u[:, None], v / length_v[:, None]
    normal = np.array([surfaces[k].sign * s.normal for k, s in zip(planes, shapes)])
    square = np.abs(np.einsum("ij,ij->i", e, f)) < TINY
    a, b = number[i], number[j]
    frame = np.stack([e, f, normal], axis=1)[a]  # of the source

    def local(w):
        return np.einsum("mij,mj->mi", frame, w)

    be, bf, bn, offset = local(e[b]), local(f[b]), local(normal[b]), local(origin[b] - origin[a])
    known = (a >= 0) & (b >= 0) & square[a] & square[b] & _along_axes(be) & _along_axes(bn)
    extent = be * length_u[b, None] + bf * length_v[b, None]
    low, high = np.minimum(offset, offset + extent), np.maximum(offset, offset + extent)
    value = _exchange(known, bn, low, high, length_u[a], length_v[a])
    return np.maximum(value, 0.0) / (length_u * length_v)[a], known


def _exchange(known, normal, low, high, lu, lv):
    """Area times form factor (m,) from [0, lu] x [0, lv] at z = 0, facing +z, to the boxes low..high (m, 3), flat
    along the axis of their normal (m, 3); 0 where not known."""
    value = np.zeros(len(known))
    axis = np.argmax(np.abs(normal), axis=1)
    k = known & (axis == 2) & (normal[:, 2] < 0) & (low[:, 2] > 0)
    if k.any():
        z = low[k, 2]
        ends = 0.0, lu[k], low[k, 0], high[k, 0], 0.0, lv[k], low[k, 1], high[k, 1]
        value[k] = _corner_sum(lambda x, xi, y, eta: _parallel(x - xi, y - eta, z), *ends)
    for across, along, width, span in ((0, 1, lu, lv), (1, 0, lv, lu)):
        k = known & (axis == across)
        if not k.any():
            continue
        # distances from the common line: of the source into the target's front, of the target above the source
        side, line = np.sign(normal[k, across]), low[k, across]
        x = np.maximum(np.sort(np.stack([-side * line, side * (width[k] - line)]), axis=0), 0.0)
        xi = np.maximum(np.stack([low[k, 2], high[k, 2]]), 0.0)
        ends = *x, *xi, 0.0, span[k], low[k, along], high[k, along]
        value[k] = _corner_sum(lambda p, q, y, eta: _perpendicular(p, q, y - eta), *ends)
    return value
