"""How far a solution by rays is off, part by part: of rays and shadows where colours are read, as random points tell,
of the rays and the cells of the nodes, as they reach others, and of the solver."""

import copy
from functools import partial

import numpy as np

from ..each_surface import TOLD
from ..read_off import drawn, materials_at, spread_points
from ..signs_of_life import in_thread
from .amplified import passed_on
from .engine import DIM, is_same
from .placed import Placed
from .rows import HALF, Gathered, Traced, directions, sky_alone, sky_missed

SAFETY = 1.7  # of what halves and surpluses tell to what is stated
CHECKED = 256, 1024  # points where the error is found: at least, and at most, where they are of few rays
CHECKED_RAYS = 1 << 17  # of all of these, where that does not leave too few
ASKED, FINER = 4, 4.0  # of these points every such one is asked for its direct light again, so many times as fine
DIM_WITHIN = 0.15  # the same of what nodes' rays cost: light goes round many times within bodies that nobody looks into
ONE_WAY = 0.2  # of the error of cells: of one sign in all that a place sees of them in part, as where daylight bends
CORRELATED = 0.08  # of the error of the nodes' own rays: neighbours share their directions, and so their errors


class Check:
    """Of a RayState: error, stated; parts {name: of the light}; surface_errors (n surfaces,), each one's of its own
    light; node_error (n,): of what each node reflects; passed (n,): the square of what of it comes from others;
    surplus: see Nodes.surplus, as squares over their m^2."""

    def __init__(self, state):
        self.state, self.error, self.parts = state, float("inf"), {}
        self.looked = self.looked_rays = self.told_by = None

    def under(self, state):
        """The check of the same nodes and rays under other light."""
        new = copy.copy(self)
        new.state, new.looked, new.told_by = state, None, None
        return new

    def measure(self):
        """Finds the error and its parts; yields."""
        state = self.state
        if not state.norm > 0:
            self.error, self.parts, self.surface_errors = 0.0, {}, np.zeros(len(state.scene))
            self.node_error = np.zeros(len(state.nodes))
            return
        yield from self._look()
        nodes, scene = state.nodes, state.scene
        weight, rho, _, sky = self.looked
        rows = yield from in_thread(Gathered, self.looked_rays, nodes, scene)
        glare = yield from state.glare(state.read)
        if glare is not None:
            glare.take_out(rows, self.looked_rays, self.places)
        unsure = rows.unsure(state.sent, weight * rho.max(axis=1) ** 2)[0]
        if glare is not None:
            one, other = yield from glare.at(self.places)
            unsure = np.hypot(unsure, (one - other) / 2)
        if sky is not None:
            unsure = np.hypot(unsure, sky_missed(scene, sky, self.looked_rays))
        there = self.places.surface
        rays = self._relative(there, weight, ((rho * unsure) ** 2).sum(axis=1))
        shadows = self._shadows()
        told_by = state.sent, state.lit.lost, state.lit.lamps
        if not is_same(told_by, self.told_by):
            yield from self._of_nodes()
            self.told_by = told_by
        self.parts = {"rays": rays, "shadows": float(np.hypot(shadows, self.lost)), **self.passed_parts}
        self.error = SAFETY * float(np.sqrt(sum(v * v for v in self.parts.values())))
        node_shadow = nodes.reflectance.max(axis=1) * state.lit.unsure
        whole = partial(self._relative, nodes.surface, nodes.weight)
        of_nodes, of_shadows = whole(self.unsure**2), whole(node_shadow**2)
        scales = rays / max(of_nodes, 1e-300), shadows / of_shadows if of_shadows > 0 else 0.0
        self.node_error = np.hypot(scales[0] * self.unsure, scales[1] * node_shadow)
        self._each({"rays"} | ({"shadows"} if scales[1] > 0 else set()))

    def _of_nodes(self):
        """What the nodes' errors come to where others have received them; yields: sets `passed`, `unsure` (n,), of
        the nodes' own rays, `lost`, a part of shadows, and the other parts of nodes alone."""
        state, nodes = self.state, self.state.nodes
        reflected = nodes.weight * nodes.reflectance.max(axis=1) ** 2
        own = yield from in_thread(state.rows.unsure, state.sent, reflected)
        self.unsure = np.linalg.norm(nodes.reflectance * own[0], axis=1)
        of_nodes = self._relative(nodes.surface, nodes.weight, self.unsure**2)
        dim = float((nodes.weight[:, None] * nodes.reflectance).sum() / (3 * nodes.weight.sum()))
        # neighbours share their directions, so that an error of one sign that white walls amplify may be in any half
        sent, of_rays = (yield from in_thread(self._sent)), (yield from self._passed(own))
        # of one sign, and no matter of how many rays there are
        lost = yield from self._passed(np.repeat(state.lit.lost[None, :, None], 3, axis=2))
        lamps = yield from self._passed(HALF * state.lit.lamps.reshape(len(nodes), -1, 3).swapaxes(0, 1))
        self.passed = sent + of_rays + lost + lamps
        whole = partial(self._relative, nodes.surface, nodes.weight)
        self.lost = whole(lost, DIM_WITHIN)
        self.passed_parts = {
            "sent": whole(sent),
            "nodes": whole(of_rays, DIM_WITHIN) + CORRELATED * dim * of_nodes,
            "lamps": whole(lamps, DIM_WITHIN),
            "solver": float(state.left),
        }

    def _look(self):
        """Direct light and rays at random points, as where colours are read, anew where that gets finer; yields."""
        state = self.state
        count = int(np.clip(CHECKED_RAYS // state.read, *CHECKED))
        if self.looked is None or len(self.looked[0]) != count:
            surface, points, weight = check_points(state.scene, state.reflects, count)
            self.places = Placed(state.facets, surface, points)
            factor, off = yield from state.straight(self.places)
            some = np.arange(0, count, ASKED)
            finer = (yield from state.straight(self.places.take(some), finer=FINER))[0]
            self.shade = some, np.einsum("nkc,kc->nc", factor[some] - finer, state.lit.light)
            sky = None if state.scene.sky is None else sky_alone(state.scene, self.places.normals)
            self.looked = weight, materials_at(state.scene, surface, points)[0], off, sky
        if self.looked_rays is None or self.looked_rays.code.shape != (count, state.read):
            self.looked_rays, places = Traced(len(self.places), directions(state.read)), self.places
            yield from self.looked_rays.trace(state.facets, lambda rows, _: places.take(rows), np.arange(len(places)))

    def _shadows(self):
        """What is wrong with direct light where it was looked at, of all light: half is what halves of lamps tell,
        which is smooth, half what more points tell at some places, which holds where all of few agree, too."""
        weight, rho, off, _ = self.looked
        some, wrong = self.shade
        there = self.places.surface
        told = self._relative(there, weight, (rho.max(axis=1) * off) ** 2)
        found = self._relative(there[some], ASKED * weight[some], ((rho[some] * wrong) ** 2).sum(axis=1))
        return float(np.hypot(told, found)) / np.sqrt(2)

    def _passed(self, errors):
        """(n,) Squares of what errors (k, n, 3) of the nodes' light cost once passed on, in their mean; yields."""
        state, rho = self.state, np.tile(self.state.nodes.reflectance, len(errors))
        if not errors.any():
            return np.zeros(len(rho))
        passed = yield from in_thread(passed_on, state.rows.times, rho, np.concatenate(errors, axis=1), state.amplified)
        return ((rho * passed) ** 2).sum(axis=1) / len(errors)

    def _sent(self):
        """(n,) Squares of what finer cells would show of the light sent, where others receive it: most of either sign,
        so that who sees many cells gets little of it, and who is near to one all; what cells are off by in their own
        means with its sign; keeps what each cell and mesh makes of it."""
        state, nodes = self.state, self.state.nodes
        cells, meshes = state.surplus
        own, rho = nodes.surface, nodes.reflectance.max(axis=1)
        # what rules the error that is stated: what all of it is of all light, or what each surface's is of its own
        weight = nodes.weight * rho**2
        weights = weight / max(state.norm, 1e-300) ** 2, weight / state.own_square(DIM)[own] / nodes.weight.sum()
        received, all_one_way, seen = *np.zeros((2, len(nodes))), np.zeros((2, len(nodes)))
        signed = np.zeros((len(nodes), 3))
        for who, node, share in state.rows.cells_met():
            received += np.bincount(who, (share * state.bent[node]) ** 2, len(nodes))
            all_one_way += np.bincount(who, share * state.bent[node], len(nodes))
            for c, bias in enumerate(state.bias.T):
                signed[:, c] += np.bincount(who, share * bias[node], len(nodes))
            for k, each in enumerate(weights):
                seen[k] += np.bincount(node, share**2 * each[who], len(nodes))
        seen = seen[(seen @ state.bent**2).argmax()]
        of_meshes = np.bincount(own[len(cells) :], (seen * state.bent**2)[len(cells) :], len(meshes))
        self.surplus = seen[: len(cells), None] * cells**2, of_meshes
        received += (ONE_WAY * all_one_way) ** 2 + (signed**2).sum(axis=1)
        # from there on as the errors of the nodes' rays go on, three draws of the signs at once
        signs = np.random.default_rng(len(nodes)).choice([-1, 1], (len(nodes), 3)) / np.sqrt(3)
        error = np.sqrt(received)[:, None] * signs
        passed = passed_on(state.rows.times, nodes.reflectance, error, state.amplified)
        return rho**2 * (received + (passed**2).sum(axis=1))

    def _relative(self, surface, weight, square, dim=DIM):
        """Errors, squares (k,) of them on surfaces (k,) and weights (k,) m^2 -> what they are of all light, in L2, or,
        where that is more, of each surface's own: what lies in the dark is to be right too, as a room is whose outer
        walls stand in the sun, but a dark place that all but no light comes to is not to rule all."""
        whole = np.sqrt((weight * square).sum()) / max(self.state.norm, 1e-300)
        each = square / self.state.own_square(dim)[surface]
        return float(max(whole, np.sqrt((weight * each).sum() / max(weight.sum(), 1e-300))))

    def _each(self, told):
        """surface_errors (n surfaces,): of each one's own light, what its nodes are off by, and of the rest what they
        receive of it, or what it is of all light, if that is more."""
        nodes, count, norms = self.state.nodes, len(self.state.scene), self.state.surface_norms
        rest = np.sqrt(sum(v * v for k, v in self.parts.items() if k not in told))
        known = norms > 0
        relative, passed = (
            np.divide(np.sqrt(np.bincount(nodes.surface, nodes.weight * e, count)), norms, np.zeros(count), where=known)
            for e in (self.node_error**2, self.passed)
        )
        # a few nodes tell little of their own error: the usual one counts as so many more
        usual = np.median(relative[known]) if known.any() else 0.0
        relative = np.sqrt((nodes.number * relative**2 + TOLD * usual**2) / (nodes.number + TOLD))
        self.surface_errors = SAFETY * np.where(known, np.hypot(relative, np.maximum(rest, passed)), 0.0)


def check_points(scene, reflects, count):
    """Random points, of a fixed seed: surface (k,), points (k, 3) m and weights (k,) m^2 of an unbiased mean; half by
    area and half evenly over the surfaces that reflect."""
    rng = np.random.default_rng(20)
    some = np.flatnonzero(reflects)
    if not len(some):
        return np.zeros(0, int), np.zeros((0, 3)), np.zeros(0)
    area = scene.areas[some]
    share = area / area.sum() / 2 + 1 / (2 * len(some))
    pick = drawn(share, count, rng)
    surface = some[pick]
    return surface, spread_points(scene, surface, rng), area[pick] / (share[pick] * count)
