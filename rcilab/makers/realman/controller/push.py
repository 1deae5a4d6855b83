"""The datagram of a pushed state."""

from __future__ import annotations

from math import degrees

from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.state_requests import (
    TEMPERATURE,
    VOLTAGE,
    error_codes,
    joint_angles,
    joint_currents,
)
from rcilab.makers.realman.wire.line import encode_answer
from rcilab.makers.realman.wire.units import SPEED_STEP, microns_from_lengths, quaternion_to_wire
from rcilab.sim.planner import PlannerState

_MOVES = {"movej": "move_J", "movel": "move_L", "movec": "move_C", "moves": "move_S"}
_STREAMS = {"joint": "move_through_joint", "pose": "move_through_pose"}


def arm_status(controller: RealManController) -> str:
    """Returns what the arm does, as a client reads it."""
    if controller.button != "none":
        return "stop"
    if controller.streamed:
        return _STREAMS[controller.streamed]
    if controller.is_teaching:
        return "tech_demonstration"
    planner = controller.drive.planner
    if planner.state is PlannerState.PAUSED:
        return "pause"
    current = planner.current
    trajectory = None if current is None else controller.trajectories.find(current.id)
    return "idle" if trajectory is None else _MOVES[trajectory.kind]


def encode_push(controller: RealManController, arm_ip: str) -> bytes:
    """Returns the datagram of the present state.

    Args:
        controller: The controller.
        arm_ip: Address of the arm.
    """
    n = controller.model.n
    pose = controller.T_work_tool
    joints = {
        "joint_position": joint_angles(controller),
        "joint_speed": [round(degrees(dq) / SPEED_STEP) for dq in controller.arm.signals.measured.dq.tolist()],
        "joint_current": joint_currents(controller),
        "joint_temperature": [TEMPERATURE] * n,
        "joint_voltage": [VOLTAGE] * n,
        "joint_en_flag": [int(on) for on in controller.enabled],
        "joint_err_code": controller.joint_errors,
    }
    waypoint = {
        "position": microns_from_lengths(pose.position.tolist()),
        "euler": [round(1e3 * angle) for angle in pose.rpy.tolist()],
        "quat": quaternion_to_wire(pose),
    }
    return encode_answer(
        {
            "state": "realtime_arm_joint_state",
            "arm_ip": arm_ip,
            "arm_current_status": arm_status(controller),
            "err": error_codes(controller),
            "joint_status": joints,
            "waypoint": waypoint,
        }
    )
