"""Motion commands of a client become targets of the planner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import hypot, inf, isinf, radians, tau
from typing import Any, NamedTuple

import numpy as np

from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.core.spatial import Pose, rotation_between
from rcilab.i18n.translator import Remark
from rcilab.makers.ufactory.bounds import SERVO_PERIOD, SERVO_STEP, TOOL_ROTATION
from rcilab.makers.ufactory.controller.modes import Answer, Command
from rcilab.makers.ufactory.controller.queue_end import absolute_pose, relative_pose, tool_pose
from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.poses import MILLIMETRE
from rcilab.sim.planner import (
    ArcTarget,
    Blend,
    JointSpeed,
    JointTarget,
    LineTarget,
    PauseTarget,
    Planner,
    Refusal,
    RefusalReason,
    Target,
    ToolSpeed,
)

COMMANDS = {
    Function.MOVE_LINE: Command.LINE,
    Function.MOVE_LINE_BLENDED: Command.LINE,
    Function.MOVE_LINE_TOOL: Command.LINE,
    Function.MOVE_LINE_AXIS_ANGLE: Command.LINE,
    Function.MOVE_JOINT: Command.JOINTS,
    Function.MOVE_JOINT_BLENDED: Command.JOINTS,
    Function.MOVE_HOME: Command.JOINTS,
    Function.MOVE_CIRCLE: Command.CIRCLE,
    Function.SLEEP: Command.PAUSE,
    Function.SERVO_JOINT: Command.SERVO_JOINTS,
    Function.SERVO_CARTESIAN: Command.SERVO_POSE,
    Function.SERVO_CARTESIAN_AXIS_ANGLE: Command.SERVO_POSE,
    Function.JOINT_VELOCITY: Command.JOINT_VELOCITY,
    Function.CARTESIAN_VELOCITY: Command.TOOL_VELOCITY,
}
"""The kind of each motion function; that of MOVE_RELATIVE is in the request."""
MOTIONS = frozenset({*COMMANDS, Function.MOVE_RELATIVE})
_PURE_ROTATION = 1e-6  # [m] Below it a line only turns, and its speed counts in degrees.


class Outcome(NamedTuple):
    """What becomes of a motion command."""

    answer: Answer
    is_check: bool = False
    """Whether it was only checked."""
    error: int = 0
    """Of the check: the number of the error that it would raise."""
    is_dropped: bool = False
    """Whether it is lost without an error, above the rate of servo commands."""


class _Flags(NamedTuple):
    """The optional bytes at the end of a line or circle."""

    in_tool: bool = False
    is_rotation_vector: bool = False
    is_check: bool = False


def handle_motion(controller: XArmController, function: Function, values: tuple[Any, ...], task: int) -> Outcome:
    """Carries out a motion command, or returns why not.

    Args:
        controller: The controller.
        function: Of `MOTIONS`.
        values: Of the request.
        task: Number of the command.

    Raises:
        InvalidValueError: A value is not valid.
    """
    command = COMMANDS.get(function)
    if command is None:
        command = Command.JOINTS if values[11] else Command.LINE
    answer = controller.answer_to(command)
    if not answer.is_taken:
        return Outcome(answer)
    if command in (Command.SERVO_JOINTS, Command.SERVO_POSE):
        return _servo(controller, function, values, task, answer)
    if command is Command.JOINT_VELOCITY:
        return _joint_velocity(controller, values, task)
    if command is Command.TOOL_VELOCITY:
        return _tool_velocity(controller, values, task)
    target, is_check = _build_target(controller, function, values, task)
    if is_check:
        return Outcome(answer, is_check=True, error=_check(controller, target))
    if answer is Answer.FOLLOWED:
        _follow(controller, target, task)
    else:
        controller.queue(target)
        _move_end(controller, target)
    return Outcome(answer)


def _build_target(
    controller: XArmController, function: Function, values: tuple[Any, ...], task: int
) -> tuple[Target, bool]:
    """Returns the target of a command, and whether it is only to be checked."""
    match function:
        case Function.SLEEP:
            return PauseTarget(id=task, seconds=values[0]), False
        case Function.MOVE_HOME:
            q = (0.0,) * controller.model.n
            return JointTarget(id=task, q=q, speed=_joint_speed(controller, *values[:2])), any(values[3:])
        case Function.MOVE_JOINT | Function.MOVE_JOINT_BLENDED:
            blend = _blend(values[9]) if function is Function.MOVE_JOINT_BLENDED else Blend()
            q = _joints(controller, values)
            target = JointTarget(id=task, q=q, speed=_joint_speed(controller, *values[7:9]), blend=blend)
            return target, any(values[10:])
        case Function.MOVE_CIRCLE:
            return _circle(controller, values, task)
        case Function.MOVE_RELATIVE if values[11]:
            end = controller.find_end().q
            q = tuple(old + (0.0 if isinf(step) else step) for old, step in zip(end, values, strict=False))
            speed = _joint_speed(controller, *values[7:9])
            return JointTarget(id=task, q=q, speed=speed, blend=_blend(values[10])), any(values[13:14])
        case _:
            return _line(controller, function, values, task)


def _line(controller: XArmController, function: Function, values: tuple[Any, ...], task: int) -> tuple[Target, bool]:
    end, user = controller.find_end().pose, controller.settings.T_base_user
    radius, is_check = -1.0, False
    speeds = values[6:8]
    match function:
        case Function.MOVE_LINE:
            others = values[9:]
            if others and isinstance(others[0], float):
                radius, flags = others[0], _Flags(*map(bool, others[1:4]))
            else:
                flags = _Flags(is_check=any(others[:1]))
            pose = _pose(controller, values[:6], flags)
            is_check = flags.is_check
        case Function.MOVE_LINE_BLENDED:
            radius, is_check = values[9], any(values[10:11])
            pose = absolute_pose(values[:6], end, user, is_rotation_vector=False)
        case Function.MOVE_LINE_TOOL:
            is_check = any(values[9:10])
            pose = tool_pose(values[:6], end, is_rotation_vector=False)
        case Function.MOVE_LINE_AXIS_ANGLE:
            in_tool, is_relative, *others = values[9:]
            is_check = any(others[:1])
            if in_tool:
                _refuse_tool_axes(controller)
                pose = tool_pose(values[:6], end, is_rotation_vector=True)
            else:
                build = relative_pose if is_relative else absolute_pose
                pose = build(values[:6], end, user, is_rotation_vector=True)
        case _:  # MOVE_RELATIVE
            speeds, radius = values[7:9], values[10]
            is_check = any(values[13:14])
            pose = relative_pose(values[:6], end, user, is_rotation_vector=bool(values[12]))
    speed = _tool_speed(controller, *speeds, start=end, goal=pose)
    return LineTarget(id=task, pose=pose, speed=speed, blend=_blend(radius)), is_check


def _pose(controller: XArmController, values: Sequence[float], flags: _Flags) -> Pose:
    end = controller.find_end().pose
    if flags.in_tool:
        _refuse_tool_axes(controller)
        return tool_pose(values, end, is_rotation_vector=flags.is_rotation_vector)
    user = controller.settings.T_base_user
    return absolute_pose(values, end, user, is_rotation_vector=flags.is_rotation_vector)


def _refuse_tool_axes(controller: XArmController) -> None:
    if controller.answer_to(Command.LINE) is Answer.FOLLOWED:
        raise InvalidValueError("coordinates", "tool", "are not possible in mode 7: use those of the base")


def _circle(controller: XArmController, values: tuple[Any, ...], task: int) -> tuple[Target, bool]:
    others = values[16:]
    flags = _Flags(*map(bool, others)) if len(others) == 3 else _Flags(is_check=any(others))
    via, pose = (_pose(controller, part, flags) for part in (values[:6], values[6:12]))
    if not 0.0 < values[15] < inf:
        raise InvalidValueError("part of the circle", values[15], "must be above 0 [percent]")
    speed = _tool_speed(controller, *values[12:14])
    target = ArcTarget(id=task, via=via, pose=pose, angle=tau * values[15] / 100.0, speed=speed)
    return target, flags.is_check


def _follow(controller: XArmController, target: Target, task: int) -> None:
    """Moves on-line to a target."""

    def begin(planner: Planner) -> Refusal | None:
        if isinstance(target, JointTarget):
            assert target.q is not None  # Of every joint target here.
            return planner.move_joints(target.q, target.speed)
        assert isinstance(target, LineTarget)
        return planner.move_tool(target.pose, target.speed)

    controller.follow(task, begin)


def _servo(
    controller: XArmController, function: Function, values: tuple[Any, ...], task: int, answer: Answer
) -> Outcome:
    if not controller.take_servo():
        return Outcome(answer, is_dropped=True)
    speed = controller.settings.servo_tool_speed(controller.model.limits)
    if function is Function.SERVO_JOINT:
        q = _joints(controller, values)
        controller.follow(task, partial(Planner.servo_joints, q=q, mode="linear", tool_speed=speed))
        controller.end.begin(q)
    else:
        pose = _servo_pose(controller, function, values)
        controller.follow(task, lambda planner: _servo_tool(controller, planner, pose, speed))
        controller.end.move(pose)
    return Outcome(answer)


def _servo_tool(controller: XArmController, planner: Planner, pose: Pose, speed: float) -> Refusal | None:
    """Follows a streamed pose; the refusal of one too far away also says how fast a joint would have to move."""
    refusal = planner.servo_tool(pose, mode="linear", tool_speed=speed, max_step=SERVO_STEP)
    if refusal is None or refusal.reason is not RefusalReason.STEP:
        return refusal
    near = planner.q if planner.streamed is None else planner.streamed
    try:
        goal = controller.end.solver.nearest(pose, near)
    except KinematicsError:
        return refusal
    dq = np.subtract(goal, near) / SERVO_PERIOD
    joint = int((np.abs(dq) / controller.model.limits.joint.velocity).argmax()) + 1
    value, milliseconds = float(dq[joint - 1]), round(1e3 * SERVO_PERIOD)
    text = f"joint {joint} would move with {value:.4g} rad/s to be there {milliseconds} ms later"
    needed = Remark(text, "step_speed", joint=joint, value=value, unit="rad/s", milliseconds=milliseconds)
    return replace(refusal, remark=Remark.all((refusal.remark, needed)))


def _servo_pose(controller: XArmController, function: Function, values: tuple[Any, ...]) -> Pose:
    end, user = controller.find_servo_end(), controller.settings.T_base_user
    if function is Function.SERVO_CARTESIAN:
        if values[8]:
            return tool_pose(values[:6], end, is_rotation_vector=False)
        return absolute_pose(values[:6], end, user, is_rotation_vector=False)
    in_tool, is_relative = values[8:]
    if in_tool:
        return tool_pose(values[:6], end, is_rotation_vector=True)
    return (relative_pose if is_relative else absolute_pose)(values[:6], end, user, is_rotation_vector=True)


def _joint_velocity(controller: XArmController, values: tuple[Any, ...], task: int) -> Outcome:
    settings = controller.settings
    speed = JointSpeed(acceleration=settings.joint_acceleration, jerk=settings.joint_jerk)
    dq, duration = values[: controller.model.n], _duration(values[8:])
    controller.follow(
        task,
        lambda planner: planner.set_joint_velocity(dq, speed=speed, is_synchronized=bool(values[7]), duration=duration),
    )
    return Outcome(Answer.FOLLOWED)


def _tool_velocity(controller: XArmController, values: tuple[Any, ...], task: int) -> Outcome:
    settings, in_tool = controller.settings, bool(values[6])
    twist = np.array([MILLIMETRE * value for value in values[:3]] + list(values[3:6]))
    if not in_tool:
        R = settings.T_base_user.rotation
        twist = np.concatenate((R @ twist[:3], R @ twist[3:]))
    speed = ToolSpeed(velocity=settings.tool_speed, acceleration=settings.tool_acceleration, jerk=settings.tool_jerk)
    duration = _duration(values[7:])
    controller.follow(
        task,
        lambda planner: planner.set_twist(
            twist.tolist(), speed=speed, frame="tool" if in_tool else "base", duration=duration
        ),
    )
    return Outcome(Answer.FOLLOWED)


def _duration(values: Sequence[float]) -> float | None:
    return values[0] if values and values[0] > 0.0 else None


def _move_end(controller: XArmController, target: Target) -> None:
    """Notes where the queue ends with this target."""
    end = controller.end
    if isinstance(target, JointTarget):
        assert target.q is not None  # Of every joint target here.
        end.begin(target.q)
    elif isinstance(target, LineTarget):
        end.move(target.pose)
    elif isinstance(target, ArcTarget):
        assert target.angle is not None  # Of every circle here.
        end.turn(target.via, target.pose, target.angle)


def _check(controller: XArmController, target: Target) -> int:
    """Returns the number of the error that a target would raise at its end; 0: none."""
    q: Sequence[float] | None = None
    try:
        if isinstance(target, JointTarget):
            q = target.q
        elif isinstance(target, (LineTarget, ArcTarget)):
            q = controller.find_end().solve(target.pose)
    except KinematicsError:
        return UfactoryError.KINEMATICS
    if q is None:
        return 0
    joint = controller.motion_limits.joint
    is_inside = bool(np.all(np.array(q) >= joint.lower) and np.all(np.array(q) <= joint.upper))
    return 0 if is_inside else UfactoryError.JOINT_RANGE


def _joints(controller: XArmController, values: Sequence[float]) -> tuple[float, ...]:
    """Returns joint angles; an infinite one keeps that of the end of the queue."""
    q = values[: controller.model.n]
    if not any(map(isinf, q)):
        return tuple(q)
    return tuple(old if isinf(new) else new for new, old in zip(q, controller.find_end().q, strict=True))


def _joint_speed(controller: XArmController, velocity: float, acceleration: float) -> JointSpeed:
    settings = controller.settings
    _require_positive("speed", velocity, "rad/s")
    _require_positive("acceleration", acceleration, "rad/s^2")
    return JointSpeed(
        velocity=min(velocity, settings.joint_speed),
        acceleration=min(acceleration, settings.joint_acceleration),
        jerk=settings.joint_jerk,
    )


def _tool_speed(
    controller: XArmController,
    velocity: float,
    acceleration: float,
    *,
    start: Pose | None = None,
    goal: Pose | None = None,
) -> ToolSpeed:
    """Returns the speed of a line in mm/s, or in deg/s if it only turns."""
    settings = controller.settings
    _require_positive("speed", velocity, "mm/s")
    _require_positive("acceleration", acceleration, "mm/s^2")
    if start is not None and goal is not None:
        off = [a - b for a, b in zip(start.parts[1], goal.parts[1], strict=True)]
        if hypot(*off) < _PURE_ROTATION and hypot(*rotation_between(start.parts[0], goal.parts[0])) > 0.0:
            return ToolSpeed(
                rotation_velocity=min(radians(velocity), TOOL_ROTATION), rotation_acceleration=radians(acceleration)
            )
    return ToolSpeed(
        velocity=min(MILLIMETRE * velocity, settings.tool_speed),
        acceleration=min(MILLIMETRE * acceleration, settings.tool_acceleration),
        jerk=settings.tool_jerk,
    )


def _require_positive(name: str, value: float, unit: str) -> None:
    if not 0.0 < value < inf:
        raise InvalidValueError(name, value, f"must be above zero and finite [{unit}]")


def _blend(radius: float) -> Blend:
    return Blend(radius=MILLIMETRE * radius) if 0.0 < radius < inf else Blend()
