"""One scene of one kind: solved and judged."""

import time
from dataclasses import dataclass

import numpy as np
from tracer import measured_error, places
from variants import solve_by_rays

from pdm_core import Plane, Scene, SceneError, solve
from pdm_core.contacts import contacts_of, settle
from pdm_core.rays.bundles import AGAINST

POINTS, PATHS = 250, 128
BY_RAYS = 1000  # points: few of them tell little of light that is wrong in few places
NOISE = 2.0  # standard deviations of the tracer that count as agreement
FLUSH = 64.0  # tolerances within which a point is of a plane
ROUNDING = 5e-5  # below it the furnace is exact: single precision rows, and a point within rounding of an edge


@dataclass
class Verdict:
    kind: str
    extreme: str
    stated: float
    measured: float
    noise: float
    seconds: float
    said: str  # refusal or first warning

    @property
    def refused(self):
        return np.isnan(self.stated)

    @property
    def holds(self):
        """Refused by name, or what is stated covers what is measured."""
        return self.refused or self.measured <= self.stated + NOISE * self.noise + ROUNDING


def judge(kind, seed, target=0.02, limit=20.0, variant=None, solver=solve):
    """variant: what is made of the scene for rays; None: solver(scene, target, limit), by default what is chosen."""
    rng = np.random.default_rng([seed, sum(kind.__name__.encode())])
    name = f"{kind.__name__} {variant.__name__}" if variant else kind.__name__
    start = time.process_time()
    try:
        extreme, given, how = kind(rng)
        scene = variant(given) if variant else given
        solution = (solve_by_rays if variant else solver)(scene, target, limit)
    except SceneError as error:
        return Verdict(name, "", np.nan, np.nan, 0.0, time.process_time() - start, str(error))
    seconds = time.process_time() - start
    if how == "tracer":
        measured, noise = measured_error(scene, solution, POINTS, PATHS, rng)
    else:
        told = with_contacts_told(given, solution)
        measured, noise = furnace_error(told, scene, solution, rng, BY_RAYS if variant else POINTS), 0.0
    said = solution.warnings[0] if solution.warnings else ""
    return Verdict(name, extreme, float(solution.error), float(measured), float(noise), seconds, said)


def with_contacts_told(scene, solution):
    """The scene; rounded, where rays name shapes that they take as in contact, so far that these are."""
    if not any("taken as in contact" in text for text in solution.warnings):
        return scene
    coarser = AGAINST * solution._state.facets.tolerance / scene.tolerance
    return Scene(scene.surfaces, scene.background, coarser * scene.rounding)


def furnace_error(given, scene, solution, rng, count):
    """Relative L2 error of L - Le where L is 1: everywhere but where two faces of the scene as it was given lie against
    each other."""
    surface, points, normals, weight = places(scene, count, rng)
    rho = scene.reflectance[surface]
    mine = rho * solution.incident(surface, points)
    weight = np.where(covered(given, points, normals), 0.0, weight)
    return np.sqrt((weight[:, None] * (mine - rho) ** 2).sum() / (weight[:, None] * rho**2).sum())


def covered(scene, points, normals):
    """(n,) Whether points (n, 3) m lie between two planes in contact; normals (n, 3) off what they are on."""
    settled, origin = settle(scene)
    contacts, out = contacts_of(settled), np.zeros(len(points), bool)
    for k, own in enumerate(scene.surfaces):
        if isinstance(own.shape, Plane):
            local = own.shape.local(points)
            on = np.abs(local[:, 2]) * np.sqrt(own.shape.area) < FLUSH * scene.tolerance
            on &= (np.abs(local[:, :2] - 0.5) <= 0.5 + 1e-9).all(axis=1)
            on = np.flatnonzero(on & (normals @ own.normals(points[:1])[0] > 0.99))
            out[on] |= contacts.covered(points[on] - origin, np.full(len(on), k))
    return out
