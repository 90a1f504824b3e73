"""What the scene makes of a light's errors: between white walls light, and what it is off by, come back many times."""

import numpy as np

from ..error_estimates import source_defect
from ..error_flow import norms
from ..numerics import ROUGHLY, gcr
from ..signs_of_life import finish
from ..tolerances import SINGLE

ROUNDED = 0.2 * SINGLE  # of the light: what single precision costs, as a row's entries are off either way


class Amplified:
    """What errors of one sign come to when light has gone round with them, solved for like light; each (n surfaces,),
    in L2.

    direct: of how direct light bends within the cells it is sent from, bent (n sent nodes, 3) there; bends: of direct
    and indirect light's; unsolved: of what the solver left; unclosed: of rows that do not sum to 1.
    """

    def __init__(self, light):
        t, rho = light.transport, light.reflectance
        self.bent = source_defect(t.sent, light.lit)
        lit = t.rows.times(rho * self.bent)
        indirect = t.rows.times(rho * t.spread(source_defect(t.field, light.indirect)))
        received = t.rows.times(light.radiosity())
        unsolved = received - light.indirect
        unsolved += np.copysign(ROUNDED, unsolved.sum()) * light.indirect
        right = np.concatenate([lit, lit + indirect, unsolved, t.from_nothing(received)], axis=1)
        scatter = light.scatter(np.tile(rho, 4))
        # what is left of it may be as much of one sign as all of it is
        error = finish(gcr(scatter, right, np.zeros_like(right), ROUGHLY))[0] / (1 - ROUGHLY)
        self.direct, self.bends, self.unsolved, self.unclosed = (
            norms(t.sent, np.linalg.norm(rho * t.spread(error[:, k : k + 3]), axis=1)) for k in (0, 3, 6, 9)
        )
