"""Where to spend more: which cells are split, which rows made anew, and how well is solved, from what a Check found."""

import numpy as np

from .. import each_surface
from ..error_estimates import bends, leaf_errors
from ..error_flow import areas_of_nodes
from ..field import DEEPEST
from ..gaps import crowded
from .check import SAFETY
from .light import Precision

LINK_SHARE, MANY = 0.2, 0.0025  # tolerance of one link, of the round's target; below that one links are many: less
NOISY = 1.2  # error found, of the error the surpluses promise, that only links can make
SENT_SHARE = 0.15  # of the target: what direct light between the nodes may cost as it is sent on
LIGHT_NODES = 0.6  # of the memory: what direct light may take, lest none be left for the rest
CONTACT_SHARE = 2.0  # cells near contacts are no smaller than a square whose whole light is this part of the target
CONTACT_LEAST = (
    0.0125  # target that contacts of spheres are resolved for in any case: the dark about a point of contact
)
# is caught light, of which residuals show an eighth
FLAT = 0.133  # of that size in gaps between planes, which are as large as they
CONTACT_OWN = 6.0  # sides of a square as large as the smaller of the two shapes: the same of its own light
SURE = 0.7  # lower than what was found asks for: the halves of what is split, and the rest, have errors of their own
MOST_STRAIN = 16.0  # how much finer links get there
LENIENT = 3.0  # surpluses alone promise too much in gaps: what is found there decides
LESS = 0.8  # of what did not close is left after a round that helped
HALVED = 0.5  # of the error expected on a surface, or of links', what is left where that is too large
TIGHTER, TIGHTEST = 0.03, 1e-5  # tolerance of the solver, of the last, where its rest is most of the error; the least
STRAIGHTER = 0.3  # part of the bends of the sources that a refinement leaves, where they are most of the error
REFINE_TO = 0.9 / SAFETY  # of the target: what a refinement leaves in the leaves not split


class Refinement:
    """Of a Check's light and its transport, towards one target after another. strain (n surfaces,): how much finer
    links are there; solver_share: tolerance of the solver, of the usual; cramped: whether less was refined than asked
    for, lest the memory get full."""

    def __init__(self, check):
        self.check, self.light, self.transport = check, check.light, check.light.transport
        self.strain = np.ones(len(self.light.scene))
        self.link_target, self.sharpness, self.solver_share = None, 1.0, 1.0
        self.cramped, self.unclosed = False, np.inf

    # -- before the rows -----------------------------------------------------------------------------------------

    def light_up(self, target, final):
        """Refine where shapes touch, and `sent` until direct light is sent on well enough for `final`; yields."""
        light, t = self.light, self.transport
        while 0 < len(cells := self._crowded(target)) <= t.room(LIGHT_NODES):
            yield from self._split(cells)
            yield
        while True:
            error = leaf_errors(t.sent, light.reflectance * light.lit)
            cells = _worst(t.sent, error, SENT_SHARE * final * light.scale)
            if self.check.measured:
                own = light.shared.allowed(SENT_SHARE * final / light.caught)
                cells = np.union1d(cells, each_surface.worst_of_parts(t.sent, error, own))
                cells = cells[np.argsort(error[cells], kind="stable")]
            room = t.room(LIGHT_NODES)
            if not min(len(cells), room):
                break
            yield from self._grow(cells[-room:])  # the worst come last
            yield
        if final != self.link_target:
            self.link_up(final)

    def _crowded(self, target):
        """Cells of the field that are to be split where shapes touch."""
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
        self._be_precise(tolerance)

    def _be_precise(self, tolerance):
        """Links to come are so fine, and finer where dark surfaces and strain ask for it."""
        strain = np.repeat(self.strain, self.transport.field.charts)
        stress = np.append(self.light.shared.stress(self.light.level) * strain, 1.0)
        self.light.precision = Precision(tolerance, stress)

    # -- after a check -------------------------------------------------------------------------------------------

    def improve(self, target, last):
        """Whatever helps most towards the target, the last or not; False where nothing does; yields."""
        if self.check.fresh:
            before, self.unclosed = self.unclosed, self.check.unclosed
            # what rows make from nothing, where shapes run through each other, finer cells and links do not mend
            if SAFETY * self.unclosed > target and self.unclosed > LESS * before:
                return False
        # where only some surface's own error is too large, what helps is local
        whole = not self.check.fresh or self.check.error > target
        if whole and ((yield from self._straighten()) or self._sharpen()):
            return True
        tightened = last and self._tighten(target)
        return (yield from self._refine(target)) or tightened

    def _straighten(self):
        """Where errors that the scene amplifies are most of all: split the cells, of direct light or of the field, over
        which the sources bend, or solve better; False where not, or where there is no more to gain; yields."""
        check, light, t = self.check, self.light, self.transport
        if check.fresh and check.largest("solver"):
            self.solver_share *= TIGHTER
            return self.solver_share > TIGHTEST
        if not (check.fresh and check.largest("stiff")):
            return False
        direct = check.amplified_light > check.amplified / 2
        f, value = (t.sent, light.lit) if direct else (t.field, light.indirect)
        bend = bends(f, light.scene.reflectance[f.node_surface] * value)
        part = np.zeros(len(f.level))
        part[f.leaves] = np.sqrt(np.linalg.norm(bend, axis=1) * f.sizes()[f.leaves])  # they add up, not their squares
        cells = _worst(f, part, np.sqrt(STRAIGHTER) * np.linalg.norm(part))
        room = t.room(LIGHT_NODES if direct else 1.0)
        if not min(len(cells), room):
            return False
        if direct:
            yield from self._grow(cells[-room:])
            self.link_up(self.link_target)
        else:
            yield from self._split(cells[-room:])
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
        """Rows anew with finer links on the surfaces whose own errors are too large, and larger than surpluses promise;
        False where there are none."""
        if self.cramped or not self.check.fresh:
            return False
        mended = self._to_mend(target)
        noisy = self.check.told[mended] > NOISY * self.check.own_promised[mended]
        mended = mended[noisy & (self.strain[mended] < MOST_STRAIN)]
        if not len(mended):
            return False
        self.strain[mended] /= HALVED
        self.transport.drop(np.flatnonzero(np.isin(self.transport.field.node_surface, mended)))
        self._be_precise(self.light.precision.tolerance)
        return True

    def _refine(self, target):
        """Split the leaves that hold most of the estimated error; False where nothing is left to split; yields."""
        check, f = self.check, self.transport.field
        error, allowed = np.clip(check.optimism, 0.5, 2.0) * check.leaf_error, REFINE_TO * target * self.light.scale
        if check.fresh:  # what was found has to fall by so much, however little was promised
            allowed = min(allowed, SURE * target / check.error * np.linalg.norm(error[f.leaves]))
        own = LENIENT * self.light.shared.allowed(REFINE_TO * target / self.light.caught)
        if check.fresh and len(mended := self._to_mend(target)):
            found = np.sqrt(np.bincount(f.part[f.leaves], error[f.leaves] ** 2, len(own)))
            part = np.isin(np.repeat(np.arange(len(self.light.scene)), f.charts), mended)
            own[part] = np.minimum(own[part], HALVED * found[part])
        cells = np.union1d(_worst(f, error, allowed), each_surface.worst_of_parts(f, error, own))
        if check.fresh:
            cells = np.union1d(cells, (yield from self._blamed(target)))
        if not len(cells):
            return False
        cells, room = cells[np.argsort(error[cells], kind="stable")], self.transport.room()
        if room < len(cells):
            self.cramped = True
            cells = cells[max(len(cells) - room, 0) :]  # the worst come last
        if room > 0:
            yield from self._split(cells)
        return room > 0

    def _to_mend(self, target):
        """Surfaces (k,) where own errors arise that are too large."""
        check = self.check
        return np.flatnonzero(check.too_large(target) & (check.own_here > SURE * each_surface.OWN * target / SAFETY))

    def _blamed(self, target):
        """Leaves of the field whose errors, passed on with the light, make own errors elsewhere too large; yields."""
        check, light, t = self.check, self.light, self.transport
        far = check.too_large(target) & (check.own_passed > SURE * each_surface.OWN * target / SAFETY)
        if not far.any():
            return np.zeros(0, int)
        own, norm = t.sent.node_surface, np.maximum(light.shared.norm, 1e-300)
        # of each surface's own error, an L2 norm, by the error received at each node
        weight = areas_of_nodes(t.sent) * check.flow_received / np.maximum(check.own_passed * norm**2, 1e-300)[own]
        rho = light.scene.reflectance.max(axis=1)[own]
        each = yield from check.flow.blame(np.where(far[own], weight * rho, 0.0))
        leaves = t.field.leaves[t.field.level[t.field.leaves] < DEEPEST]
        leaves = leaves[np.argsort(each[leaves], kind="stable")]
        return leaves[np.cumsum(each[leaves]) > HALVED * each[leaves].sum()]

    # -- more nodes ----------------------------------------------------------------------------------------------

    def _grow(self, cells):
        yield from self.transport.grow(cells)
        self.light.follow()

    def _split(self, cells):
        yield from self.transport.split(cells)
        self.light.follow()


def _worst(field, error, allowed):
    """Leaves to split so that those left hold no more than `allowed` of the error (n cells,), in L2."""
    leaves = field.leaves
    leaves = leaves[(error[leaves] > 0) & (field.level[leaves] < DEEPEST)]
    part = error[leaves] ** 2
    order = np.argsort(part)
    return leaves[order[np.cumsum(part[order]) > allowed**2]]
