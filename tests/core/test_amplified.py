"""How much of an error is left when light has gone round with it, against the linear system solved."""

import numpy as np
import pytest

from pdm_core.rays.amplified import amplification


@pytest.mark.parametrize("rho", [(0.999999, 0.737), (0.5, 0.5), (0.99, 0.99), (0.999999, 0.0), (0.9, 0.1)])
def test_two_faces_that_see_each_other_alone(rho):
    """By the last bounce alone a white lamp under a ceiling was told to make errors a million times larger."""
    rows = np.array([[0.0, 1.0], [1.0, 0.0]])
    right = np.linalg.solve(np.eye(2) - rows * rho, np.ones(2))
    told = amplification(lambda value: rows @ value, np.repeat(np.array(rho)[:, None], 3, axis=1))
    np.testing.assert_allclose(told, right, rtol=0.15)


def test_a_closed_room():
    rng = np.random.default_rng(1)
    rows = rng.random((40, 40)) + 2 * np.eye(40)
    rows /= rows.sum(axis=1, keepdims=True)
    told = amplification(lambda value: rows @ value, np.full((40, 3), 0.999))
    np.testing.assert_allclose(told, 1000, rtol=1e-6)
