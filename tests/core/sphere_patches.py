"""What is known of patches of a sphere's inner side, by which other ways to it are judged."""

import numpy as np

from pdm_core.closed_forms import circle_above_horizon


def sphere_patch_unoccluded(points, normals, centre, radius, low, high):
    """What points (m, 3) m, unit normals (m, 3), inside or on a round sphere receive from a patch of its inner side.

    centre (3,) m, radius m; low, high (theta, phi): the patch's bounds, 0 <= theta <= pi from +z, high phi - low phi
    at most a turn -> (m,) form factor, horizon-clipped. The contour integral along two parallels and two meridians,
    in closed form; the way back along the horizon is known up to whole turns, of which a form factor below 1 has none.
    Absolute error about 1e-12; a point on the patch's border has no limit: move it off.
    """
    offset = (np.asarray(centre, float) - points).T
    n = np.ascontiguousarray(normals.T)
    (t0, p0), (t1, p1) = low, high
    x, y, z = (np.array([np.eye(3)[k]]).T * radius for k in range(3))
    total = np.zeros(len(points))
    for theta, start, end in ((t0, p1, p0), (t1, p0, p1)):
        k0 = offset + np.cos(theta) * z
        total += circle_above_horizon(n, k0, np.sin(theta) * x, np.sin(theta) * y, start, end)
    for phi, start, end in ((p0, t0, t1), (p1, t1, t0)):
        total += circle_above_horizon(n, offset, z, np.cos(phi) * x + np.sin(phi) * y, start, end)
    share = np.mod(total / (2 * np.pi), 1.0)
    return np.where(share > 1 - 1e-12, 0.0, share)
