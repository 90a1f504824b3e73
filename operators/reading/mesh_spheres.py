"""Recognises an affine image of Blender's UV sphere, whatever the vertex order, segments and rings. No bpy.

The unit UV sphere has its vertices at theta = pi k / rings, phi = 2 pi j / segments. Centres, means and second
moments commute with affine maps: they lead from the poles to each vertex's (k, j) without any walk over the mesh.
"""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from .mesh_spheres_cut import MOST_AXES, across, cut_places
from .mesh_topology import NotRecognised

# Blender turns one meridian round in float32: vertices drift up to 1.1e-5 of the radius at 512 x 256 segments
DRIFT = 3e-5
TYPED = 3e-4  # of the radius: files of text keep six decimals of a metre, .2 mm of a marble of 3 mm radius at most
COARSEST = 1e-2  # of the semi-axis: with more rounding than this an edited sphere could not be told from a true one
ROUND = 1e-5  # semi-axes that agree to this come from an even scale


@dataclass(frozen=True, eq=False)
class SphereShape:
    """matrix (4, 4): the unit sphere to local coordinates, determinant positive; is_outward: where normals point;
    is_even: whether its vertices are those of its rings and segments alone."""

    matrix: np.ndarray
    segments: int
    rings: int
    is_outward: bool
    is_even: bool = True


@dataclass(frozen=True, eq=False)
class Grid:
    """Where a mesh's vertices are on the unit UV sphere: ring k (n,) from 0 at the north pole, segment j (n,), with
    fractions where it has more vertices in places."""

    segments: int
    rings: int
    north: int
    south: int
    k: np.ndarray
    j: np.ndarray
    is_outward: bool

    @property
    def is_even(self):
        return len(self.k) == self.segments * (self.rings - 1) + 2

    @cached_property
    def ideal(self):
        """(n, 3) on the unit sphere."""
        return on_sphere(self.k, self.j, self.rings, self.segments)

    @cached_property
    def least_squares(self):
        """(4, n): vertices to the affine map of `ideal` that is nearest to them, its linear part and its origin."""
        rows = np.column_stack([self.ideal, np.ones(len(self.ideal))])
        return np.linalg.solve(rows.T @ rows, rows.T)


def on_sphere(ring, segment, rings, segments):
    """(n, 3) on the unit sphere at rings and segments (n,), of so many."""
    theta, phi = np.pi * ring / rings, 2 * np.pi * segment / segments
    return np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def find_sphere(mesh, grids):
    """The SphereShape that the whole of a MeshArrays is, or None; NotRecognised where it is one with a fault.

    grids: dict of the Grid of polygons that were a sphere before: a scene has many spheres of few topologies.
    """
    if len(mesh.vertices) < 8 or mesh.counts.max() > 4:
        return None
    topology = (mesh.corners.tobytes(), mesh.counts.tobytes())
    fault = None
    for guess in _guesses(mesh, grids.get(topology)):
        try:
            if grid := guess():
                sphere = _fit(mesh, grid)
                grids[topology] = grid
                return sphere
        except NotRecognised as error:
            fault = error
    if place := cut_places(mesh):
        grids[topology] = grid = Grid(*place)
        return _fit(mesh, grid)
    if fault:
        raise fault
    return None


def _guesses(mesh, grid):
    """Functions that return a Grid or None: first the one that fitted the same polygons before.

    They may be another sphere now, where triangles leave it open which edges are meridians.
    """
    if grid:
        yield lambda: grid
    for poles in _poles(mesh):
        yield partial(_grid, mesh, *poles)


def _poles(mesh):
    """[(north, south, segments, rings)], the likeliest first.

    A pole of S segments has S neighbours, their mean is cos(pi / R) of the way from the centre to the pole, and the
    opposite pole mirrors it at the centre.
    """
    n = len(mesh.vertices)
    valence = np.bincount(mesh.corners, minlength=n)
    rings = (n - 2) // valence + 1
    may_be = np.flatnonzero((valence >= 3) & ((n - 2) % valence == 0) & (rings >= 3))
    offset = mesh.vertices - mesh.vertices.mean(axis=0)
    around = np.column_stack([np.bincount(mesh.corners, offset[mesh.following, k], n) for k in range(3)])
    miss = around[may_be] / valence[may_be, None] - np.cos(np.pi / rings[may_be])[:, None] * offset[may_be]
    miss = np.linalg.norm(miss, axis=1)
    slack = TYPED * np.abs(offset).max() + 10 * mesh.rounding[0]
    # where only two vertices have a valence they are the poles; a smooth mesh may have thousands that look alike
    many = np.bincount(valence)[valence[may_be]] > 2
    likeliest = np.lexsort((miss, many))[:MOST_AXES]
    pairs, seen = [], set()
    for north in may_be[likeliest[miss[likeliest] <= slack]].tolist():
        distance = np.linalg.norm(offset + offset[north], axis=1)
        south = int(distance.argmin())
        if north not in seen and distance[south] <= slack and valence[south] == valence[north]:
            pairs.append((north, south, int(valence[north]), int(rings[north])))
            seen |= {north, south}
    return pairs


def _fit(mesh, grid):
    """The SphereShape whose grid the vertices are on, or NotRecognised."""
    middle = (mesh.vertices[grid.north] + mesh.vertices[grid.south]) / 2
    solution = grid.least_squares @ (mesh.vertices - middle)
    linear, origin = solution[:3].T, middle + solution[3]
    axes = np.linalg.svd(linear, compute_uv=False)
    if not axes[2] > 1e-9 * axes[0]:
        raise NotRecognised("is a UV sphere scaled flat; give it a volume or replace it by a plane")
    noise = mesh.rounding[0] / axes[2]
    if noise > COARSEST:
        raise NotRecognised("is a sphere too flat for its distance from the object's origin; give it more volume")
    miss = np.linalg.norm((mesh.vertices - origin) @ np.linalg.inv(linear).T - grid.ideal, axis=1).max()
    if miss > TYPED + noise:
        size = f"{grid.segments} x {grid.rings}"
        raise NotRecognised(f"is no UV sphere: a vertex is {miss:.1g} of the radius off a {size} one; was it edited?")
    mirrored = np.linalg.det(linear) < 0
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear * [1, -1 if mirrored else 1, 1], origin  # the same sphere, right-handed
    is_typed = miss > DRIFT + noise
    if axes[0] - axes[2] <= (miss if is_typed else ROUND + noise) * axes[0]:
        # a round sphere has no orientation; its poles hardly drift, so every tessellation gives the same sphere
        exact = noise < ROUND and not is_typed
        radius = np.linalg.norm(mesh.vertices[grid.north] - middle) if exact else axes.mean()
        matrix[:3, :3], matrix[:3, 3] = radius * np.eye(3), middle if exact else origin
    return SphereShape(matrix, grid.segments, grid.rings, grid.is_outward != mirrored, grid.is_even)


def _grid(mesh, north, south, segments, rings):
    """The Grid of a mesh with these poles, or None; NotRecognised where only its polygons do not fit."""
    x = mesh.vertices - (mesh.vertices[north] + mesh.vertices[south]) / 2
    axis = x[north]
    # seen along the axis, in two coordinates across it, ring k is sin(theta_k) times one affine image of the circle
    q = x @ across(axis).T
    try:
        q = np.linalg.solve(np.linalg.cholesky(q.T @ q * 4 / (segments * rings)), q.T).T
    except np.linalg.LinAlgError:  # no extent across the axis
        return None
    along = x @ axis / (axis @ axis)
    height = along - q @ (along @ q) * 4 / (segments * rings)  # the rings may lean against the axis
    theta = np.arctan2(np.hypot(q[:, 0], q[:, 1]), height)
    k = np.rint(theta * rings / np.pi).astype(np.int64)
    turns = segments * np.arctan2(q[:, 1], q[:, 0]) / (2 * np.pi)
    phase = np.exp(2j * np.pi * turns) @ np.sin(theta)
    j = np.rint(turns - np.arctan2(phase.imag, phase.real) / (2 * np.pi)).astype(np.int64) % segments
    k[[north, south]], j[[north, south]] = (1, rings - 1), (0, 0)
    place = np.delete((k - 1) * segments + j, [north, south])
    if k.min() < 1 or k.max() > rings - 1 or np.bincount(place, minlength=len(place)).max() > 1:
        return None
    k[[north, south]] = 0, rings
    return Grid(segments, rings, north, south, k, j, _is_outward(mesh, k, j, segments, rings))


def _is_outward(mesh, k, j, segments, rings):
    """Checks that the polygons cover every cell of the grid once, all with the same winding; True for outward."""
    starts, polygon = mesh.starts, mesh.polygons
    ring, turn = k[mesh.corners], j[mesh.corners]
    pole = (ring == 0) | (ring == rings)
    top = np.minimum(np.minimum.reduceat(ring, starts), rings - 1)
    some = np.maximum.reduceat(np.where(pole, -1, turn), starts)  # a segment of the polygon: its cell is beside it
    right = np.where(pole, 1, (turn - some[polygon] + 1) % segments)
    left = np.minimum.reduceat(right, starts)
    dk, dj = ring - top[polygon], np.where(pole, 0, right - left[polygon])
    cell = (top * segments + (some + left - 1) % segments)[polygon]
    after = mesh.next
    steps = np.abs(dk[after] - dk) + np.abs(dj[after] - dj)
    is_quad = (mesh.counts == 4)[polygon]
    # of a cell's four corners a quad takes each once, two triangles both ends of a diagonal twice: half are low,
    # half on the right; beside a pole one triangle is the cell
    size = segments * rings
    corners, low, right = (np.bincount(cell, d, size) for d in (None, dk, dj))
    fits = ((corners == 4) | (corners == 6)) & (2 * low == corners) & (2 * right == corners)
    fits[:segments], fits[size - segments :] = corners[:segments] == 3, corners[size - segments :] == 3
    if dk.max() > 1 or dj.max() > 1 or (steps[is_quad] != 1).any() or not fits.all():
        raise NotRecognised("is no UV sphere: its faces are not those between its rings and segments")
    winding = np.add.reduceat(dk * dj[after] - dk[after] * dj, starts)
    if (winding > 0).all() or (winding < 0).all():
        return bool(winding[0] > 0)
    raise NotRecognised("has normals that point both ways; recalculate them (Mesh > Normals > Recalculate)")
