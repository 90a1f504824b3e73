"""Shape detection from plain arrays: what must be found, with the known map, and what must not be mistaken for it."""

import importlib
import sys
import tracemalloc
import types
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

# the package and its operators import bpy; empty ones over the same folders let numpy-only modules be imported
for _name, _path in (("without_bpy", "."), ("without_bpy.operators", "operators")):
    _package = types.ModuleType(_name)
    _package.__path__ = [str(Path(__file__).resolve().parents[2] / _path)]
    sys.modules.setdefault(_name, _package)
mesh_shapes = importlib.import_module("without_bpy.operators.reading.mesh_shapes")
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


def polygon_shape(found, mesh):
    """(p,) the shape of each polygon's first corner."""
    assert len(found.corner_shape) == sum(len(q) for q in mesh[1])
    return found.corner_shape[np.cumsum([0] + [len(q) for q in mesh[1]])[:-1]]


def not_a_sphere(mesh):
    return find(mesh).counts[0] == 0


def loop_area(loop):
    return np.cross(loop - loop[0], np.roll(loop, -1, axis=0) - loop[0]).sum(axis=0) / 2


def area(shape):
    if isinstance(shape, mesh_shapes.PlaneShape):
        return np.linalg.norm(np.cross(shape.u, shape.v))
    if isinstance(shape, mesh_shapes.PolygonShape):
        return np.linalg.norm(sum(loop_area(loop) for loop in (shape.outline, *shape.holes)))
    a, b, c = (shape.vertices[shape.triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def mesh_area(mesh):
    return sum(np.linalg.norm(loop_area(mesh[0][list(q)].astype(float))) for q in mesh[1])


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
    assert (polygon_shape(found, mesh) == 0).all()


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
    assert find_shapes(bent, corners, counts, grids=grids).counts[0] == 0


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


def test_a_flat_scaled_sphere_is_none():
    assert not_a_sphere(mapped(uv_sphere(), np.diag([1, 1, 0])))
    assert not_a_sphere(mapped(uv_sphere(), np.diag([1, 1, 1e-6]), [1, 0, 0]))


@pytest.mark.parametrize("move", [1e-3, 1e-2, 0.3])
@pytest.mark.parametrize("vertex", [0, 200, 480])
@pytest.mark.parametrize("along", [0, 1, 2])
def test_an_edited_sphere_is_a_mesh(move, vertex, along):
    vertices, polygons = uv_sphere()
    vertices[vertex, along] += move
    found = find((vertices, polygons))
    faces = sum(shape.faces for shape in found.shapes if isinstance(shape, mesh_shapes.MeshShape))
    assert found.kind == "MESH" and faces + 4 >= len(polygons)


def test_a_sphere_with_a_face_missing_twice_or_flipped_is_none():
    vertices, polygons = uv_sphere(8, 6)
    for at in (0, 12, len(polygons) - 1):
        assert not_a_sphere((vertices, polygons[:at] + polygons[at + 1 :]))
        assert not_a_sphere((vertices, [q[::-1] if i == at else q for i, q in enumerate(polygons)]))
        twice = find((vertices, [*polygons, polygons[at]]))
        assert "on another face" in twice.warnings[0]
    assert not_a_sphere((vertices, [(q[0], q[2], q[1], q[3]) if len(q) == 4 else q for q in polygons]))


def test_a_sphere_with_overlapping_triangles_in_a_cell_is_none():
    vertices, polygons = uv_sphere(8, 6)
    a, b, c, d = polygons[20]
    for pair in ([(a, b, c), (a, b, c)], [(a, b, c), (a, b, d)], [(a, b, c), (b, c, d)]):
        assert not_a_sphere((vertices, polygons[:20] + polygons[21:] + pair))


def test_uneven_rings_are_no_sphere():
    """Vertices on the sphere and the right topology, but rings at even heights instead of even angles."""
    vertices, polygons = uv_sphere(32, 16)
    z = np.round(np.arccos(np.clip(vertices[:, 2], -1, 1)) * 16 / np.pi) / 8 - 1
    phi = np.arctan2(vertices[:, 1], vertices[:, 0])
    r = np.sqrt(1 - z * z)
    tracemalloc.start()
    assert not_a_sphere((np.column_stack([r * np.cos(phi), r * np.sin(phi), -z]), polygons))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e7  # bytes: 1 GB was looked through for crossings


def test_a_twisted_sphere_is_none():
    vertices, polygons = uv_sphere(16, 8)
    turn = 0.3 * vertices[:, 2]
    x, y, z = vertices.T
    x, y = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
    assert not_a_sphere((np.column_stack([x, y, z]), polygons))


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
def test_other_bodies_are_no_spheres_and_keep_their_area(mesh, how):
    rng = np.random.default_rng(5)
    mesh = triangulated(mesh, how, rng)
    for size in (1.0, 1e-3, 1e3):
        for linear in (np.eye(3), random_affine(rng)):
            moved = mapped(shuffled(mesh, rng), size * linear, size * rng.uniform(-1, 1, 3))
            found = find(moved)
            assert found.counts[0] == 0
            # bent quads of a prism that rounding turns are cut one way or the other
            assert sum(area(shape) for shape in found.shapes) == pytest.approx(mesh_area(moved), rel=5e-3)


def test_several_materials_on_a_sphere_make_it_a_mesh():
    mesh = uv_sphere(8, 4)
    found = find(mesh, np.arange(len(mesh[1])) % 2)
    assert found.counts[0] == 0 and "material" in found.warnings[0]
    np.testing.assert_array_equal(np.unique(found.material), [0, 1])


def test_split_vertices_are_welded():
    vertices, polygons = uv_sphere(12, 7)
    corners = np.concatenate(polygons)
    counts = [len(q) for q in polygons]
    found = find_shapes(vertices[corners].astype(np.float32), np.arange(len(corners)), counts)
    assert found.label == "UV sphere 12 x 7"


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
    "gone, outline, holes",
    [
        ([(1, 1)], 4, [4]),
        ([(4, 4)], 6, []),
        ([(0, 0), (4, 0), (2, 4)], 12, []),
        ([(1, 1), (3, 3)], 4, [4, 4]),
        ([(1, 1), (1, 2), (2, 1)], 4, [6]),
        ([(0, 1), (2, 2)], 8, [4]),
    ],
)
@pytest.mark.parametrize("how", TRIANGULATE)
def test_holes_and_notches_are_polygons(gone, outline, holes, how):
    rng = np.random.default_rng(4)
    vertices, polygons = grid(5, 5)
    polygons = [q for i, q in enumerate(polygons) if divmod(i, 5) not in gone]
    for size in (1.0, 1e-3, 1e3):
        linear, origin = size * random_affine(rng), size * rng.uniform(-1, 1, 3)
        moved = mapped(shuffled(triangulated((vertices, polygons), how, rng), rng), linear, origin)
        used = np.unique(np.concatenate(moved[1]))
        moved = moved[0][used], [tuple(np.searchsorted(used, q)) for q in moved[1]]
        (shape,) = find(moved).shapes
        assert len(shape.outline) == outline and [len(h) for h in shape.holes] == holes
        assert area(shape) == pytest.approx(mesh_area(moved), rel=1e-5)


@pytest.mark.parametrize("gone, loops", [((6, 12), [4, 8]), ((6, 12, 18), [4, 12]), ((6, 8, 12), [4, 12])])
@pytest.mark.parametrize("how", TRIANGULATE)
def test_holes_that_meet_at_a_vertex(gone, loops, how):
    vertices, polygons = grid(5, 5)
    mesh = vertices, [q for i, q in enumerate(polygons) if i not in gone]
    mesh = triangulated(mesh, how, np.random.default_rng(3))
    (shape,) = find(mesh).shapes
    assert area(shape) == pytest.approx(mesh_area(mesh), rel=1e-6)
    assert [len(shape.outline), *map(len, shape.holes)] == loops


OUTLINES = {
    "triangle": [(0, 0), (2, 0), (1, 1)],
    "trapezoid": [(0, 0), (2, 0), (1.5, 1), (0, 1)],
    "nearly": [(0, 0), (2, 0), (2, 1), (0.001, 1)],
    "L": [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
    "bulge": [(0, 0), (2, 0), (2, 1), (1, 1.001), (0, 1)],
    "disc": [(np.cos(a), np.sin(a)) for a in np.arange(64) * np.pi / 32],
    "concave": [(0, 0), (2, 0), (0.9, 0.5), (2, 1), (0, 1)],
}


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES.keys())
def test_any_outline_is_a_polygon(outline):
    rng = np.random.default_rng(3)
    vertices = np.column_stack([np.array(outline, float), np.zeros(len(outline))])
    for size in (1.0, 1e-3, 1e3):
        linear, origin = size * random_affine(rng), size * rng.uniform(-1, 1, 3)
        mesh = mapped((vertices, [tuple(range(len(outline)))]), linear, origin)
        found = find(mesh)
        (shape,) = found.shapes
        assert (found.kind, found.label, found.exactness) == ("POLYGONS", "polygon", "exact")
        assert same_points(shape.outline, mesh[0].astype(float), 1e-6 * size)
        normal = np.cross(shape.outline - shape.outline[0], np.roll(shape.outline, -1, axis=0) - shape.outline[0])
        assert normal.sum(axis=0) @ np.linalg.inv(linear).T[:, 2] > 0


@pytest.mark.parametrize("height", [1e-4, 1e-3, 0.1])
def test_curved_sheets_are_meshes_and_bent_faces_their_triangles(height):
    vertices, polygons = grid(30, 20)
    vertices[:, 2] = height * vertices[:, 0] ** 2 * 10
    assert find((vertices, polygons)).label == "mesh of 600 faces"
    twisted, quad = grid(1, 1)
    twisted[0, 2] += height
    found = find((twisted, quad))
    assert found.label == "2 polygons" and len(np.unique(found.triangle_shape)) == 2
    for triangle, shape in zip([(0, 1, 2), (0, 2, 3)], found.triangle_shape, strict=True):
        assert same_points(found.shapes[shape].outline, twisted[[quad[0][k] for k in triangle]], 1e-6)


def test_doubled_and_opposite_faces_are_mended():
    vertices, polygons = grid(3, 3)
    doubled = find((vertices, [*polygons, polygons[4]]))
    assert doubled.label == "plane" and "1 face on another" in doubled.warnings[0] and not doubled.corner_back.any()
    opposite = find((vertices, [q[::-1] if i == 4 else q for i, q in enumerate(polygons)]))
    assert opposite.label == "plane"
    np.testing.assert_array_equal(opposite.corner_back, np.repeat(np.arange(9) == 4, 4))
    both = find((vertices, [*polygons, *flipped((vertices, polygons))[1]]))
    assert both.label == "plane" and "9 faces on another" in both.warnings[0]
    np.testing.assert_array_equal(both.corner_back, np.arange(72) >= 36)


@pytest.mark.parametrize("tilt", [0.0, 1.1])
def test_what_is_folded_in_one_plane_is_one_mesh(tilt):
    """Its parts were polygons that lie against each other, and dark. A flap folded over a wall is as well."""
    vertices, polygons = cylinder(9, top=0.5)
    turn = np.array([(1, 0, 0), (0, np.cos(tilt), -np.sin(tilt)), (0, np.sin(tilt), np.cos(tilt))])
    found = find(((vertices * (1, 1, 0)) @ turn.T, polygons))
    assert found.counts == (0, 0, 0, 1) and found.label == "mesh of 11 faces"
    corners = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (1.5, 0.25, 0), (0.5, 0.25, 0)], float)
    found = find((corners @ turn.T, [(0, 1, 2, 3), (1, 0, 5, 4)]))
    assert found.label == "mesh of 2 faces" and not found.corner_back.any()


def test_faces_without_area_are_left_out():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], float)
    found = find((vertices, [(0, 2, 3, 4), (0, 1, 2)]))
    assert found.label == "plane" and "1 face without area" in found.warnings[0]
    np.testing.assert_array_equal(found.corner_shape, 0)
    assert "area" in reason((np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], float), [(0, 1, 2, 3)]))


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
    assert sorted(np.bincount(polygon_shape(found, mesh))) == [1 if how == "no" else 2] * 6


def test_polygons_know_their_plane():
    vertices, polygons = subdivided(*triangulated(cube(), "mixed", np.random.default_rng(0)))
    found = find((vertices, polygons))
    for polygon, k in zip(polygons, polygon_shape(found, (vertices, polygons)), strict=True):
        shape = found.shapes[k]
        assert np.abs((vertices[list(polygon)] - shape.corner) @ np.cross(shape.u, shape.v)).max() < 1e-6


def test_materials_part_planes():
    found = find(grid(4, 3), np.repeat([7, 9], 6))
    assert len(found.shapes) == 2
    assert same_points(corners_of(found.shapes[0]), np.array([[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0.0]]), 1e-6)
    np.testing.assert_array_equal(found.corner_shape, np.repeat([0, 1], 24))
    np.testing.assert_array_equal(found.material, [7, 9])


def test_three_walls_meeting_at_one_edge():
    wall = [(0, 0, 0), (0, 0, 1)] + [p for x, y in [(1, 0), (0, 1), (-1, -1)] for p in [(x, y, 0), (x, y, 1)]]
    found = find((np.array(wall, float), [(0, 2, 3, 1), (0, 4, 5, 1), (0, 6, 7, 1)]))
    assert len(found.shapes) == 3


def test_fine_meshes_take_no_search_over_all_vertices():
    """Fine and smooth: every vertex is nearly the mean of its neighbours, as a pole is."""
    (shape,) = find(uv_sphere(400, 200)).shapes
    assert (shape.segments, shape.rings) == (400, 200)
    assert find(torus(300, 200)).label == "mesh of 60,000 faces"


def test_columns_are_planes_and_finer_facets_are_meshes():
    for n in (8, 12, 24):
        assert find(cylinder(n)).label == f"{n} planes, 2 polygons"
    for n in (25, 32, 100):
        assert find(cylinder(n)).label == f"2 polygons, mesh of {n} faces"


def test_smooth_columns_are_meshes_and_smooth_cubes_are_not():
    for mesh, label in ((cylinder(6), "2 polygons, mesh of 6 faces"), (cube(), "6 planes")):
        vertices, polygons = mesh
        corners, counts = np.concatenate(polygons), [len(q) for q in polygons]
        smooth = vertices[corners] / np.linalg.norm(vertices[corners], axis=1, keepdims=True)
        found = find_shapes(vertices.astype(np.float32), corners, counts, normals=smooth)
        assert found.label == label
        for shape in found.shapes:
            if isinstance(shape, mesh_shapes.MeshShape):
                at = shape.vertices[shape.triangles]
                np.testing.assert_allclose(shape.normals, at / np.linalg.norm(at, axis=2, keepdims=True), atol=1e-6)


def test_many_small_parts_are_a_mesh():
    rng = np.random.default_rng(2)
    leaves = [
        mapped(grid(), 0.01 * np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.uniform(-1, 1, 3)) for _ in range(1500)
    ]
    found = find(joined(grid(), *leaves))
    assert found.label == "1 plane, mesh of 1,500 faces"


def test_closed_bodies_are_told_through_polygons_and_meshes():
    found = find(joined(cylinder(32), mapped(grid(), np.eye(3), (9, 0, 0))))
    assert found.label == "1 plane, 2 polygons, mesh of 32 faces"
    numbers = dict(zip([type(s).__name__ for s in found.shapes], found.bodies.tolist()))
    assert numbers["PlaneShape"] == -1 and numbers["MeshShape"] == numbers["PolygonShape"] >= 0
    assert (find(flipped(cylinder(32))).bodies == -1).all()


def test_joined_pieces():
    far = [(5, 0, 0), (0, 5, 0), (0, 0, 5), (-5, 0, 0)]
    pieces = [uv_sphere(8, 6), grid(2, 2), flipped(uv_sphere(16, 8)), cube()]
    found = find(joined(*(mapped(mesh, np.eye(3), at) for mesh, at in zip(pieces, far, strict=True))))
    assert found.kind == "SHAPES" and found.label == "2 UV spheres, 7 planes"
    spheres = [s for s in found.shapes if isinstance(s, mesh_shapes.SphereShape)]
    assert [(s.segments, s.is_outward) for s in spheres] == [(8, True), (16, False)]
    np.testing.assert_allclose([s.matrix[:3, 3] for s in spheres], [far[0], far[2]], atol=1e-6)
    counts = [len(pieces[0][1]), 4, len(pieces[2][1]), 1, 1, 1, 1, 1, 1]
    np.testing.assert_array_equal(polygon_shape(found, joined(*pieces)), np.repeat(np.arange(9), counts))


def test_pieces_of_every_kind():
    pieces = [uv_sphere(8, 6), grid(2, 2), torus(), cylinder(32), cube()]
    mesh = joined(*(mapped(m, np.eye(3), (9 * k, 0, 0)) for k, m in enumerate(pieces)))
    found = find(mesh)
    assert found.kind == "MESH" and found.label == "1 UV sphere, 7 planes, 2 polygons, mesh of 320 faces"
    (rest,) = [s for s in found.shapes if isinstance(s, mesh_shapes.MeshShape)]
    assert len(rest.triangles) == 2 * (288 + 32)


def test_meshes_at_once_are_what_each_is_alone():
    """Of any sizes, places and materials; those that are none say why, and change nothing of the others."""
    rng = np.random.default_rng(4)
    bad = grid(2, 2)
    bad[0][0, 0] = np.inf
    kinds = [
        uv_sphere(8, 6), uv_sphere(8, 6), grid(2, 2), bad, torus(), (np.zeros((0, 3)), []), cylinder(32), cube(),
        (np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), [(0, 1, 2)]), quad_sphere(), icosahedron(2),
        joined(uv_sphere(6, 4), mapped(cube(), np.eye(3), (5, 0, 0))), joined(grid(3, 1), grid(3, 1)), cone(),
    ]  # fmt: skip
    meshes = [mapped(kind, 10 ** rng.uniform(-3, 3) * random_affine(rng), rng.normal(size=3)) for kind in kinds]
    given = []
    for vertices, polygons in meshes:
        corners = np.concatenate([np.asarray(q, int) for q in polygons]) if polygons else np.zeros(0, int)
        counts = np.array([len(q) for q in polygons], int)
        materials = np.minimum(np.arange(len(counts)), len(given) % 3)
        given.append(mesh_shapes.Given(vertices, corners, counts, materials if len(given) % 2 else None))
    for order in (np.arange(len(given)), rng.permutation(len(given))):
        for k, found in zip(order, mesh_shapes.find_all([given[k] for k in order]), strict=True):
            (alone,) = mesh_shapes.find_all([given[k]])
            if isinstance(alone, NotRecognised):
                assert str(found) == str(alone) and k in (3, 5, 8)
                continue
            assert (found.label, found.warnings) == (alone.label, alone.warnings)
            for name in ("corner_shape", "triangle_shape", "corner_back", "triangle_back", "material"):
                np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))
            np.testing.assert_array_equal(found.bodies >= 0, alone.bodies >= 0)
            size = np.abs(meshes[k][0]).max()
            for shape, other in zip(found.shapes, alone.shapes, strict=True):
                assert type(shape) is type(other)
                for name, value in vars(other).items():
                    for a, b in zip(*(v if isinstance(v, list) else [v] for v in (vars(shape)[name], value))):
                        np.testing.assert_allclose(a, b, atol=1e-9 * size)


# --- bad meshes -------------------------------------------------------------------------------------------------------


def test_bad_meshes_have_reasons():
    vertices, polygons = grid(2, 2)
    assert "no faces" in reason((np.zeros((0, 3)), []))
    assert "no faces" in reason((vertices, []))
    assert find((np.vstack([vertices, [[0, 0, 1]]]), polygons)).label == "plane"
    vertices[0, 0] = np.nan
    assert "not finite" in reason((vertices, polygons))
