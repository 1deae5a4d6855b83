"""Small symmetric systems of equations for the 1 kHz path, and the vibration modes of an arm on springs.

eigenpy, which comes with pinocchio, binds Eigen's decompositions: for six equations they take a fifth of the time of
NumPy's general solver, whose checks dominate, and for the modes of seven joints less than half.
"""

# pyright: reportAttributeAccessIssue=false
# eigenpy defines its names in compiled code at import; pyright does not know them.

from __future__ import annotations

from math import prod
from typing import NamedTuple

import eigenpy  # pyright: ignore[reportMissingImports]  # Installed through a .pth file.

from rcilab.core.arrays import Array, Matrix

_SUCCESS = eigenpy.ComputationInfo.Success
_OPTIONS = eigenpy.DecompositionOptions
_MODES = int(_OPTIONS.ComputeEigenvectors) | int(_OPTIONS.BAx_lx)  # M^-1 K u = w^2 u, with u^T M u = 1.


class SymmetricSolver:
    """Solves A x = b for symmetric, positive-definite A. One instance serves one thread at a time.

    Args:
        size: Number of equations, 2 or more.
    """

    def __init__(self, size: int) -> None:
        self._decomposition = eigenpy.LLT(size)

    def solve(self, A: Matrix, b: Array) -> Array:
        """Returns x, of the shape of `b`; undefined if A is not positive-definite.

        Args:
            A: Shape (size, size); symmetric; only the lower triangle is used.
            b: Shape (size,) or (size, columns).
        """
        return self._decomposition.compute(A).solve(b)

    def is_definite(self, A: Matrix) -> bool:
        """Returns whether a symmetric matrix is positive-definite, shape (size, size)."""
        return self._decomposition.compute(A).info() == _SUCCESS

    @property
    def determinant(self) -> float:
        """Determinant of the last matrix; undefined if it was not positive-definite."""
        return prod(self._decomposition.matrixLLT().diagonal().tolist()) ** 2

    @property
    def has_solved(self) -> bool:
        """Whether the last matrix was positive-definite and its solution valid; undefined for NaN."""
        return self._decomposition.info() == _SUCCESS


class VibrationModes(NamedTuple):
    """The vibration modes of an arm on springs, slowest first."""

    squares: Array
    """Angular frequencies squared, w^2, shape (n,), [rad^2/s^2]; zero within rounding for modes without a spring."""
    shapes: Matrix
    """A mode in each column, U with U^T M U = 1, shape (n, n)."""
    momenta: Matrix
    """M U, shape (n, n)."""


def vibration_modes(mass_inverse: Matrix, stiffness: Matrix) -> VibrationModes:
    """Returns the modes of springs on an arm: the solutions of K u = w^2 M u.

    Args:
        mass_inverse: M^-1 of the arm in its current state, symmetric, positive-definite, shape (n, n), [1/(kg m^2)].
        stiffness: K of the springs, in joint space, symmetric, shape (n, n), [N m/rad].
    """
    solver = eigenpy.GeneralizedSelfAdjointEigenSolver(stiffness, mass_inverse, _MODES)
    shapes = solver.eigenvectors().copy()
    return VibrationModes(solver.eigenvalues().copy(), shapes, eigenpy.LLT(mass_inverse).solve(shapes))
