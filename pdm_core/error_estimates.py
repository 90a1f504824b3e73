"""How far the solution is from the truth: surpluses of the field, residuals where nothing was enforced."""

from dataclasses import dataclass

import numpy as np

from .field_values import by_axis, inherited, surpluses
from .read_off import drawn

DECAY = 0.35  # a leaf's own error, of the surplus its nodes showed, where nothing is known of its parent's
SMOOTH, ROUGH = 0.125, 0.6  # bounds of that ratio, observed from parent to child: smooth fields 1/8, kinks 1/2
# mean of a biquadratic that is 0 at the corners, Simpson's, as parts of either axis: half of what is more in the middle
BENDS = np.array([(0, -4, 0, 8, 8, 8, 0, -4, 0), (0, 8, 0, -4, 8, -4, 0, 8, 0)]) / 36
LONE = 0.3  # part of the square of the error found that one point may make
SOURCE = 0.15  # weight of a leaf's direct light as a source of indirect light elsewhere


def leaf_errors(field, value):
    """Nodal radiance (n, 3) -> (n cells, 2) estimated L2 error that each cell, as a source, makes elsewhere, as light
    bends along either axis."""
    size = np.sqrt(by_axis(field, (surpluses(field, value) ** 2).sum(axis=2)))
    return SOURCE * size * decay(field, np.arange(len(size)), size) * np.sqrt(field.sizes())[:, None]


def lengths(errors):
    """L2 errors (n, 2) along both axes -> (n,) in all"""
    return np.hypot(errors[:, 0], errors[:, 1])


def source_defect(field, value):
    """Nodal radiance (n, 3) -> (n, 3) its expected error as a source, mean over the leaves about each node: of one sign
    over a bend, so that it adds up where light goes to and fro, unlike errors at points."""
    return about_nodes(field, bends(field, value).sum(axis=1))


def about_nodes(field, mean):
    """mean (n leaves, c) -> (n nodes, c) its mean over the leaves about each node, by their areas"""
    leaves, count = field.leaves, len(field.keys)
    nodes, area = np.ravel(field.nodes[leaves]), field.sizes()[leaves]
    weight = np.bincount(nodes, np.repeat(area, 9), count)
    total = [np.bincount(nodes, np.repeat(area * row, 9), count) for row in mean.T]
    return np.stack(total, axis=1) / np.maximum(weight, 1e-300)[:, None]


def bends(field, value):
    """Nodal radiance (n, 3) -> (n leaves, 2, 3) the expected mean error of its interpolant over each leaf, as it bends
    along either axis."""
    surplus, leaves = surpluses(field, value), field.leaves
    size = np.sqrt(by_axis(field, (surplus**2).sum(axis=2)))
    mean = inherited(field, np.einsum("ak,nkc->nac", BENDS, surplus))
    return mean[leaves] * decay(field, leaves, size)[:, :, None]


def decay(field, cells, size):
    """Surpluses size (n cells, 2) along both axes, 0 where not known -> (len(cells), 2) how much smaller the next ones
    are expected."""
    made, axis = field.made[cells], np.arange(2)
    parent = field.parent[made]
    before = field.made[parent, axis]
    above = np.where((parent >= 0) & (field.parent[before] >= 0), size[before, axis], 0.0)
    ratio = np.divide(size[cells], above, out=np.full(made.shape, DECAY), where=above > 0)
    return np.clip(ratio, SMOOTH, ROUGH)


def sample_points(field, leaf_error, light, reached, count, seed):
    """Random points for the residual: surface (k,), points, normals (k, 3) and weights (k,) m^2 of an unbiased mean.

    A fifth each is spread over the area, where the error is expected, in all and against each surface's own light
    (n surfaces,), 0 where that does not count, and evenly over the surfaces and the leaves, lest one point in a small
    place should stand for more than that; only where light comes to (reached, per surface).
    seed: fixed by the caller so that runs repeat.
    """
    rng = np.random.default_rng(seed)
    leaves = field.leaves[reached[field.surface[field.leaves]]]
    area, error, own = field.sizes()[leaves], leaf_error[leaves] ** 2, field.surface[leaves]
    total = np.bincount(own, area, len(reached))
    share = area / area.sum() + area / total[own] / reached.sum() + 1 / len(leaves)
    relative = np.divide(error, light[own] ** 2, out=np.zeros_like(error), where=light[own] > 0)
    for expected in (error, relative):
        share += expected / max(expected.sum(), 1e-300)
    share /= share.sum()
    pick = drawn(share, count, rng)
    points, normals = field.place(leaves[pick], rng.random((count, 2)))
    return own[pick], points, normals, area[pick] / (share[pick] * count)


@dataclass
class Look:
    """Geometry of k random points: surface (k,), points (k, 3), weight (k,) m^2 of an unbiased mean, finer rows of
    the indirect operator, fractions (k, lights + 1) of direct light."""

    surface: np.ndarray
    points: np.ndarray
    weight: np.ndarray
    rows: object
    fractions: np.ndarray


class Residual:
    """What several looks found, value (k, 3): its L2 norm over the surfaces, and that of its mean."""

    def __init__(self, looks, value):
        self.value = value
        self.surface = np.concatenate([look.surface for look in looks])
        self.points = np.concatenate([look.points for look in looks])
        weight = np.concatenate([look.weight for look in looks]) / len(looks)
        part = weight * (value**2).sum(axis=1)
        self.rms = float(np.sqrt(part.sum()))
        self.mean = float(np.linalg.norm(weight @ value) / np.sqrt(weight.sum()))
        self.hangs_on_one = part.max() > LONE * part.sum()
        self._weight, self._part = weight, part

    def share_of(self, pattern):
        """How much of a pattern (k, 3) the values hold, by least squares: at most, within the deviation of so few."""
        square, product = (pattern**2).sum(axis=1), (pattern * self.value).sum(axis=1)
        whole = max(self._weight @ square, 1e-300)
        share = self._weight @ product / whole
        return abs(share) + np.linalg.norm(self._weight * (product - share * square)) / whole

    def ratios(self, light, count):
        """(n surfaces, 3) The sum over each, of so many, as part of that of its light (k, 3): that of all together, and
        what each one's differs from it by, but for what may be chance."""
        each = lambda value: np.stack([np.bincount(self.surface, row, count) for row in value.T], axis=1)  # noqa: E731
        weight, points = self._weight[:, None], np.bincount(self.surface, minlength=count)[:, None]
        wrong, whole = each(weight * self.value), each(weight * light)
        ratio = np.divide(wrong, whole, out=np.zeros_like(whole), where=whole > 0)
        rest = each((weight * (self.value - ratio[self.surface] * light)) ** 2) * points / np.maximum(points - 1, 1)
        chance2 = np.divide(rest, whole**2, out=np.zeros_like(whole), where=whole > 0)
        mean = wrong.sum(axis=0) / np.maximum(whole.sum(axis=0), 1e-300)
        apart = ratio - mean
        return mean + np.sign(apart) * np.sqrt(np.maximum(apart**2 - chance2, 0.0))

    def by_surface(self, areas):
        """areas (n surfaces,) m^2 -> how many points lie on each, and the square of its L2 norm, as they tell (n,)"""
        count, weight, part = (
            np.bincount(self.surface, w, len(areas)) for w in (np.ones(len(self.surface)), self._weight, self._part)
        )
        return count, areas * part / np.maximum(weight, 1e-300)
