"""Motions of the tool along lines, arcs and circles, and of the elbow alone, as joint angles on the 1 ms grid."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointVector, as_number, as_vector, described
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError, SingularError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.bounds import require_inside
from rcilab.motion.joint import DEFAULT_SPEED, JOINT_LAWS, MIN_SPEED, JointLaw
from rcilab.motion.motion import Motion, stationary_motion
from rcilab.motion.path import (
    ArcOrientation,
    CircleOrientation,
    ElbowDirection,
    Path,
    build_arc,
    build_circle,
    build_line,
    circle_through,
)
from rcilab.motion.path_infeasibility import path_error, solve_path
from rcilab.motion.path_timing import curve_through, plan_along, require_path
from rcilab.motion.piecewise import join_pieces
from rcilab.motion.s_curve import plan_s_curve
from rcilab.motion.time_parametrization import TimeParametrization
from rcilab.motion.torque_rate import plan_within_torque_rate

"""Time law of a path: the same as for a joint motion; the S profile is that of MOVEL (manual 3.5)."""


_ELBOW_DIRECTIONS: tuple[ElbowDirection, ...] = get_args(ElbowDirection)

S_PROFILE_PATH_VELOCITY = 1.0
"""Speed of the vendor's path generator at speed 1, [m/s]; of a pure rotation, [rad/s]."""
S_PROFILE_PATH_ACCELERATION = 2.5
"""Acceleration of the vendor's path generator at speed 1, [m/s^2] or [rad/s^2]."""

_JUMP_FACTOR = 4.0
"""A joint that turns more in a cycle than this factor times its velocity limit and the tool's rotation allow changes
branches at a singularity. Tuning value; slower motions are planned, and `check` checks them."""
_LEVER_LENGTH = 0.1
"""Length that converts the tool's translation to a rotation, [m]; tuning value."""


def plan_line(
    model: RobotModel,
    start: ArrayLike,
    goal: Pose,
    *,
    speed: float = DEFAULT_SPEED,
    psi: float | None = None,
    law: JointLaw = "jerk_limited",
) -> Motion:
    """Returns the motion on which the tool moves in a straight line from its pose at `start` to `goal`.

    Position and arm angle are linear in the path length, the orientation is a slerp. Starts and ends at standstill.

    Args:
        model: The arm, with its tool.
        start: Joint angles at the start, shape (n,), [rad]. Plan from the commanded angles (`state.q_c`).
        goal: Pose of the tool in base at the end.
        speed: Part of the velocity and acceleration limits to use, or of those of the vendor's generator, from
            `MIN_SPEED` = 0.001 to 1.
        psi: Arm angle of a 7-axis arm at the end, from -pi to pi, [rad]; it goes there in the shorter direction,
            across +-pi too. None holds the one of the start.
        law: "jerk_limited": as fast as the limits on joints, tool and arm angle allow, with a margin of `LIMIT_MARGIN`,
            as the controller checks them; the jerk limits are used in full. "torque_rate_limited": the same with lower
            jerk limits, see `plan_joint`. "s_profile": the vendor's MOVEL, with at most `speed` times 1 m/s and 2.5
            m/s^2. A rotation on a short path is therefore fast, and that profile ignores the limits of joints and tool:
            use `rcilab.check`. Unlike the vendor's, a line from a pose to itself is a motion of zero length, and a pure
            rotation about any axis uses its angle as path length.

    Raises:
        PlanningError: A pose on the path is out of reach, or a joint limit or a singularity is in the way; the message
            says where and why.
        InvalidValueError: An argument is of the wrong shape or kind, not finite, or out of range.
    """
    q = _require_start(model, start, law)
    return plan_path(model, q, build_line(model.forward(q), goal, *arm_angles(model, q, psi, "shorter")), speed, law)


def plan_arc(
    model: RobotModel,
    start: ArrayLike,
    via: Pose,
    goal: Pose,
    *,
    speed: float = DEFAULT_SPEED,
    psi: float | None = None,
    law: JointLaw = "jerk_limited",
    orientation: ArcOrientation = "through_via",
) -> Motion:
    """Returns the motion on which the tool moves on the arc from its pose at `start` through `via` to `goal`.

    As on the vendor's MOVEC, the path length is that of the arc.

    Args:
        model: The arm, with its tool.
        start: Joint angles at the start, shape (n,), [rad]. Plan from the commanded angles (`state.q_c`).
        via: A pose on the arc.
        goal: Pose of the tool in base at the end.
        speed: Part of the velocity and acceleration limits to use, or of those of the vendor's generator, from
            `MIN_SPEED` = 0.001 to 1.
        psi: Arm angle of a 7-axis arm at the end, from -pi to pi, [rad]; it goes there in the shorter direction,
            across +-pi too. None holds the one of the start.
        law: "jerk_limited", "torque_rate_limited" or "s_profile", see `plan_line`.
        orientation: "through_via": the tool passes exactly the orientation of `via` where it passes its position, and
            turns there and on in the shorter direction, with continuous angular velocity and acceleration.
            "start_to_goal": it turns by slerp from start to goal, and the orientation of `via` is ignored, as on the
            vendor's MOVEC.

    Raises:
        PlanningError: The three positions do not define a circle, a pose on the path is out of reach, or a joint limit
            or a singularity is in the way; the message says where and why.
        InvalidValueError: An argument is of the wrong shape or kind, not finite, or out of range.
    """
    q = _require_start(model, start, law)
    angles = arm_angles(model, q, psi, "shorter")
    return plan_path(model, q, build_arc(model.forward(q), via, goal, *angles, orientation=orientation), speed, law)


def plan_circle(
    model: RobotModel,
    start: ArrayLike,
    *,
    through: tuple[Pose, Pose] | None = None,
    center: ArrayLike | None = None,
    axis: ArrayLike | None = None,
    angle: float = math.tau,
    speed: float = DEFAULT_SPEED,
    psi: float | None = None,
    law: JointLaw = "jerk_limited",
    orientation: CircleOrientation = "held",
) -> Motion:
    """Returns the motion on which the tool moves on a circle.

    The circle is given either by two more poses on it (`through`; only their positions count), or by `center` and
    `axis`.

    Args:
        model: The arm, with its tool.
        start: Joint angles at the start, shape (n,), [rad]. Plan from the commanded angles (`state.q_c`).
        through: The second and the third pose on the circle, in the order of the motion.
        center: Centre of the circle in base, shape (3,), [m].
        axis: Direction of its axis in base, shape (3,), of any length; the tool goes around it by the right-hand rule.
        angle: How far, more than 0 and up to 2 pi (all around), [rad].
        speed: Part of the velocity and acceleration limits to use, or of those of the vendor's generator, from
            `MIN_SPEED` = 0.001 to 1.
        psi: Arm angle of a 7-axis arm at the end, from -pi to pi, [rad]; it goes there in the shorter direction,
            across +-pi too. None holds the one of the start.
        law: "jerk_limited", "torque_rate_limited" or "s_profile", see `plan_line`.
        orientation: "held": that of the start, constant. "turning": the tool turns with the circle, about its axis
            and by the same angle, so that the same side of it faces the centre.

    Raises:
        PlanningError: The positions do not define a circle, start is not on it, a pose on the path is out of reach, or
            a joint limit or a singularity is in the way; the message says where and why.
        InvalidValueError: An argument is missing, of the wrong shape or kind, not finite, or out of range.
    """
    q = _require_start(model, start, law)
    T = model.forward(q)
    if through is not None:
        if center is not None or axis is not None:
            raise InvalidValueError("center", described(center), "and axis must not be combined with through")
        if not isinstance(through, tuple) or len(through) != 2:  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InvalidValueError("through", described(through), "must be a tuple of two poses on the circle")
        center, axis = circle_through(T, *through)
    elif center is None or axis is None:
        raise InvalidValueError("center", described(center), "and axis are both required, or two poses as through")
    angles = arm_angles(model, q, psi, "shorter")
    return plan_path(model, q, build_circle(T, center, axis, angle, *angles, orientation=orientation), speed, law)


def plan_nullspace(
    model: RobotModel,
    start: ArrayLike,
    psi: float,
    *,
    speed: float = DEFAULT_SPEED,
    law: JointLaw = "jerk_limited",
    way: ElbowDirection = "shorter",
) -> Motion:
    """Returns the motion on which the tool keeps its pose at `start` and only the elbow moves, to arm angle `psi`.

    Args:
        model: A 7-axis arm, with its tool.
        start: Joint angles at the start, shape (7,), [rad]. Plan from the commanded angles (`state.q_c`).
        psi: Arm angle at the end, from -pi to pi, [rad].
        speed: Part of the velocity and acceleration limits to use, or of those of the vendor's generator, from
            `MIN_SPEED` = 0.001 to 1.
        law: "jerk_limited", "torque_rate_limited" or "s_profile", see `plan_line`.
        way: Direction of the elbow, "shorter" or "longer"; both may cross +-pi, where the arm angle wraps around. The
            longer direction to the arm angle of the start is a full turn.

    Raises:
        PlanningError: The arm angle has no meaning at the start, or a joint limit or a singularity is in the way; the
            message says where and why, and whether the other direction is free.
        InvalidValueError: The arm has 6 axes, or an argument is of the wrong shape or kind, not finite, or out of
            range.
    """
    q = _require_start(model, start, law)
    if way not in _ELBOW_DIRECTIONS:
        raise InvalidValueError("way", described(way), f"is unknown; known: {', '.join(_ELBOW_DIRECTIONS)}")
    T, psi = model.forward(q), as_number(psi, "psi", "rad")
    try:
        return plan_path(model, q, build_line(T, T, *arm_angles(model, q, psi, way)), speed, law)
    except PlanningError as error:
        if error.share is None:
            raise
        other: ElbowDirection = "longer" if way == "shorter" else "shorter"
        try:
            require_path(model, q, build_line(T, T, *arm_angles(model, q, psi, other)))
        except PlanningError:
            advice = f"the {other} direction is not free either; model.feasible_arcs returns the feasible arm angles"
        else:
            advice = f'the {other} direction is free: way="{other}"'
        raise PlanningError(f"{error}; {advice}", share=error.share).coded(error.code, **error.facts) from error


def arm_angles(
    model: RobotModel, q: JointVector, psi: float | None, way: ElbowDirection | None = None
) -> tuple[float | None, float | None]:
    """Returns the arm angles at the start and at the end of a path from q, [rad]; None twice for a 6-axis arm.

    Args:
        model: The arm.
        q: Joint angles at the start, shape (n,), [rad].
        psi: Arm angle at the end, from -pi to pi, [rad]; None holds the one of the start.
        way: Direction; the angle at the end is beyond +-pi if it crosses that. None is the direction that never
            crosses it, as in the vendor's generator.

    Raises:
        PlanningError: The arm angle has no meaning at the start.
        InvalidValueError: `psi` is not within +-pi, or not in the range of the joint whose angle it is; or the arm has
            no arm angle.
    """
    if not model.redundancy:
        if psi is not None:
            problem = f"has no meaning for {model.name}: a 6-axis arm has no arm angle"
            raise InvalidValueError("psi", psi, problem).coded("six_axes", model=model.name)
        return None, None
    try:
        current = model.arm_angle(q)
    except SingularError as error:
        failure = PlanningError(f"at the start {error}; move to a bent pose in joint space first")
        raise failure.coded("stretched_start") from error
    requested = current if psi is None else as_number(psi, "psi", "rad")
    if not abs(requested) <= math.pi:
        raise InvalidValueError("psi", psi, "must be from -pi to pi [rad]").coded("span", low="-pi", high="pi")
    joint = model.redundancy.joint
    if joint is not None and psi is not None:
        low, high = (float(bound[joint - 1]) for bound in (model.limits.joint.lower, model.limits.joint.upper))
        if not low <= requested <= high:
            problem = f"is the angle of joint {joint} and must be from {low:g} to {high:g} [rad]"
            raise InvalidValueError("psi", psi, problem).coded("span", low=f"{low:g}", high=f"{high:g}")
    if way is None or psi is None:
        return current, requested
    shorter = math.remainder(requested - current, math.tau)
    turn = shorter if way == "shorter" else shorter - math.copysign(math.tau, shorter)
    return current, requested + math.tau * round((current + turn - requested) / math.tau)


def schedule(path: Path, speed: float) -> Array:
    """Returns the shares of the path length, 0 to 1, at every cycle of the S profile, shape (N,).

    Args:
        path: The path.
        speed: Part of the generator's velocity and acceleration to use, from `MIN_SPEED` to 1.

    Raises:
        InvalidValueError: The speed is out of range.
    """
    return _s_profile_timing(path, speed).s


def follow_path(model: RobotModel, q: JointVector, path: Path, speed: float) -> Motion:
    """Returns the motion along a path by the S profile: the inverse of every pose, without a change of branch.

    Args:
        model: The arm, with its tool.
        q: Joint angles at the start of the path, shape (n,), [rad]: they choose the branch.
        path: The path.
        speed: Part of the generator's velocity and acceleration to use, from `MIN_SPEED` to 1.

    Raises:
        PlanningError: A pose on the path is out of reach, a joint limit or a singularity is in the way.
        InvalidValueError: The speed is out of range.
    """
    require_inside("start", q, model.limits.joint)
    law = _s_profile_timing(path, speed)
    shares = law.s
    if len(shares) == 1:
        return stationary_motion(q, law="s_profile", speed=speed)
    whole_turn = path.turn + (path.distance / _LEVER_LENGTH if path.unit == "m" else path.distance)
    longest = _JUMP_FACTOR * (model.limits.joint.velocity * CYCLE_TIME + whole_turn * np.diff(shares)[:, np.newaxis])
    rows, infeasible = solve_path(model, q, path, shares, longest, "within one cycle")
    if infeasible is not None:
        when = f"t = {infeasible.row * CYCLE_TIME:.3f} s, "
        raise path_error(path, float(shares[infeasible.row]), infeasible.reason, when)
    return Motion(polynomial=curve_through(model, path, rows, law), goal=rows[-1], law="s_profile", speed=speed)


def _s_profile_timing(path: Path, speed: float) -> TimeParametrization:
    speed = as_number(speed, "speed")
    if not MIN_SPEED <= speed <= 1.0:
        raise InvalidValueError(
            "speed", speed, f"must be from {MIN_SPEED:g} to 1: the part of the generator's speed to use"
        )
    if path.distance == 0.0:
        return TimeParametrization(np.ones(1), np.zeros(1), np.zeros(1))
    curve = plan_s_curve(path.distance, S_PROFILE_PATH_VELOCITY * speed, S_PROFILE_PATH_ACCELERATION * speed)
    starts, coefficients = curve.pieces()
    profile = join_pieces(starts[np.newaxis], coefficients[np.newaxis], curve.duration)
    times = np.arange(math.ceil(curve.duration / CYCLE_TIME - 1e-9) + 1) * CYCLE_TIME
    shares, du, ddu = (profile.sample(times, order)[:, 0] / path.distance for order in range(3))
    shares[-1], du[-1], ddu[-1] = 1.0, 0.0, 0.0
    return TimeParametrization(np.clip(shares, 0.0, 1.0), du, ddu)


def plan_path(model: RobotModel, q: JointVector, path: Path, speed: float, law: JointLaw) -> Motion:
    """Returns the motion along a path with a time law.

    Args:
        model: The arm, with its tool.
        q: Joint angles at the start of the path, shape (n,), [rad]: they choose the branch.
        path: The path.
        speed: Part of the limits to use, or of those of the vendor's generator, from `MIN_SPEED` to 1.
        law: See `plan_line`.

    Raises:
        PlanningError: A pose on the path is out of reach, or a joint limit or a singularity is in the way.
    """
    if law == "s_profile":
        return follow_path(model, q, path, speed)
    if law == "jerk_limited":
        return plan_along(model, q, path, speed)
    motion = plan_within_torque_rate(
        model, lambda arm: plan_along(arm, q, path, speed), lambda planned: planned.polynomial
    )
    return replace(motion, law=law)


def _require_start(model: RobotModel, start: ArrayLike, law: str) -> JointVector:
    require_model(model)
    if law not in JOINT_LAWS:
        raise InvalidValueError("law", described(law), f"is unknown for a path; known: {', '.join(JOINT_LAWS)}")
    q = as_vector(start, model.n, "start", "rad")
    require_inside("start", q, model.limits.joint)
    return q
