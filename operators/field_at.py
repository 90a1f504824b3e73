"""The field that is baked, at points of the scene's surfaces."""

from dataclasses import dataclass

import numpy as np

from ..pdm_core import Solution


@dataclass(frozen=True, eq=False)
class Field:
    """What colours mean: quantity 'RADIANCE' or 'IRRADIANCE' of a Solution."""

    solution: Solution
    quantity: str

    def steps(self, surface, points, normals=None, inward=None):
        """At points (n, 3) m of surfaces (n,) -> (n, 3): generator of the fraction done.

        Of meshes with the normals (n, 3) that they are shaded with and points inward (n, 3) m of their faces: at a hard
        edge the place alone tells neither.
        """
        if normals is not None:  # on its back a mesh's normals look away from it
            sign = np.array([s.sign for s in self.solution.scene.surfaces])
            normals = sign[surface][:, None] * normals
        solution = self.solution
        read = solution.radiance_steps if self.quantity == "RADIANCE" else solution.incident_steps
        return read(surface, points, normals, inward)
