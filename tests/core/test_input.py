"""Whatever is handed over: a right answer, or a SceneError that says what to do, and nothing else."""

import itertools

import numpy as np
import pytest

from pdm_core import (
    AreaLight,
    Mesh,
    Plane,
    PointLight,
    Polygon,
    Scene,
    SceneError,
    Sphere,
    SpotLight,
    SunLight,
    Surface,
    form_factors,
    pdm_form_factor,
    plan,
    solve,
    solve_steps,
)

NONSENSE = [
    None, "three", 1j, [1, 2], [[1, 2, 3]], [1, [2, 3]], np.nan, np.inf, -np.inf, -1.0, True, {}, object(), b"1", (),
    [None] * 3, [1e200] * 3, [[1e308] * 3] * 3, 1e308, 5e-324, ["1"] * 3, [1j] * 3, [np.nan] * 3, [np.inf] * 3,
    [-1.0] * 3, np.zeros((2, 2)), np.array(["a"]),
]  # fmt: skip
FLOOR = Plane((0, 0, 0), (1, 0, 0), (0, 1, 0))
ROOF = Surface(Plane((0, 0, 1), (0, 1, 0), (1, 0, 0)), 0.5, 1.0)
SCENE = Scene([Surface(FLOOR, 0.5, name="floor"), ROOF])
SOLUTION = solve(SCENE, 0.05)
SHEET = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
BY_RAYS = solve(Scene([Surface(SHEET, 0.5), ROOF], lights=[PointLight((0, 0, 0.5), 1)]), 0.1)
PLACES = np.array([[0.2, 0.3, 0.0], [0.4, 0.1, 0.0]])
LIGHTS = {
    PointLight: {"position": (0, 0, 2), "power": 1, "radius": 0.1, "faces": False, "shadows": True},
    SpotLight: {"position": (0, 0, 2), "direction": (0, 0, -1), "power": 1, "angle": 1.0, "blend": 0.5, "axes": None},
    SunLight: {"direction": (0, 0, -1), "irradiance": 1, "angle": 0.1, "shadows": True},
    AreaLight: {"centre": (0, 0, 2), "u": (0, 1, 0), "v": (1, 0, 0), "power": 1, "ellipse": False, "spread": 1.0},
}


def lit_by(kind, given):
    return solve(Scene([Surface(FLOOR, 0.5)], lights=[kind(**given)]), 0.2).incident(0, PLACES)


CALLS = {
    "corner": lambda x: Surface(Plane(x, (1, 0, 0), (0, 1, 0))),
    "edge": lambda x: Surface(Plane((0, 0, 0), x, (0, 1, 0))),
    "matrix": lambda x: Surface(Sphere(x)),
    "center": lambda x: Surface(Sphere.at(x, 1)),
    "radius": lambda x: Surface(Sphere.at((0, 0, 0), x)),
    "shape": Surface,
    "reflectance": lambda x: Surface(FLOOR, x),
    "emission": lambda x: Surface(FLOOR, 0.5, x),
    "side": lambda x: Surface(FLOOR, 0.5, 0, x),
    "name": lambda x: Surface(FLOOR, 0.5, name=x),
    "surfaces": Scene,
    "background": lambda x: Scene([ROOF], x),
    "rounding": lambda x: Scene([ROOF], 0, x),
    "plan": plan,
    "plan target": lambda x: plan(SCENE, x),
    "solve": solve,
    "target_error": lambda x: solve(SCENE, x),
    "time_limit": lambda x: x is None or solve(SCENE, 0.05, x),
    "progress": lambda x: x is None or solve(SCENE, 0.05, progress=x),
    "form_factors": form_factors,
    "rtol": lambda x: form_factors(SCENE, x),
    "rows": lambda x: x is None or form_factors(SCENE, rows=x),
    "pdm surface": lambda x: pdm_form_factor(ROOF, x),
    "divisions": lambda x: pdm_form_factor(ROOF, SCENE.surfaces[0], x),
    "points": lambda x: pdm_form_factor(ROOF, SCENE.surfaces[0], points=x),
    "occluders": lambda x: pdm_form_factor(ROOF, SCENE.surfaces[0], occluders=x),
    "surface_index": lambda x: SOLUTION.radiance(x, (0, 0, 0)),
    "radiance at": lambda x: SOLUTION.radiance(0, x),
    "irradiance at": lambda x: SOLUTION.irradiance(x, (0, 0, 1)),
    "normals": lambda x: SOLUTION.irradiance((0, 0, 0.5), x),
    "relight": SOLUTION.relight,
    "corners": lambda x: Surface(Plane.through(x)),
    "outline": lambda x: Surface(Polygon(x)),
    "hole": lambda x: Surface(Polygon(FLOOR.corners, [x])),
    "vertices": lambda x: Surface(Mesh(x, [(0, 1, 2)])),
    "faces": lambda x: Surface(Mesh(SHEET.vertices, x)),
    "face": lambda x: Surface(Mesh(SHEET.vertices, [x])),
    "smooth": lambda x: Surface(Mesh(SHEET.vertices, [(0, 1, 2)], x)),
    "enough": lambda x: callable(x) or list(solve_steps(SCENE, 0.2, None, x)),
    **{
        f"{what} of {'links' if of is SOLUTION else 'rays'}": call
        for of in (SOLUTION, BY_RAYS)
        for what, call in {
            "incident at": lambda x, of=of: of.incident(0, x),
            "shading normals": lambda x, of=of: of.incident(0, PLACES, x),
            "inward": lambda x, of=of: of.incident(0, PLACES, None, x),
            "kept of": lambda x, of=of: of.kept(x, PLACES),
            "kept at": lambda x, of=of: of.kept(np.zeros(2, int), x),
            "estimated error": lambda x, of=of: of.estimated_error(x, PLACES),
            "seconds": lambda x, of=of: of.seconds_to(x),
            "error over": lambda x, of=of: of.error_over(x) if isinstance(x, list | np.ndarray) else None,
        }.items()
    },
    **{
        f"{what} of {kind.__name__}": lambda x, kind=kind, what=what: lit_by(kind, LIGHTS[kind] | {what: x})
        for kind in LIGHTS
        for what in LIGHTS[kind]
    },
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.filterwarnings("error")
def test_nonsense_is_refused_or_makes_sense(call):
    for nonsense in NONSENSE:
        try:
            CALLS[call](nonsense)
        except SceneError as error:
            assert len(str(error)) > 20  # noqa: PT017 - what else comes out fails the test


@pytest.mark.parametrize("which", [-1, 2, 0.0, True, "0"])
def test_a_surface_that_is_not_there_is_refused(which):
    with pytest.raises(SceneError, match="surface_index"):
        SOLUTION.radiance(which, (0, 0, 0))


@pytest.mark.parametrize("which", [[0], [0, 1, 0], [0, 2], [0, -1], [0.0, 1.0], [True, False], ["0", "1"], [None, 0]])
def test_surfaces_that_are_not_those_of_two_points_are_refused(which):
    with pytest.raises(SceneError, match="surface_index"):
        SOLUTION.radiance(which, np.zeros((2, 3)))


def test_points_of_several_surfaces_are_read_at_once():
    points = np.array([[0.2, 0.3, 0], [0.4, 0.1, 1], [0.7, 0.7, 0]])
    at_once = SOLUTION.radiance([0, 1, 0], points)
    np.testing.assert_array_equal(at_once[[0, 2]], SOLUTION.radiance(0, points[[0, 2]]))
    np.testing.assert_array_equal(at_once[1:2], SOLUTION.radiance(1, points[1:2]))


@pytest.mark.parametrize("points", [np.zeros((2, 2)), np.zeros((3, 2)), np.zeros((2, 3, 1)), [[0, 0, np.nan]]])
def test_points_of_another_shape_are_refused(points):
    with pytest.raises(SceneError, match="points"):
        SOLUTION.radiance(0, points)


def test_normals_are_normalised_and_points_may_be_one_or_none():
    unit, long = (SOLUTION.irradiance((0.5, 0.5, 0.5), (0, 0, k)) for k in (1, 1e-200))
    assert (unit == long).all() and unit.shape == (1, 3)
    assert SOLUTION.radiance(0, np.zeros((0, 3))).shape == (0, 3)
    for points, normals in itertools.permutations([np.zeros((2, 3)), np.ones((3, 3))]):
        with pytest.raises(SceneError, match="normals"):
            SOLUTION.irradiance(points, normals)
    with pytest.raises(SceneError, match="zero"):
        SOLUTION.irradiance((0, 0, 0), (0, 0, 0))


def test_one_number_is_a_grey():
    scene = Scene([Surface(FLOOR, 0.5, 2)], 3)
    assert scene.background.tolist() == [3, 3, 3] and scene.emission.tolist() == [[2, 2, 2]]


@pytest.mark.parametrize("factor", [1e-29, 1e-12, 1e12, 1e29])
def test_light_of_any_magnitude_is_the_same_picture(factor):
    surfaces = [Surface(s.shape, s.reflectance, factor * s.emission) for s in SCENE.surfaces]
    found = solve(Scene(surfaces), 0.05).radiance(0, (0.3, 0.4, 0)) / factor
    assert found == pytest.approx(SOLUTION.radiance(0, (0.3, 0.4, 0)), rel=1e-6)


@pytest.mark.parametrize("value", [1e-31, 1e31, 1e-100, 3.4e38])
def test_light_beyond_single_precision_is_refused(value):
    with pytest.raises(SceneError, match="emission"):
        Surface(FLOOR, 0.5, value, name="lamp")
    with pytest.raises(SceneError, match="background"):
        Scene([ROOF], value)


@pytest.mark.parametrize("scale", [1e-9, 1e-4, 1e4, 1e9])
def test_scenes_of_any_size_have_the_same_light(scale):
    def scene(size):
        ball = Sphere.at((0.4 * size, 0.5 * size, 0.3 * size), 0.2 * size)
        planes = [Plane(size * s.shape.origin, size * s.shape.u, size * s.shape.v) for s in SCENE.surfaces]
        return Scene([Surface(planes[0], 0.5), Surface(planes[1], 0.5, 1.0), Surface(ball, 0.7)], 0.1)

    points = np.random.default_rng(0).random((20, 3))
    one, other = solve(scene(1.0)), solve(scene(scale))
    found, right = (np.array([s.radiance(k, c * points) for k in range(3)]) for s, c in ((other, scale), (one, 1)))
    assert np.linalg.norm(found - right) < 5e-3 * np.linalg.norm(right)  # rounding may decide on a cell


def test_what_rounding_leaves_nothing_of_is_refused_by_name():
    far = Plane((1e7, 2e7, 0), (1, 0, 0), (0, 1, 0))
    Scene([Surface(far, name="far")])  # double precision holds it
    with pytest.raises(SceneError, match="far"):
        Scene([Surface(far, name="far")], rounding=2**-24)
    with pytest.raises(SceneError, match="thin"):
        thin = Sphere(np.diag([1, 1, 1e-17, 1]))
        Scene([Surface(FLOOR), Surface(thin, name="thin")])


def test_the_same_side_twice_is_refused():
    with pytest.raises(SceneError, match="'a'.*'b'|'b'.*'a'"):
        Scene([Surface(FLOOR, name="a"), Surface(FLOOR, name="b")])


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["reflectance", "emission", "background"])
def test_what_varies_and_is_not_finite_is_refused_by_name(where, value):
    """Of a picture with such a pixel all colours were NaN, without a word from the core."""

    def told(places):
        return np.where(places[:, :1] > 0.3, value, 0.5) * np.ones(3)

    floor, lamp = Plane((0, 0, 0), (1, 0, 0), (0, 1, 0)), Plane((0, 0, 1), (0, 1, 0), (1, 0, 0))
    of = {where: told} if where != "background" else {}
    with pytest.raises(SceneError, match=where if where == "background" else f"'floor': {where}"):
        solve(Scene([Surface(floor, name="floor", **of), Surface(lamp, 0, 1)], told if not of else 0), 0.05)


@pytest.mark.parametrize("wrong", [5, None, "grey", np.ones((2, 3)), 1j])
def test_functions_that_do_not_tell_a_colour_a_place_are_refused(wrong):
    floor = Plane((0, 0, 0), (1, 0, 0), (0, 1, 0))
    for given in ({"reflectance": lambda points: wrong}, {"emission": lambda points: wrong}):
        with pytest.raises(SceneError, match="'floor'"):
            solve(Scene([Surface(floor, name="floor", **given)], 1), 0.05)
    with pytest.raises(SceneError, match="background"):
        Scene([Surface(floor, 0.5)], lambda directions: wrong)


@pytest.mark.parametrize("angle", [1e-9, 1e-100, 1e-160, 1e-300])
def test_the_narrowest_sun_shines_as_one_without_a_size_does(angle):
    narrow, point = (lit_by(SunLight, LIGHTS[SunLight] | {"angle": a}) for a in (angle, 0))
    np.testing.assert_allclose(narrow, point)
