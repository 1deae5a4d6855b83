"""The rate limiter and the low pass of libfranka's own loop, by the formulas of its rate_limiting.h and .cpp.

Of version 0.9.2 for the Panda, and of 0.21 for the FR3, which have the same formulas for other bounds. Velocity,
acceleration and jerk are clipped, with an acceleration that decreases near the velocity bound; nothing brakes ahead of
the command, so that a jump is overshot. Here a cycle starts from the last command sent: libfranka starts from the
commanded values of the state, which are the same, apart from rounding, unless commands were lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rcilab.core.arrays import Array, Matrix
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.limits import JointLimits, Limits
from rcilab.core.rotation import rotation_matrix, rotation_vector
from rcilab.motion.low_pass import FILTER_OFF, low_pass, low_pass_pose, smoothing

MARGIN = 1e-3  # Inside each limit, in its unit.
LOST_CYCLES = {5: 3.0, 10: 0.0}
"""Cycles that libfranka's velocity bounds allow for lost commands, by version of the interface: a part of the velocity
that is left for what the arm then gains with its largest acceleration."""
_POSE_ROTATION = 0.99  # Part of the rotation's bounds that poses use.
_SMALLEST = float(np.finfo(np.float64).eps)  # A shorter vector has no direction.


class RateBounds(NamedTuple):
    """Bounds of one signal: numbers for a vector's length, or one element per joint."""

    velocity: float | Array
    acceleration: float | Array
    jerk: float | Array


class Rates(NamedTuple):
    """Velocity and acceleration of the last command."""

    velocity: Array
    acceleration: Array


def limit_rate(wanted: Array, last: Rates, lower: Array | float, upper: Array | float, bounds: RateBounds) -> Array:
    """Returns the limited velocities of joints, or of the elbow, one by one.

    Args:
        wanted: Commanded velocities, shape (n,), [rad/s].
        last: The last command's.
        lower: Smallest velocities, shape (n,) or for all.
        upper: Largest velocities.
        bounds: Acceleration and jerk; their velocity is not used.
    """
    jerk = np.clip(((wanted - last.velocity) / CYCLE_TIME - last.acceleration) / CYCLE_TIME, -bounds.jerk, bounds.jerk)
    steepness = bounds.jerk / bounds.acceleration
    highest = np.minimum(steepness * (upper - last.velocity), bounds.acceleration)
    lowest = np.maximum(steepness * (lower - last.velocity), -bounds.acceleration)
    acceleration = np.maximum(np.minimum(last.acceleration + jerk * CYCLE_TIME, highest), lowest)
    return last.velocity + acceleration * CYCLE_TIME


def limit_vector_rate(wanted: Array, last: Rates, bounds: RateBounds) -> Array:
    """Returns the limited velocity of the tool's translation or rotation, by its length.

    Args:
        wanted: Commanded velocity, shape (3,), [m/s] or [rad/s].
        last: The last command's.
        bounds: Of the lengths.
    """
    most, steepest = float(bounds.acceleration), float(bounds.jerk)
    jerk = ((wanted - last.velocity) / CYCLE_TIME - last.acceleration) / CYCLE_TIME
    acceleration, size = last.acceleration, float(np.linalg.norm(jerk))
    if size > _SMALLEST:
        acceleration = acceleration + jerk / size * min(size, steepest) * CYCLE_TIME
    size = float(np.linalg.norm(acceleration))
    if size <= _SMALLEST:
        return last.velocity
    direction = acceleration / size
    along = float(direction @ last.velocity)  # The room is up to where this direction meets the sphere of the bound.
    room = np.sqrt(max(along**2 - float(last.velocity @ last.velocity) + float(bounds.velocity) ** 2, 0.0)) - along
    return last.velocity + direction * min(size, steepest / most * room, most) * CYCLE_TIME


class LibfrankaFilter:
    """Low pass and rate limiter, in this order, as libfranka's loop runs them with `limit_rate`.

    Args:
        limits: Bounds of the arm, from which libfranka's are computed.
        lost_cycles: See `LOST_CYCLES`.
        cut_off: Cut-off frequency of the low pass, [Hz]; None: no low pass.

    Raises:
        InvalidValueError: The frequency is not above 0.
    """

    def __init__(self, limits: Limits, lost_cycles: float, cut_off: float | None) -> None:
        joint, c, elbow = limits.joint, limits.cartesian, limits.arm_angle
        self._k = smoothing(FILTER_OFF if cut_off is None else cut_off)
        self._limits: JointLimits = joint
        self._reserve = lost_cycles * CYCLE_TIME
        self._joint = self._bounds(joint.velocity, joint.acceleration, joint.jerk)
        self._translation = self._bounds(c.translation_velocity, c.translation_acceleration, c.translation_jerk)
        rotation = self._bounds(c.rotation_velocity, c.rotation_acceleration, c.rotation_jerk)
        self._rotation = RateBounds(*(_POSE_ROTATION * bound for bound in rotation))
        self._elbow = None if elbow is None else self._bounds(elbow.velocity, elbow.acceleration, elbow.jerk)
        self._torque_step = (joint.torque_rate - MARGIN) * CYCLE_TIME
        self._sent: Command | None = None
        self._rates: list[Rates] = []

    def begin(self, command: Command) -> None:
        """Starts at standstill at the first command of a motion; torques start at zero."""
        self._sent = command
        if isinstance(command, JointTorque):
            self._sent = JointTorque(np.zeros_like(command.tau))
        elif isinstance(command, JointPosition):
            self._rates = [_standstill(len(command.q))]
        else:
            self._rates = [_standstill(3), _standstill(3), _standstill(1)]

    def step(self, command: Command) -> Command:
        """Returns the command, or as much of it as the filter and the bounds allow in this cycle."""
        sent = self._sent
        if isinstance(command, JointTorque) and isinstance(sent, JointTorque):
            change = np.clip(low_pass(command.tau, sent.tau, self._k) - sent.tau, -self._torque_step, self._torque_step)
            self._sent = JointTorque(sent.tau + change, command.finished)
        elif isinstance(command, JointPosition) and isinstance(sent, JointPosition):
            self._sent = JointPosition(self._angles(command.q, sent.q), command.finished)
        elif isinstance(command, CartesianPosition) and isinstance(sent, CartesianPosition):
            T = self._pose(command.T_base_tool, sent.T_base_tool)
            self._sent = CartesianPosition(T, self._elbow_angle(command.psi, sent.psi), command.finished)
        assert self._sent is not None  # A motion has commands of one kind.
        return self._sent

    def _angles(self, q: Array, q_sent: Array) -> Array:
        lower, upper = self._limits.velocity_bounds(q_sent)
        less = MARGIN + self._reserve * self._joint.acceleration
        wanted = (low_pass(q, q_sent, self._k) - q_sent) / CYCLE_TIME
        return q_sent + self._follow(0, limit_rate(wanted, self._rates[0], lower + less, upper - less, self._joint))

    def _pose(self, T: Matrix, T_sent: Matrix) -> Matrix:
        T = low_pass_pose(T, T_sent, self._k) if self._k < 1.0 else T
        shift = (T[:3, 3] - T_sent[:3, 3]) / CYCLE_TIME
        turn = rotation_vector(T_sent[:3, :3], T[:3, :3]) / CYCLE_TIME
        following = np.eye(4)
        step = self._follow(0, limit_vector_rate(shift, self._rates[0], self._translation))
        following[:3, 3] = T_sent[:3, 3] + step
        step = self._follow(1, limit_vector_rate(turn, self._rates[1], self._rotation))
        following[:3, :3] = rotation_matrix(step) @ T_sent[:3, :3]
        return following

    def _elbow_angle(self, psi: float | None, sent: float | None) -> float | None:
        if psi is None or sent is None or self._elbow is None:
            return psi
        wanted = np.array([self._k * (psi - sent) / CYCLE_TIME])
        highest = float(self._elbow.velocity)
        return sent + float(self._follow(2, limit_rate(wanted, self._rates[2], -highest, highest, self._elbow))[0])

    def _follow(self, signal: int, velocity: Array) -> Array:
        """Remembers the velocity of a command; returns its step."""
        acceleration = (velocity - self._rates[signal].velocity) / CYCLE_TIME
        self._rates[signal] = Rates(velocity, acceleration)
        return velocity * CYCLE_TIME

    def _bounds(self, velocity: float | Array, acceleration: float | Array, jerk: float | Array) -> RateBounds:
        most = acceleration - MARGIN
        return RateBounds(velocity - MARGIN - self._reserve * most, most, jerk - MARGIN)


def _standstill(size: int) -> Rates:
    return Rates(np.zeros(size), np.zeros(size))
