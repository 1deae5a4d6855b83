"""The inverse along a whole path by Newton's method, on one branch and without jumps.

The numeric counterpart of `spherical/branch.py`. A few rows are solved in sequence, each from the previous one; between
them the joint angles are interpolated linearly, and Newton's method refines all rows together.
"""

from __future__ import annotations

from collections.abc import Callable
from math import degrees

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError, SingularError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.forward import Chain
from rcilab.model.kinematics.solvers.newton import refine, refine_near
from rcilab.model.kinematics.solvers.solver import Angles, BranchEnd

_KNOTS = 48  # Rows solved in sequence: takes a few ms, and gives guesses accurate to 0.01 rad.
_MAX_KNOT_STEP = 0.15  # [rad] A larger step from knot to knot needs further knots in between.
_MAX_ROW_STEP = 0.6  # [rad] A larger step from row to row is a change of branch.


def follow_by_newton(
    chain: Chain,
    held: int | None,
    solve: Callable[[Pose, float], list[Angles]],
    rotations: Array,
    positions: Array,
    psi: Array,
    start: JointVector,
) -> tuple[JointPath, BranchEnd | None]:
    """Returns the joint angles along a path of the flange, on one branch; limits are not checked.

    Args:
        chain: From `build_chain`.
        held: Index of the joint that is held at `psi`; None for none.
        solve: Returns every solution at a pose of the flange and an angle of the held joint; used if the branch ends.
        rotations: Flange in base, shape (N, 3, 3).
        positions: Flange in base, shape (N, 3), [m].
        psi: Angles of the held joint, shape (N,), [rad].
        start: Joint angles at row 0, shape (n,), [rad]; they select the branch.

    Returns:
        Joint angles, shape (N, n), [rad], and the first row without a solution, or None. From that row on the angles
        have no meaning.
    """
    knot_solver = _KnotSolver(chain, held, rotations, positions, psi)
    known = knot_solver.run(start)
    rows = np.arange(len(psi))
    solved_rows = sorted(known)
    table = np.array([known[row_index] for row_index in solved_rows])
    guess = np.stack([np.interp(rows, solved_rows, column) for column in table.T], axis=1)
    if held is not None:
        guess[:, held] = psi
    q, settled = refine(chain, held, rotations, positions, guess, is_path=True)
    q[solved_rows] = table
    settled[solved_rows] = True
    lost = ~settled
    lost[1:] |= (np.abs(np.diff(q, axis=0)) > _MAX_ROW_STEP).any(axis=1)
    if knot_solver.lost is not None:
        lost[knot_solver.lost] = True
    if not lost.any():
        return q, None
    row = int(lost.argmax())
    return q, BranchEnd(row, _reason(solve, rotations[row], positions[row], float(psi[row]), held))


class _KnotSolver:
    """Solves a few rows of a path in sequence."""

    def __init__(self, chain: Chain, held: int | None, rotations: Array, positions: Array, psi: Array) -> None:
        self._chain, self._held = chain, held
        self._rotations, self._positions, self._psi = rotations, positions, psi
        self.lost: int | None = None

    def run(self, start: JointVector) -> dict[int, list[float]]:
        """Returns joint angles of some rows, by row; `lost` is the row at which the branch ends."""
        first = self._solve_row(0, start.tolist())
        known: dict[int, list[float]] = {0: start.tolist() if first is None else first}
        if first is None:
            self.lost = 0
            return known
        last = len(self._psi) - 1
        row, stride = 0, max(1, last // _KNOTS)
        before: tuple[int, list[float]] | None = None
        longest = stride
        while row < last:
            after = min(row + stride, last)
            current = known[row]
            guess = current
            if before is not None:
                part = (after - row) / (row - before[0])
                guess = [a + part * (a - b) for a, b in zip(current, before[1], strict=True)]
            found = self._solve_row(after, guess)
            max_step = _MAX_KNOT_STEP if stride > 1 else _MAX_ROW_STEP
            if found is None or max(abs(a - b) for a, b in zip(found, current, strict=True)) > max_step:
                if stride == 1:
                    self.lost = after
                    return known
                stride = max(1, stride // 4)
                continue
            before, row = (row, current), after
            known[after] = found
            stride = min(2 * stride, longest)
        return known

    def _solve_row(self, row: int, guess: list[float]) -> list[float] | None:
        """Returns the solution at a row near a guess, in plain floats, or None."""
        psi = float(self._psi[row])
        rotation, position = self._rotations[row], self._positions[row]
        return refine_near(self._chain, self._held, rotation, position, psi, guess, is_path=True)


def _reason(
    solve: Callable[[Pose, float], list[Angles]], rotation: Array, position: Array, psi: float, held: int | None
) -> KinematicsError:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    try:
        found = solve(Pose.from_matrix(T), psi)
    except UnreachableError as error:
        return error
    if not found:
        return no_solution(psi, held)
    return SingularError(
        "the arm would have to jump, because a singularity is in the way; move the tool around it, use another arm "
        "angle, or a joint motion"
    ).coded("jump")


def no_solution(psi: float, held: int | None) -> UnreachableError:
    """Returns the error for a pose without solution with a joint, by index, held at an angle, [rad]."""
    if held is None:
        return UnreachableError("no joint angles put the tool there; move the target").coded("no_angles")
    elbow = "the elbow (joint 3)" if held == 2 else f"joint {held + 1}"
    return UnreachableError(
        f"no joint angles put the tool there with {elbow} at {degrees(psi):.1f} deg; use another arm angle"
    ).coded("no_angles")
