"""Small symmetric systems of equations, solved once a millisecond.

eigenpy, which comes with pinocchio, binds Eigen's Cholesky decomposition: on six equations it takes a fifth of the time
of numpy's general solver, whose checks cost more than its work.
"""

from __future__ import annotations

import eigenpy  # pyright: ignore[reportMissingImports]  # It lives behind a .pth file.

from rcilab.arrays import Array, Matrix

_SUCCESS = eigenpy.ComputationInfo.Success  # pyright: ignore[reportAttributeAccessIssue]


class SymmetricSolver:
    """Solves A x = b for symmetric, positive-definite A. One instance serves one thread at a time.

    Args:
        size: Number of equations, 2 or more.
    """

    def __init__(self, size: int) -> None:
        self._decomposition = eigenpy.LLT(size)  # pyright: ignore[reportAttributeAccessIssue]

    def solve(self, A: Matrix, b: Array) -> Array:
        """Returns x, of the shape of `b`; without meaning where A is not positive-definite.

        Args:
            A: Shape (size, size); symmetric, of which the lower triangle counts.
            b: Shape (size,) or (size, columns).
        """
        return self._decomposition.compute(A).solve(b)

    @property
    def has_solved(self) -> bool:
        """Whether the last matrix was positive-definite, so that its solution has a meaning; of NaN it is not known."""
        return self._decomposition.info() == _SUCCESS
