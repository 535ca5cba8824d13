"""Least squares without BLAS: against LAPACK's, compiled and not, in any memory layout."""

import numpy as np
import pytest

from snakewalk.drivers import least_squares as module
from snakewalk.drivers.least_squares import least_squares, solve_positive_definite


@pytest.mark.parametrize("solve", [solve_positive_definite, solve_positive_definite.py_func])
@pytest.mark.parametrize("size", [1, 2, 3, 4, 10])
def test_a_positive_definite_system_is_solved_from_its_lower_half(solve, size: int) -> None:
    rng = np.random.default_rng(size)
    half = rng.normal(size=(size, size + 3))
    a, x = half @ half.T, rng.normal(size=size)
    found = np.empty(size)
    lower = np.where(np.tri(size, dtype=bool), a, np.nan)
    solve(lower, a @ x, found)
    np.testing.assert_allclose(found, x, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("run", [module._least_squares, module._least_squares.py_func])
def test_the_sum_of_squares_is_least_with_and_without_damping(run, monkeypatch) -> None:
    monkeypatch.setattr(module, "_least_squares", run)
    rng = np.random.default_rng(3)
    rows, target = rng.normal(size=(17, 10)), rng.normal(size=17)
    for damping in (np.zeros(10), np.linspace(0.0, 0.3, 10)):
        stacked, right = np.vstack([rows, np.diag(damping)]), np.append(target, np.zeros(10))
        expected = np.linalg.lstsq(stacked, right, rcond=None)[0]
        np.testing.assert_allclose(least_squares(rows, target, damping), expected, atol=1e-13)


def test_the_bits_do_not_depend_on_how_an_array_lies_in_memory_or_on_compilation() -> None:
    rng = np.random.default_rng(4)
    rows, target, damping = rng.normal(size=(17, 10)), rng.normal(size=17), np.full(10, 0.02)
    found = least_squares(rows, target, damping)
    wide = np.empty((34, 20))[::2, ::2]
    wide[:] = rows
    for same in (np.asfortranarray(rows), wide):
        np.testing.assert_array_equal(least_squares(same, target, damping), found)
    np.testing.assert_array_equal(module._least_squares.py_func(rows, target, damping), found)


def test_damping_decides_what_rows_leave_open() -> None:
    rows, target = np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([1.0, 2.0])
    np.testing.assert_allclose(least_squares(rows, target, np.array([0.0, 1.0])), [1.5, 0.0])
