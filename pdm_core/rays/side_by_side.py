"""Planes laid out side by side in one: what lies where in many of them is looked for at once."""

import numpy as np

from ..shapes.shape import frames


class SideBySide:
    """Of Facets: planes with normals (p, 3), in which things reach m apart are looked for as one."""

    def __init__(self, facets, normals, reach):
        self.frames = frames(normals)
        self.room = 2 * np.linalg.norm(facets.boxes, axis=1).max(initial=0.0)  # m, the widest that a plane can be
        self.reach = reach + 2.0**-50 * self.room * len(normals)

    def at(self, place, points):
        """x, y (2, ...) m of points (..., 3) m about the facets' centre in planes number (...)."""
        axes = self.frames[np.broadcast_to(place, points.shape[:-1])]
        x, y, _ = np.moveaxis(np.einsum("...ai,...i->...a", axes, points), -1, 0)
        return np.stack([x + self.room * place, y])

    def boxes(self, place, corners):
        """low, high (2, k) m about things of corners (k, n, 3) m in planes number (k,)."""
        corners = self.at(place[:, None], corners)
        return corners.min(axis=2) - self.reach, corners.max(axis=2) + self.reach
