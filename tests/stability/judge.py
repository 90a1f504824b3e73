"""One scene of one kind: solved and judged."""

import time
from dataclasses import dataclass

import numpy as np
from tracer import measured_error, places

from pdm_core import SceneError, solve
from pdm_core.contacts import contacts_of

POINTS, PATHS = 250, 128
NOISE = 2.0  # standard deviations of the tracer that count as agreement
ROUNDING = 1e-5  # below it the furnace is exact: single precision rows


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


def judge(kind, seed, target=0.02, limit=20.0):
    rng = np.random.default_rng([seed, sum(kind.__name__.encode())])
    start = time.process_time()
    try:
        extreme, scene, how = kind(rng)
        solution = solve(scene, target, time_limit=limit)
    except SceneError as error:
        return Verdict(kind.__name__, "", np.nan, np.nan, 0.0, time.process_time() - start, str(error))
    seconds = time.process_time() - start
    if how == "tracer":
        measured, noise = measured_error(scene, solution, POINTS, PATHS, rng)
    else:
        measured, noise = furnace_error(scene, solution, rng), 0.0
    said = solution.warnings[0] if solution.warnings else ""
    return Verdict(kind.__name__, extreme, float(solution.error), float(measured), float(noise), seconds, said)


def furnace_error(scene, solution, rng):
    """Relative L2 error of L - Le where L is 1: everywhere but where two faces lie against each other."""
    surface, points, normals, weight = places(scene, POINTS, rng)
    rho = scene.reflectance[surface]
    mine = np.empty_like(points)
    for s in np.unique(surface):
        mine[surface == s] = rho[surface == s] * solution.incident(s, points[surface == s])
    transport = solution._light.transport
    covered = contacts_of(transport.scene).covered(points - transport.origin, surface)
    weight = np.where(covered, 0.0, weight)
    return np.sqrt((weight[:, None] * (mine - rho) ** 2).sum() / (weight[:, None] * rho**2).sum())
