"""Shape detection from plain arrays: what must be found, with the known map, and what must be refused."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

# operators/__init__.py imports bpy; an empty package over the same folder lets its numpy-only modules be imported
_package = types.ModuleType("operators_without_bpy")
_package.__path__ = [str(Path(__file__).resolve().parents[2] / "operators")]
sys.modules[_package.__name__] = _package
mesh_shapes = importlib.import_module("operators_without_bpy.mesh_shapes")
find_shapes, NotRecognised = mesh_shapes.find_shapes, mesh_shapes.NotRecognised

TRIANGULATE = ("no", "first", "second", "mixed")


# --- meshes as (vertices, list of polygons) ---------------------------------------------------------------------------


def uv_sphere(segments=32, rings=16):
    theta, phi = np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(segments) / segments
    t, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    vertices = np.column_stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    at = np.arange(segments * (rings - 1)).reshape(rings - 1, segments)
    north, south = at.size, at.size + 1
    polygons = [(north, at[0, j], at[0, (j + 1) % segments]) for j in range(segments)]
    for k in range(rings - 2):
        polygons += [
            (at[k, j], at[k + 1, j], at[k + 1, (j + 1) % segments], at[k, (j + 1) % segments]) for j in range(segments)
        ]
    polygons += [(south, at[-1, (j + 1) % segments], at[-1, j]) for j in range(segments)]
    return np.vstack([vertices, [[0, 0, 1], [0, 0, -1]]]), polygons


def grid(nx=1, ny=1):
    x, y = np.meshgrid(np.linspace(-1, 1, nx + 1), np.linspace(-1, 1, ny + 1), indexing="ij")
    at = np.arange(x.size).reshape(x.shape)
    quads = [(at[i, j], at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i in range(nx) for j in range(ny)]
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), quads


def cube():
    vertices = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    return vertices, [(0, 1, 3, 2), (2, 3, 7, 6), (6, 7, 5, 4), (4, 5, 1, 0), (2, 6, 4, 0), (7, 3, 1, 5)]


def cylinder(n=32, caps=True, top=1.0):
    phi = 2 * np.pi * np.arange(n) / n
    ring = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi - 1])
    sides = [(j, (j + 1) % n, n + (j + 1) % n, n + j) for j in range(n)]
    lids = [tuple(range(n))[::-1], tuple(range(n, 2 * n))] if caps else []
    return np.vstack([ring, ring * [top, top, -1]]), sides + lids


def cone(n=32):
    phi = 2 * np.pi * np.arange(n) / n
    ring = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi - 1])
    return np.vstack([ring, [[0, 0, 1]]]), [(j, (j + 1) % n, n) for j in range(n)] + [tuple(range(n))[::-1]]


def torus(n=24, m=12):
    a, b = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = 1 + 0.25 * np.cos(b)
    at = np.arange(n * m).reshape(n, m)
    quads = [
        (at[i, j], at[(i + 1) % n, j], at[(i + 1) % n, (j + 1) % m], at[i, (j + 1) % m])
        for i in range(n)
        for j in range(m)
    ]
    return np.column_stack([(r * np.cos(a)).ravel(), (r * np.sin(a)).ravel(), 0.25 * np.sin(b).ravel()]), quads


def icosahedron(subdivisions=0):
    g = (1 + 5**0.5) / 2
    vertices = [(s * a, t * b * g, 0.0) for s in (-1, 1) for t in (-1, 1) for a, b in [(1, 1)]]
    vertices = np.array([np.roll(v, k) for k in range(3) for v in vertices]) / np.sqrt(1 + g * g)
    near = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    edge = near[near > 0].min() * 1.01
    faces = [
        (i, j, k) if np.linalg.det(vertices[[i, j, k]]) > 0 else (i, k, j)
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if max(near[i, j], near[j, k], near[i, k]) < edge
    ]
    for _ in range(subdivisions):
        vertices, faces = subdivided(vertices, faces)
        vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, faces


def subdivided(vertices, triangles):
    vertices, middles, result = list(map(tuple, vertices)), {}, []

    def middle(a, b):
        if (key := (min(a, b), max(a, b))) not in middles:
            middles[key] = len(vertices)
            vertices.append(tuple((np.array(vertices[a]) + vertices[b]) / 2))
        return middles[key]

    for a, b, c in triangles:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        result += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.array(vertices), result


def quad_sphere(n=4):
    """A cube of n x n quads a face, blown up: what a sub-surfed cube comes close to."""
    vertices, polygons = joined(
        *(
            (np.roll(grid(n, n)[0] + [0, 0, 1], k, axis=1) * s, [q[::s] for q in grid(n, n)[1]])
            for k in range(3)
            for s in (1, -1)
        )
    )
    _, first, label = np.unique(np.round(vertices * n).astype(int), axis=0, return_index=True, return_inverse=True)
    vertices = vertices[first]
    label = label.ravel()
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), [tuple(label[list(q)]) for q in polygons]


def joined(*meshes):
    vertices, polygons, n = [], [], 0
    for v, p in meshes:
        vertices.append(v)
        polygons += [tuple(np.add(q, n)) for q in p]
        n += len(v)
    return np.vstack(vertices), polygons


def flipped(mesh):
    return mesh[0], [q[::-1] for q in mesh[1]]


def triangulated(mesh, how, rng):
    vertices, polygons = mesh
    result = []
    for polygon in polygons:
        if len(polygon) == 3 or how == "no":
            result.append(polygon)
            continue
        turn = {"first": 0, "second": 1, "mixed": int(rng.integers(2))}[how]
        q = polygon[turn:] + polygon[:turn]
        result += [(q[0], q[i], q[i + 1]) for i in range(1, len(q) - 1)]
    return vertices, result


def shuffled(mesh, rng):
    """Other vertex order, other polygon order, other first corners: the same surface."""
    vertices, polygons = mesh
    order = rng.permutation(len(vertices))
    to = np.argsort(order)
    polygons = [tuple(np.roll(to[list(polygons[i])], rng.integers(4))) for i in rng.permutation(len(polygons))]
    return vertices[order], polygons


def random_affine(rng, evenness=0.05):
    """A rotation, an uneven scale down to `evenness`, another rotation (shear), perhaps a mirror."""
    q1, q2 = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    return q1 @ np.diag(np.exp(rng.uniform(np.log(evenness), 0, 3))) @ q2


def mapped(mesh, linear, origin=(0, 0, 0)):
    """The mesh under an affine map, stored in float32; a mirror keeps the winding's side as Blender's apply does."""
    vertices = mesh[0] @ np.transpose(linear) + origin
    polygons = mesh[1] if np.linalg.det(linear) > 0 else [q[::-1] for q in mesh[1]]
    return vertices.astype(np.float32), polygons


def find(mesh, materials=None):
    vertices, polygons = mesh
    corners = np.concatenate([np.asarray(q, int) for q in polygons]) if polygons else np.zeros(0, int)
    return find_shapes(np.asarray(vertices, np.float32), corners, [len(q) for q in polygons], materials)


def reason(mesh, materials=None):
    with pytest.raises(NotRecognised) as refused:
        find(mesh, materials)
    return str(refused.value)


def sphere_error(shape, linear, origin, size):
    """How far the found ellipsoid is from the true one: origins and L L^T, relative to the size."""
    found, l_true = shape.matrix[:3, :3], np.asarray(linear, float)
    return max(
        np.abs(shape.matrix[:3, 3] - origin).max() / size,
        np.abs(found @ found.T - l_true @ l_true.T).max() / np.linalg.norm(l_true, 2) ** 2,
    )


# --- spheres ----------------------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=150)
@given(
    st.integers(3, 64),
    st.integers(3, 40),
    st.sampled_from(TRIANGULATE),
    st.floats(-6, 6),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_any_affine_uv_sphere(segments, rings, how, log_size, inward, seed):
    rng = np.random.default_rng(seed)
    size = 10.0**log_size
    linear, origin = size * random_affine(rng), size * rng.uniform(-2, 2, 3)
    mesh = shuffled(triangulated(uv_sphere(segments, rings), how, rng), rng)
    mesh = mapped(flipped(mesh) if inward else mesh, linear, origin)
    found = find(mesh)
    (shape,) = found.shapes
    assert (shape.segments, shape.rings, shape.is_outward) == (segments, rings, not inward)
    assert found.kind == "SPHERE" and found.label == f"UV sphere {segments} x {rings}"
    assert np.linalg.det(shape.matrix[:3, :3]) > 0
    assert sphere_error(shape, linear, origin, size) < 3e-6
    assert (found.polygon_shape == 0).all() and len(found.polygon_shape) == len(mesh[1])


@pytest.mark.parametrize("segments", [3, 4, 5, 6, 8])
@pytest.mark.parametrize("rings", [3, 4, 5, 6, 8])
@pytest.mark.parametrize("how", TRIANGULATE)
def test_small_counts_where_poles_have_the_valence_of_others(segments, rings, how):
    rng = np.random.default_rng(segments * 100 + rings)
    (shape,) = find(shuffled(triangulated(uv_sphere(segments, rings), how, rng), rng)).shapes
    assert (shape.segments, shape.rings, shape.is_outward) == (segments, rings, True)


@pytest.mark.parametrize("how", TRIANGULATE)
def test_a_row_of_spheres_of_one_topology(how):
    """What is remembered of the first must not mislead: mirrored, inward, edited, or another shape altogether."""
    rng = np.random.default_rng(8)
    vertices, polygons = shuffled(triangulated(uv_sphere(7, 5), how, rng), rng)
    corners, counts, grids = np.concatenate(polygons), [len(q) for q in polygons], {}
    for _ in range(20):
        linear, origin = random_affine(rng), rng.uniform(-2, 2, 3)
        (shape,) = find_shapes((vertices @ linear.T + origin).astype(np.float32), corners, counts, grids=grids).shapes
        assert sphere_error(shape, linear, origin, 1.0) < 3e-6
        assert shape.is_outward == (np.linalg.det(linear) > 0) and np.linalg.det(shape.matrix[:3, :3]) > 0
    assert len(grids) == 1
    bent = vertices.copy()
    bent[3] *= 1.01
    with pytest.raises(NotRecognised):
        find_shapes(bent, corners, counts, grids=grids)


@pytest.mark.parametrize("radius", [1e-3, 0.37, 1.0, 250.0])
def test_round_spheres_of_any_tessellation_are_one_and_the_same(radius):
    matrices = [find(mapped(uv_sphere(s, r), radius * np.eye(3))).shapes[0].matrix for s, r in [(8, 4), (128, 64)]]
    np.testing.assert_array_equal(matrices[0], matrices[1])
    np.testing.assert_array_equal(matrices[0], np.diag([np.float32(radius)] * 3 + [1.0]))


@pytest.mark.parametrize("distance, error", [(10, 3e-6), (1e3, 1e-4), (2e4, 3e-3)])
def test_mesh_data_far_from_the_origin(distance, error):
    (shape,) = find(mapped(uv_sphere(), np.eye(3), [distance, -distance, 0])).shapes
    assert np.abs(shape.matrix[:3, :3] - np.eye(3)).max() < error
    assert np.abs(shape.matrix[:3, 3] - [distance, -distance, 0]).max() < error


def test_mesh_data_too_far_from_the_origin():
    assert "origin" in reason(mapped(uv_sphere(), 1e-3 * np.eye(3), [300, 0, 0]))


def test_a_flat_scaled_sphere_is_refused():
    assert "neither" in reason(mapped(uv_sphere(), np.diag([1, 1, 0])))
    assert "flat" in reason(mapped(uv_sphere(), np.diag([1, 1, 1e-6]), [1, 0, 0]))


@pytest.mark.parametrize("move", [1e-3, 1e-2, 0.3])
@pytest.mark.parametrize("vertex", [0, 200, 480])
@pytest.mark.parametrize("along", [0, 1, 2])
def test_an_edited_sphere_is_refused(move, vertex, along):
    vertices, polygons = uv_sphere()
    vertices[vertex, along] += move
    assert "UV sphere" in reason((vertices, polygons))


def test_a_sphere_with_a_face_missing_twice_or_flipped_is_refused():
    vertices, polygons = uv_sphere(8, 6)
    for at in (0, 12, len(polygons) - 1):
        reason((vertices, polygons[:at] + polygons[at + 1 :]))
        reason((vertices, [*polygons, polygons[at]]))
        flipped_one = [q[::-1] if i == at else q for i, q in enumerate(polygons)]
        assert "both ways" in reason((vertices, flipped_one))
    folded = [(q[0], q[2], q[1], q[3]) if len(q) == 4 else q for q in polygons]
    reason((vertices, folded))


def test_a_sphere_with_overlapping_triangles_in_a_cell_is_refused():
    vertices, polygons = uv_sphere(8, 6)
    a, b, c, d = polygons[20]
    for pair in ([(a, b, c), (a, b, c)], [(a, b, c), (a, b, d)], [(a, b, c), (b, c, d)]):
        reason((vertices, polygons[:20] + polygons[21:] + pair))


def test_uneven_rings_are_refused():
    """Vertices on the sphere and the right topology, but rings at even heights instead of even angles."""
    vertices, polygons = uv_sphere(32, 16)
    z = np.round(np.arccos(np.clip(vertices[:, 2], -1, 1)) * 16 / np.pi) / 8 - 1
    phi = np.arctan2(vertices[:, 1], vertices[:, 0])
    r = np.sqrt(1 - z * z)
    reason((np.column_stack([r * np.cos(phi), r * np.sin(phi), -z]), polygons))


def test_a_twisted_sphere_is_refused():
    vertices, polygons = uv_sphere(16, 8)
    turn = 0.3 * vertices[:, 2]
    x, y, z = vertices.T
    reason((np.column_stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z]), polygons))


@pytest.mark.parametrize(
    "mesh",
    [
        cylinder(32),
        cylinder(3),
        cylinder(32, top=0.5),
        cone(),
        cone(4),
        torus(),
        icosahedron(0),
        icosahedron(1),
        icosahedron(2),
        icosahedron(3),
        quad_sphere(2),
        quad_sphere(4),
        quad_sphere(8),
        uv_sphere(4, 2),
    ],
    ids="cylinder prism frustum cone pyramid torus ico0 ico1 ico2 ico3 quad2 quad4 quad8 octa".split(),
)
@pytest.mark.parametrize("how", TRIANGULATE)
def test_other_bodies_are_refused(mesh, how):
    rng = np.random.default_rng(5)
    mesh = triangulated(mesh, how, rng)
    for size in (1.0, 1e-3, 1e3):
        for linear in (np.eye(3), random_affine(rng)):
            assert "neither" in reason(mapped(shuffled(mesh, rng), size * linear, size * rng.uniform(-1, 1, 3)))


def test_several_materials_on_a_sphere_are_refused():
    mesh = uv_sphere(8, 4)
    assert "material" in reason(mesh, np.arange(len(mesh[1])) % 2)


# --- planes -----------------------------------------------------------------------------------------------------------


def corners_of(shape):
    return np.array([shape.corner, shape.corner + shape.u, shape.corner + shape.u + shape.v, shape.corner + shape.v])


def same_points(a, b, slack):
    """Each row of a has its own row in b."""
    near = np.linalg.norm(a[:, None] - b[None], axis=2) <= slack
    return (near.sum(axis=0) == 1).all() and (near.sum(axis=1) == 1).all()


@settings(deadline=None, max_examples=150)
@given(
    st.integers(1, 12),
    st.integers(1, 12),
    st.sampled_from(TRIANGULATE),
    st.floats(-6, 6),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_any_parallelogram(nx, ny, how, log_size, flip, seed):
    rng = np.random.default_rng(seed)
    size = 10.0**log_size
    linear, origin = size * random_affine(rng), size * rng.uniform(-2, 2, 3)
    mesh = shuffled(triangulated(grid(nx, ny), how, rng), rng)
    found = find(mapped(flipped(mesh) if flip else mesh, linear, origin))
    (shape,) = found.shapes
    true = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) @ linear.T + origin
    assert found.kind == "PLANE" and found.label == "plane"
    assert same_points(corners_of(shape), true, 2e-6 * size)
    normal = np.linalg.inv(linear).T @ [0, 0, -1.0 if flip else 1.0]
    assert np.cross(shape.u, shape.v) @ normal > 0


def test_irregular_subdivision_and_ngons():
    """Vertices on the sides, a concave n-gon, fans: the outline is what counts."""
    vertices = np.array([(0, 0), (2, 0), (4, 0), (4, 3), (4, 4), (1, 4), (0, 4), (0, 1), (1, 1), (3, 2)], float)
    polygons = [(0, 1, 9, 8, 7), (1, 2, 3, 9), (3, 4, 5, 9), (5, 6, 7, 8, 9)]
    (shape,) = find((np.column_stack([vertices, 0 * vertices[:, 0]]), polygons)).shapes
    assert same_points(corners_of(shape), np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0.0]]), 1e-6)


def test_a_sliver_and_a_fine_grid():
    for mesh, linear in [
        (grid(40, 1), np.diag([10, 1e-3, 1])),
        (grid(120, 120), random_affine(np.random.default_rng(1))),
    ]:
        assert len(find(mapped(mesh, linear, [3, 2, 1])).shapes) == 1


@pytest.mark.parametrize(
    "kept", [lambda i, j: (i, j) != (1, 1), lambda i, j: (i, j) != (2, 2), lambda i, j: i < 2 or j]
)
def test_holes_and_notches_are_refused(kept):
    vertices, polygons = grid(3, 3)
    polygons = [q for i, q in enumerate(polygons) if kept(*divmod(i, 3))]
    used = np.unique(polygons)
    mesh = vertices[used], [tuple(np.searchsorted(used, q)) for q in polygons]
    assert "parallelogram" in reason(mesh)


@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (2, 0), (1, 1)],
        [(0, 0), (2, 0), (1.5, 1), (0, 1)],
        [(0, 0), (2, 0), (2, 1), (0.001, 1)],
        [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
        [(0, 0), (2, 0), (2, 1), (1, 1.001), (0, 1)],
        [(np.cos(a), np.sin(a)) for a in np.arange(64) * np.pi / 32],
        [(0, 0), (2, 0), (0.9, 0.5), (2, 1), (0, 1)],
    ],
    ids=["triangle", "trapezoid", "nearly", "L", "bulge", "disc", "concave"],
)
def test_other_outlines_are_refused(outline):
    rng = np.random.default_rng(3)
    vertices = np.column_stack([np.array(outline, float), np.zeros(len(outline))])
    for size in (1.0, 1e-3, 1e3):
        linear, origin = size * random_affine(rng), size * rng.uniform(-1, 1, 3)
        assert "neither" in reason(mapped((vertices, [tuple(range(len(outline)))]), linear, origin))


@pytest.mark.parametrize("height", [1e-4, 1e-3, 0.1])
def test_bent_and_curved_sheets_are_refused(height):
    vertices, polygons = grid(20, 20)
    vertices[:, 2] = height * vertices[:, 0] ** 2 * 10
    assert "neither" in reason((vertices, polygons))
    twisted, quad = grid(1, 1)
    twisted[0, 2] += height
    assert "neither" in reason((twisted, quad))


def test_doubled_and_opposite_faces_are_refused():
    vertices, polygons = grid(3, 3)
    assert "neither" in reason((vertices, [*polygons, polygons[4]]))
    assert "opposite" in reason((vertices, [q[::-1] if i == 4 else q for i, q in enumerate(polygons)]))
    assert "neither" in reason((vertices, [*polygons, *flipped((vertices, polygons))[1]]))


def test_faces_without_area_are_refused():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], float)
    assert "without area" in reason((vertices, [(0, 2, 3, 4), (0, 1, 2)]))
    assert "without area" in reason((np.zeros((4, 3)), [(0, 1, 2, 3)]))
    assert "neither" in reason((np.array([(0, 0, 0), (1, 0, 0), (1, 1e-9, 0), (0, 1e-9, 0)]), [(0, 1, 2, 3)]))


# --- boxes, rooms, several pieces -------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(st.sampled_from(TRIANGULATE), st.floats(-6, 6), st.booleans(), st.integers(0, 2**32 - 1))
def test_any_box_or_room(how, log_size, inward, seed):
    rng = np.random.default_rng(seed)
    size = 10.0**log_size
    linear, origin = size * random_affine(rng), size * rng.uniform(-2, 2, 3)
    mesh = shuffled(triangulated(cube(), how, rng), rng)
    found = find(mapped(flipped(mesh) if inward else mesh, linear, origin))
    assert found.kind == "PLANES" and found.label == "6 planes" and len(found.shapes) == 6
    volume = 0.0
    for shape in found.shapes:
        outward = np.cross(shape.u, shape.v) @ (shape.corner + (shape.u + shape.v) / 2 - origin)
        assert (outward > 0) != inward
        volume += outward / 3
    assert abs(volume) == pytest.approx(8 * abs(np.linalg.det(linear)), rel=1e-3)
    assert sorted(np.bincount(found.polygon_shape)) == [1 if how == "no" else 2] * 6


def test_polygons_know_their_plane():
    vertices, polygons = subdivided(*triangulated(cube(), "mixed", np.random.default_rng(0)))
    found = find((vertices, polygons))
    for polygon, k in zip(polygons, found.polygon_shape, strict=True):
        shape = found.shapes[k]
        assert np.abs((vertices[list(polygon)] - shape.corner) @ np.cross(shape.u, shape.v)).max() < 1e-6


def test_materials_part_planes():
    found = find(grid(4, 3), np.repeat([7, 9], 6))
    assert len(found.shapes) == 2
    assert same_points(corners_of(found.shapes[0]), np.array([[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0.0]]), 1e-6)
    np.testing.assert_array_equal(found.polygon_shape, np.repeat([0, 1], 6))


def test_three_walls_meeting_at_one_edge():
    wall = [(0, 0, 0), (0, 0, 1)] + [p for x, y in [(1, 0), (0, 1), (-1, -1)] for p in [(x, y, 0), (x, y, 1)]]
    found = find((np.array(wall, float), [(0, 2, 3, 1), (0, 4, 5, 1), (0, 6, 7, 1)]))
    assert len(found.shapes) == 3


def test_fine_meshes_take_no_search_over_all_vertices():
    """Fine and smooth: every vertex is nearly the mean of its neighbours, as a pole is."""
    (shape,) = find(uv_sphere(400, 200)).shapes
    assert (shape.segments, shape.rings) == (400, 200)
    vertices, polygons = torus(300, 202)
    assert "neither" in reason((vertices, polygons))


def test_octagonal_rooms_are_planes_but_finer_facets_are_not():
    assert len(find(cylinder(8, caps=False)).shapes) == 8
    for n in (9, 12, 32, 100):
        assert "rounded" in reason(cylinder(n, caps=False))


def test_joined_pieces():
    far = [(5, 0, 0), (0, 5, 0), (0, 0, 5), (-5, 0, 0)]
    pieces = [uv_sphere(8, 6), grid(2, 2), flipped(uv_sphere(16, 8)), cube()]
    found = find(joined(*(mapped(mesh, np.eye(3), at) for mesh, at in zip(pieces, far, strict=True))))
    assert found.kind == "SHAPES" and found.label == "2 UV spheres, 7 planes"
    spheres = [s for s in found.shapes if isinstance(s, mesh_shapes.SphereShape)]
    assert [(s.segments, s.is_outward) for s in spheres] == [(8, True), (16, False)]
    np.testing.assert_allclose([s.matrix[:3, 3] for s in spheres], [far[0], far[2]], atol=1e-6)
    counts = [len(pieces[0][1]), 4, len(pieces[2][1]), 1, 1, 1, 1, 1, 1]
    np.testing.assert_array_equal(found.polygon_shape, np.repeat(np.arange(9), counts))


def test_one_bad_piece_refuses_the_whole():
    assert "neither" in reason(joined(grid(2, 2), mapped(torus(), np.eye(3), (9, 0, 0))))


# --- bad meshes -------------------------------------------------------------------------------------------------------


def test_bad_meshes_have_reasons():
    vertices, polygons = grid(2, 2)
    assert "no faces" in reason((np.zeros((0, 3)), []))
    assert "no faces" in reason((vertices, []))
    assert "loose" in reason((np.vstack([vertices, [[0, 0, 1]]]), polygons))
    vertices[0, 0] = np.nan
    assert "not finite" in reason((vertices, polygons))
