"""Motion of the tool and the elbow: pose, twist, acceleration and arm angle, updated once per cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rcilab.core.arrays import Matrix
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import SingularError
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.rigid_body import ToolTerms, Twist
from rcilab.model.robot_model import RobotModel

_REST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class ToolKinematics:
    """Follows one motion of the joints, commanded or measured. Owned by the virtual arm.

    The arm angle is undefined if shoulder and wrist are aligned with the base axis or the arm is stretched: its last
    value is kept, initially 0. Without redundancy it is 0.

    Attributes:
        matrix: Pose of the tool in base as a homogeneous transform, shape (4, 4), [m].
        twist: Its velocity in base axes, linear first, [m/s, rad/s]: Jacobian times joint velocity.
        acceleration: The twist's backward difference over one cycle, [m/s^2, rad/s^2].
        psi: Arm angle, [rad].
        dpsi: Its backward difference over one cycle, in the shorter direction, [rad/s].
        ddpsi: The second, [rad/s^2].

    Args:
        model: The arm with its tool.
        q: Joint angles of the stationary arm, n plain floats, [rad].
    """

    def __init__(self, model: RobotModel, q: Sequence[float]) -> None:
        self._body = model.rigid_body
        self._solver, self._has_arm_angle = model.solver, bool(model.redundancy)
        self._terms: ToolTerms
        self.matrix: Matrix
        self.twist = self.acceleration = _REST
        self.psi = self.dpsi = self.ddpsi = 0.0
        self.reset(q)

    @property
    def pose(self) -> Pose:
        """Pose of the tool in base; computed on demand."""
        return self._terms.pose

    @property
    def position(self) -> list[float]:
        """Position of the tool in base, 3 plain floats, [m]."""
        return self.matrix[:3, 3].tolist()

    @property
    def is_stationary(self) -> bool:
        """Whether nothing changes as long as the joints do not move."""
        return not (any(self.twist) or any(self.acceleration) or self.dpsi or self.ddpsi)

    def reset(self, q: Sequence[float]) -> None:
        """Sets a stationary arm."""
        self._terms = self._body.tool_motion(np.array(q), np.zeros(len(q)))
        self.matrix = self._terms.matrix
        self.twist = self.acceleration = _REST
        self.psi, self.dpsi, self.ddpsi = self._arm_angle(q), 0.0, 0.0

    def update(self, q: Sequence[float], motion: ToolTerms) -> None:
        """Updates from the joint angles of this cycle, n plain floats, [rad], and the motion of the tool."""
        h = CYCLE_TIME
        self._terms, self.matrix, twist = motion, motion.matrix, motion.twist
        a, b, c, d, e, f = twist
        p, r, s, t, u, v = self.twist
        self.acceleration = ((a - p) / h, (b - r) / h, (c - s) / h, (d - t) / h, (e - u) / h, (f - v) / h)
        self.twist = twist
        psi = self._arm_angle(q)
        dpsi = math.remainder(psi - self.psi, math.tau) / h
        self.psi, self.dpsi, self.ddpsi = psi, dpsi, (dpsi - self.dpsi) / h

    def observe(self, q: Sequence[float], motion: ToolTerms) -> None:
        """Updates pose, twist and arm angle from measured joint angles, without differences."""
        self._terms, self.matrix, self.twist = motion, motion.matrix, motion.twist
        self.psi = self._arm_angle(q)

    def coincide(self, other: ToolKinematics) -> None:
        """Copies pose, twist and arm angle of another one, for joints that are exactly at their reference."""
        self._terms, self.matrix, self.twist, self.psi = other._terms, other.matrix, other.twist, other.psi

    def _arm_angle(self, q: Sequence[float]) -> float:
        if not self._has_arm_angle:
            return 0.0
        try:
            return self._solver.redundancy_angle(q)
        except SingularError:
            return self.psi
