"""Motions in joint space: time-optimal and jerk-limited, or by the manual's S profile."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_number, as_vector, require_radians
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.limits import JointLimits, Limits
from rcilab.model.robot_model import require_model
from rcilab.motion import _ruckig
from rcilab.motion.bounds import LIMIT_MARGIN, angle_text, require_inside
from rcilab.motion.end_velocity import plan_within_velocity, require_approachable
from rcilab.motion.motion import Motion, stationary_motion
from rcilab.motion.piecewise import PiecewisePolynomial, join_pieces
from rcilab.motion.s_curve import STANDSTILL_DISTANCE, plan_s_curve, synchronize
from rcilab.motion.torque_rate import plan_within_torque_rate

JointLaw = Literal["jerk_limited", "torque_rate_limited", "s_profile"]
JOINT_LAWS: tuple[JointLaw, ...] = get_args(JointLaw)

DEFAULT_JOINT_SPEED = 0.5
"""Speed of `plan_joint`, and of the plans on page and in notebook at their start."""
DEFAULT_SPEED = 0.2
"""Speed of the other planners, of waypoints and of a session's moves."""
MIN_SPEED = 0.001
"""Lowest speed to plan with: a full turn then takes most of an hour and its rows 200 MB; ruckig cannot represent a
motion of more than about two hours."""

S_PROFILE_VELOCITY = {7: (1.0, 1.0, 1.0, 1.0, 1.25, 1.25, 1.25), 6: (1.0, 1.0, 1.0, 1.25, 1.25, 1.25)}
"""Speeds of the vendor's joint generator at speed 1, by number of joints, [rad/s]; six joints: without joint 3."""
S_PROFILE_ACCELERATION = 2.5
"""Acceleration of the vendor's joint generator at speed 1, every joint, [rad/s^2]."""


class Arm(Protocol):
    """What a planner needs of an arm; implemented by RobotModel and RobotDescription."""

    @property
    def n(self) -> int:
        """Number of joints."""
        ...

    @property
    def limits(self) -> Limits:
        """Bounds of the arm."""
        ...


def plan_joint(
    model: Arm,
    start: ArrayLike,
    goal: ArrayLike,
    *,
    speed: float = DEFAULT_JOINT_SPEED,
    law: JointLaw = "jerk_limited",
    start_velocity: ArrayLike | None = None,
    start_acceleration: ArrayLike | None = None,
) -> Motion:
    """Returns a motion to standstill at `goal` on which all joints start and arrive together.

    Args:
        model: The arm: a RobotModel, or another object with `n` and `limits` if they do not bound the tool.
        start: Joint angles at the start, shape (n,), [rad]. Plan from the commanded angles (`state.q_c`).
        goal: Joint angles at the end, shape (n,), [rad]; strictly inside the limits, as the robot requires.
        speed: Part of the velocity and acceleration limits to use, from `MIN_SPEED` = 0.001 to 1; the
            jerk limit is used in full.
        law: "jerk_limited": the fastest motion inside the limits, with a margin of `LIMIT_MARGIN`. From standstill, or
            moving straight towards or away from `goal`, it is the fastest one on the straight line in joint space; with
            another start velocity or acceleration there is no such line, and the joints arrive together on different
            curves. "torque_rate_limited": the same with jerk limits lowered until the torques change no faster than the
            manual recommends (4.4), which takes some hundredths of a second to plan; it needs a RobotModel.
            "s_profile": exactly the motion of the vendor's joint generator (manual 3.5), which has its own speeds
            and ignores the robot's limits: use `rcilab.check`. A joint with less than 1e-6 rad to move stays, so the
            motion may end that far from `goal`.
        start_velocity: Joint velocities at the start, shape (n,), [rad/s]; None is zero. Derivatives of the running
            motion, not the backward differences that a robot reports (`derivatives_from_differences`).
        start_acceleration: Joint accelerations at the start, shape (n,), [rad/s^2]; None is zero.

    Raises:
        InvalidValueError: Wrong shape, not finite, more than two turns, an unknown law, a speed out of range, or not an
            arm.
        PlanningError: A joint is outside its limits, or cannot stay inside them. Where an arm bounds its velocities
            near the ends of the joints' ranges, or that of the tool (`Limits.joint_tool_velocity`), the motion is
            slowed down as a whole, and refused if that is not enough.
    """
    if not hasattr(model, "limits"):
        require_model(model)
    n, limits = model.n, model.limits.joint
    start = require_radians(as_vector(start, n, "start", "rad"), "start")
    goal = require_radians(as_vector(goal, n, "goal", "rad"), "goal")
    dq = as_vector(np.zeros(n) if start_velocity is None else start_velocity, n, "start_velocity", "rad/s")
    ddq = as_vector(np.zeros(n) if start_acceleration is None else start_acceleration, n, "start_acceleration")
    speed = as_number(speed, "speed")
    if not MIN_SPEED <= speed <= 1.0:
        raise InvalidValueError(
            "speed", speed, f"must be from {MIN_SPEED:g} to 1: the part of the limits to use"
        ).coded("span", low=f"{MIN_SPEED:g}", high="1")
    if not isinstance(law, str) or law not in JOINT_LAWS:
        raise InvalidValueError("law", law, f"is unknown; known: {', '.join(JOINT_LAWS)}")
    require_inside("start", start, limits)
    require_inside("goal", goal, limits)
    if law == "s_profile":
        return _plan_s_profile(limits, start, goal, speed, dq, ddq)
    if law == "jerk_limited":
        return _plan_jerk_limited(model, start, goal, speed, dq, ddq)
    motion = plan_within_torque_rate(
        require_model(model),
        lambda arm: _plan_jerk_limited(arm, start, goal, speed, dq, ddq),
        lambda planned: planned.polynomial,
    )
    return replace(motion, law=law)


def _plan_jerk_limited(
    arm: Arm, start: JointVector, goal: JointVector, speed: float, dq: JointVector, ddq: JointVector
) -> Motion:
    limits = arm.limits.joint
    is_stationary = not dq.any() and not ddq.any()
    if is_stationary and np.array_equal(start, goal):
        return stationary_motion(goal, speed=speed)
    if not is_stationary:
        _require_possible(limits, dq, ddq)
    require_approachable(limits, start, goal)
    scale = LIMIT_MARGIN * speed
    velocity, acceleration, jerk = scale * limits.velocity, scale * limits.acceleration, LIMIT_MARGIN * limits.jerk

    def plan(part: float) -> PiecewisePolynomial:
        return _ruckig.plan_profile(start, goal, part * velocity, part * part * acceleration, jerk, dq, ddq)

    model = require_model(arm) if isfinite(arm.limits.joint_tool_velocity) else None
    curve = plan_within_velocity(limits, plan, model)
    if not is_stationary:  # From standstill every joint moves straight from start to goal, and both are inside.
        _require_room(curve, limits)
    return Motion(polynomial=curve, goal=goal, law="jerk_limited", speed=speed)


def _plan_s_profile(
    limits: JointLimits, start: JointVector, goal: JointVector, speed: float, dq: JointVector, ddq: JointVector
) -> Motion:
    n = len(start)
    if dq.any() or ddq.any():
        raise PlanningError(
            "the S profile starts at standstill; use law='jerk_limited' to plan from a moving start"
        ).coded("s_profile_moving")
    if n not in S_PROFILE_VELOCITY:
        raise PlanningError(
            f"the S profile is defined for arms of 6 or 7 joints, not {n}; use law='jerk_limited'"
        ).coded("s_profile")
    acceleration = S_PROFILE_ACCELERATION * speed
    curves = synchronize(
        [
            plan_s_curve(float(distance), velocity * speed, acceleration)
            for distance, velocity in zip(goal - start, S_PROFILE_VELOCITY[n], strict=True)
        ]
    )
    end = np.where(np.abs(goal - start) > STANDSTILL_DISTANCE, goal, start)
    duration = max(curve.duration for curve in curves)
    if duration == 0.0:
        return stationary_motion(end, law="s_profile", speed=speed)
    pieces = [curve.pieces() for curve in curves]
    coefficients = np.array([table for _, table in pieces])
    coefficients[:, :, 0] += start[:, np.newaxis]
    curve = join_pieces(np.array([starts for starts, _ in pieces]), coefficients, duration)
    return Motion(polynomial=curve, goal=end, law="s_profile", speed=speed)


def _require_possible(limits: JointLimits, dq: JointVector, ddq: JointVector) -> None:
    """Requires a start state inside the limits that some jerk inside the limits keeps inside."""
    for name, value, bound, unit in (
        ("start velocity", dq, limits.velocity, "rad/s"),
        ("start acceleration", ddq, limits.acceleration, "rad/s^2"),
        # While full jerk removes the acceleration, the velocity still changes by ddq^2 / (2 jerk).
        ("velocity shortly after the start", dq + ddq * np.abs(ddq) / (2.0 * limits.jerk), limits.velocity, "rad/s"),
    ):
        beyond = np.flatnonzero(np.abs(value) > bound)
        if beyond.size:
            i = int(beyond[0])
            raise PlanningError(
                f"joint {i + 1}: {name} {value[i]:.4g} {unit} exceeds {bound[i]:.4g} {unit}; "
                f"slow down first (plan_stop works from any state)"
            )


def _require_room(curve: PiecewisePolynomial, limits: JointLimits) -> None:
    """Requires a curve that stays inside the position limits."""
    (lowest, lowest_times), (highest, highest_times) = curve.extremes()
    for angles, times, bounds, outside in (
        (lowest, lowest_times, limits.lower, lowest <= limits.lower),
        (highest, highest_times, limits.upper, highest >= limits.upper),
    ):
        if outside.any():
            i = int(outside.argmax())
            raise PlanningError(
                f"joint {i + 1}: would reach {angle_text(float(angles[i]))} at t = {times[i]:.3f} s, past its limit "
                f"{angle_text(float(bounds[i]))}, because it starts too fast towards it; "
                f"plan with a higher speed (it brakes harder), or stop first and plan from standstill"
            )
