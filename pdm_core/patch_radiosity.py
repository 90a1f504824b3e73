"""The published method as a whole: radiosity of uniform patches whose form factors are those of pdm_form_factor, read
off bilinearly. It is here to be compared with: the exact gather of `solve` is what is baked.
"""

import time
from collections import Counter

import numpy as np

from .at_once import AT_ONCE, slices
from .checked import SceneError, index, number, of_kind, vectors
from .closed_forms import divide
from .published import patch_samples, published_kernel
from .read_off import runs_of
from .sampled import segment_blocked
from .scene import Scene
from .shape_table import ShapeTable

MOST_PATCHES = 4000  # their matrix is dense


class PatchSolution:
    """radiance (n patches, 3) of the patches of each surface, rows first; real (n patches,): whether they have an area,
    as those outside a polygon have not; seconds; counts of the segments tested."""

    def __init__(self, scene, divisions, radiance, real, seconds, counts):
        self.scene, self.divisions, self.patches, self.real = scene, divisions, radiance, real
        self.seconds, self.counts = seconds, counts
        self._start = np.concatenate([[0], np.cumsum(np.prod(divisions, axis=1))])

    def radiance(self, surface_index, points):
        """points (n, 3) m, projected onto the surface -> outgoing radiance (n, 3), bilinear between the middles of
        patches, even beyond those at a border; 0 where none of them has an area."""
        k = index(surface_index, len(self.scene), "surface_index")
        shape, (rows, columns) = self.scene.surfaces[k].shape, self.divisions[k]
        s, t = shape.parameters(shape.local(shape.project(vectors(points, "points"))))
        own = slice(self._start[k], self._start[k + 1])
        real = self.real[own].reshape(rows, columns, 1)
        value = np.where(real, self.patches[own].reshape(rows, columns, 3), 0.0)
        i, a = _between(s, rows, False)
        j, b = _between(t, columns, shape.wraps)
        corners = [((p * q)[:, None], i[m], j[n]) for m, p in enumerate((1 - a, a)) for n, q in enumerate((1 - b, b))]
        weight = sum(w * real[m, n] for w, m, n in corners)
        return divide(sum(w * value[m, n] for w, m, n in corners), weight)

    def radiance_steps(self, surface, points, normals=None, inward=None):
        """Radiance (n, 3) at points (n, 3) m of surfaces (n,): generator of the fraction done. No point of theirs is
        on a mesh, to be shaded by normals or to belong to a face."""
        out, done = np.empty((len(points), 3)), 0
        for k, mine in runs_of(surface):
            out[mine] = self.radiance(k, points[mine])
            done += len(mine)
            yield done / len(points)
        return out


def beyond(scene):
    """What of a Scene is beyond the published method, or ''."""
    for surface in scene.surfaces:
        if surface.shape.is_mesh:
            return f"surface {surface.name!r} is a mesh, which has no parameters"
        if surface.varies:
            return f"surface {surface.name!r} varies from place to place"
    if scene.lights:
        return f"light {scene.lights[0].name!r} is no surface"
    return "the background varies" if scene.sky is not None else ""


def _between(at, count, wraps):
    """at (n,) in [0, 1] -> the two of `count` equal parts (2, n) whose middles it lies between, weight (n,) of the
    second."""
    place = np.asarray(at) * count - 0.5
    low = np.floor(place).astype(int)
    both = np.stack([low, low + 1])
    return (both % count if wraps else np.clip(both, 0, count - 1)), place - low


def patch_radiosity_steps(scene, divisions, points):
    """Generator of the fraction done; returns the PatchSolution with divisions x divisions patches a plane, divisions x
    2 divisions a sphere, at `points` Gauss points a direction in each patch. The error is large where surfaces share an
    edge: see form_factors."""
    start = time.perf_counter()
    of_kind(scene, Scene, "patch_radiosity")
    divisions, points = (
        int(number(k, f"patch_radiosity: {what}", "a whole number above 0", above=0.5))
        for k, what in ((divisions, "divisions"), (points, "points"))
    )
    if what := beyond(scene):
        raise SceneError(f"patch_radiosity: {what}; use solve")
    each = [(divisions, divisions * (1 + s.shape.wraps)) for s in scene.surfaces]
    patches = int(np.prod(each, axis=1).sum())
    if patches > MOST_PATCHES:
        raise SceneError(f"patch_radiosity: {patches} patches are more than {MOST_PATCHES}; use fewer divisions")
    factors, real, counts = yield from _factors(scene, each, points)
    own = np.repeat(np.arange(len(scene)), np.prod(each, axis=1))
    rho, emission = scene.reflectance[own], scene.emission[own]
    received = np.maximum(1 - factors.sum(axis=1), 0.0)[:, None] * scene.background
    radiance = np.empty((patches, 3))
    for c in range(3):
        right = emission[:, c] + rho[:, c] * received[:, c]
        radiance[:, c] = np.linalg.solve(np.eye(patches) - rho[:, c, None] * factors, right)
    return PatchSolution(scene, each, radiance, real, time.perf_counter() - start, counts)


def _factors(scene, divisions, points):
    """F (n patches, n patches) by the published rule, every pair at all its points, which patches have an area (n
    patches,), and counts; yields."""
    samples = [patch_samples(s, d, points) for s, d in zip(scene.surfaces, divisions)]
    x, normal = (np.concatenate(part) for part in zip(*samples))
    surface = np.repeat(np.arange(len(scene)), [len(p) for p, _ in samples])
    shape = scene.shape_of[surface]
    each = points * points
    count = len(x) // each
    area = np.linalg.norm(normal, axis=1).reshape(count, each).sum(axis=1)
    pieces = [(part, k) for k, s in enumerate(scene.shapes) for part in s.pieces]
    table, counts = ShapeTable([part for part, _ in pieces]), Counter()
    factors = np.empty((count, count))
    for some in slices(count, AT_ONCE // (each * len(x))):
        rows = slice(some.start * each, min(some.stop, count) * each)
        i, j, d, value = published_kernel(x[rows], normal[rows], x, normal)
        at = i + rows.start
        for piece, (_, k) in enumerate(pieces):
            # flat and convex shapes are hidden from themselves by their normals alone
            others = np.flatnonzero((value > 0) & (shape[at] != k) & (shape[j] != k))
            hit = segment_blocked(table, x[at[others]].T, d[:, others], np.full(len(others), piece))
            value[others[hit]] = 0.0
            counts["sampled"] += len(others)
        flat = (i // each) * count + j // each
        block = np.bincount(flat, value, len(area[some]) * count).reshape(-1, count)
        factors[some] = divide(block, np.pi * area[some, None])
        yield some.start / count
    return factors, area > 0, counts
