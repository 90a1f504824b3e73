"""Where meshes need vertices: their triangles are halved where the light bends, until what is interpolated is right."""

from dataclasses import dataclass

import numpy as np

from ...pdm_core.shapes.shape import unit
from ...pdm_core.signs_of_life import mapped
from ..reading.mesh_arrays import in_world
from ..reading.mesh_topology import FLOAT32
from .bake_points import areas_of, random_places
from .bisect import Bisected

SAMPLES, LEAST_SAMPLES = 2000, 64  # random places looked at once, in all and on each mesh, by area
ROUNDS = 32
# of the square of the error: its triangles are halved in one round, at most, far from what is allowed and nearer: the
# fewer, the better they are known to be the worst. 383 vertices for 436 of Cornell's floor, in 8 rounds for 6
MOST, MOST_NEAR = 0.9, 0.4
NEAR = 4  # times the error that is allowed
FALL = 1 / 16  # of the square of the error, what halving three edges leaves where light is smooth
POOR, LEAST_GAIN = 3, 0.05  # rounds in a row whose error falls by less, times what is halved of it: the light's noise
THIN = 2000  # roundings; edges not longer stay whole, flat faces could not be told to be flat
ENDED = "it was ended early"
NOISE = "finer faces hardly help, the light's own error is as large"
FULL = "the vertices allowed are too few"
BUBBLES = np.full((3, 3), 4 / 45) + np.eye(3) * 4 / 45  # inner products of 4 x y over a triangle of area 1


@dataclass(eq=False)
class Bent:
    """One mesh. flat (Triangulated); surface (t,) of its triangles at first; matrix (4, 4) to the world; places: a
    Places; parts: the Bisected with values 'light' and, where it is shaded smooth, 'normal'."""

    surface: np.ndarray
    matrix: np.ndarray
    places: object
    parts: Bisected
    inward: np.ndarray | None
    known: np.ndarray | None = None  # (n, 3) light at the Bisected's places

    @classmethod
    def make(cls, target, faces, places, samples, rng):
        """target: a ReadObject; faces: its Triangulated mesh; so many random places."""
        matrix = np.array(target.matrix, np.float64)
        at = in_world(matrix, places.at)[faces.vertices]
        pick, weight = random_places(areas_of(at), samples, rng)
        values, inward = {"light": np.full((*faces.vertices.shape, 3), np.nan)}, None
        if target.corner_normals is not None:
            values["normal"] = target.corner_normals[faces.corners]
            inward = at.mean(axis=1)
        parts = Bisected.make(places.at, faces.vertices, values, pick, weight)
        return cls(target.polygon_surface[faces.polygon], matrix, places, parts, inward)

    def at_points(self):
        """Surfaces, points, normals and inward of the random places."""
        corner = in_world(self.matrix, self.places.at)[self.parts.corner[self.parts.points]]
        return self._placed(self.parts.points, np.einsum("nk,nki->ni", self.parts.weight, corner), self.parts.weight)

    def unknown(self):
        """Where light is not known yet, each place once -> (surfaces, points, normals, inward), and a function that
        takes the light (n, 3) there."""
        parts, (triangle, corner) = self.parts, np.nonzero(np.isnan(self.parts.values["light"][..., 0]))
        halves, edge = np.nonzero(np.isnan(parts.middle["light"][..., 0]))
        ends = parts.corner[halves, edge], parts.corner[halves, (edge + 1) % 3]
        weight = np.concatenate([np.eye(3)[corner], (1 - np.eye(3)[(edge + 2) % 3]) / 2])
        local = np.concatenate([self.places.at[parts.corner[triangle, corner]], self.places.between(*ends)])
        placed = self._placed(np.concatenate([triangle, halves]), in_world(self.matrix, local), weight)
        edges = parts.arrays.edge.reshape(-1, 3)[halves, edge]
        first, of = _each_once(np.concatenate([parts.corner[triangle, corner], -1 - edges]), placed)

        def take(light):
            parts.values["light"][triangle, corner] = light[of[: len(triangle)]]
            parts.middle["light"][halves, edge] = light[of[len(triangle) :]]

        return tuple(part[first] for part in placed), take

    def _placed(self, triangle, points, weight):
        """Places at points (n, 3) m with weights (n, 3) in triangles (n,)."""
        root = self.parts.root[triangle]
        none = np.full(points.shape, np.nan)
        if self.inward is None:
            return self.surface[root], points, none, none
        normal = np.einsum("nk,nki->ni", weight, self.parts.values["normal"][triangle])
        known = np.isfinite(normal).all(axis=1)
        normal[known] = unit(normal[known])
        return self.surface[root], points, normal, self.inward[root]

    def squares(self, shown):
        """(t,) squares of the L2 error of the light interpolated in each triangle, in radiance times metres as Shown
        counts it.

        From the middles of the edges, as if it were quadratic, and from the random places: a shadow may fall between
        the middles.
        """
        parts = self.parts
        light, middle, surface = parts.values["light"], parts.middle["light"], self.surface[parts.root]
        factor = shown.factor(surface, np.maximum(light, middle).max(axis=1))
        bend = (middle - (light + np.roll(light, -1, axis=1)) / 2) * factor[:, None]
        square = np.einsum("tic,ij,tjc->t", bend, BUBBLES, bend)
        found = np.einsum("nk,nkc->nc", parts.weight, light[parts.points])
        factor = shown.factor(surface[parts.points], np.maximum(found, self.known))
        wrong = (((found - self.known) * factor) ** 2).sum(axis=1)
        count = np.bincount(parts.points, minlength=len(square))
        seen = np.bincount(parts.points, wrong, len(square)) / np.maximum(count, 1)
        corner = in_world(self.matrix, self.places.at)[parts.corner]
        longest = np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1)
        self.is_thin = longest <= THIN * FLOAT32 * np.abs(corner).max()
        return areas_of(corner) * np.maximum(square, seen)

    def halve(self, wanted):
        """Cuts the edges of triangles wanted (t,)."""
        self.parts.bisect(wanted)
        self.places.extend(self.parts.cuts[-1].edges)


def bend_steps(shown, meshes, allowed, budget, is_over=lambda: False):
    """Generator of the fraction done: halves triangles of `meshes` [Bent] until the root of their errors' squares is
    `allowed`, in radiance times metres, with at most `budget` vertices -> (error, why that is above it, or '').

    shown: of the Field that is baked; is_over(): True ends it with what there is.
    """
    field = shown.field
    known = yield from mapped(field.at_places([mesh.at_points() for mesh in meshes], roughly=True), lambda _: 0.0)
    for mesh, light in zip(meshes, known, strict=True):
        mesh.known = light
    least, poor = np.inf, 0
    for turn in range(ROUNDS):
        found = [mesh.unknown() for mesh in meshes]
        steps = field.at_places([places for places, _ in found], roughly=True)
        light = yield from mapped(steps, lambda done, turn=turn: (turn + done) / ROUNDS)
        over = is_over()
        for (_, take), values in zip(found, light, strict=True):
            take(values)
        squares = [mesh.squares(shown) for mesh in meshes]
        error = float(np.sqrt(sum(square.sum() for square in squares)))
        poor = poor + 1 if error > (1 - LEAST_GAIN * _most(error, allowed)) * least else 0
        least = min(least, error)
        if error <= allowed:
            return error, ""
        if poor == POOR:
            return error, NOISE
        if not _halve_worst(meshes, squares, allowed, budget):
            return error, FULL
        if over:  # where the last halving leads is not known
            return error, ENDED
    return error, NOISE


def _halve_worst(meshes, squares, allowed, budget):
    """Halves the triangles that make the most of the error; False where there is no room for more."""
    square = np.concatenate([np.where(mesh.is_thin, 0.0, square) for mesh, square in zip(meshes, squares, strict=True)])
    order = np.argsort(-square)
    worst = np.cumsum(square[order])
    left = sum(s.sum() for s in squares) - worst + FALL * worst
    enough = int(np.searchsorted(-left, -(allowed**2))) + 1
    most = _most(np.sqrt(worst[-1]), allowed)
    count = min(enough, int(np.searchsorted(worst, most * worst[-1])) + 1)
    room = budget - sum(mesh.parts.size for mesh in meshes)
    cuts = np.cumsum([len(square) for square in squares])[:-1]
    while count and square[order[count - 1]] > 0:
        wanted = np.zeros(len(square), bool)
        wanted[order[:count]] = True
        each = np.split(wanted, cuts)
        if sum(mesh.parts.edges_of(own)[1].sum() for mesh, own in zip(meshes, each, strict=True)) <= room:
            for mesh, own in zip(meshes, each, strict=True):
                mesh.halve(own)
            return True
        count //= 2
    return False


def _most(error, allowed):
    return MOST_NEAR if error < NEAR * allowed else MOST


def _each_once(key, placed):
    """first (k,) and of (n,): places that are one, at one vertex or edge (n,) on one surface and shaded alike."""
    surface, _, normals, _ = placed
    columns = [*normals.astype(np.float32).view(np.int32).T, surface, key]
    order = np.lexsort(columns)
    rows = np.column_stack(columns)[order]
    starts = np.append(True, (rows[1:] != rows[:-1]).any(axis=1)) if len(rows) else np.zeros(0, bool)
    of = np.empty(len(order), np.int64)
    of[order] = np.cumsum(starts) - 1
    return order[starts], of
