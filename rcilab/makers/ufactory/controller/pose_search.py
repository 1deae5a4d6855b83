"""The inverse kinematics of a request: of all joint angles of a pose inside their ranges, those nearest to others.

A path of the tool stays on its branch, and is solved by the planner instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, hypot, pi

import numpy as np

from rcilab.core.arrays import Array, as_vector
from rcilab.core.errors import UnreachableError
from rcilab.core.limits import JointLimits
from rcilab.core.spatial import Pose, rotation_between
from rcilab.model.kinematics.solution_batch import SolutionBatch
from rcilab.model.kinematics.solutions import Solutions
from rcilab.model.robot_model import RobotModel

_ROUNDING = 1e-6  # [m], [rad] Of poses and angles on the wire.
_OUT_OF_PLANE = 1e-5  # [rad] Rounding of the tool's axis, of angles in degrees with six digits.
_SWEEP = 72  # Angles of the redundant joint that are tried, 5 deg apart: in about 5 ms.
_AT_AXIS = 1e-3  # [m] A tool that is nearer to the base's axis does not define the plane of the arm.


def find_nearest_angles(
    model: RobotModel, limits: JointLimits, pose: Pose, near: Sequence[float], *, is_limited: bool = False
) -> list[float]:
    """Returns the joint angles of a pose inside their ranges that are nearest to others, shape (n,), [rad].

    A redundant joint keeps its angle of `near` if there is a solution with it.

    Args:
        model: The arm with its tool.
        limits: Ranges of the joints.
        pose: Of the tool in base; in single precision.
        near: Shape (n,), [rad].
        is_limited: Whether joints with several turns are kept within ±180 deg.

    Raises:
        UnreachableError: The pose is out of reach, or only within reach outside the ranges.
        InvalidValueError: A number is not finite, or too large for an angle.
    """
    start = as_vector(near, model.n, "reference angles", "rad")
    lower, upper = limits.lower, limits.upper
    if is_limited:
        is_wide = (lower <= -pi) & (upper >= pi)
        lower, upper = np.where(is_wide, -pi, lower), np.where(is_wide, pi, upper)
    found = _search(model, limits, pose, start, (lower - _ROUNDING, upper + _ROUNDING))
    return np.clip(found, lower, upper).tolist()


def _search(model: RobotModel, limits: JointLimits, pose: Pose, near: Array, ranges: tuple[Array, Array]) -> Array:
    lower, upper = ranges
    here = model.forward(near)  # Refuses numbers that cannot be angles.
    if np.all((near >= lower) & (near <= upper)) and _is_same(here, pose):
        return near  # Also where a singular pose has any number of solutions.
    flange = pose @ model.T_flange_tool.inverse()
    if model.n < 6:
        flange = _into_plane(flange)
    solver, start = model.solver, near.tolist()
    psi = solver.redundancy_angle(start) if solver.redundancy else 0.0
    branches = solver.at(flange, start).branches(psi)
    solutions = Solutions(branches, lower.tolist(), upper.tolist(), psi if solver.redundancy else None, limits)
    if len(solutions):
        return solutions.nearest(near)
    if not solver.redundancy:
        raise solutions.refusal()
    angles = psi + np.linspace(-pi, pi, _SWEEP, endpoint=False)
    batch = SolutionBatch(solver.batch(np.repeat(flange.matrix[np.newaxis], _SWEEP, axis=0), angles), lower, upper)
    rows = batch.nearest(near)[batch.reachable]
    if not len(rows):
        raise solutions.refusal(everywhere=True)
    return rows[np.square(rows - near).sum(axis=1).argmin()]


def _is_same(a: Pose, b: Pose) -> bool:
    off = max(abs(x - y) for x, y in zip(a.parts[1], b.parts[1], strict=True))
    return off <= _ROUNDING and hypot(*rotation_between(a.parts[0], b.parts[0])) <= _ROUNDING


def _into_plane(flange: Pose) -> Pose:
    """Returns a pose without the rounding that turns it out of the plane in which an arm with five axes moves.

    Raises:
        UnreachableError: It is turned farther.
    """
    R, (x, y, _) = flange.rotation, flange.parts[1]
    axis = R[:, 2]
    across = np.array([-y, x, 0.0]) if hypot(x, y) > _AT_AXIS else np.array([-axis[1], axis[0], 0.0])
    normal = across / max(float(np.linalg.norm(across)), _ROUNDING)
    turn = float(axis @ normal)
    if abs(turn) > _OUT_OF_PLANE:
        raise UnreachableError(
            f"the tool would be turned out of the plane of the arm by {degrees(abs(turn)):.3g} deg, which an arm with "
            "five axes cannot do"
        )
    axis = axis - turn * normal
    axis = axis / np.linalg.norm(axis)
    first = R[:, 0] - (R[:, 0] @ axis) * axis
    first = first / np.linalg.norm(first)
    matrix = flange.matrix.copy()
    matrix[:3, :3] = np.column_stack((first, np.cross(axis, first), axis))
    return Pose.from_matrix(matrix)
