"""Links or rays, decided once a scene: by what it holds, else by what each is predicted to cost."""

from dataclasses import dataclass

import numpy as np

MOST = 200  # surfaces that links take: they keep tables of all pairs of shapes, and of nodes; rays are ahead from 60 on
# Fitted to measured runs of 5 to 300 boxes, balls and planes at targets of 4 to .25 %, on one thread.
PAIR, BLOCKED = 3.75e-4, 0.1  # s of links a pair of surfaces: 30 us for each of 25 nodes that half of the others
# face; more for each shape that may hide them
FINER_LINKS, FINER_RAYS = 0.85, 1.8  # powers of the target's reciprocal
# s of rays for any scene, more at the target of 1 %, and for each ball, reading some thousand places included
RAYS, RAYS_AT, CURVED = 1.0, 1.0, 0.5


@dataclass(frozen=True)
class Choice:
    """by_rays; why: for the plan; links, rays: predicted s, None where there is no choice."""

    by_rays: bool
    why: str
    links: float | None = None
    rays: float | None = None


def choose(scene, target):
    """The Choice for a Scene and a target error."""
    needs = scene.plurals + ["lights"] * bool(scene.lights) + ["a background that varies"] * (scene.sky is not None)
    needs += ["surfaces that vary"] * any(surface.varies for surface in scene.surfaces)
    needs += [f"more than {MOST} surfaces"] * (len(scene) > MOST)
    if needs:
        return Choice(True, f"because of {' and '.join(needs)}")
    links = PAIR * len(scene) ** 2 * (1 + BLOCKED * len(scene.shapes)) * (0.04 / target) ** FINER_LINKS
    curved = sum(np.isfinite(shape.bend) for shape in scene.shapes)
    rays = RAYS + (RAYS_AT + CURVED * curved) * (0.01 / target) ** FINER_RAYS
    return Choice(rays < links, f"predicted: {_seconds(rays)} s by rays, {_seconds(links)} s by links", links, rays)


def _seconds(value):
    return f"{value:.2g}" if value < 99.5 else f"{value:,.0f}"
