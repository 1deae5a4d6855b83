"""A program with RealMan's client library only, as a user writes it; it prints what its calls return, as JSON.

Run by the tests in a process of its own: the library has threads of its own, and may wait after a failed handshake.
"""

from __future__ import annotations

import json
import socket
import sys
import time
from typing import Any

_KEPT: list[Any] = []
"""Callbacks. The library may call one after its push is off and its robot deleted, and crashes if it is gone."""


def joint_commands(robot: Any, n: int) -> dict[str, Any]:
    """Calls every method of JointConfigSettings and JointConfigReader."""
    found: dict[str, Any] = {"refused while enabled": robot.rm_set_joint_max_speed(2, 90.0)}
    found["disabled"] = robot.rm_set_joint_en_state(2, 0)
    found["speed"] = [robot.rm_set_joint_max_speed(2, 90.0), robot.rm_get_joint_max_speed()]
    found["acceleration"] = [robot.rm_set_joint_max_acc(2, 600.0), robot.rm_get_joint_max_acc()]
    found["lower"] = [robot.rm_set_joint_min_pos(2, -100.0), robot.rm_get_joint_min_pos()]
    found["upper"] = [robot.rm_set_joint_max_pos(2, 100.0), robot.rm_get_joint_max_pos()]
    found["drive speed"] = [robot.rm_set_joint_drive_max_speed(2, 120.0), robot.rm_get_joint_drive_max_speed()]
    found["drive acceleration"] = [robot.rm_set_joint_drive_max_acc(2, 600.0), robot.rm_get_joint_drive_max_acc()]
    found["drive lower"] = [robot.rm_set_joint_drive_min_pos(2, -90.0), robot.rm_get_joint_drive_min_pos()]
    found["drive upper"] = [robot.rm_set_joint_drive_max_pos(2, 90.0), robot.rm_get_joint_drive_max_pos()]
    found["zero"] = robot.rm_set_joint_zero_pos(2)
    found["cleared"] = robot.rm_set_joint_clear_err(2)
    found["enabled while one is disabled"] = robot.rm_get_joint_en_state()
    found["error flags"] = robot.rm_get_joint_err_flag()
    for joint in range(1, n + 1):
        robot.rm_set_joint_en_state(joint, 0)
    found["factory ranges"] = [robot.rm_auto_set_joint_limit(1), robot.rm_get_joint_max_pos()]
    found["enabled"] = [robot.rm_set_joint_en_state(joint, 1) for joint in range(1, n + 1)]
    return found


def motions(robot: Any, n: int) -> dict[str, Any]:
    """Moves as the maker's examples do, waiting for each end."""
    start = [0, -20, -70, 0, -90, 0] if n == 6 else [0, 20, 0, 70, 0, 90, 0]
    wait = 1 if n else 0
    found: dict[str, Any] = {"movej": robot.rm_movej(start, 50, 0, 0, wait)}
    pose = robot.rm_get_current_arm_state()[1]["pose"]
    found["movej_p"] = robot.rm_movej_p([*pose[:2], pose[2] + 0.05, *pose[3:]], 50, 0, 0, wait)
    found["movel"] = robot.rm_movel(pose, 50, 0, 0, wait)
    via, end = [pose[0], 0.03, pose[2] + 0.03, *pose[3:]], [pose[0], 0.06, pose[2], *pose[3:]]
    found["movec"] = robot.rm_movec(via, end, 50, 0, 0, 0, wait)
    found["moves"] = [
        robot.rm_moves([pose[0], 0.06 - 0.02 * i, pose[2] + 0.01 * (i % 2), *pose[3:]], 50, 0, int(i < 3), wait)
        for i in range(1, 4)
    ]
    found["joint step"] = robot.rm_set_joint_step(1, 5.0, 50, wait)
    found["refused"] = robot.rm_movej([179.0, *start[1:]], 50, 0, 0, wait)
    found["error"] = robot.rm_get_current_arm_state()[1]["err"]
    found["cleared"] = robot.rm_clear_system_err()
    found["frames"] = [
        robot.rm_set_manual_work_frame("table", [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]),
        robot.rm_change_work_frame("table"),
        robot.rm_get_current_work_frame()[1]["name"],
        robot.rm_change_work_frame("World"),
        robot.rm_delete_work_frame("table"),
    ]
    q = robot.rm_get_joint_degree()[1][:n]
    for i in range(50):
        robot.rm_movej_canfd([q[0] + 0.2 * (i + 1), *q[1:]], True, 0, 0, 0)
        time.sleep(0.01)
    time.sleep(0.5)
    found["streamed"] = robot.rm_get_joint_degree()[1][0] - q[0]
    found["stop"] = [robot.rm_set_arm_pause(), robot.rm_set_arm_continue(), robot.rm_set_arm_slow_stop()]
    found["stop"].append(robot.rm_set_arm_stop())
    return found


def ends_at_once(robot: Any, n: int) -> dict[str, Any]:
    """Waits for motions that end as soon as they are accepted: to where the arm is, and beyond its reach."""
    q, pose = robot.rm_get_joint_degree()[1][:n], robot.rm_get_current_arm_state()[1]["pose"]
    return {
        "reached": [robot.rm_movej(q, 50, 0, 0, 5) for _ in range(3)],
        "refused": [robot.rm_movel([pose[0] + 3.0, *pose[1:]], 50, 0, 0, 5) for _ in range(3)],
    }


def signals(robot: Any, n: int) -> dict[str, Any]:
    """Sets ports of controller and tool, as the maker's example on them does, and reads them back."""
    return {
        "functions": [robot.rm_set_io_mode(port, mode) for port, mode in ((1, 2), (2, 3), (3, 4), (4, 5))],
        "start": robot.rm_get_io_state(1),
        "input set": robot.rm_set_do_state(1, 1),
        "speed": [robot.rm_set_io_mode(1, 14, 50, 1), robot.rm_get_io_state(1)],
        "output": [robot.rm_set_io_mode(2, 1), robot.rm_set_do_state(2, 1), robot.rm_get_io_output()],
        "inputs": robot.rm_get_io_input(),
        "voltage": [robot.rm_set_voltage(3, True), robot.rm_get_voltage()],
        "tool": [robot.rm_set_tool_IO_mode(1, 1), robot.rm_set_tool_do_state(1, 1), robot.rm_get_tool_io_state()],
        "tool voltage": [robot.rm_set_tool_voltage(3), robot.rm_get_tool_voltage()],
    }


def program(robot: Any, n: int) -> dict[str, Any]:
    """Records, sends and runs a program, as the maker's example on programs does."""
    from Robotic_Arm.rm_robot_interface import rm_send_project_t

    found: dict[str, Any] = {"dragged": [robot.rm_start_drag_teach(1)]}
    time.sleep(0.2)
    found["dragged"].append(robot.rm_stop_drag_teach())
    found["saved"] = robot.rm_save_trajectory("recorded.txt")
    q = [round(1000.0 * angle) for angle in robot.rm_get_joint_degree()[1][:n]]
    lines = [{"file": n}, {"name": "Folder", "num": 1, "type": 100, "enabled": True, "parent_number": 0}]
    lines += [{"point": [q[0] + 50 * k, *q[1:]]} for k in range(100)]
    with open("program.txt", "w", encoding="ascii") as file:
        file.writelines(json.dumps(line) + "\n" for line in lines)
    found["stored"] = robot.rm_send_project(rm_send_project_t("program.txt", 100, 1, 5, 0, 0, 0))
    found["sent"] = robot.rm_send_project(rm_send_project_t("program.txt", 50, 0, 6, 0, 0, 0))
    found["running"] = robot.rm_get_program_run_state()[1]["run_state"]
    found["paused"] = [robot.rm_set_arm_pause(), robot.rm_get_program_run_state()[1]["run_state"]]
    found["continued"] = robot.rm_set_arm_continue()
    while robot.rm_get_program_run_state()[1]["run_state"]:
        time.sleep(0.1)
    found["moved"] = robot.rm_get_joint_degree()[1][0] - q[0] / 1000.0
    found["listed"] = [entry["id"] for entry in robot.rm_get_program_trajectory_list(1, 10, "")[1]["trajectory_list"]]
    found["run by number"] = robot.rm_set_program_id_run(5, 0, 1)
    found["default"] = [robot.rm_set_default_run_program(5), robot.rm_get_default_run_program()]
    found["deleted"] = robot.rm_delete_program_trajectory(5)
    return found


def five(host: str, ports: list[int]) -> dict[str, Any]:
    """Drives several robots, and receives the states that one pushes."""
    from Robotic_Arm.rm_robot_interface import (
        RoboticArm,
        rm_realtime_arm_state_callback_ptr,
        rm_realtime_push_config_t,
        rm_thread_mode_e,
        rm_udp_custom_config_t,
    )

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        push_port = free.getsockname()[1]
    robots = [RoboticArm(rm_thread_mode_e.RM_TRIPLE_MODE_E), *(RoboticArm() for _ in ports[1:])]
    for robot, port in zip(robots, ports, strict=True):
        robot.rm_create_robot_arm(host, port, 3)
    found: dict[str, Any] = {
        "generations": [robot.rm_get_robot_info()[1]["robot_controller_version"] for robot in robots]
    }
    pushed: list[float] = []
    callback = rm_realtime_arm_state_callback_ptr(lambda state: pushed.append(state.joint_status.joint_position[0]))
    _KEPT.append(callback)
    robots[0].rm_realtime_arm_state_call_back(callback)
    robots[0].rm_set_realtime_push(rm_realtime_push_config_t(2, True, push_port, 0, host, rm_udp_custom_config_t()))
    start = [0, -20, -70, 0, -90, 0]
    found["moved"] = [robot.rm_movej([number, *start[1:]], 50, 0, 0, 1) for number, robot in enumerate(robots, 1)]
    found["joint 1"] = [robot.rm_get_joint_degree()[1][0] for robot in robots]
    found["offset"] = robots[-1].rm_movel_offset([0.0, 0.0, -0.02, 0.0, 0.0, 0.0], 50, 0, 0, 1, 1)
    time.sleep(0.5)
    found["pushed"] = len(pushed)
    robots[0].rm_set_realtime_push(rm_realtime_push_config_t(2, False, push_port, 0, host, rm_udp_custom_config_t()))
    for robot in robots:
        robot.rm_delete_robot_arm()
    return found


def main() -> None:
    """Runs a part in a thread mode: HOST PORT MODE PART, or HOST PORT,PORT,... MODE five."""
    from Robotic_Arm.rm_robot_interface import RoboticArm, rm_thread_mode_e

    host, mode, part = sys.argv[1], int(sys.argv[3]), sys.argv[4]
    if part == "five":
        print("FOUND", json.dumps(five(host, [int(port) for port in sys.argv[2].split(",")])), flush=True)
        return
    port = int(sys.argv[2])
    robot = RoboticArm(rm_thread_mode_e(mode))
    handle = robot.rm_create_robot_arm(host, port, 3)
    info = robot.rm_get_robot_info()[1]
    parts = {
        "joint_commands": joint_commands,
        "motions": motions,
        "ends_at_once": ends_at_once,
        "signals": signals,
        "program": program,
    }
    found = parts[part](robot, info["arm_dof"])
    robot.rm_delete_robot_arm()
    print("FOUND", json.dumps({"id": handle.id, "info": info, **found}, default=str), flush=True)


if __name__ == "__main__":
    main()
