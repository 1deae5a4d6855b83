"""Wrong commands: each fault of a command, and the shortest stream of commands that violates its condition."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import radians

import numpy as np

from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.scenario import Callback, FaultScenario, Scene
from rcilab.makers.scenario_streams import PAUSE, joint_stream, path, rise, spin, tool_stream, torque_stream
from rcilab.model.robot_model import RobotModel


def posed(*angles: float) -> Callable[[RobotModel], JointVector]:
    """Returns the start of a scenario: seven joint angles, [rad], without the third one for a 6-axis arm."""
    return lambda model: readonly_copy(angles if model.n == 7 else np.delete(angles, 2))


lively_elbow = posed(*map(radians, (0.0, -28.6, 58.8, 56.4, -5.8, 113.8, 0.0)))
"""Position in which the elbow turns fastest for given joint velocities: the arm angle exceeds its bound first."""

_SOFT_LIMIT = 0.05  # [rad] From the position of the joint.
_HELD_LINK = 2
_HOLD = 0.8  # Largest holding force, as a part of the collision threshold.
_SENT_EVERY = 4  # [cycles] Interval at which it is sent to the simulation.
_HALF_BOX = 0.03  # [m]
_PAST = 1.006  # Factor on the bound: beyond it by more than rounding.


def soften_joint_1(scene: Scene) -> Scene:
    """Sets a soft limit of joint 1 next to its position."""
    upper = np.array(scene.limits.joint.upper)
    upper[0] = scene.start.q_c[0] + _SOFT_LIMIT
    scene.commands.set_joint_limit(scene.limits.joint.lower, upper)
    return scene.narrowed(upper)


def box_around_tool(scene: Scene) -> Scene:
    """Sets a small safety box around the tool."""
    edge = 2.0 * _HALF_BOX
    box = SafetyBox(size=(edge, edge, edge), T_base_box=Pose(scene.start.T_base_tool_c.position), active=True)
    scene.robot.set_safety_box(box)
    return replace(scene, box=box)


def _soft_limit(scene: Scene) -> Callback:
    return joint_stream(scene.start.q_c, 0, path(rise(1.0, 8.0, 400)))


def _box(scene: Scene) -> Callback:
    return tool_stream(scene.start.T_base_tool_c, _lift, path(rise(0.1, 1.5, 400)), scene.start.psi_c)


def _elbow(scene: Scene) -> Callback:
    displacement = path(rise(0.4, 20.0, 120))
    T, psi = scene.start.T_base_tool_c, scene.start.psi_c

    def callback(state: RobotState, t: float) -> CartesianPosition:
        cycle = round(t / CYCLE_TIME)
        return CartesianPosition(
            T, psi=psi + float(displacement[min(cycle, len(displacement) - 1)]), finished=cycle >= len(displacement)
        )

    return callback


def _joint_velocity(scene: Scene) -> Callback:
    return joint_stream(scene.start.q_c, 0, path(rise(1.2, 14.0, 400)))


def _tool_velocity(scene: Scene) -> Callback:
    return tool_stream(scene.start.T_base_tool_c, spin, path(rise(0.9, 9.5, 400)), scene.start.psi_c)


def _joint_acceleration(scene: Scene) -> Callback:
    elbow = scene.robot.model.n - 4  # Joint 4 of seven, joint 3 of six, from 0.
    bound = scene.limits.joint.acceleration[elbow]
    return joint_stream(scene.start.q_c, elbow, path(rise(0.97, 2.0 * bound, 80)))


def _tool_acceleration(scene: Scene) -> Callback:
    bound = scene.limits.cartesian.rotation_acceleration
    return tool_stream(scene.start.T_base_tool_c, spin, path(rise(0.97, 2.0 * bound, 80)), scene.start.psi_c)


def _joint_jerk(scene: Scene) -> Callback:
    step = _PAST * 1.2 * scene.limits.joint.jerk[0] * CYCLE_TIME
    return joint_stream(scene.start.q_c, 0, path(np.where(np.arange(60) < PAUSE, 0.0, step)))


def _singular(scene: Scene) -> Callback:
    """Moves the tool straight away from the shoulder, so slowly that no joint is too fast before the arm is stretched.

    Cartesian motions cannot go through a stretched arm, whatever their speed.
    """
    T, arm = scene.start.T_base_tool_c, scene.robot.model.description.dh
    flange = T @ scene.robot.model.T_flange_tool.inverse()
    wrist = flange.position - arm[-1].d * flange.rotation[:, 2]
    outwards = wrist - np.array([0.0, 0.0, arm[0].d])
    outwards /= np.linalg.norm(outwards)
    displacement = np.cumsum(np.minimum(np.maximum(np.arange(3000) - PAUSE, 0) * 1e-8, 1.5e-6))
    return tool_stream(T, lambda value: (outwards * value, np.zeros(3)), displacement, scene.start.psi_c)


def _torque_rate(scene: Scene) -> Callback:
    step = _PAST * 2.0 * scene.limits.joint.torque_rate[0] * CYCLE_TIME
    return torque_stream(scene.robot.model.n, 0, np.where(np.arange(40) < PAUSE, 0.0, step))


def _torque_range(scene: Scene) -> Callback:
    """A force holds link 2 meanwhile: without it the link would be too fast before the bound is exceeded."""
    limits, robot = scene.limits.joint, scene.robot
    tau = 0.95 * limits.torque_rate[1] * CYCLE_TIME * np.maximum(np.arange(200) - PAUSE, 0)
    axis = robot.model.rigid_body.link_jacobian(scene.start.q, _HELD_LINK, np.zeros(3))[3:, 1]
    stream = torque_stream(robot.model.n, 1, tau)
    strongest = _HOLD * limits.collision_threshold[1]

    def callback(state: RobotState, t: float) -> Command:
        cycle = round(t / CYCLE_TIME)
        if cycle % _SENT_EVERY == 0 and tau[cycle] <= strongest:
            robot.simulation.push((0.0, 0.0, 0.0, *(-tau[cycle] * axis).tolist()), link=_HELD_LINK, rise_time=0.0)
        return stream(state, t)

    return callback


def _lift(value: float) -> tuple[Array, Array]:
    return np.array([0.0, 0.0, value]), np.zeros(3)


COMMAND_SCENARIOS = (
    FaultScenario(
        fault=Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION, group="position", mode="joint_position",
        prepare=soften_joint_1, act=_soft_limit, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION, group="position", mode="cartesian_position",
        prepare=box_around_tool, act=_box, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION, group="position",
        mode="cartesian_position", act=_elbow, is_commanded=True, needs_elbow=True,
        start=lively_elbow,
    ),
    FaultScenario(
        fault=Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, group="velocity", mode="joint_position",
        act=_joint_velocity, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION, group="velocity", mode="cartesian_position",
        act=_tool_velocity, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION, group="acceleration", mode="joint_position",
        act=_joint_acceleration, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION, group="acceleration", mode="cartesian_position",
        act=_tool_acceleration, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY, group="acceleration", mode="joint_position",
        act=_joint_jerk, is_commanded=True,
    ),
    FaultScenario(
        fault=Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME, group="command", mode="cartesian_position",
        act=_singular, is_commanded=True, start=posed(0.1, 0.5, 0.0, 0.05, 0.0, 1.0, 0.0),
    ),
    FaultScenario(
        fault=Fault.COMMAND_TORQUE_DISCONTINUITY, group="command", mode="torque", act=_torque_rate,
    ),
    FaultScenario(
        fault=Fault.COMMAND_TORQUE_RANGE_VIOLATION, group="command", mode="torque", act=_torque_range,
    ),
)  # fmt: skip
"""Every fault of a command."""
