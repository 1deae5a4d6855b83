"""Feasibility of a tool path: the first point that the arm cannot follow, and the reason."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import PlanningError, RcilabError, SingularError, UnreachableError
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import limit_passed
from rcilab.motion.inverse_path import inverse_path
from rcilab.motion.path import Path

_STRETCHED_ROWS = 5
"""Number of rows before the limit of reach on which a fast elbow is caused by that limit. Observed: 3."""


@dataclass(frozen=True, slots=True)
class Infeasibility:
    """The first row of a path that the arm cannot follow."""

    row: int
    reason: RcilabError
    is_singular: bool
    """True at a singularity; False out of reach or at a joint limit."""


def solve_path(
    model: RobotModel, q: JointVector, path: Path, shares: Array, max_steps: Array, span: str
) -> tuple[JointPath, Infeasibility | None]:
    """Returns the joint angles along a path, shape (N, n), [rad], and the first row that is infeasible, or None.

    Args:
        model: The arm, with its tool.
        q: Joint angles at the start, shape (n,), [rad].
        path: The path.
        shares: Shares of the path, shape (N,), the first 0.
        max_steps: Largest steps of the joints from row to row that are not a jump, shape (N - 1, n) or (n,), [rad].
        span: Distance between two rows, for the message.
    """
    T, psi = path.sample(shares)
    rows, branch_end = inverse_path(model, T, psi, q)
    rows[0] = q
    limits = model.limits.joint
    excess = np.abs(np.diff(rows, axis=0)) - max_steps
    jumps = (np.flatnonzero((excess > 0.0).any(axis=1)) + 1).tolist()
    outside = np.flatnonzero(~((limits.lower < rows) & (rows < limits.upper)).all(axis=1)).tolist()
    first = min(jumps[:1] + outside[:1], default=len(rows))
    # Close to the stretched arm the elbow turns fast; the reason is then the reach.
    if branch_end is not None and branch_end.row <= first + _STRETCHED_ROWS * isinstance(
        branch_end.reason, UnreachableError
    ):
        return rows, Infeasibility(branch_end.row, branch_end.reason, isinstance(branch_end.reason, SingularError))
    if first == len(rows):
        return rows, None
    advice = ", or give another arm angle" if model.redundancy else ""
    if outside[:1] == [first]:
        angles = rows[first]
        i = int(np.maximum(limits.lower - angles, angles - limits.upper).argmax())
        limit_error = limit_passed(limits, i + 1, float(angles[i]), f"start from another branch{advice}")
        return rows, Infeasibility(first, limit_error, False)
    i = int(excess[first - 1].argmax())
    turn = abs(math.degrees(rows[first, i] - rows[first - 1, i]))
    jump_error = PlanningError(
        f"joint {i + 1} would have to jump by {turn:.1f} deg {span}, because a singularity is in the way; move the "
        f"tool around it, use a joint motion{advice}"
    ).coded("path_singular", joint=i + 1, turn=math.radians(turn))
    return rows, Infeasibility(first, jump_error, True)


def path_error(path: Path, share: float, reason: RcilabError, when: str = "") -> PlanningError:
    """Returns the error for a path that cannot be followed, with the position and the reason.

    Args:
        path: The path.
        share: The point, as a share of the path length.
        reason: The reason.
        when: The time, for the message.
    """
    x, y, z = path.at(share)[0].parts[1]
    return PlanningError(
        f"the {path.name} cannot be followed at {share * path.distance:.3f} of {path.distance:.3f} {path.unit} "
        f"({when}{100.0 * share:.1f} % of the path, tool at {x:.3f}, {y:.3f}, {z:.3f} m): {reason}",
        share=share,
    ).coded("path", share=f"{100.0 * share:.1f}", place=(float(x), float(y), float(z)), reason=reason)
