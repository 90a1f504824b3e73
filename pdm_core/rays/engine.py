"""Radiosity by rays: direct light by shares of sources, indirect light and the sky by fixed bundles, to a stated error.

E = D + S + A (rho E): D from sources, S from the sky, A the rows of hits over the nodes. Where colours are read, D is
worked out anew and A (rho E) gathered anew, by as many directions as the error there asks for.
"""

import time
from collections import Counter

import numpy as np

from ..numerics import gmres
from ..plan import RAY_MEMORY
from ..read_off import materials_at, spread_points
from ..signs_of_life import finish, in_thread
from .aimed import Spot, spots_of
from .amplified import amplification, passed_on
from .covered import covered
from .direct import AT_NODES, COARSE, FINE, READ, ROUGHLY, Shares
from .facets import Facets
from .near import NearHits
from .nodes import LIT, Nodes
from .placed import Placed
from .rows import Gathered, Traced, batches, bundle, directions, light_of, sky_alone, sky_missed
from .sources import relit, sources_of

RAYS, MOST_RAYS = 64, 4096  # directions of a node, of a point where colours are read: at first, at most
POWER = 0.72  # the error of n directions falls as n to this
HALF = 0.62  # error of all rays, of what half of them differ from all: every second one is spread less evenly
SAFETY = 1.7  # of what halves and surpluses tell to what is stated
CHECKED = 256  # points where the error is found
LEAST_TOLD = 1e-3
SOLVED = 0.02  # relative residual of the linear system, of the target
STEPS = 60  # of the solver at most
TOLD = 1.0  # of the target: what direct light may be off by where part of a source is seen, which is so in few places
TOLD_BRIGHT = 0.5  # of that, where it is brighter than in the mean: relative to the light there
AT_NODES_TOLD = 3.0  # the same at one of the places of a node, which stand for it together
SHARES = {"rays": 0.6, "shadows": 0.25, "nodes": 0.55, "sent": 0.5}  # of the error that is left, each part's at most
REACHED = 0.95  # of the target: what is worked towards
STEP = 32  # of directions where colours are read
MORE = 1.25  # times as many directions of the nodes at least, as all their rays begin anew
MOST_MORE = 8.0, 3.0  # how many times more directions at once where colours are read, and of the nodes, as few tell it
SOURCE = 0.33  # of the error of what cells send: what reaches others, most of it being of either sign nearby
DIM = 0.05  # of the mean light: what is darker need not be right to its own
DIM_WITHIN = 0.15  # the same of what nodes' rays cost: light goes round many times within bodies that nobody looks into
CANCEL = 0.5  # of one-signed errors of sources, this part goes on as light does
HALVED = 0.7  # of the error of cells, what halves of them leave
KEPT_WHOLE = 0.02  # of the square of the error: cells that make no more are not halved
USUAL = 4.0  # nodes whose weight the usual error of a surface has beside its own
CORRELATED = 0.08  # of the error of the nodes' own rays: neighbours share their directions, and so their errors


class RayState:
    """Everything a solution by rays grows from."""

    def __init__(self, scene, target_error):
        self.scene, self.target, self.started = scene, target_error, time.perf_counter()
        self.counts, self.history, self.parts = Counter(), [], {}
        self.facets = Facets(scene)
        self.by_rays = (scene.emission > 0).any(axis=1) & np.array([s.is_inside for s in scene.surfaces])
        self.reflects = (scene.reflectance > 0).any(axis=1)
        self._take_sources(sources_of(self.facets, self.by_rays))
        self.aimed = False  # whether spots of narrow beams are among the sources
        self.nodes = Nodes(self.facets, self.reflects | self.by_rays)
        self.factor = np.zeros((0, len(self.sources), 3), np.float32)
        self.spread = np.zeros(0)  # of the direct light within each node's cell
        self.unsure_lit = np.zeros(0)  # how far the direct light at a node's places may be off
        self.traced = Traced(0, directions(RAYS // 2 if target_error > COARSE else RAYS))
        self.read = RAYS  # directions where colours are read
        self.error, self.level = float("inf"), 0.0
        self.looked = self.looked_rays = None
        self.told = TOLD

    def elapsed(self):
        """s since the beginning"""
        return time.perf_counter() - self.started

    # -- geometry ------------------------------------------------------------------------------------------------

    def extend(self, old):
        """Rays and direct light of the nodes that old (n,) does not know, -1; yields."""
        self.traced = self.traced.moved(len(old), old)
        new = np.flatnonzero(old < 0)
        yield from self.trace(new)
        hidden = yield from in_thread(covered, self.traced, self.nodes, new)
        kept, changed = yield from in_thread(self.nodes.uncover, new, hidden)
        self.traced, old = self.traced.moved(len(kept), kept), old[kept]
        yield from self.trace(changed)
        new = np.flatnonzero(old < 0)
        lit, told = self.nodes.lit_places(new), AT_NODES_TOLD * self.target
        each, off = yield from self.shares.at(lit, told * self.scale(), told, AT_NODES)
        if not self.aimed:
            each = np.concatenate([each, (yield from self._take_spots(each, lit, told))], axis=1)
            self.factor = np.zeros((0, *each.shape[1:]), np.float32)
        each[:, self.beamed] = 0.0
        each = each.reshape(len(new), LIT, *each.shape[1:])
        self.factor, self.spread, self.unsure_lit = (
            _carried(a, old) for a in (self.factor, self.spread, self.unsure_lit)
        )
        self.unsure_lit[new] = np.sqrt((off.reshape(len(new), LIT) ** 2).mean(axis=1))
        self.factor[new] = each.mean(axis=1)
        self.spread[new] = np.linalg.norm(np.einsum("nlkc,kc->nlc", each, self.light).std(axis=1), axis=1)
        yield from in_thread(self.link)

    def trace(self, which):
        """Rays of the nodes which (k,), from each of their places in turn; yields."""
        yield from self.traced.trace(self.facets, self.nodes.from_place, which)
        self.counts["rays"] += len(which) * len(self.traced.directions)

    def _take_spots(self, each, lit, told):
        """Adds spots of narrow beams to the sources, where places lit have factors each (n, k, 3); returns those of the
        spots (n, spots, 3), of which so much may be off; yields."""
        spots = yield from spots_of(self, (each > 0).any(axis=2).sum(axis=0))
        steps = Shares(self.facets, spots, self.counts).at(lit, told * self.scale(), told, AT_NODES)
        own = (yield from steps)[0]
        self._take_sources(self.sources + spots)
        self.aimed = True
        return own

    def _take_sources(self, sources):
        self.sources = sources
        self.light = np.array([s.colour for s in sources]).reshape(-1, 3)
        self.shares = Shares(self.facets, sources, self.counts)
        self.beamed = np.zeros(len(sources), bool)  # whether its light goes on by way of spots, sources too
        self.spots = [s for s in sources if isinstance(s, Spot)]
        self.beamed[[s.beam_of for s in self.spots]] = True

    def scale(self):
        """Irradiance / pi that tolerances refer to: before any is known, the sources' own over the scene."""
        if self.level > 0:
            return self.level
        whole = self.scene.background.max()
        centre = self.facets.centre + np.zeros((1, 3))
        for source in self.sources:
            faces = np.concatenate([np.eye(3), -np.eye(3)])
            whole = max(whole, source.unoccluded(np.repeat(centre, 6, axis=0), faces).max() * source.colour.max())
        return whole / 4

    def link(self):
        """The rows of all nodes, and their own light: direct, and what they send whatever they receive."""
        self.rows = Gathered(self.traced, self.nodes, self.scene)
        self.direct = np.einsum("nkc,kc->nc", self.factor, self.light)
        own = self.nodes.surface
        self.shining = np.where(self.by_rays[own, None], self.scene.emission[own], 0.0)

    # -- solving -------------------------------------------------------------------------------------------------

    def solve(self):
        """E at the nodes, and what they send on; yields."""
        rho = self.nodes.reflectance
        outer = self.direct + self.rows.sky
        right = self.rows.times(rho * outer + self.shining)
        guess = right.copy()
        solving = gmres(lambda v: self.rows.times(rho * v), right, guess, SOLVED * self.target, STEPS)
        indirect, steps, _ = yield from in_thread(finish, solving)
        self.counts["iterations"] += steps
        self.amplified = yield from in_thread(amplification, self.rows.times, rho)
        residual = right - indirect + self.rows.times(rho * indirect)
        self.received = outer + indirect
        self.sent = rho * self.received + self.shining
        weight, reflected = self.nodes.weight, rho * self.received
        square = np.bincount(self.nodes.surface, weight * (reflected**2).sum(axis=1), len(self.scene))
        spots = np.bincount([s.index for s in self.spots], [s.square for s in self.spots], len(self.scene))
        self.surface_norms = np.sqrt(square + spots)
        self.norm = float(np.sqrt((square + spots).sum()))
        reflecting = max(self.scene.areas[self.reflects].sum(), 1e-300)
        # of each surface: the mean square that its errors count against; a bright spot in a dim room makes none good
        self.usual_square = square.sum() / reflecting
        self.own_square = np.maximum(square / self.scene.areas, DIM**2 * self.usual_square)
        usual = np.sqrt(square.sum()) if square.any() else self.norm
        self.level = float(usual / np.sqrt(reflecting) / max(rho.max(initial=0.0), 1e-3))
        once = (weight[:, None] * rho * (outer + self.rows.times(self.shining))).sum()
        self.gain = float((weight[:, None] * reflected).sum() / max(once, 1e-300))
        left = rho * self.amplified[:, None] * residual
        self.left = np.sqrt((weight * (left**2).sum(axis=1)).sum()) / max(self.norm, 1e-300)

    # -- reading -------------------------------------------------------------------------------------------------

    def gather(self, receivers, count):
        """Indirect light and the sky's at receivers by `count` directions -> (n, 3); yields."""
        n, every = len(receivers), directions(count)
        total, weight = np.zeros((n, 3)), np.zeros(n)
        sent, near = self.sent.astype(np.float32), NearHits(self, receivers, count)
        for some in batches(count, n, self.facets):
            rays = bundle(self.facets, self.nodes, receivers, every[some])
            yield
            cosine = np.abs(rays.cosine)
            near.add(rays)
            light = cosine[:, None] * light_of(rays, sent, self.scene, every[some])
            total += light.reshape(len(some), n, 3).sum(axis=0)
            weight += cosine.reshape(len(some), n).sum(axis=0)
        self.counts["rays"] += n * count
        total += yield from near.settle()
        return total / np.maximum(weight, 1e-300)[:, None]

    def lit(self, receivers, roughly=False):
        """Factors of the sources (n, k, 3) at receivers and how far their light may be off (n,); yields."""
        told = self.told * self.target
        points = ROUGHLY if roughly and self.target > FINE else READ[roughly or self.target > COARSE]
        return (yield from self.shares.at(receivers, told * self.level, TOLD_BRIGHT * told, points))

    def incident(self, receivers, roughly=False):
        """Irradiance / pi (n, 3) at receivers; yields."""
        factor, _ = yield from self.lit(receivers, roughly)
        rest = yield from self.gather(receivers, min(RAYS, self.read) if roughly else self.read)
        return np.einsum("nkc,kc->nc", factor, self.light) + rest

    # -- error ---------------------------------------------------------------------------------------------------

    def check(self):
        """The error and its parts; yields."""
        nodes, scene = self.nodes, self.scene
        yield from self.look()
        weight, rho, off, sky = self.looked
        rows = yield from in_thread(Gathered, self.looked_rays, nodes, scene)
        unsure = HALF * rows.unsure(self.sent)
        if sky is not None:
            unsure = np.hypot(unsure, sky_missed(scene, sky, self.looked_rays))
        there = self.places.surface
        rays = self._relative(there, weight, ((rho * unsure) ** 2).sum(axis=1))
        shadows = self._relative(there, weight, (rho.max(axis=1) * off) ** 2)
        own = HALF * self.rows.unsure(self.sent)
        reflected = nodes.reflectance * own
        self.node_error = np.linalg.norm(reflected, axis=1)
        self.node_shadow = nodes.reflectance.max(axis=1) * self.unsure_lit
        passed = nodes.reflectance * (
            yield from in_thread(passed_on, self.rows.times, nodes.reflectance, own, self.amplified)
        )
        rms = self._relative(nodes.surface, nodes.weight, self.node_error**2)
        dim = float((nodes.weight[:, None] * nodes.reflectance).sum() / (3 * nodes.weight.sum()))
        sent = self._sent_error()
        self.parts = {
            "rays": rays,
            "shadows": shadows,
            "sent": sent,
            "nodes": self._relative(nodes.surface, nodes.weight, (passed**2).sum(axis=1), DIM_WITHIN)
            + CORRELATED * dim * rms,
            "solver": float(self.left),
        }
        self.error = SAFETY * float(np.sqrt(sum(v * v for v in self.parts.values())))
        shadow_rms = self._relative(nodes.surface, nodes.weight, self.node_shadow**2)
        self._each(rays / max(rms, 1e-300), shadows / shadow_rms if shadow_rms > 0 else 0.0)
        self.history.append((self.elapsed(), self.error))

    def _sent_error(self):
        """What finer cells would show of the light that is sent on, as it reaches others; keeps how far each node is
        off beside it, and what each cell and mesh makes of it."""
        nodes, scene = self.nodes, self.scene
        cells, meshes = nodes.surplus(self.sent, self.spread * nodes.reflectance.max(axis=1))
        self.bent = np.zeros(len(nodes))
        self.bent[: len(cells)] = np.linalg.norm(cells, axis=1)
        own = nodes.surface[: len(cells)]
        cells = nodes.weight[: len(cells), None] * cells**2
        square = np.bincount(own, cells.sum(axis=1), len(scene)) + meshes**2
        some, scale = np.flatnonzero(self.reflects), np.sqrt(np.maximum(self.own_square, 1e-300))
        self.surplus = cells / scale[own, None], meshes**2 / scale
        whole = self._relative(some, scene.areas[some], square[some] / scene.areas[some])
        return SOURCE * max(1.0, CANCEL * self.gain) * whole

    def _relative(self, surface, weight, square, dim=DIM):
        """Errors, squares (k,) of them on surfaces (k,) and weights (k,) m^2 -> what they are of all light, in L2, or,
        where that is more, of each surface's own: what lies in the dark is to be right too, as a room is whose outer
        walls stand in the sun, but a dark place that all but no light comes to is not to rule all."""
        whole = np.sqrt((weight * square).sum()) / max(self.norm, 1e-300)
        each = square / np.maximum(np.maximum(self.own_square, dim**2 * self.usual_square)[surface], 1e-300)
        return float(max(whole, np.sqrt((weight * each).sum() / max(weight.sum(), 1e-300))))

    def look(self):
        """Direct light and rays at random points, as where colours are read, anew where that gets finer; yields."""
        if self.looked is None:
            surface, points, weight = check_points(self.scene, self.reflects, CHECKED)
            self.places = Placed(self.facets, surface, points)
            off = (yield from self.lit(self.places))[1]
            sky = None if self.scene.sky is None else sky_alone(self.scene, self.places.normals)
            self.looked = weight, materials_at(self.scene, surface, points)[0], off, sky
        if self.looked_rays is None or len(self.looked_rays.directions) != self.read:
            self.looked_rays = Traced(len(self.places), directions(self.read))
            yield from self.looked_rays.trace(
                self.facets, lambda rows, _: self.places.take(rows), np.arange(len(self.places))
            )

    def _each(self, ray_scale, shadow_scale):
        """surface_errors (n surfaces,): of each one's own light: of its nodes' rays and shadows, as large as those are
        where colours are read, and its part of all the rest."""
        nodes, count = self.nodes, len(self.scene)
        self.node_error = np.hypot(ray_scale * self.node_error, shadow_scale * self.node_shadow)
        own = np.sqrt(np.bincount(nodes.surface, nodes.weight * self.node_error**2, count))
        told = {"rays"} | ({"shadows"} if shadow_scale > 0 else set())
        rest = np.sqrt(sum(v * v for k, v in self.parts.items() if k not in told))
        known = self.surface_norms > 0
        relative = np.divide(own, self.surface_norms, out=np.zeros(count), where=known)
        # a few nodes tell little of their own error: the usual one counts as so many more
        usual = np.median(relative[known]) if known.any() else 0.0
        relative = np.sqrt((nodes.number * relative**2 + USUAL * usual**2) / (nodes.number + USUAL))
        self.surface_errors = SAFETY * np.where(known, np.hypot(relative, rest), 0.0)

    @property
    def idle(self):
        """Names of what shines but comes to no place of any node: all of it is hidden, or what it lights is smaller."""
        seen = (self.factor > 0).any(axis=(0, 2)) | self.beamed
        lamps = zip(self.sources[: len(seen) - len(self.spots)], seen)
        return [s.name for s, some in lamps if not some and s.colour.any() and len(self.factor)]

    def nothing(self):
        """Where no light is."""
        self.error, self.parts, self.surface_errors = 0.0, {}, np.zeros(len(self.scene))
        self.node_error, self.bent = np.zeros((2, len(self.nodes)))
        self.history.append((self.elapsed(), 0.0))

    def take_light(self, scene):
        """The same shapes under the light of another scene."""
        self.scene, self.started, self.counts, self.history = scene, time.perf_counter(), Counter(), []
        self.nodes = self.nodes.of(scene)
        self.facets = self.nodes.facets
        self._take_sources(relit(self.sources, scene))
        self.looked = None  # of the old light
        before = np.linalg.norm(self.direct, axis=1)
        self.link()
        self.spread = self.spread * np.linalg.norm(self.direct, axis=1) / np.maximum(before, 1e-300)

    # -- refinement ----------------------------------------------------------------------------------------------

    def improve(self):
        """Work on the largest part of the error; False where nothing is left to do; yields."""
        excess, did = self.excess(), False
        if excess["rays"] > 1 and self.read < MOST_RAYS:
            more = self.read * excess["rays"] ** (1 / POWER)
            more = STEP * np.ceil(np.clip(more, 1.5 * self.read, MOST_MORE[0] * self.read) / STEP)
            self.read = int(min(more, MOST_RAYS))
            did = True
        if excess["shadows"] > 1 and self.told > LEAST_TOLD:
            self.told *= max(0.7 / excess["shadows"], 0.1)
            self.looked, did = None, True
        if excess["nodes"] > 1:
            did |= yield from self.trace_finer(excess["nodes"])
        if excess["sent"] > 1:
            did |= yield from self.refine(excess["sent"])
        return did

    def excess(self):
        """{part: how many times larger it is than its share of what the target allows}; of cells, which are slow to
        become finer, than what the others leave once they are no larger than their shares, where that is more."""
        allowed = REACHED * self.target / SAFETY
        shares = {k: share * allowed for k, share in SHARES.items()}
        others = sum(min(v, shares.get(k, allowed)) ** 2 for k, v in self.parts.items() if k != "sent")
        shares["sent"] = max(shares["sent"], np.sqrt(max(allowed**2 - others, 0.0)))
        return {k: self.parts[k] / share for k, share in shares.items()}

    def trace_finer(self, excess):
        """More directions at the nodes, whose error is so many times too large, where memory has room; yields."""
        more = max(min(excess, MOST_MORE[1]) ** (1 / POWER), MORE)
        count = int(np.ceil(len(self.traced.directions) * more))
        count += count % 2
        if Traced.bytes_for(len(self.nodes), count) > RAY_MEMORY:
            return False
        self.traced = Traced(len(self.nodes), directions(count))
        yield from self.trace(np.arange(len(self.nodes)))
        yield from in_thread(self.link)
        return True

    def refine(self, excess):
        """Halve the cells that hold most of the error of what is sent; yields."""
        cells, meshes = self.surplus
        square = np.concatenate([cells.ravel(), meshes])
        # a cell becomes two, each part of a mesh four
        new = np.concatenate([np.ones(cells.size), np.maximum(3 * self.nodes.number, 1)])
        order = np.argsort(square / new)
        kept = np.cumsum(square[order]) / max(square.sum(), 1e-300)
        marked = np.zeros(len(square), bool)
        marked[order[(kept + HALVED**2 * (1 - kept) > (REACHED / excess) ** 2) & (kept > KEPT_WHOLE)]] = True
        may = np.concatenate([self.nodes.lattice.may_split().ravel(), ~self.nodes.is_finest])
        marked &= may & (square > 0)
        # what brings most for its memory first
        best = order[::-1][marked[order[::-1]]]
        room = RAY_MEMORY / Traced.bytes_for(1, len(self.traced.directions)) - len(self.nodes)
        marked[best[np.cumsum(new[best]) > room]] = False
        if not marked.any():
            return False
        cells, meshes = marked[: cells.size].reshape(cells.shape), marked[cells.size :]
        nodes = yield from in_thread(self.nodes.refined, cells, meshes)
        if Traced.bytes_for(len(nodes), len(self.traced.directions)) > RAY_MEMORY or len(nodes) == len(self.nodes):
            return False
        self.nodes = nodes
        yield from self.extend(nodes.old)
        return True


def check_points(scene, reflects, count):
    """Random points, of a fixed seed: surface (k,), points (k, 3) m and weights (k,) m^2 of an unbiased mean; half by
    area and half evenly over the surfaces that reflect."""
    rng = np.random.default_rng(20)
    some = np.flatnonzero(reflects)
    if not len(some):
        return np.zeros(0, int), np.zeros((0, 3)), np.zeros(0)
    area = scene.areas[some]
    share = area / area.sum() / 2 + 1 / (2 * len(some))
    edges = np.cumsum(share)
    pick = np.searchsorted(edges, (np.arange(count) + rng.random(count)) / count * edges[-1])
    pick = np.minimum(pick, len(some) - 1)
    surface = some[pick]
    return surface, spread_points(scene, surface, rng), area[pick] / (share[pick] * count)


def _carried(values, old):
    """Values of nodes known before, old (n,) >= 0 which, as an array for all (n, ...), 0 for the others."""
    out = np.zeros((len(old), *values.shape[1:]), values.dtype)
    out[old >= 0] = values[old[old >= 0]]
    return out
