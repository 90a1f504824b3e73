"""What an artist would rather know before the light is solved: that all is black, or that lamps miss the scene."""

import numpy as np

from ...pdm_core.aims import aims
from ..reading.read_scene import some
from .colour_attribute import BakeError


def check_colours(reading, targets):
    """Raises BakeError where every baked side neither reflects nor shines, so that radiance is 0 wherever it is lit."""
    scene = reading.scene
    sides = np.unique(np.concatenate([target.corner_surface for target in targets]))
    if scene.reflectance[sides].any() or scene.emission[sides].any():
        return
    names = [target.name for target in targets]
    raise BakeError(
        f"All is black: {some('object', names)} reflect{'s' * (len(names) == 1)} nothing, whatever the light; give "
        "the materials a Base Color above black (their notes tell of shaders that are taken as black), or bake "
        "Irradiance"
    )


def foreseen(reading):
    """[sentence] on lamps that light nothing, or only what is right in front of them; arrays alone, for a thread.
    BakeError where nothing else shines."""
    scene = reading.scene
    owner = {surface: each.name for each in reading.objects for surface in each.surfaces}
    away, shut = [], {}
    for aim in aims(scene) if scene else []:
        name = scene.lights[aim.light].name
        if aim.surface < 0:
            away.append(name)
        else:
            names, distances = shut.setdefault(owner[aim.surface], ([], []))
            names.append(name)
            distances.append(aim.distance)
    texts = [
        f"{some('Light', names)} {_be(names)} right before object {hiding!r} or within it: nearly all light ends on it "
        f"within {max(distances):.2g} m; turn or move the light, or disable the object in renders"
        for hiding, (names, distances) in shut.items()
    ]
    if not away:
        return texts
    text = f"{some('Light', away)} {_be(away)} turned away from all objects: nothing is lit; turn or move {_it(away)}"
    if len(away) == len(scene.lights) and not (scene.emission.any() or scene.background.any()):
        raise BakeError(f"Nothing is lit: {text.partition(': ')[0]}; turn or move {_it(away)}")
    return [text, *texts]


def _be(names):
    return "is" if len(names) == 1 else "are"


def _it(names):
    return "it" if len(names) == 1 else "them"
