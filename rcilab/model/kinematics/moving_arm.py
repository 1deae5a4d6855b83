"""Forward and differential kinematics of an arm's frames."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import MAX_ANGLE, Array, JointVector, as_path, as_rows, as_vector, require_radians
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose, as_pose
from rcilab.model.kinematics import forward as forward_kinematics
from rcilab.model.kinematics.differential import MovingFrame, drift_path, jacobian_path, moving_frame
from rcilab.model.kinematics.frames import Frame, locate
from rcilab.model.kinematics.jacobian import jacobian
from rcilab.model.kinematics.least_norm import JointRates, least_norm
from rcilab.robots.description import DhRow


class MovingArm:
    """The geometry of an arm with its tool. Immutable.

    Capital names in brackets are those of the vendor's model library (RCI manual, section 3.4).

    Args:
        dh: Standard Denavit-Hartenberg table, one row per joint.
        T_flange_tool: Pose of the tool in the flange frame.
        T_tool_stiffness: Pose of the stiffness frame in the tool frame.

    Raises:
        InvalidValueError: A pose is not valid.
    """

    def __init__(self, dh: Sequence[DhRow], T_flange_tool: Pose, T_tool_stiffness: Pose) -> None:
        self.T_flange_tool = as_pose(T_flange_tool, "tool", "; Pose() is no tool")
        self.T_tool_stiffness = as_pose(T_tool_stiffness, "stiffness frame")
        self.n = len(dh)
        self._chain = forward_kinematics.build_chain(dh)
        self._has_tool = not self.T_flange_tool.is_close(IDENTITY, 0.0)

    def forward(self, q: ArrayLike) -> Pose:
        """Returns the pose of the tool in base.

        Args:
            q: Joint angles, shape (n,), [rad]; limits are not checked.

        Raises:
            InvalidValueError: q is not n finite numbers.
        """
        T = forward_kinematics.forward(self._chain, self._floats(q))
        return T @ self.T_flange_tool if self._has_tool else T

    def pose(self, q: ArrayLike, frame: Frame = "tool") -> Pose:
        """Returns the pose of a frame of the arm in base (GetCartPose); for the tool see also `forward`.

        Args:
            q: Joint angles, shape (n,), [rad]; limits are not checked.
            frame: joint1 to jointn, flange, tool or stiffness.

        Raises:
            InvalidValueError: q is not n finite numbers, or the frame is unknown.
        """
        joints, T_joint_frame = self._locate(frame)
        return forward_kinematics.forward(self._chain[:joints], self._floats(q)[:joints]) @ T_joint_frame

    def forward_path(self, q: ArrayLike, frame: Frame = "tool") -> Array:
        """Returns the poses of a frame in base along a path (GetCartPose), shape (N, 4, 4), for q of shape (N, n)."""
        joints, T_joint_frame = self._locate(frame)
        table = as_path(q, self.n, "q", "rad")[:, :joints]
        T = forward_kinematics.forward_path(self._chain[:joints], table)
        return T if T_joint_frame is IDENTITY else T @ T_joint_frame.matrix

    def position_path(self, q: ArrayLike) -> Array:
        """Returns the positions of the tool in base along a path, shape (N, 3), [m], for q of shape (N, n)."""
        point = self.T_flange_tool.parts[1]
        return forward_kinematics.position_path(self._chain, as_path(q, self.n, "q", "rad"), point)

    def joint_frames(self, q: ArrayLike) -> tuple[Pose, ...]:
        """Returns the Denavit-Hartenberg frames after joint 1, 2, ..., n in base; the last one is the flange."""
        return forward_kinematics.joint_frames(self._chain, self._floats(q))

    def jacobian(self, q: ArrayLike, frame: Frame = "tool") -> Array:
        """Returns the Jacobian at the origin of a frame (Jacobian), linear rows first, base axes.

        It is the derivative of `pose` for every frame. The vendor's library differs for the tool and the stiffness
        frame.

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad].
            frame: joint1 to jointn, flange, tool or stiffness; later joints than the frame's have columns of zeros.

        Returns:
            Shape (6, n) or (N, 6, n), [m/rad] and [rad/rad].

        Raises:
            InvalidValueError: q has another shape or is not finite, or the frame is unknown.
        """
        if frame == "tool" and getattr(q, "ndim", 0) == 1:
            return jacobian(self._chain, self._floats(q), self.T_flange_tool)
        angles = as_rows(q, self.n, "q", "rad")
        return jacobian_path(self._moving(angles, frame)).reshape(*angles.shape[:-1], 6, self.n)

    def velocity(self, q: ArrayLike, dq: ArrayLike, frame: Frame = "tool") -> Array:
        """Returns the twist of a frame (GetCartVel): velocity of its origin and angular velocity, base axes.

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad].
            dq: Joint velocities, of q's shape, [rad/s].
            frame: joint1 to jointn, flange, tool or stiffness.

        Returns:
            Shape (6,) or (N, 6), [m/s, rad/s].
        """
        angles = as_rows(q, self.n, "q", "rad")
        speeds = as_rows(dq, self.n, "dq", "rad/s", angles)
        J = jacobian_path(self._moving(angles, frame))
        return np.einsum("nij,nj->ni", J, np.atleast_2d(speeds)).reshape(*angles.shape[:-1], 6)

    def acceleration(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, frame: Frame = "tool") -> Array:
        """Returns the acceleration of a frame (GetCartAcc), J ddq + dJ/dt dq: of its origin, and angular, base axes.

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad].
            dq: Joint velocities, of q's shape, [rad/s].
            ddq: Joint accelerations, of q's shape, [rad/s^2].
            frame: joint1 to jointn, flange, tool or stiffness.

        Returns:
            Shape (6,) or (N, 6), [m/s^2, rad/s^2].
        """
        angles = as_rows(q, self.n, "q", "rad")
        speeds = np.atleast_2d(as_rows(dq, self.n, "dq", "rad/s", angles))
        rates = np.atleast_2d(as_rows(ddq, self.n, "ddq", "rad/s^2", angles))
        moving = self._moving(angles, frame)
        found = np.einsum("nij,nj->ni", jacobian_path(moving), rates) + drift_path(moving, speeds)
        return found.reshape(*angles.shape[:-1], 6)

    def joint_velocity(
        self, q: ArrayLike, twist: ArrayLike, weights: ArrayLike | None = None, frame: Frame = "tool"
    ) -> JointRates:
        """Returns the joint velocities of least norm that give a frame a twist (GetJointVel).

        Close to a singularity they are damped: see `.damped`, and `.missed` for the part of the twist that is missing.

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad].
            twist: Desired motion in base axes, shape (6,) or (N, 6), linear part first, [m/s, rad/s].
            weights: Relative costs of the joints' motions, shape (n,), positive; all equal when absent.
            frame: joint1 to jointn, flange, tool or stiffness. A frame moved by fewer than 6 joints is always damped.

        Raises:
            InvalidValueError: An argument has another shape or is not finite, a weight is not positive.
        """
        angles = as_rows(q, self.n, "q", "rad")
        desired = as_rows(twist, 6, "twist", "m/s, rad/s", angles)
        return least_norm(self.jacobian(angles, frame), desired, self._weights(weights))

    def joint_acceleration(
        self,
        q: ArrayLike,
        dq: ArrayLike,
        acceleration: ArrayLike,
        weights: ArrayLike | None = None,
        frame: Frame = "tool",
    ) -> JointRates:
        """Returns the joint accelerations of least norm that give a frame an acceleration (GetJointAcc).

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad].
            dq: Joint velocities, of q's shape, [rad/s].
            acceleration: Desired acceleration, in base axes, shape (6,) or (N, 6), linear part first, [m/s^2, rad/s^2].
            weights: As for `joint_velocity`.
            frame: joint1 to jointn, flange, tool or stiffness.

        Raises:
            InvalidValueError: As for `joint_velocity`.
        """
        angles = as_rows(q, self.n, "q", "rad")
        desired = as_rows(acceleration, 6, "acceleration", "m/s^2, rad/s^2", angles)
        drift = self.acceleration(angles, dq, np.zeros(angles.shape), frame)
        return least_norm(self.jacobian(angles, frame), desired - drift, self._weights(weights))

    def _locate(self, frame: str) -> tuple[int, Pose]:
        return locate(frame, self.n, self.T_flange_tool, self.T_tool_stiffness)

    def _moving(self, q: Array, frame: str) -> MovingFrame:
        return moving_frame(self._chain, np.atleast_2d(q), *self._locate(frame))

    def _weights(self, weights: ArrayLike | None) -> JointVector:
        if weights is None:
            return np.ones(self.n)
        values = as_vector(weights, self.n, "weights")
        if not (values > 0.0).all():
            raise InvalidValueError("weights", values.tolist(), "must all be above 0")
        return values

    def _floats(self, q: ArrayLike) -> list[float]:
        """Returns q as n finite plain floats; cheap for an array.

        Raises:
            InvalidValueError: It is not n finite numbers, or an angle is too large for radians.
        """
        if isinstance(q, np.ndarray) and q.dtype == np.float64 and q.shape == (self.n,):
            values = q.tolist()
            if math.hypot(*values) <= MAX_ANGLE:  # False also for nan.
                return values
        return require_radians(as_vector(q, self.n, "q", "rad"), "q").tolist()
