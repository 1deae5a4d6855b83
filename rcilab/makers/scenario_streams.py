"""Streams of commands and pushes of which the scenarios of all makers are made.

Paths are built from their second differences, cycle by cycle, so that no other condition is violated first.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.makers.scenario import Callback, Scene
from rcilab.motion import plan_joint
from rcilab.sim.api import NetworkFaults

PAUSE = 20
"""[cycles] Standstill at the start, so that the plot shows it."""
LONGEST = 3000
"""[cycles] Within which a fault of the arm itself has to come."""

_STEP = 5  # [cycles] Interval at which a growing push is sent to the simulation.
_CUT = 40  # [cycles] After which the network is cut.
_NARROW = 0.05  # [rad] From the start of the last joint to the end of its narrower range.
_AWAY = 1.2  # [rad] Of joint 1, by which the tool is far from its start.
_FREE = 0.5  # [s] Of a motion until a blow.

Push: TypeAlias = Callable[[int], tuple[float, ...]]
"""Wrench on the tool by the cycle since the start of the push: force and moment, base axes, [N, N m]."""


def path(second: Array) -> Array:
    """Returns the path with these second differences, [unit/s^2], from standstill at 0."""
    return np.cumsum(np.cumsum(second)) * CYCLE_TIME**2


def rise(slope: float, top: float, count: int) -> Array:
    """Returns accelerations that are zero at first, rise by `slope` per cycle up to `top`, and stay there."""
    return np.minimum(slope * np.maximum(np.arange(count) - PAUSE, 0), top)


def joint_stream(start: Array, joint: int, displacement: Array) -> Callback:
    """Returns a callback that adds a displacement per cycle, [rad], to one joint, counted from 0, and then stops."""

    def callback(state: RobotState, t: float) -> JointPosition:
        cycle = round(t / CYCLE_TIME)
        q = np.array(start)
        q[joint] += displacement[min(cycle, len(displacement) - 1)]
        return JointPosition(readonly_copy(q), finished=cycle >= len(displacement))

    return callback


def tool_stream(
    start: Pose, offset: Callable[[float], tuple[Array, Array]], displacement: Array, psi: float
) -> Callback:
    """Returns a callback that moves and turns the tool: `offset` turns a displacement into a motion of it."""
    held = None if np.isnan(psi) else psi

    def callback(state: RobotState, t: float) -> CartesianPosition:
        cycle = round(t / CYCLE_TIME)
        shift, turn = offset(float(displacement[min(cycle, len(displacement) - 1)]))
        T = start.matrix
        T[:3, 3] += shift
        T[:3, :3] = T[:3, :3] @ _rotation(turn)
        return CartesianPosition(readonly_copy(T), psi=held, finished=cycle >= len(displacement))

    return callback


def torque_stream(n: int, joint: int, tau: Array) -> Callback:
    """Returns a callback that commands torques of one joint, counted from 0, [N m]."""

    def callback(state: RobotState, t: float) -> JointTorque:
        cycle = round(t / CYCLE_TIME)
        wanted = np.zeros(n)
        wanted[joint] = tau[min(cycle, len(tau) - 1)]
        return JointTorque(readonly_copy(wanted), finished=cycle >= len(tau))

    return callback


def spin(value: float) -> tuple[Array, Array]:
    """About the tool's own axis: the last joint alone, so that the tool's bounds are exceeded before any joint's."""
    return np.zeros(3), np.array([0.0, 0.0, value])


def planned(scene: Scene, goal: ArrayLike, speed: float) -> Callback:
    """Returns a callback that follows a correct plan to joint angles, shape (n,), [rad], at a share of the speed."""
    rows = plan_joint(scene.robot.model, scene.start.q_c, goal, speed=speed).q

    def callback(state: RobotState, t: float) -> JointPosition:
        cycle = round(t / CYCLE_TIME)
        return JointPosition(readonly_copy(rows[min(cycle, len(rows) - 1)]), finished=cycle >= len(rows))

    return callback


def turned(scene: Scene) -> JointVector:
    """Returns the start with joint 1 turned, so that the tool is far from its start."""
    q = np.array(scene.start.q_c)
    q[0] += _AWAY
    return readonly_copy(q)


def last_joint_narrowed(scene: Scene) -> Scene:
    """Returns the scene with a range of the last joint that ends next to its start, set by the maker's own request."""
    joint = scene.robot.model.limits.joint
    upper = np.array(joint.upper)
    upper[-1] = scene.start.q_c[-1] + _NARROW
    scene.commands.set_joint_ranges(joint.lower, upper)
    return scene.narrowed(readonly_copy(upper))


def over_the_end(scene: Scene) -> Callback:
    """Returns a callback that moves the last joint over the end of its range."""
    return joint_stream(scene.start.q_c, scene.robot.model.n - 1, path(rise(0.01, 0.2, 1200)))


def struck(scene: Scene, force: float, speed: float) -> Callback:
    """Returns a callback that turns joint 1 by a plan, during which a blow, [N], comes against the motion."""
    move = planned(scene, turned(scene), speed)
    pending = [(0.0, -force, 0.0, 0.0, 0.0, 0.0)]

    def callback(state: RobotState, t: float) -> Command:
        if pending and t > _FREE:
            scene.robot.simulation.push(pending.pop(), rise_time=0.0)
        return move(state, t)

    return callback


def held(scene: Scene, act: Callable[[int], None], *, tool: bool) -> Callback:
    """Returns a callback that commands standstill, and calls `act` with the cycle before each answer."""
    q, T, psi = scene.start.q_c, scene.start.T_base_tool_c, scene.start.psi_c
    angle = None if np.isnan(psi) else psi

    def callback(state: RobotState, t: float) -> JointPosition | CartesianPosition:
        cycle = round(t / CYCLE_TIME)
        act(cycle)
        finished = cycle >= LONGEST
        return CartesianPosition(T, psi=angle, finished=finished) if tool else JointPosition(q, finished=finished)

    return callback


def pushed(scene: Scene, push: Push, *, link: int | None = None, tool: bool) -> Callback:
    """Returns a callback that commands standstill while an external force grows."""

    def act(cycle: int) -> None:
        since = cycle - PAUSE
        if since >= 0 and since % _STEP == 0:
            scene.robot.simulation.push(push(since), link=link, rise_time=0.0)

    return held(scene, act, tool=tool)


def ramp_of(direction: tuple[float, ...], slope: float, top: float) -> Push:
    """A push that grows by `slope` a second up to `top` times `direction`."""
    return lambda since: tuple(min(since * CYCLE_TIME * slope, top) * part for part in direction)


def cut_off(scene: Scene) -> Callback:
    """Returns a callback that commands standstill and loses every command from a cycle on."""

    def act(cycle: int) -> None:
        if cycle == _CUT - 1:  # From now on lock-step waits only briefly for commands that may be lost.
            scene.robot.simulation.set_network(NetworkFaults(jitter=1e-6), "commands")
        elif cycle == _CUT:
            scene.robot.simulation.set_network(NetworkFaults(loss=1.0), "commands")

    return held(scene, act, tool=False)


def _rotation(turn: Array) -> Array:
    angle = float(np.linalg.norm(turn))
    if angle < 1e-12:
        return np.eye(3)
    half = turn / angle * np.sin(angle / 2.0)
    return Pose((0.0, 0.0, 0.0), (np.cos(angle / 2.0), *half)).rotation
