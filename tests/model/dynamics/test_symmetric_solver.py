"""Equations of a symmetric matrix, against what they say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.model.dynamics.symmetric_solver import SymmetricSolver, vibration_modes
from rcilab.model.robot_model import load_model


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


@pytest.mark.parametrize("name", ["xMatePro7", "xMate3"])
def test_modes_are_those_of_springs_on_the_arm(name: str) -> None:
    model, rng = load_model(name), np.random.default_rng(5)
    for q in model.home + rng.normal(scale=0.5, size=(20, model.n)):
        M, J = model.rigid_body.mass_matrix(q), model.jacobian(q)
        K = J.T @ (rng.uniform(0.0, 3000.0, size=(6, 1)) * J)
        squares, U, momenta = vibration_modes(model.rigid_body.mass_inverse(q), K)
        assert (np.diff(squares) >= 0.0).all()
        # Up to rounding, times the condition of M.
        np.testing.assert_allclose(U.T @ M @ U, np.eye(model.n), atol=1e-9)
        np.testing.assert_allclose(U.T @ K @ U / squares[-1], np.diag(squares) / squares[-1], atol=1e-9)
        np.testing.assert_allclose(momenta, M @ U, atol=1e-9)
