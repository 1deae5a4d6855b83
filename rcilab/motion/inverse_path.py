"""Inverse kinematics along a path of the tool."""

from __future__ import annotations

from math import isfinite

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import IDENTITY, Pose, rotation_from_wxyz, wxyz_from_rotation
from rcilab.model.kinematics.solvers.solver import BranchEnd
from rcilab.model.robot_model import RobotModel
from rcilab.motion.ik_tracker import IkTracker


def inverse_path(
    model: RobotModel, T: Array, psi: Array | None, start: JointVector
) -> tuple[JointPath, BranchEnd | None]:
    """Returns the joint angles along a path of the tool, on one branch and without jumps.

    Joint limits are not checked. About 2 us per row; 20 us for an arm with offsets, which has no closed-form inverse.

    Args:
        model: The arm, with its tool.
        T: Poses of the tool in base, shape (N, 4, 4), each close to the next.
        psi: Arm angles of a 7-axis arm, shape (N,), [rad]; None for 6 axes.
        start: Joint angles at row 0, shape (n,), [rad]; they select the branch.

    Returns:
        Joint angles, shape (N, n), [rad], and the first row that is out of reach or singular, or None. From that row on
        the angles have no meaning.
    """
    (rotation, (x, y, z)), R, p = model.T_flange_tool.inverse().parts, T[:, :3, :3], T[:, :3, 3]
    if not model.T_flange_tool.is_close(IDENTITY, 0.0):
        a, b, c = (R[:, :, i] for i in range(3))
        p = p + x * a + y * b + z * c
        R = np.stack([a * rotation[i] + b * rotation[3 + i] + c * rotation[6 + i] for i in range(3)], axis=2)
    return model.solver.follow(R, p, psi, start)


def free_inverse_path(model: RobotModel, T: Array, psi: Array, start: JointVector) -> JointPath:
    """Returns the joint angles along a path of the tool, where the joints move least from row to row.

    It is the inverse of a controller that leaves the arm angle free. Joint limits are not checked. 100 us per row.

    Args:
        model: The arm, with its tool.
        T: Poses of the tool in base, shape (N, 4, 4), each close to the next.
        psi: Arm angles, shape (N,), [rad]; NaN in rows that leave it free.
        start: Joint angles before row 0, shape (n,), [rad].

    Returns:
        Joint angles, shape (M, n), [rad], up to the first row that is out of reach or singular: M < N if there is one.
    """
    tracker, q, rows = IkTracker(model), start.tolist(), list[list[float]]()
    for matrix, angle in zip(T, psi.tolist(), strict=True):
        a, b, c, d, e, f, g, h, i = matrix[:3, :3].ravel().tolist()
        x, y, z = matrix[:3, 3].tolist()
        pose = Pose.from_parts(rotation_from_wxyz(wxyz_from_rotation((a, b, c, d, e, f, g, h, i))), (x, y, z))
        try:
            q = tracker.solve(pose, angle, q) if isfinite(angle) else tracker.follow(pose, q)
        except KinematicsError:
            break
        rows.append(q)
    return np.array(rows).reshape(-1, model.n)
