"""What light by links is off by: residuals at random points, and what the scene makes of errors."""

import copy

import numpy as np

from ..contacts import contacts_of
from ..error_estimates import Look, Residual, lengths, sample_points
from ..error_flow import ONE_SIGNED
from ..signs_of_life import in_thread
from .amplified import Amplified
from .own import FINER, FOR_EACH, SAFETY, Own

SEED = 20  # of the samples: runs repeat
LOOKS = 4  # sets of samples at most, where the error found hangs on one point
LEARNT = 0.2  # of an error found at a point, at least, along either axis, whatever surpluses tell of them


class Check:
    """The error of a SolvedLight, relative, and the named parts that make it; own: Own, of each surface's light.
    fresh: whether it is of the light as it is now; leaf_error (n cells, 2) of the field as far as is known; optimism:
    error found by residuals, of the error the surpluses promise; amplified: Amplified; one_way (n surfaces,): what it
    makes of bends, as far as they do not cancel."""

    def __init__(self, light):
        self.light, self.looks, self.amplified, self.own = light, [], None, Own(light)
        self.error, self.parts = float("inf"), {}
        self.fresh, self.measured, self.optimism = False, False, 1.0

    def snapshot(self):
        """As it is now, whatever becomes of this one."""
        new = self.under(self.light.snapshot())
        new.own.flow = None  # it holds rows
        return new

    def under(self, light):
        """The same looks at another Light of the same transport."""
        new = copy.copy(self)
        new.light, new.own = light, self.own.under(light)
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
        elif self.measured and self.error <= target and (some := self.own.suspects(target)).any():
            look = yield from self._look(SEED, min(samples, FOR_EACH * some.sum()), some)
            at_points = yield from self._at_points([look])
            self._learn(at_points[0])
            yield from self.own.judge(some, at_points, self)
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
        self.own.looked_at()
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
        self.error, self.parts = 0.0, {}
        self.own.nothing()

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
        yield from self.own.judge(np.ones(len(light.scene), bool), at_points, self)
        return residual

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

    # -- what it says --------------------------------------------------------------------------------------------

    def of_light(self, each):
        """What each surface's part (n surfaces,), in L2, comes to, relative to the light."""
        return float(np.linalg.norm(each)) / self.light.norm

    def largest(self, name):
        """Whether that part of the error is, or any other is larger than it."""
        return self.parts.get(name, 0.0) >= max((v for k, v in self.parts.items() if k != name), default=np.inf)

    def misses(self):
        """The target that would be met, by the whole scene's light and each surface's own."""
        return max(self.error, self.own.misses())

    def met(self, target):
        """Whether the whole error and each surface's own are what they may be."""
        return self.error <= target and not self.own.too_large(target).any()
