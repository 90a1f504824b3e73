"""How errors of colours count: as pictures show them. What is far brighter than nearly all of the light, as a patch of
ceiling behind a lamp is, would hide all else: there they count in proportion to the light."""

from dataclasses import dataclass

import numpy as np

from ...pdm_core.read_off import drawn, materials_at, spread_points
from .field_at import Field

PLACES = 4000  # looked at, by area
DARK = 0.01  # of the mean: what is no brighter lies in no light, as the outside of walls
NEARLY_ALL, STOPS = 0.95, 2  # of the lit area is white at most; so much brighter is still told apart by views


@dataclass(frozen=True, eq=False)
class Shown:
    """field: what is baked; white: radiance without emission up to which errors count in full; norm: of all light as it
    counts, as Solution.norm, whose own it is where nothing is brighter than white."""

    field: Field
    white: float
    norm: float

    def factor(self, surface, light):
        """(n, 3) by which errors of the Field's values near `light` (n, 3) on surfaces (n,) count, as radiance."""
        scene = self.field.solution.scene
        if self.field.quantity == "IRRADIANCE":
            reflectance = scene.reflectance[surface]
            return reflectance * _part(self.white, reflectance * light)
        return np.broadcast_to(_part(self.white, light - scene.emission[surface]), light.shape)


def _part(white, light):
    """(n, 1)"""
    largest = light.max(axis=1, keepdims=True)
    return np.divide(white, largest, out=np.ones_like(largest), where=largest > white)


def shown_steps(field):
    """Generator of the fraction done; returns the Shown of a Field."""
    solution, rng = field.solution, np.random.default_rng(4)
    scene, norm = solution.scene, solution.norm
    areas = np.where((scene.reflectance > 0).any(axis=1), scene.areas, 0.0)
    if not norm > 0 or not areas.any():  # nothing was to be found
        return Shown(field, np.inf, np.inf)
    surface = drawn(areas, PLACES, rng)
    points = spread_points(scene, surface, rng)
    light = materials_at(scene, surface, points)[0] * (yield from solution.held_steps(surface, points))
    size = light.max(axis=1)
    white = 2**STOPS * float(np.quantile(size[size >= DARK * size.mean()], NEARLY_ALL))
    part = _part(white, light)
    if not white > 0 or (part == 1).all():
        return Shown(field, np.inf, norm)
    return Shown(field, white, float(np.sqrt(areas.sum() * ((part * light) ** 2).sum(axis=1).mean())))
