"""Filters of a callback's commands: a low pass, and a limiter of velocity, acceleration and jerk.

ROKAE's client always filters commands at 100 Hz and ends a motion before the filter has settled. Here both filters are
options of `RobotSession.control`, and a motion ends when the sent command has reached the last one. A driver may have
those of its maker's client library instead (`StreamingDriver.open_filter`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.limits import Limits
from rcilab.core.rotation import rotation_matrix, rotation_vector
from rcilab.motion import LIMIT_MARGIN
from rcilab.motion.end_velocity import followable_bounds
from rcilab.motion.low_pass import low_pass, low_pass_pose, smoothing

_CATCH_UP = 300.0  # [1/s] Largest rate at which a lag decays: about three cycles, slower than the 1 kHz sampling.
_BRAKING = 0.7  # Part of the acceleration used for braking: the rest covers the delay of a limited jerk. Tuning value.
_LOOKAHEAD = (
    4.0  # [cycles] In which the deceleration builds up that a decreasing velocity bound requires. Tuning value.
)
_HALVINGS = 16  # Steps of a search: 1/65536 of the acceleration.
_ROUNDING = 1.0 + 1e-6
_NEAR = 1e-7  # [rad, m or N m] In one cycle that is a jerk of 100 units/s^3.
_ARRIVED = 1e-12  # [rad or m] Rounding.


class Bounds(NamedTuple):
    """Bounds of a rate limiter: numbers for a vector's length, or arrays with one element per coordinate."""

    velocity: float | Array
    acceleration: float | Array
    jerk: float | Array


class SignalState(NamedTuple):
    """Velocity and acceleration of a limited signal, by backward differences at 1 ms."""

    velocity: Array
    acceleration: Array
    feed: Array
    """Velocity of the command, within the bound."""


def limit_rate(lag: Array, command_velocity: Array, last: SignalState, bounds: Bounds) -> SignalState:
    """Returns the next step of coordinates with independent bounds.

    A stream inside the bounds passes unchanged. After a jump, each coordinate approaches the command as fast as the
    bounds allow and brakes in time (a jump of a few mrad is overshot by part of it). The vendor's limiter, that of
    libfranka's `limitRate`, clips velocity, acceleration and jerk and overshoots.

    Args:
        lag: Difference of the command from the last value, shape (n,).
        command_velocity: Velocity of the command over this cycle, shape (n,).
        last: The last step.
        bounds: Each a number or of shape (n,).
    """
    feed = np.clip(command_velocity, -bounds.velocity, bounds.velocity)
    remaining = lag - feed * CYCLE_TIME
    closing, slope = _closing_speed(np.abs(remaining), bounds)
    wanted = feed + np.sign(remaining) * closing
    velocity = np.clip(wanted, -bounds.velocity, bounds.velocity)
    is_closing = velocity == wanted  # Otherwise it moves with the bound.
    # Along the command, and along the closing speed, which decreases with the distance.
    along = (feed - last.feed) / CYCLE_TIME - np.where(is_closing, slope, 0.0) * (last.velocity - last.feed)
    error = velocity - last.velocity - along * CYCLE_TIME
    size = np.abs(error)
    most = np.where(is_closing, _max_acceleration(size, bounds.jerk), np.inf)
    acceleration = along + np.sign(error) * np.minimum(size / CYCLE_TIME, most)
    highest = np.minimum(_max_acceleration(bounds.velocity - last.velocity, bounds.jerk), bounds.acceleration)
    lowest = -np.minimum(_max_acceleration(bounds.velocity + last.velocity, bounds.jerk), bounds.acceleration)
    acceleration = np.minimum(np.maximum(acceleration, lowest), highest)
    step = bounds.jerk * CYCLE_TIME
    acceleration = np.clip(acceleration, last.acceleration - step, last.acceleration + step)
    return SignalState(last.velocity + acceleration * CYCLE_TIME, acceleration, feed)


def limit_vector_rate(lag: Array, command_velocity: Array, last: SignalState, bounds: Bounds) -> SignalState:
    """Returns the next step of a vector with bounds of its length: the tool's translation, or its rotation.

    Like `limit_rate`, with shapes (3,) and numbers as bounds.
    """
    feed = _limit_length(command_velocity, bounds.velocity)
    remaining = lag - feed * CYCLE_TIME
    length = float(np.linalg.norm(remaining))
    closing = remaining * (float(_closing_speed(length, bounds)[0]) / length) if length > 0.0 else remaining
    velocity = _limit_length(feed + closing, bounds.velocity)
    goal = _limit_length((velocity - last.velocity) / CYCLE_TIME, bounds.acceleration)
    # Reducing the acceleration is always allowed; the search goes from there towards the goal.
    size = float(np.linalg.norm(last.acceleration))
    ease = last.acceleration * max(0.0, 1.0 - float(bounds.jerk) * CYCLE_TIME / size) if size > 0.0 else np.zeros(3)
    low, high = 0.0, 1.0
    if _is_allowed(goal, last, bounds):
        low = 1.0
    else:
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _is_allowed(ease + middle * (goal - ease), last, bounds):
                low = middle
            else:
                high = middle
    acceleration = ease + low * (goal - ease)
    return SignalState(last.velocity + acceleration * CYCLE_TIME, acceleration, feed)


class LowPass:
    """The first-order filter of the vendor's client, for every kind of command.

    Args:
        cut_off: Cut-off frequency, [Hz]; the vendor's client uses 100 by default.
        period: Cycles from one command to the next.

    Raises:
        InvalidValueError: The frequency is not above 0.
    """

    def __init__(self, cut_off: float, period: int = 1) -> None:
        self._k = smoothing(cut_off, period)
        self._last: Command | None = None

    def begin(self, command: Command) -> None:
        """Starts at standstill at the first command of a motion."""
        self._last = command

    def step(self, command: Command) -> Command:
        """Returns the filtered command."""
        last, k = self._last, self._k
        if isinstance(command, JointPosition) and isinstance(last, JointPosition):
            command = JointPosition(low_pass(command.q, last.q, k), command.finished)
        elif isinstance(command, JointTorque) and isinstance(last, JointTorque):
            command = JointTorque(low_pass(command.tau, last.tau, k), command.finished)
        elif isinstance(command, CartesianPosition) and isinstance(last, CartesianPosition):
            psi = command.psi
            if psi is not None and last.psi is not None:
                psi = last.psi + k * (psi - last.psi)
            command = CartesianPosition(low_pass_pose(command.T_base_tool, last.T_base_tool, k), psi, command.finished)
        self._last = command
        return command


class RateLimiter:
    """Keeps every command inside the arm's limits of velocity, acceleration and jerk, or of torque rate.

    Poses are kept inside the tool's limits, as in the vendor's client; a jump of the tool may still exceed the limits
    of the joints.

    Args:
        limits: Bounds of the arm, from the manual's table or the vendor's (`cartesian_limits`); `LIMIT_MARGIN` is kept.
        period: Cycles from one command to the next. Everything here is per cycle of 1 ms, so bounds of a longer period
            are scaled: what a command may change by is the same.
    """

    def __init__(self, limits: Limits, period: int = 1) -> None:
        joint, c, psi = limits.joint, limits.cartesian, limits.arm_angle
        self._limits = joint
        self._period = period
        self._joint = _bounds(joint.velocity, joint.acceleration, joint.jerk, period)
        self._translation = _bounds(c.translation_velocity, c.translation_acceleration, c.translation_jerk, period)
        self._rotation = _bounds(c.rotation_velocity, c.rotation_acceleration, c.rotation_jerk, period)
        self._psi = None if psi is None else _bounds(psi.velocity, psi.acceleration, psi.jerk, period)
        self._torque_step = LIMIT_MARGIN * joint.torque_rate * period * CYCLE_TIME
        self._command: Command | None = None  # The last one before the limiter.
        self._sent: Command | None = None
        self._rates: list[SignalState] = []

    def begin(self, command: Command) -> None:
        """Starts at standstill at the first command of a motion; torques start at zero."""
        self._command = self._sent = command
        if isinstance(command, JointPosition):
            self._rates = [_standstill(len(command.q))]
        elif isinstance(command, JointTorque):
            self._sent = JointTorque(np.zeros_like(command.tau))
        else:
            self._rates = [_standstill(3), _standstill(3), _standstill(1)]

    def step(self, command: Command) -> Command:
        """Returns the command, or as much of it as the limits allow in this cycle."""
        before, sent = self._command, self._sent
        self._command = command
        if isinstance(command, JointTorque) and isinstance(sent, JointTorque):
            change = np.clip(command.tau - sent.tau, -self._torque_step, self._torque_step)
            self._sent = JointTorque(_snapped(sent.tau + change, command.tau), command.finished)
        elif (
            isinstance(command, JointPosition) and isinstance(before, JointPosition) and isinstance(sent, JointPosition)
        ):
            command_velocity = (command.q - before.q) / CYCLE_TIME
            lag = command.q - sent.q
            bounds = self._joint if self._limits.near_ends is None else self._bounds_near_ends(sent.q, lag)
            self._rates[0] = limit_rate(lag, command_velocity, self._rates[0], bounds)
            q = sent.q + self._rates[0].velocity * CYCLE_TIME
            self._sent = JointPosition(_snapped(q, command.q), command.finished)
        elif isinstance(before, CartesianPosition) and isinstance(sent, CartesianPosition):
            assert isinstance(command, CartesianPosition)  # A motion has commands of one kind.
            self._sent = CartesianPosition(
                self._pose(command.T_base_tool, before.T_base_tool, sent.T_base_tool),
                self._arm_angle(command.psi, before.psi, sent.psi),
                command.finished,
            )
        assert self._sent is not None
        return self._sent

    def _bounds_near_ends(self, q: Array, lag: Array) -> Bounds:
        """Returns the bounds of the joints, with those of the velocity some cycles ahead."""
        joint, last = self._joint, self._rates[0].velocity
        ahead = q + _LOOKAHEAD * CYCLE_TIME * last
        lower, upper = followable_bounds(self._limits, _BRAKING * self._limits.acceleration, ahead)
        velocity = np.where(np.where(last == 0.0, lag, last) < 0.0, -lower, upper)
        return joint._replace(velocity=LIMIT_MARGIN * velocity * self._period)

    def _pose(self, T: Array, T_before: Array, T_sent: Array) -> Array:
        p, p_sent = T[:3, 3], T_sent[:3, 3]
        R, R_sent = T[:3, :3], T_sent[:3, :3]
        command_velocity = (p - T_before[:3, 3]) / CYCLE_TIME
        self._rates[0] = limit_vector_rate(p - p_sent, command_velocity, self._rates[0], self._translation)
        command_velocity = rotation_vector(T_before[:3, :3], R) / CYCLE_TIME
        self._rates[1] = limit_vector_rate(rotation_vector(R_sent, R), command_velocity, self._rates[1], self._rotation)
        T = np.eye(4)
        T[:3, 3] = _snapped(p_sent + self._rates[0].velocity * CYCLE_TIME, p)
        T[:3, :3] = _snapped(rotation_matrix(self._rates[1].velocity * CYCLE_TIME) @ R_sent, R)
        return T

    def _arm_angle(self, psi: float | None, before: float | None, sent: float | None) -> float | None:
        if psi is None or before is None or sent is None or self._psi is None:
            return psi
        command_velocity = np.array([(psi - before) / CYCLE_TIME])
        self._rates[2] = limit_rate(np.array([psi - sent]), command_velocity, self._rates[2], self._psi)
        limited = sent + float(self._rates[2].velocity[0]) * CYCLE_TIME
        return psi if abs(limited - psi) <= _ARRIVED else limited


def is_near(sent: Command, requested: Command) -> bool:
    """Returns whether a sent command is so close to the requested one that the difference is a small jerk."""
    if isinstance(sent, CartesianPosition) and isinstance(requested, CartesianPosition):
        off = float(np.abs(sent.T_base_tool - requested.T_base_tool).max())
        return max(off, abs((sent.psi or 0.0) - (requested.psi or 0.0))) <= _NEAR
    if isinstance(sent, JointTorque) and isinstance(requested, JointTorque):
        return float(np.abs(sent.tau - requested.tau).max()) <= _NEAR
    if isinstance(sent, JointPosition) and isinstance(requested, JointPosition):
        return float(np.abs(sent.q - requested.q).max()) <= _NEAR
    return True


def _closing_speed(distance: Array | float, bounds: Bounds) -> tuple[Array | float, Array | float]:
    """Returns the largest speed from which there is time to brake within a distance, and its slope over the distance.

    The stopping distance from speed v is v^2 / (2 a) + v a / (2 j), with the jerk's ramps (exact for v >= a^2 / j).
    """
    a = _BRAKING * bounds.acceleration
    ramp = a * a / (2.0 * bounds.jerk)
    speed = np.sqrt(ramp * ramp + 2.0 * a * distance) - ramp
    near = _CATCH_UP * distance
    return np.minimum(near, speed), np.where(near <= speed, _CATCH_UP, a / (speed + ramp))


def _max_acceleration(room: Array, jerk: float | Array) -> Array:
    """Returns the largest acceleration with which a velocity does not exceed its bound, `room` above it.

    With acceleration a in one cycle and a decrease by the jerk in each following one, the velocity grows by
    a h / 2 + a^2 / (2 j).
    """
    half = 0.5 * CYCLE_TIME
    return jerk * (np.sqrt(half * half + 2.0 * np.maximum(room, 0.0) / jerk) - half)


def _is_allowed(acceleration: Array, last: SignalState, bounds: Bounds) -> bool:
    """Returns whether an acceleration keeps the bounds, now and while it decreases to zero from here."""
    size = float(np.linalg.norm(acceleration))
    change = float(np.linalg.norm(acceleration - last.acceleration))
    reached = last.velocity + acceleration * (0.5 * CYCLE_TIME + 0.5 * size / float(bounds.jerk))
    return (
        size <= float(bounds.acceleration) * _ROUNDING
        and change <= float(bounds.jerk) * CYCLE_TIME * _ROUNDING
        and float(np.linalg.norm(reached)) <= float(bounds.velocity) * _ROUNDING
    )


def _bounds(velocity: float | Array, acceleration: float | Array, jerk: float | Array, period: int) -> Bounds:
    return Bounds(
        LIMIT_MARGIN * velocity * period, LIMIT_MARGIN * acceleration * period**2, LIMIT_MARGIN * jerk * period**3
    )


def _standstill(size: int) -> SignalState:
    return SignalState(np.zeros(size), np.zeros(size), np.zeros(size))


def _limit_length(vector: Array, longest: float | Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector if length <= longest else vector * (float(longest) / length)


def _snapped(x: Array, u: Array) -> Array:
    """Returns the command itself if the sent value differs from it only by rounding."""
    return u if float(np.abs(x - u).max()) <= _ARRIVED else x
