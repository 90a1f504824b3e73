"""Where a bake object's colours are read off: each (vertex, surface) pair once, scattered to points or corners."""

from dataclasses import dataclass

import numpy as np


@dataclass
class BakePoints:
    """points (k, 3) m world, sorted by surface; runs [(surface index, start, stop)] of equal surface among them.

    scatter: CORNER (n corners,) index of each corner's pair; POINT (k,) the vertex of each pair.
    """

    domain: str
    size: int
    points: np.ndarray
    runs: list
    scatter: np.ndarray

    def colours(self, values):
        """values (k, 3) -> (n points or corners, 4) float32, alpha 1; a vertex of several surfaces gets their mean."""
        colours = np.ones((self.size, 4), np.float32)
        if self.domain == "CORNER":
            colours[:, :3] = values[self.scatter]
            return colours
        count = np.maximum(np.bincount(self.scatter, minlength=self.size), 1)  # 0: a vertex of no face, black
        for channel in range(3):
            colours[:, channel] = np.bincount(self.scatter, values[:, channel], self.size) / count
        return colours


def corners_of(target):
    """Of `target` (a ReadObject): vertex of each corner (c,), corners of each polygon (p,), vertices (n, 3) m world."""
    mesh = target.mesh
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    count = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", count)
    return vertex, count, world_vertices(target)


def bake_points(polygon_surface, corner_vertex, corners, world, domain):
    """The BakePoints of polygons (p,) on these surfaces, see corners_of; domain 'AUTO' is POINT where one surface
    covers them all."""
    corner_surface = np.repeat(np.asarray(polygon_surface, np.int64), corners)
    pairs, of_corner = np.unique(corner_surface * len(world) + corner_vertex, return_inverse=True)
    surface, vertex = np.divmod(pairs, len(world))
    if domain == "AUTO":
        domain = "POINT" if surface[0] == surface[-1] else "CORNER"
    starts = np.flatnonzero(np.diff(surface, prepend=-1))
    runs = [(int(surface[a]), int(a), int(b)) for a, b in zip(starts, np.append(starts[1:], len(surface)))]
    at_corners = domain == "CORNER"
    return BakePoints(
        domain, len(of_corner) if at_corners else len(world), world[vertex], runs, of_corner if at_corners else vertex
    )


def world_vertices(target):
    """(n, 3) m: the vertices of `target` (a ReadObject) in the world."""
    mesh = target.mesh
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    matrix = np.array(target.matrix, np.float64)
    return vertices.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
