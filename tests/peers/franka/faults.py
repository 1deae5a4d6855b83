"""What a program does wrong: for each error of a command, the commands that raise it and the first that does.

Paths are built from their second differences, so that the first value outside its bound is known exactly; they stay off
all other bounds. Bounds are those of the maker's page for the Panda (version 5) and of its client for the FR3 (10).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from rcilab.core.spatial import Pose, rotation_from_rpy
from rcilab.model.robot_model import RobotModel, load_model
from tests.peers.franka import wire
from tests.peers.franka.arena import MODELS
from tests.peers.franka.robot import Output
from tests.peers.franka.wire import State

H = 0.001  # [s]
Rows: TypeAlias = np.ndarray


class Bounds(NamedTuple):
    """Those of one version; joints from 0."""

    velocity: float
    """Of joint 1, [rad/s]."""
    acceleration: float
    """Of joint 4, [rad/s^2]; its jerk is 500 times that, as every joint's."""
    upper: float
    """End of the range of joint 7, [rad]."""
    turn: tuple[float, float, float]
    """Velocity, acceleration and jerk of the tool's rotation, [rad/s, ...]."""
    last: float
    """Acceleration of joint 7, [rad/s^2]."""
    elbow: tuple[float, float, float]
    """Velocity, acceleration and jerk of the elbow, [rad/s, ...]."""
    elbow_end: float
    """End of its range, [rad]."""


BOUNDS = {
    5: Bounds(2.175, 12.5, 2.8973, (2.5, 25.0, 12500.0), 20.0, (2.175, 10.0, 5000.0), 2.8973),
    10: Bounds(2.62, 10.0, 3.0196, (2.5, 17.0, 8500.0), 10.0, (1.5, 10.0, 5000.0), 2.9065),
}


class Wrong(NamedTuple):
    """Commands, one a cycle, and the number of the first that is wrong."""

    outputs: list[Output]
    at: int
    rows: Rows | None = None
    """The joint angles that these commands stand for, where one joint moves, shape (N, 7), [rad]."""


class Case(NamedTuple):
    """One way to raise errors by commands."""

    errors: str | dict[int, str]
    """Numbers of all errors that are set, in both versions or by version; with "..." others may be."""
    generator: int
    build: Callable[[State], Wrong]
    q: tuple[float, ...] | None = None
    """Where the arm is placed before; None: at its home pose."""
    controller: int = wire.JOINT_IMPEDANCE


def _path(second: Sequence[float] | Rows) -> Rows:
    """Returns the path whose second differences are given, from rest at 0."""
    return np.cumsum(np.cumsum(second)) * H * H


def _rise(slope: float, top: float, count: int) -> Rows:
    """Second differences that rise by `slope` a cycle up to `top` and stay."""
    return np.minimum(slope * np.arange(count), top)


def _first(values: Rows, bound: float) -> int:
    return int(np.argmax(np.abs(values) > bound))


def _rows(start: State, joint: int, path: Rows) -> Rows:
    rows = np.tile(start.q_d, (len(path), 1))
    rows[:, joint] += path
    return rows


def _joints(start: State, joint: int, path: Rows) -> list[Output]:
    return [Output(q=tuple(row)) for row in _rows(start, joint, path).tolist()]


def _rates(joint: int, path: Rows) -> list[Output]:
    rows = np.zeros((len(path), 7))
    rows[:, joint] = np.diff(path, prepend=0.0) / H
    return [Output(dq=tuple(row)) for row in rows.tolist()]


def model_of(state: State) -> RobotModel:
    return load_model(MODELS[state.version])


def columns(T: Rows) -> tuple[float, ...]:
    return tuple(T.T.ravel().tolist())


def _poses(start: State, joint: int, path: Rows) -> list[Output]:
    """Poses of an arm of which one joint moves, with its elbow."""
    model, found = model_of(start), []
    for value in path.tolist():
        q = list(start.q_d)
        q[joint] += value
        found.append(Output(pose=columns(model.forward(q).matrix), elbow=(q[2], start.elbow_c[1])))
    return found


def _twists(start: State, joint: int, path: Rows) -> list[Output]:
    """The same as velocities: a turn about the joint's axis."""
    q = np.array(start.q_d)
    model = model_of(start)
    rates, found = np.diff(path, prepend=0.0) / H, []
    for value, rate in zip(path.tolist(), rates.tolist(), strict=True):
        q[joint] = start.q_d[joint] + value
        unit = np.zeros(7)
        unit[joint] = rate
        twist = model.jacobian(q) @ unit
        found.append(Output(twist=tuple(twist.tolist()), elbow=start.elbow_c))
    return found


def _bounds(start: State) -> Bounds:
    return BOUNDS[start.version]


def _steady(start: State, cycles: int = 5) -> list[Output]:
    return [Output(q=start.q_d, pose=start.O_T_EE_c, elbow=start.elbow_c, dq=(0.0,) * 7, twist=(0.0,) * 6)] * cycles


# Paths of a joint, or of the tool's turn about the axis of joint 7.


def _too_fast(bound: float) -> tuple[Rows, int]:
    second = _rise(0.5, 8.03, 600)
    return _path(second), _first(np.cumsum(second) * H, bound)


def _too_strong(bound: float) -> tuple[Rows, int]:
    second = _rise(0.97, 60.0, 40)
    return _path(second), _first(second, bound)


def _jump(size: float) -> tuple[Rows, int]:
    """An acceleration that jumps by `size` after 5 cycles."""
    return _path(np.array([0.0] * 5 + [size] * 5)), 5


def _turn_too_strong(bounds: Bounds) -> tuple[Rows, int]:
    """An acceleration that passes the tool's bound in one step from below that of joint 7, within the tool's jerk."""
    below = 0.97 * bounds.last
    second = np.concatenate((_rise(below / 4.0, below, 6), [1.01 * bounds.turn[1]] * 3))
    return _path(second), 6


# Commands that are wrong.


def joint_start(start: State) -> Wrong:
    return Wrong(_joints(start, 2, np.full(5, 0.01)), 0)


def _over_the_end(start: State) -> Rows:
    """A path of joint 7 out of its range; an FR3 may only creep there."""
    return _path(_rise(1e-4, 0.02, 1200) if start.version == 10 else _rise(0.01, 0.2, 1200))


def joint_range(start: State) -> Wrong:
    path = _over_the_end(start)
    return Wrong(_joints(start, 6, path), _first(path, _bounds(start).upper - start.q_d[6]), _rows(start, 6, path))


def joint_beyond_its_range(start: State) -> Wrong:
    return Wrong([*_steady(start), *_joints(start, 6, np.full(3, 0.1))], 5)


def joint_velocity(start: State) -> Wrong:
    path, at = _too_fast(_bounds(start).velocity)
    return Wrong(_joints(start, 0, path), at, _rows(start, 0, path))


def joint_acceleration(start: State) -> Wrong:
    path, at = _too_strong(_bounds(start).acceleration)
    return Wrong(_joints(start, 3, path), at, _rows(start, 3, path))


def joint_jerk(start: State) -> Wrong:
    path, at = _jump(0.55 * _bounds(start).acceleration)
    return Wrong(_joints(start, 3, path), at, _rows(start, 3, path))


def rate_range(start: State) -> Wrong:
    wrong = joint_range(start)
    return Wrong(_rates(6, _over_the_end(start)), wrong.at)


def rate_velocity(start: State) -> Wrong:
    path, at = _too_fast(_bounds(start).velocity)
    return Wrong(_rates(0, path), at)


def rate_acceleration(start: State) -> Wrong:
    path, at = _too_strong(_bounds(start).acceleration)
    return Wrong(_rates(3, path), at)


def rate_jerk(start: State) -> Wrong:
    path, at = _jump(0.55 * _bounds(start).acceleration)
    return Wrong(_rates(3, path), at)


def no_angles(start: State) -> Wrong:
    return Wrong([*_steady(start), Output(q=(math.nan, *start.q_d[1:]))], 5)


def pose_start(start: State) -> Wrong:
    pose = start.O_T_EE_c
    return Wrong([Output(pose=(*pose[:12], pose[12] + 0.001, *pose[13:]))] * 3, 0)


def turned_start(start: State) -> Wrong:
    T = np.reshape(start.O_T_EE_c, (4, 4)).T.copy()
    T[:3, :3] = T[:3, :3] @ np.reshape(rotation_from_rpy(0.0, 0.0, 0.01), (3, 3))
    return Wrong([Output(pose=columns(T))] * 3, 0)


def turn_velocity(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    def build(start: State) -> Wrong:
        path, at = _too_fast(_bounds(start).turn[0])
        return Wrong(make(start, 6, path), at, _rows(start, 6, path))

    return build


def turn_acceleration(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    def build(start: State) -> Wrong:
        path, at = _turn_too_strong(_bounds(start))
        return Wrong(make(start, 6, path), at, _rows(start, 6, path))

    return build


def turn_jerk(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    def build(start: State) -> Wrong:
        path, at = _jump(1.02 * H * _bounds(start).turn[2])
        return Wrong(make(start, 6, path), at, _rows(start, 6, path))

    return build


def inverse_range(start: State) -> Wrong:
    path = _over_the_end(start)
    return Wrong(_poses(start, 6, path), _first(path, _bounds(start).upper - start.q_d[6]), _rows(start, 6, path))


def inverse_velocity(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    """Joint 1 alone turns the whole arm, faster than it may but not than the tool may."""

    def build(start: State) -> Wrong:
        path, at = _too_fast(_bounds(start).velocity)
        if start.version == 10:  # Near the end of its range, where it may be slower than the tool.
            second = _rise(0.5, 8.03, 600)
            q, dq = start.q_d[0] + _path(second), np.cumsum(second) * H
            before = np.concatenate(([start.q_d[0]], q[:-1]))
            at = _first(dq - (-0.30 + np.sqrt(2.0 * 6.0 * np.maximum(2.7501 - before, 0.0)) - 100.0), 100.0)
        return Wrong(make(start, 0, path), at, _rows(start, 0, path))

    return build


def inverse_acceleration(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    def build(start: State) -> Wrong:
        path, at = _too_strong(_bounds(start).acceleration)
        return Wrong(make(start, 3, path), at, _rows(start, 3, path))

    return build


def inverse_jerk(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    def build(start: State) -> Wrong:
        path, at = _jump(0.55 * _bounds(start).acceleration)
        return Wrong(make(start, 3, path), at, _rows(start, 3, path))

    return build


def elbow_too_fast(make: Callable[[State, int, Rows], list[Output]]) -> Callable[[State], Wrong]:
    def build(start: State) -> Wrong:
        path, at = _too_fast(_bounds(start).elbow[0])
        return Wrong(make(start, 2, path), at)

    return build


def elbow_too_strong(start: State) -> Wrong:
    path, at = _too_strong(_bounds(start).elbow[1])
    return Wrong(_poses(start, 2, path), at)


def elbow_jerk(start: State) -> Wrong:
    path, at = _jump(1.03 * H * _bounds(start).elbow[2])
    return Wrong(_poses(start, 2, path), at)


def elbow_range(start: State) -> Wrong:
    path = _path(_rise(0.01, 0.2, 1200))
    at = _first(path, _bounds(start).elbow_end - start.q_d[2]) if start.version == 5 else -1
    return Wrong(_poses(start, 2, path), at)  # An FR3 is too fast before it is at the end.


def elbow_jump(start: State) -> Wrong:
    jumped = (start.elbow_c[0] + 0.3, start.elbow_c[1])
    return Wrong([*_steady(start), Output(pose=start.O_T_EE_c, elbow=jumped, twist=(0.0,) * 6)], 5)


def elbow_side(start: State) -> Wrong:
    flipped = (start.elbow_c[0], -start.elbow_c[1])
    return Wrong([*_steady(start), Output(pose=start.O_T_EE_c, elbow=flipped, twist=(0.0,) * 6)], 5)


def elbow_side_at_the_start(start: State) -> Wrong:
    return Wrong(elbow_side(start).outputs[5:], 0)


def elbow_of_no_side(start: State) -> Wrong:
    return Wrong([Output(pose=start.O_T_EE_c, elbow=(start.elbow_c[0], 0.5), twist=(0.0,) * 6)], 0)


def elbow_of_side_zero(start: State) -> Wrong:
    return Wrong([Output(pose=start.O_T_EE_c, elbow=(start.elbow_c[0], 0.0), twist=(0.0,) * 6)], 0)


def elbow_start(start: State) -> Wrong:
    off = (start.elbow_c[0] + 0.01, start.elbow_c[1])
    return Wrong([Output(pose=start.O_T_EE_c, elbow=off, twist=(0.0,) * 6)] * 3, 0)


def elbow_no_number(start: State) -> Wrong:
    return Wrong([*_steady(start), Output(pose=start.O_T_EE_c, elbow=(math.nan, -1.0), twist=(0.0,) * 6)], 5)


def stretched_arm(start: State) -> Wrong:
    """Poses of an arm that stretches to the angle at which its elbow flips, where it is singular."""
    path = _path(_rise(0.005, 0.1, 1500))
    return Wrong(_poses(start, 3, path), -1)


def stretched_pose(start: State) -> Wrong:
    pose = start.O_T_EE_c
    return Wrong([*_steady(start), Output(pose=(1.01 * pose[0], *pose[1:]))], 5)


def mirrored_pose(start: State) -> Wrong:
    pose = start.O_T_EE_c
    return Wrong([*_steady(start), Output(pose=(-pose[0], -pose[1], -pose[2], *pose[3:]))], 5)


def pose_no_number(start: State) -> Wrong:
    return Wrong([*_steady(start), Output(pose=(math.nan, *start.O_T_EE_c[1:]))], 5)


def pose_out_of_reach(start: State) -> Wrong:
    T = Pose([0.0, 0.0, 3.0]).matrix
    return Wrong([*_steady(start), Output(pose=columns(T))], 5)


def twist_no_number(start: State) -> Wrong:
    return Wrong([*_steady(start), Output(twist=(math.nan,) * 6)], 5)


def torque_jump(start: State) -> Wrong:
    quiet = Output(tau=(0.0,) * 7, dq=(0.0,) * 7)
    return Wrong([quiet] * 5 + [quiet._replace(tau=(0.0,) * 6 + (1.01,))] * 3, 5)


def torque_no_number(start: State) -> Wrong:
    quiet = Output(tau=(0.0,) * 7, dq=(0.0,) * 7)
    return Wrong([quiet] * 5 + [quiet._replace(tau=(math.inf,) + (0.0,) * 6)], 5)


def torque_to_the_end(start: State) -> Wrong:
    """A torque that takes joint 7 over the end of its range, slowly."""
    tau = tuple(min(0.01 * k, 1.5) for k in range(3000))
    return Wrong([Output(tau=(0.0,) * 6 + (t,), dq=(0.0,) * 7) for t in tau], -1)


def torque_too_fast(start: State) -> Wrong:
    tau = tuple(min(0.5 * k, 11.0) for k in range(600))
    return Wrong([Output(tau=(0.0,) * 6 + (t,), dq=(0.0,) * 7) for t in tau], -1)


Q, DQ, POSE, TWIST = wire.JOINT_POSITION, wire.JOINT_VELOCITY, wire.CARTESIAN_POSE, wire.CARTESIAN_VELOCITY
TORQUE = -1  # NONE in version 10, joint velocities of zero in version 5.
_NEAR_END = {5: 2.85, 10: 3.0196 - 1e-6}


def near_end(version: int) -> tuple[float, ...]:
    """Returns a pose from which joint 7 soon reaches the end of its range."""
    return (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, _NEAR_END[version])


TURNED = (1.9, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
NEAR_ELBOW_END = (0.0, -0.785, 2.87, -2.356, 0.0, 1.571, 0.785)
NEAR_FLIP = (0.0, -0.3, 0.2, -0.55, 0.1, 1.5, 0.785)
END = (-1.0,)
"""Stands for `near_end`."""

CASES: dict[str, Case] = {
    "angles that begin off the arm": Case("11", Q, joint_start),
    "an angle over the end of its range": Case({5: "12", 10: "0 ..."}, Q, joint_range, END),
    "an angle beyond its range": Case({5: "12 ...", 10: "0 ..."}, Q, joint_beyond_its_range, END),
    "an angle that is no number": Case({5: "12 ...", 10: "0 ..."}, Q, no_angles),
    "a joint too fast": Case("13", Q, joint_velocity),
    "a joint accelerated too much": Case("14", Q, joint_acceleration),
    "a joint whose acceleration jumps": Case("15", Q, joint_jerk),
    "velocities over the end of the range": Case({5: "12", 10: "0 ..."}, DQ, rate_range, END),
    "velocities too high": Case("13", DQ, rate_velocity),
    "velocities that jump": Case("14", DQ, rate_acceleration),
    "velocities whose change jumps": Case("15", DQ, rate_jerk),
    "a pose that begins off the arm": Case("16", POSE, pose_start),
    "a pose that begins turned": Case("16", POSE, turned_start),
    "an elbow too fast": Case({5: "17 28", 10: "17"}, POSE, elbow_too_fast(_poses)),
    "an elbow accelerated too much": Case("17 29", POSE, elbow_too_strong),
    "an elbow whose acceleration jumps": Case("17 30", POSE, elbow_jerk),
    "an elbow over the end of its range": Case({5: "17 27 ...", 10: "28 ..."}, POSE, elbow_range, NEAR_ELBOW_END),
    "an elbow that jumps": Case("17 28 29 30", POSE, elbow_jump),
    "an elbow that jumps, with velocities": Case("17 28 29 30", TWIST, elbow_jump),
    "an elbow that is no number": Case("17", POSE, elbow_no_number),
    "a tool too fast": Case("18", POSE, turn_velocity(_poses)),
    "a tool accelerated too much": Case({5: "19 29", 10: "19 29 30"}, POSE, turn_acceleration(_poses)),
    "a tool whose acceleration jumps": Case("20 30", POSE, turn_jerk(_poses)),
    "a twist too high": Case("18", TWIST, turn_velocity(_twists)),
    "a twist that jumps": Case({5: "19 29", 10: "19 29 30"}, TWIST, turn_acceleration(_twists)),
    "a twist whose change jumps": Case("20 30", TWIST, turn_jerk(_twists)),
    "an elbow of the other side": Case("21", POSE, elbow_side),
    "an elbow of the other side at the start": Case("21", POSE, elbow_side_at_the_start),
    "an elbow of the other side, with velocities": Case("21", TWIST, elbow_side),
    "an elbow of no side": Case("21", POSE, elbow_of_no_side),
    "an elbow of side zero": Case("21", POSE, elbow_of_side_zero),
    "an elbow of side zero, with velocities": Case("21", TWIST, elbow_of_side_zero),
    "poses that stretch the arm": Case("31", POSE, stretched_arm, NEAR_FLIP),
    "an elbow that begins off the arm": Case("22", POSE, elbow_start),
    "poses that need an angle over the end of its range": Case({5: "27", 10: "0 ..."}, POSE, inverse_range, END),
    "poses that need a joint too fast": Case("28", POSE, inverse_velocity(_poses), TURNED),
    "poses that accelerate a joint too much": Case("29", POSE, inverse_acceleration(_poses)),
    "poses that make a joint's acceleration jump": Case("30", POSE, inverse_jerk(_poses)),
    "twists that need a joint too fast": Case("28", TWIST, inverse_velocity(_twists), TURNED),
    "twists that accelerate a joint too much": Case("29", TWIST, inverse_acceleration(_twists)),
    "twists that make a joint's acceleration jump": Case("30", TWIST, inverse_jerk(_twists)),
    "a pose that is stretched": Case("31", POSE, stretched_pose),
    "a pose that is mirrored": Case("31", POSE, mirrored_pose),
    "a pose that is no number": Case("31", POSE, pose_no_number),
    "a pose out of reach": Case("18 19 20", POSE, pose_out_of_reach),
    "a twist that is no number": Case("18", TWIST, twist_no_number),
    "a torque that jumps": Case("32", TORQUE, torque_jump, controller=wire.EXTERNAL),
    "a torque that is no number": Case("32", TORQUE, torque_no_number, controller=wire.EXTERNAL),
    "torques that drive a joint over its range": Case("0", TORQUE, torque_to_the_end, END, wire.EXTERNAL),
    "torques that make a joint too fast": Case("3", TORQUE, torque_too_fast, controller=wire.EXTERNAL),
}
