"""What light by links is off by: residuals at random points, what the scene makes of errors, each surface's own."""

import copy

import numpy as np

from .. import each_surface
from ..contacts import contacts_of
from ..error_estimates import Look, Residual, leaf_errors, lengths, sample_points, source_defect
from ..error_flow import ONE_SIGNED, Flow, areas_of_nodes, norms
from ..numerics import ROUGHLY, gmres
from ..signs_of_life import finish, in_thread
from ..tolerances import SINGLE

SEED = 20  # of the samples: runs repeat
LOOKS = 4  # sets of samples at most, where the error found hangs on one point
FINER = 0.25  # tolerance of their links, of the round's
SAFETY = 2.6  # of what samples find to what is stated: they miss penumbrae, and rounds stop where they found little
LINKED = 16  # nodes of a surface that tell what its links are off by
LEARNT = 0.2  # of an error found at a point, at least, along either axis, whatever surpluses tell of them
ROUNDED = 0.2 * SINGLE  # of the light: what single precision costs, as a row's entries are off either way


class Check:
    """The error of a SolvedLight, relative, and the named parts that make it; own_errors (n surfaces,): of each one's
    own light; node_error (n sent nodes,): where it is. fresh: whether it is of the light as it is now; leaf_error
    (n cells, 2) of the field as far as is known; optimism: error found by residuals, of the error the surpluses
    promise."""

    def __init__(self, light):
        self.light, self.looks, self.flow = light, [], None
        self.error, self.parts = float("inf"), {}
        self.own_errors = np.full(len(light.scene), np.inf)
        self.fresh, self.measured, self.optimism, self.unclosed = False, False, 1.0, 0.0

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
            yield from in_thread(self._amplify)
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
            yield from in_thread(self._amplify)
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

    def _amplify(self):
        """What the scene makes of errors of its sources and of what the solver left: solved for like light."""
        light, t, rho = self.light, self.light.transport, self.light.reflectance

        def size(error):
            return norms(t.sent, np.linalg.norm(rho * t.spread(error), axis=1))

        self.bent = source_defect(t.sent, light.lit)
        lit = t.rows.times(rho * self.bent)
        indirect = t.rows.times(rho * t.spread(source_defect(t.field, light.indirect)))
        received = t.rows.times(light.radiosity())
        unsolved = received - light.indirect
        unsolved += np.copysign(ROUNDED, unsolved.sum()) * light.indirect
        right = np.concatenate([lit, lit + indirect, unsolved, t.from_nothing(received)], axis=1)
        scatter = light.scatter(np.tile(rho, 4))
        # what is left of it may be as much of one sign as all of it is
        error = finish(gmres(scatter, right, np.zeros_like(right), ROUGHLY))[0] / (1 - ROUGHLY)
        self.own_light, self.own_bends, self.own_unsolved, self.own_unclosed = (
            size(error[:, k : k + 3]) for k in (0, 3, 6, 9)
        )
        self.amplified_light, self.unsolved, self.unclosed = (
            float(np.linalg.norm(v)) / light.norm for v in (self.own_light, self.own_unsolved, self.own_unclosed)
        )

    def _judge(self):
        """Error and its parts from the points looked at -> Residual; yields."""
        light, t, found, sources, made = self.light, self.light.transport, [], [], []
        sent = t.sent
        every = light.radiosity() + (light.scene.emission - light.added)[sent.node_surface]
        value, held = light.radiosity(), np.concatenate([light.total(), self.bent], axis=1)
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
        self.own_amplified = np.hypot(self.own_bends, uncancelled * self.own_light)
        self.amplified = float(np.linalg.norm(self.own_amplified)) / light.norm
        known = found, light.sent_error * light.norm / light.scale
        # solved for, and stated as they are. Amplified beyond what is found at points, where errors of either sign
        # are: between white planes 1.06 to 5 times the true one
        stiff = float(np.sqrt(max(self.amplified**2 - sum(known) ** 2, 0.0)))
        self.parts = {
            "discretisation": SAFETY * known[0],
            "gather": SAFETY * light.gain() * residual.mean / light.norm,
            "sent": SAFETY * known[1],
            "closure": SAFETY * float(np.hypot(self.unclosed, made.rms / light.norm)),
        }
        # where light is caught these are of one pattern and of one sign: they add up
        self.error = float(np.hypot(np.linalg.norm(list(self.parts.values())), stiff + self.unsolved))
        self.parts |= {"stiff": stiff, "solver": self.unsolved}
        yield from self._each(residual, np.hypot(self.own_unclosed, np.sqrt(made.by_surface(light.scene.areas)[1])))
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
        received = np.hypot(norms(t.sent, received), ONE_SIGNED * self.own_amplified)
        own, self.own_here, self.own_passed = each_surface.own_errors(light.shared, found, promised, received)
        rest = np.hypot(self.own_unsolved, SAFETY * unclosed) / np.maximum(light.shared.norm, 1e-300)
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
