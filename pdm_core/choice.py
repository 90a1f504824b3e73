"""Links or rays, decided once a scene: by what it holds, else by what each is predicted to cost."""

from dataclasses import dataclass

import numpy as np

from .contacts import settle
from .in_depth import balls_that_cross
from .visibility import shafts_of

MOST = 200  # surfaces that links take: they keep tables of all pairs of shapes, and of nodes; rays are ahead from 60 on
# Fitted to measured runs of 1 to 300 boxes, balls and planes at targets of 4 and 1 %, on one thread, 4,000 places read.
FACING, CROSSED = 4e-3, 2.0  # s of links at the target of 4 %, either way of a pair of surfaces of which neither is
# behind the other, and for each ball that another shape runs through: cells get finer all along that curve
FINER_LINKS, FINER_RAYS = 0.9, 1.8  # powers of the target's reciprocal
RAYS, RAYS_AT, CURVED = 0.75, 1.4, 0.5  # s of rays for any scene, more at the target of 1 %, and for each ball


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
    shafts = shafts_of(settle(scene)[0])
    facing = sum(int(shafts.may_see(a).sum()) for a in range(len(scene)))  # one row at a time bounds the memory
    crossed = len(balls_that_cross(shafts.table)[0])
    links = (FACING * facing + CROSSED * crossed) * (0.04 / target) ** FINER_LINKS
    curved = sum(np.isfinite(shape.bend) for shape in scene.shapes)
    rays = RAYS + (RAYS_AT + CURVED * curved) * (0.01 / target) ** FINER_RAYS
    return Choice(rays < links, f"predicted: {_seconds(rays)} s by rays, {_seconds(links)} s by links", links, rays)


def _seconds(value):
    return f"{value:.2g}" if value < 99.5 else f"{value:,.0f}"
