"""Where errors of the light go: what each place receives of them, and which cells the error of some places comes from.

An error at a source is light that is not there: it is sent on and reflected as light is, through the same rows, and the
transposed rows tell where it came from.
"""

import numpy as np

from .error_estimates import about_nodes
from .numerics import ROUGHLY, gcr

ONE_SIGNED = 0.3  # part of a cell's error that is of one sign, and goes on as light does


class Flow:
    """Errors of a field and of what is sent, through the rows A (n nodes, n sent nodes); placed: the cells of the field
    (n sent nodes,) and weights (n sent nodes, 9) that interpolate it there; rho (n sent nodes,) reflectance."""

    def __init__(self, field, sent, rows, placed, rho):
        self.field, self.sent, self.rows, self.rho = field, sent, rows, rho[:, None]
        self.placed = placed

    def received(self, leaf_error, sent_error, wrong):
        """L2 errors (n cells,), radiance times metres, of the field and of what is sent, and what is known to be sent
        wrongly (n sent nodes, 3) -> (n sent nodes,) the error of incident light that they make elsewhere; yields."""
        self.spread_out = density(self.field, leaf_error)
        source = ONE_SIGNED * self._spread(self.spread_out) + density(self.sent, sent_error)
        right = self.rows.times(np.concatenate([source, wrong], axis=1))
        scatter = lambda value: self.rows.times(self.rho * self._spread(value))  # noqa: E731
        error = (yield from gcr(scatter, right, right, ROUGHLY))[0]
        return np.linalg.norm(self._spread(error), axis=1)

    def blame(self, weight, error):
        """weight (n sent nodes,) of the errors received, L2 errors (n cells, 2) of the field -> (n cells, 2) what each
        leaf makes of their weighted sum; yields."""
        weight = self._gathered(weight[:, None])
        scatter_back = lambda value: self._gathered(self.rho * self._back(value))  # noqa: E731
        adjoint = (yield from gcr(scatter_back, weight, weight, ROUGHLY))[0]
        sensitivity = ONE_SIGNED * self._gathered(self._back(adjoint))
        field, leaves = self.field, self.field.leaves
        each = sensitivity[:, 0] / np.maximum(areas_of_nodes(field), 1e-300)
        out = np.zeros(error.shape)
        # its density times the integral of the sensitivity, as `density` shares it out
        share = np.sqrt(field.sizes()[leaves]) * each[field.nodes[leaves]].mean(axis=1)
        out[leaves] = np.abs(error[leaves] * share[:, None])
        return out

    def _spread(self, value):
        return self.field.interpolate(self.placed, value)

    def _gathered(self, value):
        cell, weight = self.placed
        nodes = self.field.nodes.take(cell, axis=0)
        return np.bincount(nodes.ravel(), (weight * value).ravel(), len(self.field.keys))[:, None]

    def _back(self, value):
        return self.rows.times_transposed(value, len(self.rho))


def density(field, leaf_error):
    """L2 errors (n cells,) of the leaves -> (n nodes, 1) error of the radiance, mean of the leaves about each node."""
    leaves = field.leaves
    # an L2 error is its density times the root of the area
    return about_nodes(field, (leaf_error[leaves] / np.sqrt(field.sizes()[leaves]))[:, None])


def areas_of_nodes(field):
    """(n nodes,) m^2 that each stands for: a ninth of the leaves about it."""
    leaves = field.leaves
    return np.bincount(field.nodes[leaves].ravel(), np.repeat(field.sizes()[leaves] / 9, 9), len(field.keys))


def norms(field, value):
    """(n nodes,) -> (n surfaces,) L2 norm over each surface"""
    leaves = field.leaves
    square = field.sizes()[leaves] * (value[field.nodes[leaves]] ** 2).mean(axis=1)
    return np.sqrt(np.bincount(field.surface[leaves], square, len(field.charts)))
