"""Recognises UV spheres with further vertices between their rings and segments, as Subdivide for the Bake leaves them.

Every vertex is on one ellipsoid, at a multiple of some halves of a ring and of a segment, all crossings of rings and
segments among them, and the polygons cover every cell once. No bpy.
"""

from itertools import product

import numpy as np

ROUGH = 1e-4  # of the radius: vertices off the ellipsoid or the rings, before the map to them is known exactly
APART = 4 * ROUGH  # rad between two levels
STEEP = 0.3  # sine of a vertex's angle to the axis from which on its turn is known well
MOST_AXES = 16  # vertices, or pairs of them, to try as poles
MOST_TRIED, LEAST_TRIED = 4_000_000, 64  # angles between vertices looked at, and vertices in any case
FINEST = 12  # halvings
SAMPLE = 1000  # vertices looked at first


def cut_places(mesh):
    """(segments, rings, north, south, k (n,), j (n,), is_outward) of a MeshArrays, ring and segment of each vertex with
    fractions, or None."""
    if len(mesh.vertices) < 12 or mesh.counts.max() > 4:
        return None
    unit = _on_sphere(mesh.vertices)
    if unit is None or not _is_closed(mesh):
        return None
    for north, south in _axes(mesh, unit):
        for rings, segments, k, j in _places(unit, north, south):
            if winding := _winding(mesh, rings, segments, north, south, k, j):
                return segments, rings, north, south, k, j, winding > 0
    return None


def _on_sphere(vertices):
    """(n, 3) the vertices mapped to the unit sphere by an affine map, one of those that turn it left open; or None."""
    offset = vertices - vertices.mean(axis=0)
    step = max(len(offset) // SAMPLE, 1)
    try:
        white = offset @ np.linalg.inv(np.linalg.cholesky(offset.T @ offset / len(offset))).T
        for part in (white[::step], white):
            x, y, z = part.T
            rows = np.column_stack([x * x, y * y, z * z, y * z, x * z, x * y, x, y, z])
            q = np.linalg.lstsq(rows, np.ones(len(rows)), rcond=None)[0]
            if not (np.abs(rows @ q - 1) < 10 * ROUGH).all():
                return None
        form = np.array([[q[0], q[5] / 2, q[4] / 2], [q[5] / 2, q[1], q[3] / 2], [q[4] / 2, q[3] / 2, q[2]]])
        centre = -np.linalg.solve(form, q[6:]) / 2
        root = np.linalg.cholesky(form / (1 + centre @ form @ centre))
    except np.linalg.LinAlgError:  # no extent in some direction, or no ellipsoid
        return None
    unit = (white - centre) @ root
    length = np.linalg.norm(unit, axis=1)
    return unit / length[:, None] if (np.abs(length - 1) < ROUGH).all() else None


def _is_closed(mesh):
    """Whether each edge belongs to two polygons, once in either direction, and there are no handles."""
    forward = np.where(mesh.corners < mesh.following, 1, -1)
    edges = np.bincount(mesh.edge)
    paired = (edges == 2).all() and not np.bincount(mesh.edge, forward).any()
    return paired and len(mesh.vertices) - len(edges) + len(mesh.counts) == 2


def _axes(mesh, unit):
    """[(north, south)] of vertices opposite each other, the likeliest first: seen from a pole most vertices share their
    rings with others."""
    valence = np.bincount(mesh.corners, minlength=len(unit))
    tried = np.argsort(-valence, kind="stable")[: max(MOST_TRIED // len(unit), LEAST_TRIED)]
    along = unit[tried] @ unit.T
    south = along.argmin(axis=1)
    found = np.flatnonzero(np.linalg.norm(unit[south] + unit[tried], axis=1) < ROUGH)
    levels = (np.diff(np.sort(np.arccos(np.clip(along[found], -1, 1)), axis=1), axis=1) > APART).sum(axis=1)
    some = found[np.argsort(levels, kind="stable")[:MOST_AXES]]
    return list(zip(tried[some].tolist(), south[some].tolist(), strict=True))


def across(axis):
    """(2, 3) unit vectors across an axis (3,), right-handed with it."""
    vectors = np.linalg.svd(axis[None])[2][1:]
    return vectors if np.dot(np.cross(*vectors), axis) >= 0 else vectors[::-1]


def _places(unit, north, south):
    """Yields rings, segments, k (n,) and j (n,) about an axis."""
    axis = unit[north]
    q = unit @ across(axis).T
    sine = np.hypot(*q.T)
    theta = np.arctan2(sine, unit @ axis)
    poles = np.array([north, south])
    inner = np.ones(len(unit), bool)
    inner[poles] = False
    if not (sine[inner] > APART).all():
        return
    phi = np.arctan2(q[:, 1], q[:, 0])
    phi = (phi - phi[sine.argmax()]) % (2 * np.pi)
    rings = _lattice(theta, np.pi, np.ones(len(unit)))
    segments = _lattice(np.append(phi[inner], 2 * np.pi), 2 * np.pi, np.append(sine[inner], 1.0))
    if not rings or not segments:
        return
    k, j = np.rint(theta * rings / np.pi).astype(np.int64), np.rint(phi * segments / (2 * np.pi)).astype(np.int64)
    j %= segments
    j[poles] = 0
    for down, along, first in _whole(rings, segments, k[inner], j[inner]):
        yield rings // down, segments // along, k / down, (j - first) % segments / along


def _lattice(angle, period, sine):
    """How many equal parts of `period` the angles (n,) are multiples of, or None."""
    levels = np.sort(angle[sine >= STEEP])
    gaps = np.diff(levels)
    gaps = gaps[gaps > APART]
    if not len(gaps):
        return None
    count = int(np.rint(period / gaps.min()))
    for halved in range(3):  # the finest may be near a pole only
        parts = angle * (count << halved) / period
        if (np.abs(parts - np.rint(parts)) * period / (count << halved) * sine < ROUGH).all():
            return count << halved
    return None


def _whole(rings, segments, k, j):
    """Yields powers of two by which rings and segments are thinned out so that all crossings of them are vertices, and
    the first segment then; the least first."""
    k, j = np.divmod(np.unique(k * segments + j), segments)  # each crossing once; a table of all may fill the memory
    j, k = j[(0 < k) & (k < rings)], k[(0 < k) & (k < rings)]
    steps = [[1 << n for n in range(FINEST + 1) if c % (1 << n) == 0 and c >> n >= 3] for c in (rings, segments)]
    for down, along in sorted(product(*steps), key=lambda pair: pair[0] * pair[1]):
        met = np.bincount(j[k % down == 0] % along)
        full = np.flatnonzero(met == (rings // down - 1) * (segments // along))
        if len(full):
            yield down, along, int(full[0])


def _winding(mesh, rings, segments, north, south, k, j):
    """1 or -1 where the polygons, each within a cell, cover all cells once and look outward or inward; else 0."""
    here, there = mesh.corners, mesh.following
    pole = np.zeros(len(k), bool)
    pole[[north, south]] = True
    turn = (j[there] - j[here] + segments / 2) % segments - segments / 2
    turn[pole[here] | pole[there]] = 0.0
    starts = mesh.starts
    area = np.add.reduceat((k[here] + k[there]) / 2 * turn, starts)
    area -= np.add.reduceat(np.where(pole[here], k[here], 0.0), starts) * np.add.reduceat(turn, starts)
    low, high = (f.reduceat(k[here], starts) for f in (np.minimum, np.maximum))
    wide = np.maximum.reduceat(np.abs(turn), starts)
    if (high > np.floor(low) + 1).any() or (wide > 1).any() or abs(abs(area.sum()) - rings * segments) > 0.5:
        return 0
    return int(np.sign(area[0])) if (area > 0).all() or (area < 0).all() else 0
