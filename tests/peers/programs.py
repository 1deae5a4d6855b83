"""Programs as people write them against the vendor's library: blocking moves, then a motion of their own in each mode.

Each program leaves the arm at rest after a motion that ended by itself. `seconds` is how long the motion proper runs,
a whole number of periods; the swings are those of the vendor's examples, `amplitude * (1 - cos(2 pi t / period))`, with
velocity 0 at both ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from tests.peers import kinematics, s_profile, wire
from tests.peers.kinematics import Matrix
from tests.peers.robot import (
    CARTESIAN_SPACE,
    DRAG_FREE,
    DRAG_ROTATION,
    DRAG_TRANSLATION,
    JOINT_SPACE,
    Callback,
    Output,
    Robot,
)
from tests.peers.wire import State

CYCLE = 0.001  # [s]
DRAGS = {
    "in joint space": (JOINT_SPACE, DRAG_FREE),
    "translation": (CARTESIAN_SPACE, DRAG_TRANSLATION),
    "rotation": (CARTESIAN_SPACE, DRAG_ROTATION),
    "free": (CARTESIAN_SPACE, DRAG_FREE),
}
START = {  # Where the examples begin, [rad].
    7: (0.0, math.pi / 6, 0.0, math.pi / 3, 0.0, math.pi / 2, 0.0),
    6: (0.0, math.pi / 6, math.pi / 3, 0.0, math.pi / 2, 0.0),
}
LEFT = {  # A little aside, so that the first move is not empty, [rad].
    7: (0.1, math.pi / 6 + 0.05, -0.1, math.pi / 3 - 0.1, 0.1, math.pi / 2 - 0.1, 0.2),
    6: (0.1, math.pi / 6 + 0.05, math.pi / 3 - 0.1, 0.1, math.pi / 2 - 0.1, 0.2),
}


def prepare(robot: Robot, goal: Sequence[float] | None = None, factor: float = 0.5) -> None:
    """What every example begins with: power on, one state, MOVEJ."""
    robot.set_motor_power(1)
    state = robot.receive_robot_state()
    move_j(robot, factor, state.q[: robot.axes], LEFT[robot.axes] if goal is None else goal)


def move_j(robot: Robot, factor: float, start: Sequence[float], goal: Sequence[float]) -> None:
    """MOVEJ: the joint generator from the given start; the first command is the profile at 1 ms."""
    generator = s_profile.JointGenerator(factor, start, goal)
    robot.start_move(wire.JOINT_POSITION, wire.JOINT)

    def callback(state: State, t: float) -> Output:
        return Output(q=generator.at(t), finished=t > generator.duration)

    robot.control(timed(callback, first=CYCLE))


def move_l(robot: Robot, factor: float, start: State, goal: Sequence[float], psi: float) -> None:
    """MOVEL: position linear, orientation on the great circle, arm angle linear, all in the same proportion."""
    a, b = kinematics.matrix(start.pos_m), kinematics.matrix(goal)
    axis = s_profile.path(factor, float(np.linalg.norm(b[:3, 3] - a[:3, 3])))
    psi_start = start.psi_m[0]
    robot.start_move(wire.CARTESIAN_POSITION, wire.CARTESIAN)

    def callback(state: State, t: float) -> Output:
        share = axis.at(t) / axis.distance
        pose = _at(a[:3, 3] + share * (b[:3, 3] - a[:3, 3]), kinematics.slerp(start.pos_m, goal, share))
        return Output(pose=pose, psi=psi_start + share * (psi - psi_start), finished=t > axis.duration)

    robot.control(timed(callback, first=CYCLE))


def timed(callback: Callable[[State, float], Output], first: float = 0.0) -> Callback:
    """Returns a callback that keeps a clock of its own, one cycle a call, as the examples do."""
    t = first - CYCLE

    def ticking(state: State) -> Output:
        nonlocal t
        t += CYCLE
        return callback(state, t)

    return ticking


def swing(amplitude: float, period: float, t: float) -> float:
    """Returns where a swing is at a time, [s]."""
    return amplitude * (1.0 - math.cos(2.0 * math.pi * t / period))


def joint_sine(
    robot: Robot, seconds: float, *, mode: int = wire.JOINT_POSITION, amplitude: float = 0.1, period: float = 2.5
) -> None:
    """Every joint swings."""
    robot.start_move(mode, wire.JOINT)
    init: list[float] = []

    def callback(state: State, t: float) -> Output:
        if not init:
            init.extend(state.q[: robot.axes])
        delta = swing(amplitude, period, t)
        return Output(q=tuple(q + delta for q in init), finished=t >= seconds - CYCLE / 2)

    robot.control(timed(callback))


def joint_impedance(robot: Robot, seconds: float, *, stiffness: float = 0.5, period: float = 2.5) -> None:
    """The same with springs instead of servos; `stiffness` is a share of the largest."""
    largest = (3000.0,) * (4 if robot.axes == 7 else 3) + (300.0,) * 3
    robot.set_joint_impedance([stiffness * value for value in largest])
    joint_sine(robot, seconds, mode=wire.JOINT_IMPEDANCE, amplitude=0.05, period=period)


def cartesian(
    robot: Robot,
    seconds: float,
    offset: Callable[[float], tuple[float, float, float]],
    *,
    mode: int = wire.CARTESIAN_POSITION,
    psi: Callable[[float], float] | None = None,
    turn: Callable[[float], tuple[float, float, float]] | None = None,
) -> None:
    """The tool moves by an offset, [m], about an axis of its own, [rad], and with an arm angle, all functions of time.

    Without `psi` the arm angle is left to the controller.
    """
    robot.start_move(mode, wire.CARTESIAN)
    init: list[State] = []

    def callback(state: State, t: float) -> Output:
        if not init:
            init.append(state)
        T = kinematics.matrix(init[0].pos_m)
        R = T[:3, :3] if turn is None else T[:3, :3] @ kinematics.rotation(np.array(turn(t)))
        angle = 0.0 if psi is None else init[0].psi_m[0] + psi(t)
        return Output(pose=_at(T[:3, 3] + offset(t), R), psi=angle, finished=t >= seconds - CYCLE / 2)

    robot.control(timed(callback))


def line(robot: Robot, seconds: float, *, mode: int = wire.CARTESIAN_POSITION, period: float = 2.5) -> None:
    """Down and up along base z."""
    cartesian(robot, seconds, lambda t: (0.0, 0.0, -swing(0.05, period, t)), mode=mode)


def circle(robot: Robot, seconds: float, *, radius: float = 0.05, period: float = 2.5) -> None:
    """Round and round in the base's y-z plane; the angle itself swings, so that the speed starts and ends at 0."""

    def offset(t: float) -> tuple[float, float, float]:
        angle = swing(math.pi / 4, period, t)
        return 0.0, radius * math.sin(angle), radius * (math.cos(angle) - 1.0)

    cartesian(robot, seconds, offset)


def tool_rotation(robot: Robot, seconds: float, *, period: float = 2.5) -> None:
    """The tool turns about its own x axis, on the spot."""
    cartesian(robot, seconds, lambda t: (0.0, 0.0, 0.0), turn=lambda t: (swing(0.1, period, t), 0.0, 0.0))


def nullspace(robot: Robot, seconds: float, *, period: float = 2.5) -> None:
    """The tool stands still while the elbow swings."""
    cartesian(robot, seconds, lambda t: (0.0, 0.0, 0.0), psi=lambda t: swing(0.1, period, t))


def cartesian_impedance(robot: Robot, seconds: float, *, period: float = 2.5) -> None:
    """Down and up on springs."""
    robot.set_cartesian_impedance((1500.0,) * 3 + (150.0,) * 3)
    line(robot, seconds, mode=wire.CARTESIAN_IMPEDANCE, period=period)


def torque(robot: Robot, seconds: float, *, depth: float = 0.02, period: float = 2.5) -> kinematics.Model:
    """Torques from a spring and a damper between the tool and a place that moves: J^T (K error - D velocity)."""
    model = kinematics.Model(robot.load_robot_model())
    # Soft enough for a command that acts 10 ms late: a rate of 10 to 20 per second in every direction, the last of
    # which has an inertia of 0.002 kg m^2 only.
    stiffness = np.array((150.0, 150.0, 150.0, 3.0, 3.0, 0.2))
    damping = np.array((20.0, 20.0, 20.0, 0.4, 0.4, 0.02))
    joint_damping = np.array((0.5, 0.5, 0.2, 0.2, 0.05, 0.05, 0.005))
    robot.start_move(wire.TORQUE, wire.IDLE)
    init: list[Matrix] = []

    def callback(state: State, t: float) -> Output:
        T, J = kinematics.matrix(state.pos_m), model.jacobian(state.q)
        if not init:
            init.append(T)
        goal = init[0][:3, 3] + (0.0, 0.0, -swing(depth / 2.0, period, t))
        error = np.concatenate((goal - T[:3, 3], kinematics.rotation_vector(init[0][:3, :3] @ T[:3, :3].T)))
        tau = J.T @ (stiffness * error - damping * (J @ state.dq_m)) - joint_damping * state.dq_m
        return Output(tau=tuple(tau.tolist()), finished=t >= seconds - CYCLE / 2)

    robot.control(timed(callback))
    return model


def drag(robot: Robot, states: int) -> list[State]:
    """Sets a tool, opens dragging in all directions for a number of states, closes it; returns those states."""
    robot.set_coor((1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.1, 0, 0, 0, 1))
    robot.receive_fresh_state()
    robot.start_drag(CARTESIAN_SPACE, DRAG_FREE)
    seen = [robot.receive_fresh_state() for _ in range(states)]
    robot.stop_drag()
    return seen


def led_by_hand(
    robot: Robot, seconds: float, space: int, kind: int, push: Callable[[list[float]], None]
) -> list[State]:
    """Opens dragging and leads the arm: a hand pulls to and fro, turns the tool, and lets go; returns the states."""
    robot.start_drag(space, kind)
    seen: list[State] = []
    for sign in (1.0, -1.0, 0.0):
        push([0.0, 15.0 * sign, 5.0 * sign, 0.0, 0.0, 2.0 * sign])
        seen += [robot.receive_fresh_state() for _ in range(round(seconds / 3.0 / CYCLE))]
    robot.stop_drag()
    return seen


def _at(position: Matrix, R: Matrix) -> tuple[float, ...]:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position
    return kinematics.numbers(T)
