"""Requests that only read: states, and what a client reads when it connects."""

from __future__ import annotations

from typing import Any

from rcilab.makers.realman.controller.handler import Getter
from rcilab.makers.realman.controller.identity import dh_data
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.wire.line import Request
from rcilab.makers.realman.wire.units import millidegrees_from_angles, wire_from_pose

VOLTAGE = 24000
"""[0.001 V] Of controller and joints; constant."""
TEMPERATURE = 30000
"""[0.001 deg C]."""
CURRENT = 1500
"""[0.001 A] Of the controller."""
_SECONDS_A_DAY, _CYCLES_A_SECOND = 86400, 1000


def error_codes(controller: RealManController) -> list[int]:
    """Returns the errors of the system; 0 without one."""
    return [error.code for error in controller.system_errors] or [0]


def joint_angles(controller: RealManController) -> list[int]:
    """Returns the joint angles, [0.001 deg]."""
    return millidegrees_from_angles(controller.q.tolist())


def tool_pose(controller: RealManController) -> list[int]:
    """Returns the pose of the tool in the work frame."""
    return wire_from_pose(controller.T_work_tool)


def joint_currents(controller: RealManController) -> list[int]:
    """Returns torques of the joints as currents, [mA]: 1 A a newton metre, rcilab's own value."""
    return [round(1e3 * torque) for torque in controller.arm.signals.measured.tau.tolist()]


def _arm_state(controller: RealManController, request: Request) -> dict[str, Any]:
    state = {"joint": joint_angles(controller), "pose": tool_pose(controller), "err": error_codes(controller)}
    return {"state": "current_arm_state", "arm_state": state}


def _all_state(controller: RealManController, request: Request) -> dict[str, Any]:
    n = controller.model.n
    state = {
        "temperature": [TEMPERATURE] * n,
        "current": joint_currents(controller),
        "voltage": [VOLTAGE] * n,
        "err_flag": controller.joint_errors,
        "en_flag": [int(on) for on in controller.enabled],
        "err": error_codes(controller),
    }
    return {"state": "arm_all_state", "all_state": state}


def _trajectory(controller: RealManController, request: Request) -> dict[str, Any]:
    current = controller.drive.planner.current
    trajectory = None if current is None else controller.trajectories.find(current.id)
    kind = "none" if trajectory is None else trajectory.kind
    data = joint_angles(controller) if kind in ("none", "movej") else tool_pose(controller)
    return {"state": "arm_current_trajectory", "type": kind, "data": data}


def _runtime(controller: RealManController, request: Request) -> dict[str, Any]:
    seconds = controller.cycle_number // _CYCLES_A_SECOND
    day, rest = divmod(seconds, _SECONDS_A_DAY)
    hour, rest = divmod(rest, 3600)
    return {"command": "get_system_runtime", "day": day, "hour": hour, "min": rest // 60, "sec": rest % 60}


def _joint_list(state: str, values: list[int]) -> dict[str, Any]:
    return {"state": f"current_{state}", state: values}


GETTERS: dict[str, Getter] = {
    "get_current_arm_state": _arm_state,
    "get_joint_degree": lambda controller, request: {"state": "joint_degree", "joint": joint_angles(controller)},
    "get_arm_all_state": _all_state,
    "get_arm_current_trajectory": _trajectory,
    "get_controller_state": lambda controller, request: {
        "state": "controller_state",
        "voltage": VOLTAGE,
        "current": CURRENT,
        "temperature": TEMPERATURE,
        "err_flag": 0,
    },
    "get_current_joint_current": lambda controller, request: _joint_list("joint_current", joint_currents(controller)),
    "get_current_joint_voltage": lambda controller, request: _joint_list(
        "joint_voltage", [VOLTAGE] * controller.model.n
    ),
    "get_current_joint_temperature": lambda controller, request: _joint_list(
        "joint_temperature", [TEMPERATURE] * controller.model.n
    ),
    "get_arm_power_state": lambda controller, request: {
        "state": "arm_power_state",
        "power_state": int(controller.is_powered),
    },
    "get_arm_run_mode": lambda controller, request: {
        "command": "get_arm_run_mode",
        "mode": int(not controller.drive.is_simulated),
    },
    "get_DH_data": lambda controller, request: dh_data(controller.model.description),
    "get_system_runtime": _runtime,
    "get_joint_software_version": lambda controller, request: {
        "state": "joint_software_version",
        "version": [531] * controller.model.n,
    },
    "get_tool_software_version": lambda controller, request: {"state": "tool_software_version", "version": 531},
    "get_joint_odom": lambda controller, request: {"command": "get_joint_odom", "odom": [0] * controller.model.n},
}
