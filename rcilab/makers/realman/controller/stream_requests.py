"""Commands that clients stream: joint angles, poses and velocities of the tool. None is answered.

A joint more than 10 deg from the angle that was streamed before, at first from its own, does not follow the command;
the bit of its error word is set. What is outside the limits sets the error of the system.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import degrees, radians
from typing import TypeAlias

import numpy as np

from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.makers.realman.bounds import LARGEST_STREAM_STEP
from rcilab.makers.realman.controller.fault_of import REFUSALS
from rcilab.makers.realman.controller.motion_requests import read_angles, read_pose
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.wire.line import Request
from rcilab.makers.realman.wire.units import pose_from_wire_quaternion
from rcilab.sim.planner import JointSpeed, Refusal, ToolSpeed
from rcilab.sim.planner.stream_filter import StreamMode

_MICRO, _MILLI = 1e-6, 1e-3
_VELOCITY_TIMEOUT = 0.1  # [s] The tool stops when velocities cease for so long; rcilab's own value.

Stream: TypeAlias = Callable[[RealManController, Request], None]


def _joints(controller: RealManController, request: Request) -> None:
    q = read_angles(controller, request, inwards=True)
    _require_near(controller, q)
    controller.begin_command()
    mode, smoothing = _read_smoothing(request)
    refusal = controller.drive.planner.follow_joints(q, mode=mode, smoothing=smoothing)
    _follow(controller, "joint", refusal)
    controller.drive.end_tool_watch()


def _follow_joints(controller: RealManController, request: Request) -> None:
    q = read_angles(controller, request, inwards=True)
    controller.begin_command()
    _follow(controller, "joint", controller.drive.planner.move_joints(q, JointSpeed()))


def _pose(controller: RealManController, request: Request) -> None:
    pose = _read_pose(controller, request)
    controller.begin_command()
    mode, smoothing = _read_smoothing(request)
    if mode == "direct":
        controller.drive.end_tool_watch()
    else:
        controller.drive.watch_tool(controller.cycle_number, pose)
    _follow(controller, "pose", controller.drive.planner.follow_tool(pose, mode=mode, smoothing=smoothing))


def _follow_pose(controller: RealManController, request: Request) -> None:
    pose = _read_pose(controller, request)
    controller.begin_command()
    _follow(controller, "pose", controller.drive.planner.move_tool(pose, ToolSpeed()))


def _velocity(controller: RealManController, request: Request) -> None:
    vx, vy, vz, wx, wy, wz = request.integers("cartesian_velocity", 6)
    twist = np.array([_MICRO * vx, _MICRO * vy, _MICRO * vz, _MILLI * wx, _MILLI * wy, _MILLI * wz])
    controller.begin_command()
    in_tool = controller.settings.velocity_in_tool
    R = np.eye(3) if in_tool else controller.settings.T_base_work.rotation
    turned = [*(R @ twist[:3]).tolist(), *(R @ twist[3:]).tolist()]
    controller.drive.planner.set_twist(turned, frame="tool" if in_tool else "base", duration=_VELOCITY_TIMEOUT)
    controller.streamed = "pose"


def _read_smoothing(request: Request) -> tuple[StreamMode, float]:
    """Returns how a stream is smoothed: not at all, on a curve (0 to 100), or by a filter (0 to 1000)."""
    mode, radio = request.integer("trajectory_mode", 0), request.integer("radio", 0)
    names: tuple[StreamMode, ...] = ("direct", "fit", "filter")
    largest = (1, 100, 1000)
    if not 0 <= mode < len(names):
        raise InvalidValueError("trajectory_mode", mode, "must be 0, 1 or 2")
    return names[mode], min(max(radio / largest[mode], 0.0), 1.0) if mode else 0.0


def _read_pose(controller: RealManController, request: Request) -> Pose:
    if "pose_quat" not in request.fields:
        return read_pose(controller, request.integers("pose", 6))
    return controller.settings.T_base_work @ pose_from_wire_quaternion(request.integers("pose_quat", 7))


def _require_near(controller: RealManController, q: Sequence[float]) -> None:
    drive = controller.drive
    before = drive.planner.streamed
    steps = np.abs(np.array(q) - (drive.q_c if before is None else before))
    joint = int(steps.argmax()) + 1
    step = degrees(float(steps.max()))
    if step > LARGEST_STREAM_STEP:
        problem = f"deg is the step of joint {joint}, more than {LARGEST_STREAM_STEP:g} deg; stream smaller steps"
        error = InvalidValueError("joint", round(step, 3), problem)
        bound = radians(LARGEST_STREAM_STEP)
        reason = Remark(str(error), "stream_step", joint=joint, value=radians(step), bound=bound, unit="rad")
        controller.set_error(RealManError.JOINT_POSITION_STEP, reason, joint)
        raise error


def _follow(controller: RealManController, kind: str, refusal: Refusal | None) -> None:
    if refusal is not None:
        controller.set_error(REFUSALS[refusal.reason], refusal.remark)
        raise UsageError(str(refusal.remark))
    controller.streamed = kind


STREAMS: dict[str, Stream] = {
    "movej_canfd": _joints,
    "movej_follow": _follow_joints,
    "movep_canfd": _pose,
    "movep_follow": _follow_pose,
    "movev_canfd": _velocity,
}
