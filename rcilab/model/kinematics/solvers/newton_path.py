"""The inverse along a whole path by Newton's method: one branch, followed without a jump.

The numeric counterpart of `spherical/branch.py`. A few rows are solved one after the other, each from the one before;
between them the joint angles are interpolated linearly, and Newton's method refines all rows at once.
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

_KNOTS = 48  # Rows that are solved one by one: takes a few ms, and gives guesses good to a hundredth of a radian.
_TURN = 0.15  # [rad] Of a joint from knot to knot, beyond which rows between them are solved first.
_JUMP = 0.6  # [rad] From row to row: a larger step is a change of branch.


def follow_by_newton(
    chain: Chain,
    held: int | None,
    solve: Callable[[Pose, float], list[Angles]],
    rotations: Array,
    positions: Array,
    psi: Array,
    start: JointVector,
) -> tuple[JointPath, BranchEnd | None]:
    """Returns the joint angles along a path of the flange, each row next to the one before; limits are not checked.

    Args:
        chain: From `build_chain`.
        held: Which joint, from 0, is held at `psi`; None for none.
        solve: Every solution at a pose of the flange and an angle of the held joint; asked where the branch ends.
        rotations: Flange in base, shape (N, 3, 3).
        positions: Flange in base, shape (N, 3), [m].
        psi: Angles of the held joint, shape (N,), [rad].
        start: Joint angles at row 0, shape (n,), [rad]: they choose the branch.

    Returns:
        Joint angles, shape (N, n), [rad], meaningless from the first row without solution on, and that row, or None.
    """
    march = _RowByRow(chain, held, rotations, positions, psi)
    known = march.run(start)
    rows = np.arange(len(psi))
    places = sorted(known)
    table = np.array([known[place] for place in places])
    guess = np.stack([np.interp(rows, places, column) for column in table.T], axis=1)
    if held is not None:
        guess[:, held] = psi
    q, settled = refine(chain, held, rotations, positions, guess)
    q[places] = table
    settled[places] = True
    lost = ~settled
    lost[1:] |= (np.abs(np.diff(q, axis=0)) > _JUMP).any(axis=1)
    if march.lost is not None:
        lost[march.lost] = True
    if not lost.any():
        return q, None
    row = int(lost.argmax())
    return q, BranchEnd(row, _reason(solve, rotations[row], positions[row], float(psi[row]), held))


class _RowByRow:
    """Solves a few rows of a path one after the other."""

    def __init__(self, chain: Chain, held: int | None, rotations: Array, positions: Array, psi: Array) -> None:
        self._chain, self._held = chain, held
        self._rotations, self._positions, self._psi = rotations, positions, psi
        self.lost: int | None = None

    def run(self, start: JointVector) -> dict[int, list[float]]:
        """Returns joint angles of some rows, by row; where the branch ends, `lost` is the row."""
        first = self._settled(0, start.tolist())
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
            here = known[row]
            guess = here
            if before is not None:
                part = (after - row) / (row - before[0])
                guess = [a + part * (a - b) for a, b in zip(here, before[1], strict=True)]
            found = self._settled(after, guess)
            small = _TURN if stride > 1 else _JUMP
            if found is None or max(abs(a - b) for a, b in zip(found, here, strict=True)) > small:
                if stride == 1:
                    self.lost = after
                    return known
                stride = max(1, stride // 4)
                continue
            before, row = (row, here), after
            known[after] = found
            stride = min(2 * stride, longest)
        return known

    def _settled(self, row: int, guess: list[float]) -> list[float] | None:
        """Returns the solution at a row next to a guess, or None, in plain floats."""
        psi = float(self._psi[row])
        return refine_near(self._chain, self._held, self._rotations[row], self._positions[row], psi, guess)


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
        "the arm would have to jump, because a singularity is in the way; lead the tool around it, give another arm "
        "angle, or go there in joint space"
    ).coded("jump")


def no_solution(psi: float, held: int | None) -> UnreachableError:
    """Returns the error of a pose that has no solution with a joint, from 0, held at an angle, [rad]."""
    if held is None:
        return UnreachableError("no joint angles put the tool there; move the target").coded("no_angles")
    elbow = "the elbow (joint 3)" if held == 2 else f"joint {held + 1}"
    return UnreachableError(
        f"no joint angles put the tool there with {elbow} at {degrees(psi):.1f} deg; give another arm angle"
    ).coded("no_angles")
