"""From a wanted twist of the tool to joint velocities, cycle by cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, TypeAlias, get_args

import numpy as np

from rcilab.arrays import Array, Matrix
from rcilab.clock import CYCLE_TIME
from rcilab.errors import InvalidValueError
from rcilab.model import RobotModel
from rcilab.motion import _ruckig
from rcilab.motion.margin import LIMIT_MARGIN

Frame: TypeAlias = Literal["base", "tool"]
"""Axes in which a twist is given; its point is the tool tip in both."""

DAMPED_BELOW = 0.02
"""Singular value of the Jacobian under which a direction is damped, metres and radians taken as they are. A choice:
three to ten percent of all configurations of the xMates are that close to a singularity."""

RAMP_PART = 0.5
"""Part of the joints' acceleration and jerk that changes of the twist use. A choice: the rest is for the bending of the
joints' curves, so that the tool keeps its direction."""

_SAME = 1e-9  # [m/s, rad/s] Twists closer than this are the same.
_SLOWEST = 1e-12  # [rad/s] Below this a joint stands.


class TwistRamp:
    """Leads the tool from the twist it has to the wanted one. Owned by the thread that runs the cycle.

    Attributes:
        is_damped: Whether the last step was so close to a singularity that the tool leaves the twist.

    Args:
        model: The arm, with its tool.
        twist: Wanted twist, shape (6,), linear first, [m/s, rad/s].
        frame: Its axes.
        speed: Part of the tool's velocity limits to use, in (0, 1].

    Raises:
        InvalidValueError: The frame is unknown.
    """

    def __init__(self, model: RobotModel, twist: Array, frame: Frame, speed: float) -> None:
        if frame not in get_args(Frame):
            raise InvalidValueError("frame", frame, f"is unknown; known: {', '.join(get_args(Frame))}")
        tool = model.limits.cartesian
        part = LIMIT_MARGIN * speed
        norms = _norms(twist)
        bounds = (part * tool.translation_velocity, part * tool.rotation_velocity)
        self._cut = min([1.0, *(bound / norm for norm, bound in zip(norms, bounds, strict=True) if norm)])
        self._model = model
        self._in_tool = frame == "tool"
        self._goal = self._cut * twist
        self._start = self._goal
        self._blend: _ruckig.Stepper | None = None  # Made at the first step, when the tool's twist is known.
        self._weight = 0.0
        self._accelerations = (tool.translation_acceleration, tool.rotation_acceleration)
        self._jerks = (tool.translation_jerk, tool.rotation_jerk)
        self.is_damped = False

    def step(
        self,
        q: Sequence[float],
        dq: Sequence[float],
        ddq: Sequence[float],
        room: Sequence[tuple[float, float]],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
    ) -> tuple[list[float], float]:
        """Returns joint velocities to go on with, plain floats, [rad/s], and the part of the wanted twist they give.

        Args:
            q: Joint angles, [rad].
            dq: Joint velocities, [rad/s].
            ddq: Joint accelerations, [rad/s^2].
            room: For each joint how far it may go down and up, [rad].
            velocity: Bounds of the joints, [rad/s].
            acceleration: Bounds, [rad/s^2].
            jerk: Bounds, [rad/s^3].
        """
        angles = np.array(q)
        J = self._model.jacobian(angles)
        if self._in_tool:
            R = self._model.forward(angles).rotation.T
            J = np.concatenate((R @ J[:3], R @ J[3:]))
        inverse, self.is_damped = damped_inverse(J)
        twist = self._goal
        if self._weight != 1.0:
            twist = self._blended(J, inverse, dq, ddq, acceleration, jerk)
        wanted: list[float] = (inverse @ twist).tolist()
        part = _part_inside(wanted, room, velocity, acceleration, jerk)
        return [part * v for v in wanted], part * self._cut

    def _blended(
        self,
        J: Matrix,
        inverse: Matrix,
        dq: Sequence[float],
        ddq: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
    ) -> Array:
        """Returns the twist of this cycle, on the straight line from the twist at the first step to the goal."""
        blend = self._blend
        if blend is None:
            self._start = J @ dq
        change = self._goal - self._start
        norms = _norms(change)
        if max(norms) < _SAME:
            self._weight = 1.0
            return self._goal
        strides = [*(abs(v) for v in (inverse @ change).tolist()), *norms]
        rate = RAMP_PART * _smallest_ratio([*acceleration, *self._accelerations], strides)
        rate_change = RAMP_PART * _smallest_ratio([*jerk, *self._jerks], strides)
        if blend is None:
            # What the tool accelerates along the line already goes on; the rest is for the joints to lose.
            running = float(change @ (J @ ddq)) / float(change @ change)
            blend = self._blend = _ruckig.Stepper([0.0], [0.0], [min(max(running, -rate), rate)], [rate], [rate_change])
        blend.limit([rate], [rate_change])
        blend.towards_velocity([1.0])
        weight = blend.dq[0]
        self._weight = 1.0 if abs(weight - 1.0) < _SAME and abs(blend.ddq[0]) < _SAME * rate_change else weight
        return self._start + weight * change


def damped_inverse(J: Matrix) -> tuple[Matrix, bool]:
    """Returns the matrix that turns a twist into the smallest joint velocities, and whether it is damped.

    Damped least squares with numerical filtering (Maciejewski & Klein 1988; Siciliano et al., Robotics, 2009, 3.5.2):
    a direction whose singular value s is below `DAMPED_BELOW` = s0 is driven by s / (s^2 + s0^2 - s^2) = s / s0^2
    instead of 1 / s, which fades to nothing at the singularity itself; every other direction is exact.

    Args:
        J: Jacobian, shape (6, n).

    Returns:
        Shape (n, 6), and True when a direction was damped.
    """
    A = J @ J.T
    try:
        B = np.linalg.inv(A)
        # The Frobenius norm is no smaller than the largest eigenvalue of the inverse, 1 / s^2 of the smallest s.
        if float(B.ravel() @ B.ravel()) < DAMPED_BELOW**-4:
            return J.T @ B, False
    except np.linalg.LinAlgError:
        pass
    squares, U = np.linalg.eigh(A)
    weights = [1.0 / max(square, DAMPED_BELOW**2) for square in squares.tolist()]
    return J.T @ ((U * weights) @ U.T), bool(squares[0] < DAMPED_BELOW**2)


def _part_inside(
    wanted: Sequence[float],
    room: Sequence[tuple[float, float]],
    velocity: Sequence[float],
    acceleration: Sequence[float],
    jerk: Sequence[float],
) -> float:
    """Returns the part of joint velocities that is inside their bounds and can be taken back before a range ends."""
    moving = [i for i, v in enumerate(wanted) if abs(v) > _SLOWEST]
    if not moving:
        return 1.0
    speeds = [abs(wanted[i]) for i in moving]
    part = min(1.0, _smallest_ratio([velocity[i] for i in moving], speeds))
    # The time at full velocity until the first joint comes to the end of its range, and after this cycle.
    time = _smallest_ratio([room[i][wanted[i] > 0.0] for i in moving], speeds) - part * CYCLE_TIME
    if time <= 0.0:
        return 0.0
    a = RAMP_PART * _smallest_ratio([acceleration[i] for i in moving], speeds)
    j = RAMP_PART * _smallest_ratio([jerk[i] for i in moving], speeds)
    return min(part, _fastest_before(time, a, j))


def _fastest_before(distance: float, a: float, j: float) -> float:
    """Returns the velocity from which a stop at acceleration a and jerk j takes this distance.

    With the trapezoid of accelerations d = v / 2 (v / a + a / j), with the triangle d = v sqrt(v / j).
    """
    if distance < a**3 / j**2:
        return (distance * distance * j) ** (1.0 / 3.0)
    lost = a / j
    return 0.5 * a * (math.sqrt(lost * lost + 8.0 * distance / a) - lost)


def _smallest_ratio(bounds: Sequence[float], values: Sequence[float]) -> float:
    return min(bound / value for bound, value in zip(bounds, values, strict=True) if value > 0.0)


def _norms(twist: Array) -> tuple[float, float]:
    a, b, c, d, e, f = twist.tolist()
    return math.sqrt(a * a + b * b + c * c), math.sqrt(d * d + e * e + f * f)
