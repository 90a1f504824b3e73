"""Where lamps shine, told before any work: at nothing at all, or at what is right in front of them."""

from dataclasses import dataclass

import numpy as np

from .rays.aimed import in_cone, on_balls, on_facets
from .rays.facets import Facets
from .shapes.shape import cone_lattice, lattice

RAYS = 64  # of a lamp
MOST_PAIRS = 1 << 24  # of rays and facets, some 2 s; beyond it nothing is told
NEAR, OWN = 0.02, 0.25  # of the scene's size, of the lamp's own: light that ends within neither comes into a room
NEARLY_ALL = 0.9  # of a lamp's light
BESIDE = 1e-4  # radians: what a lamp is mounted on is beside its light


@dataclass(frozen=True)
class Aim:
    """Of Scene.lights[light], which lights nothing, surface -1; or whose light ends on surface, at most distance m
    away."""

    light: int
    surface: int = -1
    distance: float = 0.0


def aims(scene):
    """[Aim] of those of a Scene's lamps that are turned away from all surfaces, or shut in close to one."""
    lamps = [k for k, light in enumerate(scene.lights) if not light.distant]
    count = sum(max(shape.facet_count, 1) for shape in scene.shapes)
    if not lamps or len(lamps) * RAYS * count > MOST_PAIRS:
        return []
    facets, out = Facets(scene), []
    for k in lamps:
        light = scene.lights[k]
        at, axis, half, size = light.cone
        rays = lattice(RAYS) if half == np.pi else cone_lattice(RAYS, axis, half)
        blocking = facets.blocking(light)
        surface, far = _first_met(blocking, at - facets.centre, rays)
        if np.isinf(far).all():
            apex, axis, half = light.beam or (at, axis, half)
            aimed = half < np.pi and blocking is facets  # what shines all around is turned away from nothing
            if aimed and not _any_within(facets, apex - facets.centre, axis, half):
                out.append(Aim(k))
            continue
        share = light.power_along(rays)
        order = np.argsort(far)
        most = order[np.searchsorted(np.cumsum(share[order]), NEARLY_ALL * share.sum())]
        if far[most] < max(NEAR * scene.size, OWN * size):
            names, times = np.unique(surface[far <= far[most]], return_counts=True)
            out.append(Aim(k, int(names[times.argmax()]), float(far[most])))
    return out


def _first_met(facets, at, rays):
    """surface (r,) and distance (r,) m where rays from a place end; -1 and inf where they meet nothing."""
    surface, far = np.full(len(rays), -1), np.full(len(rays), np.inf)
    flats, balls = np.arange(facets.count), np.arange(len(facets.shape) - facets.count)
    for ray, facet, front, place, _ in (on_facets(facets, flats, at, rays), on_balls(facets, balls, at, rays)):
        length = np.linalg.norm(place - at, axis=1)
        order = np.argsort(-length, kind="stable")  # the nearest is written last
        order = order[(length[order] < far[ray[order]]) & (length[order] > facets.tolerance)]
        far[ray[order]] = length[order]
        surface[ray[order]] = facets.surface[facet[order], np.where(front[order], 0, 1)]
    return surface, far


def _any_within(facets, apex, axis, half):
    """Whether a corner or the middle of any facet, or any part of a ball, is within a cone."""
    o, u, v = facets.origin, facets.u, facets.v
    offset = np.concatenate([o, o + u, o + v, facets.middles(), facets.ball_centre]) - apex
    reach = np.append(np.zeros(4 * facets.count), np.linalg.norm(facets.ball_linear, axis=(1, 2)))
    return bool(in_cone(offset, reach, axis, half - BESIDE).any())
