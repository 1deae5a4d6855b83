"""Motion commands: planned trajectories, steps, teaching, and the control of what moves."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from math import degrees, pi
from typing import Any

import numpy as np

from rcilab.core.errors import InvalidValueError, KinematicsError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.makers.realman.controller.arm_drive import find_outside
from rcilab.makers.realman.controller.handler import MOTION_FIELD, Getter, Setter, setter
from rcilab.makers.realman.controller.joint_parameters import require_joint
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.trajectories import Trajectory, TrajectoryKind
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.wire.line import Request
from rcilab.makers.realman.wire.units import angles_from_millidegrees, pose_from_wire
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.numeric.solver import NumericSolver
from rcilab.motion.bounds import range_from
from rcilab.sim.channels import Peer
from rcilab.sim.planner import (
    ArcTarget,
    Blend,
    JointSpeed,
    JointTarget,
    LineTarget,
    PlannerState,
    Target,
    ToolSpeed,
)

_MICRO, _MILLI = 1e-6, 1e-3
_AXES = ("x", "y", "z")
_MOST_LOOPS = 1000
_ARM_ANGLES = 24  # That are tried for an arm with 7 axes; a tuning value.


def read_share(request: Request, name: str = "v") -> float:
    """Returns a speed in percent as a share, above 0.

    Raises:
        InvalidValueError: It is not 1 to 100.
    """
    percent = request.integer(name)
    if not 1 <= percent <= 100:
        raise InvalidValueError(name, percent, "must be 1 to 100")
    return percent / 100.0


def _blend(request: Request) -> Blend:
    percent = request.integer("r", 0)
    if not 0 <= percent <= 100:
        raise InvalidValueError("r", percent, "must be 0 to 100")
    return Blend(share=percent / 100.0 if _is_connected(request) else 0.0)


def _is_connected(request: Request) -> bool:
    return request.flag("trajectory_connect", False)


def joint_speed(controller: RealManController, share: float) -> JointSpeed:
    """Returns a share of the joints' largest speeds."""
    return JointSpeed(velocity=tuple((share * controller.limits.joint.velocity).tolist()))


def tool_speed(controller: RealManController, share: float) -> ToolSpeed:
    """Returns a share of the tool's largest speeds."""
    tip = controller.settings.tip
    return ToolSpeed(velocity=share * tip.line_speed, rotation_velocity=share * tip.angular_speed)


def read_angles(controller: RealManController, request: Request, *, inwards: bool = False) -> tuple[float, ...]:
    """Returns joint angles inside the ranges in force, [rad].

    Args:
        controller: The controller.
        request: The request.
        inwards: Whether a joint that is outside may also have angles from there on.

    Raises:
        UsageError: They are not; the error of the system is set.
    """
    q, limits = angles_from_millidegrees(request.integers("joint", controller.model.n)), controller.limits
    if inwards:
        limits = replace(limits, joint=range_from(limits.joint, np.array(controller.drive.q_c)))
    _require_inside(controller, q, limits)
    return q


def _require_inside(controller: RealManController, q: Sequence[float], limits: Limits) -> None:
    """Requires joint angles inside the ranges; otherwise the error of the system is set.

    Raises:
        UsageError: One is outside.
    """
    found = find_outside(np.array(q), limits)
    if found is not None:
        joint, bound = found
        sentence = f"joint {joint}: {degrees(q[joint - 1]):.6g} deg is beyond its limit of {degrees(bound):.6g} deg"
        reason = Remark(sentence, "target_range", joint=joint, value=q[joint - 1], bound=bound, unit="rad")
        controller.set_error(RealManError.TARGET_OVER_LIMIT, reason)
        raise UsageError(sentence)


def read_pose(controller: RealManController, values: tuple[int, ...]) -> Pose:
    """Returns a pose of the tool in base, from one in the current work frame."""
    return controller.settings.T_base_work @ pose_from_wire(values)


def _trajectory(kind: TrajectoryKind, request: Request, peer: Peer) -> Trajectory:
    return Trajectory(kind=kind, peer=peer, is_followed_by_another=_is_connected(request))


def _movej(controller: RealManController, request: Request, peer: Peer) -> None:
    speed, blend = joint_speed(controller, read_share(request)), _blend(request)
    q = read_angles(controller, request)
    target = JointTarget(id=controller.trajectories.next_id(), q=q, speed=speed, blend=blend)
    _add(controller, target, _trajectory("movej", request, peer))


def _movej_p(controller: RealManController, request: Request, peer: Peer) -> None:
    speed, blend = joint_speed(controller, read_share(request)), _blend(request)
    pose = read_pose(controller, request.integers("pose", 6))
    q = _solve(controller, pose)
    target = JointTarget(id=controller.trajectories.next_id(), q=q, pose=None if q else pose, speed=speed, blend=blend)
    _add(controller, target, _trajectory("movej", request, peer))


def _solve(controller: RealManController, pose: Pose) -> tuple[float, ...] | None:
    """Returns the joint angles of a pose inside the ranges that are nearest to the standing arm.

    None: the planner chooses, as behind other targets, or for an arm without a closed form.
    """
    model = controller.model
    solver = build_solver(model.description)
    if controller.drive.planner.queued or isinstance(solver, NumericSolver):
        return None
    near, joint = np.array(controller.drive.q_c), controller.limits.joint
    T_base_flange = pose @ model.T_flange_tool.inverse()
    start = near.tolist()
    branches = np.empty((0, model.n))
    with suppress(KinematicsError):
        found = solver.at(T_base_flange, start).branches(solver.redundancy_angle(start) if solver.redundancy else 0.0)
        branches = np.array(found).reshape(-1, model.n)
    if solver.redundancy:  # Many poses at once take a tenth of the time.
        angles = np.linspace(-pi, pi, _ARM_ANGLES, endpoint=False)
        poses = np.repeat(T_base_flange.matrix[np.newaxis], _ARM_ANGLES, axis=0)
        branches = np.concatenate((branches, solver.batch(poses, angles).reshape(-1, model.n)))
    turned = branches + 2.0 * pi * np.round((near - branches) / (2.0 * pi))  # Turns, where the range has some.
    q = np.where((joint.lower <= turned) & (turned <= joint.upper), turned, branches)
    q = q[((joint.lower <= q) & (q <= joint.upper)).all(axis=1)]
    return tuple(q[np.abs(q - near).max(axis=1).argmin()].tolist()) if len(q) else None


def _movel(controller: RealManController, request: Request, peer: Peer) -> None:
    speed, blend = tool_speed(controller, read_share(request)), _blend(request)
    pose = read_pose(controller, request.integers("pose", 6))
    target = LineTarget(id=controller.trajectories.next_id(), pose=pose, speed=speed, blend=blend)
    _add(controller, target, _trajectory("movel", request, peer))


def _movel_offset(controller: RealManController, request: Request, peer: Peer) -> None:
    speed, blend = tool_speed(controller, read_share(request)), _blend(request)
    offset = pose_from_wire(request.integers("offset", 6))
    target = _offset_target(controller, offset, speed, in_tool=request.flag("frame_type"))
    _add(controller, replace(target, blend=blend), _trajectory("movel", request, peer))


def _offset_target(controller: RealManController, offset: Pose, speed: ToolSpeed, *, in_tool: bool) -> LineTarget:
    """Returns a line by an offset from the end of the queue, in the axes of the tool or of the work frame."""
    number = controller.trajectories.next_id()
    if in_tool:
        return LineTarget(id=number, pose=offset, frame="tool", speed=speed)
    R_base_work = Pose.from_parts(controller.settings.T_base_work.parts[0], (0.0, 0.0, 0.0))
    return LineTarget(id=number, pose=R_base_work @ offset @ R_base_work.inverse(), frame="offset", speed=speed)


def _movec(controller: RealManController, request: Request, peer: Peer) -> None:
    speed, blend = tool_speed(controller, read_share(request)), _blend(request)
    poses = request.inner("pose")
    via, end = (read_pose(controller, poses.integers(name, 6)) for name in ("pose_via", "pose_to"))
    loops = request.integer("loop", 0)
    if not 0 <= loops <= _MOST_LOOPS:
        raise InvalidValueError("loop", loops, f"must be 0 to {_MOST_LOOPS}")
    target = ArcTarget(
        id=controller.trajectories.next_id(),
        via=via,
        pose=end,
        angle=2.0 * pi * loops if loops else None,
        speed=speed,
        blend=blend,
    )
    _add(controller, target, _trajectory("movec", request, peer))


def _moves(controller: RealManController, request: Request, peer: Peer) -> None:
    speed = tool_speed(controller, read_share(request))
    pose = read_pose(controller, request.integers("pose", 6))
    controller.begin_command()
    trajectory = _trajectory("moves", request, peer)
    controller.add_all(controller.trajectories.add_spline(pose, speed, trajectory))


def _add(controller: RealManController, target: Target, trajectory: Trajectory) -> None:
    controller.begin_command()
    controller.add(target, trajectory)


def _joint_step(controller: RealManController, request: Request, peer: Peer) -> None:
    joint, step = request.integers("joint_step", 2)
    index = require_joint(joint, controller.model.n) - 1
    (angle,) = angles_from_millidegrees((step,))
    end = controller.drive.planner.end_q
    if end is not None and not controller.trajectories.is_connecting(peer):  # Otherwise the planner checks it.
        end[index] += angle
        _require_inside(controller, end, controller.limits)
    target = JointTarget(
        id=controller.trajectories.next_id(),
        q=tuple(angle if i == index else 0.0 for i in range(controller.model.n)),
        is_relative=True,
        speed=joint_speed(controller, read_share(request)),
    )
    _add(controller, target, Trajectory(kind="movej", peer=peer))


def _pos_step(controller: RealManController, request: Request, peer: Peer) -> None:
    axis = _axis(request.text("step_type").removesuffix("_step"), "")
    step = [0.0, 0.0, 0.0]
    step[axis] = _MICRO * request.integer("step")
    _step(controller, Pose(step), request, peer)


def _ort_step(controller: RealManController, request: Request, peer: Peer) -> None:
    axis = _axis(request.text("step_type").removesuffix("_step"), "r")
    turn = [0.0, 0.0, 0.0]
    turn[axis] = _MILLI * request.integer("step")
    _step(controller, Pose.from_rpy((0.0, 0.0, 0.0), turn), request, peer)


def _step(controller: RealManController, offset: Pose, request: Request, peer: Peer) -> None:
    speed = tool_speed(controller, read_share(request))
    target = _offset_target(controller, offset, speed, in_tool=controller.settings.teach_in_tool)
    _add(controller, target, Trajectory(kind="movel", peer=peer))


def _axis(name: str, prefix: str) -> int:
    names = tuple(f"{prefix}{axis}" for axis in _AXES)
    if name not in names:
        raise InvalidValueError("axis", name, f"must be one of {', '.join(names)}")
    return names.index(name)


def _sign(request: Request) -> float:
    direction = request.text("direction")
    if direction not in ("pos", "neg"):
        raise InvalidValueError("direction", direction, "must be pos or neg")
    return 1.0 if direction == "pos" else -1.0


def _joint_teach(controller: RealManController, request: Request) -> None:
    index = require_joint(request.integer("teach_joint"), controller.model.n) - 1
    velocity = [0.0] * controller.model.n
    velocity[index] = _sign(request) * read_share(request) * float(controller.limits.joint.velocity[index])
    controller.begin_command()
    controller.drive.planner.set_joint_velocity(velocity, speed=JointSpeed())
    controller.is_teaching = True


def _pos_teach(controller: RealManController, request: Request) -> None:
    twist = np.zeros(6)
    speed = read_share(request) * controller.settings.tip.line_speed
    twist[_axis(request.text("teach_type"), "")] = _sign(request) * speed
    _teach(controller, twist)


def _ort_teach(controller: RealManController, request: Request) -> None:
    twist = np.zeros(6)
    speed = read_share(request) * controller.settings.tip.angular_speed
    twist[3 + _axis(request.text("teach_type"), "r")] = _sign(request) * speed
    _teach(controller, twist)


def _teach(controller: RealManController, twist: np.ndarray) -> None:
    controller.begin_command()
    in_tool = controller.settings.teach_in_tool
    R = np.eye(3) if in_tool else controller.settings.T_base_work.rotation
    turned = [*(R @ twist[:3]).tolist(), *(R @ twist[3:]).tolist()]
    controller.drive.planner.set_twist(turned, speed=ToolSpeed(), frame="tool" if in_tool else "base")
    controller.is_teaching = True


def _pause(controller: RealManController, request: Request) -> None:
    controller.drive.planner.pause()
    if controller.program is not None:
        controller.program.is_paused = True


def _continue(controller: RealManController, request: Request) -> None:
    controller.require_ready()
    controller.drive.planner.resume()
    if controller.program is not None:
        controller.program.is_paused = False


def _require_paused(controller: RealManController) -> None:
    if controller.drive.planner.state is not PlannerState.PAUSED:
        raise UsageError("the trajectory can be deleted after set_arm_pause only")


def _delete_current(controller: RealManController, request: Request) -> None:
    _require_paused(controller)
    controller.drive.planner.skip()


def _delete_all(controller: RealManController, request: Request) -> None:
    _require_paused(controller)
    controller.discard_waiting()
    controller.drive.planner.clear_queue()
    controller.drive.planner.skip()


def _set_teach_frame(controller: RealManController, request: Request) -> None:
    controller.change(replace(controller.settings, teach_in_tool=request.flag("frame_type")))


def _teach_frame(controller: RealManController, request: Request) -> dict[str, Any]:
    return {"command": "get_teach_frame", "frame_type": int(controller.settings.teach_in_tool)}


SETTERS: dict[str, Setter] = {
    "movej": Setter(MOTION_FIELD, _movej),
    "movej_p": Setter(MOTION_FIELD, _movej_p),
    "movel": Setter(MOTION_FIELD, _movel),
    "movel_offset": Setter(MOTION_FIELD, _movel_offset),
    "movec": Setter(MOTION_FIELD, _movec),
    "moves": Setter(MOTION_FIELD, _moves),
    "set_joint_step": Setter(MOTION_FIELD, _joint_step),
    "set_pos_step": Setter(MOTION_FIELD, _pos_step),
    "set_ort_step": Setter(MOTION_FIELD, _ort_step),
    "set_joint_teach": setter("joint_teach", _joint_teach),
    "set_pos_teach": setter("pos_teach", _pos_teach),
    "set_ort_teach": setter("ort_teach", _ort_teach),
    "set_stop_teach": setter("stop_teach", lambda controller, request: controller.slow_stop()),
    "set_arm_stop": setter("arm_stop", lambda controller, request: controller.stop_at_once()),
    "set_arm_slow_stop": setter("arm_slow_stop", lambda controller, request: controller.slow_stop()),
    "set_arm_pause": setter("arm_pause", _pause),
    "set_arm_continue": setter("arm_continue", _continue),
    "set_delete_current_trajectory": setter("delete_current_trajectory", _delete_current),
    "set_arm_delete_trajectory": setter("arm_delete_trajectory", _delete_all),
    "set_teach_frame": setter("set_state", _set_teach_frame),
}
GETTERS: dict[str, Getter] = {"get_teach_frame": _teach_frame}
