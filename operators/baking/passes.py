"""Passes: parts of the light, and how open the vertices are, as attributes beside the baked one."""

import numpy as np

from ...pdm_core.openness import openness_steps
from ...pdm_core.read_off import materials_at
from .bake_points import each_of, joined
from .colour_attribute import colours_of

SUFFIX = {"DIRECT": " Direct", "INDIRECT": " Indirect", "SKY": " Sky", "AO": " AO"}  # of the attribute's name
OF_LIGHT = ("DIRECT", "INDIRECT")


def in_order(passes):
    """Those of a set, as a tuple."""
    return tuple(name for name in SUFFIX if name in passes)


def names_of(attribute, passes):
    """Of the attributes of these passes."""
    return tuple(attribute + SUFFIX[name] for name in passes)


def pass_steps(settings, scene, kept, targets, points):
    """Generator of the fraction done; returns {attribute: [Colours]} of a bake's passes. kept: Kept of the points,
    without which the light is left out.

    Direct and indirect make the baked light: with emission, where that is radiance, all of it.
    """
    values = {}
    if kept is not None and any(name in OF_LIGHT for name in settings.passes):
        parts = dict(zip(OF_LIGHT, kept.parts(scene), strict=True))
        if settings.quantity == "RADIANCE":
            reflectance = materials_at(scene, kept.surface, kept.points)[0]
            parts = {name: reflectance * value for name, value in parts.items()}
        values |= {name: value * 2.0**settings.exposure for name, value in parts.items()}
    distances = {"SKY": np.inf, "AO": settings.ao_distance}
    if any(name in distances for name in settings.passes):
        surface, place, normals, inward = joined(points)
        share = yield from openness_steps(scene, surface, place, list(distances.values()), normals, inward)
        values |= {name: np.repeat(column[:, None], 3, axis=1) for name, column in zip(distances, share.T, strict=True)}
    return {
        settings.attribute + SUFFIX[name]: colours_of(targets, points, each_of(values[name], points))
        for name in settings.passes
        if name in values
    }
