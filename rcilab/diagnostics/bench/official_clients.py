"""Programs that move a virtual arm there and back through the client library of its maker, without rcilab's session.

An xMate's library is for C++ only, so a session of rcilab drives it. This module, run with an address and a duration,
runs the program for the address and prints what it found as JSON.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import cycle
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ControlError
from rcilab.execution.connect import connect
from rcilab.motion.joint import plan_joint

_REACH = 0.5  # [rad] Of each joint, there and back; half of it where a program computes each command,
_PERIOD = 8.0  # [s] in this time.
_SPEED = 0.1  # Of the joints' own.
_RATE = 0.2  # [rad/s]
_REALMAN_PORT = 8080
_TRIPLE_THREADED = 2  # A thread for the states and another for the answers.


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What a program did."""

    motions: int
    """Motions, each to its end."""
    lost: int
    """Cycles of the streamed motions without a command of their own; a motion that the controller plans loses none."""


def drive_rci(address: str, seconds: float) -> Drive:
    """Streams joint angles at 1 kHz from a session of rcilab."""
    motions = lost = 0
    with connect(address) as robot:
        robot.power_on()
        end = time.monotonic() + seconds
        start = robot.state.q_c
        goals = cycle((start + _REACH, start))
        while time.monotonic() < end:
            run = robot.execute(plan_joint(robot.model, robot.state.q_c, next(goals), speed=_SPEED))
            motions, lost = motions + 1, lost + run.timing.lost
    return Drive(motions=motions, lost=lost)


def drive_fci(address: str, seconds: float) -> Drive:
    """Streams joint angles at 1 kHz with pylibfranka's active control."""
    import pylibfranka

    robot = pylibfranka.Robot(_host(address), pylibfranka.RealtimeConfig.kIgnore)
    motions = lost = 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        control = robot.start_joint_position_control(pylibfranka.ControllerMode.JointImpedance)
        state, _ = control.readOnce()
        start, t = np.array(state.q_d), 0.0
        while True:
            command = pylibfranka.JointPositions((start + _swing(t)).tolist())
            command.motion_finished = t >= _PERIOD
            control.writeOnce(command)
            if command.motion_finished:
                break
            _, passed = control.readOnce()
            cycles = round(passed.to_sec() / CYCLE_TIME)
            t, lost = min(t + cycles * CYCLE_TIME, _PERIOD), lost + cycles - 1
        motions += 1
    return Drive(motions=motions, lost=lost)


def drive_xarm(address: str, seconds: float) -> Drive:
    """Lets the controller plan motions to joint angles, with xarm-python-sdk."""
    from xarm.wrapper import XArmAPI

    arm = XArmAPI(_host(address), is_radian=True)
    require_success(arm.motion_enable(True), "motion_enable")
    require_success(arm.set_mode(0), "set_mode")
    require_success(arm.set_state(0), "set_state")
    start = np.array(arm.angles)[: arm.axis]

    def move(q: Any) -> int:
        return arm.set_servo_angle(angle=q.tolist(), speed=_RATE, wait=True)

    motions = _alternate(move, "set_servo_angle", start, seconds)
    arm.disconnect()
    return Drive(motions=motions, lost=0)


def drive_realman(address: str, seconds: float) -> Drive:
    """Lets the controller plan motions to joint angles, with the library Robotic_Arm."""
    from Robotic_Arm.rm_robot_interface import RoboticArm, rm_thread_mode_e

    arm = RoboticArm(rm_thread_mode_e(_TRIPLE_THREADED))
    arm.rm_create_robot_arm(_host(address), urlsplit(address).port or _REALMAN_PORT)
    code, degrees = arm.rm_get_joint_degree()
    require_success(code, "rm_get_joint_degree")

    def move(q: Any) -> int:
        return arm.rm_movej(np.degrees(q).tolist(), round(100 * _SPEED), 0, 0, 1)

    motions = _alternate(move, "rm_movej", np.radians(degrees), seconds)
    arm.rm_delete_robot_arm()
    return Drive(motions=motions, lost=0)


def require_success(code: int, call: str) -> None:
    """Raises a `ControlError` for a return code other than 0 of a library's call."""
    if code != 0:
        raise ControlError(f"{call} returned {code}")


def _host(address: str) -> str:
    return urlsplit(address).hostname or ""


def _swing(t: float) -> float:
    """Returns how far each joint is from its start at a time, [s], there and back in `_PERIOD`, [rad]."""
    return _REACH / 4.0 * (1.0 - math.cos(2.0 * math.pi * t / _PERIOD))


def _alternate(move: Callable[[Any], int], call: str, start: Any, seconds: float) -> int:
    """Moves to two places in turn until the time is over; returns the number of motions."""
    motions = 0
    end = time.monotonic() + seconds
    goals = cycle((start + _REACH, start))
    while time.monotonic() < end:
        require_success(move(next(goals)), call)
        motions += 1
    return motions


PROGRAMS = {"rci": drive_rci, "fci": drive_fci, "xarm": drive_xarm, "realman": drive_realman}
"""By the scheme of a controller's address."""


def main(arguments: list[str]) -> None:
    """Runs the program for an address; an error is one line with the time at which it came."""
    address, seconds = arguments[0], float(arguments[1])
    begin = time.monotonic()
    try:
        found = PROGRAMS[urlsplit(address).scheme](address, seconds)
    except Exception as error:
        print(f"after {time.monotonic() - begin:.1f} s: {type(error).__name__}: {error}".replace("\n", " "))
        sys.stdout.flush()
        os._exit(1)
    print(json.dumps(asdict(found)))
    sys.stdout.flush()
    os._exit(0)  # The libraries have threads of their own that do not end.


if __name__ == "__main__":
    main(sys.argv[1:])
