"""Shapes and the refusal of invalid input."""

import numpy as np
import pytest

from pdm_core import Plane, Scene, SceneError, Sphere, Surface


def test_areas_of_ellipsoids():
    c = 0.5
    e = np.sqrt(1 - c * c)
    oblate = Sphere(np.diag([1, 1, c, 1.0]))
    assert abs(oblate.area / (2 * np.pi * (1 + c * c / e * np.arctanh(e))) - 1) < 1e-14
    prolate = Sphere(np.diag([1, 1, 2.0, 1]))
    e = np.sqrt(1 - 1 / 4)
    assert abs(prolate.area / (2 * np.pi * (1 + 2 / e * np.arcsin(e))) - 1) < 1e-14
    assert abs(Sphere.at((1, 2, 3), 2e-5).area / (16e-10 * np.pi) - 1) < 1e-14


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Surface(Plane((0, 0, 0), (1, 0, 0), (2, 0, 0)), name="Wall"), "Wall.*no area"),
        (lambda: Surface(Plane((0, 0, np.nan), (1, 0, 0), (0, 1, 0)), name="Wall"), "Wall.*not finite"),
        (lambda: Surface(Sphere(np.diag([1, 1, 0, 1.0])), name="Ball"), "Ball.*flat"),
        (lambda: Surface(Sphere.at((0, 0, 0), 1), (1, 0.5, 0), name="Ball"), "Ball.*below 1"),
        (lambda: Surface(Sphere.at((0, 0, 0), 1), (-0.1, 0.5, 0), name="Ball"), "Ball.*at least 0"),
        (lambda: Surface(Sphere.at((0, 0, 0), 1), 0.5, np.inf, name="Ball"), "Ball.*finite"),
        (lambda: Surface(Sphere.at((0, 0, 0), 1), side="top", name="Ball"), "Ball.*'front' or 'back'"),
        (lambda: Surface("Ball"), "give a Plane, Sphere, Polygon or Mesh"),
        (lambda: Scene([]), "no surfaces"),
        (lambda: Scene([Surface(Sphere.at((0, 0, 0), 1))], background=(0, 0, -1)), "background"),
        (lambda: Plane((0, 0), (1, 0, 0), (0, 1, 0)), "shape"),
    ],
)
def test_invalid_input_is_named(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_one_side_twice_is_refused():
    ball = Sphere.at((0, 0, 0), 1)
    with pytest.raises(SceneError, match="'b'.*'a'"):
        Scene([Surface(ball, name="a"), Surface(ball, name="b")])


def test_projection_lands_on_the_shape():
    points = np.random.default_rng(0).normal(size=(50, 3)) * 3
    ball = Sphere(np.array([[2, 0.5, 0, 1], [0, 1, 0.2, 0], [0, 0, 0.7, 0], [0, 0, 0, 1.0]]))
    assert np.abs(np.linalg.norm(ball.local(ball.project(points)), axis=1) - 1).max() < 1e-12
    plane = Plane((0, 0, 1), (2, 0, 0), (1, 1, 0))
    assert np.abs(plane.local(plane.project(points))[:, 2]).max() < 1e-15
