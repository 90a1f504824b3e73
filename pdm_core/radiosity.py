"""The solution: direct light exact everywhere, indirect light on an adaptive field, to a stated error.

L = Le + rho (D + I). D comes from closed forms (direct), I = A rho (D + I) on the field's nodes with the rows A of
gather. Rounds tighten the tolerance, refine the field where the estimated error is, and solve again.
"""

import copy
import time
from collections import Counter, namedtuple

import numpy as np

from .checked import SceneError, number
from .choice import choose
from .contacts import contacts_of, settle, settled_again
from .deadline import above_target, is_over
from .each_surface import OWN, Light, own_errors, worst_of_parts
from .error_estimates import Look, Residual, bends, leaf_errors, sample_points, source_defect
from .error_flow import Flow, areas_of_nodes, norms
from .field import DEEPEST, Field, crowded
from .gather import Detail, Gather, Received
from .kept_links import KeptLinks
from .numerics import Rows, gmres
from .plan import MEMORY, plan, proportional_channels, reached_by_light
from .rays.solution import ray_steps
from .read_off import ReadOff, check_same_shapes, oriented, runs_of
from .scene import Scene
from .signs_of_life import finish, in_thread, mapped
from .visibility import Factors, Shafts

Progress = namedtuple("Progress", "fraction error seconds")

COARSEST = 0.16  # relative error aimed at by the first round
STEP = 4.0  # each further round aims at most this much lower
LINK_SHARE, MANY = 0.2, 0.0025  # tolerance of one link, of the round's target; below that one links are many: less
NOISY = 1.2  # error found, of the error the surpluses promise, that only links can make
SHARPER = 0.5  # part of it to go on with where links turn out to be what most of the error comes from
EXACT_SHARE = 0.05  # of the target: what the interpolated sum of the lesser sources may cost
SENT_SHARE = 0.15  # of the target: what direct light between the nodes may cost as it is sent on
CELL_NODES = 20  # that splitting a cell adds, with the neighbours that have to follow
LIGHT_NODES = 0.6  # of the memory: what direct light may take, lest none be left for the rest
CONTACT_SHARE = 2.0  # cells near contacts are no smaller than a square whose whole light is this part of the target
CONTACT_LEAST = 0.05  # target that contacts of spheres are resolved for in any case: coarser ones do not see them
FLAT = 0.133  # of that size in gaps between planes, which are as large as they
CONTACT_OWN = 6.0  # sides of a square as large as the smaller of the two shapes: the same of its own light
SOLVER_SHARE = 0.02  # relative residual of the linear system, of the round's target
SURE = 0.7  # lower than what was found asks for: the halves of what is split have errors of their own
NAMED = 3  # surfaces in a warning
BLAMED = 0.3  # of what a surface's own error may be: what comes with the light
MOST_STRAIN = 16.0  # how much finer links get there
LENIENT = 3.0  # surpluses alone promise too much in gaps: what is found there decides
HALVED = 0.5  # of the error expected on a surface, what a refinement leaves where its own is too large
MAX_ROUNDS = 12  # refinements towards one target
TIGHTER, TIGHTEST = 0.03, 1e-5  # tolerance of the solver, of the last, where its rest is most of the error; the least
MAX_KRYLOV = 60
CANCELLED = 0.25  # of what direct light makes alone, that is left where indirect light takes it back
AMPLIFIED = 0.03  # relative residual in solving for an error
SAMPLES = 128  # points where the residual is measured each round; half of them on the way to the target
SEED = 20  # of the samples: runs repeat
LOOKS = 4  # sets of samples at most, where the error found hangs on one point
FINER = 0.25  # tolerance of their links, of the round's
SAFETY = 2.6  # of what samples find to what is stated: they miss penumbrae, and rounds stop where they found little
REFINE_TO = 0.9 / SAFETY  # of the target: what a refinement leaves in the leaves not split
ROUNDED = 0.2 * 2**-24  # of the light: what single precision costs, as a row's entries are off either way
STIFF = 1.0  # of what amplified errors of sources come to: between white planes 1.04 to 7 times the true one is stated
STIFF_OWN = 0.3  # the same of one surface alone
STRAIGHTER = 0.3  # part of the bends of the sources that a refinement leaves, where they are most of the error
CANCEL = 0.5  # of an error of either sign this part is left in the mean, which the rooms amplify
DENSER = 1.2  # what the next rows may take, of what the last ones took
FEWEST_NODES, USUAL_NODES = 15, 25  # that a surface starts with
SMALLER = "leave small objects out of the scene (hide them from renders) or join flat ones into larger planes"
FULL = "the field is as fine as the memory allows"
FACTORS = 1 << 10  # of lights, and of the background as many as there are shapes, between two signs of life
EVALUATE = 1 << 13  # points evaluated at once, at most
FIRST_CHUNK = 256  # points of the first evaluation; the later ones are sized by what it took
CHUNK_SECONDS = 0.08  # a window stays usable when each takes about this long, and larger chunks gain little


class Solution(ReadOff):
    """Radiance everywhere on the scene's surfaces; see `solve`."""

    def __init__(self, state):
        self._state = state = copy.copy(state)  # arrays are replaced as the state grows on, never written into
        state.field, state.sent = copy.copy(state.field), copy.copy(state.sent)
        self.scene, self.plan, self.counts = state.given, state.plan, dict(state.counts)
        self.error, self.error_parts = state.error, dict(state.error_parts)
        self.surface_errors = state.own_errors  # (n surfaces,) each one's own: relative L2, estimated
        self.surface_norms = state.shared.norm  # (n surfaces,) as norm, of each
        self.norm = state.norm  # ||L - Le||, radiance times metres
        self.nodes = len(state.sent.keys)
        self.seconds, self.history, self.warnings = state.elapsed(), list(state.history), []

    def incident_steps(self, surface, points, normals=None, inward=None, roughly=False):
        """Irradiance / pi (n, 3) at points (n, 3) m of surfaces (n,), see incident: generator of the fraction done."""
        out, done, chunk = np.empty((len(points), 3)), 0, FIRST_CHUNK
        while done < len(points):
            begun = time.perf_counter()
            part = slice(done, done + chunk)
            out[part] = self._state.incident(surface[part], points[part] - self._state.origin)
            speed = chunk / max(time.perf_counter() - begun, 1e-6)
            done, chunk = done + chunk, int(np.clip(speed * CHUNK_SECONDS, FIRST_CHUNK, EVALUATE))
            yield min(done / len(points), 1.0)
        return np.maximum(out, 0.0)

    def estimated_error_steps(self, surface, points):
        """(n,) at points (n, 3) m of surfaces (n,), see estimated_error: generator of the fraction done."""
        on, sent, out = np.empty(points.shape), self._state.sent, np.empty(len(points))
        for k, mine in runs_of(surface):
            on[mine] = self.scene.surfaces[k].shape.project(points[mine]) - self._state.origin
        for start in range(0, len(points), EVALUATE):
            part = slice(start, start + EVALUATE)
            placed = sent.locate(surface[part], sent.local(surface[part], on[part]))
            out[part] = sent.interpolate(placed, self._state.node_error[:, None])[:, 0]
            yield start / len(points)
        return SAFETY * np.maximum(out, 0.0)

    def irradiance(self, points, normals):
        """points (n, 3) m, normals (n, 3) of any length but 0, anywhere in space -> irradiance / pi (n, 3)"""
        points, normals = oriented(points, normals)
        points, free = points - self._state.origin, np.full(len(points), -1)
        indirect = self._state.gathered(points, normals, free, self._state.link_tolerance)
        return indirect + self._state.direct(points, normals, free)

    def relight(self, scene):
        """The same shapes and sides with other reflectance, emission or background -> Solution, without visibility."""
        if self._state.rows is None:
            raise SceneError("relight: this solution was delivered early, without what relighting needs; solve again")
        return _relit(self._state, scene)

    def kept_steps(self, surface, points, normals=None, inward=None):
        """Kept of points (n, 3) m of surfaces (n,): generator of the fraction done."""
        if self._state.rows is None:
            raise SceneError("kept: this solution was delivered early, without what relighting needs; solve again")
        kept = KeptLinks(self._state, surface, points)
        yield from kept.steps(self._state, EVALUATE // 8)
        return kept

    def let_go(self):
        """Make room for the rows of a better solution: this one cannot be relit any more."""
        self._state.rows = None


class _State:
    """Everything a solution grows from."""

    def __init__(self, scene, target_error=1e-2):
        self.given, self.started = scene, time.perf_counter()
        scene, self.origin = settle(scene)
        self.scene = scene
        self.counts = Counter()
        self.factors = Factors(scene, Shafts(scene), self.counts)
        self.plan = plan(scene, target_error, shafts=self.factors.shafts)
        if self.plan.counts["nodes"] > _most_nodes():
            raise SceneError(_too_many(scene))
        self.reached = self.plan.reached
        self.area = scene.areas[self.reached].sum() or scene.areas.sum()  # m^2, of what light may come to
        self.field = Field(scene)  # where indirect light is gathered
        self.sent = Field(scene)  # finer: what the surfaces send on, direct light with its shadows included
        self.lights = np.flatnonzero((scene.emission > 0).any(axis=1))
        self.reflectors = np.flatnonzero((scene.reflectance > 0).any(axis=1) & self.reached)
        self.background = bool((scene.background > 0).any())
        self.light = np.concatenate([scene.emission[self.lights], scene.background[None]])
        self.added = np.zeros((len(scene), 3))  # emission of surfaces that became lights by relighting
        self.error, self.error_parts, self.history = float("inf"), {}, []
        self.own_errors, self.strain = np.full(len(scene), np.inf), np.ones(len(scene))
        self.fractions = np.zeros((0, len(self.lights) + 1))
        self.indirect = np.zeros((len(self.field.keys), 3))
        self.rows, self.density, self.full = Rows(), 1.0, False  # the part of all nodes that blocks of rows use
        self.cramped = False  # less was refined than asked for, lest the memory get full
        self.link_target, self.sharpness = None, 1.0
        self.measured, self.solver_share = False, 1.0
        self.optimism = 1.0  # error measured by residuals, of the error the surpluses promise
        self.exact, self.remembered, self.looks = {}, {}, []

    def elapsed(self):
        return time.perf_counter() - self.started

    # -- light ---------------------------------------------------------------------------------------------------

    def direct(self, points, normals, surface):
        if not len(self.lights) and not self.background:
            return np.zeros((len(points), 3))
        return self.factors.matrix(points, normals, surface, self.lights, self.background) @ self.light

    def incident(self, surface, points):
        """points (n, 3) m near surfaces (n,) -> irradiance / pi (n, 3); direct light and the leading sources exact."""
        out = np.empty((len(points), 3))
        for s, part, lights, exact, cell, weight, covered in self.seen(surface, points):
            out[part] = lights @ self.light + self.received[s].between(cell, weight, exact)
            out[part[covered]] = 0.0
        return out

    def seen(self, surface, points):
        """Of points (n, 3) m near surfaces (n,), what each surface's see of the sources, and where they lie in the
        field: [(s, index (k,), factors (k, lights + 1), of exact sources (k, e), cells (k,), weights (k, 9), covered)].
        """
        on, x, normals = np.empty((3, *points.shape))
        present = np.unique(surface)
        parts = [np.flatnonzero(surface == s) for s in present]
        sources = [self.reflectors[self.received[s].exact] for s in present]
        wanted = [np.union1d(self.lights, exact) for exact in sources]
        for s, part in zip(present, parts):
            own = self.scene.surfaces[s]
            on[part] = own.shape.project(points[part])
            normals[part], x[part] = own.normals(on[part]), self.field.inset(s, on[part])
        factors = self._factors(x, normals, surface, parts, wanted)
        covered, out = contacts_of(self.scene).covered(x, surface), []
        for s, part, needed, exact, factor in zip(present, parts, wanted, sources, factors):
            lights = np.append(np.searchsorted(needed, self.lights), -1)
            own = np.full(len(part), s)
            placed = self.field.locate(own, self.field.local(own, x[part]))
            exact = factor[:, np.searchsorted(needed, exact)]
            out.append((s, part, factor[:, lights], exact, *placed, covered[part]))
        return out

    def _factors(self, x, normals, surface, parts, wanted):
        """Factors of the wanted sources, and the background's last, at parts of the points; kept for relighting."""
        key = hash(x.tobytes()), tuple(surface[part[0]] for part in parts)
        if key not in self.remembered:
            self.remembered[key] = self.factors.lists(x, normals, surface, parts, wanted, self.background)
        return self.remembered[key]

    def links(self, points, normals, surface, tolerance):
        """Yield Blocks of rows over the nodes of `sent` at points, and None between as a sign of life."""
        gather = Gather(self.sent, self.factors, self.reflectors)
        yield from gather.blocks(points, normals, surface, self.detail(), self.tolerance(points, surface, tolerance))
        self.counts["links"] += gather.links

    def gathered(self, points, normals, surface, tolerance):
        """Indirect irradiance / pi (n, 3) at points."""
        rows = Rows([block for block in self.links(points, normals, surface, tolerance) if block], len(points))
        return rows.times(self.radiosity())

    def radiosity(self):
        """(n sent nodes, 3): what the nodes send on besides the lights' uniform emission."""
        own = self.sent.node_surface
        return self.scene.reflectance[own] * (self.lit + self.spread(self.indirect)) + self.added[own]

    def spread(self, indirect):
        """Values (n nodes, c) of the field at the nodes of `sent`."""
        return self.field.interpolate(self.placed, indirect)

    def gain(self):
        """How much the rooms amplify an error spread evenly: 1 / (1 - share of the light that is indirect)."""
        own = self.sent.node_surface
        rho, received = self.scene.reflectance[own], self.lit + self.spread(self.indirect)
        direct = self.lit
        if self.added.any():  # what has begun to shine sends its light as indirect light goes
            direct = direct + self.spread(self.rows.times(self.added[own]))
        share = 1 - (rho * direct).sum() / max((rho * received).sum(), 1e-300)
        return 1.0 / max(1.0 - share, 1e-6)

    # -- geometry ------------------------------------------------------------------------------------------------

    def grow(self, cells):
        """Split these leaves of `sent`; direct light at its new nodes, exact; yields."""
        f, old = self.sent, len(self.fractions)
        f.refine(cells)
        own = f.node_surface[old:]
        new = yield from self.received_directly(f.points[old:], f.normals[old:], own)
        self.fractions = np.concatenate([self.fractions, new])
        self.lit = self.fractions @ self.light
        self.place()
        self.measure()

    def received_directly(self, points, normals, surface):
        """Factors (n, lights + 1) of all lights, and the background's last; yields."""
        step = max(1, FACTORS // (len(self.lights) + len(self.scene.shapes) * self.background + 1))
        parts = [np.zeros((0, len(self.lights) + 1))]
        for start in range(0, len(points), step):
            k = slice(start, start + step)
            parts.append(self.factors.matrix(points[k], normals[k], surface[k], self.lights, self.background))
            yield
        return np.concatenate(parts)

    def place(self):
        """Where the nodes of `sent` lie in the field: cells (n,) and weights (n, 9)."""
        f = self.sent
        self.placed = self.field.locate(f.node_surface, f.local(f.node_surface, f.points))

    def light_up(self, target, final):
        """Refine where shapes touch, and `sent` until direct light is sent on well enough for `final`; yields."""
        own = np.sqrt([shape.area for shape in self.scene.shapes])
        share = CONTACT_SHARE * min(target, CONTACT_LEAST)
        flat = FLAT * target / min(target, CONTACT_LEAST)
        smallest = share * np.sqrt(self.area)
        touching = np.minimum(smallest, share * CONTACT_OWN * own)
        while 0 < len(cells := crowded(self.field, smallest, touching, flat, self.reached)) <= self.room(LIGHT_NODES):
            yield from self.split(cells)
            yield
        while True:
            error = leaf_errors(self.sent, self.scene.reflectance[self.sent.node_surface] * self.lit)
            cells = _worst(self.sent, error, SENT_SHARE * final * self.scale)
            if self.measured:
                own = self.shared.allowed(SENT_SHARE * final / self.caught)
                cells = np.union1d(cells, worst_of_parts(self.sent, error, own))
                cells = cells[np.argsort(error[cells], kind="stable")]
            room = self.room(LIGHT_NODES)
            if not min(len(cells), room):
                return
            yield from self.grow(cells[-room:])  # the worst come last
            yield

    def measure(self):
        """Norm of L - Le over all surfaces: sqrt of the area integral of the squared channels."""
        f = self.sent
        light = self.lit + self.spread(self.indirect)
        self.shared = Light(f, self.scene.reflectance[f.node_surface] * light)
        self.norm = float(np.linalg.norm(self.shared.norm))
        self.caught = max(1.0, CANCEL * self.gain())
        self.scale = self.norm / self.caught  # what local errors are to be small against
        self.level = self.scale / np.sqrt(self.area)

    def detail(self):
        """How the sources vary, for the choice of links."""
        f, value = self.sent, self.radiosity()
        variation = np.ptp(value[f.nodes], axis=1).max(axis=1)
        surplus = np.abs(f.surplus(value)).max(axis=(1, 2))
        below = np.zeros(len(f.level))
        for level in range(f.level.max(), 0, -1):
            cells = np.flatnonzero(f.level == level)
            np.maximum.at(below, f.parent[cells], np.maximum(below[cells], surplus[cells]))
        low, high = np.full((len(self.scene), 3), np.inf), np.full((len(self.scene), 3), -np.inf)
        np.minimum.at(low, f.node_surface, value)
        np.maximum.at(high, f.node_surface, value)
        return Detail(variation, below, (high - low).max(axis=1))

    def tolerance(self, points, surface, tolerance):
        """Link tolerance (m,) of receivers at points (m, 3) on surfaces (m,): black ones need less, dark ones more."""
        rho = np.where(surface >= 0, self.scene.reflectance[surface].max(axis=1), 1.0)
        return tolerance / np.maximum(rho, 0.05) / self.stress[self.field.part_at(surface, points)]

    def extend(self):
        """Rows for the nodes that have none and that light reaches; yields now and then."""
        f = self.field
        new = self.rows.missing(len(f.keys))
        new = new[self.reached[f.node_surface[new]] & bool(len(self.reflectors) and self.norm > 0)]
        blocks, own, size, most = [], f.node_surface[new], 0, MEMORY - self.rows.bytes
        for block in self.links(f.points[new], f.normals[new], own, self.link_tolerance):
            if block:
                block.rows = new[block.rows]
                blocks.append(block)
                size += block.values.nbytes
            if size > most:
                self.full = True
                return
            yield
        if blocks:
            self.density = max(size / (4 * len(new)), 1.0) / len(self.sent.keys)  # an entry a row at least
        self.rows = self.rows.grown(blocks, len(f.keys))

    # -- solving -------------------------------------------------------------------------------------------------

    def solve(self, tolerance):
        """I = A rho (D + I) + A added, from the guess at hand; for one of each set of proportional channels; yields."""
        own = self.sent.node_surface
        which, channels = self.channels()
        rho = self.scene.reflectance[own][:, which]

        def scatter(value):
            return self.rows.times(rho * self.spread(value))

        right = self.rows.times(rho * self.lit[:, which] + self.added[own][:, which])
        value, steps, left = yield from gmres(scatter, right, self.indirect[:, which], tolerance, MAX_KRYLOV)
        # of the solution's size, which the rooms' gain has made larger than the right side
        self.solver_error = left * np.linalg.norm(right) / max(np.linalg.norm(value), 1e-300)
        self.indirect = value @ channels
        self.counts["iterations"] += steps
        self.measure()

    def channels(self):
        """Channels to solve for, and what makes all three of them."""
        return proportional_channels(self.scene)

    def by_source(self, value):
        """Nodal radiosity -> what each node receives from each reflector (n, s, 3), and the form factors (n, s)."""
        part = np.full(len(self.scene), -1)
        part[self.reflectors] = np.arange(len(self.reflectors))
        value = np.column_stack([value, np.ones(len(value))])
        out = yield from self.rows.times_by_part(value, part[self.sent.node_surface], len(self.reflectors))
        return out[..., :3], out[..., 3]

    def divide(self, target):
        """Received light of every surface split by source; estimates of what interpolation costs; yields."""
        f, value = self.field, self.radiosity()
        received, factors = yield from self.by_source(value)
        lights = np.flatnonzero(np.isin(self.reflectors, self.lights))
        rho = self.scene.reflectance
        sent = leaf_errors(self.sent, value)[self.sent.leaves] ** 2
        self.sent_error = float(np.sqrt(sent.sum()))
        self.leaf_error, self.received = np.zeros(len(f.level)), []
        for s in range(len(self.scene)):
            nodes = f.node_surface == s
            share = max(self.scene.areas[s] / self.area, 0.5 / len(self.scene))
            allowed = EXACT_SHARE * target * min(self.scale * np.sqrt(share), OWN * self.shared.norm[s] or np.inf)
            part = Received(f, s, received[nodes], factors[nodes], self.reflectors)
            part.choose(rho[s], allowed, self.exact.get(s, lights), s in self.exact)
            self.leaf_error[part.leaves] = part.leaf_error
            self.received.append(part.conform())
            yield
        self.promised = self._promised()
        self.sent_error /= max(self.norm, 1e-300)

    def _promised(self):
        return float(np.linalg.norm(self.leaf_error[self.field.leaves])) / max(self.norm, 1e-300)

    # -- error ---------------------------------------------------------------------------------------------------

    def check(self, target):
        """Relative error of L_h, in named parts, from the residual at random points; yields."""
        self.looks, self.remembered = [], {}
        if self.norm > 0 and len(self.reflectors):
            yield from self.amplify()
        while self.norm > 0 and len(self.reflectors) and len(self.looks) < LOOKS:
            yield from self.look(SEED + len(self.looks))
            residual = yield from self.judge()
            if self.error <= target or not residual.hangs_on_one:
                break
        if not self.looks:
            self.error, self.error_parts, self.own_errors = 0.0, {}, np.zeros(len(self.scene))
            self.node_error = np.zeros(len(self.sent.keys))
        else:
            self.learn(residual)
            self.optimism = self.error_parts["discretisation"] / max(self._promised(), 1e-300)
            self.measured = True
        self.history.append((self.elapsed(), self.error))

    def look(self, seed):
        """Geometry of random points whose residual tells the error: finer rows, and factors of the lights; yields."""
        light = np.where(self.shared.counts, self.shared.norm, 0.0)
        surface, points, normals, weight = sample_points(
            self.field, self.leaf_error, light, self.reached, self.samples, seed
        )
        blocks = []
        for block in self.links(points, normals, surface, self.link_tolerance * FINER):
            if block:
                blocks.append(block)
            yield
        fractions = yield from self.received_directly(points, normals, surface)
        weight = np.where(contacts_of(self.scene).covered(points, surface), 0.0, weight)
        self.looks.append(Look(surface, points, weight, Rows(blocks, len(points)), fractions))

    def amplify(self):
        """What the scene makes of errors of its sources and of what the solver left: solved for like light; yields."""
        own = self.sent.node_surface
        rho = self.scene.reflectance[own]

        def scatter(value):
            return self.rows.times(rho * self.spread(value))

        def size(error):
            return norms(self.sent, np.linalg.norm(rho * self.spread(error), axis=1))

        lit = self.rows.times(rho * source_defect(self.sent, self.lit))
        indirect = self.rows.times(rho * self.spread(source_defect(self.field, self.indirect)))
        unsolved = self.rows.times(rho * (self.lit + self.spread(self.indirect)) + self.added[own]) - self.indirect
        unsolved += np.copysign(ROUNDED, unsolved.sum()) * self.indirect
        right = np.concatenate([lit, lit + indirect, unsolved], axis=1)
        rho = np.tile(rho, 3)
        error = (yield from gmres(scatter, right, np.zeros_like(right), AMPLIFIED, MAX_KRYLOV))[0]
        rho = rho[:, :3]
        # bends of direct and of indirect light may cancel, but are not known well enough to rely on it
        light, indirect, rest = (size(error[:, k : k + 3]) for k in (0, 3, 6))
        self.own_amplified = np.linalg.norm([indirect, CANCELLED * light, rest], axis=0)
        self.amplified_light, self.amplified_rest, self.amplified = (
            float(np.linalg.norm(v)) / self.norm for v in (light, rest, self.own_amplified)
        )

    def judge(self):
        """Error and its parts from the points looked at -> Residual; yields."""
        value, parts = self.radiosity(), []
        for look in self.looks:
            fine = look.rows.times(value) + look.fractions @ self.light
            here = self.incident(look.surface, look.points)
            parts.append(self.scene.reflectance[look.surface] * (fine - here))
        residual = Residual(self.looks, np.concatenate(parts))
        found = residual.rms / self.norm
        if self.measured:
            found = float(np.sqrt((found**2 + (self.optimism * self.promised) ** 2) / 2))
        self.error_parts = {
            "discretisation": found,
            "gather": self.gain() * residual.mean / self.norm,
            "sent": self.sent_error * self.norm / self.scale,
            "solver": self.gain() * self.solver_error,
        }
        # amplified beyond what is found at points, where errors of either sign are
        known = found + self.error_parts["sent"]
        self.error_parts["stiff"] = float(np.sqrt(max((STIFF * self.amplified) ** 2 - known**2, 0.0)))
        self.error = SAFETY * float(np.sqrt(sum(v * v for v in self.error_parts.values())))
        yield from self.each(residual)
        return residual

    def each(self, residual):
        """(n surfaces,) Each one's own relative error; yields."""
        f = self.field
        error = self.optimism * self.leaf_error
        promised = np.sqrt(np.bincount(f.surface[f.leaves], error[f.leaves] ** 2, len(self.scene)))
        found = residual.by_surface(self.scene.areas)
        rho = self.scene.reflectance.max(axis=1)[self.sent.node_surface]
        flow = Flow(f, self.sent, self.rows, self.placed, rho)
        received = rho * (yield from flow.received(error, leaf_errors(self.sent, rho[:, None] * self.lit)))
        self.flow, self.flow_received = flow, received
        self.told, self.own_promised = np.sqrt(found[1]), promised
        received = np.hypot(norms(self.sent, received), STIFF_OWN * self.own_amplified)
        own, self.own_here, self.own_passed = own_errors(self.shared, found, promised, received)
        self.own_errors = SAFETY * np.where(own > 0, np.hypot(own, self.error_parts["solver"]), 0.0)
        # where surpluses are, as large as what points found on the surface
        local = self.spread(flow.spread_out)[:, 0]
        found = self.own_here * self.shared.norm / np.maximum(norms(self.sent, local), 1e-300)
        self.node_error = np.hypot(found[self.sent.node_surface] * local, self.flow_received)

    def misses(self):
        """The target that would be met, by the whole scene's light and each surface's own."""
        return max(self.error, self.own_errors[self.shared.counts].max(initial=0.0) / OWN)

    def too_large(self, target):
        """(n surfaces,) Whether own errors, but of the darkest, are above what they may be."""
        return (self.own_errors > OWN * target) & self.shared.counts

    def to_mend(self, target):
        """Surfaces (k,) where own errors arise that are too large."""
        return np.flatnonzero(self.too_large(target) & (self.own_here > SURE * OWN * target / SAFETY))

    def blamed(self, target):
        """Leaves of the field whose errors, passed on with the light, make own errors elsewhere too large; yields."""
        far = self.too_large(target) & (self.own_passed > BLAMED * OWN * target / SAFETY)
        if not far.any():
            return np.zeros(0, int)
        own, norm = self.sent.node_surface, np.maximum(self.shared.norm, 1e-300)
        # of each surface's own error, an L2 norm, by the error received at each node
        weight = areas_of_nodes(self.sent) * self.flow_received / np.maximum(self.own_passed * norm**2, 1e-300)[own]
        each = yield from self.flow.blame(np.where(far[own], weight * self.scene.reflectance.max(axis=1)[own], 0.0))
        leaves = self.field.leaves[self.field.level[self.field.leaves] < DEEPEST]
        leaves = leaves[np.argsort(each[leaves], kind="stable")]
        return leaves[np.cumsum(each[leaves]) > HALVED * each[leaves].sum()]

    def tighten(self, target):
        """Rows anew with finer links on the surfaces whose own errors are too large, and larger than surpluses promise;
        False where there are none."""
        mended = self.to_mend(target)
        mended = mended[(self.told[mended] > NOISY * self.own_promised[mended]) & (self.strain[mended] < MOST_STRAIN)]
        if self.cramped or not (self.checked and len(mended)):
            return False
        self.strain[mended] /= SHARPER
        self.rows = self.rows.without(np.flatnonzero(np.isin(self.field.node_surface, mended)))
        self.put_under_stress()
        return True

    def put_under_stress(self):
        """How much finer links have to be at points of each part, the last: in space."""
        strain = np.repeat(self.strain, self.field.charts)
        self.stress = np.append(self.shared.stress(self.level) * strain, 1.0)

    def learn(self, residual):
        """Leaves whose residual is larger than their surplus promised, and their siblings, are to be refined."""
        f = self.field
        cells = f.locate(residual.surface, f.local(residual.surface, residual.points))[0]
        found = np.linalg.norm(residual.value, axis=1)
        child = f.child[f.parent[cells]]
        family = np.where((f.parent[cells] >= 0)[:, None], child[:, None] + np.arange(4), cells[:, None])
        error = found[:, None] * np.sqrt(f.sizes()[family]) * (f.child[family] < 0)
        np.maximum.at(self.leaf_error, family, error)

    def refine(self, target):
        """Split the leaves that hold most of the estimated error; False where nothing is left to split; yields."""
        f = self.field
        error, allowed = np.clip(self.optimism, 0.5, 2.0) * self.leaf_error, REFINE_TO * target * self.scale
        if self.checked:  # what was found has to fall by so much, however little was promised
            allowed = min(allowed, SURE * target / self.error * np.linalg.norm(error[f.leaves]))
        own = LENIENT * self.shared.allowed(REFINE_TO * target / self.caught)
        if self.checked and len(mended := self.to_mend(target)):
            found = np.sqrt(np.bincount(f.part[f.leaves], error[f.leaves] ** 2, len(own)))
            part = np.isin(np.repeat(np.arange(len(self.scene)), f.charts), mended)
            own[part] = np.minimum(own[part], HALVED * found[part])
        cells = np.union1d(_worst(f, error, allowed), worst_of_parts(f, error, own))
        if self.checked:
            cells = np.union1d(cells, (yield from self.blamed(target)))
        if not len(cells):
            return False
        cells, room = cells[np.argsort(error[cells], kind="stable")], self.room()
        if room < len(cells):
            self.cramped = True
            cells = cells[max(len(cells) - room, 0) :]  # the worst come last
        if room > 0:
            yield from self.split(cells)
        return room > 0

    def sharpen(self):
        """All rows anew with finer links where they are most of the error: all off to one side, or no less where the
        surpluses have become small; False where not."""
        parts = self.error_parts
        one_sided = parts.get("gather", 0.0) >= max(parts.get("discretisation", 0.0), parts.get("sent", 0.0))
        if not self.checked or not (one_sided or self.optimism > NOISY):
            return False
        self.sharpness *= SHARPER
        self.link_up(self.link_target)
        return True

    def straighten(self):
        """Where errors that the scene amplifies are most of all: split the cells, of direct light or of the field, over
        which the sources bend, or solve better; False where not, or where there is no more to gain; yields."""
        parts = self.error_parts
        stiff = parts.get("stiff", 0.0) >= max((v for k, v in parts.items() if k != "stiff"), default=np.inf)
        if not (self.checked and stiff):
            return False
        if self.amplified_rest > self.amplified / 2:
            self.solver_share *= TIGHTER
            return self.solver_share > TIGHTEST
        light = self.amplified_light > self.amplified / 2
        f, value = (self.sent, self.lit) if light else (self.field, self.indirect)
        bend = bends(f, self.scene.reflectance[f.node_surface] * value)
        part = np.zeros(len(f.level))
        part[f.leaves] = np.sqrt(np.linalg.norm(bend, axis=1) * f.sizes()[f.leaves])  # they add up, not their squares
        cells = _worst(f, part, np.sqrt(STRAIGHTER) * np.linalg.norm(part))
        room = self.room(LIGHT_NODES if light else 1.0)
        if not min(len(cells), room):
            return False
        if light:
            yield from self.grow(cells[-room:])
            self.link_up(self.link_target)
        else:
            yield from self.split(cells[-room:])
        return True

    def link_up(self, target):
        """Drop all rows; those to come have links fit for `target`."""
        self.rows, self.link_target = Rows(), target
        self.put_under_stress()
        self.link_tolerance = LINK_SHARE * min(1.0, np.sqrt(target / MANY)) * self.sharpness * target * self.level

    def room(self, share=1.0):
        """How many cells may still be split within this share of the memory."""
        rows, columns = len(self.field.keys), len(self.sent.keys)
        entries = share * MEMORY / 4 / min(1.0, DENSER * self.density)
        # (rows + more) (columns + more) = entries
        more = (np.sqrt((columns - rows) ** 2 + 4 * entries) - rows - columns) / 2
        return int(max(more, 0.0)) // CELL_NODES

    def split(self, cells):
        """Split these leaves of the field, and those of `sent` that would be coarser; yields."""
        f = self.field
        old = len(f.keys)
        f.refine(cells)
        self.indirect = np.concatenate([self.indirect, f.predict(self.indirect, old)])
        self.place()
        while len(coarser := self._coarser()):
            yield from self.grow(coarser)

    def _coarser(self):
        """Leaves of `sent` that are coarser than the field: it has to carry the field's detail."""
        f = self.field
        leaves = f.leaves
        points = f.points[f.nodes[leaves, 4]]
        there = self.sent.locate(f.surface[leaves], f.local(f.surface[leaves], points))[0]
        return np.unique(there[self.sent.level[there] < f.level[leaves]])


def _worst(field, error, allowed):
    """Leaves to split so that those left hold no more than `allowed` of the error (n cells,), in L2."""
    leaves = field.leaves
    leaves = leaves[(error[leaves] > 0) & (field.level[leaves] < DEEPEST)]
    part = error[leaves] ** 2
    order = np.argsort(part)
    return leaves[order[np.cumsum(part[order]) > allowed**2]]


def solve_steps(scene, target_error=1e-2, time_limit=None, enough=lambda: False):
    """Generator of Progress at least ten times a second; returns the Solution. Closing it cancels.

    target_error: of the radiance, relative L2 over all surfaces, of L - Le. time_limit: seconds, None for none.
    enough(): asked at every step; True ends with the best so far, once there is one.
    """
    target_error, time_limit = _check(scene, target_error, time_limit)
    choice = choose(scene, target_error)
    if choice.by_rays:
        steps = ray_steps(scene, target_error, time_limit, choice.why, enough)
        return (yield from mapped(steps, lambda now: Progress(_done(now[0], target_error), *now)))
    _check_memory(scene)
    state, best = (yield from _set_up(scene, target_error)), _Best(time_limit, target_error, enough)
    try:
        for _ in _approach(state, best, target_error):
            yield Progress(_fraction(state, target_error), state.error, state.elapsed())
            best.check_time(state)
    except _OutOfTime:
        pass
    return _finish(best.solution, state, target_error)


def _set_up(scene, target_error):
    """Generator of Progress; returns the _State to begin with."""
    start = time.perf_counter()
    steps = in_thread(_State, scene, target_error)
    return (yield from mapped(steps, lambda _: Progress(0.0, float("inf"), time.perf_counter() - start)))


class _OutOfTime(Exception):
    """The time limit is reached, and there is something to deliver."""


class _Best:
    """The best solution so far, and the time until which a better one is looked for."""

    def __init__(self, time_limit, target_error, enough=lambda: False):
        self.solution, self.limit, self.target, self.enough = None, time_limit, target_error, enough

    def add(self, state):
        """Take the solution at hand, unless an earlier one is better: out of memory, finer lights cost elsewhere."""
        if self.solution is None or self._rank(state) <= self._rank(self.solution._state):
            self.solution = Solution(state)

    def _rank(self, state):
        return max(state.error, self.target), state.misses()

    def check_time(self, state):
        if self.solution is not None and self.enough():
            raise _OutOfTime
        if is_over(self.limit, state.elapsed(), self.solution is not None):
            raise _OutOfTime


def _approach(state, best, target_error):
    """Rounds towards ever lower targets, until the last is met or no better solution is to be had; yields."""
    yield from state.grow(state.sent.leaves[:0])
    for target, final in _ladder(target_error):
        state.samples = SAMPLES if target == target_error else SAMPLES // 2
        yield from state.light_up(target, final)
        if final != state.link_target:
            state.link_up(final)
        for turn in range(MAX_ROUNDS):
            if best.solution and not state.rows.blocks:
                best.solution.let_go()
            yield from _round(state, target, turn == MAX_ROUNDS - 1)
            if state.full:
                return
            if state.checked:
                best.add(state)
                yield
            if state.checked and state.error <= target and (target > target_error or not state.too_large(target).any()):
                break
            # where only some surface's own error is too large, what helps is local
            whole = not state.checked or state.error > target
            if whole and ((yield from state.straighten()) or (target == target_error and state.sharpen())):
                continue
            tightened = target == target_error and state.tighten(target)
            if (yield from state.refine(target)) or tightened:
                continue
            if not state.checked:  # nothing left to split although little was promised: measure what it is
                yield from state.check(target)
                best.add(state)
                yield
            break
        if state.error <= target_error and not state.too_large(target_error).any():
            return


def solve(scene, target_error=1e-2, time_limit=None, progress=None):
    """Solution of the scene; progress(fraction, error, seconds) is called at least ten times a second."""
    if progress is not None and not callable(progress):
        raise SceneError(f"progress is {progress!r}; give a function of (fraction, error, seconds), or None")
    steps = solve_steps(scene, target_error, time_limit)
    return finish(steps, progress and (lambda step: progress(*step)))


def _check_memory(scene):
    """Raises SceneError for more surfaces than the memory can hold, at once: without a look at what they are."""
    if len(scene) * FEWEST_NODES > _most_nodes():
        raise SceneError(_too_many(scene))


def _too_many(scene):
    return f"{len(scene)} surfaces are more than the memory can hold, about {_most_nodes() // USUAL_NODES}; {SMALLER}"


def _most_nodes():
    """That the memory has room for rows of."""
    return int(np.sqrt(MEMORY / 4))


def _check(scene, target_error, time_limit):
    if not isinstance(scene, Scene):
        raise SceneError(f"solve needs a Scene, not {scene!r}")
    target_error = number(target_error, "target_error", "a number above 0 such as 0.01", above=0)
    if time_limit is not None:
        time_limit = number(time_limit, "time_limit", "seconds above 0, or None for no limit", above=0)
    return target_error, time_limit


def _ladder(target_error):
    """Targets of the rounds, coarse ones first so that there is always something to deliver, and of their links: two
    rounds share them, so that the rows of the first serve the second."""
    steps = max(1, int(np.ceil(np.log(COARSEST / target_error) / np.log(STEP) - 0.01)))
    return [(target_error * STEP**k, target_error * STEP ** (k - k % 2)) for k in range(steps, -1, -1)]


def _fraction(state, target_error):
    """How much is done, from the error: a rough guide, as the cost of what is left is not known."""
    return _done(state.error, target_error)


def _done(error, target_error):
    if not np.isfinite(error) or error <= 0:
        return 0.0
    return float(np.clip(target_error / error, 0.0, 1.0))


def _finish(solution, state, target_error):
    if solution is None:
        raise SceneError(f"{FULL} and nothing was reached; {SMALLER}")
    solution.seconds, solution.history = state.elapsed(), list(state.history)
    solution.warnings = list(contacts_of(state.scene).warnings)
    if solution.error > target_error:
        memory = state.cramped or state.full
        solution.warnings += [FULL] if memory else []
        advice = f"raise the {'' if memory else 'time limit or the '}target error"
        solution.warnings.append(above_target(solution.error, target_error, advice))
    elif len(dark := np.flatnonzero(solution._state.too_large(target_error))):
        surfaces, own = solution.scene.surfaces, solution.surface_errors
        named = ", ".join(f"{surfaces[k].name!r} {100 * own[k]:.2g} %" for k in dark[:NAMED])
        more = f" and {len(dark) - NAMED} more" if len(dark) > NAMED else ""
        solution.warnings.append(
            f"Of their own light, dark surfaces are off by more than {OWN:g} times the target ({named}{more}); "
            "raise the time limit or lower the target error"
        )
    return solution


def _round(state, target, last):
    """Rows at new nodes, the solve, and where the surpluses promise enough, the check; yields now and then."""
    yield from state.extend()
    if state.full:
        return
    yield from state.solve(SOLVER_SHARE * state.solver_share * target)
    yield from state.divide(target)
    promised = SAFETY * state.optimism * state.promised * state.norm / max(state.scale, 1e-300)
    state.checked = last or promised <= target or state.rows.bytes > MEMORY / 2
    if state.checked:
        yield from state.check(target)


def _relit(old, scene):
    """Solution of old's shapes under other light, from its stored rows and factors."""
    state = _under_other_light(old, scene)
    finish(state.solve(1e-2 * max(old.error, 1e-6)))
    finish(state.divide(old.error))
    if state.looks and state.norm > 0:
        finish(state.amplify())
        finish(state.judge())
    elif not state.norm > 0:
        state.error, state.error_parts, state.own_errors = 0.0, {}, np.zeros(len(scene))
        state.node_error = np.zeros(len(state.sent.keys))
    state.history.append((state.elapsed(), state.error))
    return Solution(state)


def _under_other_light(old, scene):
    """State of old's shapes under other light, to be solved."""
    check_same_shapes(old.given, scene)
    given, scene = scene, settled_again(old.scene, scene)
    lit = reached_by_light(scene, old.factors.shafts) & ~old.reached
    if lit.any():
        name = scene.surfaces[np.flatnonzero(lit)[0]].name
        raise SceneError(f"relight: light now comes to surface {name!r}, where there was none; solve again")
    new = np.setdiff1d(np.flatnonzero((scene.reflectance > 0).any(axis=1) & old.reached), old.reflectors)
    if len(new) or ((scene.background > 0).any() and not old.background):
        raise SceneError("relight: a surface that was black or a background that was dark now sends light; solve again")
    state = copy.copy(old)
    state.scene, state.started, state.counts, state.history = scene, time.perf_counter(), Counter(), []
    state.given = given
    state.light = np.concatenate([scene.emission[old.lights], scene.background[None]])
    state.added = scene.emission.copy()
    state.added[old.lights] = 0.0
    state.exact = {s: part.exact for s, part in enumerate(old.received)}
    state.lit = state.fractions @ state.light
    state.indirect = np.zeros_like(state.indirect)  # the old light may be larger than the new by any factor
    return state
