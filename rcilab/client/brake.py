"""How a stream of commands comes to rest from wherever it is, one brake for each kind of command."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from rcilab.arrays import Array, JointVector
from rcilab.clock import CYCLE_TIME
from rcilab.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.limits import JointLimits, Limits
from rcilab.motion import plan_stop
from rcilab.state import RobotState

_FAR = 1e3  # Position bounds that a Cartesian brake never meets: [m], [rad].


class Brake(Protocol):
    """Remembers what was commanded and knows how to end it. Owned by the control loop."""

    def begin(self, state: RobotState) -> None:
        """Starts from the arm standing at its commanded state."""
        ...

    def remember(self, command: Any, cycle: int) -> None:
        """Takes note of a command that was sent in answer to a controller cycle."""
        ...

    def plan(self) -> Sequence[Command]:
        """Returns the commands that lead to rest within the limits, one a cycle after the last; at least one."""
        ...


class StreamBrake:
    """Brings sampled coordinates to rest, whatever they are.

    The past is taken as the parabola through the last three samples: its continuation by a curve that keeps the
    limits keeps them in backward differences too, because those are means of that curve's derivatives.

    Args:
        limits: Bounds of the coordinates.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._limits = limits
        self._past: list[tuple[int, Array]] = []

    def begin(self, *past: tuple[int, Array]) -> None:
        """Starts from three samples, each with the number of its cycle, oldest first."""
        self._past = list(past)

    def remember(self, x: Array, cycle: int) -> None:
        """Appends a sample."""
        if cycle > self._past[-1][0]:
            self._past = [*self._past[-2:], (cycle, x)]

    def rows(self) -> Array:
        """Returns the samples from the one after the last to rest, shape (N, n)."""
        (t0, x0), (t1, x1), (t2, x2) = self._past
        near, far = (x2 - x1) / ((t2 - t1) * CYCLE_TIME), (x1 - x0) / ((t1 - t0) * CYCLE_TIME)
        ddq = 2.0 * (near - far) / ((t2 - t0) * CYCLE_TIME)
        dq = near + ddq * ((t2 - t1) * CYCLE_TIME / 2.0)
        rows = plan_stop(self._limits, x2, dq, ddq).q
        return rows[1:] if len(rows) > 1 else rows


class JointBrake:
    """Brings commanded joint angles to rest.

    Args:
        limits: Bounds of the joints.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._stream = StreamBrake(limits)

    def begin(self, state: RobotState) -> None:
        """Starts from the arm standing at its commanded angles."""
        self._stream.begin(*((cycle, state.q_c) for cycle in (-3, -2, -1)))

    def remember(self, command: JointPosition, cycle: int) -> None:
        """Takes note of a command."""
        self._stream.remember(command.q, cycle)

    def plan(self) -> Sequence[Command]:
        """Returns the angles that lead to rest."""
        return [JointPosition(row) for row in self._stream.rows()]


class CartesianBrake:
    """Brings a commanded pose to rest: position, rotation about the last orientation, and arm angle each by itself.

    Args:
        limits: Bounds of the arm.
    """

    def __init__(self, limits: Limits) -> None:
        c, psi = limits.cartesian, limits.arm_angle
        velocity = [c.translation_velocity] * 3 + [c.rotation_velocity] * 3
        acceleration = [c.translation_acceleration] * 3 + [c.rotation_acceleration] * 3
        jerk = [c.translation_jerk] * 3 + [c.rotation_jerk] * 3
        # An arm without an arm angle leaves the seventh coordinate at 0, where any bound will do.
        velocity.append(psi.velocity if psi else 1.0)
        acceleration.append(psi.acceleration if psi else 1.0)
        jerk.append(psi.jerk if psi else 1.0)
        unused, far = np.zeros(7), np.full(7, _FAR)
        self._stream = StreamBrake(
            JointLimits(
                lower=-far, upper=far, velocity=np.array(velocity), acceleration=np.array(acceleration),
                jerk=np.array(jerk), torque=unused, torque_rate=unused, collision_threshold=unused, stiffness=unused,
            )
        )  # fmt: skip
        self._poses: list[tuple[int, CartesianPosition]] = []

    def begin(self, state: RobotState) -> None:
        """Starts from the arm standing at its commanded pose."""
        still = CartesianPosition(state.T_base_tool_c)
        self._poses = [(cycle, still) for cycle in (-3, -2, -1)]

    def remember(self, command: CartesianPosition, cycle: int) -> None:
        """Takes note of a command."""
        if cycle > self._poses[-1][0]:
            self._poses = [*self._poses[-2:], (cycle, command)]

    def plan(self) -> Sequence[Command]:
        """Returns the poses that lead to rest."""
        last = self._poses[-1][1]
        R = last.T_base_tool[:3, :3]
        past: list[tuple[int, Array]] = []
        for cycle, pose in self._poses:
            turn = _rotation_vector(pose.T_base_tool[:3, :3] @ R.T)
            psi = 0.0 if pose.psi is None or last.psi is None else pose.psi - last.psi
            past.append((cycle, np.concatenate((pose.T_base_tool[:3, 3], turn, [psi]))))
        self._stream.begin(*past)
        way: list[Command] = []
        for row in self._stream.rows():
            T = np.eye(4)
            T[:3, :3] = _rotation(row[3:6]) @ R
            T[:3, 3] = row[:3]
            way.append(CartesianPosition(T, None if last.psi is None else last.psi + float(row[6])))
        return way


class TorqueBrake:
    """Takes commanded torques back to zero at the allowed rate; what is left is the controller's own compensation.

    Args:
        limits: Bounds of the joints.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._step = limits.torque_rate * CYCLE_TIME
        self._tau: JointVector = np.zeros_like(limits.torque_rate)

    def begin(self, state: RobotState) -> None:
        """Starts without torque."""
        self._tau = np.zeros_like(self._step)

    def remember(self, command: JointTorque, cycle: int) -> None:
        """Takes note of a command."""
        self._tau = command.tau

    def plan(self) -> Sequence[Command]:
        """Returns the torques that lead to zero."""
        way = [JointTorque(self._tau)]
        while way[-1].tau.any():
            tau = way[-1].tau
            way.append(JointTorque(np.sign(tau) * np.maximum(np.abs(tau) - self._step, 0.0)))
        return way


def _rotation_vector(R: Array) -> Array:
    """Returns the axis times the angle, shape (3,), [rad], of a rotation well below half a turn."""
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    sine = float(np.linalg.norm(skew))
    return skew if sine < 1e-12 else skew * (math.asin(min(1.0, sine)) / sine)


def _rotation(vector: Array) -> Array:
    """Returns the rotation, shape (3, 3), about an axis by an angle, given as their product (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector if angle < 1e-12 else vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-12:
        return np.eye(3) + K
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)
