"""The field that is baked, at points of the scene's surfaces."""

from dataclasses import dataclass

import numpy as np

from ...pdm_core import Solution
from ...pdm_core.read_off import materials_at


@dataclass(frozen=True, eq=False)
class Field:
    """What colours mean: quantity 'RADIANCE' or 'IRRADIANCE' of a Solution."""

    solution: Solution
    quantity: str

    def steps(self, surface, points, normals=None, inward=None, roughly=False):
        """At points (n, 3) m of surfaces (n,) -> (n, 3): generator of the fraction done.

        Of meshes with the normals (n, 3) that their surfaces' sides are shaded with and points inward (n, 3) m of their
        faces: at a hard edge the place alone tells neither.
        """
        solution = self.solution
        read = solution.radiance_steps if self.quantity == "RADIANCE" else solution.incident_steps
        return read(surface, points, normals, inward, roughly)

    def held(self, surface, points):
        """The same as the solution's cells hold it, at once and roughly: generator of the fraction done."""
        light = yield from self.solution.held_steps(surface, points)
        if self.quantity == "IRRADIANCE":
            return light
        reflectance, emission = materials_at(self.solution.scene, surface, points)
        return emission + reflectance * light

    def at_places(self, places, roughly=False):
        """[(n, 3)] at several places, each (surfaces, points, normals, inward) as in steps, all at once: generator."""
        if not places:
            return []
        found = yield from self.steps(*(np.concatenate(part) for part in zip(*places)), roughly)
        return np.split(found, np.cumsum([len(place[0]) for place in places])[:-1])
