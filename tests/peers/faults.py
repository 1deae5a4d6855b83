"""What a program does wrong: for each fault of a command, the commands that cause it and the cycle that must show it.

Paths are built from their second differences, so that the first value outside its bound is known exactly; each is
unfiltered, and kept off the bounds by more than rounding. Bounds are those of the manual, section 4.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from tests.peers import kinematics, wire
from tests.peers.kinematics import Matrix
from tests.peers.robot import Output, Robot
from tests.peers.wire import State

H = 0.001  # [s]
VELOCITY = (2.175, 2.175, 2.175, 2.175, 2.610, 2.610, 2.610)  # [rad/s]
ACCELERATION = (15.0, 7.5, 10.0, 10.0, 15.0, 15.0, 20.0)  # [rad/s^2]
JERK = (5000.0, 3500.0, 5000.0, 5000.0, 7500.0, 7500.0, 7500.0)  # [rad/s^3]
TOOL_VELOCITY, TOOL_ACCELERATION = 2.5, 10.0  # [rad/s], [rad/s^2] Rotation.
LIMIT_UP = tuple(math.radians(angle) for angle in (170, 120, 170, 120, 170, 120, 360))  # [rad]
THRESHOLDS = (75.0, 75.0, 60.0, 45.0, 30.0, 30.0, 20.0)  # [N m]
WORLD = (1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0)

JOINT_MODE = (wire.JOINT_POSITION, wire.JOINT)
CARTESIAN_MODE = (wire.CARTESIAN_POSITION, wire.CARTESIAN)
TORQUE_MODE = (wire.TORQUE, wire.IDLE)


class Wrong(NamedTuple):
    """Commands, one a cycle, and the number of the first that breaks a condition."""

    outputs: list[Output]
    at: int


class Case(NamedTuple):
    """One way to raise a fault by commands."""

    bit: int
    modes: tuple[int, int]
    build: Callable[[Robot, State], Wrong]
    alone: bool = True
    """Whether no other bit may be set with it."""


def _path(second: Sequence[float] | Matrix) -> Matrix:
    """Returns the path whose second differences are given, from rest at 0."""
    return np.cumsum(np.cumsum(second)) * H * H


def _first(values: Matrix, bound: float) -> int:
    return int(np.argmax(np.abs(values) > bound))


def _rise(slope: float, top: float, count: int) -> Matrix:
    """Second differences that rise by `slope` a cycle up to `top` and stay."""
    return np.minimum(slope * np.arange(count), top)


def _joint(state: State, joint: int, path: Matrix) -> list[Output]:
    rows = np.tile(state.q_c, (len(path), 1))
    rows[:, joint - 1] += path
    return [Output(q=tuple(row)) for row in rows.tolist()]


def _tool(state: State, place: Callable[[float], tuple[Matrix, Matrix]], path: Matrix) -> list[Output]:
    """Poses: the start, moved by an offset in the base and turned in tool axes."""
    T = kinematics.matrix(state.pos_c)
    outputs: list[Output] = []
    for value in path:
        offset, turn = place(float(value))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = T[:3, :3] @ kinematics.rotation(turn), T[:3, 3] + offset
        outputs.append(Output(pose=kinematics.numbers(pose)))
    return outputs


def _spin(value: float) -> tuple[Matrix, Matrix]:
    """About the tool's own axis: joint 7 alone, so that the tool's bounds are passed before any joint's."""
    return np.zeros(3), np.array([0.0, 0.0, value])


def _lift(value: float) -> tuple[Matrix, Matrix]:
    return np.array([0.0, 0.0, value]), np.zeros(3)


def soft_limit(robot: Robot, state: State) -> Wrong:
    path = _path(_rise(0.2, 2.03, 200))
    return Wrong(_joint(state, 1, path), _first(path, 0.01))


def joint_velocity(robot: Robot, state: State) -> Wrong:
    second = _rise(0.5, 5.03, 600)
    return Wrong(_joint(state, 1, _path(second)), _first(np.cumsum(second) * H, VELOCITY[0]))


def joint_acceleration(robot: Robot, state: State) -> Wrong:
    second = _rise(0.97, 50.0, 20)
    return Wrong(_joint(state, 4, _path(second)), _first(second, ACCELERATION[3]))


def joint_jerk(robot: Robot, state: State) -> Wrong:
    second = np.array([0.0] * 5 + [6.03] * 5)
    return Wrong(_joint(state, 1, _path(second)), 5)


def box(robot: Robot, state: State) -> Wrong:
    path = _path(_rise(0.05, 0.503, 400))
    return Wrong(_tool(state, _lift, path), _first(path, 0.02))


def box_by_joints(robot: Robot, state: State) -> Wrong:
    path = _path(_rise(0.2, 2.03, 300))
    outputs = _joint(state, 1, path)
    model = kinematics.Model(robot.load_robot_model())
    off = np.array([model.pose(output.q)[:3, 3] - state.pos_c[3:12:4] for output in outputs if output.q])
    return Wrong(outputs, _first(np.abs(off).max(axis=1), 0.02))


def elbow(robot: Robot, state: State) -> Wrong:
    pose, psi = state.pos_c, state.psi_c[0]
    return Wrong([Output(pose=pose, psi=psi + 1e-6)] * 5 + [Output(pose=pose, psi=psi + 0.3)] * 5, 5)


def tool_velocity(robot: Robot, state: State) -> Wrong:
    second = _rise(0.5, 5.03, 600)
    return Wrong(_tool(state, _spin, _path(second)), _first(np.cumsum(second) * H, TOOL_VELOCITY))


def tool_acceleration(robot: Robot, state: State) -> Wrong:
    second = _rise(0.97, 50.0, 20)
    return Wrong(_tool(state, _spin, _path(second)), _first(second, TOOL_ACCELERATION))


def no_rotation(robot: Robot, state: State) -> Wrong:
    stretched = list(state.pos_c)
    stretched[0] *= 1.01
    stretched[1] += 0.01
    return Wrong([Output(pose=state.pos_c)] * 5 + [Output(pose=tuple(stretched))], 5)


def no_number(robot: Robot, state: State) -> Wrong:
    return Wrong([Output(pose=state.pos_c)] * 5 + [Output(pose=(math.nan, *state.pos_c[1:]))], 5)


def torque_step(robot: Robot, state: State) -> Wrong:
    return Wrong([Output(tau=(0.0,) * 7)] * 5 + [Output(tau=(5.0, *(0.0,) * 6))] * 2, 5)


def torque_range(robot: Robot, state: State) -> Wrong:
    return Wrong([Output(tau=(0.0,) * 7)] * 5 + [Output(tau=(90.0, *(0.0,) * 6))], 5)


CASES: dict[str, Case] = {
    "a joint passes its soft limit": Case(7, JOINT_MODE, soft_limit),
    "the tool leaves the safety box": Case(8, CARTESIAN_MODE, box),
    "joints take the tool out of the safety box": Case(8, JOINT_MODE, box_by_joints),
    "the arm angle jumps": Case(9, CARTESIAN_MODE, elbow, alone=False),
    "a joint is too fast": Case(10, JOINT_MODE, joint_velocity),
    "the tool turns too fast": Case(11, CARTESIAN_MODE, tool_velocity),
    "a joint accelerates too much": Case(12, JOINT_MODE, joint_acceleration),
    "the tool accelerates too much": Case(13, CARTESIAN_MODE, tool_acceleration),
    "a joint's acceleration jumps": Case(14, JOINT_MODE, joint_jerk),
    "a pose is no pose": Case(16, CARTESIAN_MODE, no_rotation),
    "a pose is no number": Case(16, CARTESIAN_MODE, no_number),
    "a torque jumps": Case(17, TORQUE_MODE, torque_step),
    "a torque is too high": Case(18, TORQUE_MODE, torque_range, alone=False),
}


def set_the_scene(robot: Robot, state: State, bit: int) -> None:
    """Narrows the soft limit or the safety box around the arm where a fault is about them."""
    if bit in (0, 7):
        robot.set_joint_limit((state.q[0] + 0.01, *LIMIT_UP[1:]), [-limit for limit in LIMIT_UP])
    if bit in (1, 8):
        robot.set_cartesian_limit((0.04, 0.04, 0.04), _centred(state))


def clear_the_scene(robot: Robot) -> None:
    """Takes the widest limits again."""
    robot.set_joint_limit(LIMIT_UP, [-limit for limit in LIMIT_UP])
    robot.set_cartesian_limit((20.0, 20.0, 20.0), WORLD)
    robot.set_collision_behavior(THRESHOLDS)


def _centred(state: State) -> tuple[float, ...]:
    x, y, z = state.pos_c[3:12:4]
    return (1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z, 0.0, 0.0, 0.0, 1.0)


def differences(states: Sequence[State], field: str = "q_c") -> tuple[Any, Any]:
    """Returns second and third differences of joint angles over consecutive states, [rad/s^2] and [rad/s^3]."""
    rows = {state.message_id: getattr(state, field) for state in states}
    numbers = sorted(rows)
    assert numbers == list(range(numbers[0], numbers[-1] + 1)), "states are missing"
    q = np.array([rows[number] for number in numbers])
    return np.diff(q, 2, axis=0) / H**2, np.diff(q, 3, axis=0) / H**3
