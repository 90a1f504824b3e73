"""Form factors of aligned rectangles in closed form: parallel ones and perpendicular ones.

Gross, Spindler and Hahne 1981; Ehlert and Smith 1993. The double contour integral of Lambert's law has an
elementary primitive when the edges are parallel to three orthogonal axes; it is summed over sixteen corner pairs.
"""

import numpy as np

from .scene import Plane

ALIGNED = 1e-14  # sine and cosine of angles that count as right


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
    for i, a in enumerate((a0, a1)):
        for j, b in enumerate((b0, b1)):
            for k, c in enumerate((c0, c1)):
                for m, d in enumerate((d0, d1)):
                    total = total + (-1) ** (i + j + k + m) * primitive(a, b, c, d)
    return total / (2 * np.pi)


def aligned_rectangles(surfaces, i, j):
    """Unoccluded form factors (m,) of pairs i -> j (m,) of surfaces, and which pairs are aligned rectangles (m,).

    Absolute error about 1e-15 of the larger area over the source's.
    """
    planes = [k for k in np.unique(np.concatenate([i, j])) if isinstance(surfaces[k].shape, Plane)]
    number = np.full(len(surfaces), -1)
    number[planes] = np.arange(len(planes))
    shapes = [surfaces[k].shape for k in planes]
    if not shapes:
        return np.zeros(len(i)), np.zeros(len(i), bool)
    u, v, origin = (np.array([getattr(s, name) for s in shapes]) for name in ("u", "v", "origin"))
    length_u, length_v = np.linalg.norm(u, axis=1), np.linalg.norm(v, axis=1)
    e, f = u / length_u[:, None], v / length_v[:, None]
    normal = np.array([surfaces[k].sign * s.normal for k, s in zip(planes, shapes)])
    square = np.abs(np.einsum("ij,ij->i", e, f)) < ALIGNED
    a, b = number[i], number[j]
    known = (a >= 0) & (b >= 0) & square[a] & square[b]
    value = np.zeros(len(i))
    # in the frame (e, f, normal) of the source
    frame = np.stack([e, f, normal], axis=1)[a]

    def local(w):
        return np.einsum("mij,mj->mi", frame, w)

    be, bf, bn, offset = local(e[b]), local(f[b]), local(normal[b]), local(origin[b] - origin[a])
    aligned = np.isclose(np.abs(bn).max(axis=1), 1, rtol=0, atol=ALIGNED) & np.isclose(np.abs(be).max(axis=1), 1, rtol=0, atol=ALIGNED)
    known &= aligned
    extent = be * length_u[b, None] + bf * length_v[b, None]
    low, high = np.minimum(offset, offset + extent), np.maximum(offset, offset + extent)
    axis = np.argmax(np.abs(bn), axis=1)
    lu, lv = length_u[a], length_v[a]
    facing = known & (axis == 2) & (bn[:, 2] < 0) & (offset[:, 2] > 0)
    if facing.any():
        k = facing
        z = offset[k, 2]
        value[k] = _corner_sum(lambda x, xi, y, eta: _parallel(x - xi, y - eta, z), 0.0, lu[k], low[k, 0], high[k, 0],
                               0.0, lv[k], low[k, 1], high[k, 1])
    for normal_axis, along, width, span in ((0, 1, lu, lv), (1, 0, lv, lu)):
        k = known & (axis == normal_axis)
        if not k.any():
            continue
        # distances from the common line: of the source into the target's front, of the target above the source
        side = np.sign(bn[k, normal_axis])
        x = np.stack([side * (0 - offset[k, normal_axis]), side * (width[k] - offset[k, normal_axis])])
        x = np.maximum(np.sort(x, axis=0), 0.0)
        xi = np.maximum(np.stack([low[k, 2], high[k, 2]]), 0.0)
        value[k] = _corner_sum(lambda p, q, y, eta: _perpendicular(p, q, y - eta), x[0], x[1], xi[0], xi[1],
                               0.0, span[k], low[k, along], high[k, along])
    area = length_u * length_v
    return np.maximum(value, 0.0) / area[a], known
