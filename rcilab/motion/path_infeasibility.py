"""Feasibility of a tool path before planning: the first point that cannot be followed, and the reason."""

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

_STRETCHING = 5
"""Rows before the end of reach on which a turning elbow is a sign of that end. Seen: 3."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """The first row of a path that the arm cannot follow."""

    row: int
    reason: RcilabError
    is_singular: bool
    """Rather than out of reach, or at a joint limit."""


def examine(
    model: RobotModel, q: JointVector, path: Path, shares: Array, longest: Array, span: str
) -> tuple[JointPath, Obstacle | None]:
    """Returns the joint angles along a path, shape (N, n), [rad], and the first obstacle, or None.

    Args:
        model: The arm, with its tool.
        q: Joint angles at the start, shape (n,), [rad].
        path: The path.
        shares: Shares of the way, shape (N,), the first 0.
        longest: Turns of the joints from row to row that are no jump yet, shape (N - 1, n) or (n,), [rad].
        span: Distance between two rows, for the message.
    """
    T, psi = path.sample(shares)
    rows, loss = inverse_path(model, T, psi, q)
    rows[0] = q
    limits = model.limits.joint
    excess = np.abs(np.diff(rows, axis=0)) - longest
    jumps = (np.flatnonzero((excess > 0.0).any(axis=1)) + 1).tolist()
    outside = np.flatnonzero(~((limits.lower < rows) & (rows < limits.upper)).all(axis=1)).tolist()
    first = min(jumps[:1] + outside[:1], default=len(rows))
    # The elbow turns ever faster before the arm is stretched: then reach is the reason.
    if loss is not None and loss.row <= first + _STRETCHING * isinstance(loss.reason, UnreachableError):
        return rows, Obstacle(loss.row, loss.reason, isinstance(loss.reason, SingularError))
    if first == len(rows):
        return rows, None
    advice = ", or give another arm angle" if model.redundancy else ""
    if outside[:1] == [first]:
        angles = rows[first]
        i = int(np.maximum(limits.lower - angles, angles - limits.upper).argmax())
        passed = limit_passed(limits, i + 1, float(angles[i]), f"start from another branch{advice}")
        return rows, Obstacle(first, passed, False)
    i = int(excess[first - 1].argmax())
    turn = abs(math.degrees(rows[first, i] - rows[first - 1, i]))
    jump = PlanningError(
        f"joint {i + 1} would have to jump by {turn:.1f} deg {span}, because a singularity is in the way; lead the "
        f"tool around it, go there in joint space{advice}"
    ).coded("path_singular", joint=i + 1, turn=math.radians(turn))
    return rows, Obstacle(first, jump, True)


def refusal(path: Path, share: float, reason: RcilabError, when: str = "") -> PlanningError:
    """Returns the error that says where a path cannot be followed, and why.

    Args:
        path: The path.
        share: The point, as a share of the path length.
        reason: The cause.
        when: Its time, for the message.
    """
    x, y, z = path.at(share)[0].parts[1]
    return PlanningError(
        f"the {path.name} cannot be followed at {share * path.distance:.3f} of {path.distance:.3f} {path.unit} "
        f"({when}{100.0 * share:.1f} % of the way, tool at {x:.3f}, {y:.3f}, {z:.3f} m): {reason}",
        share=share,
    ).coded("path", share=f"{100.0 * share:.1f}", place=(float(x), float(y), float(z)), reason=reason)
