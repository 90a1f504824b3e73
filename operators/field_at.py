"""The field that is baked, at points of the scene's surfaces."""

from dataclasses import dataclass

from ..pdm_core import Mesh, Solution


@dataclass(frozen=True, eq=False)
class Field:
    """What colours mean: quantity 'RADIANCE' or 'IRRADIANCE' of a Solution."""

    solution: Solution
    quantity: str

    def __call__(self, surface, points, normals=None, inward=None):
        """At points (n, 3) m of a surface (index) -> (n, 3).

        Of a mesh with the normals (n, 3) that they are shaded with and points inward (n, 3) m of their faces: at a hard
        edge the place alone tells neither.
        """
        own = self.solution.scene.surfaces[surface]
        if normals is None or not isinstance(own.shape, Mesh):
            return getattr(self.solution, "radiance" if self.quantity == "RADIANCE" else "incident")(surface, points)
        # on its back the mesh's normals look away from it
        light = self.solution.incident(surface, points, normals=own.sign * normals, inward=inward)
        return light if self.quantity == "IRRADIANCE" else own.emission_at(points) + own.reflectance_at(points) * light
