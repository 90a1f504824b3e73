"""What a scene needs, decided before the work and said with counts and reasons."""

from dataclasses import dataclass, field

import numpy as np

from .visibility import Shafts


@dataclass
class Plan:
    """lines: what is needed and what is left out, with the reason; str() prints it. counts: the numbers in it."""

    lines: list = field(default_factory=list)
    counts: dict = field(default_factory=dict)

    def __str__(self):
        return "\n".join(self.lines)


def plan(scene):
    """scene -> Plan"""
    lights = int((scene.emission > 0).any(axis=1).sum())
    black = int((scene.reflectance == 0).all(axis=1).sum())
    shafts = Shafts(scene)
    pairs, free = 0, 0
    everyone = np.arange(len(scene))
    for a in everyone:  # one row of pairs at a time bounds the memory
        hidden = shafts.may_hide(np.full(len(scene), a), everyone).any(axis=1)
        pairs, free = pairs + len(scene), free + int((~hidden).sum())
    result = Plan()
    say = result.lines.append
    say(f"{len(scene)} surfaces on {len(scene.shapes)} shapes, {lights} of them lights")
    if black:
        say(f"{black} surfaces send nothing on: they are black")
    if not lights and not (scene.background > 0).any():
        say("nothing shines: all is dark, no work")
    if not (scene.background > 0).any():
        say("no background light: directions that leave the scene are left out")
    say(f"{free} of {pairs} pairs of surfaces can be hidden by nothing: no visibility work there")
    result.counts = {"surfaces": len(scene), "lights": lights, "black": black, "pairs": pairs, "free pairs": free}
    return result
