"""What is read off a solution: incident light and radiance at points of its surfaces, at once or step by step."""

import numpy as np

from .checked import index, vectors
from .signs_of_life import finish


class ReadOff:
    """Of a solution with `scene` and `incident_steps`."""

    def incident(self, surface_index, points, normals=None, inward=None):
        """points (n, 3) m, projected onto the surface -> irradiance / pi (n, 3) on its own side.

        On a mesh: normals (n, 3) of that side, to shade by; inward (n, 3) m, a point of the face that each belongs to.
        """
        return finish(self.incident_steps(*self._of_one(surface_index, points), normals, inward))

    def radiance(self, surface_index, points, normals=None, inward=None):
        """As incident -> outgoing radiance (n, 3)"""
        return finish(self.radiance_steps(*self._of_one(surface_index, points), normals, inward))

    def radiance_steps(self, surface, points, normals=None, inward=None, roughly=False):
        """Radiance (n, 3) at points (n, 3) m of surfaces (n,): generator of the fraction done. roughly: where
        differences between near points count, not the light itself."""
        light = yield from self.incident_steps(surface, points, normals, inward, roughly)
        scene = self.scene
        out = scene.emission[surface] + scene.reflectance[surface] * light
        for k in np.unique(surface):
            own = scene.surfaces[k]
            if own.varies:
                mine = surface == k
                on = own.shape.project(points[mine])
                out[mine] = own.emission_at(on) + own.reflectance_at(on) * light[mine]
        return out

    def _of_one(self, surface_index, points):
        points = vectors(points, "points")
        return np.full(len(points), index(surface_index, len(self.scene), "surface_index")), points
