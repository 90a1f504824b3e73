"""What is read off a solution: incident light and radiance at points of its surfaces, at once or step by step."""

import numpy as np

from .checked import MOST, SceneError, indices, number, of_kind, told_or_nan, vectors
from .foretell import seconds_to
from .scene import Scene
from .shapes.shape import unit
from .signs_of_life import finish
from .tolerances import FAINT

LEAST, AMONG = 64, 4  # points spread over a surface, and for each one taken, among which chance chooses


class Unseen(SceneError):
    """What a solution never looked at sends light in the scene that it is asked for."""


class ReadOff:
    """Of a solution with `scene`, `surface_errors`, `surface_norms`, `incident_steps`, `estimated_error_steps`,
    `kept_steps`, and `held_steps`: the irradiance as its cells hold it, at once and roughly, without gathering."""

    anew = None  # of a solution by `solve`: the function of another Scene that solves it to the same target

    def incident(self, surface_index, points, normals=None, inward=None):
        """points (n, 3) m, projected onto the surface -> irradiance / pi (n, 3) on its own side; surface_index: of one
        surface for all, or (n,): many surfaces' points at once are read faster.

        On a mesh: normals (n, 3) of that side, to shade by; inward (n, 3) m, a point of the face that each belongs to.
        """
        return finish(self.incident_steps(*self._of(surface_index, points, normals, inward)))

    def radiance(self, surface_index, points, normals=None, inward=None):
        """As incident -> outgoing radiance (n, 3)"""
        return finish(self.radiance_steps(*self._of(surface_index, points, normals, inward)))

    def relight(self, scene):
        """The same shapes, sides and lights with other reflectance, emission, lights' colours or background -> solution
        of that Scene, without visibility but where what was dark or black now sends light: that is solved anew."""
        try:
            return self.relit(scene)
        except Unseen:
            if self.anew is None:
                raise
            return self.anew(scene)

    def radiance_steps(self, surface, points, normals=None, inward=None, roughly=False):
        """Radiance (n, 3) at points (n, 3) m of surfaces (n,): generator of the fraction done. roughly: where
        differences between near points count, not the light itself."""
        light = yield from self.incident_steps(surface, points, normals, inward, roughly)
        reflectance, emission = materials_at(self.scene, surface, points)
        return emission + reflectance * light

    def estimated_error(self, surface_index, points):
        """points (n, 3) m, projected onto the surface -> (n,) estimated error of the radiance there, in its unit, as
        the length of the three channels': where it is likely to be large, not a bound at each point."""
        return finish(self.estimated_error_steps(*self._of(surface_index, points)))

    def kept(self, surface_index, points, normals=None, inward=None):
        """As incident -> Kept of the points: their light under any other, as long as no shape changes."""
        return finish(self.kept_steps(*self._of(surface_index, points, normals, inward)))

    def seconds_to(self, target):
        """Seconds that a solution to the target may take, from how this one converged; None where nothing is known."""
        return seconds_to(self.history, number(target, "seconds_to: target", "a number such as 0.01", below=MOST))

    def error_over(self, surfaces):
        """Estimated relative L2 error of L - Le over these surfaces (indices) alone."""
        surfaces = indices(surfaces, len(self.scene), len(surfaces), "surfaces")
        norm = self.surface_norms[surfaces]
        return float(np.linalg.norm(self.surface_errors[surfaces] * norm) / max(np.linalg.norm(norm), 1e-300))

    def _of(self, surface_index, points, *told):
        """What steps take: surfaces (n,), points (n, 3), and what is told of these (n, 3), nan or None for nothing."""
        points = vectors(points, "points")
        surface = indices(surface_index, len(self.scene), len(points), "surface_index")
        return surface, points, *(told_or_nan(a, points.shape, "normals and inward") for a in told)


def oriented(points, normals):
    """Places in space as users hand them over: points (n, 3) m, normals (n, 3) of any length but 0 -> the same, the
    normals of length 1"""
    points, normals = vectors(points, "points"), vectors(normals, "normals")
    if len(points) != len(normals):
        raise SceneError(f"irradiance: {len(points)} points but {len(normals)} normals; give one each")
    normals = unit(normals / np.maximum(np.abs(normals).max(axis=1, keepdims=True), 1e-300))
    if not normals.any(axis=1).all():
        raise SceneError("irradiance: a normal is zero; give it a direction")
    return points, normals


def check_same_shapes(old, scene):
    """Raises SceneError where a Scene has not the shapes, sides and as many lights as an old one, in the same order."""
    of_kind(scene, Scene, "relight")
    alike = len(scene) == len(old) and all(
        a.shape is b.shape and a.side == b.side for a, b in zip(scene.surfaces, old.surfaces)
    )
    if not alike or len(scene.lights) != len(old.lights):
        raise SceneError(
            "relight needs the same shapes, sides and lights in the same order; solve the new scene instead"
        )


def drawn(share, count, rng):
    """(count,) random indices of shares (n,), as many of each as it is of all of them."""
    edges = np.cumsum(share)
    pick = np.searchsorted(edges, (np.arange(count) + rng.random(count)) / count * edges[-1])
    return np.minimum(pick, len(share) - 1)


def spread_points(scene, surface, rng):
    """Random points (n, 3) m, one on each of surfaces (n,), as likely as the area that it stands for."""
    points = np.empty((len(surface), 3))
    for k, mine in runs_of(surface):
        shape = scene.surfaces[k].shape
        spread = shape.spread(max(LEAST, AMONG * len(mine)))
        share = shape.area_shares(spread)
        likely = None if np.ptp(share) <= FAINT * share.max() else share / share.sum()
        points[mine] = spread[rng.choice(len(spread), len(mine), replace=False, p=likely)]
    return points


def runs_of(surface):
    """[(k, index (m,))] of each surface among surfaces (n,), and where it is."""
    order = np.argsort(surface, kind="stable")
    cuts = np.flatnonzero(np.diff(surface[order], prepend=-2))
    return [(int(surface[order[a]]), order[a:b]) for a, b in zip(cuts, np.append(cuts[1:], len(order)))]


def materials_at(scene, surface, points):
    """Reflectance and emission (n, 3) at points (n, 3) m of surfaces (n,)."""
    reflectance, emission = scene.reflectance[surface], scene.emission[surface]
    varying = np.array([own.varies for own in scene.surfaces])
    some = np.flatnonzero(varying[surface])
    for k, mine in runs_of(surface[some]):
        own, mine = scene.surfaces[k], some[mine]
        on = own.shape.project(points[mine])
        reflectance[mine], emission[mine] = own.reflectance_at(on), own.emission_at(on)
    return reflectance, emission
