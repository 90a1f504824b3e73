"""What points receive as a function of the light alone, kept so that other light costs no geometry."""

import copy
from dataclasses import replace

import numpy as np

from .checked import SceneError
from .numerics import gcr
from .read_off import check_same_shapes, materials_at
from .scene import Scene
from .signs_of_life import finish
from .tolerances import FAINT

MOST = 1.5e9  # bytes kept
GROUPS = 1500  # of nodes, at most: their matrix stays in the cache
TRIED = 1.2  # factor of the size of groups, until there are no more
SOLVED = 1e-4  # relative residual of the linear system
LEAST_SHARE = 0.1  # of what groups tell: the light itself, and the most the other way round


class Kept:
    """Points (n, 3) m of surfaces (n,) of a Scene. incident(scene) and radiance(scene) of the same shapes under other
    light; bytes: what it takes of the memory. SceneError where what is kept does not tell."""

    def __init__(self, scene, surface, points):
        self.scene, self.surface, self.points = scene, surface, points
        self.reflectance, self.emission = materials_at(scene, surface, points)

    def radiance(self, scene):
        """Outgoing radiance (n, 3) at the points."""
        light = self.incident(scene)
        return self.emission + self.reflectance * light

    def incident(self, scene):
        """Irradiance / pi (n, 3) at the points."""
        return sum(self.parts(scene))

    def parts(self, scene):
        """Irradiance / pi (n, 3) straight from lights, emission and the background, and by way of reflections."""
        changed = self._changed(scene)
        parts = self.light(scene, changed)
        some = np.flatnonzero(np.isin(self.surface, changed))
        self.reflectance[some], self.emission[some] = materials_at(scene, self.surface[some], self.points[some])
        self.scene = scene
        return [np.maximum(part, 0.0) for part in parts]

    def _changed(self, scene):
        """[index] of the surfaces whose material is another than before."""
        check_same_shapes(self.scene, scene)
        pairs = enumerate(zip(self.scene.surfaces, scene.surfaces))
        return [k for k, (a, b) in pairs if a is not b and not (same(a, b, "reflectance") and same(a, b, "emission"))]


def under_light(scene, materials, background, lights):
    """The Scene under other light: materials {surface index: (reflectance, emission)} that change, background, lights.
    Its shapes are not looked at again."""
    new, surfaces = copy.copy(scene), list(scene.surfaces)
    reflectance, emission = scene.reflectance.copy(), scene.emission.copy()
    for k, (paint, shine) in materials.items():
        surfaces[k] = own = replace(surfaces[k], reflectance=paint, emission=shine)
        for means, value in ((reflectance, own.reflectance), (emission, own.emission)):
            if not callable(value):
                means[k] = value
    other = Scene(scene.surfaces[:1], background, scene.rounding, lights)  # checks them
    values = {"surfaces": tuple(surfaces), "reflectance": reflectance, "emission": emission}
    values |= {name: getattr(other, name) for name in ("background", "sky", "lights")}
    for name, value in values.items():
        object.__setattr__(new, name, value)
    return new


def same(a, b, what):
    a, b = getattr(a, what), getattr(b, what)
    return a is b or not (callable(a) or callable(b)) and np.array_equal(a, b)


class KeptGroups(Kept):
    """Light that comes from sources at once, and by way of groups of nodes, neighbours on one surface, whose matrix is
    small. What falls where within a group stays as the solution had it: under its own light nothing is lost.

    Of each kind are check(scene), which raises where what is kept does not tell, colours(scene) (k, 3) of the sources,
    and shining(scene) (groups, 3): what groups send whatever they receive.

    factor (n, k, 1 or 3) of k sources at the points, rows (n, groups), share (n, 3): the solution's light from the
    groups, of what rows tell; group_factor, group_rows, reflectance_of_groups: of the groups; indirect (groups, 3).
    """

    def __init__(self, scene, surface, points, of, node_surface, weight, sources, channels=1):
        super().__init__(scene, surface, points)
        self.of, self.count = of, int(of.max(initial=-1)) + 1
        self.part = weight / np.maximum(np.bincount(of, weight, self.count), 1e-300)[of]
        self.group_surface = np.zeros(self.count, int)
        self.group_surface[of] = node_surface
        if 4 * (len(points) * (self.count + channels * sources) + self.count**2) > MOST:
            raise SceneError(
                f"Live light would keep more than {MOST / 1e9:g} GB; bake fewer vertices, or to a larger error"
            )
        self.factor = np.zeros((len(points), sources, channels), np.float32)
        self.rows = np.zeros((len(points), self.count), np.float32)
        self.group_rows = np.zeros((self.count, self.count), np.float32)
        self.indirect = np.zeros((self.count, 3))

    def take_nodes(self, factor, reflectance):
        """factor (nodes, k, 1 or 3), reflectance (nodes, 3): their means over the groups."""
        shape = factor.shape[1:]
        self.group_factor = self._mean(factor.reshape(len(factor), -1)).reshape(self.count, *shape)
        self.reflectance_of_groups = self._mean(reflectance)

    def _mean(self, values):
        columns = [np.bincount(self.of, self.part * v, self.count) for v in values.T]
        return np.stack(columns, axis=1) if columns else np.zeros((self.count, 0))

    def settle(self, light):
        """light (n, 3): what the solution has at the points by way of reflections."""
        self.share = np.ones_like(light)
        told = self._reflected(self.scene)
        clear = told > FAINT * max(np.abs(told).max(initial=0.0), 1e-300)  # below it groups tell nothing
        self.share[clear] = np.clip(light[clear] / told[clear], LEAST_SHARE, 1 / LEAST_SHARE)

    def light(self, scene, changed):
        self.check(scene)
        self._take_materials(scene, changed)
        return self._straight(self.factor, scene) + self.sky(scene), self.share * self._reflected(scene)

    def _take_materials(self, scene, changed):
        for k in changed:
            a, b = self.scene.surfaces[k], scene.surfaces[k]
            other = [what for what in ("reflectance", "emission") if not same(a, b, what)]
            shines = "emission" in other and (callable(a.emission) or callable(b.emission))
            if shines or ("reflectance" in other and callable(b.reflectance)):
                raise SceneError(f"Surface {b.name!r} varies from place to place; solve again to see it changed")
            if "reflectance" in other:
                self.reflectance_of_groups[self.group_surface == k] = b.reflectance

    def _straight(self, factor, scene):
        """factor (n, k, 1 or 3) -> (n, 3)"""
        colours = self.colours(scene).astype(np.float32)
        if factor.shape[2] == 1:
            return (factor[..., 0] @ colours).astype(float)
        return np.einsum("nkc,kc->nc", factor, colours)

    def _reflected(self, scene):
        """(n, 3) What the groups send to the points."""
        rho, shining = self.reflectance_of_groups, self.shining(scene)
        outer = self._straight(self.group_factor, scene) + self.group_sky(scene)

        def times(value):
            return (self.group_rows @ value.astype(np.float32)).astype(float)

        right = times(rho * outer + shining)
        guess = np.where(right.any(axis=0), self.indirect, 0.0)
        self.indirect = finish(gcr(lambda v: times(rho * v), right, guess, SOLVED))[0]
        sent = rho * (outer + self.indirect) + shining
        return self.rows @ sent.astype(np.float32)

    def sky(self, scene):
        """(n, 3) Light from outside that no source stands for."""
        return 0.0

    def group_sky(self, scene):
        """The same at the groups."""
        return 0.0

    @property
    def bytes(self):
        """What is kept takes of the memory."""
        arrays = self.factor, self.rows, self.share, self.group_rows, self.group_factor, self.of, self.part, self.points
        return sum(array.nbytes for array in arrays)


def group(surface, points, weight):
    """(n,) Numbers of groups of nodes on surfaces (n,) at points (n, 3) m that are near each other, GROUPS at most,
    unless there are more surfaces; weight (n,) m^2."""
    low = points.min(axis=0, initial=np.inf)
    size = np.sqrt(weight.sum() / GROUPS)
    fewest = len(np.unique(surface))
    while True:
        cell = np.minimum(np.floor((points - low) / max(size, 1e-300)), 1 << 15).astype(np.int64)
        key = (surface.astype(np.int64) << 48) + (cell[:, 0] << 32) + (cell[:, 1] << 16) + cell[:, 2]
        found, of = np.unique(key, return_inverse=True)
        if len(found) <= max(GROUPS, fewest):
            return of.reshape(-1)
        size *= TRIED
