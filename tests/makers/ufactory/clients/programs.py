"""What users of xarm-python-sdk do, through its calls: what its official examples do, in less time.

Run as `python -m tests.makers.ufactory.clients.programs NAME HOST ...`; the result is the last line, as JSON.
"""

from __future__ import annotations

import json
import math
import sys
import time
from inspect import signature
from typing import Any

from xarm.wrapper import XArmAPI

Q6 = [0.2, -0.5, -0.8, 0.1, 1.1, 0.3]
OTHERS = (
    "get_initial_point", "get_mount_direction", "get_trajectories",  # Of UFACTORY Studio, at a port of its own.
    "get_bio_gripper_g2_position",  # The library decodes the answer of a gripper that is not there.
)  # fmt: skip
DOWN = [-180.0, 0.0, 0.0]
SERVO_PERIOD = 0.004  # [s]


def connect(host: str, **options: Any) -> Any:
    """Returns a connected arm; another controller's Unix-domain socket would be preferred to the address."""
    return XArmAPI(host, forbid_uds=True, **options)


def ready(arm: Any, mode: int = 0) -> list[int]:
    """Returns the codes of the usual first calls."""
    arm.clean_error()
    arm.clean_warn()
    codes = [arm.motion_enable(True), arm.set_mode(mode), arm.set_state(0)]
    wait(lambda: arm.mode == mode and arm.state in (1, 2) and arm.error_code == 0)  # As reported, later.
    return codes


def wait(condition: Any, seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def stand(arm: Any) -> None:
    """Waits until the state is not that of a motion."""
    wait(lambda: arm.get_state()[1] != 1)


def properties(host: str) -> object:
    arm = connect(host, is_radian=True)
    wait(lambda: arm.get_servo_angle()[0] == 0)
    codes = {
        name: getattr(arm, name)()[0]
        for name in (
            "get_version", "get_robot_sn", "get_state", "get_cmdnum", "get_err_warn_code", "get_position",
            "get_position_aa", "get_servo_angle", "get_joint_states", "get_joints_torque", "get_reduced_mode",
            "get_reduced_states", "get_report_tau_or_i", "get_hd_types", "get_cgpio_digital", "get_cgpio_analog",
            "get_cgpio_state", "get_tgpio_digital", "get_tgpio_analog", "get_servo_debug_msg",
            "get_allow_approx_motion",
        )
    }  # fmt: skip
    angles = arm.angles[:6]
    _, pose = arm.get_forward_kinematics(angles)
    _, back = arm.get_inverse_kinematics(pose)
    return {
        "codes": codes,
        "version": list(arm.version_number),
        "axes": [arm.axis, arm.device_type],
        "serial": arm.sn,
        "angles": angles,
        "pose": pose,
        "position": arm.position,
        "back": back[:6],
        "limits": [*arm.tcp_speed_limit, *arm.joint_speed_limit, *arm.joint_acc_limit],
        "volts": arm.voltages[0],
        "warm": arm.temperatures[0],
    }


def getters(host: str) -> object:
    """Returns what every getter without arguments raised, by its name, and the number of getters."""
    arm = connect(host)
    wait(lambda: arm.get_servo_angle()[0] == 0)
    raised, names = {}, []
    for name in dir(type(arm)):
        if not name.startswith("get_") or name in OTHERS:
            continue
        required = [
            x for x in list(signature(getattr(type(arm), name)).parameters.values())[1:]
            if x.default is x.empty and x.kind is not x.VAR_KEYWORD
        ]  # fmt: skip
        if not required:
            names.append(name)
            try:
                getattr(arm, name)()
            except Exception as error:
                raised[name] = repr(error)
    return {"raised": raised, "count": len(names)}


def joints(host: str) -> object:
    arm = connect(host, is_radian=True)
    codes = ready(arm)
    codes.append(arm.set_servo_angle(angle=[0.5, *Q6[1:]], speed=2.0, wait=True))
    codes.append(arm.set_servo_angle(servo_id=2, angle=-0.6, speed=2.0, wait=True))
    for radius in (60, 60, None):
        codes.append(arm.set_servo_angle(angle=[angle + 0.02 * len(codes) for angle in Q6], speed=2.0, radius=radius))
    codes.append(arm.set_pause_time(0.1))
    codes.append(arm.set_servo_angle(angle=[0.1] * 6, relative=True, speed=2.0, wait=True))
    codes.append(arm.set_servo_angle(servo_id=1, angle=-0.1, relative=True, speed=2.0, wait=True))
    codes.append(arm.set_servo_angle(servo_id=1, angle=0.1, relative=True, speed=2.0, wait=True))
    last = list(arm.get_servo_angle()[1][:6])
    codes.append(arm.move_gohome(speed=3.0, wait=True))
    return {"codes": codes, "last": last, "home": arm.get_servo_angle()[1][:6]}


def lines(host: str) -> object:
    arm = connect(host)
    codes = ready(arm)
    codes.append(arm.move_gohome(speed=100, wait=True))
    codes.append(arm.set_position(300, 0, 150, *DOWN, speed=300, wait=True))
    codes.append(arm.set_position(300, 100, 250, *DOWN, speed=300))
    codes.append(arm.set_position(z=200, wait=True))
    corner = arm.get_position()[1]
    codes.append(arm.set_position(y=-50, relative=True, speed=300, wait=True))
    codes.append(arm.set_tool_position(z=-30, speed=300, wait=True))
    codes.append(arm.set_position_aa([0, 0, 0, 0, 20, 0], relative=True, speed=100, wait=True))
    codes.append(arm.set_position_aa([0, 0, 0, 0, -20, 0], is_tool_coord=False, relative=True, speed=100, wait=True))
    end = arm.get_position()[1]
    paths = [[300, 0, 200, *DOWN, 30], [400, 0, 200, *DOWN, 30], [400, 100, 200, *DOWN, 30], [300, 50, 200, *DOWN, 30]]
    codes.append(arm.move_arc_lines(paths, speed=300, wait=True) or 0)
    codes.append(arm.set_position(300, 0, 200, *DOWN, speed=300, wait=True))
    start = arm.get_position()[1]
    circle = [340, 40, 200, *DOWN], [380, 0, 200, *DOWN]
    codes.append(arm.move_circle(*circle, percent=100, speed=300, wait=True))
    return {"codes": codes, "corner": corner, "end": end, "start": start, "around": arm.get_position()[1]}


def velocities(host: str) -> object:
    arm = connect(host, is_radian=True)
    codes = ready(arm, 4)
    codes.append(arm.vc_set_joint_velocity([0.3, 0, 0, 0, 0, 0.3], duration=0.3))
    time.sleep(0.2)
    speeds = list(arm.realtime_joint_speeds)
    stand(arm)
    codes.append(arm.vc_set_joint_velocity([-0.3, 0, 0, 0, 0, -0.3]))
    time.sleep(0.3)
    codes.append(arm.vc_set_joint_velocity([0] * 6))
    stand(arm)
    codes += ready(arm, 5)
    before = arm.get_position()[1]
    codes.append(arm.vc_set_cartesian_velocity([0, 0, -50, 0, 0, 0], duration=0.5))
    stand(arm)
    moved = [b - a for a, b in zip(before, arm.get_position()[1], strict=True)]
    return {"codes": codes, "speeds": speeds, "moved": moved}


def online(host: str) -> object:
    arm = connect(host, is_radian=True)
    codes = ready(arm, 6)
    for k in range(5):
        codes.append(arm.set_servo_angle(angle=[0.2 + 0.4 * (-1) ** k, *Q6[1:]], speed=1.0, wait=False))
        time.sleep(0.15)
    stand(arm)
    joint = arm.get_servo_angle()[1][0]
    codes += ready(arm, 7)
    x, y, z, *rpy = arm.get_position()[1]
    for side in (60, -60, 20):
        codes.append(arm.set_position(x, y + side, z, *rpy, speed=200, wait=False))
        time.sleep(0.15)
    stand(arm)
    return {"codes": codes, "joint": joint, "off": arm.get_position()[1][1] - y}


def servo(host: str) -> object:
    arm = connect(host, is_radian=True)
    codes = ready(arm, 1)
    start = arm.get_servo_angle()[1][:6]
    for k in range(150):
        codes.append(arm.set_servo_angle_j([start[0] + 0.001 * k, *start[1:]]))
        time.sleep(0.004)
    stand(arm)
    turned = arm.get_servo_angle()[1][0] - start[0]
    x, y, z, *rpy = arm.get_position()[1]
    for k in range(50):
        codes.append(arm.set_servo_cartesian([x, y, z - 0.5 * k, *rpy]))
        time.sleep(0.005)
    for _ in range(20):
        codes.append(arm.set_servo_cartesian_aa([0, 0.5, 0, 0, 0, 0], is_tool_coord=False, relative=True))
        time.sleep(0.005)
    stand(arm)
    after = arm.get_position()[1]
    return {"codes": sorted(set(codes)), "turned": turned, "moved": [after[1] - y, after[2] - z]}


def swing(host: str, seconds: str) -> object:
    """Streams a swing of every joint at 250 Hz, while reports come at their own rate."""
    arm = connect(host, is_radian=True)
    codes, sent, reports = set(ready(arm, 1)), 0, 0
    start = arm.get_servo_angle()[1][:6]

    def count(_: object) -> None:
        nonlocal reports
        reports += 1

    arm.register_report_callback(count)
    begin = time.monotonic()
    while (now := time.monotonic() - begin) < float(seconds):
        delta = 0.1 * (1.0 - math.cos(math.pi * now))
        codes.add(arm.set_servo_angle_j([angle + delta for angle in start]))
        sent += 1
        time.sleep(max(0.0, begin + sent * SERVO_PERIOD - time.monotonic()))
    codes.add(arm.set_servo_angle_j(start))
    stand(arm)
    end = arm.get_servo_angle()[1][:6]
    return {"codes": sorted(codes), "sent": sent, "reports": reports, "start": start, "end": end}


def reports(host: str, kind: str) -> object:
    arm = connect(host, is_radian=True, report_type=kind)
    seen: dict[str, list[Any]] = {"report": [], "state": [], "mode": [], "cmdnum": []}
    arm.register_report_callback(lambda item: seen["report"].append(time.monotonic()))
    arm.register_state_changed_callback(lambda item: seen["state"].append(item["state"]))
    arm.register_mode_changed_callback(lambda item: seen["mode"].append(item["mode"]))
    ready(arm)
    arm.set_servo_angle(angle=[0.4, *Q6[1:]], speed=1.0)
    time.sleep(1.2)
    times = seen["report"]
    return {
        "rate": (len(times) - 1) / (times[-1] - times[0]),
        "states": seen["state"],
        "angle": arm.angles[0],
        "asked": arm.get_servo_angle()[1][0],
    }


def feedback(host: str) -> object:
    arm = connect(host, is_radian=True)
    ready(arm)
    seen: list[list[int]] = []
    arm.register_feedback_callback(lambda data: seen.append([data[8], data[9], data[12]]))
    codes = [arm.set_feedback_type(7)]
    codes.append(arm.set_servo_angle(angle=[0.4, *Q6[1:]], speed=2.0))
    codes.append(arm.set_cgpio_digital(0, 1))
    codes.append(arm.set_servo_angle(angle=Q6, speed=2.0))
    wait(lambda: len(seen) >= 5)
    codes.append(arm.set_servo_angle(angle=[0.6, *Q6[1:]], speed=1.0))
    time.sleep(0.2)
    codes.append(arm.set_state(4))
    wait(lambda: len(seen) >= 7)
    return {"codes": codes, "seen": seen}


def modbus(host: str) -> object:
    arm = connect(host)
    results = [
        arm.write_single_coil_bit(0, 1),
        arm.read_coil_bits(0, 3),
        arm.write_multiple_coil_bits(1, [1, 1]),
        arm.read_coil_bits(0, 3),
        arm.read_input_bits(0, 3),
        arm.write_single_holding_register(0x100, 5),
        arm.write_multiple_holding_registers(0x101, [6, 7]),
        arm.read_holding_registers(0x100, 3),
        arm.mask_write_holding_register(0x100, 0x0F0F, 0x0030),
        arm.write_and_read_holding_registers(0x100, 2, 0x102, [9]),
        arm.read_holding_registers(0x102, 1),
        arm.read_input_registers(0x20, 2),
        arm.read_holding_registers(0x200, 1)[0],
    ]
    angles = arm.read_input_registers(0x59, 6, is_signed=True)[1]
    return {"results": results, "angles": angles, "true": arm.get_servo_angle()[1][:6]}


def signals(host: str) -> object:
    arm = connect(host)
    codes = ready(arm)
    codes += [arm.set_cgpio_digital(2, 1), arm.set_cgpio_digital(9, 1), arm.set_cgpio_analog(0, 2.5)]
    codes += [arm.set_tgpio_digital(0, 1), arm.set_cgpio_digital(3, 1, delay_sec=0.1)]
    time.sleep(0.3)
    digital, analog, tool = arm.get_cgpio_digital()[1], arm.get_cgpio_analog()[1], arm.get_tgpio_digital()[1]
    codes += [arm.set_gripper_mode(0), arm.set_gripper_enable(True), arm.set_gripper_speed(5000)]
    codes.append(arm.set_gripper_position(400, wait=True))
    return {
        "codes": codes,
        "digital": digital,
        "analog": analog,
        "tool": tool[:2],
        "gripper": arm.get_gripper_position(),
        "gripper_version": arm.get_gripper_version()[1],
    }


def safety(host: str) -> object:
    arm = connect(host)
    codes = ready(arm)
    x, y, z = arm.get_position()[1][:3]
    codes.append(arm.set_reduced_tcp_boundary([x + 50, x - 50, y + 20, y - 50, z + 50, z - 50]))
    codes += arm.set_fence_mode(True)  # This one returns a list.
    refused = arm.set_position(y=y + 60, speed=200, wait=True)
    error = arm.get_err_warn_code()[1][0]
    codes += ready(arm)
    codes += arm.set_fence_mode(False)
    codes.append(arm.set_position(y=y, speed=200, wait=True))
    codes.append(arm.set_collision_sensitivity(4))
    codes.append(arm.set_tcp_load(0.5, [0, 0, 30], wait=True))
    codes.append(arm.set_state(0))
    codes.append(arm.set_tcp_offset([0, 0, 100, 0, 0, 0]))
    codes.append(arm.set_state(0))
    wait(lambda: arm.tcp_offset[2] == 100.0 and arm.tcp_load[0] == 0.5)
    seen = [arm.collision_sensitivity, arm.tcp_load, arm.tcp_offset]
    codes.append(arm.set_tcp_offset([0, 0, 0, 0, 0, 0]))
    codes.append(arm.set_tcp_load(0, [0, 0, 0]))
    return {"codes": codes, "refused": refused, "error": error, "seen": seen}


def stops(host: str) -> object:
    arm = connect(host, is_radian=True)
    codes = ready(arm)
    codes.append(arm.set_servo_angle(angle=[1.2, *Q6[1:]], speed=0.5))
    time.sleep(0.4)
    codes.append(arm.set_state(3))
    time.sleep(0.3)
    paused = arm.get_servo_angle()[1][0]
    time.sleep(0.2)
    still = arm.get_servo_angle()[1][0]
    codes.append(arm.set_state(0))
    time.sleep(0.3)
    codes.append(arm.set_state(6))
    wait(lambda: arm.get_state()[1] == 4)
    not_ready = arm.set_servo_angle(angle=Q6, speed=1.0)
    codes.append(arm.set_state(0))
    codes.append(arm.set_servo_angle(angle=[-1.2, *Q6[1:]], speed=0.5))
    time.sleep(0.3)
    arm.emergency_stop()
    state = arm.state
    codes += ready(arm)
    unreachable = arm.set_position(1500, 0, 300, math.pi, 0, 0, speed=200, wait=True)
    error = arm.get_err_warn_code()[1][0]
    return {
        "codes": codes, "paused": paused, "still": still, "not_ready": not_ready, "state": state,
        "unreachable": unreachable, "error": error, "cleaned": [arm.clean_error(), arm.get_err_warn_code()[1][0]],
    }  # fmt: skip


def two_clients(host: str) -> object:
    first, second = connect(host, is_radian=True), connect(host, is_radian=True, report_type="real")
    codes = ready(first)
    codes.append(first.set_servo_angle(angle=[0.5, *Q6[1:]], speed=1.0, wait=False))
    wait(lambda: second.state == 1)
    codes.append(second.set_state(3))
    wait(lambda: first.state == 3)
    codes.append(second.set_state(0))
    wait(lambda: first.state == 2 and abs(first.angles[0] - 0.5) < 1e-3)
    first.disconnect()
    again = connect(host, is_radian=True)
    wait(lambda: abs(again.angles[0] - 0.5) < 1e-3)
    codes.append(again.set_servo_angle(angle=Q6, speed=2.0, wait=True))
    wait(lambda: abs(second.angles[0] - Q6[0]) < 1e-3)
    return {"codes": codes, "connected": [first.connected, second.connected, again.connected]}


def by_unix_socket(host: str) -> object:
    arm: Any = XArmAPI(host, is_radian=True)
    ready(arm)
    return [arm.set_servo_angle(angle=[0.1] * 6, speed=3.0, wait=True), arm.get_servo_angle()[1][:6], arm.mode == 0]


if __name__ == "__main__":
    _, name, *arguments = sys.argv
    result = globals()[name](*arguments)
    print(json.dumps(result), flush=True)
