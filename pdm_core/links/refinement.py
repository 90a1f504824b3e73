"""Where to spend more: which cells are split, which rows made anew, and how well is solved, from what a Check found."""

import numpy as np

from .. import each_surface
from ..error_estimates import bends, leaf_errors, lengths
from ..error_flow import areas_of_nodes, norms
from ..gaps import crowded
from .light import Precision
from .own import SAFETY

LINK_SHARE, MANY = 0.2, 0.0025  # tolerance of one link, of the round's target; below that one links are many: less
NOISY = 1.2  # error found, of the error the surpluses promise, that only links can make
SENT_SHARE = 0.15  # of the target: what direct light between the nodes may cost as it is sent on
LIGHT_NODES = 0.6  # of the memory: what direct light may take, lest none be left for the rest
CONTACT_SHARE = 2.0  # cells near contacts are no smaller than a square whose whole light is this part of the target
# target that contacts of spheres are resolved for in any case: the dark about a point of contact is caught light, of
# which residuals show an eighth
CONTACT_LEAST = 0.0125
FLAT = 0.133  # of that size in gaps between planes, which are as large as they
CONTACT_OWN = 6.0  # sides of a square as large as the smaller of the two shapes: the same of its own light
SURE = 0.7  # lower than what was found asks for: the halves of what is split, and the rest, have errors of their own
MOST_STRAIN = 16.0  # how much finer links get there
LENIENT = 3.0  # surpluses alone promise too much in gaps: what is found there decides
LESS = 0.8  # of what did not close is left after a round that helped
HALVED = 0.5  # of the error expected on a surface, or of links', what is left where that is too large
STRAIGHTER = 0.3  # part of the bends of the sources that a refinement leaves, where they are most of the error
NEXT, UNTOLD = 0.3, 0.2  # of a cell's error along one axis: that along the other is halved as well; that of a root
REFINE_TO = 0.9 / SAFETY  # of the target: what a refinement leaves in the leaves not split


class Refinement:
    """Of a Check's light and its transport, towards one target after another. strain (n surfaces,): how much finer
    links are there; cramped: whether less was refined than asked for, lest the memory get full."""

    def __init__(self, check):
        self.check, self.light, self.transport = check, check.light, check.light.transport
        self.strain = np.ones(len(self.light.scene))
        self.link_target, self.sharpness = None, 1.0
        self.cramped, self.unclosed = False, np.inf

    # -- before the rows -----------------------------------------------------------------------------------------

    def light_up(self, target, final):
        """Refine where shapes touch, and `sent` until direct light is sent on well enough for `final`; yields."""
        light, t = self.light, self.transport
        while 0 < len(halvings := self._crowded(target)) <= t.room(LIGHT_NODES):
            yield from self._split(halvings)
            yield
        while True:
            error = leaf_errors(t.sent, light.reflectance * light.lit)
            halvings = _worst(t.sent, error, SENT_SHARE * final * light.scale)
            if self.check.measured:
                own = light.shared.allowed(SENT_SHARE * final / light.caught)
                halvings = np.union1d(halvings, each_surface.worst_of_parts(t.sent, error, own, t.sent.part))
            halvings = _ordered(t.sent, error, halvings)
            room = t.room(LIGHT_NODES)
            if not min(len(halvings), room):
                break
            yield from self._grow(halvings[-room:])  # the worst come last
            yield
        if final != self.link_target:
            self.link_up(final)

    def _crowded(self, target):
        """Halvings of the field where shapes touch."""
        t = self.transport
        own = np.sqrt([shape.area for shape in t.scene.shapes])
        share = CONTACT_SHARE * min(target, CONTACT_LEAST)
        flat = FLAT * target / min(target, CONTACT_LEAST)
        smallest = share * np.sqrt(t.area)
        return crowded(t.field, np.minimum(smallest, share * CONTACT_OWN * own), flat, t.reached)

    def link_up(self, target):
        """Drop all rows; those to come have links fit for `target`."""
        self.transport.drop()
        self.link_target, level = target, self.light.level
        tolerance = LINK_SHARE * min(1.0, np.sqrt(target / MANY)) * self.sharpness * target * level
        self.light.precision = Precision(tolerance, self.strain)

    # -- after a check -------------------------------------------------------------------------------------------

    def improve(self, target, last):
        """Whatever helps most towards the target, the last or not; False where nothing does; yields."""
        if self.check.fresh:
            before, self.unclosed = self.unclosed, self.check.of_light(self.check.amplified.unclosed)
            # what rows make from nothing, where shapes run through each other, finer cells and links do not mend
            if SAFETY * self.unclosed > target and self.unclosed > LESS * before:
                return False
        # where only some surface's own error is too large, what helps is local
        whole = not self.check.fresh or self.check.error > target
        if whole and ((yield from self._straighten()) or self._sharpen()):
            return True
        tightened = last and (yield from self._tighten(target))
        return (yield from self._refine(target)) or tightened

    def _straighten(self):
        """Where errors that the scene amplifies are most of all: split the cells, of direct light or of the field, over
        which the sources bend; False where not, or where there is no more to gain; yields."""
        check, light, t = self.check, self.light, self.transport
        if not (check.fresh and check.largest("stiff")):
            return False
        direct = np.linalg.norm(check.amplified.direct) > np.linalg.norm(check.one_way) / 2
        f, value = (t.sent, light.lit) if direct else (t.field, light.indirect)
        bend = bends(f, light.scene.reflectance[f.node_surface] * value)
        part = np.zeros(f.level.shape)
        # they add up, not their squares
        part[f.leaves] = np.sqrt(np.linalg.norm(bend, axis=2) * f.sizes()[f.leaves][:, None])
        halvings = _worst(f, part, np.sqrt(STRAIGHTER) * np.linalg.norm(part))
        room = t.room(LIGHT_NODES if direct else 1.0)
        if not min(len(halvings), room):
            return False
        if direct:
            yield from self._grow(halvings[-room:])
            self.link_up(self.link_target)
        else:
            yield from self._split(halvings[-room:])
        return True

    def _sharpen(self):
        """All rows anew with finer links where they are most of the error: all off to one side, or no less where the
        surpluses have become small; False where not."""
        parts = self.check.parts
        one_sided = parts.get("gather", 0.0) >= max(parts.get("discretisation", 0.0), parts.get("sent", 0.0))
        if not self.check.fresh or not (one_sided or self.check.optimism > NOISY):
            return False
        self.sharpness *= HALVED
        self.link_up(self.link_target)
        return True

    def _tighten(self, target):
        """Rows anew with finer links on the surfaces whose own errors are too large, and larger than surpluses promise,
        because of them; False where there are none; yields."""
        if self.cramped or not self.check.fresh:
            return False
        mended = self._to_mend(target)
        own = self.check.own
        noisy = own.told[mended] > NOISY * own.promised[mended]
        mended = mended[noisy & (self.strain[mended] < MOST_STRAIN)]
        if len(mended):
            linked = yield from own.linked(mended)
            mended = mended[linked > HALVED * own.told[mended]]
        if not len(mended):
            return False
        self.strain = self.strain.copy()  # best solutions keep theirs
        self.strain[mended] /= HALVED
        self.transport.drop(np.flatnonzero(np.isin(self.transport.field.node_surface, mended)))
        self.light.precision = Precision(self.light.precision.tolerance, self.strain)
        return True

    def _refine(self, target):
        """Split the leaves that hold most of the estimated error; False where nothing is left to split; yields."""
        check, f = self.check, self.transport.field
        error, allowed = np.clip(check.optimism, 0.5, 2.0) * check.leaf_error, REFINE_TO * target * self.light.scale
        if check.fresh:  # what was found has to fall by so much, however little was promised, if it is too large
            fall = SURE * target / check.error * np.linalg.norm(error[f.leaves])
            allowed = min(allowed, fall) if check.error > target else np.inf
        own = LENIENT * self.light.shared.allowed(REFINE_TO * target / self.light.caught)
        halvings = np.union1d(_worst(f, error, allowed), each_surface.worst_of_parts(f, error, own, f.part))
        if check.fresh and len(mended := self._to_mend(target)):
            found = np.sqrt(np.bincount(f.surface[f.leaves], lengths(error[f.leaves]) ** 2, len(self.light.scene)))
            own = np.full(len(found), np.inf)
            own[mended] = SURE * each_surface.OWN * target / (SAFETY * check.own.here[mended]) * found[mended]
            halvings = np.union1d(halvings, each_surface.worst_of_parts(f, error, own, f.surface))
        if check.fresh:
            halvings = np.union1d(halvings, (yield from self._blamed(target)))
        if not len(halvings):
            return False
        halvings, room = _ordered(f, error, halvings), self.transport.room()
        if room < len(halvings):
            self.cramped = True
            halvings = halvings[max(len(halvings) - room, 0) :]  # the worst come last
        if room > 0:
            yield from self._split(halvings)
        return room > 0

    def _to_mend(self, target):
        """Surfaces (k,) where own errors arise that are too large."""
        own = self.check.own
        return np.flatnonzero(own.too_large(target) & (own.here > SURE * each_surface.OWN * target / SAFETY))

    def _blamed(self, target):
        """Halvings of the field whose errors, passed on with the light, make own errors elsewhere too large; yields."""
        own, light, t = self.check.own, self.light, self.transport
        far = own.too_large(target) & (own.passed > SURE * each_surface.OWN * target / SAFETY)
        if not far.any():
            return np.zeros(0, int)
        at, norm = t.sent.node_surface, np.maximum(light.shared.norm, 1e-300)
        # of each surface's own error, an L2 norm, by the error received at each node
        weight = areas_of_nodes(t.sent) * own.received / np.maximum(own.passed * norm**2, 1e-300)[at]
        rho = light.scene.reflectance.max(axis=1)[at]
        f, error = t.field, light.leaf_error
        alone = norms(t.sent, own.received) / norm
        if (alone[far] <= SURE * each_surface.OWN * target / SAFETY).all():  # it is what bends make, amplified
            bend = np.linalg.norm(bends(f, light.scene.reflectance[f.node_surface] * light.indirect), axis=2)
            error = np.zeros(error.shape)
            error[f.leaves] = bend * np.sqrt(f.sizes()[f.leaves])[:, None]
        each, halvings = (yield from own.flow.blame(np.where(far[at], weight * rho, 0.0), error)).ravel(), f.halvings
        halvings = halvings[np.argsort(each[halvings], kind="stable")]
        left = SURE * each_surface.OWN * target / (SAFETY * own.passed[far].max())
        return halvings[np.cumsum(each[halvings]) > left * each[halvings].sum()]

    # -- more nodes ----------------------------------------------------------------------------------------------

    def _grow(self, halvings):
        yield from self.transport.grow(halvings)
        self.light.follow()

    def _split(self, halvings):
        yield from self.transport.split(halvings)
        self.light.follow()


def _ordered(field, error, halvings):
    """The worst last, by errors (n cells, 2), with those along the cells' other axes that would be the worst next."""
    other, error = halvings ^ 1, error.ravel()
    untold = field.parent[field.made.ravel()[other]] < 0  # roots' errors are one order less sure
    halvings = np.union1d(halvings, other[error[other] > np.where(untold, UNTOLD, NEXT) * error[halvings]])
    return halvings[np.argsort(error[halvings], kind="stable")]


def _worst(field, error, allowed):
    """Halvings so that those left hold no more than `allowed` of the error (n cells, 2), in L2."""
    halvings = field.halvings
    part = error.ravel()[halvings] ** 2
    halvings, part = halvings[part > 0], part[part > 0]
    order = np.argsort(part)
    return halvings[order[np.cumsum(part[order]) > allowed**2]]
