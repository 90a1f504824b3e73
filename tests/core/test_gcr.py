"""The solver of linear systems: its tolerance is of the error of the solution, however stiff the system is."""

import numpy as np
import pytest

from pdm_core.numerics import STEPS, gcr
from pdm_core.signs_of_life import finish


def closed_rooms(rng, reflectances, size=12):
    """Light between the walls of rooms that do not see each other, of a reflectance each: rows sum to it."""
    out = np.zeros((len(reflectances) * size,) * 2)
    for k, rho in enumerate(reflectances):
        rows = rng.random((size, size)) ** 4
        out[k * size :, k * size :][:size, :size] = rho * rows / rows.sum(axis=1, keepdims=True)
    return out


@pytest.mark.parametrize("reflectances", [(0.5,), (0.3, 0.95), (0.2, 0.3, 0.99, 0.5), (0.999, 0.1), (0.99999,)])
@pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-4])
@pytest.mark.parametrize("guessed", [False, True])
def test_the_solution_is_as_near_as_asked(reflectances, tolerance, guessed):
    """In white rooms beside dim ones a small rest comes back so often that it is most of the error."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        matrix = closed_rooms(rng, reflectances)
        right = rng.random((len(matrix), 3)) ** 4
        true = np.linalg.solve(np.eye(len(matrix)) - matrix, right)
        guess = true * rng.uniform(0.8, 1.2, true.shape) if guessed else np.zeros_like(true)
        found, steps = finish(gcr(matrix.__matmul__, right, guess, tolerance))
        wrong = np.linalg.norm(found - true, axis=0) / np.linalg.norm(true, axis=0)
        assert (wrong < 1.5 * tolerance).all(), (seed, wrong)
        assert steps < STEPS


def test_channels_that_are_done_wait_for_the_others():
    """One that is nothing, one that a step solves, one that takes many."""
    rng = np.random.default_rng(0)
    matrix = closed_rooms(rng, (0.9, 0.5))
    even = np.ones(len(matrix))
    even[12:] = 0.0
    right = np.stack([0 * even, even, rng.random(len(matrix))], axis=1)
    with np.errstate(all="raise"):
        found, _ = finish(gcr(matrix.__matmul__, right, np.zeros_like(right), 1e-6))
    np.testing.assert_array_equal(found[:, 0], 0.0)
    np.testing.assert_allclose(found[:, 1], 10 * even, rtol=1e-6, atol=1e-9)
    true = np.linalg.solve(np.eye(len(matrix)) - matrix, right[:, 2])
    np.testing.assert_allclose(found[:, 2], true, rtol=1e-5)
