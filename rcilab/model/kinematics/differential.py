"""Jacobian, velocity and acceleration of a frame of the arm, for tables of joint angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.forward import Chain, joint_frame_paths


@dataclass(frozen=True, slots=True, eq=False)
class MovingFrame:
    """A frame of the arm in base, and the axes of the first m of n joints, which move it, for N configurations."""

    axes: Array
    """Directions of the joint axes, shape (N, m, 3)."""
    origins: Array
    """A point on each axis, shape (N, m, 3), [m]."""
    pose: Array
    """The frame in base, shape (N, 4, 4)."""
    n: int
    """Number of joints of the arm."""


def moving_frame(chain: Chain, q: JointPath, joints: int, T_joint_frame: Pose) -> MovingFrame:
    """Returns a frame that is fixed to a link.

    Args:
        chain: From `rcilab.model.kinematics.forward.build_chain`.
        q: Joint angles, shape (N, n), [rad].
        joints: Number of joints before the frame.
        T_joint_frame: Pose of the frame in the Denavit-Hartenberg frame after the last of them.
    """
    steps = joint_frame_paths(chain[:joints], q[:, :joints])
    before = np.stack([np.broadcast_to(np.eye(4), (len(q), 4, 4)), *steps[:-1]], axis=1)
    return MovingFrame(before[:, :, :3, 2], before[:, :, :3, 3], steps[-1] @ T_joint_frame.matrix, len(chain))


def jacobian_path(frame: MovingFrame) -> Array:
    """Returns Jacobians at the frame's origin, shape (N, 6, n), linear rows first, base axes.

    Column i is `[z_i x (p - p_i); z_i]` (Siciliano et al., Robotics, 2009, eq. 3.30); joints after the frame have
    columns of zeros.
    """
    count, joints, _ = frame.axes.shape
    J = np.zeros((count, 6, frame.n))
    J[:, :3, :joints] = np.cross(frame.axes, frame.pose[:, None, :3, 3] - frame.origins).transpose(0, 2, 1)
    J[:, 3:, :joints] = frame.axes.transpose(0, 2, 1)
    return J


def drift_path(frame: MovingFrame, dq: JointPath) -> Array:
    """Returns the acceleration of the frame for zero joint accelerations: dJ/dt dq, shape (N, 6), [m/s^2, rad/s^2].

    Recursion of accelerations along the links (Siciliano et al., Robotics, 2009, section 7.5.1, with ddq = 0).

    Args:
        frame: From `moving_frame`.
        dq: Joint velocities, shape (N, n), [rad/s].
    """
    count, joints, _ = frame.axes.shape
    w, dw, a = np.zeros((3, count, 3))
    ends = np.concatenate((frame.origins[:, 1:], frame.pose[:, None, :3, 3]), axis=1)
    for joint in range(joints):
        turn = frame.axes[:, joint] * dq[:, joint, None]
        dw = dw + np.cross(w, turn)
        w = w + turn
        arm = ends[:, joint] - frame.origins[:, joint]
        a = a + np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
    return np.concatenate((a, dw), axis=1)
