"""How far colours interpolated between a mesh's vertices are from the light: what the mesh itself cannot show."""

from dataclasses import dataclass, field

import numpy as np

from ...pdm_core.shapes.shape import unit
from .bake_points import areas_of, random_places, world_vertices

SHARE = 0.1  # points looked at, of the vertices baked
MOST, MANY, FEW = 4000, 32, 8  # points in all, and on each object where that allows it, and in any case
# parts of an edge, for which meshes that are too coarse are looked at: the later where the former are not enough
FINER = (2, 4, 8), (16, 32, 64)
FEW_AT_ONCE = 4000  # places: as soon read all at once, a bundle of rays takes 5 ms however few they are
# points of that, in all, and on how many objects, the worst: 250 points of a floor under a ball took a quarter of a
# draft's whole time, 16 on each of 82 crates three quarters of a bake's
LOOKED, WORST = 100, 6


@dataclass
class Between:
    """error: relative L2 error of the interpolated colours over all objects, as Shown counts it; parts (n objects,);
    finer {index of one of the worst that are too coarse: [(N, its part if each face were N x N)]}."""

    error: float
    parts: np.ndarray
    finer: dict = field(default_factory=dict)

    def too_coarse(self, target):
        """Indices of the objects, worst first, without which the rest would be within the target."""
        order = np.argsort(-self.parts)
        left = np.sqrt(np.maximum(self.error**2 - np.cumsum(self.parts[order] ** 2), 0.0))
        return order[: int(np.argmax(left <= target)) + 1] if self.error > target else order[:0]


def looks_between(targets, points):
    """[Look] of each object at its BakePoints: random places between its vertices, of a fixed seed."""
    total = sum(p.size for p in points)
    least = int(np.clip(MOST // len(points), FEW, MANY))
    rng = np.random.default_rng(1)
    return [
        Look(target, p.domain, least + int(min(SHARE * total, MOST) * p.size / total), rng)
        for target, p in zip(targets, points, strict=True)
    ]


def between_steps(shown, targets, points, values, looks, here, seen, allowed):
    """Generator of the fraction done; returns Between.

    shown: of the Field that is baked, before the exposure; values: [(k, 3)] of it at the BakePoints `points`; here
    [(n, 3)] at the places of `looks`, seen [(n,)] whether anybody sees these; allowed: the error from which on finer
    meshes are looked at.
    """
    rng, norm = np.random.default_rng(1), shown.norm
    colours = [p.colours(value)[:, :3].astype(float) for p, value in zip(points, values, strict=True)]
    found = [look.between(c) for look, c in zip(looks, colours, strict=True)]
    found = [np.where(s[:, None], f, h) for f, h, s in zip(found, here, seen, strict=True)]
    parts = [look.norm(f, h, shown) for look, f, h in zip(looks, found, here, strict=True)]
    between = Between(float(np.sqrt((np.array(parts) ** 2).sum())) / norm, np.array(parts) / norm)
    coarse = between.too_coarse(allowed)
    worst = coarse[:WORST].tolist()
    looks = {k: Look(targets[k], points[k].domain, LOOKED // len(worst), rng) for k in worst}
    light, enough = {}, allowed / (2 * max(len(coarse), 1))
    between.finer = {k: [] for k in looks}
    at_once = [look.finer_places(times) for look in looks.values() for times in FINER[0] + FINER[1]]
    for some in FINER if len(_once(at_once)[1]) > FEW_AT_ONCE else (FINER[0] + FINER[1],):
        short = {k: look for k, look in looks.items() if not any(error < enough for _, error in between.finer[k])}
        places = [look.places() for look in short.values() if not light]
        places += [look.finer_places(times) for look in short.values() for times in some]
        found = iter((yield from distinct(shown.field, places)))
        light = light or {k: next(found) for k in short}
        for k, look in short.items():
            for times in some:
                between_finer = look.between_finer(times, next(found).reshape(-1, 3, 3))
                between.finer[k].append((times, look.norm(between_finer, light[k], shown) / norm))
    for finer in between.finer.values():
        last = [k for k, (_, error) in enumerate(finer) if error < enough]
        del finer[last[0] + 1 if last else len(finer) :]
    return between


def distinct(field, places):
    """[(n, 3)] of the field, roughly, at several places, each only once: in a coarse triangle many points lie between
    the same few; generator."""
    if not places:
        return []
    parts, first, of = _once(places)
    found = yield from field.steps(*(part[first] for part in parts), True)
    return np.split(found[of], np.cumsum([len(place[0]) for place in places])[:-1])


def _once(places):
    """Several places in turn, the indices of those that differ, and of each which of them it is."""
    if not places:
        return (), np.zeros(0, int), np.zeros(0, int)
    parts = [np.concatenate(part) for part in zip(*places)]
    rows = np.column_stack([np.nan_to_num(part, nan=np.inf) for part in parts])
    _, first, of = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return parts, first, of.reshape(-1)


class Look:
    """Random points of one object and where they are in the mesh's triangles."""

    def __init__(self, target, domain, count, rng):
        ends, corners, surface, normals = _triangles(target, domain)
        area = areas_of(ends)
        self.area = area.sum()
        pick, self.weight = random_places(area, count if self.area > 0 else 0, rng)
        self.corners, self.ends, self.surface = corners[pick], ends[pick], surface[pick]
        self.normals = np.full(self.ends.shape, np.nan) if normals is None else normals[pick]

    def places(self):
        """Surfaces (n,), points, shading normals, and points inward (n, 3) of their faces."""
        return self._at(self.weight[:, None])

    def finer_places(self, times):
        """The same of the corners of the triangles about each point, three each, were each triangle times x times."""
        cell, step, _ = self._cut(times)
        return self._at((cell[:, None] + step) / times)

    def _at(self, weight):
        """weight (n, k, 3) of the triangles' corners -> places of n k points"""
        many = weight.shape[1]
        points = np.einsum("nkc,nci->nki", weight, self.ends).reshape(-1, 3)
        normals = np.einsum("nkc,nci->nki", weight, self.normals).reshape(-1, 3)
        known = np.isfinite(normals).all(axis=1)
        normals[known] = unit(normals[known])
        inward = np.repeat(self.ends.mean(axis=1), many, axis=0)
        return np.repeat(self.surface, many), points, normals, inward

    def _cut(self, times):
        cell = np.floor(times * self.weight)
        part = times * self.weight - cell
        upright = np.rint(part.sum(axis=1)) < 2  # else the small triangle is upside down
        step = np.where(upright[:, None, None], np.eye(3), 1 - np.eye(3))
        return cell, step, np.where(upright[:, None], part, 1 - part)

    def between(self, colours):
        """(n, 3) interpolated between colours, one a vertex or corner."""
        return np.einsum("nk,nki->ni", self.weight, colours[self.corners])

    def between_finer(self, times, values):
        """(n, 3) interpolated between values (n, 3, 3) at finer_places."""
        return np.einsum("nc,nci->ni", self._cut(times)[2], values)

    def norm(self, found, light, shown):
        """L2 norm over the object of the errors of what is found for the light (n, 3), as radiance times metres."""
        wrong = (found - light) * shown.factor(self.surface, np.maximum(found, light))
        return float(np.sqrt(self.area * (wrong**2).sum(axis=1).sum() / max(len(wrong), 1)))


def _triangles(target, domain):
    """World corners (t, 3, 3) m of the mesh's triangles, indices (t, 3) of their colours, their surfaces (t,), and
    shading normals (t, 3, 3) or None."""
    loops = target.base.triangles
    vertices = target.base.corners[loops]
    normals = None if target.corner_normals is None else target.corner_normals[loops]
    return world_vertices(target)[vertices], loops if domain == "CORNER" else vertices, target.triangle_surface, normals
