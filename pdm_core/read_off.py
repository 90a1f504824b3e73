"""What is read off a solution: incident light and radiance at points of its surfaces, at once or step by step."""

import numpy as np

from .checked import index, vectors
from .signs_of_life import finish


class ReadOff:
    """Of a solution with `scene`, `incident_steps`, `estimated_error_steps` and `kept_steps`."""

    def incident(self, surface_index, points, normals=None, inward=None):
        """points (n, 3) m, projected onto the surface -> irradiance / pi (n, 3) on its own side.

        On a mesh: normals (n, 3) of that side, to shade by; inward (n, 3) m, a point of the face that each belongs to.
        """
        return finish(self.incident_steps(*self._of_one(surface_index, points), normals, inward))

    def radiance(self, surface_index, points, normals=None, inward=None):
        """As incident -> outgoing radiance (n, 3)"""
        return finish(self.radiance_steps(*self._of_one(surface_index, points), normals, inward))

    def radiance_steps(self, surface, points, normals=None, inward=None):
        """Radiance (n, 3) at points (n, 3) m of surfaces (n,): generator of the fraction done."""
        light = yield from self.incident_steps(surface, points, normals, inward)
        reflectance, emission = materials_at(self.scene, surface, points)
        return emission + reflectance * light

    def estimated_error(self, surface_index, points):
        """points (n, 3) m, projected onto the surface -> (n,) estimated error of the radiance there, in its unit, as
        the length of the three channels': where it is likely to be large, not a bound at each point."""
        return finish(self.estimated_error_steps(*self._of_one(surface_index, points)))

    def kept(self, surface, points, normals=None, inward=None):
        """Kept of points (n, 3) m of surfaces (n,): what they show under other light, while no shape changes."""
        return finish(self.kept_steps(surface, vectors(points, "points"), normals, inward))

    def _of_one(self, surface_index, points):
        points = vectors(points, "points")
        return np.full(len(points), index(surface_index, len(self.scene), "surface_index")), points


def runs_of(surface):
    """[(k, index (m,))] of each surface among surfaces (n,), and where it is."""
    order = np.argsort(surface, kind="stable")
    cuts = np.flatnonzero(np.diff(surface[order], prepend=-2))
    return [(int(surface[order[a]]), order[a:b]) for a, b in zip(cuts, np.append(cuts[1:], len(order)))]


def materials_at(scene, surface, points):
    """Reflectance and emission (n, 3) at points (n, 3) m of surfaces (n,)."""
    reflectance, emission = scene.reflectance[surface], scene.emission[surface]
    varying = np.array([own.varies for own in scene.surfaces])
    some = np.flatnonzero(varying[surface])
    for k, mine in runs_of(surface[some]):
        own, mine = scene.surfaces[k], some[mine]
        on = own.shape.project(points[mine])
        reflectance[mine], emission[mine] = own.reflectance_at(on), own.emission_at(on)
    return reflectance, emission
