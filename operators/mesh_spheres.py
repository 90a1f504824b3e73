"""Recognises an affine image of Blender's UV sphere, whatever the vertex order, segments and rings. No bpy.

The unit UV sphere has its vertices at theta = pi k / rings, phi = 2 pi j / segments. Centres, means and second
moments commute with affine maps: they lead from the poles to each vertex's (k, j) without any walk over the mesh.
"""

from dataclasses import dataclass

import numpy as np

from .mesh_topology import NotRecognised

# Blender turns one meridian round in float32: vertices drift up to 1.1e-5 of the radius at 512 x 256 segments
DRIFT = 3e-5
COARSEST = 1e-2  # of the semi-axis: with more rounding than this an edited sphere could not be told from a true one
ROUND = 1e-5  # semi-axes that agree to this come from an even scale


@dataclass(frozen=True, eq=False)
class SphereShape:
    """matrix (4, 4): the unit sphere to local coordinates, determinant positive; is_outward: where normals point."""

    matrix: np.ndarray
    segments: int
    rings: int
    is_outward: bool


def find_sphere(mesh):
    """The SphereShape that the whole of a MeshArrays is, or None; NotRecognised where it is one with a fault."""
    if len(mesh.vertices) < 8 or mesh.counts.max() > 4:
        return None
    fault = None
    for north, south, segments, rings in _poles(mesh):
        try:
            if sphere := _fit(mesh, north, south, segments, rings):
                return sphere
        except NotRecognised as error:
            fault = error
    if fault:
        raise fault
    return None


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
    slack = 10 * DRIFT * np.abs(offset).max() + 10 * mesh.rounding
    pairs, seen = [], set()
    for north in may_be[np.argsort(miss, kind="stable")][: np.count_nonzero(miss <= slack)]:
        distance = np.linalg.norm(offset + offset[north], axis=1)
        south = int(distance.argmin())
        if north not in seen and distance[south] <= slack and valence[south] == valence[north]:
            pairs.append((int(north), south, int(valence[north]), int(rings[north])))
            seen |= {int(north), south}
    return pairs


def _fit(mesh, north, south, segments, rings):
    place = _grid(mesh, north, south, segments, rings)
    if place is None:
        return None
    k, j = place
    theta, phi = np.pi * k / rings, 2 * np.pi * j / segments
    ideal = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    middle = (mesh.vertices[north] + mesh.vertices[south]) / 2
    rows = np.column_stack([ideal, np.ones(len(ideal))])
    solution = np.linalg.solve(rows.T @ rows, rows.T @ (mesh.vertices - middle))
    linear, origin = solution[:3].T, middle + solution[3]
    axes = np.linalg.svd(linear, compute_uv=False)
    if not axes[2] > 1e-9 * axes[0]:
        raise NotRecognised("is a UV sphere scaled flat; give it a volume or replace it by a plane")
    noise = mesh.rounding / axes[2]
    if noise > COARSEST:
        raise NotRecognised("is a sphere too flat for its distance from the object's origin; give it more volume")
    miss = np.linalg.norm((mesh.vertices - origin) @ np.linalg.inv(linear).T - ideal, axis=1).max()
    if miss > DRIFT + noise:
        raise NotRecognised(
            f"is no UV sphere: a vertex is {miss:.1g} of the radius off a {segments} x {rings} sphere; was it edited?"
        )
    is_outward = _is_outward(mesh, k, j, segments, rings)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, origin
    if axes[0] - axes[2] <= (ROUND + noise) * axes[0]:
        # a round sphere has no orientation; its poles do not drift, so every tessellation gives the same sphere
        exact = noise < ROUND
        radius = np.linalg.norm(mesh.vertices[north] - middle) if exact else axes.mean()
        matrix[:3, :3], matrix[:3, 3] = radius * np.eye(3), middle if exact else origin
    return SphereShape(matrix, segments, rings, is_outward)


def _grid(mesh, north, south, segments, rings):
    """Ring k (n,) from 0 at the north pole to `rings`, and segment j (n,) of each vertex (0 at the poles), or None."""
    x = mesh.vertices - (mesh.vertices[north] + mesh.vertices[south]) / 2
    axis = x[north]
    # seen along the axis, in two coordinates across it, ring k is sin(theta_k) times one affine image of the circle
    across = np.linalg.svd(axis[None])[2][1:]
    if np.dot(np.cross(across[0], across[1]), axis) < 0:
        across = across[::-1]  # right-handed with the axis
    q = x @ across.T
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
    k[[north, south]], j[[north, south]] = (0, rings), 0
    inner = (k > 0) & (k < rings)
    place = np.where(inner, 1 + (k - 1) * segments + j, np.where(k == 0, 0, len(x) - 1))
    if np.count_nonzero(inner) != len(x) - 2 or (np.bincount(place, minlength=len(x)) != 1).any():
        return None
    return k, j


def _is_outward(mesh, k, j, segments, rings):
    """Checks that the polygons cover every cell of the grid once, all with the same winding; True for outward."""
    starts, corners = mesh.starts, mesh.corners
    ring, pole = k[corners], (k[corners] == 0) | (k[corners] == rings)
    top = np.minimum(np.minimum.reduceat(ring, starts), rings - 1)
    turn = np.where(pole, 0, np.exp(2j * np.pi * j[corners] / segments))
    middle = np.angle(np.add.reduceat(turn, starts)) * segments / (2 * np.pi)  # always between two segments
    cell = top * segments + np.floor(middle).astype(np.int64) % segments
    dk = ring - np.repeat(top, mesh.counts)
    dj = np.where(pole, 0, (j[corners] - np.repeat(cell, mesh.counts)) % segments)
    after = np.arange(1, len(corners) + 1)
    after[starts + mesh.counts - 1] = starts
    steps = np.abs(dk[after] - dk) + np.abs(dj[after] - dj)
    quad = np.repeat(mesh.counts == 4, mesh.counts)
    size = segments * rings
    in_cell = np.bincount(np.repeat(cell, mesh.counts), minlength=size)
    at_pole = (np.arange(size) < segments) | (np.arange(size) >= size - segments)
    # of a cell's four corners a quad takes each once, two triangles both ends of a diagonal twice: half are low,
    # half left; beside a pole one triangle is the cell
    low, left = (np.bincount(np.repeat(cell, mesh.counts), d, size) for d in (dk, dj))
    whole = np.isin(in_cell, (4, 6)) & (2 * low == in_cell) & (2 * left == in_cell)
    if dk.max() > 1 or dj.max() > 1 or (steps[quad] != 1).any() or not np.where(at_pole, in_cell == 3, whole).all():
        raise NotRecognised("is no UV sphere: its faces are not those between its rings and segments")
    winding = np.add.reduceat(dk * dj[after] - dk[after] * dj, starts)
    if (winding > 0).all() or (winding < 0).all():
        return bool(winding[0] > 0)
    raise NotRecognised("has normals that point both ways; recalculate them (Mesh > Normals > Recalculate)")
