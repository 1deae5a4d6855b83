"""Stop planners, one per type of command: they stop from any point of a command stream."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.arrays import Array, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.errors import SingularError
from rcilab.core.limits import JointLimits, Limits
from rcilab.core.rotation import rotation_matrix, rotation_vector
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.motion import LIMIT_MARGIN, plan_stop

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_JOINT_SHARE = 0.6  # Part of the joints' acceleration and jerk for a stop of the tool: the rest is for their motion.
_STEP = 1e-6  # [rad] Of a central difference.
_SINGULAR = 1e-3  # Share of the largest singular value below which a direction counts as singular.
_FLOOR = 1e-9  # Avoids a division by zero for a joint that does not move.
_HISTORY = 3  # Previous commands in a third difference.
_FAR = 1e3  # Position bounds that a Cartesian stop never reaches: [m], [rad].


class StopPlanner(Protocol):
    """Stores the last commands and plans the stop. Owned by the control loop."""

    def begin(self, state: RobotState) -> None:
        """Starts from a stationary arm at its commanded state."""
        ...

    def remember(self, command: Any, cycle: int, state: RobotState) -> None:
        """Stores the command that was sent for a controller cycle."""
        ...

    def plan(self) -> Sequence[Command]:
        """Returns the commands of a stop within the limits, one per following cycle; at least one."""
        ...

    def find_motion(self) -> LimitViolation | None:
        """Returns the violation if the arm stopped at the last command because it is repeated, or None."""
        ...


class StreamStopPlanner:
    """Stops a stream of sampled coordinates.

    It continues the parabola through the last three samples with a curve inside the limits. The backward differences
    are then inside the limits, too, because they are means of the curve's derivatives.

    Args:
        limits: Bounds of the coordinates.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._limits = limits
        self.past: list[tuple[int, Array]] = []
        """The last three samples, each with the number of its cycle, oldest first."""

    def begin(self, *past: tuple[int, Array]) -> None:
        """Starts from three samples with their cycle numbers, oldest first."""
        self.past = list(past)

    def remember(self, x: Array, cycle: int) -> None:
        """Appends a sample."""
        if cycle > self.past[-1][0]:
            self.past = [*self.past[-2:], (cycle, x)]

    def rows(self) -> Array:
        """Returns the samples after the last one until standstill, shape (N, n)."""
        near, ddq = self.differences()
        dq = near + ddq * ((self.past[-1][0] - self.past[-2][0]) * CYCLE_TIME / 2.0)
        rows = plan_stop(self._limits, self.last, dq, ddq).q
        return rows[1:] if len(rows) > 1 else rows

    def differences(self) -> tuple[Array, Array]:
        """Returns the first and second divided differences of the last samples, shape (n,), per s and s^2."""
        (t0, x0), (t1, x1), (t2, x2) = self.past
        near, far = (x2 - x1) / ((t2 - t1) * CYCLE_TIME), (x1 - x0) / ((t1 - t0) * CYCLE_TIME)
        return near, 2.0 * (near - far) / ((t2 - t0) * CYCLE_TIME)

    @property
    def last(self) -> Array:
        """The last sample."""
        return self.past[-1][1]


class JointStopPlanner:
    """Stops commanded joint angles.

    Args:
        limits: Bounds of the joints.
        period: Cycles between two commands; the last command is repeated meanwhile.
    """

    def __init__(self, limits: JointLimits, period: int = 1) -> None:
        self._limits = limits
        self._period = period
        self._stream = StreamStopPlanner(limits)

    def begin(self, state: RobotState) -> None:
        """Starts from a stationary arm at its commanded angles."""
        self._stream.begin(*((cycle, state.q_c) for cycle in (-3, -2, -1)))

    def remember(self, command: JointPosition, cycle: int, state: RobotState) -> None:
        """Stores a command."""
        self._stream.remember(command.q, cycle)

    def plan(self) -> Sequence[Command]:
        """Returns the angles of the stop."""
        return [JointPosition(row) for row in self._stream.rows()]

    def find_motion(self) -> LimitViolation | None:
        """Returns the violation if the last command is repeated, or None."""
        monitor = JointMonitor(self._limits)
        (before, first), *later = self._stream.past
        monitor.reset(first.tolist())
        for cycle, row in later:
            monitor.step(row.tolist(), cycle - before)
            before = cycle
        q = self._stream.last.tolist()
        return _first_violation(monitor, lambda: monitor.step(q, self._period))


class CartesianStopPlanner:
    """Stops a commanded pose: position, rotation about the last orientation, and arm angle independently.

    The controller also checks the joint angles that it computes, and they are often more restrictive: stopping a tool
    with 10 m/s^2 can exceed the limits of the elbow. Acceleration and jerk are therefore reduced to what the joints
    allow in this configuration.

    Args:
        limits: Bounds of the arm.
        model: The arm, for the limits of its joints.
        period: Cycles between two commands; the last command is repeated meanwhile.
    """

    def __init__(self, limits: Limits, model: RobotModel, period: int = 1) -> None:
        self._limits = limits
        self._period = period
        self._model = model
        self._poses: list[tuple[int, CartesianPosition]] = []
        self._q = model.home

    def begin(self, state: RobotState) -> None:
        """Starts from a stationary arm at its commanded pose."""
        still = CartesianPosition(state.T_base_tool_c)
        self._poses = [(cycle, still) for cycle in (-3, -2, -1)]
        self._q = state.q_c

    def remember(self, command: CartesianPosition, cycle: int, state: RobotState) -> None:
        """Stores a command."""
        self._q = state.q_c
        if cycle > self._poses[-1][0]:
            self._poses = [*self._poses[-2:], (cycle, command)]

    def plan(self) -> Sequence[Command]:
        """Returns the poses of the stop."""
        last = self._poses[-1][1]
        R = last.T_base_tool[:3, :3]
        past: list[tuple[int, Array]] = []
        for cycle, pose in self._poses:
            turn = rotation_vector(R, pose.T_base_tool[:3, :3])
            psi = 0.0 if pose.psi is None or last.psi is None else pose.psi - last.psi
            past.append((cycle, np.concatenate((pose.T_base_tool[:3, 3], turn, [psi]))))
        stream = StreamStopPlanner(self._bounds())
        stream.begin(*past)
        commands: list[Command] = []
        for row in stream.rows():
            T = np.eye(4)
            T[:3, :3] = rotation_matrix(row[3:6]) @ R
            T[:3, 3] = row[:3]
            commands.append(CartesianPosition(T, None if last.psi is None else last.psi + float(row[6])))
        return commands

    def find_motion(self) -> LimitViolation | None:
        """Returns the violation if the last command is repeated, or None. The joints are not checked."""
        monitor = CartesianMonitor(self._limits)
        (before, first), *later = self._poses
        monitor.reset(Pose.from_matrix(first.T_base_tool), first.psi)
        for cycle, command in later:
            monitor.step(Pose.from_matrix(command.T_base_tool), command.psi, cycle - before)
            before = cycle
        last = self._poses[-1][1]
        pose = Pose.from_matrix(last.T_base_tool)
        return _first_violation(monitor, lambda: monitor.step(pose, last.psi, self._period))

    def _bounds(self) -> JointLimits:
        """Returns the bounds of position, rotation and arm angle, seven coordinates, as those of joints."""
        c, psi = self._limits.cartesian, self._limits.arm_angle
        velocity = np.array([c.translation_velocity] * 3 + [c.rotation_velocity] * 3 + [1.0])
        acceleration = np.array([c.translation_acceleration] * 3 + [c.rotation_acceleration] * 3 + [1.0])
        jerk = np.array([c.translation_jerk] * 3 + [c.rotation_jerk] * 3 + [1.0])
        if psi is not None:  # Without one the seventh coordinate stays at 0, and its bound has no effect.
            velocity[6], acceleration[6], jerk[6] = psi.velocity, psi.acceleration, psi.jerk
        # The tool's bounds apply to the length of a vector, these to each of its three coordinates.
        acceleration[:6] /= math.sqrt(3.0)
        jerk[:6] /= math.sqrt(3.0)
        needed, joint = _joint_shares(self._model, self._q), self._limits.joint
        acceleration *= min(1.0, _JOINT_SHARE * float((joint.acceleration / (needed @ acceleration)).min()))
        jerk *= min(1.0, _JOINT_SHARE * float((joint.jerk / (needed @ jerk)).min()))
        unused, far = np.zeros(7), np.full(7, _FAR)
        return JointLimits(
            lower=-far, upper=far, velocity=velocity, acceleration=acceleration, jerk=jerk, torque=unused,
            torque_rate=unused, collision_threshold=unused, stiffness=unused,
        )  # fmt: skip


class TorqueStopPlanner:
    """Reduces commanded torques to zero at the allowed rate; the controller's compensation remains.

    Args:
        limits: Bounds of the joints.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._step = LIMIT_MARGIN * limits.torque_rate * CYCLE_TIME
        self._tau: JointVector = np.zeros_like(limits.torque_rate)

    def begin(self, state: RobotState) -> None:
        """Starts at zero torque."""
        self._tau = np.zeros_like(self._step)

    def remember(self, command: JointTorque, cycle: int, state: RobotState) -> None:
        """Stores a command."""
        self._tau = command.tau

    def plan(self) -> Sequence[Command]:
        """Returns the torques of the stop."""
        commands = [JointTorque(self._tau)]
        while commands[-1].tau.any():
            tau = commands[-1].tau
            commands.append(JointTorque(np.sign(tau) * np.maximum(np.abs(tau) - self._step, 0.0)))
        return commands

    def find_motion(self) -> LimitViolation | None:
        """Returns None: torques may be repeated."""
        return None


def _first_violation(
    monitor: JointMonitor | CartesianMonitor, repeat: Callable[[], list[LimitViolation]]
) -> LimitViolation | None:
    """Returns the first violation in `_HISTORY` repetitions of the last command, or None."""
    for _ in range(_HISTORY):
        violations = [violation for violation in repeat() if violation.condition.order > 0]
        if violations:  # Positions are not checked.
            return violations[0]
    return None


def _joint_shares(model: RobotModel, q: JointVector) -> Array:
    """Returns the largest motion of each joint per unit of each tool coordinate, shape (n, 7).

    These are the absolute values of the inverse Jacobian, with the arm angle as seventh row if there is one; at a
    singularity those of the least-squares inverse.
    """
    J = np.zeros((7, model.n))
    J[:6] = model.jacobian(q)
    if model.redundancy:
        try:
            for i, unit in enumerate(np.eye(7) * _STEP):
                J[6, i] = math.remainder(model.arm_angle(q + unit) - model.arm_angle(q - unit), math.tau) / (
                    2.0 * _STEP
                )
        except SingularError:
            J[6] = 0.0
    return np.abs(np.linalg.pinv(J, rcond=_SINGULAR)) + _FLOOR
