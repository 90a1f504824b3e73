"""What points receive as a function of the light alone, kept so that other light costs no geometry."""

import copy
from dataclasses import replace

import numpy as np

from .checked import SceneError
from .closed_forms import divide
from .scene import Scene
from .signs_of_life import finish

MOST = 1.5e9  # bytes kept
SOLVED = 0.02  # relative residual of the linear system, of the error


class Kept:
    """Points (n, 3) m of surfaces (n,) of a Scene. incident(scene) and radiance(scene) of the same shapes under other
    light; bytes: what it takes of the memory. SceneError where what is kept does not tell."""

    def __init__(self, scene, surface, points):
        self.scene, self.surface, self.points = scene, surface, points
        self.order = np.argsort(surface, kind="stable")
        self.first = np.searchsorted(surface[self.order], np.arange(len(scene) + 1))
        self.reflectance, self.emission = np.zeros((len(points), 3)), np.zeros((len(points), 3))
        self._read(scene, np.unique(surface).tolist())

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
        self._read(scene, changed)
        self.scene = scene
        return [np.maximum(part, 0.0) for part in parts]

    def _changed(self, scene):
        """[index] of the surfaces whose material is another than before."""
        old, new = self.scene.surfaces, scene.surfaces
        if len(old) != len(new) or any(a.shape is not b.shape or a.side != b.side for a, b in zip(old, new)):
            raise SceneError("kept light needs the same shapes and sides in the same order; solve the new scene")
        pairs = enumerate(zip(old, new))
        return [k for k, (a, b) in pairs if a is not b and not (same(a, b, "reflectance") and same(a, b, "emission"))]

    def _read(self, scene, surfaces):
        """Reflectance and emission at the points of these surfaces."""
        for k in surfaces:
            mine, own = self.order[self.first[k] : self.first[k + 1]], scene.surfaces[k]
            if len(mine):
                on = own.shape.project(self.points[mine]) if own.varies else self.points[mine]
                self.reflectance[mine], self.emission[mine] = own.reflectance_at(on), own.emission_at(on)


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


def check_room(size):
    """Raises SceneError where more would be kept than may be."""
    if size > MOST:
        raise SceneError(
            f"Live light would keep more than {MOST / 1e9:g} GB; bake fewer vertices, or to a larger error"
        )


class KeptLinks(Kept):
    """Of a solution by links: the factors of the lights and of the sources taken exactly, and places in the field.

    relit(state, scene) -> a state under other light, to be solved, whose exact sources are the same.
    """

    def __init__(self, state, relit, surface, points):
        super().__init__(state.given, surface, points)
        self.state, self.relit = state, relit
        self.guess = state.indirect, state.lit  # indirect light that was last found, and direct

    def steps(self, chunk):
        """Generator of the fraction done, that works out what is kept; chunk: points at once."""
        self.seen, n = [], len(self.points)
        for start in range(0, n, chunk):
            index = self.order[start : start + chunk]
            self.seen += self._of(index, self.surface[index], self.points[index] - self.state.origin)
            check_room(self.bytes)
            yield min(start + chunk, n) / n

    def _of(self, index, surface, points):
        """[(surface, index (k,), factors of lights, of exact sources, cells (k,), weights (k, 9), covered (k,))]"""
        seen = self.state.seen(surface, points)
        return [(s, index[part], *rest) for s, part, *rest in seen]

    def light(self, scene, changed):
        state, (indirect, lit) = self.relit(self.state, scene), self.guess
        size = np.abs(lit).sum(axis=0)
        state.indirect = indirect * divide(np.abs(state.lit).sum(axis=0), size)
        finish(state.solve(SOLVED * state.error))
        finish(state.share_out())
        self.guess = state.indirect, state.lit
        direct, rest = np.empty((2, *self.points.shape))
        for s, index, lights, exact, cell, weight, covered in self.seen:
            direct[index], rest[index] = lights @ state.light, state.received[s].between(cell, weight, exact)
            direct[index[covered]] = rest[index[covered]] = 0.0
        return direct, rest

    @property
    def bytes(self):
        """Also of the solution's own rows, without which it cannot be relit."""
        return self.state.rows.bytes + sum(a.nbytes for _, *arrays in self.seen for a in arrays)
