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
    promise; amplified: Amplified; one_way (n surfaces,): what it makes of bends, as far as they do not cancel."""

    def __init__(self, light):
        self.light, self.looks, self.flow, self.amplified = light, [], None, None
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
        light, self.looks = self.light, []
        light.transport.forget()
        some = light.norm > 0 and len(light.transport.reflectors)
        if some:
            self.amplified = yield from in_thread(Amplified, light)
        while some and len(self.looks) < LOOKS:
            yield from self._look(SEED + len(self.looks), samples)
            residual = yield from self._judge()
            if self.error <= target or not residual.hangs_on_one:
                break
        if not self.looks:
            self.nothing()
        else:
            self._learn(residual)
            self.optimism = self.parts["discretisation"] / SAFETY / max(light.promise(self.leaf_error), 1e-300)
            self.measured = True
        self.fresh = True

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

    def _look(self, seed, samples):
        """Geometry of random points whose residual tells the error: finer rows, and factors of the lights; yields."""
        light, t = self.light, self.light.transport
        shared = np.where(light.shared.counts, light.shared.norm, 0.0)
        error = lengths(self.leaf_error)
        surface, points, normals, weight = sample_points(t.field, error, shared, t.reached, samples, seed)
        rows = yield from light.rows_at(points, normals, surface, FINER)
        fractions = yield from t.received_directly(points, normals, surface)
        weight = np.where(contacts_of(t.scene).covered(points, surface), 0.0, weight)
        self.looks.append(Look(surface, points, weight, rows, fractions))

    def _judge(self):
        """Error and its parts from the points looked at -> Residual; yields."""
        light, t, found, sources, made = self.light, self.light.transport, [], [], []
        sent, amplified = t.sent, self.amplified
        every = light.radiosity() + (light.scene.emission - light.added)[sent.node_surface]
        value, held = light.radiosity(), np.concatenate([light.total(), amplified.bent], axis=1)
        for look in self.looks:
            rho = light.scene.reflectance[look.surface]
            fine = look.rows.times(value) + look.fractions @ light.colours
            # read off with the very factors that do not sum to 1
            made.append(rho * t.over(look.rows, look.fractions)[:, None] * look.rows.times(every))
            found.append(rho * (fine - light.incident(look.surface, look.points)))
            held_there = sent.interpolate(sent.locate(look.surface, sent.on.local(look.surface, look.points)), held)
            sources.append(np.stack([rho * (fine - held_there[:, :3]), rho * held_there[:, 3:]]))
            yield
        residual, made = Residual(self.looks, np.concatenate(found)), Residual(self.looks, np.concatenate(made))
        found = residual.rms / light.norm
        if self.measured:
            found = float(np.sqrt((found**2 + (self.optimism * light.promised) ** 2) / 2))
        # bends of direct and of indirect light may cancel: as far as points do not show the one's in the whole
        sources, bent = np.concatenate(sources, axis=1)
        uncancelled = min(ONE_SIGNED, Residual(self.looks, sources).share_of(bent))
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
        yield from self._each(residual, np.hypot(amplified.unclosed, np.sqrt(made.by_surface(light.scene.areas)[1])))
        return residual

    def _each(self, residual, unclosed):
        """(n surfaces,) Each one's own relative error; unclosed (n surfaces,): its part of what does not sum to 1;
        yields."""
        light, t = self.light, self.light.transport
        f, error = t.field, self.optimism * lengths(light.leaf_error)
        promised = np.sqrt(np.bincount(f.surface[f.leaves], error[f.leaves] ** 2, len(light.scene)))
        found = residual.by_surface(light.scene.areas)
        rho = light.scene.reflectance.max(axis=1)[t.sent.node_surface]
        flow = Flow(f, t.sent, t.rows, t.placed, rho)
        received = rho * (yield from flow.received(error, lengths(leaf_errors(t.sent, rho[:, None] * light.lit))))
        self.flow, self.flow_received = flow, received
        self.told, self.own_promised = np.sqrt(found[1]), promised
        received = np.hypot(norms(t.sent, received), ONE_SIGNED * self.one_way)
        own, self.own_here, self.own_passed = each_surface.own_errors(light.shared, found, promised, received)
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
