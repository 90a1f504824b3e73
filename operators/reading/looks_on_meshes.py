"""The Appearances of materials on the meshes that have them, and which of them are lights at all."""

from dataclasses import replace

import numpy as np

from .materials import NO_MATERIAL
from .varying import Faces, Varying


def looks_on(mesh, looks, baked):
    """[Appearance] of each shape of a MeshObject, what varies as functions of points of it. looks: {name: Appearance};
    baked: names of colour attributes that hold bakes.

    What the mesh has not goes to its warnings.
    """
    own = [looks[name] for name in mesh.shape_materials]
    layers = mesh.raw.layers
    if layers is None:
        return own
    mesh.warnings += layers.told
    for kind, name in layers.missing:
        what = {"uv": "UV map", "attribute": "attribute"}[kind]
        mesh.warnings.append(f"it has no {what} {name!r} that its material asks for: it is taken as 0")
    shape = mesh.shapes.triangle_shape
    order = np.argsort(shape, kind="stable")
    ends = np.searchsorted(shape[order], np.arange(len(own) + 1))
    on = [
        look.on(Faces(layers, mesh.raw.matrix, order[ends[k] : ends[k + 1]])) if look.needs else look
        for k, look in enumerate(own)
    ]
    return [_without_bake(look, mesh) for look in on] if layers.default_colour in baked else on


def _without_bake(look, mesh):
    """A bake that is shown as the attribute without a name is no light, and no reflectance."""

    def other(sides, value):
        return tuple(
            np.full(3, value) if isinstance(s, Varying) and ("attribute", "") in s.value.needs else s for s in sides
        )

    changed = replace(look, reflectance=other(look.reflectance, NO_MATERIAL), emission=other(look.emission, 0.0))
    if any(a is not b for a, b in zip(changed.reflectance + changed.emission, look.reflectance + look.emission)):
        if not any(callable(side) or side.any() for side in changed.reflectance):  # nothing tells what it reflects
            changed = replace(changed, reflectance=(np.full(3, NO_MATERIAL),) * 2)
        mesh.warnings.append(
            f"its material shows the baked attribute {mesh.raw.layers.default_colour!r}: it is not read"
        )
        return changed
    return look


def settle_pictures(looks, is_lit):
    """Takes the emission of pictures for no light where anything else lights the scene; looks {name: Appearance}.

    A material that emits an image, at a strength of 1 at most, and reflects nothing is an unlit picture: artists draw
    backdrops, screens and whole low-poly worlds so, to be seen as they are and not to light their neighbours. Alone in
    the dark it is the light. is_lit: whether the world or lamps light the scene.
    """
    is_lit = is_lit or any(look.shines and not look.is_picture for look in looks.values())
    for name, look in looks.items():
        if look.is_picture and is_lit:
            text = (
                "it shows an image by its own light, and other light is there: it is taken for a picture, not a light; "
                "raise its emission's Strength above 1 to make it one"
            )
            dark = (np.zeros(3),) * 2
            looks[name] = replace(look, emission=dark, warnings=[*look.warnings, text], is_picture=False)
