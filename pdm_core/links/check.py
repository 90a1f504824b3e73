"""What light by links is off by: residuals at random points, what the scene makes of errors, each surface's own."""

import copy

import numpy as np

from .. import each_surface
from ..contacts import contacts_of
from ..error_estimates import Look, Residual, leaf_errors, lengths, sample_points
from ..error_flow import ONE_SIGNED, Flow, areas_of_nodes, norms
from ..signs_of_life import in_thread
from .amplified import Amplified

SEED = 20  # of the samples: runs repeat
LOOKS = 4  # sets of samples at most, where the error found hangs on one point
FINER = 0.25  # tolerance of their links, of the round's
SAFETY = 2.6  # of what samples find to what is stated: they miss penumbrae, and rounds stop where they found little
LINKED = 16  # nodes of a surface that tell what its links are off by
LEARNT = 0.2  # of an error found at a point, at least, along either axis, whatever surpluses tell of them


class Check:
    """The error of a SolvedLight, relative, and the named parts that make it; own_errors (n surfaces,): of each one's
    own light; node_error (n sent nodes,): where it is. fresh: whether it is of the light as it is now; leaf_error
    (n cells, 2) of the field as far as is known; optimism: error found by residuals, of the error the surpluses
    promise; amplified: Amplified; one_way (n surfaces,): what it makes of bends, as far as they do not cancel; found:
    of each surface, what the last points looked at there told, see _each; nodes (n surfaces,): the field's then."""

    def __init__(self, light):
        self.light, self.looks, self.flow, self.amplified, self.found = light, [], None, None, None
        self.error, self.parts = float("inf"), {}
        self.own_errors = np.full(len(light.scene), np.inf)
        self.fresh, self.measured, self.optimism = False, False, 1.0

    def snapshot(self):
        """As it is now, whatever becomes of this one."""
        new = self.under(self.light.snapshot())
        new.flow = None  # it holds rows
        return new

    def under(self, light):
        """The same looks at another Light of the same transport."""
        new = copy.copy(self)
        new.light = light
        return new

    def promise(self):
        """The relative error that surpluses of a new solution promise, before any look at it."""
        light = self.light
        self.fresh, self.leaf_error = False, light.leaf_error
        return SAFETY * self.optimism * light.promised * light.norm / max(light.scale, 1e-300)

    def measure(self, target, samples):
        """Relative error of the light, from the residual at random points, so many a look; yields."""
        light = self.light
        light.transport.forget()
        if not (light.norm > 0 and len(light.transport.reflectors)):
            self.looks = []
            self.nothing()
        elif (some := self._suspects(target)).any():
            look = yield from self._look(SEED, min(samples, LINKED * some.sum()), some)
            at_points = yield from self._at_points([look])
            self._learn(at_points[0])
            yield from self._each(some, at_points)
        else:
            self.looks, self.amplified = [], (yield from in_thread(Amplified, light))
            while len(self.looks) < LOOKS:
                self.looks.append((yield from self._look(SEED + len(self.looks), samples, light.transport.reached)))
                residual = yield from self._judge()
                if self.error <= target or not residual.hangs_on_one:
                    break
            self._learn(residual)
            self.optimism = self.parts["discretisation"] / SAFETY / max(light.promise(self.leaf_error), 1e-300)
            self.measured = True
        self.fresh, self.nodes = True, self._nodes()

    def _suspects(self, target):
        """(n surfaces,) Where only own errors were too large: whose, and those refined since; the whole one is no
        larger than it was. None where all are to be looked at: an error that comes with the light may be anyone's."""
        large = self.too_large(target)
        if not self.measured or self.error > target or (self.own_here <= self.own_passed)[large].any():
            return np.zeros(len(large), bool)
        return self.light.transport.reached & (large | (self._nodes() != self.nodes))

    def _nodes(self):
        """(n surfaces,) How many the field has on each."""
        return np.bincount(self.light.transport.field.node_surface, minlength=len(self.light.scene))

    def again(self):
        """The error at the same points, under other light; yields."""
        if self.looks and self.light.norm > 0:
            self.amplified = yield from in_thread(Amplified, self.light)
            yield from self._judge()
        elif not self.light.norm > 0:
            self.nothing()

    def nothing(self):
        """Where no light is, or none goes on."""
        self.error, self.parts, self.own_errors = 0.0, {}, np.zeros(len(self.light.scene))
        self.node_error = np.zeros(len(self.light.transport.sent.keys))

    # -- how it is found -----------------------------------------------------------------------------------------

    def _look(self, seed, samples, some):
        """Look at random points of some surfaces (n,): finer rows, and factors of the lights; yields."""
        light, t = self.light, self.light.transport
        shared = np.where(light.shared.counts, light.shared.norm, 0.0)
        error = lengths(self.leaf_error)
        surface, points, normals, weight = sample_points(t.field, error, shared, some, samples, seed)
        rows = yield from light.rows_at(points, normals, surface, FINER)
        fractions = yield from t.received_directly(points, normals, surface)
        weight = np.where(contacts_of(t.scene).covered(points, surface), 0.0, weight)
        return Look(surface, points, weight, rows, fractions)

    def _at_points(self, looks):
        """Residuals at the points looked at: of the light there, of what is sent from there, and what rows made there;
        and the light sent (k, 3); yields."""
        light, t, out = self.light, self.light.transport, []
        every = light.radiosity() + (light.scene.emission - light.added)[t.sent.node_surface]
        value, total = light.radiosity(), light.total()
        for look in looks:
            rho = light.scene.reflectance[look.surface]
            fine = look.rows.times(value) + look.fractions @ light.colours
            sent = t.sent.interpolate(t.sent.locate(look.surface, t.sent.on.local(look.surface, look.points)), total)
            # read off with the very factors that do not sum to 1
            made = t.over(look.rows, look.fractions)[:, None] * look.rows.times(every)
            out.append(rho * np.stack([fine - light.incident(look.surface, look.points), fine - sent, made, sent]))
            yield
        *wrong, sent = np.concatenate(out, axis=1)
        return *(Residual(looks, value) for value in wrong), sent

    def _judge(self):
        """Error and its parts from the points looked at -> Residual; yields."""
        light, amplified = self.light, self.amplified
        at_points = residual, sources, made, _ = yield from self._at_points(self.looks)
        found = residual.rms / light.norm
        if self.measured:
            found = float(np.sqrt((found**2 + (self.optimism * light.promised) ** 2) / 2))
        # bends of direct and of indirect light may cancel: as far as points do not show the one's in the whole
        sent, own = light.transport.sent, residual.surface
        bent = sent.interpolate(sent.locate(own, sent.on.local(own, residual.points)), amplified.bent)
        uncancelled = min(ONE_SIGNED, sources.share_of(light.scene.reflectance[own] * bent))
        self.one_way = np.hypot(amplified.bends, uncancelled * amplified.direct)
        one_way = self.of_light(self.one_way)
        known = found, light.sent_error * light.norm / light.scale
        # solved for, and stated as they are. Amplified beyond what is found at points, where errors of either sign
        # are: between white planes 1.06 to 5 times the true one
        stiff = float(np.sqrt(max(one_way**2 - sum(known) ** 2, 0.0)))
        self.parts = {
            "discretisation": SAFETY * known[0],
            "gather": SAFETY * light.gain() * residual.mean / light.norm,
            "sent": SAFETY * known[1],
            "closure": SAFETY * float(np.hypot(self.of_light(amplified.unclosed), made.rms / light.norm)),
        }
        unsolved = self.of_light(amplified.unsolved)
        # where light is caught these are of one pattern and of one sign: they add up
        self.error = float(np.hypot(np.linalg.norm(list(self.parts.values())), stiff + unsolved))
        self.parts |= {"stiff": stiff, "solver": unsolved}
        yield from self._each(np.ones(len(light.scene), bool), at_points)
        return residual

    def _each(self, some, at_points):
        """(n surfaces,) Each one's own relative error, as far as `some` (n surfaces,) by what was found there now, see
        _at_points; yields."""
        light, t, areas = self.light, self.light.transport, self.light.scene.areas
        residual, sources, made, sent = at_points
        now = *residual.by_surface(areas), made.by_surface(areas)[1], sources.ratios(sent, len(areas))
        before = now if self.found is None else self.found
        self.found = [np.where(some.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in zip(now, before)]
        count, told, made, ratio = self.found
        f, error = t.field, self.optimism * lengths(light.leaf_error)
        promised = np.sqrt(np.bincount(f.surface[f.leaves], error[f.leaves] ** 2, len(light.scene)))
        rho = light.scene.reflectance.max(axis=1)[t.sent.node_surface]
        flow = Flow(f, t.sent, t.rows, t.placed, rho)
        sent_error = lengths(leaf_errors(t.sent, rho[:, None] * light.lit))
        wrong = ratio[t.sent.node_surface] * light.reflectance * light.total()
        received = rho * (yield from flow.received(error, sent_error, wrong))
        self.flow, self.flow_received = flow, received
        self.told, self.own_promised = np.sqrt(told), promised
        received = np.hypot(norms(t.sent, received), ONE_SIGNED * self.one_way)
        own, self.own_here, self.own_passed = each_surface.own_errors(light.shared, (count, told), promised, received)
        unclosed = np.hypot(self.amplified.unclosed, np.sqrt(made))
        rest = np.hypot(self.amplified.unsolved, SAFETY * unclosed) / np.maximum(light.shared.norm, 1e-300)
        self.own_errors = np.where(own > 0, np.hypot(SAFETY * own, rest), 0.0)
        # where surpluses are, as large as what points found on the surface
        local = t.spread(flow.spread_out)[:, 0]
        found = self.own_here * light.shared.norm / np.maximum(norms(t.sent, local), 1e-300)
        self.node_error = np.hypot(found[t.sent.node_surface] * local, self.flow_received)

    def _learn(self, residual):
        """Leaves whose residual is larger than their surplus promised, and their siblings, are to be refined."""
        f = self.light.transport.field
        cells = f.locate(residual.surface, f.on.local(residual.surface, residual.points))[0]
        found = np.linalg.norm(residual.value, axis=1)
        family, whose = f.siblings(cells)
        error = found[whose] * np.sqrt(f.sizes()[family]) * (f.child[family] < 0)
        known = self.leaf_error[family] + LEARNT * lengths(self.leaf_error[family])[:, None] + 1e-300
        self.leaf_error = self.leaf_error.copy()
        np.maximum.at(self.leaf_error, family, error[:, None] * known / lengths(known)[:, None])

    def linked(self, surfaces):
        """surfaces (k,) -> what their links are off by (k,), in L2: at nodes, where nothing is interpolated; yields."""
        light, f = self.light, self.light.transport.field
        order = np.argsort(f.node_surface, kind="stable")
        first, end = (np.searchsorted(f.node_surface[order], surfaces, side)[:, None] for side in ("left", "right"))
        area = np.append(0.0, np.cumsum(areas_of_nodes(f)[order]))
        at = area[first] + (area[end] - area[first]) * (np.arange(LINKED) + 0.5) / LINKED
        nodes = order[np.clip(np.searchsorted(area, at) - 1, first, end - 1)].ravel()
        rows = yield from light.rows_at(f.points[nodes], f.normals[nodes], f.node_surface[nodes], FINER)
        off = rows.times(light.radiosity()) - light.indirect[nodes]
        off = ((light.scene.reflectance[f.node_surface[nodes]] * off) ** 2).sum(axis=1).reshape(-1, LINKED)
        return np.sqrt(off.mean(axis=1) * light.scene.areas[surfaces])

    # -- what it says --------------------------------------------------------------------------------------------

    def of_light(self, each):
        """What each surface's part (n surfaces,), in L2, comes to, relative to the light."""
        return float(np.linalg.norm(each)) / self.light.norm

    def largest(self, name):
        """Whether that part of the error is, or any other is larger than it."""
        return self.parts.get(name, 0.0) >= max((v for k, v in self.parts.items() if k != name), default=np.inf)

    def misses(self):
        """The target that would be met, by the whole scene's light and each surface's own."""
        return max(self.error, self.own_errors[self.light.shared.counts].max(initial=0.0) / each_surface.OWN)

    def too_large(self, target):
        """(n surfaces,) Whether own errors, but of the darkest, are above what they may be."""
        return (self.own_errors > each_surface.OWN * target) & self.light.shared.counts

    def met(self, target):
        """Whether the whole error and each surface's own are what they may be."""
        return self.error <= target and not self.too_large(target).any()
