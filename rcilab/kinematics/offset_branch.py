"""The inverse of an arm with offsets along a whole path: one branch, followed without a jump.

What `branch.py` does for the arms without offsets. A few rows are settled one after the other, each from the one
before; between them the joint angles are guessed by straight lines, and Newton's method settles all rows at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.arrays import Array, JointPath, JointVector
from rcilab.errors import KinematicsError, SingularError, UnreachableError
from rcilab.kinematics.branch import Loss
from rcilab.kinematics.forward import forward
from rcilab.kinematics.jacobian import tool_jacobian
from rcilab.kinematics.offset_arm import ELBOW, OffsetGeometry, SelfMotion, no_solution, settle
from rcilab.spatial import Pose

_KNOTS = 48  # Rows that are settled one by one; a choice: a few ms, and guesses good to a hundredth of a radian.
_TURN = 0.15  # [rad] Of a joint from knot to knot, beyond which rows between them are settled first.
_ROUNDS = 12  # Beside the stretched arm two solutions meet, and the first steps only halve what is missing.
_SETTLED = 1e-12  # [m] and [rad]
_CLOSE = 1e-7  # [rad] A step that leaves nothing to settle, as each squares what is missing.
_JUMP = 0.6  # [rad] From row to row: beyond it the arm does not follow but changes branches.
_FREE = [joint for joint in range(7) if joint != ELBOW]


def follow_offset_branch(
    arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array, start: JointVector
) -> tuple[JointPath, Loss | None]:
    """Returns the joint angles along a path of the flange, each row next to the one before; limits are not looked at.

    Args:
        arm: From `build_offset_geometry`.
        rotations: Flange in base, shape (N, 3, 3).
        positions: Flange in base, shape (N, 3), [m].
        psi: Arm angles, shape (N,), [rad].
        start: Joint angles at row 0, shape (7,), [rad]: they choose the branch.

    Returns:
        Joint angles, shape (N, 7), [rad], and the first row that has none, or None. From that row on they mean nothing.
    """
    march = _March(arm, rotations, positions, psi)
    known = march.run(start)
    rows = np.arange(len(psi))
    places = sorted(known)
    table = np.array([known[place] for place in places])
    guess = np.stack([np.interp(rows, places, column) for column in table.T], axis=1)
    guess[:, ELBOW] = psi
    q, settled = settle(arm, rotations, positions, guess)
    q[places] = table
    settled[places] = True
    lost = ~settled
    lost[1:] |= (np.abs(np.diff(q, axis=0)) > _JUMP).any(axis=1)
    if march.lost is not None:
        lost[march.lost] = True
    if not lost.any():
        return q, None
    row = int(lost.argmax())
    return q, Loss(row, _reason(arm, rotations[row], positions[row], float(psi[row])))


class _March:
    """Settles a few rows of a path one after the other."""

    def __init__(self, arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array) -> None:
        self._arm, self._rotations, self._positions, self._psi = arm, rotations, positions, psi
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
        return settle_beside(self._arm, self._rotations[row], self._positions[row], psi, guess)


def settle_beside(
    arm: OffsetGeometry, rotation: Array, position: Array, psi: float, guess: Sequence[float]
) -> list[float] | None:
    """Returns the joint angles of one pose next to a guess, 7 plain floats, [rad], or None where there are none.

    Args:
        arm: From `build_offset_geometry`.
        rotation: Flange in base, shape (3, 3).
        position: Flange in base, shape (3,), [m].
        psi: Arm angle, [rad].
        guess: Joint angles close by, 7 plain floats, [rad].
    """
    q = [*guess]
    q[ELBOW] = psi
    for _ in range(_ROUNDS):
        J, _ = tool_jacobian(arm.chain, q)
        miss = _miss(forward(arm.chain, q), rotation, position)
        try:
            step = np.linalg.solve(J[:, _FREE], miss)
        except np.linalg.LinAlgError:
            return None
        if np.abs(step).max() > 2.0 * _JUMP:
            return None
        for joint, turn in zip(_FREE, step.tolist(), strict=True):
            q[joint] += turn
        if np.abs(step).max() < _CLOSE:
            break
    missing = np.abs(_miss(forward(arm.chain, q), rotation, position)).max()
    return q if missing < _SETTLED else None


def _miss(now: Pose, rotation: Array, position: Array) -> Array:
    """Returns what is missing to a pose as a small twist, base axes, shape (6,)."""
    turn = rotation @ now.rotation.T
    w = 0.5 * np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]))
    return np.concatenate((position - now.position, w))


def _reason(arm: OffsetGeometry, rotation: Array, position: Array, psi: float) -> KinematicsError:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    try:
        found = SelfMotion(arm, Pose.from_matrix(T), None).branches(psi)
    except UnreachableError as error:
        return error
    if not found:
        return UnreachableError(f"{no_solution(psi)}; give another arm angle")
    return SingularError(
        "the arm would have to jump, because a singularity is in the way; lead the tool around it, give another arm "
        "angle, or go there in joint space"
    )
