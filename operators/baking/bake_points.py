"""Where a bake object's colours are read off: each (vertex, surface) pair once, scattered to points or corners."""

from dataclasses import dataclass

import numpy as np

from ..reading.mesh_arrays import in_world


@dataclass
class BakePoints:
    """points (k, 3) m world, sorted by surface; runs [(surface index, start, stop)] of equal surface among them.

    scatter (c,): index of each corner's pair; vertex (k,) of each pair. normals (k, 3) with which points are shaded
    and inward (k, 3) m in the face that each belongs to, where a mesh is among the surfaces. lent (2, e): pairs that
    nobody sees, and those beside them that lend them their colours, see stand_ins.
    """

    domain: str
    size: int
    points: np.ndarray
    runs: list
    scatter: np.ndarray
    vertex: np.ndarray
    normals: np.ndarray | None = None
    inward: np.ndarray | None = None
    lent: np.ndarray | None = None

    @property
    def surfaces(self):
        """(k,) the surface of each point."""
        return np.concatenate([np.full(stop - start, surface) for surface, start, stop in self.runs])

    def places(self):
        """surfaces (k,), points, normals and inward (k, 3), nan where there are none."""
        none = np.full(self.points.shape, np.nan)
        normals, inward = (none if value is None else value for value in (self.normals, self.inward))
        return self.surfaces, self.points, normals, inward

    def colours(self, values):
        """values (k, 3) -> (n points or corners, 4) float32, alpha 1; a vertex of several surfaces gets their mean."""
        colours = np.ones((self.size, 4), np.float32)
        if self.lent is not None:
            values, (to, of) = values.copy(), self.lent
            values[to] = means(to, values[of], len(values))[to]
        if self.domain == "CORNER":
            colours[:, :3] = values[self.scatter]
        else:
            colours[:, :3] = means(self.vertex, values, self.size)  # black where a vertex is of no face
        return colours


def corners_of(target):
    """Of `target` (a ReadObject): surface and vertex of each corner (c,), vertices (n, 3) m world, normals and middles
    (c, 3) or None."""
    return target.corner_surface, target.base.corners, world_vertices(target), target.corner_normals, target.middles


def bake_points(surface, vertex, world, normals, middles, domain):
    """The BakePoints of corners, see corners_of; domain 'AUTO' is POINT where one smooth surface covers them all.

    Corners on one surface at one vertex are one point, of a mesh if they are shaded alike.
    """
    keys = np.asarray(surface, np.int64) * len(world) + vertex
    if normals is not None:
        kinds = np.zeros((len(keys), 3), np.float32)
        kinds[:] = normals
        keys = _numbered(keys, kinds)
    pairs, first, of_corner = np.unique(keys, return_index=True, return_inverse=True)
    surface, vertex = np.asarray(surface)[first], np.asarray(vertex)[first]
    if domain == "AUTO":
        alone = surface[0] == surface[-1] and len(np.unique(vertex)) == len(vertex)
        domain = "POINT" if alone else "CORNER"
    starts = np.flatnonzero(np.diff(surface, prepend=-1))
    runs = [(int(surface[a]), int(a), int(b)) for a, b in zip(starts, np.append(starts[1:], len(surface)))]
    at_corners = domain == "CORNER"
    return BakePoints(
        domain,
        len(of_corner) if at_corners else len(world),
        world[vertex],
        runs,
        of_corner,
        vertex,
        None if normals is None else normals[first],
        None if middles is None else middles[first],
    )


def means(index, values, count):
    """(count, c): of the values (n, c) that belong to each index (n,), 0 where none does."""
    many = np.maximum(np.bincount(index, minlength=count), 1)
    return np.stack([np.bincount(index, column, count) / many for column in values.T], axis=1)


def joined(points):
    """surfaces (n,), points, normals and inward (n, 3) of several BakePoints in turn."""
    return tuple(np.concatenate(part) for part in zip(*(p.places() for p in points)))


def each_of(values, points):
    """Values (n, ...) at several BakePoints in turn -> [(k, ...)] of each."""
    return np.split(values, np.cumsum([len(p.points) for p in points])[:-1])


def _numbered(keys, normals):
    """One number for each key and normal (c, 3) float32 that occur together, in the order of the keys."""
    order = np.lexsort([*normals.T, keys])
    key, normal = keys[order], normals[order]
    number = np.empty(len(keys), np.int64)
    number[order] = np.cumsum(np.append(0, (key[1:] != key[:-1]) | (normal[1:] != normal[:-1]).any(axis=1)))
    return number


def world_vertices(target):
    """(n, 3) m: the vertices of `target` (a ReadObject) in the world."""
    return in_world(np.array(target.matrix, np.float64), target.base.vertices.astype(np.float64))


def areas_of(corner):
    """(t,) m^2 of triangles (t, 3, 3) m."""
    return np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2


def random_places(area, count, rng):
    """So many places spread over triangles of these areas (t,): triangles (k,), weights (k, 3) of their corners."""
    edges = np.cumsum(area) / max(area.sum(), 1e-300)
    pick = np.searchsorted(edges, (np.arange(count) + rng.random(count)) / max(count, 1))
    weight = np.sort(rng.random((count, 2)), axis=1)
    weight = np.column_stack([weight[:, 0], weight[:, 1] - weight[:, 0], 1 - weight[:, 1]])
    return np.minimum(pick, len(area) - 1), weight
