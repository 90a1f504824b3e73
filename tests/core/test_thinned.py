"""Many places: light gathered at few and interpolated between; many facets: sifted before they are projected."""

import numpy as np
import pytest

from pdm_core import Mesh, Scene, Sphere, Surface, solve
from pdm_core.rays import thinned as thinning
from pdm_core.rays.bundles import Receivers, along
from pdm_core.rays.facets import Facets
from pdm_core.rays.perspective import seen_from
from pdm_core.rays.sieve import worth_it
from pdm_core.signs_of_life import finish

MANY = 4096
CELLS = 160  # along each side of a sheet


@pytest.fixture(autouse=True)
def fewer(monkeypatch):
    """As with more places, but quicker."""
    monkeypatch.setattr(thinning, "MANY", MANY)


def sheet(cells=CELLS):
    """A bumpy sheet 1 m wide: vertices (n, 3), unit normals (n, 3), and cells of four vertices (cells^2, 4)."""
    x, y = np.meshgrid(*[np.linspace(0, 1, cells + 1)] * 2, indexing="ij")
    points = np.stack([x, y, 0.1 * np.sin(4 * x) * np.cos(3 * y)], -1).reshape(-1, 3)
    x, y, _ = points.T
    slopes = -0.4 * np.cos(4 * x) * np.cos(3 * y), 0.3 * np.sin(4 * x) * np.sin(3 * y)
    normals = np.column_stack([*slopes, np.ones(len(x))])
    at = np.arange(len(x)).reshape(cells + 1, -1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True), quads


def places(points, normals):
    n = len(points)
    return Receivers(points, normals, np.full(n, -1), np.full(n, 1e-12), np.zeros(n, bool), np.zeros(n, int))


def read(points, normals, light, tolerance, mesh=True):
    """What thinned makes of light(points, normals) -> (n,), off by tolerance at most; how many it was told of."""
    told = []

    def gather(some):
        told.append(len(some))
        yield
        return np.repeat(light(some.points, some.normals)[:, None], 3, axis=1)

    steps = thinning.thinned(gather, places(points, normals), np.array([mesh]), np.full(len(points), tolerance))
    return finish(steps)[:, 0], sum(told)


def smooth(points, normals):
    """Light of two sides of the sky and of what is beside it: varies with the normal and the place."""
    return 1 + 0.5 * normals @ [0.6, 0.3, 0.7] + 0.3 * np.sin(2 * points[:, 0]) * points[:, 1]


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_smooth_light_is_gathered_at_few_places(scale):
    points, normals, _ = sheet()
    found, told = read(scale * points, normals, lambda p, n: smooth(p / scale, n), 0.02)
    assert told < len(points) / 12
    assert np.abs(found - smooth(points, normals)).max() < 0.02


def test_where_light_jumps_all_places_are_gathered():
    """A shadow's edge: no place beside it may show what is on its other side."""
    points, normals, _ = sheet()

    def light(p, n):
        return smooth(p, n) * np.where(p[:, 0] + 0.3 * p[:, 1] < 0.5, 1.0, 0.3)

    found, told = read(points, normals, light, 0.02)
    off = np.abs(found - light(points, normals))
    assert off.max() < 0.04 and np.sqrt((off**2).mean()) < 0.004
    assert told < len(points) / 2


def test_sheets_that_lie_close_keep_their_own_light():
    """Two layers of one mesh, nearer than places where light is gathered: one lit, one dark."""
    points, normals, _ = sheet()
    both = np.concatenate([points, points + 0.01 * normals])
    lit = np.arange(len(both)) < len(points)
    names = {tuple(p): k for k, p in enumerate(both)}

    def light(p, _):
        return np.where(lit[[names[tuple(one)] for one in p]], 1.0, 0.1)

    found, _ = read(both, np.tile(normals, (2, 1)), light, 0.02)
    assert np.abs(found - np.where(lit, 1.0, 0.1)).max() < 0.02


@pytest.mark.parametrize("mesh, count", [(False, None), (True, MANY - 1)])
def test_few_places_and_other_shapes_are_gathered_each(mesh, count):
    points, normals, _ = sheet()
    points, normals = points[:count], normals[:count]
    found, told = read(points, normals, smooth, 0.02, mesh)
    assert told == len(points) and np.array_equal(found, smooth(points, normals))


# --- sifted facets ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[5.0, 3e4])
def pierced(request):
    """Facets of a fine sheet with a hole about its middle under a ball and, far aside, another: that makes places few
    in single precision."""
    points, _, quads = sheet()
    middle = points[quads].mean(axis=1)
    quads = quads[np.linalg.norm(middle[:, :2] - 0.5, axis=1) > 0.2]
    shapes = [Mesh(points, quads), Sphere.at((0.5, 0.5, 0.6), 0.1), Sphere.at((request.param, 0.5, 3.0), 0.5)]
    facets = Facets(Scene([Surface(shape, 0.5, name=str(k)) for k, shape in enumerate(shapes)]))
    assert worth_it(facets.count, 400)
    return facets


def below(facets):
    """Places (400, 3) m under the sheet, not next to the hole's edge, and whether they are under the hole."""
    x, y = np.random.default_rng(3).random((2, 4000)) * 0.9 + 0.05
    from_middle = np.hypot(x - 0.5, y - 0.5)
    some = np.flatnonzero(np.abs(from_middle - 0.2) > 0.02)[:400]
    points = np.column_stack([x, y, np.full(len(x), -0.5)])[some]
    start = places(points - facets.centre, np.tile([0.0, 0, 1], (400, 1)))
    start.start[:] = facets.tolerance
    return points, from_middle[some] < 0.2, start


def test_rays_meet_the_facet_over_them_or_go_through_the_hole(pierced):
    points, free, start = below(pierced)
    hits = along(pierced, np.array([[0.0, 0.0, 1.0]]), start)
    assert (hits.facet[~free] >= 0).all() and (hits.facet[~free] < pierced.count).all()
    k, at = hits.facet[~free], hits.at[~free].astype(float)
    met = pierced.origin[k] + at[:, :1] * pierced.u[k] + at[:, 1:] * pierced.v[k] + pierced.centre
    assert np.abs(met[:, :2] - points[~free, :2]).max() < 1e-4
    under_ball = np.hypot(*(points[:, :2] - 0.5).T) < 0.099
    assert (hits.facet[under_ball] == pierced.count).all() and under_ball.any()
    beside = free & (np.hypot(*(points[:, :2] - 0.5).T) > 0.101)
    assert (hits.facet[beside] < 0).all() and beside.any()


def test_what_is_seen_through_the_hole(pierced):
    """From over the sheet, aside of the ball: the line passes the sheet's height where the hole is, or does not."""
    points, _, start = below(pierced)
    eye = np.array([0.52, 0.47, 0.4])
    line = points - eye
    at = np.full(len(points), 0.5)
    for _ in range(60):  # where the line meets the sheet's height
        x, y, z = (eye + at[:, None] * line).T
        at += (z - 0.1 * np.sin(4 * x) * np.cos(3 * y)) * 0.7
    there = (eye + at[:, None] * line)[:, :2]
    off = np.linalg.norm(there - 0.5, axis=1)
    clear = np.abs(off - 0.2) > 0.02
    everyone = np.arange(len(points))
    seen = seen_from(pierced, (eye - pierced.centre)[None], start, np.zeros(len(points), int), everyone)
    assert (seen == (off < 0.2))[clear].all()
    assert seen.any() and not seen.all()


def test_a_fine_mesh_in_a_furnace_is_as_bright_as_all():
    """Whatever is interpolated: where all emits 1 - reflectance, all light is 1."""
    points, _, quads = sheet(80)
    mesh, around = Mesh(points, quads), Sphere.at((0.5, 0.5, 0), 3.0)
    surfaces = [Surface(mesh, 0.6, 0.4, side=side, name=side) for side in ("front", "back")]
    solution = solve(Scene([*surfaces, Surface(around, 0.3, 0.7, side="back", name="around")]), 0.02)
    assert len(mesh.vertices) > MANY
    for k in range(2):
        assert np.abs(solution.radiance(k, mesh.vertices) - 1).max() < 2e-4
