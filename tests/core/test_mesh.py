"""Meshes: what their faces are cut into, normals, the nearest point, and what is taken and what refused."""

import numpy as np
import pytest

from pdm_core import Mesh, SceneError, Surface

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
CUBE_FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def left_out(mesh):
    """(k,) Faces that have no triangle."""
    return np.setdiff1d(np.arange(mesh.faces.count), mesh.faces.of)


def ball(rings=12, radius=1.0):
    """A UV sphere as a mesh: triangles at the poles, else quadrilaterals, all facing out."""
    theta, phi = np.pi * np.arange(1, rings) / rings, np.pi * np.arange(2 * rings) / rings
    at, around = np.meshgrid(theta, phi, indexing="ij")
    body = np.stack([np.sin(at) * np.cos(around), np.sin(at) * np.sin(around), np.cos(at)], axis=-1).reshape(-1, 3)
    n, faces = 2 * rings, []
    for k in range(n):
        j = (k + 1) % n
        faces += [[i * n + k, (i + 1) * n + k, (i + 1) * n + j, i * n + j] for i in range(rings - 2)]
        faces += [[len(body), k, j], [len(body) + 1, (rings - 2) * n + j, (rings - 2) * n + k]]
    return radius * np.concatenate([body, [[0, 0, 1], [0, 0, -1]]]), faces


def nearest_of_all(mesh, points):
    """Distances (n,) by each with each: on a triangle's inside, else on its edges."""
    corners = mesh.vertices[mesh.triangles]
    p, edge = corners, np.roll(corners, -1, axis=1) - corners
    offset = points[:, None, None] - p
    t = np.clip(np.einsum("ntki,tki->ntk", offset, edge) / np.maximum((edge**2).sum(axis=2), 1e-300), 0, 1)
    best = np.linalg.norm(offset - t[..., None] * edge, axis=3).min(axis=2)
    height = np.einsum("nti,ti->nt", offset[:, :, 0], mesh.triangle_normals)
    outward = np.cross(edge, mesh.triangle_normals[:, None])
    inside = (np.einsum("ntki,tki->ntk", offset, outward) <= 0).all(axis=2)
    return np.where(inside, np.abs(height), best).min(axis=1)


def test_a_cube():
    mesh = Mesh(CUBE, CUBE_FACES, False)
    assert mesh.problem is None and len(mesh.triangles) == 12 and len(left_out(mesh)) == 0
    assert abs(mesh.area - 6) < 1e-14 and mesh.faces.of.tolist() == np.repeat(np.arange(6), 2).tolist()
    centre, radius = mesh.bounds
    assert np.abs(centre - 0.5).max() < 1e-15 and abs(radius - np.sqrt(0.75)) < 1e-15
    assert (np.einsum("ti,ti->t", mesh.triangle_normals, CUBE[mesh.triangles].mean(axis=1) - 0.5) > 0).all()
    assert np.abs(mesh.corner_normals - mesh.triangle_normals[:, None]).max() == 0
    # smooth corners look along the diagonals, however faces are cut: angles count, not triangles
    smooth = Mesh(CUBE, CUBE_FACES)
    known = (CUBE[smooth.triangles] - 0.5) / np.sqrt(0.75)
    assert np.abs(smooth.corner_normals - known).max() < 1e-14
    points = np.array([[0.5, 0.5, 2.0], [0.25, 0.5, 1.0]])
    assert np.abs(smooth.project(points) - [[0.5, 0.5, 1.0], [0.25, 0.5, 1.0]]).max() < 1e-15
    assert np.abs(mesh.normals(points) - [0, 0, 1]).max() < 1e-15


@pytest.mark.parametrize("seed", range(6))
def test_the_nearest_point_against_each_with_each(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = ball(8 + seed)
    size = 10 ** rng.uniform(-6, 6)
    vertices = size * (vertices * rng.uniform(0.1, 2.0, 3) + 0.1 * rng.normal(size=vertices.shape) + rng.normal(size=3))
    mesh = Mesh(vertices, faces)
    points = np.concatenate([size * 2 * rng.normal(size=(200, 3)), vertices, mesh.spread(100)])
    triangle, weights = mesh.nearest(points)
    near = mesh.project(points)
    assert np.abs(weights.sum(axis=1) - 1).max() < 1e-12 and weights.min() > -1e-12
    assert np.abs(near - np.einsum("nk,nki->ni", weights, vertices[mesh.triangles[triangle]])).max() < 1e-12 * size
    distance = np.linalg.norm(near - points, axis=1)
    assert np.abs(distance - nearest_of_all(mesh, points)).max() < 1e-9 * size
    assert distance[200:].max() < 1e-9 * size


def test_points_equally_near_to_everything():
    """In the middle of a ball all triangles are as near: the work is limited, the answer right."""
    mesh = Mesh(*ball(40))
    points = 1e-9 * np.random.default_rng(0).normal(size=(300, 3))
    distance = np.linalg.norm(mesh.project(points) - points, axis=1)
    assert np.abs(distance - np.cos(np.pi / 80) ** 2).max() < 2e-3


def test_fine_balls_tend_to_the_ball():
    error = []
    for rings in (10, 20, 40):
        mesh = Mesh(*ball(rings))
        points = mesh.spread(2000)
        normals = points / np.linalg.norm(points, axis=1, keepdims=True)
        error.append([4 * np.pi - mesh.area, np.abs(mesh.normals(points) - normals).max()])
        assert abs(mesh.spread(2000).mean(axis=0)).max() < 0.02
    error = np.array(error)
    assert (error[:-1] / error[1:] > 3.5).all()  # second order in the area and in the normals


def test_concave_and_bent_faces():
    """Quadrilaterals and larger faces with a corner that looks in are cut so that nothing lies outside them."""
    arrow = [(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)]
    for first in range(4):
        mesh = Mesh(np.roll(arrow, first, axis=0), [[0, 1, 2, 3]])
        assert abs(mesh.area - 1.5) < 1e-14 and (mesh.triangle_normals[:, 2] > 0.99).all()
    corner = [(0, 0, 0), (3, 0, 0), (3, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0)]
    for first in range(6):
        mesh = Mesh(np.roll(corner, first, axis=0), [list(range(6))])
        assert len(mesh.triangles) == 4 and abs(mesh.area - 5) < 1e-14 and (mesh.triangle_normals[:, 2] > 0.99).all()
    with_middles = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (1, 2, 0), (0, 2, 0)]
    mesh = Mesh(with_middles, [list(range(6))])
    assert len(mesh.triangles) == 4 and abs(mesh.area - 4) < 1e-14 and mesh.areas.min() > 0.1
    bent = Mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)], [[0, 1, 2, 3]])
    assert bent.problem is None and len(bent.triangles) == 2
    mixed = Mesh(np.concatenate([np.array(corner), CUBE + 5]), [list(range(6)), [6, 8, 9], [6, 8, 9, 7][::-1]])
    assert mixed.faces.of.tolist() == [0, 0, 0, 0, 1, 2, 2]


def test_smooth_and_flat_faces_beside_each_other():
    flat = np.array([True, True, False, False, False, False])
    mesh = Mesh(CUBE, CUBE_FACES, flat)
    own = mesh.triangle_normals[:, None]
    assert np.abs(mesh.corner_normals - own).max() < 1e-15  # two smooth ones that share no corner
    roof = Mesh([(0, 0, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1), (2, 0, 0), (2, 1, 0)], [[0, 2, 3, 1], [2, 4, 5, 3]], True)
    assert np.abs(roof.normals(np.array([[1, 0.5, 1.0]])) - [0, 0, 1]).max() < 1e-12
    assert np.abs(roof.normals(np.array([[0, 0.5, 0.0]])) - np.array([-1, 0, 1]) / np.sqrt(2)).max() < 1e-12


def test_given_normals():
    vertices, faces = ball(6)
    assert np.abs(Mesh(vertices, faces, vertices).normals(vertices) - vertices).max() < 1e-14
    corners = vertices[[k for face in faces for k in face]]
    mesh = Mesh(vertices, faces, 3 * corners)
    assert np.abs(mesh.normals(vertices) - vertices).max() < 1e-14
    lost = Mesh(CUBE, CUBE_FACES, 0 * CUBE)  # no normals are those of the faces
    assert np.abs(lost.corner_normals - lost.triangle_normals[:, None]).max() == 0


def test_bad_meshes_give_sensible_shapes():
    doubled = Mesh(CUBE, [*CUBE_FACES, CUBE_FACES[0], CUBE_FACES[1][::-1]])
    assert abs(doubled.area - 7) < 1e-14 and left_out(doubled).tolist() == [6]
    apart = Mesh(np.concatenate([CUBE, CUBE]), [*CUBE_FACES, [8, 10, 11, 9]])  # of vertices of its own
    assert abs(apart.area - 6) < 1e-14 and left_out(apart).tolist() == [6]
    needle = Mesh([*CUBE, (0.5, 0, 0)], [*CUBE_FACES, [0, 8, 1], [0, 0, 1], [0, 1, 0, 1]])
    assert left_out(needle).tolist() == [6, 7, 8] and np.isfinite(needle.corner_normals).all()
    fins = Mesh([(0, 0, 0), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0)], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    inside_out = Mesh(CUBE, [face[::-1] if k % 2 else face for k, face in enumerate(CUBE_FACES)])
    sliver = Mesh([(0, 0, 0), (1, 0, 0), (0.5, 1e-7, 0), (0.5, 1, 0)], [[0, 1, 2], [0, 2, 3], [2, 1, 3]])
    loose = Mesh([*CUBE, (1e9, 0, 0)], CUBE_FACES)  # a vertex that no face uses is not part of it
    assert loose.bounds[1] < 1
    for mesh in (doubled, apart, needle, fins, inside_out, sliver, loose):
        assert mesh.problem is None
        points = np.random.default_rng(0).normal(size=(50, 3))
        for value in (mesh.project(points), mesh.normals(points), mesh.marks, mesh.spread(30), mesh.corner_normals):
            assert np.isfinite(value).all()
        assert np.abs(np.linalg.norm(mesh.corner_normals, axis=2) - 1).max() < 1e-12
        assert mesh.thickness > 0 and mesh.areas.min() > 0


def test_marks_tell_meshes_from_each_other():
    vertices, faces = ball(6)
    mesh = Mesh(vertices, faces)
    assert np.abs(mesh.marks - Mesh(vertices[::-1], len(vertices) - 1 - np.array(faces[1:2])).marks).max() > 1e-2
    order = np.random.default_rng(0).permutation(len(vertices))
    same = Mesh(vertices[np.argsort(order)], [[order[k] for k in face] for face in faces[::-1]])
    assert np.abs(mesh.marks - same.marks).max() < 1e-12
    for other in (Mesh(vertices, [f[::-1] for f in faces]), Mesh(vertices * [1, 1, -1.1], faces), Mesh(*ball(7))):
        assert np.abs(mesh.marks - other.marks).max() > 1e-3


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Mesh(CUBE[:, :2], CUBE_FACES), "vertices.*shape"),
        (lambda: Mesh([], []), "vertices"),
        (lambda: Mesh(CUBE, []), "at least one"),
        (lambda: Mesh(CUBE, [[0, 1]]), "at least 3 corners"),
        (lambda: Mesh(CUBE, [[0, 1, 8]]), "from 0 to 7"),
        (lambda: Mesh(CUBE, [[0, 1, -1]]), "from 0 to 7"),
        (lambda: Mesh(CUBE, [[0, 1, 2.5]]), "from 0 to 7"),
        (lambda: Mesh(CUBE, [[0, 1, "a"]]), "numbers"),
        (lambda: Mesh(CUBE, 5), "faces"),
        (lambda: Mesh(CUBE, CUBE_FACES, "yes"), "smooth"),
        (lambda: Mesh(CUBE, CUBE_FACES, [True, False]), "6 faces"),
        (lambda: Mesh(CUBE, CUBE_FACES, np.ones((5, 3))), "8 vertices or 24 corners"),
        (lambda: Surface(Mesh([*CUBE, (np.nan, 0, 0)], [*CUBE_FACES, [0, 1, 8]])), "not finite"),
        (lambda: Surface(Mesh(CUBE, CUBE_FACES, np.full((8, 3), np.inf))), "normals are not finite"),
        (lambda: Surface(Mesh([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [[0, 1, 2]])), "no area"),
    ],
)
def test_what_is_wrong_is_named(make, words):
    with pytest.raises(SceneError, match=words):
        make()
