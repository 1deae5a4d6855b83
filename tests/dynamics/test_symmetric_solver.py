"""Equations of a symmetric matrix, against what they say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.dynamics.symmetric_solver import SymmetricSolver


@given(size=st.integers(2, 8), seed=st.integers(0, 10**6))
def test_what_it_returns_solves_the_equations(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(size, size + 1))
    A = half @ half.T + 1e-3 * np.eye(size)
    solver = SymmetricSolver(size)
    for b in (rng.normal(size=size), rng.normal(size=(size, 2)), rng.normal(size=(2, size)).T):
        x = solver.solve(A, b)
        assert x.shape == b.shape
        assert np.abs(A @ x - b).max() < 1e-9


def test_it_serves_again_after_a_matrix_that_it_cannot() -> None:
    solver = SymmetricSolver(2)
    assert not np.isfinite(solver.solve(np.full((2, 2), np.nan), np.ones(2))).any()
    assert solver.solve(np.eye(2), np.ones(2)) == pytest.approx([1.0, 1.0])


@given(size=st.integers(2, 8), seed=st.integers(0, 10**6))
def test_it_says_whether_the_matrix_was_positive_definite(size: int, seed: int) -> None:
    half = np.random.default_rng(seed).normal(size=(size, size + 1))
    A = half @ half.T + 1e-3 * np.eye(size)
    solver = SymmetricSolver(size)
    solver.solve(A, np.ones(size))
    assert solver.has_solved
    solver.solve(A - 1.01 * np.linalg.eigvalsh(A)[0] * np.eye(size), np.ones(size))
    assert not solver.has_solved
