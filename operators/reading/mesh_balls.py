"""The UV spheres among the components of meshes. numpy only, no bpy."""

import numpy as np

from ...pdm_core.at_once import CACHED
from .mesh_spheres import find_sphere
from .mesh_topology import NotRecognised

FEWEST = 8, 9  # vertices and faces of the coarsest, of three rings and three segments
SAMPLE = 64  # vertices of a component that are looked at first
OFF = 0.05  # of the radius squared: further off every ellipsoid there is no sphere, however rounded (COARSEST)
MISSES = 16  # components of one number of vertices and faces that are no spheres: the others are not tried


def spheres_in(mesh, grids):
    """Welded MeshArrays -> sphere (p,): which of the list each polygon is part of, -1 for none; [SphereShape]; (m,)
    meshes that have a sphere of several materials. grids: see find_sphere."""
    of, spheres, mixed = np.full(len(mesh.counts), -1), [], []
    component = _numbered(mesh)
    may = np.flatnonzero(_may_be(mesh, component))
    if not len(may):
        return of, spheres, mixed
    order = np.argsort(component, kind="stable")
    size = np.bincount(component)
    begin = np.cumsum(size) - size
    missed = {}
    for k in may.tolist():
        own = order[begin[k] : begin[k] + size[k]]
        part = mesh.alone(own)
        like = (len(part.vertices), *np.bincount(np.bincount(part.corners)).tolist())  # how many faces meet at vertices
        if missed.get(like, 0) >= MISSES:
            continue
        if (sphere := _sphere(part, grids)) is None:
            missed[like] = missed.get(like, 0) + 1
        elif (part.materials != part.materials[0]).any():
            mixed.append(int(mesh.mesh[own[0]]))
        else:
            of[own] = len(spheres)
            spheres.append(sphere)
    return of, spheres, mixed


def _sphere(mesh, grids):
    try:
        return find_sphere(mesh, grids)
    except NotRecognised:
        return None  # one with a fault is a mesh like any other


def _numbered(mesh):
    """(p,) the component of each polygon, numbered from 0."""
    label = mesh.components
    is_first = np.zeros(len(mesh.vertices), bool)
    is_first[label] = True
    return (np.cumsum(is_first) - 1)[label]


def _may_be(mesh, component):
    """(k,) Whether each component may be a sphere: triangles and quads whose vertices are near one ellipsoid."""
    faces = np.bincount(component)
    widest = np.zeros(len(faces), np.int64)
    np.maximum.at(widest, component, mesh.counts)
    may = (widest <= 4) & (faces >= FEWEST[1])
    if not may.any():
        return may
    of = np.full(len(mesh.vertices), -1)
    of[mesh.corners] = component[mesh.polygons]
    some = np.flatnonzero(may[of] & (of >= 0))
    some = some[np.argsort(of[some], kind="stable")]
    count = np.bincount(of[some], minlength=len(faces))
    begin = np.cumsum(count) - count
    may &= count >= FEWEST[0]
    for part in np.array_split(np.flatnonzero(may), np.count_nonzero(may) // CACHED + 1):
        pick = begin[part, None] + np.arange(SAMPLE) * count[part, None] // SAMPLE
        may[part] = _near_ellipsoids(mesh.vertices[some[pick]])
    return may


def _near_ellipsoids(points):
    """points (k, n, 3) -> (k,) whether all of them are near one quadric, by least squares."""
    offset = points - points.mean(axis=1, keepdims=True)
    spread, axes = np.linalg.eigh(offset.swapaxes(1, 2) @ offset)
    tiny = np.finfo(float).tiny
    white = offset @ axes / np.sqrt(np.maximum(spread, 1e-20 * spread[:, 2:] + tiny))[:, None]
    x, y, z = np.moveaxis(white * np.sqrt(points.shape[1]), 2, 0)
    rows = np.stack([x * x, y * y, z * z, y * z, x * z, x * y, x, y, z], axis=2)
    square = rows.swapaxes(1, 2) @ rows
    square += 1e-12 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(9)
    form = np.linalg.solve(square, rows.sum(axis=1)[:, :, None])
    return np.abs((rows @ form)[:, :, 0] - 1).max(axis=1) < OFF
