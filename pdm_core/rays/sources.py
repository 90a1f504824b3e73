"""What shines: emitting surfaces and lights, what each would give unhidden and points that stand for it."""

import copy

import numpy as np

from ..scene import Light
from ..shapes.mesh import Mesh
from ..tolerances import FLUSH, KEPT, ROUNDING
from .bundles import AGAINST
from .lamp_parts import parted

# barycentric coordinates of places all over a triangle, by which it is told that all of it is covered
ASKED = np.array([(a, b, 8 - a - b) for a in range(9) for b in range(9 - a)]) / 8 * 0.99 + 0.01 / 3
OF_PARTS = 1024  # points that tell a part's mean of emission that varies
BROAD = 2.0  # times the mean emission of all surfaces: what is no brighter fills enough of what is seen for rays


class Source(Light):
    """As a Light, colour (3,): radiance. skip: the shape that does not hide it; own: as of receivers that it gives
    nothing; receivers (n surfaces,) bool: which its light comes to, blockers: Facets of what may hide it, None for all;
    pattern None where it is even; is_surface: whether samples' weights are areas; is_spot: whether it is what a beam
    lights; is_tinted: whether its colour varies over its sample places; partly: the part of receivers that see a part
    of it, see Shares.at; whole: the Shape or Light that it is cut from; unsure: how far its colour may be off, of
    itself."""

    whole, skip, own, partly, pattern, unsure = None, -1, -1, 0.0, None, 0.0
    is_surface = is_spot = is_tinted = False

    def __init__(self, colour, name):
        self.colour, self.name = np.asarray(colour, float), name

    def against(self, points, normals):
        """(n,) Whether it gives nothing there, as it lies against the shape or the point is within it."""
        return np.zeros(len(points), bool)

    def cut(self, facets, length):
        """[Source] its parts, about so many m long at most."""
        return [self]

    def tint(self, places):
        """(k, 3) of its colour at sample places (k, 3) m; None where it is the same everywhere."""
        return None

    def take_light(self, scene, before):
        """Becomes what it is under another scene's light; before: the sources before it, under that light."""
        raise NotImplementedError


class Emitter(Source):
    """An emitting surface, or a part of it, on `shape`. Where its emission varies, colour is its mean and each sample
    point has its own part of it: `tint(points)` (n, 3), of the mean."""

    is_surface = True

    def __init__(self, facets, index, whole, part=None):
        scene = facets.scene
        self.index, self.surface, self.whole, self.shape = index, scene.surfaces[index], whole, part or whole
        super().__init__(self._colour(scene), self.surface.name)
        self.skip = facets.own[scene.shape_of[index]]
        self.tolerance = facets.tolerance
        self.own = facets.plane[facets.first[scene.shape_of[index]]] if self.skip >= 0 else -1
        self.facets, self._samples = facets, {}
        if part is None and whole.is_mesh and len(facets.lying):
            self.shape = self._shown()

    @property
    def sizes(self):
        return np.array([2 * self.shape.bounds[1], self.shape.thickness])

    def cut(self, facets, length):
        return [Emitter(facets, self.index, self.whole, part) for part in self.shape.cut(length)]

    def take_light(self, scene, before):
        self.surface = scene.surfaces[self.index]
        self.colour = self._colour(scene)

    def _colour(self, scene):
        if self.shape is self.surface.shape or not self.is_tinted:
            return scene.emission[self.index]
        return self.shape.mean_of(self.surface.emission_at, self.shape.samples(OF_PARTS))

    def unoccluded(self, points, normals):
        """points, normals (n, 3) -> (n,) irradiance / pi where the radiance is 1 and nothing hides it."""
        factor = self.shape.unhidden(points, normals, self.surface.sign, self.tolerance)
        # where all that is ahead is in the point's own plane: else light to be right to
        factor[factor <= ROUNDING] = 0.0
        return factor

    def against(self, points, normals):
        """(n,) Whether points lie against a flat shape, or within the ball that shines outwards."""
        return self.whole.against(points, normals, self.surface.sign, AGAINST * self.tolerance)

    def distances(self, points):
        """(n,) m of points (n, 3) m from it."""
        return self.shape.gap(points)

    def spacing(self, count):
        """m between neighbours of so many points of it."""
        return np.sqrt(self.shape.area / count)

    def samples(self, count):
        """Places (k, 3) m on it, normals (k, 3), weights (k,) m^2; worked out once, as many of a mesh take long."""
        if count not in self._samples:
            self._samples[count] = self._sampled(count)
        return self._samples[count]

    def _sampled(self, count):
        points = self.shape.samples(count)
        # a triangle shines as its own plane looks, however it is shaded
        normals = self.surface.sign * self.shape.face_normals(points)
        off = np.full(len(points), min(self.shape.lift, FLUSH * self.tolerance))  # no further than what touches it
        hidden = self._covered(points, normals)
        off[hidden] = -KEPT * self.tolerance  # behind what lies on it
        return points + off[:, None] * normals, normals, self.shape.area_shares(points)

    def _covered(self, points, normals):
        """(n,) Whether something lies on it at points (n, 3) m, on the side that normals (n, 3) look to."""
        facets, shape = self.facets, self.surface.shape
        if not len(facets.lying):
            return np.zeros(len(points), bool)
        triangle = shape.nearest(points)[0] if shape.is_mesh else 0
        facet = np.full(len(points), facets.first[facets.scene.shape_of[self.index]]) + triangle
        return facets.lying.covers(facet, points - facets.centre, normals)

    def _shown(self):
        """Of a Mesh that part which is not covered all over; as it is where none is left."""
        mesh = self.whole
        places = np.einsum("pk,tki->tpi", ASKED, mesh.corners).reshape(-1, 3)
        hidden = self._covered(places, np.repeat(self.surface.sign * mesh.triangle_normals, len(ASKED), axis=0))
        left = ~hidden.reshape(-1, len(ASKED)).all(axis=1)
        return mesh if left.all() or not left.any() else Mesh.of(mesh.corners[left])

    @property
    def is_tinted(self):
        return callable(self.surface.emission)

    def tint(self, places):
        """See Source: its emission there, of its mean."""
        return self.surface.emission_at(places) / np.maximum(self.colour, 1e-300) if self.is_tinted else None


class Lamp(Source):
    """Scene.lights[number], or a part of it, which sends that share of its light."""

    def __init__(self, facets, number, light=None, share=1.0):
        self.whole, self.number, self.share = facets.scene.lights[number], number, share
        super().__init__(share * np.asarray(self.whole.colour, float), self.whole.name)
        if self.whole.receivers is not None:
            self.receivers = facets.scene.of_shapes(self.whole.receivers)
        if self.whole.blockers is not None:
            self.blockers = facets.blocking(self.whole)
        light = self.whole if light is None else light
        self.distant, self.sizes = light.distant, light.sizes
        self.unoccluded, self.samples, self.holds = light.unoccluded, light.samples, light.holds
        self.beyond = light.beyond
        self.pattern, self.beam = light.pattern, light.beam
        self.shadows = light.shadows and (self.blockers is None or len(self.blockers.shape) > 0)

    def cut(self, facets, length):
        parts = self.whole.cut(length)
        return [Lamp(facets, self.number, part, 1 / len(parts)) for part in parts]

    def take_light(self, scene, before):
        self.whole = scene.lights[self.number]
        self.colour = self.share * np.asarray(self.whole.colour, float)


def met_by_rays(scene):
    """(n surfaces,) bool: which shine, but as what reflects does: balls' insides, and what is broad rather than bright.
    Points that stand for a large surface are too few for all that is near it, and for what hides a part of it."""
    emission, inside = scene.emission.max(axis=1), scene.inside
    even = ~np.array([callable(s.emission) for s in scene.surfaces])
    mean = (scene.areas * emission).sum() / scene.areas.sum()
    return (emission > 0) & (inside | even & (emission <= BROAD * mean))


def foreseen_level(sources, facets):
    """Irradiance / pi before any is known: a quarter of the most that what shines gives in the middle of the scene."""
    middle, faces = np.tile(facets.centre, (6, 1)), np.concatenate([np.eye(3), -np.eye(3)])
    each = [source.unoccluded(middle, faces).max() * source.colour.max() for source in sources]
    return max([facets.scene.background.max(), *each]) / 4


def relit(sources, scene):
    """The same sources under the light of another scene of the same shapes and lights."""
    out = []
    for source in sources:
        new = copy.copy(source)
        new.take_light(scene, out)
        out.append(new)
    return out


def sources_of(facets, by_rays):
    """[Source] of all that shines, but for surfaces by_rays (n surfaces,) bool, which rays meet."""
    scene = facets.scene
    shines = (scene.emission > 0).any(axis=1) & ~by_rays
    emitters = [Emitter(facets, k, part) for k in np.flatnonzero(shines) for part in scene.surfaces[k].shape.apart]
    return parted(facets, emitters + [Lamp(facets, k) for k in range(len(scene.lights))])
