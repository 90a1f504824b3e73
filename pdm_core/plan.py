"""What a scene needs, decided before the work and said with counts and reasons."""

from dataclasses import dataclass, field

import numpy as np

from .checked import of_kind, target_of
from .choice import MOST, choose
from .contacts import settle
from .scene import Scene
from .tolerances import TINY
from .visibility import shafts_of

MEMORY = 1.4e9  # bytes for the light between the nodes; all of a run stays below 2 GB
RAY_MEMORY = 1.2e9  # bytes for the rays between the nodes
LAMP_POINTS = 64  # of a surface, of which one must face a lamp


@dataclass
class Plan:
    """lines: what is needed and what is left out, with the reason; str() prints it. counts: the numbers in it.

    reached (n surfaces,): whether light may come to a surface at all.
    """

    lines: list = field(default_factory=list)
    counts: dict = field(default_factory=dict)
    reached: np.ndarray = field(default=None, repr=False)

    def __str__(self):
        return "\n".join(self.lines)


def plan(scene, target_error=1e-2):
    """scene, target of the radiance's relative error -> Plan"""
    of_kind(scene, Scene, "plan")
    target = target_of(target_error)
    choice = choose(scene, target)
    return (plan_by_rays if choice.by_rays else plan_by_links)(scene, target, choice.why)


def plan_by_links(scene, target, why):
    """The Plan of a solution by links between cells, chosen for the reason why."""
    scene = settle(scene)[0]
    shafts, result = shafts_of(scene), _begun(scene, target, f"indirect light by links between cells, {why}")
    result.reached = reached = reached_by_light(scene, shafts)
    pairs, (apart, free) = len(scene) ** 2, _pairs(len(scene), shafts)
    say = result.lines.append
    if reached.any() and not reached.all():
        say(f"surfaces left out because no light reaches them: {(~reached).sum()}")
    channels = len(proportional_channels(scene)[0])
    if channels < 3:
        say(f"colour channels solved: {channels} of 3, the others are their multiples")
    if not (scene.reflectance[reached] > 0).any():
        say("no indirect light: all that light reaches is black")
    say(f"pairs of surfaces left out because they face away from each other: {apart} of {pairs}")
    say(f"pairs of surfaces without visibility work because nothing can hide them: {free} of {pairs}")
    say(f"memory for the light between the nodes: at most {MEMORY / 1e6:.0f} MB")
    result.counts |= {"dark": int((~reached).sum()), "channels": channels}
    result.counts |= {"pairs": pairs, "apart": apart, "free pairs": free}
    return result


def _begun(scene, target, how):
    """The Plan of any solution, `how` indirect light is worked out, that all surfaces are reached."""
    lights = int((scene.emission > 0).any(axis=1).sum()) + len(scene.lights)
    black = int((scene.reflectance == 0).all(axis=1).sum())
    sky = scene.sky is not None or (scene.background > 0).any()
    result = Plan(reached=np.ones(len(scene), bool))
    say = result.lines.append
    say(f"surfaces: {len(scene)} on {len(scene.shapes)} shapes, lights: {lights}, target: {100 * target:g} %")
    say(how)
    if black:
        say(f"black surfaces, which send nothing on: {black}")
    if not lights and not sky:
        say("nothing shines: all is dark, no work")
    if not sky:
        say("no background light: directions that leave the scene carry nothing")
    result.counts = {"surfaces": len(scene), "lights": lights, "black": black}
    return result


def _pairs(count, shafts):
    """Of how many pairs of so many surfaces one is behind the other, and how many others nothing can hide."""
    apart, free, everyone = 0, 0, np.arange(count)
    for a in everyone:  # one row of pairs at a time bounds the memory
        seen = everyone[shafts.may_see(a)]
        apart += count - len(seen)
        seen = seen[seen >= a]  # what may hide is the same both ways
        hidden = shafts.may_hide(np.full(len(seen), a), seen).any(axis=1)
        free += int((~hidden * np.where(seen > a, 2, 1)).sum())
    return apart, free


def plan_by_rays(scene, target, why):
    """The Plan of a solution by bundles of rays, chosen for the reason why."""
    result = _begun(scene, target, f"indirect light and the sky by bundles of parallel rays, {why}")
    count = [shape.facet_count for shape in scene.shapes]
    result.lines += [
        f"what rays may meet: {sum(count)} parallelograms and triangles, {count.count(0)} balls",
        f"memory for the rays between the nodes: at most {RAY_MEMORY / 1e6:.0f} MB",
    ]
    result.counts |= {"dark": 0, "channels": 3, "facets": sum(count)}
    return result


def lit(scene):
    """(n surfaces,) Whether light may come to each, as in Plan.reached, without the rest of the plan; of many shapes,
    or of others than planes and spheres, nothing is known beforehand."""
    if len(scene) > MOST or scene.plurals:
        return np.ones(len(scene), bool)
    scene = settle(scene)[0]
    return reached_by_light(scene, shafts_of(scene))


def reached_by_light(scene, shafts):
    """(n surfaces,) False where no light can come, directly or over other surfaces, whatever the visibility between."""
    if (scene.background > 0).any():
        return np.ones(len(scene), bool)
    reached = _reached_by_lamps(scene)
    sending, asked = (scene.emission > 0).any(axis=1), np.zeros(len(scene), bool)
    sending |= reached & (scene.reflectance > 0).any(axis=1)
    while len(new := np.flatnonzero(sending & ~asked)):
        for a in new:  # a row at a time bounds the memory
            reached |= shafts.may_see(a)
        asked[new] = True
        sending |= reached & (scene.reflectance > 0).any(axis=1)
    return reached


def _reached_by_lamps(scene):
    """(n surfaces,) whether any of some points of each faces a lamp."""
    lamps = [light for light in scene.lights if (light.colour > 0).any()]
    if not lamps:
        return np.zeros(len(scene), bool)
    points = [surface.shape.spread(LAMP_POINTS) for surface in scene.surfaces]
    normals = np.concatenate([s.normals(x) for s, x in zip(scene.surfaces, points)])
    light = sum(lamp.unoccluded(np.concatenate(points), normals) for lamp in lamps)
    return (light.reshape(len(scene), LAMP_POINTS) > 0).any(axis=1)


def proportional_channels(scene):
    """Channels to solve for, indices (c,), and what makes all three of them, (c, 3): others are their multiples.

    Channel b is one of a where every reflectance is the same in both and all light of b is k times that of a.
    """
    lamps = np.array([lamp.colour for lamp in scene.lights]).reshape(-1, 3)
    light = np.concatenate([scene.emission, scene.background[None], lamps])
    which, made = [], np.zeros((3, 3))
    for b in range(3):
        for a in which:
            k = light[:, b].sum() / max(light[:, a].sum(), 1e-300)
            same = (scene.reflectance[:, a] == scene.reflectance[:, b]).all()
            if same and np.allclose(light[:, b], k * light[:, a], rtol=TINY, atol=0):
                made[a, b] = k
                break
        else:
            which.append(b)
            made[b, b] = 1.0
    return np.array(which), made[which]
