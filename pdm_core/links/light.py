"""Light from rows: the solve, what surfaces send on, and what reading off between the nodes costs.

L = Le + rho (D + I). D comes from closed forms (direct), I = A rho (D + I) on the field's nodes with the rows A.
"""

import copy
from dataclasses import dataclass

import numpy as np

from .. import each_surface
from ..error_estimates import leaf_errors
from ..error_flow import areas_of_nodes
from ..field_values import predict, surpluses
from ..numerics import Rows, gcr
from ..plan import proportional_channels
from ..signs_of_life import finish, in_thread
from .gather import Detail
from .received import Received

EXACT_SHARE = 0.05  # of the target: what the interpolated sum of the lesser sources may cost
COARSE = 2.0  # tolerance of links that are made anew, of what would do
EXPECTED = 0.2  # of the mean light: what is expected of indirect light's range over a whole chart before it is known
CANCEL = 0.5  # of an error of either sign this part is left in the mean, which the rooms amplify


@dataclass(frozen=True)
class Precision:
    """tolerance: of one link, a radiance; strain (n surfaces,): how much finer than that at points of each, beside what
    its darkness asks for."""

    tolerance: float
    strain: np.ndarray


class SolvedLight:
    """Light of the materials of a Scene, one with the transport's shapes. lit (n sent nodes, 3): direct; indirect (n
    nodes, 3); norm: of L - Le, radiance times metres; scale: what local errors are to be small against; level: the same
    as a radiance; received, leaf_error, sent_error: see divide. exact: {surface: sources} that are not chosen anew."""

    def __init__(self, transport, scene, precision=None, exact=None):
        self.transport, self.scene, self.precision, self.exact = transport, scene, precision, exact or {}
        self.colours = np.concatenate([scene.emission[transport.lights], scene.background[None]])
        self.added = scene.emission.copy()  # of surfaces that became lights by relighting
        self.added[transport.lights] = 0.0
        self.lit = transport.fractions @ self.colours
        self.indirect = np.zeros((len(transport.field.keys), 3))
        self.channels = proportional_channels(scene)  # to solve for, and what makes all three of them
        self.iterations = 0

    def snapshot(self):
        """As it is now, whatever becomes of this one."""
        new = copy.copy(self)
        new.transport = self.transport.snapshot()
        return new

    def follow(self):
        """Where the transport has new nodes, what is known of the light there."""
        t, old = self.transport, len(self.indirect)
        if len(t.field.keys) > old:
            self.indirect = np.concatenate([self.indirect, predict(t.field, self.indirect, old)])
        if len(t.fractions) > len(self.lit):
            self.lit = t.fractions @ self.colours
            self._measure()

    # -- what is known -------------------------------------------------------------------------------------------

    @property
    def reflectance(self):
        """(n sent nodes, 3)"""
        return self.scene.reflectance[self.transport.sent.node_surface]

    @property
    def shining(self):
        """(n sent nodes, 3): what nodes of added lights send."""
        return self.added[self.transport.sent.node_surface]

    def total(self):
        """(n sent nodes, 3) irradiance / pi"""
        return self.lit + self.transport.spread(self.indirect)

    def radiosity(self):
        """(n sent nodes, 3): what the nodes send on besides the lights' uniform emission."""
        return self.reflectance * self.total() + self.shining

    def gain(self):
        """How much the rooms amplify an error spread evenly: 1 / (1 - share of the light that is indirect)."""
        t, rho, direct = self.transport, self.reflectance, self.lit
        if self.added.any():  # what has begun to shine sends its light as indirect light goes
            direct = direct + t.spread(t.rows.times(self.shining))
        share = 1 - (rho * direct).sum() / max((rho * self.total()).sum(), 1e-300)
        return 1.0 / max(1.0 - share, 1e-6)

    def _measure(self):
        """Norm of L - Le over all surfaces: sqrt of the area integral of the squared channels."""
        self.shared = each_surface.SharedLight(self.transport.sent, self.reflectance * self.total())
        self.norm = float(np.linalg.norm(self.shared.norm))
        self.caught = max(1.0, CANCEL * self.gain())
        self.scale = self.norm / self.caught
        self.level = self.scale / np.sqrt(self.transport.area)

    def mean_sent(self, value):
        """Nodal radiosity (n sent nodes, 3) -> (n reflectors, 3), the mean over each reflector."""
        t = self.transport
        value = areas_of_nodes(t.sent)[:, None] * np.column_stack([value, np.ones(len(value))])
        total = np.stack([np.bincount(t.sent.node_surface, c, len(self.scene)) for c in value.T], axis=1)[t.reflectors]
        return total[:, :3] / total[:, 3:]

    # -- rows that it asks for -----------------------------------------------------------------------------------

    def extend(self):
        """Rows for the nodes that have none, and for those whose are too coarse; yields now and then."""
        t = self.transport
        t.drop(self.coarse())
        new = t.missing()[: None if self.norm > 0 else 0]
        tolerance = self._tolerance(t.field.points[new], t.field.node_surface[new])
        yield from t.extend(new, self._detail(), tolerance)

    def coarse(self):
        """Rows (k,) whose links are too coarse by what is known of the light since."""
        t, f = self.transport, self.transport.field
        made = slice(t.rows.count)
        return np.flatnonzero(t.tolerance[made] > COARSE * self._tolerance(f.points[made], f.node_surface[made]))

    def rows_at(self, points, normals, surface, finer=1.0):
        """Rows at points, their links as fine as this light needs them or by a factor `finer`, 1 or less, more so;
        yields now and then."""
        tolerance, blocks = finer * self._tolerance(points, surface), []
        for block in self.transport.links(points, normals, surface, self._detail(), tolerance):
            blocks += [block] if block else []
            yield
        return Rows(blocks, len(points))

    def _detail(self):
        """How the sources vary, for the choice of links."""
        f, value = self.transport.sent, self.radiosity()
        variation = np.ptp(value[f.nodes], axis=1).max(axis=1)
        if not self.iterations:  # what no lamp sees will not be even: links to it from close by would be far too coarse
            expected = EXPECTED * self.level * self.scene.reflectance.max(axis=1)[f.surface]
            variation = np.maximum(variation, expected * 0.5 ** f.level.min(axis=1))
        surplus = np.abs(surpluses(f, value)).max(axis=(1, 2))
        below = np.zeros(len(f.level))
        depth = f.level.sum(axis=1)
        for level in range(depth.max(), 0, -1):
            cells = np.flatnonzero(depth == level)
            np.maximum.at(below, f.parent[cells], np.maximum(below[cells], surplus[cells]))
        low, high = np.full((len(self.scene), 3), np.inf), np.full((len(self.scene), 3), -np.inf)
        np.minimum.at(low, f.node_surface, value)
        np.maximum.at(high, f.node_surface, value)
        return Detail(variation, below, (high - low).max(axis=1))

    def _tolerance(self, points, surface):
        """Link tolerance (m,) of receivers at points (m, 3) on surfaces (m,): black ones need less, dark ones more."""
        rho = np.where(surface >= 0, self.scene.reflectance[surface].max(axis=1), 1.0)
        stress, f = np.repeat(self.precision.strain, self.transport.field.charts), self.transport.field
        if self.iterations:  # without indirect light, what no lamp sees is no darker than it will be
            stress = stress * self.shared.stress(self.level)
        return self.precision.tolerance / np.maximum(rho, 0.05) / np.append(stress, 1.0)[f.part_at(surface, points)]

    # -- solving -------------------------------------------------------------------------------------------------

    def solve(self, tolerance):
        """I = A rho (D + I) + A added, from the guess at hand; for one of each set of proportional channels; yields."""
        which, channels = self.channels
        value, steps = yield from in_thread(self._solved, which, tolerance)
        self.indirect = value @ channels
        self.iterations += steps
        self._measure()

    def _solved(self, which, tolerance):
        rho = self.reflectance[:, which]
        right = self.transport.rows.times(rho * self.lit[:, which] + self.shining[:, which])
        return (yield from gcr(self.scatter(rho), right, self.indirect[:, which], tolerance))

    def scatter(self, rho):
        """rho (n sent nodes, c) -> function of indirect light (n nodes, c): what one more reflection makes of it."""
        t = self.transport
        return lambda value: t.rows.times(rho * t.spread(value))

    def divide(self, target):
        """received: light of every surface split by source; leaf_error (n cells, 2), sent_error: estimates of what
        interpolation costs in the field, in L2, along either axis, and in what is sent, relative; yields."""
        t, value = self.transport, self.radiosity()
        received, factors = yield from self._by_source(value)
        mean = self.mean_sent(value)
        lights = np.flatnonzero(np.isin(t.reflectors, t.lights))
        sent = leaf_errors(t.sent, value)[t.sent.leaves] ** 2
        self.leaf_error, self.received = np.zeros(t.field.level.shape), []
        for s in range(len(self.scene)):
            nodes = t.field.node_surface == s
            share = max(self.scene.areas[s] / t.area, 0.5 / len(self.scene))
            own = each_surface.OWN * self.shared.norm[s] or np.inf
            allowed = EXACT_SHARE * target * min(self.scale * np.sqrt(share), own)
            part = Received(t.field, s, received[nodes], factors[nodes], mean)
            part.choose(self.scene.reflectance[s], allowed, self.exact.get(s, lights), s in self.exact)
            self.leaf_error[part.leaves] = part.leaf_error
            self.received.append(part.conform())
            yield
        self.sent_error = float(np.sqrt(sent.sum())) / max(self.norm, 1e-300)
        self.promised = self.promise(self.leaf_error)

    def promise(self, leaf_error):
        """The relative error that the leaves' (n cells, 2) come to."""
        return float(np.linalg.norm(leaf_error[self.transport.field.leaves])) / max(self.norm, 1e-300)

    def _by_source(self, value):
        """Nodal radiosity -> what each node receives from each reflector (n, s, 3), and the form factors (n, s)."""
        t = self.transport
        part = np.full(len(self.scene), -1)
        part[t.reflectors] = np.arange(len(t.reflectors))
        value = np.column_stack([value, np.ones(len(value))])
        out = yield from t.rows.times_by_part(value, part[t.sent.node_surface], len(t.reflectors))
        return out[..., :3], out[..., 3]

    # -- reading off ---------------------------------------------------------------------------------------------

    def seen(self, surface, points):
        """Transport.seen with the sources that are exact here."""
        return self.transport.seen(surface, points, [part.exact for part in self.received])

    def incident(self, surface, points):
        """points (n, 3) m near surfaces (n,) -> irradiance / pi (n, 3); direct light and the leading sources exact."""
        out = np.empty((len(points), 3))
        for s, part, lights, exact, cell, weight, covered in self.seen(surface, points):
            out[part] = lights @ self.colours + self.received[s].between(cell, weight, exact)
            out[part[covered]] = 0.0
        return out

    def in_space(self, points, normals):
        """points (n, 3) m, unit normals (n, 3) anywhere -> irradiance / pi (n, 3)"""
        free = np.full(len(points), -1)
        rows = finish(self.rows_at(points, normals, free))
        return rows.times(self.radiosity()) + self.transport.direct(points, normals, free) @ self.colours
