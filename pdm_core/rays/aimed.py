"""Narrow beams: lamps that light so few places of the nodes that these would not tell how much light comes down.

Rays of such a lamp's own cone choose points, on all that they pass through, and what these receive is worked out as
anywhere. What they reflect is a source of its own, a spot for each surface, as no cell holds what is smaller.
"""

import numpy as np

from ..at_once import AT_ONCE, slices
from ..closed_forms import disc_kernel
from ..shapes.shape import cone_lattice, unit
from ..tolerances import FAINT
from .direct import AT_NODES, POWER, Shares
from .placed import at_hits
from .sources import Emitter, Source

# of a lamp, worked out along them where it lights fewer places of nodes: they tell it to some 2 %; of each of many
RAYS, LEAST_RAYS = 512, 32
ALL_RAYS = 1 << 13  # of all lamps
TOLD = 64  # times as many that tell how much light is in a beam


def spots_of(state, places_lit):
    """[Spot] of those of a RayState's sources that light few places (sources,) of its nodes; yields."""
    beams = np.flatnonzero([bool(source.beam) for source in state.lit.sources])
    beams = beams[places_lit[beams] < RAYS]
    count = int(np.clip(ALL_RAYS // max(len(beams), 1), LEAST_RAYS, RAYS))
    out = []
    for k in beams[places_lit[beams] < count]:  # of the others nodes tell as much as so few rays would
        lamp = state.lit.sources[k]
        points = AimedPoints(state.facets, lamp, count)
        yield from points.light(state, k)
        out += [Spot(state.facets, k, lamp, points, count, own) for own in np.unique(points.surface)]
    return out


class AimedPoints:
    """Where rays of a beam meet a scene, behind each other too: facet, front (p,), place (p, 3) m about the facets'
    centre, area (p,) m^2 that each stands for; once they are lit surface, factor (p,): irradiance / pi of the source's
    unit light, normal (p, 3). Any first few are spread over all."""

    def __init__(self, facets, lamp, count):
        apex, axis, half = lamp.beam
        apex = apex - facets.centre
        some, balls = _within_cone(facets, apex, axis, half)
        rays = cone_lattice(count, axis, half)
        parts = [on_facets(facets, some, apex, rays), on_balls(facets, balls, apex, rays)]
        ray, self.facet, self.front, self.place, area = (np.concatenate(part) for part in zip(*parts))
        # few rays hit an edge of the beam by chance: more tell how much of it they stand for
        few, more = (lamp.power_along(cone_lattice(n, axis, half)).mean() for n in (count, TOLD * count))
        self.area = 4 * np.pi * np.sin(half / 2) ** 2 / count * area * (more / few if few > 0 else 1.0)
        self._keep(np.argsort(_reversed(count)[ray], kind="stable"))

    def light(self, state, k):
        """Works out what source k of a RayState gives at those of the points that send light on; keeps what is lit;
        yields."""
        facets = state.facets
        self.surface = facets.surface[self.facet, np.where(self.front, 0, 1)]
        self._keep((self.surface >= 0) & state.nodes.sends[self.surface])
        receivers = at_hits(facets, self.facet, self.front, self.place)
        one = Shares(facets, [state.lit.sources[k]], state.counts)
        found = yield from one.at(receivers, state.target * state.scale(), state.target, AT_NODES)
        self.factor = found[0][:, 0, 0].astype(float)
        self.place, self.normal = receivers.exact - facets.centre, receivers.normals
        self._keep(self.factor > 0)

    def _keep(self, some):
        for name, value in vars(self).items():
            setattr(self, name, value[some])


class Spot(Source):
    """What a beam, the source number `beam_of`, lights of one surface: points that reflect it, chosen by `count` rays.
    unsure: how far its light may be off, the most where the beam lights others too."""

    is_spot = True

    def __init__(self, facets, beam_of, lamp, points, count, index):
        mine = points.surface == index
        self.beam_of, self.index, self.centre = beam_of, index, facets.centre
        self.normal = points.normal[mine]
        self.place = facets.before(points.place[mine], self.normal)
        self.area, self.weight = points.area[mine], points.area[mine] * points.factor[mine]
        self.unsure = 4 * (1 - mine.sum() / count) / (2 * count) ** POWER + 1 / (2 * count)
        scene, emitter = facets.scene, Emitter(facets, index, facets.scene.surfaces[index].shape)
        super().__init__(self.colour_of(scene, lamp.colour), f"{lamp.name} on {scene.surfaces[index].name}")
        self.surface, self.skip, self.against = scene.surfaces[index], emitter.skip, emitter.against

    def colour_of(self, scene, colour):
        """(3,) of a lamp's colour (3,), what is reflected in the mean."""
        each = scene.surfaces[self.index].reflectance_at(self.place + self.centre)
        return colour * np.average(each, axis=0, weights=self.weight)

    @property
    def square(self):
        """m^2 times the square of radiance: of what it reflects, all over it and in all channels."""
        return (self.weight**2 / self.area).sum() * (self.colour**2).sum()

    def take_light(self, scene, before):
        """The same under other light; before: the sources before it, under that light."""
        self.colour = self.colour_of(scene, before[self.beam_of].colour)
        self.surface = scene.surfaces[self.index]

    def unoccluded(self, points, normals):
        """points, normals (n, 3) -> (n,) irradiance / pi of all its points, the nearest as discs of their area."""
        out, points = np.zeros(len(points)), points - self.centre
        for part in slices(len(points), AT_ONCE // len(self.area)):
            out[part] = disc_kernel(self.place, self.normal, self.area, points[part], normals[part]) @ self.weight
        return out

    def samples(self, count):
        """Places (k, 3) m, normals (k, 3), weights (k,)."""
        return self.place[:count] + self.centre, self.normal[:count], self.weight[:count]

    @property
    def is_tinted(self):
        return callable(self.surface.reflectance)

    def tint(self, places):
        """See Source: the reflectance of the first k places, of the mean."""
        if not self.is_tinted:
            return None
        each = self.surface.reflectance_at(self.place + self.centre)
        return each[: len(places)] / np.maximum(np.average(each, axis=0, weights=self.weight), 1e-300)


def _reversed(count):
    """(count,) ranks of numbers by their reversed bits: any first few of that order are spread over all."""
    k, out = np.arange(count), np.zeros(count)
    for bit in range(max(count - 1, 1).bit_length()):
        out += (k >> bit & 1) / 2.0 ** (bit + 1)
    return out


def _within_cone(facets, apex, axis, half):
    """Facets, and balls, which the cone may meet."""
    low, high = facets.boxes
    radius, offset = np.linalg.norm(high - low, axis=0) / 2, (low + high).T / 2 - apex
    some = np.flatnonzero(in_cone(offset, radius, axis, half + 1e-9))
    return some[some < facets.count], some[some >= facets.count] - facets.count


def in_cone(offset, radius, axis, half):
    """(n,) Whether a part of spheres, offset (n, 3) m from its apex, is within a cone."""
    distance = np.linalg.norm(offset, axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(offset, axis), axis=1), offset @ axis)
    wide = np.arcsin(np.clip(radius / np.maximum(distance, 1e-300), 0.0, 1.0))
    return (distance <= radius) | (angle <= half + wide)


def on_facets(facets, some, apex, rays):
    """ray, facet, front, place and area for a solid angle of 1, of points where rays (r, 3) meet facets some (f,)."""
    o, u, v, n = (a[some] for a in (facets.origin, facets.u, facets.v, facets.normal))
    height = np.einsum("fi,fi->f", o - apex, n)
    across = np.cross(u, v)
    across /= np.maximum(np.einsum("fi,fi->f", across, across), 1e-300)[:, None]
    parts = []
    for part in slices(len(rays), AT_ONCE // max(len(some), 1)):
        d = rays[part]
        cosine = d @ n.T
        length = height / np.where(np.abs(cosine) > FAINT, cosine, np.inf)
        r, k = np.nonzero(length > 0)
        far = length[r, k]
        place = apex + far[:, None] * d[r]
        w = place - o[k]
        s = np.einsum("pi,pi->p", np.cross(w, v[k]), across[k])
        t = np.einsum("pi,pi->p", np.cross(u[k], w), across[k])
        inside = (s >= 0) & (t >= 0) & (np.where(facets.triangle[some[k]], s + t, np.maximum(s, t)) <= 1)
        r, k, far, place, s, t = (a[inside] for a in (r, k, far, place, s, t))
        cosine = cosine[r, k]
        parts.append((part.start + r, some[k], cosine < 0, place, far**2 / np.abs(cosine)))
    return [np.concatenate(part) for part in zip(*parts)]


def on_balls(facets, some, apex, rays):
    """The same of balls some (b,), both sides of each."""
    inverse = facets.ball_inverse[some]
    start = np.einsum("bij,bj->bi", inverse, apex - facets.ball_centre[some])
    step = np.einsum("bij,rj->rbi", inverse, rays)
    a, b = np.einsum("rbi,rbi->rb", step, step), np.einsum("rbi,bi->rb", step, start)
    root = b * b - a * (np.einsum("bi,bi->b", start, start) - 1)
    root = np.sqrt(np.where(root > 0, root, np.nan))
    ends = np.stack([-b - root, -b + root]) / a
    _, r, k = index = np.nonzero(ends > 0)
    far = ends[index]
    local = start[k] + far[:, None] * step[r, k]
    cosine = np.einsum("pi,pi->p", rays[r], unit(np.einsum("pji,pj->pi", inverse[k], local)))
    keep = np.abs(cosine) > FAINT
    r, k, far, local, cosine = (value[keep] for value in (r, k, far, local, cosine))
    place = apex + far[:, None] * rays[r]
    return r, some[k] + facets.count, cosine < 0, place, far**2 / np.abs(cosine)
