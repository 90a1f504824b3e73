"""Each surface's own error: against the whole scene's light what lies in the dark may be anything, not of its own."""

import numpy as np

from .tolerances import TINY

OWN = 4.0  # targets that a surface's own error may reach
DIM = 0.01  # of the brightest surface's light: what is darker need not reach it
TOLD = 4.0  # points looked at that weigh as much as what surpluses promise, or as what is usual


class SharedLight:
    """The light L - Le of a solution, shared out. norm, part_norm: L2 norms, radiance times metres, over surfaces and
    over parts of them (charts of planes, whole spheres), numbered by their first root cells; counts, part_counts:
    whether their mean radiance is above DIM of that of the brightest surface; part_rms, radiance."""

    def __init__(self, field, value):
        """value (n nodes, 3): radiance."""
        leaves = field.leaves
        square = (value**2).sum(axis=1)[field.nodes[leaves]]
        area = field.sizes()[leaves]
        each = np.stack([area * square.mean(axis=1), area * np.sqrt(square).mean(axis=1), area])
        surfaces, parts = (
            np.stack([np.bincount(key[leaves], row, count) for row in each])
            for key, count in ((field.surface, len(field.charts)), (field.part, int(field.charts.sum())))
        )
        mean, part_mean = (sums[1] / np.maximum(sums[2], 1e-300) for sums in (surfaces, parts))
        self.norm, self.part_norm = np.sqrt(surfaces[0]), np.sqrt(parts[0])
        self.part_rms = self.part_norm / np.sqrt(np.maximum(parts[2], 1e-300))
        self.counts, self.part_counts = (m > DIM * mean.max(initial=0.0) for m in (mean, part_mean))

    def allowed(self, target):
        """(n parts,) What the error of each may be in L2, radiance times metres; infinite where too dark to count."""
        return np.where(self.part_counts, OWN * target * self.part_norm, np.inf)

    def stress(self, level):
        """(n parts,), from 1: how much finer than for the level, a radiance, errors at points of each have to be."""
        return np.clip(level / np.maximum(OWN * self.part_rms, OWN * DIM * level + 1e-300), 1.0, None)


def worst_of_parts(field, error, allowed, parts):
    """Halvings so that those left hold no more than allowed (n parts,) of the error (n cells, 2), in L2; parts (n
    cells,): field.part, or field.surface."""
    halvings, error = field.halvings, error.ravel()
    halvings = halvings[(error[halvings] > 0) & np.isfinite(allowed[parts[halvings // 2]])]
    halvings = halvings[np.lexsort((error[halvings], parts[halvings // 2]))]
    part, total = parts[halvings // 2], np.cumsum(error[halvings] ** 2)
    before = np.concatenate([[0.0], total])[np.searchsorted(part, part)]
    return halvings[total - before > allowed[part] ** 2]


def own_errors(light, found, promised, received):
    """Relative L2 errors (n surfaces,): each one's own, what of it arises there, as points found and surpluses promise,
    and what of it comes with the light from elsewhere.

    found: ((n surfaces,), (n,)), how many points told so much, squared. promised, received (n surfaces,): L2 error that
    surpluses promise; that comes with the light.
    """
    count, found2 = found
    error = np.stack([np.sqrt((count * found2 + TOLD * promised**2) / (count + TOLD)), received])
    lit = light.norm > TINY * np.linalg.norm(light.norm)
    here, passed = np.divide(error, light.norm, out=np.zeros_like(error), where=lit)
    return np.where(lit, np.hypot(here, passed), 0.0), here, passed
