"""Each surface's own error by links: what arises there, what comes with the light, and whose are looked at again."""

import copy

import numpy as np

from .. import each_surface
from ..error_estimates import leaf_errors, lengths
from ..error_flow import ONE_SIGNED, Flow, areas_of_nodes, norms

FINER = 0.25  # tolerance of the links of what is looked at, of the round's
SAFETY = 2.6  # of what samples find to what is stated: they miss penumbrae, and rounds stop where they found little
FOR_EACH = 16  # points of a surface that tell its own error, nodes that tell what its links are off by


class Own:
    """Of a SolvedLight, errors (n surfaces,): of each one's own light, relative; here, passed: what of it arises there,
    and what comes from elsewhere, before SAFETY; told, promised: in L2, what points found there, and surpluses
    promise; received (n sent nodes,) what comes from elsewhere, by flow, a Flow; node_error (n sent nodes,): in all.
    found: of each surface, what the last points looked at there told; nodes (n surfaces,): the field's then."""

    def __init__(self, light):
        self.light, self.flow, self.found = light, None, None
        self.errors = np.full(len(light.scene), np.inf)

    def under(self, light):
        """The same under another Light of the same transport."""
        new = copy.copy(self)
        new.light = light
        return new

    def nothing(self):
        """Where no light is, or none goes on."""
        self.errors, self.node_error = np.zeros(len(self.light.scene)), np.zeros(len(self.light.transport.sent.keys))

    # -- whose ---------------------------------------------------------------------------------------------------

    def too_large(self, target):
        """(n surfaces,) Whether own errors, but of the darkest, are above what they may be."""
        return (self.errors > each_surface.OWN * target) & self.light.shared.counts

    def misses(self):
        """The target that all would meet."""
        return self.errors[self.light.shared.counts].max(initial=0.0) / each_surface.OWN

    def suspects(self, target):
        """(n surfaces,) Where only own errors were too large: whose, and those refined since; the whole one is no
        larger than it was. None where all are to be looked at: an error that comes with the light may be anyone's."""
        large = self.too_large(target)
        if (self.here <= self.passed)[large].any():
            return np.zeros(len(large), bool)
        return self.light.transport.reached & (large | (self._nodes() != self.nodes))

    def looked_at(self):
        """All that are suspect."""
        self.nodes = self._nodes()

    def _nodes(self):
        """(n surfaces,) How many the field has on each."""
        return np.bincount(self.light.transport.field.node_surface, minlength=len(self.light.scene))

    # -- what they are -------------------------------------------------------------------------------------------

    def judge(self, some, at_points, check):
        """All anew, as far as `some` (n surfaces,) by what was found there now, see Check._at_points; yields."""
        light, t, areas = self.light, self.light.transport, self.light.scene.areas
        residual, sources, made, sent = at_points
        now = *residual.by_surface(areas), made.by_surface(areas)[1], sources.ratios(sent, len(areas))
        before = now if self.found is None else self.found
        self.found = [np.where(some.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in zip(now, before)]
        count, told, made, ratio = self.found
        f, error = t.field, check.optimism * lengths(light.leaf_error)
        self.promised = np.sqrt(np.bincount(f.surface[f.leaves], error[f.leaves] ** 2, len(light.scene)))
        self.told = np.sqrt(told)
        rho = light.scene.reflectance.max(axis=1)[t.sent.node_surface]
        self.flow = Flow(f, t.sent, t.rows, t.placed, rho)
        sent_error = lengths(leaf_errors(t.sent, rho[:, None] * light.lit))
        wrong = ratio[t.sent.node_surface] * light.reflectance * light.total()
        self.received = rho * (yield from self.flow.received(error, sent_error, wrong))
        received = np.hypot(norms(t.sent, self.received), ONE_SIGNED * check.one_way)
        own, self.here, self.passed = each_surface.own_errors(light.shared, (count, told), self.promised, received)
        unclosed = np.hypot(check.amplified.unclosed, np.sqrt(made))
        rest = np.hypot(check.amplified.unsolved, SAFETY * unclosed) / np.maximum(light.shared.norm, 1e-300)
        self.errors = np.where(own > 0, np.hypot(SAFETY * own, rest), 0.0)
        # where surpluses are, as large as what points found on the surface
        local = t.spread(self.flow.spread_out)[:, 0]
        found = self.here * light.shared.norm / np.maximum(norms(t.sent, local), 1e-300)
        self.node_error = np.hypot(found[t.sent.node_surface] * local, self.received)

    def linked(self, surfaces):
        """surfaces (k,) -> what their links are off by (k,), in L2: at nodes, where nothing is interpolated; yields."""
        light, f = self.light, self.light.transport.field
        order = np.argsort(f.node_surface, kind="stable")
        first, end = (np.searchsorted(f.node_surface[order], surfaces, side)[:, None] for side in ("left", "right"))
        area = np.append(0.0, np.cumsum(areas_of_nodes(f)[order]))
        at = area[first] + (area[end] - area[first]) * (np.arange(FOR_EACH) + 0.5) / FOR_EACH
        nodes = order[np.clip(np.searchsorted(area, at) - 1, first, end - 1)].ravel()
        rows = yield from light.rows_at(f.points[nodes], f.normals[nodes], f.node_surface[nodes], FINER)
        off = rows.times(light.radiosity()) - light.indirect[nodes]
        off = ((light.scene.reflectance[f.node_surface[nodes]] * off) ** 2).sum(axis=1).reshape(-1, FOR_EACH)
        return np.sqrt(off.mean(axis=1) * light.scene.areas[surfaces])
